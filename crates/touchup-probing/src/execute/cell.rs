//! Pose of the part relative to the arm, and the tool of the arm.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::links::Tool;
use crate::arm::ArmGeometry;
use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::turned_to;

/// A robot cell.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotCell {
    /// geometry of the arm
    pub geometry: ArmGeometry,
    /// pose of the part in the base: maps O to B
    pub pose_bo: Isometry3<f64>,
    /// pose of the tip in the flange: maps T to the flange; z of T from the tip to the handle
    pub pose_ft: Isometry3<f64>,
    /// tool to keep clear of the mesh
    pub tool: Tool,
}

/// Lean of a shaft from the surface's normal below which it stays as it is, rad.
const LEANS: f64 = 0.26;

/// Height of a simulated tip above the part at its start, m.
const ABOVE: f64 = 40e-3;

impl RobotCell {
    /// Pose of the tip in B with the ball's centre at a place of O.
    pub fn pose(&self, rotation: &UnitQuaternion<f64>, centre: &Point3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts((self.pose_bo * centre).coords.into(), *rotation)
    }

    /// Place in O of a pose of the tip in B.
    pub fn place(&self, pose_bt: &Isometry3<f64>) -> Point3<f64> {
        self.pose_bo
            .inverse_transform_point(&Point3::from(pose_bt.translation.vector))
    }

    /// Direction of the shaft in O, from the tip to the handle.
    pub fn shaft(&self, rotation: &UnitQuaternion<f64>) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.pose_bo.rotation.inverse() * (rotation * Vector3::z()))
    }

    /// Orientation of the tip in B that aligns the shaft with the normal of a surface; the present
    /// one if that is near enough.
    pub fn upright(
        &self,
        now: &UnitQuaternion<f64>,
        normal: &Unit<Vector3<f64>>,
    ) -> UnitQuaternion<f64> {
        let (shaft, out) = (
            now * Vector3::z(),
            self.pose_bo.rotation * normal.into_inner(),
        );
        if shaft.angle(&out) < LEANS {
            return *now;
        }
        let turn = UnitQuaternion::rotation_between(&shaft, &out).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&(now * Vector3::x_axis()), std::f64::consts::PI)
        });
        turn * now
    }

    /// Start of a simulated arm: the tip well above the middle of a part, the shaft along z of O,
    /// in B.
    pub fn above(&self, part: &TriMesh) -> Isometry3<f64> {
        let [low, high] = part.bounds();
        let middle = Point3::new(
            f64::midpoint(low.x, high.x),
            f64::midpoint(low.y, high.y),
            high.z + ABOVE,
        );
        self.pose(&turned_to(&(self.pose_bo.rotation * Vector3::z())), &middle)
    }
}
