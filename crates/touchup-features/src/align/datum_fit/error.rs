//! Reasons why features fix no frame.

use nalgebra::Vector3;

/// Reason why there is no motion into the frame of a drawing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DatumFitError {
    /// Some freedoms remain open.
    #[error("{} left open", open(turns, shifts))]
    Free {
        /// axes of open turns, unit vectors in the frame of the drawing
        turns: Vec<Vector3<f64>>,
        /// directions of open shifts
        shifts: Vec<Vector3<f64>>,
    },
    /// The search did not converge.
    #[error("the fit did not converge: check the nominal places and axes")]
    NotConverged,
}

/// "a turn about (0.00 0.00 1.00) and a shift along (1.00 0.00 0.00) are".
fn open(turns: &[Vector3<f64>], shifts: &[Vector3<f64>]) -> String {
    // no -0.00
    let rounded = |x: f64| (x * 100.0).round() / 100.0 + 0.0;
    let shown = |v: &Vector3<f64>| {
        format!(
            "({:.2} {:.2} {:.2})",
            rounded(v.x),
            rounded(v.y),
            rounded(v.z)
        )
    };
    let turns = turns
        .iter()
        .map(|axis| format!("a turn about {}", shown(axis)));
    let shifts = shifts
        .iter()
        .map(|along| format!("a shift along {}", shown(along)));
    let all: Vec<_> = turns.chain(shifts).collect();
    match &*all {
        [] => "all six degrees of freedom are".to_owned(),
        [one] => format!("{one} is"),
        [first @ .., last] => format!("{} and {last} are", first.join(", ")),
    }
}
