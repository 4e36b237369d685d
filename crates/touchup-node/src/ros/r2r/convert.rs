//! Conversion of the node's messages to those of r2r and back, field by field.
//!
//! The two differ only in type; `generate/` lists the fields, and the compiler notices a missing
//! one on either side.

use r2r::WrappedServiceTypeSupport;

use crate::ros::messages::{self as ours, RosService};

/// A value with a counterpart in r2r.
pub(super) trait Convert: Sized {
    /// type in r2r
    type Theirs;

    /// Converts to r2r.
    fn theirs(self) -> Self::Theirs;

    /// Converts from r2r.
    fn ours(theirs: Self::Theirs) -> Self;
}

/// A service of r2r.
pub(super) trait R2rService:
    RosService<Request: Convert<Theirs: Clone>, Response: Convert>
{
    /// type in r2r
    type Theirs: WrappedServiceTypeSupport<
            Request = <Self::Request as Convert>::Theirs,
            Response = <Self::Response as Convert>::Theirs,
        > + 'static;
}

macro_rules! the_same {
    ($($plain:ty),+) => {
        $(impl Convert for $plain {
            type Theirs = Self;

            fn theirs(self) -> Self {
                self
            }

            fn ours(theirs: Self) -> Self {
                theirs
            }
        })+
    };
}
the_same!(bool, u8, i32, u32, i64, u64, f32, f64);

impl Convert for String {
    type Theirs = Self;

    /// Without zeros: a C string ends at the first, and r2r panics on one.
    fn theirs(mut self) -> Self {
        self.retain(|c| c != '\0');
        self
    }

    fn ours(theirs: Self) -> Self {
        theirs
    }
}

impl<A: Convert> Convert for Vec<A> {
    type Theirs = Vec<A::Theirs>;

    fn theirs(self) -> Self::Theirs {
        self.into_iter().map(A::theirs).collect()
    }

    fn ours(theirs: Self::Theirs) -> Self {
        theirs.into_iter().map(A::ours).collect()
    }
}

/// A message, the field of ours first: `message!(Marker = r2r::visualization_msgs::msg::Marker {
/// r#type: type_ })`.
macro_rules! message {
    ($ours:ident = $($theirs:ident)::+ {}) => {
        impl Convert for ours::$ours {
            type Theirs = $($theirs)::+;

            fn theirs(self) -> Self::Theirs {
                $($theirs)::+ {}
            }

            fn ours(_: Self::Theirs) -> Self {
                Self::default()
            }
        }
    };
    ($ours:ident = $($theirs:ident)::+ { $($mine:ident: $other:ident),+ $(,)? }) => {
        impl Convert for ours::$ours {
            type Theirs = $($theirs)::+;

            fn theirs(self) -> Self::Theirs {
                $($theirs)::+ { $($other: self.$mine.theirs(),)+ }
            }

            fn ours(theirs: Self::Theirs) -> Self {
                Self { $($mine: Convert::ours(theirs.$other),)+ }
            }
        }
    };
}

/// A service: `service!(Undo = super::touchup_msgs::srv::Undo::Service)`.
macro_rules! service {
    ($ours:ident = $($theirs:ident)::+) => {
        impl R2rService for ours::$ours {
            type Theirs = $($theirs)::+;
        }
    };
}

include!(concat!(env!("OUT_DIR"), "/conversions.rs"));

#[cfg(test)]
mod tests {
    use serde::Serialize;

    use super::*;

    /// Asserts the same text from both sides: names, order and values of all fields, by serde's
    /// code for each, and that the message converts back. Its fields come from rosbags.
    fn both_agree<M: ours::RosMessage + Convert<Theirs: Clone + Serialize>>() {
        let all = include_str!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/data/ros_cdr.json"
        ));
        let mut all: serde_json::Value = serde_json::from_str(all).unwrap();
        let ours: M = serde_json::from_value(all[M::TYPE_NAME]["fields"].take()).unwrap();
        let theirs = ours.clone().theirs();
        assert_eq!(
            serde_json::to_string(&theirs).unwrap(),
            serde_json::to_string(&ours).unwrap()
        );
        assert_eq!(M::ours(theirs), ours);
    }

    macro_rules! all_agree {
        ($($ours:ident),+ $(,)?) => { $(both_agree::<ours::$ours>();)+ };
    }

    #[test]
    fn every_field_of_a_standard_message_arrives() {
        all_agree!(
            Time,
            Duration,
            WrenchStamped,
            PoseStamped,
            PointStamped,
            TFMessage,
            Clock,
            Path,
            DiagnosticArray,
            Marker,
            MarkerArray,
            SetBoolRequest,
            SetBoolResponse,
            TriggerResponse,
            GetParametersResponse,
            DescribeParametersResponse,
            ParameterEvent,
        );
    }

    #[test]
    fn every_field_of_an_own_message_arrives() {
        all_agree!(
            FeatureArray,
            MeshPatch,
            HapticMismatch,
            ProbeResult,
            ProbeTouch,
            ProbeGoal,
            ProbeResponse,
            ProbeFeedback,
            FlagFeatureRequest,
            FlagFeatureResponse,
            UnflagFeatureRequest,
            UnflagFeatureResponse,
            DetectFeaturesRequest,
            DetectFeaturesResponse,
            SaveMeshRequest,
            SaveMeshResponse,
            ResyncMeshRequest,
            ResyncMeshResponse,
            UndoRequest,
            UndoResponse,
            TakeOutTouchRequest,
            TakeOutTouchResponse,
            ProbeFeatureRequest,
            ProbeFeatureResponse,
        );
    }

    #[test]
    fn a_marker_is_what_its_constants_say() {
        let ours = ours::Marker {
            r#type: ours::Marker::TRIANGLE_LIST,
            frame_locked: true,
            ..Default::default()
        };
        let theirs = ours.theirs();
        assert_eq!((theirs.type_, theirs.pose.orientation.w), (11, 1.0));
        assert_eq!(
            (theirs.frame_locked, theirs.mesh_use_embedded_materials),
            (true, false)
        );
    }

    #[test]
    fn a_zero_in_a_text_does_not_reach_c() {
        let ours = ours::Header {
            frame_id: "a\0b".into(),
            ..Default::default()
        };
        assert_eq!(ours.theirs().frame_id, "ab");
    }

    #[test]
    fn the_build_of_the_documentation_has_every_package() {
        let docs =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/ros.md"))
                .unwrap();
        let filter = docs
            .lines()
            .find_map(|line| line.strip_prefix("export IDL_PACKAGE_FILTER="))
            .unwrap();
        let built: Vec<_> = filter.trim_matches('"').split(';').collect();
        let words = include_str!(concat!(env!("OUT_DIR"), "/conversions.rs"))
            .split(|c: char| !c.is_alphanumeric() && c != '_');
        let is_package = |word: &&str| {
            ["_msgs", "_srvs", "_interfaces"]
                .iter()
                .any(|end| word.ends_with(end))
        };
        let missing: Vec<_> = words
            .filter(is_package)
            .filter(|package| !built.contains(package))
            .collect();
        assert_eq!(missing, Vec::<&str>::new());
    }
}
