//! Stand-in for the code that r2r generates from `touchup_msgs` and `std_srvs` in a sourced ROS:
//! only the fields, listed by `generate/`, for the compiler. For feature `r2r-check` alone; nothing
//! here can run.
#![expect(
    non_snake_case,
    reason = "services and actions are modules there, with the names of their files"
)]

/// Functions without an implementation here.
macro_rules! needs_ros {
    ($(fn $name:ident($($taken:ty),*) -> $given:ty;)+) => {
        $(fn $name($(_: $taken),*) -> $given {
            unimplemented!("needs ROS")
        })+
    };
}

/// A message: its fields, and the trait of r2r.
macro_rules! message {
    ($name:ident { $($field:ident: $kind:ty),* $(,)? }) => {
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $(pub $field: $kind,)*
        }

        impl r2r::WrappedTypesupport for $name {
            type CStruct = ();

            needs_ros! {
                fn get_ts() -> &'static r2r_rcl::rosidl_message_type_support_t;
                fn create_msg() -> *mut ();
                fn destroy_msg(*mut ()) -> ();
                fn from_native(&()) -> Self;
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

                needs_ros! {
                    fn get_ts() -> &'static r2r_rcl::rosidl_service_type_support_t;
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

                needs_ros! {
                    fn get_ts() -> &'static r2r_rcl::rosidl_action_type_support_t;
                    fn make_goal_request_msg(UUID, Goal) -> Wire::Request;
                    fn make_goal_response_msg(bool, Time) -> Wire::Response;
                    fn make_feedback_msg(UUID, Feedback) -> Feedback;
                    fn make_result_request_msg(UUID) -> Wire::Request;
                    fn make_result_response_msg(i8, Result) -> Wire::Response;
                    fn destructure_goal_request_msg(Wire::Request) -> (UUID, Goal);
                    fn destructure_goal_response_msg(Wire::Response) -> (bool, Time);
                    fn destructure_feedback_msg(Feedback) -> (UUID, Feedback);
                    fn destructure_result_response_msg(Wire::Response) -> (i8, Result);
                    fn destructure_result_request_msg(Wire::Request) -> UUID;
                }
            }
        }
    };
}

// carrier of a goal and a result on the wire: any service fits here
service!(Wire {} {});

include!(concat!(env!("OUT_DIR"), "/stand_ins.rs"));
