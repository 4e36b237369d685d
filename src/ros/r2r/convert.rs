//! Messages of the node into those of r2r and back, field by field.
//!
//! The two differ in nothing but the type; every field is named once, and the compiler sees when one is missing on either
//! side.

use r2r::{
    builtin_interfaces, diagnostic_msgs, geometry_msgs, nav_msgs, rosgraph_msgs, sensor_msgs, std_msgs, tf2_msgs,
    visualization_msgs,
};

use super::{std_srvs, touchup_msgs};
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

/// Both directions: `both_ways!(Header = std_msgs::msg::Header { stamp, frame_id })`; after a `;` the fields that are named
/// otherwise over there.
macro_rules! both_ways {
    ($($ours:ident = $($theirs:ident)::+ { $($field:ident),+ $(; $mine:ident = $other:ident)* })+) => {
        $(impl Convert<$($theirs)::+> for ours::$ours {
            fn convert(self) -> $($theirs)::+ {
                $($theirs)::+ { $($field: self.$field.convert(),)+ $($other: self.$mine.convert(),)* }
            }
        }
        impl Convert<ours::$ours> for $($theirs)::+ {
            fn convert(self) -> ours::$ours {
                ours::$ours { $($field: self.$field.convert(),)+ $($mine: self.$other.convert(),)* }
            }
        })+
    };
}

both_ways! {
    Time = builtin_interfaces::msg::Time { sec, nanosec }
    Duration = builtin_interfaces::msg::Duration { sec, nanosec }
    Header = std_msgs::msg::Header { stamp, frame_id }
    ColorRGBA = std_msgs::msg::ColorRGBA { r, g, b, a }
    Point = geometry_msgs::msg::Point { x, y, z }
    Vector3 = geometry_msgs::msg::Vector3 { x, y, z }
    Quaternion = geometry_msgs::msg::Quaternion { x, y, z, w }
    Pose = geometry_msgs::msg::Pose { position, orientation }
    Transform = geometry_msgs::msg::Transform { translation, rotation }
    Wrench = geometry_msgs::msg::Wrench { force, torque }
    PointStamped = geometry_msgs::msg::PointStamped { header, point }
    PoseStamped = geometry_msgs::msg::PoseStamped { header, pose }
    WrenchStamped = geometry_msgs::msg::WrenchStamped { header, wrench }
    TransformStamped = geometry_msgs::msg::TransformStamped { header, child_frame_id, transform }
    TFMessage = tf2_msgs::msg::TFMessage { transforms }
    Clock = rosgraph_msgs::msg::Clock { clock }
    Path = nav_msgs::msg::Path { header, poses }
    KeyValue = diagnostic_msgs::msg::KeyValue { key, value }
    DiagnosticStatus = diagnostic_msgs::msg::DiagnosticStatus { level, name, message, hardware_id, values }
    DiagnosticArray = diagnostic_msgs::msg::DiagnosticArray { header, status }
    CompressedImage = sensor_msgs::msg::CompressedImage { header, format, data }
    UVCoordinate = visualization_msgs::msg::UVCoordinate { u, v }
    MeshFile = visualization_msgs::msg::MeshFile { filename, data }
    Marker = visualization_msgs::msg::Marker {
        header, ns, id, action, pose, scale, color, lifetime, frame_locked, points, colors, texture_resource, texture,
        uv_coordinates, text, mesh_resource, mesh_file, mesh_use_embedded_materials; r#type = type_
    }
    MarkerArray = visualization_msgs::msg::MarkerArray { markers }
}

