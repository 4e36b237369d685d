//! `touchup calibrate stiffness`: compliance of arm and probe, from presses on one spot.

use std::fmt;

use clap::Args;

use super::super::arm::{ArmArguments, TouchesOutput};
use super::super::check::repeated;
use super::super::{CliError, Losses, reported};
use super::{Calibrated, CalibrationTarget, rounded};
use crate::probing::execute::Repeatability;
use crate::scene::{Scene, Setting};

#[derive(Debug, Args)]
pub(in crate::cli) struct StiffnessArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// A flat place of a stiff part with nothing within 15 mm, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: String,
    /// Number of presses
    #[arg(long, value_name = "N", default_value_t = 10)]
    touches: usize,
    #[command(flatten)]
    output: TouchesOutput,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// The verb.
pub(super) fn stiffness(arguments: &StiffnessArguments) -> Result<Losses, CliError> {
    let StiffnessArguments { arm, spot, touches, output, target } = arguments;
    let (scene, draft) = target.open_for_arm()?;
    target.write(&draft, &StiffnessFound::of(&repeated(arm, scene, spot, *touches, output)?))?;
    Ok(Losses::new())
}

reported! {
    /// What `--json` prints.
    struct StiffnessFound, fn of(found: &Repeatability) {
        touches: usize = found.touches.len(),
        stiffness_n_per_mm: f64 = found.stiffness()[0] / 1e3,
        std_n_per_mm: f64 = found.stiffness()[1] / 1e3,
        /// of the places where the spot was touched
        range_um: f64 = found.range() * 1e6,
    }
}

impl Calibrated for StiffnessFound {
    fn set_in(&self, scene: &mut Scene) -> (Vec<Setting>, String) {
        let stiffness_n_per_mm = rounded(self.stiffness_n_per_mm, 3);
        scene.tip.get_or_insert_default().ball.stiffness = Some(stiffness_n_per_mm * 1e3);
        let remark = format!("stiffness: {} presses, ± {:.3} N/mm", self.touches, self.std_n_per_mm);
        (vec![Setting::scalar("tip.stiffness_n_per_mm", stiffness_n_per_mm)], remark)
    }
}

impl fmt::Display for StiffnessFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { touches, stiffness_n_per_mm, std_n_per_mm, range_um } = self;
        writeln!(f, "presses: {touches}, contact repeated within {range_um:.1} µm")?;
        write!(f, "stiffness   {stiffness_n_per_mm:.3} ± {std_n_per_mm:.3} N/mm, of arm and probe together")
    }
}
