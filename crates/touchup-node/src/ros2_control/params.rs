//! Parameters of an arm behind ros2_control, and its deadlines.

use std::sync::Arc;
use std::time::Duration;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use touchup_method::stylus::Payload;
use touchup_probing::arm::{ArmError, ArmGeometry, UrGeometry, check_parameters};
use touchup_session::clock::Clock;
use touchup_session::scene::Ros2ControlSection;

/// One arm behind ros2_control, with a probe.
#[derive(Clone, Debug)]
pub struct Ros2ControlParams {
    /// Topics of its messages, and its sensor.
    pub section: Ros2ControlSection,
    /// Kinematics from the joints to the flange F.
    pub geometry: ArmGeometry,
    /// Names of the joints from the base to the wrist, as in its joint states.
    pub joint_names: Vec<Arc<str>>,
    /// Pose of the tip (centre of its ball, z from tip to handle) in the flange.
    pub pose_ft: Isometry3<f64>,
    /// Everything on the sensor, its centre in the flange, gravity in the base B.
    pub payload: Payload,
    /// Stiffness of arm and probe in series, N/m; bounds the gain of a press.
    pub stiffness: f64,
    /// Time from a state to the motion that answers it, s, including network and controller.
    pub latency: f64,
    /// Highest commanded speed of the tip, m/s; [`touchup_probing::arm::Limits`] are below it.
    pub top_speed: f64,
    /// Maximum pressing force, N.
    pub top_force: f64,
    /// Highest speed of a joint, rad/s.
    pub top_joint_speed: f64,
    /// Maximum time from the start to states on all topics.
    pub connect: Duration,
    /// Maximum time between new messages of a topic, and maximum lateness of a message.
    pub silent: Duration,
    /// Clock of the deadlines.
    pub clock: Clock,
}

impl Default for Ros2ControlParams {
    /// Default topics of the controllers; a UR5e with a probe of 150 mm and 0.25 kg, held upright,
    /// its sensor in the flange.
    fn default() -> Self {
        let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let gravity_o = Vector3::new(0.0, 0.0, -9.81);
        Self {
            section: Ros2ControlSection::default(),
            geometry: UrGeometry::UR5E.into(),
            joint_names: (1..=6)
                .map(|number| format!("joint{number}").into())
                .collect(),
            pose_ft: Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.15).into(), upright),
            payload: Payload {
                mass: 0.25,
                p_sc: Vector3::new(0.0, 0.0, 0.05),
                gravity_o,
            },
            stiffness: 15e3,
            latency: 20e-3,
            // the limit of collaborative operation at reduced speed
            top_speed: 0.25,
            top_force: 50.0,
            top_joint_speed: 1.57,
            connect: Duration::from_secs(10),
            // a machine without real-time priority is late by 25 ms now and then
            silent: Duration::from_millis(60),
            clock: Clock::system(),
        }
    }
}

impl Ros2ControlParams {
    /// Checks the parameters before listening.
    pub(super) fn check(&self) -> Result<(), ArmError> {
        let (joints, names) = (self.geometry.joint_count(), self.joint_names.len());
        if joints != names {
            let reason = format!("the arm has {joints} joints, and {names} are named");
            return Err(ArmError::refused("its parameters", reason));
        }
        let (connect, silent) = (self.connect.as_secs_f64(), self.silent.as_secs_f64());
        check_parameters([
            ("the stiffness", self.stiffness, 10.0, 1e7, " N/m"),
            ("the latency", self.latency, 1e-3, 0.2, " s"),
            ("the largest speed", self.top_speed, 1e-3, 1.0, " m/s"),
            ("the largest force", self.top_force, 0.1, 150.0, " N"),
            (
                "the largest speed of a joint",
                self.top_joint_speed,
                1e-2,
                20.0,
                " rad/s",
            ),
            ("the time to connect", connect, 0.1, 60.0, " s"),
            ("the time between two states", silent, 0.02, 0.2, " s"),
        ])
    }
}
