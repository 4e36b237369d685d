//! `touchup check`: whether an arm measures one spot at one place, before it is trusted with a part.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::Point3;

use super::arm::{ArmArguments, TouchesOutput};
use super::probing::{KeptMeasurements, millimetres};
use super::{CliError, Losses, print_report, reported, require, require_positive};
use crate::probing::execute::{Repeatability, SpotTouch};

/// Allowed number of touches; with three each side is approached, and the repeatability is known.
const TOUCHES: std::ops::RangeInclusive<usize> = 3..=100;

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// The scene, with `robot` (config/probe.yaml is an example)
    #[arg(long, value_name = "YAML")]
    scene: PathBuf,
    /// A flat place of the part with nothing within 15 mm, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: String,
    /// Number of touches, every second one from the other side
    #[arg(long, value_name = "N", default_value_t = 10)]
    touches: usize,
    /// Gate: largest distance of a touch from the mean, µm
    #[arg(long, value_name = "G", default_value_t = 25.0)]
    gate_um: f64,
    #[command(flatten)]
    output: TouchesOutput,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<Losses, CliError> {
    let CheckArguments { arm, scene, spot, touches, gate_um, output, json } = arguments;
    require_positive("--gate-um", *gate_um)?;
    let found = repeated(arm, scene, spot, *touches, output)?;
    let checked = Checked::of(&found, *gate_um);
    print_report(*json, &checked, || checked.to_string());
    let why = format!(
        "the touches of one spot are {:.1} µm apart, the gate is {gate_um} µm: look for play in probe, flange and joints",
        checked.range_um
    );
    Ok(if checked.passed { Losses::new() } else { vec![why] })
}

/// Touches one spot again and again.
///
/// - `spot`: as it was written, X,Y,Z in mm.
pub(super) fn repeated(
    arm: &ArmArguments,
    scene: &Path,
    spot: &str,
    touches: usize,
    output: &TouchesOutput,
) -> Result<Repeatability, CliError> {
    let place = Point3::from(millimetres("--spot", spot)?);
    let (least, most) = (TOUCHES.start(), TOUCHES.end());
    require(TOUCHES.contains(&touches), format!("--touches {touches} must be {least} to {most}"))?;
    let ArmArguments { robot, cell } = arm;
    let out = KeptMeasurements::Touches(output.touches_out.as_deref());
    let found = cell.measure(*robot, scene, "touch", out, |arm, _| Ok(arm), |prober| prober.repeat(&place, touches))?;
    Ok(found.0)
}

reported! {
    /// What `--json` prints.
    struct Checked, fn of(found: &Repeatability, gate: f64) {
        spot_mm: [f64; 3] = (found.place * 1e3).coords.into(),
        normal: [f64; 3] = found.normal.into_inner().into(),
        touches: Vec<CheckedTouch> = found.touches.iter().zip(found.deviations()).map(CheckedTouch::of).collect(),
        range_um: f64 = found.range() * 1e6,
        std_um: f64 = found.deviation() * 1e6,
        /// first side less the other
        reversal_um: f64 = found.reversal() * 1e6,
        stiffness_n_per_mm: f64 = found.stiffness()[0] / 1e3,
        stiffness_std_n_per_mm: f64 = found.stiffness()[1] / 1e3,
        gate_um: f64 = gate,
        passed: bool = found.range() * 1e6 <= gate,
    }
}

reported! {
    struct CheckedTouch, fn of(found: (&SpotTouch, f64)) {
        side: i8 = found.0.side,
        /// outward from the mean of all
        deviation_um: f64 = found.1 * 1e6,
        std_um: f64 = found.0.sigma * 1e6,
        stiffness_n_per_mm: f64 = found.0.stiffness[0] / 1e3,
        verdict: &'static str = found.0.verdict.name(),
    }
}

impl fmt::Display for Checked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, touch) in (1..).zip(&self.touches) {
            let CheckedTouch { side, deviation_um, std_um, verdict, .. } = touch;
            let side = if *side > 0 { "one side" } else { "the other" };
            writeln!(f, "touch {number:3} from {side}: {deviation_um:+6.1} µm ± {std_um:.1}, {verdict}")?;
        }
        let Self { spot_mm: [x, y, z], range_um, std_um, reversal_um, stiffness_n_per_mm, gate_um, .. } = self;
        let count = self.touches.len();
        writeln!(
            f,
            "{count} touches of ({x:.1} {y:.1} {z:.1}) mm: {range_um:.1} µm apart, standard deviation {std_um:.1} µm"
        )?;
        writeln!(f, "the sides differ by {reversal_um:+.1} µm; arm and probe have {stiffness_n_per_mm:.1} N/mm")?;
        write!(f, "{}: the gate is {gate_um} µm", if self.passed { "passed" } else { "FAILED" })
    }
}
