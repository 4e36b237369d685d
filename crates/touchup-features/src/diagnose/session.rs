//! Stiffness and place of the ball: told against what the presses show among themselves.

use nalgebra::Vector3;

use super::finding::{InputCause, InputFinding};
use super::judge::{InputJudge, Presses};
use crate::adjustment::{RecordedPress, SessionAdjustment, SessionNumbers};
use touchup_method::stylus::{TipParams, TipShape};

/// Longest pause within a stroke, ns, and its longest duration, in which presses share their errors:
/// slow wander of a tracker.
const STROKE_PAUSE_NS: i64 = 100_000_000;
const LONGEST_STROKE_NS: i64 = 1_000_000_000;
/// Standard uncertainties before the presses: whatever they show.
const ANY: SessionNumbers = SessionNumbers {
    compliance: 1e-3,
    offset_t: Vector3::new(10e-3, 10e-3, 10e-3),
};
/// Standard uncertainty of the sink under the largest force, and of the place of the ball, besides
/// the scatter of strokes, m: what friction and lateral bend of a stylus look like.
const OF_MODEL: f64 = 0.02e-3;
/// Minimum difference of told and found in standard uncertainties, for a doubt and for a sure
/// finding.
const DOUBTED_SIGMAS: f64 = 4.0;
const SURE_SIGMAS: f64 = 6.0;

impl InputJudge<'_> {
    /// Numbers of the session that its presses contradict.
    pub(super) fn judge_session(&self, presses: &Presses) -> Vec<InputFinding> {
        let TipParams { radius, stiffness } = self.params.tip;
        if self.params.shape != TipShape::Ball {
            return Vec::new();
        }
        let told = SessionNumbers {
            compliance: stiffness.map_or(0.0, f64::recip),
            offset_t: Vector3::zeros(),
        };
        let recorded = self.recorded_presses(presses);
        let Some(mut adjusted) = SessionAdjustment::of(&recorded, radius, told, ANY) else {
            return Vec::new();
        };
        let sigma = &mut adjusted.sigma;
        sigma.compliance = sigma.compliance.hypot(OF_MODEL / presses.levels.largest);
        sigma.offset_t.apply(|sigma| *sigma = sigma.hypot(OF_MODEL));
        let stiffness = stiffness_finding(&adjusted, told.compliance, self.params.stiffness_share);
        let place = place_finding(&adjusted, self.params.place_sigma);
        stiffness.into_iter().chain(place).collect()
    }

    /// The presses with the numbers of their strokes.
    fn recorded_presses(&self, presses: &Presses) -> Vec<RecordedPress> {
        let levels = &presses.levels;
        let first = self.pressing.first().map_or(0, |record| record.stamp_ns);
        let (mut stroke, mut begun, mut last) = (0, first, first);
        let pressing = self.pressing.iter();
        pressing
            .filter(|record| levels.is_pressing(record))
            .map(|record| {
                let now = record.stamp_ns;
                let is_apart = now.saturating_sub(last) > STROKE_PAUSE_NS
                    || now.saturating_sub(begun) > LONGEST_STROKE_NS;
                if is_apart {
                    (stroke, begun) = (stroke + 1, now);
                }
                last = now;
                RecordedPress {
                    centre: record.centre,
                    rotation: record.rotation,
                    force: levels.force_o(record),
                    stroke,
                }
            })
            .collect()
    }
}

/// - `told`: compliance, m/N. `of_told`: its standard uncertainty, as a share.
fn stiffness_finding(
    adjusted: &SessionAdjustment,
    told: f64,
    of_told: f64,
) -> Option<InputFinding> {
    let (found, sigma) = (adjusted.found.compliance, adjusted.sigma.compliance);
    // a ball that rises under force has another cause
    let is_possible = found > -DOUBTED_SIGMAS * sigma;
    let off = (found - told).abs() / sigma.hypot(of_told * told);
    let measured = format!(
        "{} presses on {} surfaces agree if the ball sinks by {:.4} ± {:.4} mm/N, and by its stiffness it sinks by {:.4} mm/N",
        adjusted.presses,
        adjusted.surfaces,
        found * 1e3,
        sigma * 1e3,
        told * 1e3
    );
    let remedy = "give the stiffness in N/mm (--stiffness-n-per-mm, tip.stiffness_n_per_mm; touchup calibrate tip)";
    (is_possible && off > DOUBTED_SIGMAS)
        .then(|| InputFinding::new(InputCause::Stiffness, off > SURE_SIGMAS, measured, remedy))
}

/// - `of_told`: standard uncertainty of the told place along each axis, m.
fn place_finding(adjusted: &SessionAdjustment, of_told: f64) -> Option<InputFinding> {
    let (found, sigma) = (&adjusted.found.offset_t, &adjusted.sigma.offset_t);
    let off = found.zip_map(sigma, |found, sigma| found.abs() / sigma.hypot(of_told));
    let off = off.max();
    let [x, y, z] = [0, 1, 2].map(|at| format!("{:.2} ± {:.2}", found[at] * 1e3, sigma[at] * 1e3));
    let measured = format!(
        "{} presses on {} surfaces agree if the ball is ({x}, {y}, {z}) mm from its told place, in the axes of the stylus",
        adjusted.presses, adjusted.surfaces
    );
    let remedy = "add that to tip.offset_mm (touchup calibrate tip)";
    (off > DOUBTED_SIGMAS)
        .then(|| InputFinding::new(InputCause::TipOffset, off > SURE_SIGMAS, measured, remedy))
}
