//! Errors of a fit.

/// Reason of a failed fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Fewer observations than unknowns, at the start or after the rejection of outliers.
    #[error(
        "{have} observations (of {given} given) cannot fix {need} unknowns; touch in more places"
    )]
    TooFewObservations {
        /// number of kept observations
        have: usize,
        /// number of given observations
        given: usize,
        /// number of needed observations
        need: usize,
    },
    /// All observations share their error.
    #[error("all observations are of one pass, whose errors are shared; touch again elsewhere")]
    OneGroup,
    /// NaN or infinite.
    #[error("observation {index} is not finite; drop it")]
    NotFinite {
        /// number of the observation
        index: usize,
    },
    /// A standard deviation that is not positive and finite.
    #[error("{what} is {sigma} (SI units); it must be finite and above 0")]
    BadSigma {
        /// quantity
        what: &'static str,
        /// its standard deviation
        sigma: f64,
    },
    /// A needed freedom is not determined by the observations.
    #[error(
        "the observations do not fix the {what}; touch where it makes a difference, or give a known axis"
    )]
    Undetermined {
        /// the freedom
        what: &'static str,
    },
    /// The iteration did not converge.
    #[error(
        "the fit did not converge in {iterations} iterations; is the first guess near the surface?"
    )]
    NotConverged {
        /// number of iterations
        iterations: usize,
    },
    /// A size outside the range of the surface.
    #[error(
        "the {what} came out as {value} (SI units); is the surface hollow where it should be solid?"
    )]
    BadSize {
        /// the size
        what: &'static str,
        /// its value, m or rad
        value: f64,
    },
}
