//! Why drawing and part are not brought into one frame.

use crate::align::{DatumFitError, FeaturesError};

/// What is wrong, and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// The drawing has nothing to align by.
    #[error(
        "the drawing says of no feature where it is: fill in center_x_mm, center_y_mm, center_z_mm and axis_x, axis_y, axis_z"
    )]
    NoPlaces,
    /// A datum that the drawing does not have.
    #[error("--align: the drawing has no characteristic {name:?} for a datum: it has {known}")]
    NoSuchDatum {
        /// as it was given
        name: String,
        /// what there is
        known: String,
    },
    /// A datum, or all features, that cannot be used.
    #[error("--align: datum {name:?} cannot be used: {why}")]
    BadDatum {
        /// as it was given
        name: String,
        /// and what to do
        why: String,
    },
    /// The features do not say how the drawing lies on the part.
    #[error("--align: {}", in_words(.0))]
    NotFound(FeaturesError),
    /// Named features that fit in several ways, or in none.
    #[error("--align: the features that the drawing names by their ids fit it in {} way: {}",
        if *.count == 0 { "no" } else { "more than one" },
        if *.count == 0 { "check the ids, and nominal places and axes" } else { "name one more, which breaks the symmetry" })]
    Named {
        /// how many ways were found
        count: usize,
    },
    /// They leave freedoms open.
    #[error(
        "--align: {error} by {used}: give axis_x, axis_y, axis_z of nominal features, touch more features that the drawing has, or name \
         another datum"
    )]
    Open {
        /// which
        error: DatumFitError,
        /// the features that were used
        used: String,
    },
    /// A feature is far off after all.
    #[error(
        "--align: {name} is {residual_mm:.3} mm off its nominal place after the alignment, more than {limit_mm} mm (--match-mm): check the \
         drawing and which feature it is, name it in the column feature, or align by datums"
    )]
    Residual {
        /// of the feature in the drawing
        name: String,
        /// across its axis, of a plane along its normal
        residual_mm: f64,
        /// what is allowed
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
