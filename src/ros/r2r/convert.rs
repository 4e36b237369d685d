//! Messages of the node into those of r2r and back, field by field.
//!
//! The two differ in nothing but the type; `generate/` lists the fields, and the compiler sees when one is missing on either side.

use crate::ros::messages as ours;

/// The same value as the other side has it.
pub(super) trait Convert<T> {
    /// Makes it.
    fn convert(self) -> T;
}

macro_rules! the_same {
    ($($plain:ty),+) => {
        $(impl Convert<$plain> for $plain {
            fn convert(self) -> $plain {
                self
            }
        })+
    };
}
the_same!(bool, u8, i32, u32, u64, f32, f64);

impl Convert<String> for String {
    /// Without zeros: a string of C ends at the first, and r2r panics on one.
    fn convert(mut self) -> String {
        self.retain(|c| c != '\0');
        self
    }
}

impl<A: Convert<B>, B> Convert<Vec<B>> for Vec<A> {
    fn convert(self) -> Vec<B> {
        self.into_iter().map(Convert::convert).collect()
    }
}

/// Both directions, the field of ours first: `both_ways!(UndoRequest = super::touchup_msgs::srv::Undo::Request { strokes: strokes })`.
macro_rules! both_ways {
    ($($ours:ident = $($theirs:ident)::+ { $($mine:ident: $other:ident),+ $(,)? })+) => {
        $(impl Convert<$($theirs)::+> for ours::$ours {
            fn convert(self) -> $($theirs)::+ {
                $($theirs)::+ { $($other: self.$mine.convert(),)+ }
            }
        }
        impl Convert<ours::$ours> for $($theirs)::+ {
            fn convert(self) -> ours::$ours {
                ours::$ours { $($mine: self.$other.convert(),)+ }
            }
        })+
    };
}

include!(concat!(env!("OUT_DIR"), "/conversions.rs"));

#[cfg(test)]
mod tests {
    use serde::Serialize;

    use r2r::{
        builtin_interfaces, diagnostic_msgs, geometry_msgs, nav_msgs, rosgraph_msgs, std_msgs, tf2_msgs,
        visualization_msgs,
    };

    use super::super::filled::filled;
    use super::super::{std_srvs, touchup_msgs};
    use super::*;

    /// The same text from both sides: names, order and values of all fields, by the code that serde made for each. And the
    /// message itself comes back.
    fn both_agree<M, T>()
    where
        M: ours::RosMessage + Convert<T>,
        T: Clone + Serialize + Convert<M>,
    {
        let ours: M = filled();
        let theirs: T = ours.clone().convert();
        assert_eq!(serde_json::to_string(&theirs).unwrap(), serde_json::to_string(&ours).unwrap());
        assert_eq!(theirs.convert(), ours);
    }

    macro_rules! all_agree {
        ($($ours:ident = $($theirs:ident)::+),+ $(,)?) => { $(both_agree::<ours::$ours, $($theirs)::+>();)+ };
    }

    #[test]
    fn every_field_of_a_standard_message_arrives() {
        all_agree!(
            Time = builtin_interfaces::msg::Time,
            Duration = builtin_interfaces::msg::Duration,
            WrenchStamped = geometry_msgs::msg::WrenchStamped,
            PoseStamped = geometry_msgs::msg::PoseStamped,
            PointStamped = geometry_msgs::msg::PointStamped,
            TFMessage = tf2_msgs::msg::TFMessage,
            Clock = rosgraph_msgs::msg::Clock,
            Path = nav_msgs::msg::Path,
            DiagnosticArray = diagnostic_msgs::msg::DiagnosticArray,
            Marker = visualization_msgs::msg::Marker,
            MarkerArray = visualization_msgs::msg::MarkerArray,
            SetBoolRequest = std_srvs::srv::SetBool::Request,
            SetBoolResponse = std_srvs::srv::SetBool::Response,
            TriggerResponse = std_srvs::srv::Trigger::Response,
        );
    }

    #[test]
    fn every_field_of_an_own_message_arrives() {
        use touchup_msgs::{action::Probe, msg, srv};
        all_agree!(
            FeatureArray = msg::FeatureArray,
            MeshPatch = msg::MeshPatch,
            HapticMismatch = msg::HapticMismatch,
            ProbeResult = msg::ProbeResult,
            ProbeTouch = msg::ProbeTouch,
            ProbeGoal = Probe::Goal,
            ProbeResponse = Probe::Result,
            ProbeFeedback = Probe::Feedback,
            FlagFeatureRequest = srv::FlagFeature::Request,
            FlagFeatureResponse = srv::FlagFeature::Response,
            UnflagFeatureRequest = srv::UnflagFeature::Request,
            UnflagFeatureResponse = srv::UnflagFeature::Response,
            DetectFeaturesRequest = srv::DetectFeatures::Request,
            DetectFeaturesResponse = srv::DetectFeatures::Response,
            SaveMeshRequest = srv::SaveMesh::Request,
            SaveMeshResponse = srv::SaveMesh::Response,
            ResyncMeshRequest = srv::ResyncMesh::Request,
            ResyncMeshResponse = srv::ResyncMesh::Response,
            UndoRequest = srv::Undo::Request,
            UndoResponse = srv::Undo::Response,
            ProbeFeatureRequest = srv::ProbeFeature::Request,
            ProbeFeatureResponse = srv::ProbeFeature::Response,
        );
    }

    #[test]
    fn a_marker_is_what_its_constants_say() {
        let ours = ours::Marker { r#type: ours::Marker::TRIANGLE_LIST, ..Default::default() };
        let theirs: visualization_msgs::msg::Marker = ours.convert();
        assert_eq!((theirs.type_, theirs.pose.orientation.w), (11, 1.0));
    }

    #[test]
    fn a_zero_in_a_text_does_not_reach_c() {
        let ours = ours::Header { frame_id: "a\0b".into(), ..Default::default() };
        let theirs: std_msgs::msg::Header = ours.convert();
        assert_eq!(theirs.frame_id, "ab");
    }

    #[test]
    fn the_build_of_the_documentation_has_every_package() {
        let docs = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/ros.md")).unwrap();
        let filter = docs.lines().find_map(|line| line.strip_prefix("export IDL_PACKAGE_FILTER=")).unwrap();
        let built: Vec<_> = filter.trim_matches('"').split(';').collect();
        let words =
            include_str!(concat!(env!("OUT_DIR"), "/conversions.rs")).split(|c: char| !c.is_alphanumeric() && c != '_');
        let is_package = |word: &&str| ["_msgs", "_srvs", "_interfaces"].iter().any(|end| word.ends_with(end));
        let missing: Vec<_> = words.filter(is_package).filter(|package| !built.contains(package)).collect();
        assert_eq!(missing, Vec::<&str>::new());
    }
}
