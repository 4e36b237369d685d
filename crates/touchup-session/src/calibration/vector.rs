//! Numbers as a calibration shows and writes them.

use std::fmt::{self, Display};

use touchup_features::calibrate::VectorEstimate;

use crate::reported;

reported! {
    /// A vector and its standard uncertainty, as in JSON; `unit`: units per SI unit.
    #[derive(Clone, Copy)]
    pub(super) struct Vector, pub(super) fn of(known: &VectorEstimate, unit: f64) {
        pub value: [f64; 3] = (known.value * unit).into(),
        std: [f64; 3] = (known.sigma * unit).into(),
    }
}

impl Display for Vector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(4);
        let pair = |(x, s): (&f64, &f64)| format!("{x:+.digits$} ± {s:.digits$}");
        f.write_str(
            &self
                .value
                .iter()
                .zip(&self.std)
                .map(pair)
                .collect::<Vec<_>>()
                .join(", "),
        )
    }
}

/// Rounds to the digits of a scene: 1e-7 mm and 1e-10 of other units are far below any noise.
pub(super) fn rounded(x: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    // no negative zero in a file for people
    (x * scale).round() / scale + 0.0
}
