//! What r2r generates of `touchup_msgs` and `std_srvs` where ROS is sourced, as far as the compiler looks: the fields of
//! `msg/`, and nothing behind them. For feature `r2r-check` alone; nothing here can run.
#![expect(non_snake_case, reason = "services and actions are modules there, with the names of their files")]

/// A message: its fields, and that r2r takes it for one.
macro_rules! message {
    ($name:ident { $($field:ident: $kind:ty),* $(,)? }) => {
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $(pub $field: $kind,)*
        }

        #[cfg(test)]
        impl $name {
            /// Type and name of each.
            pub const FIELDS: &[(&str, &str)] = &[$((stringify!($kind), stringify!($field))),*];
        }

        impl Default for $name {
            fn default() -> Self {
                unimplemented!("needs ROS")
            }
        }

        impl r2r::WrappedTypesupport for $name {
            type CStruct = ();

            fn get_ts() -> &'static r2r_rcl::rosidl_message_type_support_t {
                unimplemented!("needs ROS")
            }

            fn create_msg() -> *mut () {
                unimplemented!("needs ROS")
            }

            fn destroy_msg(_: *mut ()) {
                unimplemented!("needs ROS")
            }

            fn from_native((): &()) -> Self {
                unimplemented!("needs ROS")
            }

            fn copy_to_native(&self, (): &mut ()) {
                unimplemented!("needs ROS")
            }
        }
    };
}

/// A service: request and response.
macro_rules! service {
    ($name:ident { $($asked:tt)* } { $($answered:tt)* }) => {
        pub mod $name {
            message!(Request { $($asked)* });
            message!(Response { $($answered)* });

            #[derive(Clone, Debug)]
            pub struct Service();

            impl r2r::WrappedServiceTypeSupport for Service {
                type Request = Request;
                type Response = Response;

                fn get_ts() -> &'static r2r_rcl::rosidl_service_type_support_t {
                    unimplemented!("needs ROS")
                }
            }
        }
    };
}

pub mod std_srvs {
    pub mod srv {
        service!(Trigger {} { success: bool, message: String });
        service!(SetBool { data: bool } { success: bool, message: String });
    }
}

pub mod touchup_msgs {
    pub mod msg {
        use r2r::geometry_msgs::msg::{Point, Pose, Vector3, Wrench};
        use r2r::std_msgs::msg::Header;

        message!(Feature {
            id: u32,
            kind: u8,
            status: u8,
            fitted_to: u8,
            touched: f64,
            touch_count: u32,
            search_radius: f64,
            center: Point,
            center_std: f64,
            axis: Vector3,
            axis_std: f64,
            direction: Vector3,
            diameter: f64,
            diameter_std: f64,
            length: f64,
            length_std: f64,
            width: f64,
            width_std: f64,
            depth: f64,
            depth_std: f64,
            cone_angle: f64,
            cone_angle_std: f64,
            through: u8,
            convex: u8,
            group: i32,
            points: Vec<Point>,
        });

        message!(FeatureArray {
            header: Header,
            session: String,
            mesh_version: u64,
            features: Vec<Feature>,
            unexplained: f64,
        });

        message!(HapticMismatch {
            header: Header,
            contact_case: u8,
            face: u32,
            mesh_version: u64,
            tip: Point,
            actual_force: Vector3,
            expected_force: Vector3,
            linear: Vector3,
            rotational: Vector3,
            signed_distance: f64,
        });

        message!(MeshPatch {
            header: Header,
            session: String,
            version: u64,
            base_version: u64,
            part: u32,
            part_count: u32,
            removed_faces: Vec<u32>,
            vertices: Vec<u32>,
            positions: Vec<f32>,
            variance: Vec<f32>,
            support: Vec<u8>,
            faces: Vec<u32>,
            corners: Vec<u32>,
            removed_vertices: Vec<u32>,
            vertex_count: u32,
            face_count: u32,
        });

        message!(ProbeResult {
            header: Header,
            id: u32,
            code: u8,
            message: String,
            feature: Feature,
            uncertainty: f64,
            duration: f64,
            max_force: f64,
            touch_count: u32,
        });

        message!(ProbeSettings {
            quantity: u8,
            tolerance: f64,
            confidence: f64,
            pattern: u8,
            max_touches: u32,
            max_duration: f64,
            max_force: f64,
            max_search_speed: f64,
            max_link_speed: f64,
            max_search_travel: f64,
            dry_run: bool,
        });

