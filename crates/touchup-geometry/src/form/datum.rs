//! The frame of a datum system A|B|C (ISO 5459).

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::element::{Element, Shape};

/// Sine between directions across each other, and along each other below it: 10°.
const APART: f64 = 0.17;

/// The frame of a datum system, as its pose in O, by the rule of 3-2-1; `None` if the datums do not
/// determine one.
///
/// A gives z: its normal, or its axis. x is across z: the normal of B, or its axis; for an axis B
/// along z it comes from C, from B to another axis along z or along the normal of C. Each
/// coordinate of the origin comes from the first datum that fixes it: a plane fixes the one along
/// its normal, through the middle of its touched part, an axis both across itself, at its
/// intersection with the plane A.
pub fn datum_frame([a, b, c]: [&Element; 3]) -> Option<Isometry3<f64>> {
    let z = a.direction;
    let across = |v: Vector3<f64>| v - z * v.dot(&z);
    let is_along = |e: &Element| e.direction.cross(&z).norm() < APART;
    let on_a = |e: &Element| {
        let to_a = (a.point - e.point).dot(&z) / e.direction.dot(&z);
        if a.shape == Shape::Plane && is_along(e) {
            e.point + e.direction * to_a
        } else {
            e.point
        }
    };
    let mut axis = Some(a).filter(|a| a.shape == Shape::Axis);
    let mut x = None;
    for datum in [b, c] {
        if !is_along(datum) {
            x = x.or_else(|| across(datum.direction).try_normalize(APART));
        } else if datum.shape == Shape::Axis {
            x = x.or_else(|| across(on_a(datum) - on_a(axis?)).try_normalize(0.0));
            axis = axis.or(Some(datum));
        }
    }
    let x = x?;
    let basis = [x, z.cross(&x), z];
    let mut origin = [None; 3];
    for datum in [a, b, c] {
        let along = |k: usize| datum.direction.dot(&basis[k]).abs() > (1.0 - APART * APART).sqrt();
        for k in 0..3 {
            if along(k) == (datum.shape == Shape::Plane) {
                origin[k] = origin[k].or(Some(on_a(datum).coords.dot(&basis[k])));
            }
        }
    }
    let [Some(x0), Some(y0), Some(z0)] = origin else {
        return None;
    };
    let place = Point3::from(basis[0] * x0 + basis[1] * y0 + basis[2] * z0);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&basis));
    Some(Isometry3::from_parts(
        place.into(),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;

    fn element(shape: Shape, point: [f64; 3], direction: [f64; 3]) -> Element {
        let (point, direction) = (Point3::from(point), Vector3::from(direction).normalize());
        Element {
            shape,
            point,
            direction,
            covariance: Matrix6::zeros(),
            calibration: 0.0,
            extent: vec![point],
        }
    }

    #[test]
    fn three_planes_meet_in_the_origin_and_the_first_gives_z() {
        let a = element(Shape::Plane, [5.0, 7.0, 1.0], [0.0, 0.0, 1.0]);
        let b = element(Shape::Plane, [2.0, 8.0, 9.0], [1.0, 0.0, 0.01]);
        let c = element(Shape::Plane, [4.0, 3.0, 6.0], [0.02, 1.0, 0.0]);
        let frame = datum_frame([&a, &b, &c]).unwrap();
        assert!((frame.translation.vector - Vector3::new(2.0, 3.0, 1.0)).norm() < 1e-12);
        assert!(
            (frame * Vector3::x() - Vector3::x()).norm() < 1e-12
                && (frame * Vector3::z() - Vector3::z()).norm() < 1e-12
        );
        assert_eq!(datum_frame([&a, &b, &a]), None, "nothing fixes y");
        assert_eq!(datum_frame([&a, &a, &c]), None, "nor x");
    }

    #[test]
    fn a_plane_and_two_holes_begin_at_the_first_and_look_to_the_second() {
        let a = element(Shape::Plane, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
        let b = element(Shape::Axis, [2.0, 2.0, -4.0], [0.0, 0.0, 1.0]);
        let c = element(Shape::Axis, [5.0, 6.0, -3.0], [0.0, 0.0, -1.0]);
        let frame = datum_frame([&a, &b, &c]).unwrap();
        assert!((frame.translation.vector - Vector3::new(2.0, 2.0, 1.0)).norm() < 1e-12);
        assert!((frame * Vector3::x() - Vector3::new(0.6, 0.8, 0.0)).norm() < 1e-12);
        let side = element(Shape::Plane, [9.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
        let frame = datum_frame([&a, &b, &side]).unwrap();
        assert!((frame * Vector3::x() + Vector3::y()).norm() < 1e-12);
    }
}
