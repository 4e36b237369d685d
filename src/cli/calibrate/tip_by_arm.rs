//! `touchup calibrate tip --robot`: where the ball is in the flange, from touches of one flat spot with a probe that leans.

use std::fmt;

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::super::arm::RobotName;
use super::super::probing::millimetres;
use super::super::{CliError, Losses, reported};
use super::tip::TipArguments;
use super::{Change, DraftScene, Vector, rounded};
use crate::calibrate::{PlaneTipFit, VectorEstimate, fit_tip_by_plane};
use crate::probing::execute::{Cell, NotReached, TipPoses};
use crate::scene::{Scene, Setting};
use crate::sim::ArmParams;

/// The verb.
///
/// - `spot`: as it was written, X,Y,Z in mm.
pub(super) fn tip(arguments: &TipArguments, robot: RobotName, spot: &str) -> Result<Losses, CliError> {
    let TipArguments { cell, truth_tip_mm, target, .. } = arguments;
    let place = Point3::from(millimetres("--spot", spot)?);
    let (scene, draft) = target.open_for_arm()?;
    let truth = |arm: ArmParams, _: &Scene| {
        let Some(text) = truth_tip_mm else { return Ok(arm) };
        let off = millimetres("--truth-tip-mm", text)? - arm.pose_ft.translation.vector;
        Ok(ArmParams { ball_offset: arm.pose_ft.rotation.inverse() * off, ..arm })
    };
    let (measured, of_arm) = cell.measure(robot, scene, "touch", truth, |prober| prober.measure_tip(&place))?;
    let TipPoses { poses_bf, normal_b, not_reached } = measured;
    let fit = fit_tip_by_plane(&poses_bf, &normal_b).map_err(CliError::arm)?;
    let found = PivotFound::of(&fit, &of_arm, &not_reached);
    target.write(&draft, &found.change(&draft), &found)?;
    Ok(Losses::new())
}

reported! {
    /// What `--json` prints.
    #[derive(Debug, Serialize)]
    struct PivotFound, fn of(fit: &PlaneTipFit, cell: &Cell, unreached: &[NotReached]) {
        touches: usize = fit.touches,
        /// centre of the ball in the flange
        tip_position_mm: Vector = Vector::of(&moved(cell.pose_ft.translation.vector, &fit.offset), 1e3),
        /// correction to the scene, in the flange
        moved_mm: [f64; 3] = (fit.offset.value * 1e3).into(),
        residual_mm: f64 = fit.rms * 1e3,
        /// unreachable orientations, and why
        not_reached: Vec<String> = unreached.iter().map(ToString::to_string).collect(),
    }
}

fn moved(from: Vector3<f64>, by: &VectorEstimate) -> VectorEstimate {
    VectorEstimate { value: from + by.value, sigma: by.sigma }
}

impl PivotFound {
    fn change(&self, draft: &DraftScene) -> Change {
        let tip_position_mm = self.tip_position_mm.value.map(|mm| rounded(mm, 7));
        let mut expected = draft.scene.clone();
        expected.robot.get_or_insert_default().tip_position = Vector3::from(tip_position_mm) / 1e3;
        Change {
            settings: vec![Setting::list(&["robot", "tip_position_mm"], &tip_position_mm)],
            remark: format!("tip: {} touches, residuals {:.4} mm rms", self.touches, self.residual_mm),
            expected,
        }
    }
}

impl fmt::Display for PivotFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.not_reached.iter().try_for_each(|line| writeln!(f, "left out    {line}"))?;
        let [x, y, z] = self.moved_mm;
        writeln!(f, "touches: {}", self.touches)?;
        writeln!(f, "tip         {} mm, in the flange", self.tip_position_mm)?;
        writeln!(f, "that is     {x:+.4}, {y:+.4}, {z:+.4} mm from where the scene had it")?;
        write!(f, "residuals   {:.4} mm rms off one plane", self.residual_mm)
    }
}
