//! Parameters of a UR, and its deadlines.

use std::path::PathBuf;
use std::time::Duration;

use nalgebra::{Isometry3, Vector3};

use super::error::UrError;
use touchup_probing::arm::check_parameters;
use touchup_session::clock::Clock;

/// One UR arm with a probe.
#[derive(Clone, Debug)]
pub struct UrParams {
    /// Name or address of the controller.
    pub host: String,
    /// Folder of Python packages with ur-rtde, as printed by `touchup ur setup`.
    pub site_packages: PathBuf,
    /// The program that speaks to the arm: touchup itself, built with feature `ur`.
    pub program: PathBuf,
    /// Pose of the tip (centre of its ball, z from tip to handle) in the flange F.
    pub pose_ft: Isometry3<f64>,
    /// Mass of everything on the flange, kg.
    pub mass: f64,
    /// Its centre of mass, m in F.
    pub centre: Vector3<f64>,
    /// Highest commanded speed of the tip, m/s; [`touchup_probing::arm::Limits`] are below it.
    pub top_speed: f64,
    /// Maximum pressing force, N.
    pub top_force: f64,
    /// Damping of force mode, 0 to 1: the higher, the sooner the tip slows down without a push.
    pub damping: f64,
    /// Gain of force mode, 0 to 2: below one it is calmer on stiff parts.
    pub gain: f64,
    /// Maximum durations.
    pub deadlines: Deadlines,
    /// Clock of the deadlines.
    pub clock: Clock,
    /// Whether to believe a controller that greets as a simulation in lock step: its stamps then
    /// replace the machine's clock. Both have to say so, for a deadline that a controller could
    /// lift would be none.
    pub is_lock_step: bool,
}

impl UrParams {
    /// A probe of 150 mm and 0.25 kg, held upright; to adapt to the mounted probe.
    pub fn new(host: impl Into<String>, site_packages: impl Into<PathBuf>) -> Self {
        let upright =
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Self {
            host: host.into(),
            site_packages: site_packages.into(),
            program: std::env::current_exe().unwrap_or_else(|_| "touchup".into()),
            pose_ft: Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.15).into(), upright),
            mass: 0.25,
            centre: Vector3::new(0.0, 0.0, 0.05),
            // the limit of collaborative operation at reduced speed
            top_speed: 0.25,
            top_force: 50.0,
            // defaults of ur_rtde's program
            damping: 0.025,
            gain: 0.5,
            deadlines: Deadlines::default(),
            clock: Clock::system(),
            is_lock_step: false,
        }
    }

    /// Checks the parameters before connecting.
    pub(super) fn check(&self) -> Result<(), UrError> {
        let Deadlines {
            connect,
            beat,
            silent,
            order,
            dashboard,
        } = self.deadlines;
        let (place, centre) = (self.pose_ft.translation.vector.norm(), self.centre.norm());
        let numbers = [
            ("the tip's distance from the flange", place, 0.0, 1.0, " m"),
            ("the payload", self.mass, 0.0, 16.0, " kg"),
            // three zeros would leave the centre unchanged
            (
                "the distance of the payload's centre",
                centre,
                1e-6,
                1.0,
                " m",
            ),
            ("the largest speed", self.top_speed, 1e-3, 1.0, " m/s"),
            ("the largest force", self.top_force, 0.1, 150.0, " N"),
            ("the damping of force mode", self.damping, 0.0, 1.0, ""),
            ("the gain of force mode", self.gain, 0.0, 2.0, ""),
        ];
        let times = [
            ("the time to connect", connect, 30.0),
            ("the time between two beats", beat, 0.2),
            ("the time between two states", silent, 0.2),
            ("the time of an order", order, 1.0),
            ("the time of an answer of the dashboard", dashboard, 5.0),
        ]
        .map(|(what, time, most)| (what, time.as_secs_f64(), 0.01, most, " s"));
        check_parameters(numbers.into_iter().chain(times)).map_err(UrError::Parameters)
    }
}

/// Deadlines; longer calls are faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deadlines {
    /// Maximum time from the start of the client until the arm takes commands.
    pub connect: Duration,
    /// Maximum time between two lines of the client.
    pub beat: Duration,
    /// Maximum time between two states of the arm.
    pub silent: Duration,
    /// Maximum time from an order to the return of its call.
    pub order: Duration,
    /// Maximum time of one answer of the dashboard.
    pub dashboard: Duration,
}

impl Default for Deadlines {
    /// A fault and the braking after it take less than 200 ms together; a machine without real-time
    /// priority is late by 25 ms now and then. While a call hangs nothing feeds the watchdog of the
    /// controller, 100 ms, which then acts sooner if it works.
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(10),
            beat: Duration::from_millis(80),
            silent: Duration::from_millis(80),
            order: Duration::from_millis(120),
            dashboard: Duration::from_millis(500),
        }
    }
}
