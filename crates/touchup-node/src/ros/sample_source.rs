//! Sources of poses and wrenches: choice of the message type, and conversion to arrivals.

use std::time::Instant;

use crate::ros::arguments::NodeConfig;
use crate::ros::parameters::CELL_FRAME;
use crate::ros::port::Arrival;
use touchup_io::recording::{BadMessage, LiveMessage, LiveType, SampleKind};

/// A topic of poses or of wrenches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SampleSource {
    kind: SampleKind,
    /// type of the parameter; `None`: the publisher's
    named: Option<LiveType>,
    usual: LiveType,
    /// frame of messages without one
    frame: String,
}

impl SampleSource {
    /// The source of poses or wrenches according to the parameters; `None` for poses from
    /// transforms.
    ///
    /// # Errors
    /// In words, for an unsuitable type in a parameter: earlier checks exclude it.
    pub fn of(config: &NodeConfig, kind: SampleKind) -> Result<Option<Self>, String> {
        let parameters = &config.parameters;
        let name = |of: &str| parameters.string(of).to_owned();
        let type_name = match kind {
            SampleKind::Pose if parameters.pose_frames().is_some() => return Ok(None),
            SampleKind::Pose => name("pose_type"),
            SampleKind::Wrench => name("wrench_type"),
        };
        // as in a recording: if both lack headers they have the same axes, else the wrench is in
        // those of its sensor
        let is_pose_unnamed = || {
            LiveType::of(SampleKind::Pose, &name("pose_type")).is_ok_and(|pose| !pose.has_header())
        };
        let frame = match kind {
            SampleKind::Wrench if !is_pose_unnamed() => format!("{}_sensor", name("source")),
            _ => CELL_FRAME.to_owned(),
        };
        let (usual, known) = (LiveType::of(kind, "")?, LiveType::of(kind, &type_name)?);
        Ok(Some(Self {
            kind,
            named: (!type_name.is_empty()).then_some(known),
            usual,
            frame,
        }))
    }

    /// The type before any publisher appears.
    pub fn first_type(&self) -> LiveType {
        self.named.unwrap_or(self.usual)
    }

