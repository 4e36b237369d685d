//! Any arm behind ros2_control: joint_state_broadcaster and force_torque_sensor_broadcaster report
//! its state, and joint_trajectory_controller moves it.
//!
//! A velocity controller would keep the last command forever after the death of this process:
//! forward_command_controller and velocity_controllers have no timeout (ros2_controllers issue 95).
//! So every order is a trajectory of a few points that ends at rest within a fraction of a second,
//! and replaces the previous one: the arm stops without any live process here. There is no other
//! stop from here, and no state of its safety system: [`touchup_probing::arm::ArmError::GoesOn`]
//! says so.

mod arm;
mod brake_plan;
mod params;
mod reader;
mod topic_age;

pub use arm::Ros2ControlArm;
pub use params::Ros2ControlParams;
