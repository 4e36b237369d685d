//! `touchup calibrate stiffness`: compliance of arm and probe, from presses on one spot.

use std::fmt;

use clap::Args;
use serde::Serialize;

use super::super::arm::ArmArguments;
use super::super::check::repeated;
use super::super::{CliError, Losses, reported};
use super::{CalibrationTarget, Change, rounded};
use crate::probing::execute::Repeatability;
use crate::scene::Setting;

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
    target: CalibrationTarget,
}

/// The verb.
pub(super) fn stiffness(arguments: &StiffnessArguments) -> Result<Losses, CliError> {
    let StiffnessArguments { arm, spot, touches, target } = arguments;
    let (scene, draft) = target.open_for_arm()?;
    let found = StiffnessFound::of(&repeated(arm, scene, spot, *touches)?);
    let stiffness_n_per_mm = rounded(found.stiffness_n_per_mm, 3);
    let mut expected = draft.scene.clone();
    expected.tip.get_or_insert_default().ball.stiffness = Some(stiffness_n_per_mm * 1e3);
    let change = Change {
        settings: vec![Setting::scalar(&["tip", "stiffness_n_per_mm"], stiffness_n_per_mm)],
        remark: format!("stiffness: {} presses, ± {:.3} N/mm", found.touches, found.std_n_per_mm),
        expected,
    };
    target.write(&draft, &change, &found)?;
    Ok(Losses::new())
}

reported! {
    /// What `--json` prints.
    #[derive(Debug, Serialize)]
    struct StiffnessFound, fn of(found: &Repeatability) {
        touches: usize = found.touches.len(),
        stiffness_n_per_mm: f64 = found.stiffness()[0] / 1e3,
        std_n_per_mm: f64 = found.stiffness()[1] / 1e3,
        /// of the places where the spot was touched
        range_um: f64 = found.range() * 1e6,
    }
}

impl fmt::Display for StiffnessFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { touches, stiffness_n_per_mm, std_n_per_mm, range_um } = self;
        writeln!(f, "presses: {touches}, contact repeated within {range_um:.1} µm")?;
        write!(f, "stiffness   {stiffness_n_per_mm:.3} ± {std_n_per_mm:.3} N/mm, of arm and probe together")
    }
}
