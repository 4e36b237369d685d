//! The arm: where it stands, what it holds, and what it must never leave.

use serde::Deserialize;

use super::in_range;
use super::stream::is_unit;
use crate::scene::SceneError;
use touchup_core::explore::PatternParams;
use touchup_core::probe::Tool;
use touchup_core::robot::{Limits, TouchParams, UrGeometry};

/// `robot`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobotSection {
    /// ur3e, ur5e, ur10e or ur16e.
    pub model: String,
    /// Whether it may move at all.
    pub allow_motion: bool,
    /// Name or address of its controller; a simulated one has none.
    pub host: String,
    /// Folder of Python packages with ur-rtde, as `touchup ur setup` prints it.
    pub site_packages: String,
    /// Of all that hangs on the flange, kg.
    pub payload_kg: f64,
    /// Its centre of mass in the flange, mm.
    pub payload_centre_mm: [f64; 3],
    /// Centre of the ball in the flange, mm.
    pub tip_position_mm: [f64; 3],
    /// Axes of the tip in the flange (z: along the shaft, tip to handle), quaternion x, y, z, w.
    pub tip_orientation_xyzw: [f64; 4],
    /// Smallest corner of the box that the ball's centre stays in, in the base, mm.
    pub workspace_low_mm: [f64; 3],
    /// Largest corner of it, mm.
    pub workspace_high_mm: [f64; 3],
    /// Force that a touch presses with, N.
    pub touch_force_n: f64,
    /// Force at which a search stops, N.
    pub trigger_n: f64,
    /// Force at the tip at which everything stops, N.
    pub largest_force_n: f64,
    /// Noise of the force that is measured, N.
    pub force_noise_n: f64,
    /// Through free air, mm/s.
    pub link_mm_per_s: f64,
    /// Searching, mm/s; slower where arm and part are stiff.
    pub search_mm_per_s: f64,
    /// Measuring, mm/s.
    pub measure_mm_per_s: f64,
    /// While the ball slides over what was found, mm/s, at most.
    pub slide_mm_per_s: f64,
    /// No motion is faster, mm/s.
    pub largest_mm_per_s: f64,
    /// Of all motions, mm/s².
    pub acceleration_mm_per_s2: f64,
    /// Travel of one search at most, mm.
    pub search_mm: f64,
    /// From a contact to the beginning of braking, ms.
    pub latency_ms: f64,
    /// Time of one feature at most, s.
    pub time_s: f64,
    /// How far from a place where the arm cannot move some way it stays: smallest singular value of its Jacobian.
    pub least_dexterity: f64,
    /// Between ball and surface where a search begins, mm.
    pub clearance_mm: f64,
    /// How deep the ball's centre is let into a hole, mm.
    pub depth_mm: f64,
    /// The shaft behind the ball: radius, mm.
    pub shaft_radius_mm: f64,
    /// … and how much of it, and of the hand, must keep clear, mm.
    pub shaft_length_mm: f64,
    /// What the scan may be wrong by, mm.
    pub margin_mm: f64,
    /// Half width within which a number is to be known, mm.
    pub tolerance_mm: f64,
    /// … with this probability.
    pub confidence: f64,
    /// Touches of a feature at most.
    pub touches: usize,
    /// Expected standard deviation of a touch, mm.
    pub touch_sigma_mm: f64,
}

impl Default for RobotSection {
    fn default() -> Self {
        let (limits, touch, pattern, tool) =
            (Limits::default(), TouchParams::default(), PatternParams::default(), Tool::default());
        Self {
            model: "ur5e".to_owned(),
            allow_motion: false,
            host: String::new(),
            site_packages: String::new(),
            payload_kg: 0.25,
            payload_centre_mm: [0.0, 0.0, 50.0],
            // 150 mm before the flange, the handle towards it
            tip_position_mm: [0.0, 0.0, 150.0],
            tip_orientation_xyzw: [1.0, 0.0, 0.0, 0.0],
            workspace_low_mm: [0.0; 3],
            workspace_high_mm: [0.0; 3],
            touch_force_n: touch.force,
            trigger_n: touch.trigger,
            largest_force_n: limits.force,
            force_noise_n: touch.onset.force_noise,
            link_mm_per_s: touch.link_speed * 1e3,
            search_mm_per_s: touch.search_speed * 1e3,
            measure_mm_per_s: touch.measure_speed * 1e3,
            slide_mm_per_s: touch.slide_speed * 1e3,
            largest_mm_per_s: limits.speed * 1e3,
            acceleration_mm_per_s2: touch.acceleration * 1e3,
            search_mm: limits.search * 1e3,
            latency_ms: touch.latency * 1e3,
            time_s: limits.time,
            least_dexterity: limits.dexterity,
            clearance_mm: pattern.clearance * 1e3,
            depth_mm: pattern.depth * 1e3,
            shaft_radius_mm: tool.shaft_radius * 1e3,
            shaft_length_mm: tool.shaft_length * 1e3,
            margin_mm: tool.margin * 1e3,
            tolerance_mm: 0.02,
            confidence: 0.95,
            touches: pattern.budget,
            touch_sigma_mm: pattern.touch_sigma * 1e3,
        }
    }
}

