//! Orthonormal bases from one direction.

use nalgebra::{UnitQuaternion, Vector3};

/// Largest share along x of an axis counted as far from x: the cross product is then at least 0.8
/// long.
const FAR_FROM_X: f64 = 0.6;

/// Two unit vectors u and v across `axis`, a unit vector: (u, v, axis) is right-handed. No
/// continuous choice exists; the axes of discontinuity are unspecified.
pub fn tangent_basis(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let aside = if axis.x.abs() < FAR_FROM_X {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = axis.cross(&aside).normalize();
    [u, axis.cross(&u)]
}

/// The smallest rotation from z to a direction; half a turn about x to the opposite one.
pub fn turned_to(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), direction).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_basis_of_each_axis_of_space_is_the_other_two() {
        assert_eq!(tangent_basis(&Vector3::z()), [Vector3::y(), -Vector3::x()]);
        assert_eq!(tangent_basis(&Vector3::x()), [Vector3::z(), -Vector3::y()]);
        assert_eq!(tangent_basis(&Vector3::y()), [-Vector3::z(), -Vector3::x()]);
    }

    #[test]
    fn the_basis_is_right_handed_on_both_sides_of_the_choice() {
        for x in [0.0, 0.599, 0.601, -0.7, 1.0f64] {
            let axis = Vector3::new(x, (1.0 - x * x).sqrt() * 0.8, (1.0 - x * x).sqrt() * 0.6);
            let [u, v] = tangent_basis(&axis);
            assert!(
                (u.cross(&v) - axis).norm() < 1e-15 && (u.norm() - 1.0).abs() < 1e-15,
                "{x}"
            );
        }
    }
}
