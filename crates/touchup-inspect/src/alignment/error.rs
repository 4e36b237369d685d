//! Errors of the alignment between drawing and part.

use touchup_features::align::{DatumFitError, FeaturesError};

/// Error and remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// The drawing states no feature place.
    #[error(
        "the drawing says of no feature where it is: fill in center_x_mm, center_y_mm, center_z_mm and axis_x, axis_y, axis_z"
    )]
    NoPlaces,
    /// The drawing lacks this datum.
    #[error("--align: the drawing has no characteristic {name:?} for a datum: it has {known}")]
    NoSuchDatum {
        /// name as given
        name: String,
        /// available names
        known: String,
    },
    /// Unusable datum, or no usable feature at all.
    #[error("--align: datum {name:?} cannot be used: {why}")]
    BadDatum {
        /// name as given
        name: String,
        /// cause and remedy
        why: String,
    },
    /// The features do not determine the pose of the drawing on the part.
    #[error("--align: {}", in_words(.0))]
    NotFound(FeaturesError),
    /// The named features fit in several ways, or in none.
    #[error("--align: the features that the drawing names by their ids fit it in {} way: {}",
        if *.count == 0 { "no" } else { "more than one" },
        if *.count == 0 { "check the ids, and nominal places and axes" } else { "name one more, which breaks the symmetry" })]
    Named {
        /// number of ways
        count: usize,
    },
    /// The features leave degrees of freedom open.
    #[error(
        "--align: {error} by {used}: give axis_x, axis_y, axis_z of nominal features, touch more features that the drawing has, or name \
         another datum"
    )]
    Open {
        /// open freedoms
        error: DatumFitError,
        /// features in use
        used: String,
    },
    /// A feature stays far off its nominal place.
    #[error(
        "--align: {name} is {residual_mm:.3} mm off its nominal place after the alignment, more than {limit_mm} mm (--match-mm): check the \
         drawing and which feature it is, name it in the column feature, or align by datums"
    )]
    Residual {
        /// name in the drawing
        name: String,
        /// residual across the axis; for a plane along its normal
        residual_mm: f64,
        /// allowed residual
        limit_mm: f64,
    },
}

fn in_words(error: &FeaturesError) -> String {
    const BY_NUMBER: &str = "name features by their ids in the column feature";
    match error {
        FeaturesError::NoFeatures { .. } => {
            "there are no features on one side: touch some that the drawing has".to_owned()
        }
        FeaturesError::TooFew { found, .. } => format!(
            "{found} features leave a turn or a shift open: the drawing needs centres and axes (axis_x, axis_y, axis_z) of two holes, slots \
             or bosses and of a plane at least; touch more, or {BY_NUMBER}"
        ),
        FeaturesError::NoMatch { explained, of, .. } => format!(
            "no motion brings the measured features onto the drawing: the best explains {explained} of {of}; check that both are the same \
             part in one unit, or {BY_NUMBER}"
        ),
        FeaturesError::Mirrored {
            explained,
            mirrored,
            of,
        } => format!(
            "the measured features fit a mirror image of the drawing ({mirrored} of {of}) and no motion of it ({explained}): the sign of one \
             axis of the drawing is wrong, or it is the part's left-handed twin"
        ),
        FeaturesError::FreeTurn { turn, .. } => {
            let axis = turn.axis;
            format!(
                "the part is free to turn about ({:.3} {:.3} {:.3}): touch a feature off that axis, or {BY_NUMBER}",
                axis.x, axis.y, axis.z
            )
        }
        FeaturesError::Ambiguous { alternatives } => format!(
            "{} motions bring the features onto the drawing equally well: the pattern is symmetric; touch a feature that breaks it, or \
             {BY_NUMBER}",
            alternatives.len()
        ),
    }
}
