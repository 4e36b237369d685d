//! Reasons why features determine no motion, or more than one.

use super::FreeTurn;
use super::alternative::Alternative;
use touchup_method::names;

names! {
    /// One of the two shapes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum FeaturesSide {
        /// the shape to move: the mesh
        Source = "mesh",
        /// the fixed shape: the true part
        Target = "truth",
    }
}

/// Reason why there is no single motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FeaturesError {
    /// One side has no features.
    #[error("no features were found on the {side}: {OTHER_METHODS}")]
    NoFeatures {
        /// the side without features
        side: FeaturesSide,
    },
    /// The features leave a turn or a shift open.
    #[error(
        "the {found} features of the {side} leave a turn or a shift open; two holes or slots, one and a plane beside it, or a \
         corner of three planes would fix it: touch one more, or {OTHER_METHODS}"
    )]
    TooFew {
        /// the side with too few features
        side: FeaturesSide,
        /// number of its features
        found: usize,
    },
    /// No motion matches enough features.
    #[error(
        "no motion brings the mesh onto the truth: the best explains {explained} of {of} features{}: are both the same part \
         and in the same unit? If so, {OTHER_METHODS}",
        agreeing.map_or_else(String::new, |share| format!(" and {:.0} % of the surface", share * 100.0))
    )]
    NoMatch {
        /// matched features of the mesh
        explained: usize,
        /// all features of the mesh
        of: usize,
        /// agreeing share of the surface of the mesh
        agreeing: Option<f64>,
    },
    /// The mesh fits a mirror image.
    #[error(
        "the mesh fits a mirror image of the truth ({mirrored} of {of} features) and no motion of it ({explained}): the sign \
         of one axis of a file is wrong, or it is the part's left-handed twin"
    )]
    Mirrored {
        /// features explained by the best motion
        explained: usize,
        /// features explained by the best mirror image
        mirrored: usize,
        /// all features of the mesh
        of: usize,
    },
    /// A part of revolution: a continuum of motions.
    #[error(
        "the part is free to turn about the axis ({:.3}, {:.3}, {:.3}) through ({:.2}, {:.2}, {:.2}) mm: neither its features \
         nor its surface fix the turn; {OTHER_METHODS}",
        .turn.axis.x, .turn.axis.y, .turn.axis.z,
        .turn.through.x * 1e3, .turn.through.y * 1e3, .turn.through.z * 1e3
    )]
    FreeTurn {
        /// the free turn
        turn: FreeTurn,
        /// one motion for each orientation of one axis on the other, the best first, each with one
        /// arbitrary turn
        alternatives: Vec<Alternative>,
    },
    /// Several motions are about as good: a symmetric part, or too small a scanned part of it.
    #[error("{} motions explain the mesh about equally well: the part is symmetric, or what distinguishes them was not scanned", .alternatives.len())]
    Ambiguous {
        /// all of them, the best first
        alternatives: Vec<Alternative>,
    },
}

const OTHER_METHODS: &str = "pick pairs of points (pairs), or bring it roughly into place (icp)";