        message!(ProbeTouch {
            header: Header,
            id: u32,
            index: u32,
            verdict: u8,
            accepted: bool,
            reason: String,
            pose: Pose,
            contact: Point,
            contact_std: f64,
            normal: Vector3,
            approach: Vector3,
            deviation: f64,
            speed: f64,
            tip_radius: f64,
            calibration: String,
            peak_wrench: Wrench,
            curve_time: Vec<f32>,
            curve_travel: Vec<f32>,
            curve_force: Vec<f32>,
            curve_lateral_force: Vec<f32>,
        });
    }

    pub mod srv {
        service!(DetectFeatures { kinds: Vec<u8> } {
            success: bool,
            message: String,
            mesh_version: u64,
            count: u32,
            ids: Vec<u32>,
        });
        service!(FlagFeature {
            kind: u8,
            point: r2r::geometry_msgs::msg::PointStamped,
            search_radius: f64,
        } {
            success: bool,
            message: String,
            id: u32,
        });
        service!(ProbeFeature { id: u32, settings: super::super::msg::ProbeSettings } {
            result: super::super::msg::ProbeResult,
        });
        service!(ResyncMesh { session: String, version: u64 } {
            success: bool,
            message: String,
            session: String,
            version: u64,
        });
        service!(SaveMesh { name: String, overwrite: bool, with_features: bool } {
            success: bool,
            message: String,
            path: String,
            mesh_version: u64,
            vertex_count: u32,
            face_count: u32,
        });
        service!(Undo { strokes: u32 } { success: bool, message: String, strokes: u32, mesh_version: u64 });
        service!(UnflagFeature { id: u32 } { success: bool, message: String });
    }

    pub mod action {
        pub mod Probe {
            use r2r::builtin_interfaces::msg::Time;
            use r2r::std_msgs::msg::Header;
            use r2r::unique_identifier_msgs::msg::UUID;

            use super::super::msg::ProbeSettings;
            // what carries a goal and a result on the wire: any service will do here
            use super::super::srv::Undo as Wire;

            message!(Goal { ids: Vec<u32>, settings: ProbeSettings });
            message!(Result { header: Header, code: u8, message: String, ids: Vec<u32>, codes: Vec<u8> });
            message!(Feedback {
                id: u32,
                feature: u32,
                feature_count: u32,
                phase: u8,
                touch: u32,
                touch_count: u32,
                force: f64,
                uncertainty: f64,
                elapsed: f64,
            });

            #[derive(Clone, Debug)]
            pub struct Action();

            impl r2r::WrappedActionTypeSupport for Action {
                type Goal = Goal;
                type Result = Result;
                type Feedback = Feedback;
                type FeedbackMessage = Feedback;
                type SendGoal = Wire::Service;
                type GetResult = Wire::Service;

                fn get_ts() -> &'static r2r_rcl::rosidl_action_type_support_t {
                    unimplemented!("needs ROS")
                }

                fn make_goal_request_msg(_: UUID, _: Goal) -> Wire::Request {
                    unimplemented!("needs ROS")
                }

                fn make_goal_response_msg(_: bool, _: Time) -> Wire::Response {
                    unimplemented!("needs ROS")
                }

                fn make_feedback_msg(_: UUID, _: Feedback) -> Feedback {
                    unimplemented!("needs ROS")
                }

                fn make_result_request_msg(_: UUID) -> Wire::Request {
                    unimplemented!("needs ROS")
                }

                fn make_result_response_msg(_: i8, _: Result) -> Wire::Response {
                    unimplemented!("needs ROS")
                }

                fn destructure_goal_request_msg(_: Wire::Request) -> (UUID, Goal) {
                    unimplemented!("needs ROS")
                }

                fn destructure_goal_response_msg(_: Wire::Response) -> (bool, Time) {
                    unimplemented!("needs ROS")
                }

                fn destructure_feedback_msg(_: Feedback) -> (UUID, Feedback) {
                    unimplemented!("needs ROS")
                }

                fn destructure_result_response_msg(_: Wire::Response) -> (i8, Result) {
                    unimplemented!("needs ROS")
                }

