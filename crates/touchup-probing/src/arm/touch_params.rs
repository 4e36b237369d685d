//! Settings of a touch: forces, speeds, and the bounds that its limits set.

use super::limits::Limits;
use super::onset::OnsetParams;
use touchup_method::parameters;
use touchup_method::parameters::SettingError;

parameters! {
    /// Settings of a touch.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TouchParams in "robot" {
        /// Pressing force of a touch, no more than largest_force_n.
        ///
        /// In N, of the second search.
        force: f64 = 3.0, "touch_force_n" [N, 0.1, 100];
        /// Force that ends a search: several standard deviations of the noise, no more than 0.8 of
        /// touch_force_n.
        ///
        /// In N, of the first search.
        trigger: f64 = 1.0, "trigger_n" [N, 0.05, 80];
        /// Speed through free air.
        ///
        /// In m/s: between touches, on a clear path.
        link_speed: f64 = 50.0, "link_mm_per_s" [MM_PER_S, 0.1, 250];
        /// Largest speed of a search; tip.stiffness_n_per_mm may lower it.
        ///
        /// In m/s, maximum: a stiff arm and part reduce it, to keep `force`.
        search_speed: f64 = 10.0, "search_mm_per_s" [MM_PER_S, 0.1, 250];
        /// Speed of the second search of a touch, which measures.
        ///
        /// In m/s, of the second search.
        measure_speed: f64 = 2.0, "measure_mm_per_s" [MM_PER_S, 0.05, 250];
        /// Largest speed of the ball in a slide over a feature.
        ///
        /// In m/s.
        slide_speed: f64 = 10.0, "slide_mm_per_s" [MM_PER_S, 0.1, 250];
        /// Acceleration of all motions, m/s²; no more than the limit.
        acceleration: f64 = Limits::default().acceleration;
        /// Height above the contact at which the second search begins, m.
        back_off: f64 = 0.3e-3;
        /// Estimated stiffness of arm, probe and part together, N/m.
        stiffness: f64 = 15e3;
        /// Time from a contact to the start of braking.
        ///
        /// In s.
        latency: f64 = 20.0, "latency_ms" [MS, 0, 200];
    }
    with {
        /// Settings of the onset fit.
        onset: OnsetParams,
    }
}

/// Share of the touch force at which a search may stop: the remainder is for braking.
const MOST_TRIGGER: f64 = 0.8;

impl TouchParams {
    /// Refuses a touch that would press harder or move faster than its limits, or whose search
    /// would stop too late.
    ///
    /// # Errors
    /// [`SettingError`]
    pub fn check_within(&self, limits: &Limits) -> Result<(), SettingError> {
        let hardest = format!("0.1 N to robot.largest_force_n, which is {}", limits.force);
        SettingError::check(
            "robot.touch_force_n",
            self.force,
            self.force <= limits.force,
            &hardest,
        )?;
        let is_early = self.trigger <= MOST_TRIGGER * self.force;
        SettingError::check(
            "robot.trigger_n",
            self.trigger,
            is_early,
            "0.05 N to 0.8 of robot.touch_force_n",
        )?;
        let fastest = format!(
            "at most robot.largest_mm_per_s, which is {}",
            limits.speed * 1e3
        );
        let speeds = [
            ("robot.link_mm_per_s", self.link_speed),
            ("robot.search_mm_per_s", self.search_speed),
            ("robot.measure_mm_per_s", self.measure_speed),
            ("robot.slide_mm_per_s", self.slide_speed),
        ];
        speeds.iter().try_for_each(|&(key, v)| {
            SettingError::check(key, v * 1e3, v <= limits.speed, &fastest)
        })
    }

    /// Speed at which a search that stops at [`Self::trigger`] ends below [`Self::force`].
    ///
    /// After the trigger the tip travels v τ + v²/2a, and the force grows by k per metre: v = a
    /// (√(τ² + 2 Δ/(k a)) − τ).
    pub(crate) fn safe_speed(&self) -> f64 {
        self.speed_below(self.force - self.trigger, self.acceleration)
            .min(self.search_speed)
            .max(CRAWL)
    }

    /// Speed at which any obstacle is pressed with no more than the largest force, if the arm stops
    /// as hard as it may on contact; m/s.
    pub(crate) fn bounded_speed(&self, limits: &Limits) -> f64 {
        self.speed_below(
            limits.force - UNEXPECTED * self.trigger,
            limits.fault_stop(),
        )
        .min(limits.speed)
        .max(CRAWL)
    }

    /// - `room`: allowed growth of the force, N; `deceleration`: m/s².
    fn speed_below(&self, room: f64, deceleration: f64) -> f64 {
        let (way, late) = (room.max(0.0) / self.stiffness, self.latency);
        deceleration * ((late * late + 2.0 * way / deceleration).sqrt() - late)
    }
}

/// Force of a contact in a fast move, in triggers: the sensor then also measures accelerations.
pub const UNEXPECTED: f64 = 1.5;
/// Minimum speed of a search, m/s: a slower one would never end.
pub const CRAWL: f64 = 0.1e-3;
