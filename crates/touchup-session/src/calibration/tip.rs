//! Tip calibration, the centre of the ball: in the tracked stylus, from a swing about it; in the
//! flange of an arm, from touches of one flat spot with a tilted probe.

use std::fmt;

use nalgebra::Vector3;
use touchup_features::calibrate::{
    PlaneTipError, PlaneTipFit, SwingPose, TipFit, TipFitParams, VectorEstimate, fit_tip,
    fit_tip_by_plane,
};
use touchup_probing::execute::{NotReached, RobotCell, TipPoses};

use super::calibrated::{Calibration, CalibrationResult};
use super::error::CalibrationError;
use super::recording::CalibrationRecording;
use super::vector::{Vector, rounded};
use crate::reported;
use crate::scene::{Scene, Setting};

/// Maximum number of poses: three minutes at 1 kHz. A longer swing loses every second pose.
const MOST_POSES: usize = 200_000;

/// Every `stride`-th pose of a swing.
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

/// Fits the tip to a recording of the stylus swung to all sides with the ball at rest in a cone or
/// divot.
///
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`CalibrationError`]
pub fn calibrate_tip(
    recording: CalibrationRecording,
    scene: &Scene,
    at_each: &mut dyn FnMut(),
) -> Result<Calibration<TipFound>, CalibrationError> {
    let path = recording.path().to_owned();
    let mut swing = Swing {
        poses: Vec::new(),
        stride: 1,
        seen: 0,
    };
    let mut scene = scene.clone();
    // recorded poses, without an older offset
    scene.tip.iter_mut().for_each(|tip| tip.offset = None);
    let replayed = recording.replay(&scene, at_each, |sample| swing.push(sample.pose_ot))?;
    let bad = |error| CalibrationError::Tip { path, error };
    let fit = fit_tip(&swing.poses, &TipFitParams::default()).map_err(bad)?;
    Ok(Calibration {
        found: TipFound::of(&fit),
        doubts: Vec::new(),
        losses: replayed.losses,
    })
}

/// Fits the tip to touches of an arm on one flat spot, with the probe tilted to all sides.
///
/// # Errors
/// [`PlaneTipError`]
pub fn calibrate_tip_by_arm(
    measured: &TipPoses,
    cell: &RobotCell,
) -> Result<Calibration<PivotFound>, PlaneTipError> {
    let TipPoses {
        poses_bf,
        normal_b,
        not_reached,
    } = measured;
    let fit = fit_tip_by_plane(poses_bf, normal_b)?;
    let found = PivotFound::of(&fit, cell, not_reached);
    Ok(Calibration {
        found,
        doubts: Vec::new(),
        losses: Vec::new(),
    })
}

reported! {
    /// The centre of the ball in the tracked stylus.
    #[derive(Clone)]
    pub struct TipFound, fn of(fit: &TipFit) {
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

impl CalibrationResult for TipFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let offset_mm = self.offset_mm.value.map(|x| rounded(x, 7));
        let remark = format!(
            "tip: {} poses, residuals {:.3} mm rms",
            self.poses, self.residual_mm
        );
        (vec![Setting::list("tip.offset_mm", &offset_mm)], remark)
    }
}

impl fmt::Display for TipFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            poses,
            left_out,
            swing_deg,
            offset_mm,
            rest_mm,
            residual_mm,
            ..
        } = self;
        writeln!(
            f,
            "poses: {poses}, left out: {left_out}; swung by {swing_deg:.0}° or more across every axis"
        )?;
        writeln!(
            f,
            "offset      {offset_mm} mm, in the axes of the recorded pose"
        )?;
        writeln!(f, "rested at   {rest_mm} mm, in the frame of the poses")?;
        write!(f, "residuals   {residual_mm:.4} mm rms")
    }
}

reported! {
    /// The centre of the ball in the flange of an arm.
    #[derive(Clone)]
    pub struct PivotFound, fn of(fit: &PlaneTipFit, cell: &RobotCell, unreached: &[NotReached]) {
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
    VectorEstimate {
        value: from + by.value,
        sigma: by.sigma,
    }
}

impl CalibrationResult for PivotFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let tip_position_mm = self.tip_position_mm.value.map(|mm| rounded(mm, 7));
        let remark = format!(
            "tip: {} touches, residuals {:.4} mm rms",
            self.touches, self.residual_mm
        );
        (
            vec![Setting::list("robot.tip_position_mm", &tip_position_mm)],
            remark,
        )
    }
}

impl fmt::Display for PivotFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.not_reached
            .iter()
            .try_for_each(|line| writeln!(f, "left out    {line}"))?;
        let [x, y, z] = self.moved_mm;
        writeln!(f, "touches: {}", self.touches)?;
        writeln!(f, "tip         {} mm, in the flange", self.tip_position_mm)?;
        writeln!(
            f,
            "that is     {x:+.4}, {y:+.4}, {z:+.4} mm from where the scene had it"
        )?;
        write!(
            f,
            "residuals   {:.4} mm rms off one plane",
            self.residual_mm
        )
    }
}
