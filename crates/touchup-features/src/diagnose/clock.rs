//! Findings about the clock of the wrench: its delay, steady, drifting or stepping.

use super::correction::InputCorrection;
use super::finding::{FoundNumber, InputCause, InputFinding};
use super::judge::InputJudge;
use touchup_method::stylus::{ClockChange, ClockOffset, SyncParams};

/// Maximum shift of a touch along the path by a delay, m; half of it gives a doubt.
pub(super) const LARGEST_PATH: f64 = 0.32e-3;
/// Speed of the stylus over the part, m/s.
pub(super) const USUAL_SPEED: f64 = 0.04;

impl InputJudge<'_> {
    /// A delay of the wrench that moves the touches along the path.
    pub(super) fn judge_clock(&self) -> Option<InputFinding> {
        let found = self.clock?;
        let sigma = match found.change {
            Some(ClockChange::Drift(of)) => of.sigma_at_ends(found.sigma),
            _ => found.sigma,
        };
        let largest = found.ends().map(f64::abs).into_iter().fold(0.0, f64::max);
        let path = (largest - 3.0 * sigma) * USUAL_SPEED;
        let (measured, remedy, numbers) = in_words(&found, sigma, &self.params.sync);
        (path > LARGEST_PATH / 2.0).then(|| {
            InputFinding::new(InputCause::Delay, path > LARGEST_PATH, measured, remedy)
                .with(numbers)
                .corrected_by(InputCorrection::of_clock(found))
        })
    }
}

/// What was measured, its remedy, and the numbers with what the scene applies already.
///
/// - `sigma`: standard uncertainty of the offset at the ends, s.
fn in_words(
    found: &ClockOffset,
    sigma: f64,
    applied: &SyncParams,
) -> (String, &'static str, Vec<FoundNumber>) {
    let (evidence, ms, sigma) = (found.evidence, found.offset * 1e3, sigma * 1e3);
    let [first, last] = found.ends().map(|offset| offset * 1e3);
    let [applied_ms, applied_ppm] = [
        applied.wrench_offset_ns as f64 * 1e-6,
        applied.wrench_drift * 1e6,
    ];
    let beside = match (applied.wrench_offset_ns, applied.wrench_drift) {
        (0, 0.0) => String::new(),
        _ => format!(" beside the {applied_ms:+.1} ms and {applied_ppm:+.1} ppm that are applied"),
    };
    let offset = |name, ms| FoundNumber::new(name, ms + applied_ms, sigma);
    match found.change {
        None => (
            format!(
                "the wrench reads {ms:+.1} ± {sigma:.1} ms beyond the pose{beside}, by {evidence}, which makes {:+.1} ms",
                ms + applied_ms
            ),
            "give that as sync.wrench_offset_ms",
            vec![offset("wrench_offset_ms", ms)],
        ),
        Some(ClockChange::Drift(of)) => {
            let [ppm, ppm_sigma] = [of.rate, of.rate_sigma].map(|x| x * 1e6);
            let [all_ms, all_ppm] = [first + applied_ms, ppm + applied_ppm];
            (
                format!(
                    "the clock of the wrench gains {ppm:+.1} ± {ppm_sigma:.1} ppm on that of the pose and reads \
                     {first:+.1} ± {sigma:.1} ms beyond it at first, {last:+.1} ms at last{beside}, by {evidence}, \
                     which makes {all_ppm:+.1} ppm and {all_ms:+.1} ms",
                ),
                "give these as sync.wrench_drift_ppm and sync.wrench_offset_ms",
                vec![
                    offset("wrench_offset_at_first_ms", first),
                    FoundNumber::new("wrench_drift_ppm", all_ppm, ppm_sigma),
                ],
            )
        }
        Some(ClockChange::Step(of)) => (
            format!(
                "the wrench reads {first:+.1} ± {sigma:.1} ms beyond the pose at first, and {last:+.1} ± {sigma:.1} ms from \
                 {:.1} ± {:.1} s on{beside}, by {evidence}",
                of.at, of.at_sigma
            ),
            "have one steady clock stamp both, or cut the recording there, and give each part its sync.wrench_offset_ms",
            vec![
                offset("wrench_offset_before_ms", first),
                offset("wrench_offset_after_ms", last),
                FoundNumber::new("at_s", of.at, of.at_sigma),
            ],
        ),
    }
}
