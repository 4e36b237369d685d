//! Transforms messages from the frames in their headers to the frames of a recording, for `touchup
//! refine` with the scene.
//!
//! Poses go to the scene's frame of poses: `cell` if the scene places the scan in it
//! (`scan_to_space`), else the object frame. A wrench goes to the sensor's own axes, or to those of
//! the poses. So the recording of a session and its scene suffice for the same result.

use nalgebra::Isometry3;

use crate::ros::parameters::CELL_FRAME;
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::{
    FrameBuffer, FrameError, Message, Placement, StampedPose, StampedWrench, Wrench, WrenchFrame,
    measured_rotation, plain_name,
};

/// Frame of the poses otherwise, as named in recordings.
const OBJECT: &str = "object";

/// Reason why a message is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Its stamp is before 1970, or no time.
    #[error("its stamp is no time")]
    Stamp,
    /// Its orientation is no rotation.
    #[error("its orientation is no rotation: normalise the quaternion at its source")]
    Quaternion,
    /// It names no frame.
    #[error("its header names no frame")]
    NoFrame,
    /// The frames are not connected at its stamp.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Earlier wrenches came in the sensor's axes and now in the object's, or the reverse.
    #[error("its axes are others than those of the wrenches before: reset begins anew")]
    AxesChanged,
}

impl Refusal {
    /// Its name in diagnostics.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Stamp => "stamp",
            Self::Quaternion => "quaternion",
            Self::NoFrame => "no_frame",
            Self::Frame(FrameError::Unknown(_)) => "unknown_frame",
            Self::Frame(_) => "transform",
            Self::AxesChanged => "axes_changed",
        }
    }
}

/// Names of the known frames.
#[derive(Clone, Debug)]
pub struct FrameNames {
    /// frame of the mesh
    pub object: String,
    /// frame whose pose the source reports
    pub tool: String,
    /// frame of the wrench axes
    pub sensor: String,
}

/// Transforms messages into the frames of the recording.
#[derive(Clone, Debug)]
pub struct FrameResolver {
    names: FrameNames,
    placement: Placement,
    /// axes of the wrenches, after the first one
    pub axes: Option<WrenchFrame>,
    /// all transforms up to now
    pub frames: FrameBuffer,
}

impl FrameResolver {
    /// - `placement`: of the scene.
    pub fn new(names: FrameNames, placement: Option<Placement>) -> Self {
        Self {
            names,
            placement: placement.unwrap_or_default(),
            axes: None,
            frames: FrameBuffer::default(),
        }
    }