both_ways! {
    Feature = touchup_msgs::msg::Feature {
        id, kind, status, fitted_to, touched, touch_count, search_radius, center, center_std, axis, axis_std, direction,
        diameter, diameter_std, length, length_std, width, width_std, depth, depth_std, cone_angle, cone_angle_std,
        through, convex, group, points
    }
    FeatureArray = touchup_msgs::msg::FeatureArray { header, session, mesh_version, features, unexplained }
    MeshPatch = touchup_msgs::msg::MeshPatch {
        header, session, version, base_version, part, part_count, removed_faces, vertices, positions, variance, support,
        faces, corners, removed_vertices, vertex_count, face_count
    }
    HapticMismatch = touchup_msgs::msg::HapticMismatch {
        header, contact_case, face, mesh_version, tip, actual_force, expected_force, linear, rotational, signed_distance
    }
    ProbeSettings = touchup_msgs::msg::ProbeSettings {
        quantity, tolerance, confidence, pattern, max_touches, max_duration, max_force, max_search_speed, max_link_speed,
        max_search_travel, dry_run
    }
    ProbeTouch = touchup_msgs::msg::ProbeTouch {
        header, id, index, verdict, accepted, reason, pose, contact, contact_std, normal, approach, deviation, speed,
        tip_radius, calibration, peak_wrench, curve_time, curve_travel, curve_force, curve_lateral_force
    }
    ProbeResult = touchup_msgs::msg::ProbeResult {
        header, id, code, message, feature, uncertainty, duration, max_force, touch_count
    }
    ProbeGoal = touchup_msgs::action::Probe::Goal { ids, settings }
    ProbeResponse = touchup_msgs::action::Probe::Result { header, code, message, ids, codes }
    ProbeFeedback = touchup_msgs::action::Probe::Feedback {
        id, feature, feature_count, phase, touch, touch_count, force, uncertainty, elapsed
    }
}

both_ways! {
    FlagFeatureRequest = touchup_msgs::srv::FlagFeature::Request { kind, point, search_radius }
    FlagFeatureResponse = touchup_msgs::srv::FlagFeature::Response { success, message, id }
    UnflagFeatureRequest = touchup_msgs::srv::UnflagFeature::Request { id }
    UnflagFeatureResponse = touchup_msgs::srv::UnflagFeature::Response { success, message }
    DetectFeaturesRequest = touchup_msgs::srv::DetectFeatures::Request { kinds }
    DetectFeaturesResponse = touchup_msgs::srv::DetectFeatures::Response { success, message, mesh_version, count, ids }
    SaveMeshRequest = touchup_msgs::srv::SaveMesh::Request { name, overwrite, with_features }
    SaveMeshResponse = touchup_msgs::srv::SaveMesh::Response {
        success, message, path, mesh_version, vertex_count, face_count
    }
    ResyncMeshRequest = touchup_msgs::srv::ResyncMesh::Request { session, version }
    ResyncMeshResponse = touchup_msgs::srv::ResyncMesh::Response { success, message, session, version }
    UndoRequest = touchup_msgs::srv::Undo::Request { strokes }
    UndoResponse = touchup_msgs::srv::Undo::Response { success, message, strokes, mesh_version }
    ProbeFeatureRequest = touchup_msgs::srv::ProbeFeature::Request { id, settings }
    ProbeFeatureResponse = touchup_msgs::srv::ProbeFeature::Response { result }
    TriggerResponse = std_srvs::srv::Trigger::Response { success, message }
    SetBoolRequest = std_srvs::srv::SetBool::Request { data }
    SetBoolResponse = std_srvs::srv::SetBool::Response { success, message }
}

#[cfg(test)]
mod tests {
    use serde::Serialize;

    use super::super::filled::filled;
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
        let (code, _) = include_str!("convert.rs").split_once("#[cfg(test)]").unwrap();
        let words = code.split(|c: char| !c.is_alphanumeric() && c != '_');
        let is_package = |word: &&str| ["_msgs", "_srvs", "_interfaces"].iter().any(|end| word.ends_with(end));
        let missing: Vec<_> = words.filter(is_package).filter(|package| !built.contains(package)).collect();
        assert_eq!(missing, Vec::<&str>::new());
    }
}
