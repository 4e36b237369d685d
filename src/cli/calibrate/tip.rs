//! `touchup calibrate tip`: where the ball is in the tracked stylus, from a swing about it; with an arm: `tip_by_arm`.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use nalgebra::Vector3;
use serde::Serialize;

use super::super::arm::{CellArguments, RobotName};
use super::super::{CliError, Losses, reported};
use super::{CalibrationRecording, CalibrationTarget, Change, DraftScene, Vector, rounded};
use crate::calibrate::{SwingPose, TipFit, TipFitParams, fit_tip};
use crate::scene::{Scene, Setting};

#[derive(Debug, Args)]
#[group(id = "swing", required = true, multiple = false, args = ["bag", "robot"])]
pub(in crate::cli) struct TipArguments {
    /// A recording in which the ball sits in a cone or divot while the stylus is swung to all sides
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["cell", "spot", "truth_tip_mm"])]
    bag: Option<PathBuf>,
    /// An arm that touches --spot with its probe leaning to all sides; it needs --scene
    #[arg(long, value_name = "ARM", requires = "spot")]
    pub(super) robot: Option<RobotName>,
    #[command(flatten)]
    pub(super) cell: CellArguments,
    /// With --robot: a flat place of the part with nothing within 20 mm, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(super) spot: Option<String>,
    /// True position of the ball of a simulated arm in the flange, mm; default: robot.tip_position_mm of the scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(super) truth_tip_mm: Option<String>,
    #[command(flatten)]
    source: CalibrationRecording,
    #[command(flatten)]
    pub(super) target: CalibrationTarget,
}

/// Poses that are held at most: three minutes at 1 kHz. Of a longer swing every second one is dropped.
const MOST_POSES: usize = 200_000;

/// Every so many-th pose of a swing.
struct Swing {
    poses: Vec<SwingPose>,
    stride: usize,
    seen: usize,
}

impl Swing {
    fn push(&mut self, pose: SwingPose) {
        if self.seen.is_multiple_of(self.stride) {
            if self.poses.len() == MOST_POSES {
                let mut at = 0;
                self.poses.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
                self.stride *= 2;
            }
            self.poses.push(pose);
        }
        self.seen += 1;
    }
}

/// The verb.
pub(super) fn tip(arguments: &TipArguments) -> Result<Losses, CliError> {
    let TipArguments { bag, source, target, .. } = arguments;
    let bag = bag.as_ref().expect("one of --bag and --robot is there");
    let draft = target.open("--bag", bag)?;
    let mut swing = Swing { poses: Vec::new(), stride: 1, seen: 0 };
    let mut scene = draft.reading();
    // the poses as they are recorded: an older offset does not count
    scene.tip.iter_mut().for_each(|tip| tip.offset = None);
    let replayed = source.replay(source.open(bag)?, &scene, |sample| swing.push(sample.pose_ot))?;
    let fit = fit_tip(&swing.poses, &TipFitParams::default()).map_err(|error| CliError::calibration(bag, error))?;
    let found = TipFound::of(&fit);
    target.write(&draft, &found.change(&draft), &found)?;
    Ok(replayed.losses)
}

reported! {
    /// What `--json` prints.
    #[derive(Debug, Serialize)]
    struct TipFound, fn of(fit: &TipFit) {
        poses: usize = fit.poses,
        left_out: usize = fit.rejected,
        swing_deg: f64 = fit.swing.to_degrees(),
        /// in the axes of the recorded pose
        offset_mm: Vector = Vector::of(&fit.offset, 1e3),
        /// centre of the resting ball, in the frame of the poses
        rest_mm: Vector = Vector::of(&fit.rest, 1e3),
        residual_mm: f64 = fit.rms * 1e3,
        /// number of independent poses with the same information
        correlation: f64 = fit.correlation,
    }
}

impl TipFound {
    fn change(&self, draft: &DraftScene) -> Change {
        let offset_mm = self.offset_mm.value.map(|x| rounded(x, 7));
        let mut expected: Scene = draft.scene.clone();
        expected.tip.get_or_insert_default().offset = Some(Vector3::from(offset_mm) / 1e3);
        Change {
            settings: vec![Setting::list(&["tip", "offset_mm"], &offset_mm)],
            remark: format!("tip: {} poses, residuals {:.3} mm rms", self.poses, self.residual_mm),
            expected,
        }
    }
}

impl fmt::Display for TipFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { poses, left_out, swing_deg, offset_mm, rest_mm, residual_mm, .. } = self;
        writeln!(f, "poses: {poses}, left out: {left_out}; swung by {swing_deg:.0}° or more across every axis")?;
        writeln!(f, "offset      {offset_mm} mm, in the axes of the recorded pose")?;
        writeln!(f, "rested at   {rest_mm} mm, in the frame of the poses")?;
        write!(f, "residuals   {residual_mm:.4} mm rms")
    }
}
