//! Location of poses and wrenches in a recording, by the same names for every verb, plan and call.

use std::path::Path;

use clap::Args;
use serde::{Deserialize, Serialize, Serializer};

use super::{RecordedSurfaces, Recording, ReplayError, marker_filter};
use crate::scene::Scene;
use touchup_io::recording::{RecordingLayout, StampSource, Topics, TransformFrames};
use touchup_method::stylus::MarkerFilter;

/// Location of poses and wrenches; unnamed ones have their usual place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Args)]
#[serde(deny_unknown_fields, default)]
pub struct RecordedAs {
    /// geometry_msgs/WrenchStamped or another wrench: of the part on the stylus [default:
    /// /stylus/wrench]
    #[arg(long, value_name = "TOPIC")]
    pub wrench_topic: Option<String>,
    /// geometry_msgs/PoseStamped or another pose: ball centre in the frame of the scan, unless
    /// tip.offset_mm and scan_to_space of the scene apply [default: /stylus/pose, with --pose-frame
    /// /tf]
    #[arg(long, value_name = "TOPIC")]
    pub pose_topic: Option<String>,
    /// Frame with the pose, such as tool0, in the transforms on --pose-topic and its _static
    #[arg(long, value_name = "FRAME")]
    pub pose_frame: Option<String>,
    /// With --pose-frame: reference frame of the pose [default: the root of the tree]
    #[arg(long, value_name = "FRAME", requires = "pose_frame")]
    pub base_frame: Option<String>,
    /// sensor_msgs/PointCloud2: markers on the stylus, in place of the pose; the scene has their
    /// positions
    #[arg(long, value_name = "TOPIC", conflicts_with_all = ["pose_topic", "pose_frame"])]
    pub markers_topic: Option<String>,
    /// Name of a [`StampSource`]; a flag of its own
    #[arg(skip)]
    pub stamp: Option<String>,
}

/// Named places alone; the id of a job depends on their order.
impl Serialize for RecordedAs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let places = [
            ("pose_topic", &self.pose_topic),
            ("wrench_topic", &self.wrench_topic),
            ("markers_topic", &self.markers_topic),
            ("pose_frame", &self.pose_frame),
            ("base_frame", &self.base_frame),
            ("stamp", &self.stamp),
        ];
        serializer.collect_map(places.into_iter().filter(|(_, place)| place.is_some()))
    }
}

impl From<Topics> for RecordedAs {
    fn from(topics: Topics) -> Self {
        Self {
            wrench_topic: Some(topics.wrench),
            pose_topic: Some(topics.pose),
            markers_topic: topics.markers,
            ..Self::default()
        }
    }
}

/// Topic of the transforms, unless another is named.
const TRANSFORMS: &str = "/tf";

impl RecordedAs {
    pub(crate) fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// The named topics and frames, and the table columns that the scene names.
    pub fn layout(&self, scene: &Scene) -> RecordingLayout {
        let own = Topics::default();
        let pose = if self.pose_frame.is_some() {
            TRANSFORMS.to_owned()
        } else {
            own.pose
        };
        let topics = Topics {
            pose: self.pose_topic.clone().unwrap_or(pose),
            wrench: self.wrench_topic.clone().unwrap_or(own.wrench),
            markers: self.markers_topic.clone(),
        };
        let frames = self.pose_frame.clone().map(|moving| TransformFrames {
            moving,
            base: self.base_frame.clone(),
        });
        RecordingLayout {
            topics,
            frames,
            columns: scene.table_columns(),
        }
    }

    /// Opens a recording with the known surfaces beside it, and the filter that computes the poses
    /// of its markers.
    ///
    /// # Errors
    /// [`ReplayError::Markers`], [`ReplayError::Read`], [`ReplayError::Known`].
    pub fn open(
        &self,
        path: &Path,
        scene: &Scene,
        stamps: StampSource,
    ) -> Result<(Recording, Option<MarkerFilter>), ReplayError> {
        let markers = marker_filter(scene, self.markers_topic.as_deref())?;
        let mut recording = Recording::open(path, self.layout(scene), stamps)?;
        recording.known = RecordedSurfaces::beside(path)?;
        Ok((recording, markers))
    }

    /// Which time of a message counts.
    ///
    /// # Errors
    /// If it is no known word, and if names contradict each other.
    pub fn checked_stamps(&self) -> Result<StampSource, String> {
        if self.base_frame.is_some() && self.pose_frame.is_none() {
            return Err("base_frame is the frame in which the pose of pose_frame is wanted: name pose_frame".to_owned());
        }
        if self.markers_topic.is_some() && (self.pose_topic.is_some() || self.pose_frame.is_some())
        {
            return Err(
                "markers_topic is read in place of the pose: leave out pose_topic and pose_frame"
                    .to_owned(),
            );
        }
        let named = self
            .stamp
            .as_deref()
            .map(|name| StampSource::of_name(name).ok_or(name))
            .transpose();
        named
            .map(Option::unwrap_or_default)
            .map_err(|other| format!("stamp is {other}; it must be header or log"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Jobs of earlier plans have this text in their ids.
    #[test]
    fn places_are_written_in_the_order_of_earlier_plans() {
        let text = r#"{"pose_topic":"/p","wrench_topic":"/w","markers_topic":"/m","pose_frame":"t","base_frame":"b","stamp":"log"}"#;
        for text in [text, r#"{"wrench_topic":"/w","pose_frame":"t"}"#, "{}"] {
            let recorded: RecordedAs = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&recorded).unwrap(), text);
        }
    }

    #[test]
    fn names_that_do_not_go_together_are_refused() {
        let some = |name: &str| Some(name.to_owned());
        let usual = RecordedAs::default();
        assert_eq!(usual.checked_stamps(), Ok(StampSource::Header));
        assert_eq!(
            RecordedAs {
                stamp: some("log"),
                ..usual.clone()
            }
            .checked_stamps(),
            Ok(StampSource::Log)
        );
        for (recorded, word) in [
            (
                RecordedAs {
                    stamp: some("Log"),
                    ..usual.clone()
                },
                "stamp is Log",
            ),
            (
                RecordedAs {
                    base_frame: some("base"),
                    ..usual.clone()
                },
                "name pose_frame",
            ),
            (
                RecordedAs {
                    markers_topic: some("/m"),
                    pose_topic: some("/p"),
                    ..usual.clone()
                },
                "leave out pose_topic",
            ),
            (
                RecordedAs {
                    markers_topic: some("/m"),
                    pose_frame: some("t"),
                    ..usual.clone()
                },
                "leave out pose_topic",
            ),
        ] {
            assert!(
                recorded.checked_stamps().unwrap_err().contains(word),
                "{recorded:?}"
            );
        }
        let layout = RecordedAs {
            pose_frame: some("tool0"),
            ..usual
        }
        .layout(&Scene::default());
        assert_eq!(
            (layout.topics.pose.as_str(), layout.topics.wrench.as_str()),
            ("/tf", "/stylus/wrench")
        );
    }
}
