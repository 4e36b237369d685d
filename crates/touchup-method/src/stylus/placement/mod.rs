//! Frames of the recorded poses: from the tracked stylus to the ball, and from space to the scan.
//!
//! A tracker gives the pose of its point H on the stylus, in its frame W. The ball centre is d from
//! H, in the axes of H, and the scan lies at `pose_wo`: pose_OT = pose_WO⁻¹ · pose_WH · d. A wrench
//! in stylus axes stays unchanged; a wrench in the axes of W turns into the axes of O. What moved
//! while the recording lasted is taken off after that: O is the frame of the part as it lay at first.

mod known_change;

pub use known_change::{ChangeCourse, ChangedThing, KnownChange, motion_about};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::{Message, SettingError, StampedPose, StampedWrench, WrenchFrame};

/// Applied to each message on reading, before all else. The default changes nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Placement {
    /// Pose of the scan frame O in the frame W of the recorded poses; `None`: W is O.
    pub pose_wo: Option<Isometry3<f64>>,
    /// Ball centre from the origin of the recorded pose, in its axes, m; `None`: at that origin.
    pub p_ht: Option<Vector3<f64>>,
    /// What changed its place, taken off one after the other. The weight of a payload keeps the
    /// axes in which it is told: as if the frame of the poses moved.
    pub changes: Vec<KnownChange>,
}

impl Placement {
    /// Refuses numbers that are not finite, and changes outside their ranges.
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
        })?;
        self.changes.iter().try_for_each(KnownChange::check)
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
            pose_ot: self.placed(pose.stamp_ns, &pose.pose_ot),
            ..pose
        }
    }

    /// pose_OT of a recorded pose_WH.
    pub fn placed(&self, stamp_ns: i64, pose_wh: &Isometry3<f64>) -> Isometry3<f64> {
        let pose_wt = self
            .p_ht
            .map_or(*pose_wh, |offset| pose_wh * Translation3::from(offset));
        let pose_ot = self
            .pose_wo
            .map_or(pose_wt, |pose_wo| pose_wo.inv_mul(&pose_wt));
        self.changes.iter().fold(pose_ot, |pose_ot, change| {
            change.cause.undone(&change.motion(stamp_ns), &pose_ot)
        })
    }

    /// The recorded pose_WH of a pose_OT.
    pub fn unplaced(&self, stamp_ns: i64, pose_ot: &Isometry3<f64>) -> Isometry3<f64> {
        let changes = self.changes.iter().rev();
        let pose_ot = changes.fold(*pose_ot, |pose_ot, change| {
            change.cause.redone(&change.motion(stamp_ns), &pose_ot)
        });
        let pose_wt = self.pose_wo.map_or(pose_ot, |pose_wo| pose_wo * pose_ot);
        self.p_ht
            .map_or(pose_wt, |offset| pose_wt * Translation3::from(-offset))
    }

    /// A wrench in the axes of W, in those of O.
    fn wrench(&self, wrench: StampedWrench) -> StampedWrench {
        let turn = self.pose_wo.map_or(UnitQuaternion::identity(), |pose_wo| {
            pose_wo.rotation.inverse()
        });
        let moves = self
            .changes
            .iter()
            .filter(|change| change.cause == ChangedThing::Part);
        let turn = moves.fold(turn, |turn, change| {
            change.motion(wrench.stamp_ns).rotation.inverse() * turn
        });
        StampedWrench {
            wrench: wrench.wrench.turned(&turn),
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
            changes: Vec::new(),
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
            ..placement.clone()
        };
        assert!(placement.check().is_ok() && lost.check().is_err());
    }

    /// The part turns by 90° about z from 5 ns on: a pose and a wrench of before, taken with it, come
    /// back; a bent tip leaves a wrench as it is.
    #[test]
    fn a_part_that_moved_takes_pose_and_wrench_with_it() {
        let turn = vector![0.0, 0.0, std::f64::consts::FRAC_PI_2];
        let moved = KnownChange {
            from: Some(5),
            turn,
            shift: vector![1e-3, 0.0, 0.0],
            ..KnownChange::default()
        };
        let bent = KnownChange {
            cause: ChangedThing::Tip,
            turn: Vector3::zeros(),
            ..moved
        };
        let placement = Placement {
            pose_wo: Some(Isometry3::translation(0.0, 0.0, 0.5)),
            changes: vec![moved, bent],
            ..Placement::default()
        };
        let pose = Isometry3::translation(0.0, 0.02, 0.6);
        // (0, 20, 100) mm, turned back by 90°, 1 mm less along x, and 1 mm along x of a stylus turned so
        let placed = placement.placed(5, &pose);
        let expected = vector![0.02 - 0.001, -0.001, 0.1];
        assert!(
            (placed.translation.vector - expected).norm() < 1e-15,
            "{placed}"
        );
        assert!((placed.rotation * Vector3::y() - Vector3::x()).norm() < 1e-15);
        let back = placement.unplaced(5, &placed);
        assert!((back.translation.vector - pose.translation.vector).norm() < 1e-15);
        assert_eq!(
            placement.placed(4, &pose).translation.vector,
            vector![0.0, 0.02, 0.6 - 0.5]
        );
        let wrench = |stamp_ns| {
            let wrench = Wrench {
                force: vector![0.0, 2.0, 1.0],
                torque: Vector3::zeros(),
            };
            Message::Wrench(StampedWrench { stamp_ns, wrench })
        };
        let Message::Wrench(turned) = placement.place(wrench(5), WrenchFrame::Object) else {
            panic!("a wrench stays one");
        };
        assert!((turned.wrench.force - vector![2.0, 0.0, 1.0]).norm() < 1e-15);
        assert_eq!(placement.place(wrench(4), WrenchFrame::Object), wrench(4));
        assert_eq!(placement.place(wrench(5), WrenchFrame::Sensor), wrench(5));
    }
}
