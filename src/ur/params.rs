//! Parameters of a UR, and its deadlines.

use std::path::PathBuf;
use std::time::Duration;

use nalgebra::{Isometry3, Vector3};

use super::error::UrError;
use crate::clock::Clock;

/// One UR arm with a probe.
#[derive(Clone, Debug)]
pub struct UrParams {
    /// Name or address of the controller.
    pub host: String,
    /// Folder of Python packages with ur-rtde in it, as `touchup ur setup` prints it.
    pub site_packages: PathBuf,
    /// The program that speaks to the arm: touchup itself, built with feature `ur`.
    pub program: PathBuf,
    /// The tip (centre of its ball, z from tip to handle) in the flange F.
    pub pose_ft: Isometry3<f64>,
    /// Of all that hangs on the flange, kg.
    pub mass: f64,
    /// Its centre of mass, m in F.
    pub centre: Vector3<f64>,
    /// Highest commanded speed of the tip, m/s; [`crate::probing::arm::Limits`] are below it.
    pub top_speed: f64,
    /// Most that is ever pressed with, N.
    pub top_force: f64,
    /// Of force mode, 0 to 1: the higher, the sooner the tip is slower again where nothing pushes.
    pub damping: f64,
    /// Of force mode, 0 to 2: below one it is calmer on stiff parts.
    pub gain: f64,
    /// How long what may take.
    pub deadlines: Deadlines,
    /// On which the deadlines are kept.
    pub clock: Clock,
    /// Whether a controller that greets as a simulation in lock step is believed: its stamps then
    /// take the place of the machine's clock. Both have to say so, for a deadline that a controller
    /// could lift would be none.
    pub is_lock_step: bool,
}

impl UrParams {
    /// A probe of 150 mm and 0.25 kg, held upright; to be set to what is mounted.
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
            // as the program of ur_rtde has them
            damping: 0.025,
            gain: 0.5,
            deadlines: Deadlines::default(),
            clock: Clock::system(),
            is_lock_step: false,
        }
    }

    /// Checks the parameters before anything is connected.
    pub(super) fn check(&self) -> Result<(), UrError> {
        let within =
            |what: &'static str, value: f64, lowest: f64, highest: f64, unit: &'static str| {
                // what is no number is in no range
                let is_in = (lowest..=highest).contains(&value);
                if is_in {
                    Ok(())
                } else {
                    Err(UrError::BadParameter {
                        what,
                        value,
                        lowest,
                        highest,
                        unit,
                    })
                }
            };
        let place = self.pose_ft.translation.vector;
        within(
            "the tip's distance from the flange",
            place.norm(),
            0.0,
            1.0,
            "m",
        )?;
        within("the payload", self.mass, 0.0, 16.0, "kg")?;
        // three zeros would leave the centre as it is
        within(
            "the distance of the payload's centre",
            self.centre.norm(),
            1e-6,
            1.0,
            "m",
        )?;
        within("the largest speed", self.top_speed, 1e-3, 1.0, "m/s")?;
        within("the largest force", self.top_force, 0.1, 150.0, "N")?;
        within("the damping of force mode", self.damping, 0.0, 1.0, "")?;
        within("the gain of force mode", self.gain, 0.0, 2.0, "")?;
        let Deadlines {
            connect,
            beat,
            silent,
            order,
            dashboard,
        } = self.deadlines;
        let times = [
            ("the time to connect", connect, 30.0),
            ("the time between two beats", beat, 0.2),
            ("the time between two states", silent, 0.2),
            ("the time of an order", order, 1.0),
            ("the time of an answer of the dashboard", dashboard, 5.0),
        ];
        times
            .into_iter()
            .try_for_each(|(what, time, most)| within(what, time.as_secs_f64(), 0.01, most, "s"))
    }
}

/// Longer calls are faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deadlines {
    /// From the start of the client to the arm at its command.
    pub connect: Duration,
    /// Between two lines of the client.
    pub beat: Duration,
    /// Between two states of the arm.
    pub silent: Duration,
    /// From an order to its call having returned.
    pub order: Duration,
    /// Of one answer of the dashboard.
    pub dashboard: Duration,
}

impl Default for Deadlines {
    /// A fault and the braking after it take less than 200 ms together; a machine that is not
    /// real-time is late by 25 ms now and then. While a call hangs the watchdog of the controller,
    /// 100 ms, is not fed: it is sooner where it works.
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