    /// Frame of the poses in the recording.
    pub fn recorded_frame(&self) -> &'static str {
        if self.placement.pose_wo.is_some() {
            CELL_FRAME
        } else {
            OBJECT
        }
    }

    /// A message of the recording in the refiner's frame.
    pub fn placed(&self, message: Message) -> Message {
        self.placement.place(message, self.axes.unwrap_or_default())
    }

    /// The message in the frame of the recording.
    ///
    /// # Errors
    /// [`Refusal`]
    pub fn recorded(
        &mut self,
        LiveMessage { frame, message }: &LiveMessage,
    ) -> Result<Message, Refusal> {
        if message.stamp_ns() < 0 {
            return Err(Refusal::Stamp);
        }
        match *message {
            Message::Pose(pose) => self.pose(frame, pose).map(Message::Pose),
            Message::Wrench(wrench) => self.wrench(frame, wrench).map(Message::Wrench),
        }
    }

    fn pose(&self, frame: &str, mut pose: StampedPose) -> Result<StampedPose, Refusal> {
        let turn = measured_rotation(pose.pose_ot.rotation.into_inner());
        pose.pose_ot.rotation = turn.ok_or(Refusal::Quaternion)?;
        if let Some(frame) = self.recorded_from(frame, pose.stamp_ns)? {
            pose.pose_ot = frame * pose.pose_ot;
        }
        Ok(pose)
    }

    fn wrench(
        &mut self,
        frame: &str,
        StampedWrench { stamp_ns, wrench }: StampedWrench,
    ) -> Result<StampedWrench, Refusal> {
        let (axes, wrench) = self.turned(frame, stamp_ns, wrench)?;
        if *self.axes.get_or_insert(axes) != axes {
            return Err(Refusal::AxesChanged);
        }
        Ok(StampedWrench { stamp_ns, wrench })
    }

    fn turned(
        &self,
        frame: &str,
        stamp_ns: i64,
        wrench: Wrench,
    ) -> Result<(WrenchFrame, Wrench), Refusal> {
        let (
            name,
            FrameNames {
                object,
                tool,
                sensor,
            },
        ) = (plain_name(frame), &self.names);
        if name == tool || name == sensor {
            return Ok((WrenchFrame::Sensor, wrench));
        }
        if name != object
            && name != CELL_FRAME
            && !name.is_empty()
            && let Ok(pose_sf) = self.frames.pose(sensor, name, stamp_ns)
        {
            return Ok((WrenchFrame::Sensor, wrench.moved(&pose_sf)));
        }
        let pose = self.recorded_from(frame, stamp_ns)?;
        let wrench = pose.map_or(wrench, |pose| wrench.turned(&pose.rotation));
        Ok((WrenchFrame::Object, wrench))
    }

    /// Pose of `frame` in the frame of the recording; `None` for that frame itself.
    fn recorded_from(&self, frame: &str, stamp_ns: i64) -> Result<Option<Isometry3<f64>>, Refusal> {
        let (name, object) = (plain_name(frame), self.names.object.as_str());
        if name.is_empty() {
            return Err(Refusal::NoFrame);
        }
        let in_object = || self.frames.pose(object, name, stamp_ns);
        let is_apart = |pose: &Result<_, _>| {
            matches!(
                pose,
                Err(FrameError::Unknown(_) | FrameError::NotConnected(..))
            )
        };
        Ok(match self.placement.pose_wo {
            None if name == object => None,
            // without `scan_to_space` the scan lies unmoved in the cell
            None if name == CELL_FRAME && is_apart(&in_object()) => None,
            None => Some(in_object()?),
            Some(_) if name == CELL_FRAME => None,
            Some(pose_wo) if name == object => Some(pose_wo),
            Some(pose_wo) => {
                let in_cell = self.frames.pose(CELL_FRAME, name, stamp_ns);
                Some(if is_apart(&in_cell) {
                    pose_wo * in_object()?
                } else {
                    in_cell?
                })
            }
        })
    }

    /// Pose of any frame in the object frame.
    ///
    /// # Errors
    /// [`Refusal`]
    pub fn object_from(&self, frame: &str, stamp_ns: i64) -> Result<Isometry3<f64>, Refusal> {
        let pose = self.recorded_from(frame, stamp_ns)?.unwrap_or_default();
        Ok(self
            .placement
            .pose_wo
            .map_or(pose, |pose_wo| pose_wo.inv_mul(&pose)))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion as Q, UnitQuaternion, Vector3, vector};

    use super::*;
    use crate::ros::convert::frame_transform;
    use crate::ros::messages::{
        Header, Quaternion, Time, Transform, TransformStamped, Vector3 as V,
    };

    fn header(frame: &str) -> Header {
        Header {
            stamp: Time { sec: 5, nanosec: 0 },
            frame_id: frame.to_owned(),
        }
    }

    const STAMP_NS: i64 = 5_000_000_000;

    fn pose(frame: &str) -> LiveMessage {
        let pose_ot = Isometry3::translation(1.0, 2.0, 3.0);
        turned_pose(frame, STAMP_NS, pose_ot)
    }

    fn turned_pose(frame: &str, stamp_ns: i64, pose_ot: Isometry3<f64>) -> LiveMessage {
        LiveMessage {
            frame: frame.to_owned(),
            message: Message::Pose(StampedPose { stamp_ns, pose_ot }),
        }
    }

    fn wrench(frame: &str) -> LiveMessage {
        let wrench = Wrench {
            force: Vector3::x(),
            torque: Vector3::zeros(),
        };
        LiveMessage {
            frame: frame.to_owned(),
            message: Message::Wrench(StampedWrench {
                stamp_ns: STAMP_NS,
                wrench,
            }),
        }
    }

    fn resolver(placement: Option<Placement>) -> FrameResolver {
        let names = FrameNames {
            object: "object".into(),
            tool: "stylus".into(),
            sensor: "stylus_sensor".into(),
        };
        let mut resolver = FrameResolver::new(names, placement);
        // a quarter turn about z, 1 m along x
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let transform = Transform {
            translation: V {
                x: 1.0,
                y: 0.0,
                z: 0.0,
            },
            rotation: Quaternion {
                x: 0.0,
                y: 0.0,
                z: half,
                w: half,
            },
        };
        for (parent, child) in [("object", "base"), ("stylus_sensor", "gauge")] {
            let stamped = TransformStamped {
                header: header(parent),
                child_frame_id: child.to_owned(),
                transform,
            };
            assert!(
                resolver
                    .frames
                    .insert(&frame_transform(&stamped).unwrap(), true)
            );
        }
        resolver
    }

    fn position(message: Message) -> Vector3<f64> {
        let Message::Pose(pose) = message else {
            panic!("a pose stays one")
        };
        pose.pose_ot.translation.vector
    }

    fn force(message: Message) -> Vector3<f64> {
        let Message::Wrench(wrench) = message else {
            panic!("a wrench stays one")
        };
        wrench.wrench.force
    }

    /// Worked by hand.
    #[test]
    fn poses_come_into_the_frame_of_the_object() {
        let mut resolver = resolver(None);
        assert_eq!(
            position(resolver.recorded(&pose("object")).unwrap()),
            vector![1.0, 2.0, 3.0]
        );
        assert_eq!(
            position(resolver.recorded(&pose("cell")).unwrap()),
            vector![1.0, 2.0, 3.0]
        );
        let turned = position(resolver.recorded(&pose("/base")).unwrap());
        assert!(
            (turned - vector![-1.0, 1.0, 3.0]).norm() < 1e-12,
            "{turned}"
        );
        assert_eq!(resolver.recorded(&pose("")).unwrap_err(), Refusal::NoFrame);
        assert_eq!(
            resolver.recorded(&pose("nowhere")).unwrap_err().name(),
            "unknown_frame"
        );
        let no_turn = UnitQuaternion::new_unchecked(Q::default());
        let bad = |stamp_ns| {
            let pose = Isometry3::from_parts(Vector3::zeros().into(), no_turn);
            turned_pose("object", stamp_ns, pose)
        };
        assert_eq!(
            resolver.recorded(&bad(STAMP_NS)).unwrap_err(),
            Refusal::Quaternion
        );
        assert_eq!(resolver.recorded(&bad(-1)).unwrap_err(), Refusal::Stamp);
    }

    #[test]
    fn with_scan_to_space_they_come_into_the_cell() {
        let pose_wo = Some(Isometry3::translation(10.0, 0.0, 0.0));
        let mut resolver = resolver(Some(Placement {
            pose_wo,
            ..Placement::default()
        }));
        assert_eq!(resolver.recorded_frame(), "cell");
        assert_eq!(
            position(resolver.recorded(&pose("cell")).unwrap()),
            vector![1.0, 2.0, 3.0],
            "bit by bit"
        );
        assert_eq!(
            position(resolver.recorded(&pose("object")).unwrap()),
            vector![11.0, 2.0, 3.0]
        );
        let recorded = resolver.recorded(&pose("base")).unwrap();
        let placed = resolver.placed(recorded);
        assert!((position(placed) - vector![-1.0, 1.0, 3.0]).norm() < 1e-12);
        assert_eq!(
            resolver
                .object_from("cell", 0)
                .unwrap()
                .translation
                .vector
                .x,
            -10.0
        );
    }

    #[test]
    fn wrenches_come_into_the_axes_of_the_sensor_or_of_the_object() {
        let mut of_sensor = resolver(None);
        assert_eq!(
            force(of_sensor.recorded(&wrench("stylus")).unwrap()),
            Vector3::x()
        );
        assert_eq!(
            force(of_sensor.recorded(&wrench("stylus_sensor")).unwrap()),
            Vector3::x()
        );
        assert!(
            (force(of_sensor.recorded(&wrench("gauge")).unwrap()) - Vector3::y()).norm() < 1e-12
        );
        assert_eq!(of_sensor.axes, Some(WrenchFrame::Sensor));
        assert_eq!(
            of_sensor.recorded(&wrench("object")).unwrap_err(),
            Refusal::AxesChanged
        );
        let mut of_object = resolver(None);
        assert!(
            (force(of_object.recorded(&wrench("base")).unwrap()) - Vector3::y()).norm() < 1e-12
        );
        assert_eq!(
            force(of_object.recorded(&wrench("object")).unwrap()),
            Vector3::x()
        );
        assert_eq!(of_object.axes, Some(WrenchFrame::Object));
        assert_eq!(
            of_object.recorded(&wrench("elsewhere")).unwrap_err().name(),
            "unknown_frame"
        );
    }
}
