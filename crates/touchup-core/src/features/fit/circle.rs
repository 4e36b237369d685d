//! Distance from the axis, shared by the round surfaces.

use nalgebra::Vector3;

/// Distance of a point from the z axis and the unit vector away from it; x on the axis itself, where every one will do.
pub(super) fn radial(q: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let rho = q.x.hypot(q.y);
    (rho, if rho > 0.0 { Vector3::new(q.x / rho, q.y / rho, 0.0) } else { Vector3::x() })
}

/// +1 where the material is inside (a boss), −1 where the air is (a hole).
pub(super) fn side(concave: bool) -> f64 {
    if concave { -1.0 } else { 1.0 }
}
