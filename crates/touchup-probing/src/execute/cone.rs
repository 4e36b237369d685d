//! Orientations of a probe that leans to all sides of its first one.

use nalgebra::{Unit, UnitQuaternion, Vector3};

/// Lean of the shaft from its first direction, and azimuth of the lean, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftOrientation {
    /// from 0 to 60°
    pub lean: f64,
    /// from x towards y of the first tip
    pub towards: f64,
}

/// An orientation out of the arm's reach.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{:.0}° towards {:.0}°: {why}", orientation.lean.to_degrees(), orientation.towards.to_degrees())]
pub struct NotReached {
    /// the orientation
    pub orientation: ShaftOrientation,
    /// reason in words
    pub why: String,
}

/// Orientations of given leans (°), each with a number of sides.
pub(super) fn rings<const N: usize>(
    rings: [(f64, usize); N],
) -> impl Iterator<Item = ShaftOrientation> {
    rings.into_iter().flat_map(|(lean_deg, count)| {
        let towards = move |at: usize| std::f64::consts::TAU * at as f64 / count as f64;
        (0..count).map(move |at| ShaftOrientation {
            lean: lean_deg.to_radians(),
            towards: towards(at),
        })
    })
}

/// Leans the shaft to one side, without turning it about itself.
pub(super) fn leaned(
    rotation: &UnitQuaternion<f64>,
    orientation: &ShaftOrientation,
) -> UnitQuaternion<f64> {
    let (sin, cos) = orientation.towards.sin_cos();
    let axis = Unit::new_unchecked(Vector3::new(-sin, cos, 0.0));
    rotation * UnitQuaternion::from_axis_angle(&axis, orientation.lean)
}
