//! Frames of the recorded poses: from the tracked stylus to the ball, and from space to the scan.
//!
//! A tracker gives the pose of its point H on the stylus, in its frame W. The ball centre is d from
//! H, in the axes of H, and the scan lies at `pose_wo`: pose_OT = pose_WO⁻¹ · pose_WH · d. A wrench
//! in stylus axes stays unchanged; a wrench in the axes of W turns into the axes of O.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::{Message, SettingError, StampedPose, StampedWrench, WrenchFrame};

/// Applied to each message on reading, before all else. The default changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Pose of the scan frame O in the frame W of the recorded poses; `None`: W is O.
    pub pose_wo: Option<Isometry3<f64>>,
    /// Ball centre from the origin of the recorded pose, in its axes, m; `None`: at that origin.
    pub p_ht: Option<Vector3<f64>>,
}

impl Placement {
    /// Refuses numbers that are not finite.
    ///
    /// # Errors
    /// [`SettingError`]
    pub fn check(&self) -> Result<(), SettingError> {
        let pose = self
            .pose_wo
            .iter()
            .flat_map(|pose| pose.translation.vector.iter().chain(&pose.rotation.coords));
        let offset = self.p_ht.iter().flat_map(|offset| offset.iter());
        pose.chain(offset).try_for_each(|x| {
            SettingError::check("scan in space or tip offset (m)", *x, true, "finite")
        })
    }

    /// `message` in the frames of the scene.
    ///
    /// - `wrench_frame`: [`WrenchFrame::Object`] for wrenches in the axes of the poses.
    pub fn place(&self, message: Message, wrench_frame: WrenchFrame) -> Message {
        match message {
            Message::Pose(pose) => Message::Pose(self.pose(pose)),
            Message::Wrench(wrench) if wrench_frame == WrenchFrame::Object => {
                Message::Wrench(self.wrench(wrench))
            }
            wrench => wrench,
        }
    }

    fn pose(&self, pose: StampedPose) -> StampedPose {
        StampedPose {
            pose_ot: self.placed(&pose.pose_ot),
            ..pose
        }
    }

    /// pose_OT of a recorded pose_WH.
    pub fn placed(&self, pose_wh: &Isometry3<f64>) -> Isometry3<f64> {
        let pose_wt = self
            .p_ht
            .map_or(*pose_wh, |offset| pose_wh * Translation3::from(offset));
        self.pose_wo
            .map_or(pose_wt, |pose_wo| pose_wo.inv_mul(&pose_wt))
    }

    /// The recorded pose_WH of a pose_OT.
    pub fn unplaced(&self, pose_ot: &Isometry3<f64>) -> Isometry3<f64> {
        let pose_wt = self.pose_wo.map_or(*pose_ot, |pose_wo| pose_wo * pose_ot);
        self.p_ht
            .map_or(pose_wt, |offset| pose_wt * Translation3::from(-offset))
    }

    fn wrench(&self, wrench: StampedWrench) -> StampedWrench {
        let Some(pose_wo) = &self.pose_wo else {
            return wrench;
        };
        StampedWrench {
            wrench: wrench.wrench.turned(&pose_wo.rotation.inverse()),
            ..wrench
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, vector};

    use super::*;
    use crate::stylus::Wrench;

    /// Worked by hand: the scan lies 1 m along x of space, turned by 90° about z; the ball hangs
    /// 0.1 m below H.
    #[test]
    fn a_pose_and_a_wrench_in_space_come_into_the_frame_of_the_scan() {
        let quarter =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let pose_wo = Some(Isometry3::from_parts(
            Translation3::new(1.0, 0.0, 0.0),
            quarter,
        ));
        let placement = Placement {
            pose_wo,
            p_ht: Some(vector![0.0, 0.0, -0.1]),
        };
        let pose_ot = Isometry3::translation(1.0, 0.5, 0.3);
        let Message::Pose(placed) = placement.place(
            Message::Pose(StampedPose {
                stamp_ns: 7,
                pose_ot,
            }),
            WrenchFrame::Sensor,
        ) else {
            panic!("a pose stays one");
        };
        assert!(
            (placed.pose_ot.translation.vector - vector![0.5, 0.0, 0.2]).norm() < 1e-15
                && placed.stamp_ns == 7
        );
        assert!((placed.pose_ot.rotation * Vector3::y() - Vector3::x()).norm() < 1e-15);
        let wrench = Wrench {
            force: vector![0.0, 2.0, 1.0],
            torque: vector![0.0, 3.0, 0.0],
        };
        let message = Message::Wrench(StampedWrench {
            stamp_ns: 7,
            wrench,
        });
        assert_eq!(placement.place(message, WrenchFrame::Sensor), message);
        let Message::Wrench(turned) = placement.place(message, WrenchFrame::Object) else {
            panic!("a wrench stays one");
        };
        assert!((turned.wrench.force - vector![2.0, 0.0, 1.0]).norm() < 1e-15);
        assert!((turned.wrench.torque - vector![3.0, 0.0, 0.0]).norm() < 1e-15);
        assert_eq!(
            Placement::default().place(message, WrenchFrame::Object),
            message
        );
        let lost = Placement {
            p_ht: Some(vector![f64::NAN, 0.0, 0.0]),
            ..placement
        };
        assert!(placement.check().is_ok() && lost.check().is_err());
    }
}
