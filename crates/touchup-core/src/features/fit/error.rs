//! Why a fit is refused.

/// What makes a fit impossible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Fewer observations than unknowns, at the start or after outliers were rejected.
    #[error(
        "{have} observations (of {given} given) cannot fix {need} unknowns; touch in more places"
    )]
    TooFewObservations {
        /// how many are kept
        have: usize,
        /// how many were given
        given: usize,
        /// how many are needed
        need: usize,
    },
    /// All observations share their error.
    #[error("all observations are of one pass, whose errors are shared; touch again elsewhere")]
    OneGroup,
    /// NaN or infinite.
    #[error("observation {index} is not finite; drop it")]
    NotFinite {
        /// which one
        index: usize,
    },
    /// A standard deviation that is not positive and finite.
    #[error("{what} is {sigma} (SI units); it must be finite and above 0")]
    BadSigma {
        /// whose
        what: &'static str,
        /// what it is
        sigma: f64,
    },
    /// The observations do not fix a number without which the surface is none.
    #[error(
        "the observations do not fix the {what}; touch where it makes a difference, or give a known axis"
    )]
    Undetermined {
        /// which number
        what: &'static str,
    },
    /// The iteration did not converge.
    #[error(
        "the fit did not converge in {iterations} iterations; is the first guess near the surface?"
    )]
    NotConverged {
        /// how many were made
        iterations: usize,
    },
    /// A size that no surface has.
    #[error(
        "the {what} came out as {value} (SI units); is the surface hollow where it should be solid?"
    )]
    BadSize {
        /// which size
        what: &'static str,
        /// its value, m or rad
        value: f64,
    },
}