/// Share of the force of a touch at which a search may stop: the rest is for its braking.
const MOST_TRIGGER: f64 = 0.8;

impl RobotSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        if UrGeometry::of(&self.model).is_none() {
            return Err(SceneError::NoSuch {
                key: "robot.model",
                value: self.model.clone(),
                allowed: "ur3e, ur5e, ur10e or ur16e",
            });
        }
        is_unit("robot.tip_orientation_xyzw", &self.tip_orientation_xyzw)?;
        in_range("robot.payload_kg", self.payload_kg, 0.0, 50.0, "0 to 50 kg")?;
        for &x in &self.payload_centre_mm {
            in_range("robot.payload_centre_mm", x, -1e3, 1e3, "-1000 to 1000 mm")?;
        }
        for &x in &self.tip_position_mm {
            in_range("robot.tip_position_mm", x, -2e3, 2e3, "-2000 to 2000 mm")?;
        }
        for (low, high) in self.workspace_low_mm.iter().zip(&self.workspace_high_mm) {
            in_range("robot.workspace_low_mm", *low, -5e3, 5e3, "-5000 to 5000 mm")?;
            in_range("robot.workspace_high_mm", *high, *low, 5e3, "robot.workspace_low_mm to 5000 mm")?;
        }
        in_range("robot.largest_force_n", self.largest_force_n, 0.1, 100.0, "0.1 to 100 N")?;
        in_range(
            "robot.touch_force_n",
            self.touch_force_n,
            0.1,
            self.largest_force_n,
            "0.1 N to robot.largest_force_n",
        )?;
        in_range(
            "robot.trigger_n",
            self.trigger_n,
            0.05,
            MOST_TRIGGER * self.touch_force_n,
            "0.05 N to 0.8 of robot.touch_force_n",
        )?;
        in_range("robot.force_noise_n", self.force_noise_n, 1e-4, 10.0, "0.0001 to 10 N")?;
        in_range("robot.largest_mm_per_s", self.largest_mm_per_s, 0.1, 250.0, "0.1 to 250 mm/s")?;
        let most = self.largest_mm_per_s;
        in_range("robot.link_mm_per_s", self.link_mm_per_s, 0.1, most, "0.1 mm/s to robot.largest_mm_per_s")?;
        in_range("robot.search_mm_per_s", self.search_mm_per_s, 0.1, most, "0.1 mm/s to robot.largest_mm_per_s")?;
        in_range("robot.measure_mm_per_s", self.measure_mm_per_s, 0.05, most, "0.05 mm/s to robot.largest_mm_per_s")?;
        in_range("robot.slide_mm_per_s", self.slide_mm_per_s, 0.1, most, "0.1 mm/s to robot.largest_mm_per_s")?;
        in_range("robot.acceleration_mm_per_s2", self.acceleration_mm_per_s2, 10.0, 5e3, "10 to 5000 mm/s²")?;
        in_range("robot.search_mm", self.search_mm, 0.5, 100.0, "0.5 to 100 mm")?;
        in_range("robot.latency_ms", self.latency_ms, 0.0, 200.0, "0 to 200 ms")?;
        in_range("robot.time_s", self.time_s, 1.0, 86_400.0, "1 to 86400 s")?;
        in_range("robot.least_dexterity", self.least_dexterity, 0.0, 1.0, "0 to 1")?;
        in_range("robot.clearance_mm", self.clearance_mm, 0.5, 50.0, "0.5 to 50 mm")?;
        in_range("robot.depth_mm", self.depth_mm, 0.0, 100.0, "0 to 100 mm")?;
        in_range("robot.shaft_radius_mm", self.shaft_radius_mm, 0.05, 50.0, "0.05 to 50 mm")?;
        in_range("robot.shaft_length_mm", self.shaft_length_mm, 0.0, 500.0, "0 to 500 mm")?;
        in_range("robot.margin_mm", self.margin_mm, 0.0, 50.0, "0 to 50 mm")?;
        in_range("robot.tolerance_mm", self.tolerance_mm, 1e-4, 10.0, "0.0001 to 10 mm")?;
        in_range("robot.confidence", self.confidence, 0.5, 0.9999, "0.5 to 0.9999")?;
        in_range("robot.touches", self.touches as f64, 1.0, 1e4, "1 to 10000")?;
        in_range("robot.touch_sigma_mm", self.touch_sigma_mm, 1e-5, 1.0, "0.00001 to 1 mm")
    }
}
