//! `touchup recover`: clears the stop of an arm after inspection, so that it can move again.

use std::fmt;
use std::path::PathBuf;

use clap::Args;

use super::probing::arm::recovered_ur;
use super::{CliError, Losses, print_report, reported};
use touchup_probing::arm::ArmState;
use touchup_session::scene::Scene;

#[derive(Debug, Args)]
pub(super) struct RecoverArguments {
    /// Scene, with `robot` of a UR (docs/ur.md)
    #[arg(long, value_name = "YAML")]
    scene: PathBuf,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn recover(arguments: &RecoverArguments) -> Result<Losses, CliError> {
    let mut arm = recovered_ur(&Scene::read(&arguments.scene)?)?;
    let recovered = RecoveryReport::of(&arm.next_state().map_err(CliError::arm)?);
    print_report(arguments.json, &recovered, || recovered.to_string())?;
    Ok(Losses::new())
}

reported! {
    /// Output of `--json`.
    struct RecoveryReport, fn of(state: &ArmState) {
        /// Position of the tip in the base of the arm.
        tip_mm: [f64; 3] = (state.pose_bt.translation.vector * 1e3).into(),
        /// Force on the sensor, before taring.
        force_n: f64 = state.wrench_b.force.norm(),
    }
}

impl fmt::Display for RecoveryReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            tip_mm: [x, y, z],
            force_n,
        } = self;
        write!(
            f,
            "nothing stops the arm any more, and nothing has moved: tip at ({x:.1} {y:.1} {z:.1}) mm in its base, {force_n:.1} N on its sensor; \
             bring the tip into free air by hand before it probes"
        )
    }
}