                fn destructure_result_request_msg(_: Wire::Request) -> UUID {
                    unimplemented!("needs ROS")
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::std_srvs::srv::{SetBool, Trigger};
    use super::touchup_msgs::{action::Probe, msg, srv};

    type FieldTypes = [(&'static str, &'static str)];

    /// Type and name of the fields in one part of a file of `msg/`, as Rust has them.
    fn fields(part: &str) -> Vec<(String, String)> {
        let lines =
            part.lines().filter(|line| !line.starts_with('#') && !line.contains('=') && !line.trim().is_empty());
        lines
            .map(|line| {
                let (kind, name) = line.split_once(' ').unwrap();
                let (kind, is_list) = kind.strip_suffix("[]").map_or((kind, false), |item| (item, true));
                let kind = match kind.rsplit('/').next().unwrap() {
                    "string" => "String",
                    "uint8" => "u8",
                    "uint32" => "u32",
                    "uint64" => "u64",
                    "int32" => "i32",
                    "float32" => "f32",
                    "float64" => "f64",
                    other => other,
                };
                (if is_list { format!("Vec<{kind}>") } else { kind.to_owned() }, name.to_owned())
            })
            .collect()
    }

    #[test]
    fn the_fields_are_those_of_msg() {
        let files: [(&str, &str, &[&FieldTypes]); 15] = [
            ("msg", "Feature.msg", &[msg::Feature::FIELDS]),
            ("msg", "FeatureArray.msg", &[msg::FeatureArray::FIELDS]),
            ("msg", "HapticMismatch.msg", &[msg::HapticMismatch::FIELDS]),
            ("msg", "MeshPatch.msg", &[msg::MeshPatch::FIELDS]),
            ("msg", "ProbeResult.msg", &[msg::ProbeResult::FIELDS]),
            ("msg", "ProbeSettings.msg", &[msg::ProbeSettings::FIELDS]),
            ("msg", "ProbeTouch.msg", &[msg::ProbeTouch::FIELDS]),
            (
                "srv",
                "DetectFeatures.srv",
                &[srv::DetectFeatures::Request::FIELDS, srv::DetectFeatures::Response::FIELDS],
            ),
            ("srv", "FlagFeature.srv", &[srv::FlagFeature::Request::FIELDS, srv::FlagFeature::Response::FIELDS]),
            ("srv", "ProbeFeature.srv", &[srv::ProbeFeature::Request::FIELDS, srv::ProbeFeature::Response::FIELDS]),
            ("srv", "ResyncMesh.srv", &[srv::ResyncMesh::Request::FIELDS, srv::ResyncMesh::Response::FIELDS]),
            ("srv", "SaveMesh.srv", &[srv::SaveMesh::Request::FIELDS, srv::SaveMesh::Response::FIELDS]),
            ("srv", "Undo.srv", &[srv::Undo::Request::FIELDS, srv::Undo::Response::FIELDS]),
            ("srv", "UnflagFeature.srv", &[srv::UnflagFeature::Request::FIELDS, srv::UnflagFeature::Response::FIELDS]),
            ("action", "Probe.action", &[Probe::Goal::FIELDS, Probe::Result::FIELDS, Probe::Feedback::FIELDS]),
        ];
        let package = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("msg");
        let count: usize =
            ["msg", "srv", "action"].map(|kind| package.join(kind).read_dir().unwrap().count()).iter().sum();
        assert_eq!(count, files.len(), "a file of msg/ is not in this list");
        for (kind, name, parts) in files {
            let text = std::fs::read_to_string(package.join(kind).join(name)).unwrap();
            let here = parts.iter().map(|part| {
                let short = |kind: &str| kind.replace(' ', "").rsplit("::").next().unwrap().to_owned();
                part.iter().map(|(kind, name)| (short(kind), name.to_string())).collect::<Vec<_>>()
            });
            assert_eq!(text.split("\n---\n").map(fields).collect::<Vec<_>>(), here.collect::<Vec<_>>(), "{name}");
        }
    }

    #[test]
    fn the_fields_of_std_srvs_are_those_that_ros2_interface_show_tells() {
        let answer = [("bool", "success"), ("String", "message")];
        assert_eq!((Trigger::Request::FIELDS, Trigger::Response::FIELDS), (&[][..], &answer[..]));
        assert_eq!((SetBool::Request::FIELDS, SetBool::Response::FIELDS), (&[("bool", "data")][..], &answer[..]));
    }
}
