//! `touchup calibrate payload --robot`: payload identification by the arm itself.
//!
//! The controller of an arm compensates the weight of the payload set there. So the result goes to its parameters:
//! `robot.payload_kg` and `robot.payload_centre_mm`. The bias is only printed: a sensor is zeroed before each touch.

use std::fmt;

use nalgebra::Vector3;
use serde::Serialize;

use super::super::arm::RobotName;
use super::super::{CliError, Losses};
use super::payload::{PayloadArguments, PayloadFound, warn_of_residuals};
use super::{Change, DraftScene, rounded};
use crate::calibrate::{PayloadError, PayloadParams, fit_payload};
use crate::probing::execute::{NotReached, PayloadReadings};
use crate::scene::{Scene, Setting};
use crate::sim::ArmParams;

/// The verb.
pub(super) fn payload(arguments: &PayloadArguments, robot: RobotName) -> Result<Losses, CliError> {
    let gravity = arguments.gravity()?;
    let PayloadArguments { cell, truth_payload, target, .. } = arguments;
    let (scene, draft) = target.open_for_arm()?;
    let truth = |arm: ArmParams, scene: &Scene| truth_payload.held_by(arm, scene);
    let stage = "identify the payload";
    let (readings, _) = cell.measure(robot, scene, stage, truth, |prober| prober.measure_payload())?;
    let PayloadReadings { segments, not_reached } = readings;
    let params = PayloadParams { gravity, ..PayloadParams::default() };
    let fit = fit_payload(&segments, &params).map_err(|error| CliError::Arm(advice(&error)))?;
    warn_of_residuals(&fit, "does a hose pull, ");
    let payload = PayloadFound::of(&fit, ["flange", "base"]);
    let found = WeighedFound { payload, not_reached: not_reached.iter().map(NotReached::to_string).collect() };
    target.write(&draft, &found.change(&draft), &found)?;
    Ok(Losses::new())
}

/// Why the static segments of an arm do not determine its payload.
fn advice(error: &PayloadError) -> String {
    match error {
        PayloadError::WrongAxes { rms_n, other_rms_n, .. } => format!(
            "the raw wrench of this arm is not in the axes of its flange: residuals are {rms_n:.3} N, and {other_rms_n:.3} N in \
             those of its base; identify its payload from a recording or a scale"
        ),
        PayloadError::NoWeight { weight_n, sigma_n } => format!(
            "the weight is {weight_n:.3} N, no more than three times its uncertainty of {sigma_n:.3} N: nothing hangs on the \
             flange, or the arm reports no raw wrench"
        ),
        PayloadError::Inconsistent { rejected, poses } => format!(
            "{rejected} of {poses} static segments do not fit the others: the probe must touch nothing, and no hose or cable may pull it"
        ),
        error => error.to_string(),
    }
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct WeighedFound {
    #[serde(flatten)]
    payload: PayloadFound,
    /// unreachable orientations, and why
    not_reached: Vec<String>,
}

impl WeighedFound {
    fn change(&self, draft: &DraftScene) -> Change {
        let PayloadFound { static_segments, residual_force_n, residual_torque_nm, .. } = self.payload;
        let payload_kg = rounded(self.payload.mass_kg, 10);
        let payload_centre_mm = self.payload.centre_mm.value.map(|mm| rounded(mm, 7));
        let mut expected = draft.scene.clone();
        let robot = expected.robot.get_or_insert_default();
        (robot.payload_mass, robot.payload_centre) = (payload_kg, Vector3::from(payload_centre_mm) / 1e3);
        Change {
            settings: vec![
                Setting::scalar(&["robot", "payload_kg"], payload_kg),
                Setting::list(&["robot", "payload_centre_mm"], &payload_centre_mm),
            ],
            remark: format!(
                "payload: {static_segments} orientations, residuals {residual_force_n:.3} N and {residual_torque_nm:.4} N·m rms"
            ),
            expected,
        }
    }
}

impl fmt::Display for WeighedFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.not_reached.iter().try_for_each(|line| writeln!(f, "left out    {line}"))?;
        write!(f, "{}", self.payload)
    }
}
