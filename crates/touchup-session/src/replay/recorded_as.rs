//! Location of poses and wrenches in a recording, by the same names for every verb, plan and call.

use serde::{Deserialize, Serialize};

use crate::scene::Scene;
use touchup_io::recording::{RecordingLayout, StampSource, Topics, TransformFrames};

/// Location of poses and wrenches; unnamed ones have their usual place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordedAs {
    /// `--pose-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_topic: Option<String>,
    /// `--wrench-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench_topic: Option<String>,
    /// `--markers-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub markers_topic: Option<String>,
    /// `--pose-frame`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_frame: Option<String>,
    /// `--base-frame`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_frame: Option<String>,
    /// `--stamp`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
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
