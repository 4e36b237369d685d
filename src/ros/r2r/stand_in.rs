//! What r2r generates of `touchup_msgs` and `std_srvs` where ROS is sourced, as far as the compiler looks: the fields, which
//! `generate/` lists, and nothing behind them. For feature `r2r-check` alone; nothing here can run.
#![expect(non_snake_case, reason = "services and actions are modules there, with the names of their files")]

/// A message: its fields, and that r2r takes it for one.
macro_rules! message {
    ($name:ident { $($field:ident: $kind:ty),* $(,)? }) => {
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $(pub $field: $kind,)*
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

/// An action: goal, result and feedback.
macro_rules! action {
    ($name:ident { $($goal:tt)* } { $($result:tt)* } { $($feedback:tt)* }) => {
        pub mod $name {
            use r2r::builtin_interfaces::msg::Time;
            use r2r::unique_identifier_msgs::msg::UUID;

            use crate::ros::r2r::stand_in::Wire;

            message!(Goal { $($goal)* });
            message!(Result { $($result)* });
            message!(Feedback { $($feedback)* });

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
    };
}

// what carries a goal and a result on the wire: any service will do here
service!(Wire {} {});

include!(concat!(env!("OUT_DIR"), "/stand_ins.rs"));
