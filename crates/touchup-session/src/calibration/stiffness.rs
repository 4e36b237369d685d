//! Compliance of arm and probe, from presses on one spot.

use std::fmt;

use touchup_probing::execute::Repeatability;

use super::calibrated::CalibrationResult;
use super::vector::rounded;
use crate::reported;
use crate::scene::Setting;

reported! {
    /// Stiffness of arm and probe together.
    #[derive(Clone)]
    pub struct StiffnessFound, pub fn of(found: &Repeatability) {
        touches: usize = found.touches.len(),
        stiffness_n_per_mm: f64 = found.stiffness[0] / 1e3,
        std_n_per_mm: f64 = found.stiffness[1] / 1e3,
        /// range of the contact positions on the spot
        range_um: f64 = found.range * 1e6,
    }
}

impl CalibrationResult for StiffnessFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let stiffness_n_per_mm = rounded(self.stiffness_n_per_mm, 3);
        let remark = format!(
            "stiffness: {} presses, ± {:.3} N/mm",
            self.touches, self.std_n_per_mm
        );
        (
            vec![Setting::number(
                "tip.stiffness_n_per_mm",
                stiffness_n_per_mm,
            )],
            remark,
        )
    }
}

impl fmt::Display for StiffnessFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            touches,
            stiffness_n_per_mm,
            std_n_per_mm,
            range_um,
        } = self;
        writeln!(
            f,
            "presses: {touches}, contact repeated within {range_um:.1} µm"
        )?;
        write!(
            f,
            "stiffness   {stiffness_n_per_mm:.3} ± {std_n_per_mm:.3} N/mm, of arm and probe together"
        )
    }
}
