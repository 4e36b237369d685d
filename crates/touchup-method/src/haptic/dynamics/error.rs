//! Errors of the face dynamics.

/// Error of [`super::FaceDynamics`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// A parameter outside its range.
    #[error("{name} is {value}, but must be {range}", range = range_of(name))]
    BadParameter {
        /// name in the scene and in `touchup step`
        name: &'static str,
        /// given value
        value: f64,
    },
    /// NaN or infinite input, or a result beyond the largest number.
    #[error("{what} is not finite; check the units of the input")]
    NotFinite {
        /// name of the quantity
        what: &'static str,
    },
    /// The face has no usable normal.
    #[error("the normal has length {length}, but must have length 1")]
    NotUnit {
        /// |n|
        length: f64,
    },
    /// Time does not run backward.
    #[error("the time step is {dt_s} s, but must be 0 or more")]
    BadTimeStep {
        /// s
        dt_s: f64,
    },
    /// A face turned beyond the angle from which its rest point repels it.
    #[error(
        "the step has no answer within its bound: what roundings grow to on the way is {share:.1e} of it; take a shorter step, \
         or a force nearer to the normal"
    )]
    Undetermined {
        /// effect of roundings, over the bound
        share: f64,
    },
    /// An adaptive solver gave up.
    #[error(
        "too stiff for {rule}: {steps} steps reached {reached_s} s of {dt_s} s; use lie or corrected"
    )]
    Stiff {
        /// as in the scene and in `touchup step`
        rule: &'static str,
        /// number of steps tried
        steps: usize,
        /// time reached, s
        reached_s: f64,
        /// time step, s
        dt_s: f64,
    },
}

impl DynamicsError {
    /// Refuses a parameter that is not finite or not `inside` its range.
    pub(super) fn check(name: &'static str, value: f64, inside: bool) -> Result<(), Self> {
        if inside && value.is_finite() {
            Ok(())
        } else {
            Err(Self::BadParameter { name, value })
        }
    }
}

fn range_of(name: &str) -> &'static str {
    match name {
        "delta" => "finite",
        "alpha_m_per_n_s" | "beta_per_n2_s" => "finite and 0 or more",
        _ => "finite and more than 0",
    }
}
