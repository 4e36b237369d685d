//! Small rigid motions about a centre, and the resulting change of distances to planes.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, Vector6};

/// `pose`, then the turn about `centre` by a rotation vector (rad), then the shift (m): x ↦ c + R
/// (x − c) + t.
pub fn moved_by_twist(
    pose: &Isometry3<f64>,
    centre: &Point3<f64>,
    shift: &Vector3<f64>,
    turn: &Vector3<f64>,
) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(*turn);
    Isometry3::from_parts((shift + centre.coords - turn * centre.coords).into(), turn) * pose
}

/// Change of the distance of a point from a plane with a small motion of the point \[Chen Medioni
/// 1992\]: (n, arm × n / lever), by shift and by turn, with turns as the shift at the lever.
///
/// - `arm`: of the point from the centre of the turn, m; `normal`: unit, of the plane; `lever`: m,
///   1 for turns in rad.
pub fn point_to_plane_row(arm: &Vector3<f64>, normal: &Vector3<f64>, lever: f64) -> Vector6<f64> {
    let turn = arm.cross(normal) / lever;
    Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_quarter_turn_about_a_centre_leaves_the_centre_and_moves_the_origin() {
        let centre = Point3::new(1.0, 0.0, 0.0);
        let up = Vector3::new(0.0, 0.0, 3.0);
        let moved = moved_by_twist(
            &Isometry3::identity(),
            &centre,
            &up,
            &(Vector3::z() * FRAC_PI_2),
        );
        assert!((moved * centre - Point3::new(1.0, 0.0, 3.0)).norm() < 1e-15);
        assert!((moved * Point3::origin() - Point3::new(1.0, -1.0, 3.0)).norm() < 1e-15);
    }

    #[test]
    fn a_row_is_the_derivative_of_the_distance() {
        let (arm, normal, lever) = (
            Vector3::new(0.3, -0.2, 0.5),
            Vector3::new(0.48, 0.6, 0.64),
            0.25,
        );
        let row = point_to_plane_row(&arm, &normal, lever);
        let small = 1e-6;
        for i in 0..3 {
            let turn = Vector3::ith(i, small / lever);
            let moved = moved_by_twist(
                &Isometry3::identity(),
                &Point3::origin(),
                &Vector3::zeros(),
                &turn,
            ) * arm;
            assert!(
                (normal.dot(&(moved - arm)) / small - row[3 + i]).abs() < 1e-5,
                "{i}"
            );
            assert_eq!(row[i], normal[i]);
        }
    }
}