    /// The type to subscribe to, and the reason if no published type is readable.
    ///
    /// - `now`: current type; it stays while a publisher has it, or none has a readable one.
    /// - `published`: ROS 2 names of types.
    pub fn choose<'a>(
        &self,
        now: LiveType,
        published: impl IntoIterator<Item = &'a str>,
    ) -> (LiveType, Option<String>) {
        let published: Vec<&str> = published.into_iter().collect();
        if published.is_empty() || published.contains(&now.name()) {
            return (now, None);
        }
        if let Some(named) = self.named {
            let parameter = if self.kind == SampleKind::Pose {
                "pose_type"
            } else {
                "wrench_type"
            };
            let why = format!(
                "somebody publishes {}, the parameter {parameter} names {}",
                published[0],
                named.name()
            );
            return (now, Some(why));
        }
        let known: Vec<_> = published
            .iter()
            .map(|name| LiveType::of(self.kind, name))
            .collect();
        match known.iter().find_map(|of| of.as_ref().ok()) {
            Some(readable) => (*readable, None),
            None => (
                now,
                known
                    .into_iter()
                    .find_map(Result::err)
                    .map(|why| format!("somebody publishes {why}")),
            ),
        }
    }

    /// Arrival for a message on `topic`, read as `of`. The node refuses a header without a frame:
    /// only a type without a header is in the parameters' frame.
    pub fn arrival(
        &self,
        topic: &'static str,
        of: LiveType,
        read: Result<LiveMessage, BadMessage>,
    ) -> Arrival {
        let mut message = match read {
            Ok(message) => message,
            Err(BadMessage::Quaternion) => return self.refused("quaternion"),
            Err(BadMessage::Stamp) => return self.refused("stamp"),
            Err(bad) => return Arrival::Unreadable(topic, format!("{bad}, read as {}", of.name())),
        };
        if !of.has_header() {
            message.frame.clone_from(&self.frame);
        }
        Arrival::Message(message, Instant::now())
    }

    fn refused(&self, reason: &'static str) -> Arrival {
        Arrival::Refused(
            usize::from(self.kind == SampleKind::Wrench),
            reason,
            Instant::now(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_method::stylus::{Message, StampedWrench, Wrench};

    fn source(kind: SampleKind, arguments: &[&str]) -> Option<SampleSource> {
        let arguments: Vec<_> = arguments
            .iter()
            .flat_map(|one| ["-p".to_owned(), (*one).to_owned()])
            .collect();
        SampleSource::of(&NodeConfig::new(&arguments, |_| None).unwrap(), kind).unwrap()
    }

    #[test]
    fn the_type_is_that_of_who_publishes_what_can_be_read() {
        let poses = source(SampleKind::Pose, &[]).unwrap();
        let first = poses.first_type();
        assert_eq!(first.name(), "geometry_msgs/msg/PoseStamped");
        assert_eq!(poses.choose(first, []), (first, None));
        let (odometry, why) = poses.choose(first, ["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"]);
        assert_eq!((odometry.name(), why), ("nav_msgs/msg/Odometry", None));
        // another publisher of another type changes nothing, nor does a leaving publisher
        assert_eq!(
            poses.choose(odometry, [first.name(), odometry.name()]),
            (odometry, None)
        );
        assert_eq!(poses.choose(odometry, []), (odometry, None));
        let (stays, why) = poses.choose(first, ["sensor_msgs/msg/Imu"]);
        let why = why.unwrap();
        assert!(
            stays == first
                && why.contains("sensor_msgs/msg/Imu, not geometry_msgs/msg/PoseStamped"),
            "{why}"
        );
        let (_, why) = poses.choose(first, ["tf2_msgs/msg/TFMessage"]);
        assert!(why.unwrap().contains("pose_frame"));
    }

    #[test]
    fn a_type_that_is_named_stays() {
        let wrenches = source(
            SampleKind::Wrench,
            &["wrench_type:=geometry_msgs/msg/Wrench"],
        )
        .unwrap();
        let first = wrenches.first_type();
        let (stays, why) = wrenches.choose(first, ["geometry_msgs/msg/WrenchStamped"]);
        assert!(
            stays == first
                && why
                    .unwrap()
                    .contains("the parameter wrench_type names geometry_msgs/msg/Wrench")
        );
        assert_eq!(source(SampleKind::Pose, &["pose_frame:=tool0"]), None);
    }

    #[test]
    fn a_type_without_a_header_is_in_the_frame_of_the_parameters_and_no_other() {
        let frame = |arguments: &[&str], of: &str, own: &str| {
            let wrench = StampedWrench {
                stamp_ns: 5,
                wrench: Wrench::default(),
            };
            let read = LiveMessage {
                frame: own.to_owned(),
                message: Message::Wrench(wrench),
            };
            let of = LiveType::of(SampleKind::Wrench, of).unwrap();
            match source(SampleKind::Wrench, arguments).unwrap().arrival(
                "stylus/wrench",
                of,
                Ok(read),
            ) {
                Arrival::Message(message, _) => message.frame,
                other => panic!("{other:?}"),
            }
        };
        let (stamped, plain) = (
            "geometry_msgs/msg/WrenchStamped",
            "geometry_msgs/msg/Wrench",
        );
        assert_eq!(frame(&[], stamped, "ft"), "ft");
        assert_eq!(frame(&[], stamped, ""), "", "the node refuses it by name");
        assert_eq!(frame(&["source:=probe"], plain, ""), "probe_sensor");
        assert_eq!(
            frame(&["pose_type:=geometry_msgs/msg/Pose"], plain, ""),
            "cell"
        );
    }

    #[test]
    fn a_pose_that_is_no_rotation_counts_as_refused_and_one_that_is_no_message_as_unreadable() {
        let poses = source(SampleKind::Pose, &[]).unwrap();
        let of = poses.first_type();
        let arrival = |bad| poses.arrival("stylus/pose", of, Err(bad));
        assert!(matches!(
            arrival(BadMessage::Quaternion),
            Arrival::Refused(0, "quaternion", _)
        ));
        assert!(matches!(
            arrival(BadMessage::Stamp),
            Arrival::Refused(0, "stamp", _)
        ));
        assert!(matches!(
            arrival(BadMessage::Malformed),
            Arrival::Unreadable("stylus/pose", _)
        ));
    }
}
