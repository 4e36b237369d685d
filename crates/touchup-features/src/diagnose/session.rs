//! What a session is made with, and what changed while it lasted: told against what the presses
//! show among themselves.

use nalgebra::Vector3;

use super::correction::{ANY, InputCorrection, is_known};
use super::finding::{FoundNumber, InputCause, InputFinding};
use super::input_record::InputRecord;
use super::judge::{InputJudge, Presses};
use crate::adjustment::{
    ChangeCause, LikelyChange, RecordedPress, SessionAdjustment, SessionNumbers,
};
use touchup_method::stylus::{ChangeCourse, TipParams, TipShape};

/// Longest pause within a stroke, ns, and its longest duration, in which presses share their errors:
/// slow wander of a tracker.
const STROKE_PAUSE_NS: i64 = 100_000_000;
const LONGEST_STROKE_NS: i64 = 1_000_000_000;
/// Number of means of presses on each side whose distance is the course of the ball, and its least
/// length, m.
const COURSE_REACH: isize = 2;
const LEAST_COURSE: f64 = 0.3e-3;
/// Standard uncertainty of the sink under the largest force, and of places, besides the scatter of
/// strokes, m: what friction and lateral bend of a stylus look like.
const OF_MODEL: f64 = 0.02e-3;
/// Minimum difference of told and found in standard uncertainties, for a doubt and for a sure
/// finding.
pub(super) const DOUBTED_SIGMAS: f64 = 4.0;
pub(super) const SURE_SIGMAS: f64 = 6.0;
/// Minimum natural logarithm of the odds against the next likely cause, and against none.
pub(super) const CLEAR_ODDS: f64 = 5.0;

/// Units of force that are read as N, N, and largest uncertainty of a sink that shows one, as a share
/// of it.
const FORCE_UNITS: [(&str, f64); 4] = [
    ("lbf", 4.448_222),
    ("kgf", 9.806_65),
    ("ozf", 0.278_013_9),
    ("gf", 9.806_65e-3),
];
const UNIT_SHARE: f64 = 0.2;

impl InputJudge<'_> {
    /// Numbers of the session that its presses contradict.
    pub(super) fn judge_session(&self, presses: &Presses) -> Vec<InputFinding> {
        let TipParams { radius, stiffness } = self.params.tip;
        if self.params.shape != TipShape::Ball {
            return Vec::new();
        }
        let told = stiffness.map_or(0.0, f64::recip);
        // what no stylus has says nothing
        let start = SessionNumbers {
            compliance: if told < ANY.compliance { told } else { 0.0 },
            ..SessionNumbers::default()
        };
        let recorded = self.recorded_presses(presses);
        let Some(mut adjusted) = SessionAdjustment::of(&recorded, radius, start, ANY) else {
            return Vec::new();
        };
        let extent = presses.scale.extent;
        let sigma = &mut adjusted.sigma;
        sigma.compliance = sigma.compliance.hypot(OF_MODEL / presses.levels.largest);
        sigma.offset_t.apply(|sigma| *sigma = sigma.hypot(OF_MODEL));
        let is_softer = adjusted
            .change
            .is_some_and(|likely| likely.change.cause == ChangeCause::StiffnessChanged);
        for (at, sigma) in sigma.change.iter_mut().enumerate() {
            let of_model = match at {
                0 if is_softer => OF_MODEL / presses.levels.largest,
                0..3 => OF_MODEL,
                _ => OF_MODEL / extent,
            };
            *sigma = sigma.hypot(of_model);
        }
        let change = adjusted
            .change
            .and_then(|change| self.change_finding(&adjusted, &change));
        let force = adjusted.force.as_ref();
        let force = force.and_then(|force| self.force_finding(presses, force));
        if let Some(change) = change {
            return [change].into_iter().chain(force).collect();
        }
        let stiffness = stiffness_finding(&adjusted, told, self.params.stiffness_share);
        let place = place_finding(&adjusted, self.params.place_sigma);
        force.into_iter().chain(stiffness).chain(place).collect()
    }

    /// The presses with the numbers of their strokes.
    fn recorded_presses(&self, presses: &Presses) -> Vec<RecordedPress> {
        let levels = &presses.levels;
        let first = self.pressing.first().map_or(0, |record| record.stamp_ns);
        let (mut stroke, mut begun, mut last) = (0, first, first);
        let pressing = self.pressing.iter();
        let pressing = pressing.filter(|record| levels.is_pressing(record));
        let pressing: Vec<&InputRecord> = pressing.collect();
        let of = pressing.iter().enumerate();
        of.map(|(at, record)| {
            let now = record.stamp_ns;
            let is_apart = now.saturating_sub(last) > STROKE_PAUSE_NS
                || now.saturating_sub(begun) > LONGEST_STROKE_NS;
            if is_apart {
                (stroke, begun) = (stroke + 1, now);
            }
            last = now;
            RecordedPress {
                stamp_ns: now,
                centre: record.centre,
                rotation: record.rotation,
                force: levels.force_o(record),
                course: course_around(&pressing, at),
                stroke,
            }
        })
        .collect()
    }

    /// A part that moved, or a ball that changed its place.
    fn change_finding(
        &self,
        adjusted: &SessionAdjustment,
        likely: &LikelyChange,
    ) -> Option<InputFinding> {
        let cause = likely.change.cause;
        let sizes = adjusted.found.change.iter().zip(&adjusted.sigma.change);
        let off = sizes.take(cause.freedoms());
        let off = off
            .map(|(size, sigma)| size.abs() / sigma)
            .fold(0.0, f64::max);
        let (cause, what, remedy) = self.change_in_words(adjusted, likely);
        let measured = format!(
            "{what}: {} presses on {} surfaces agree then",
            adjusted.presses, adjusted.surfaces
        );
        let is_possible = off > DOUBTED_SIGMAS && likely.odds > CLEAR_ODDS;
        let is_sure = off > SURE_SIGMAS;
        is_possible.then(|| {
            let numbers = self.change_numbers(adjusted, likely);
            let correction = InputCorrection::of_change(likely, [&adjusted.found, &adjusted.sigma]);
            InputFinding::new(cause, is_sure, measured, remedy)
                .with(numbers)
                .corrected_by(correction)
        })
    }

    /// Cause, what changed and when, and remedy.
    fn change_in_words(
        &self,
        adjusted: &SessionAdjustment,
        likely: &LikelyChange,
    ) -> (InputCause, String, &'static str) {
        let sizes = [(0, 1e3, "mm"), (3, 1f64.to_degrees(), "°")];
        let [shift, turn] = sizes.map(|(from, unit, name)| {
            [from, from + 1, from + 2]
                .map(|at| SizeFound {
                    value: adjusted.found.change[at] * unit,
                    sigma: adjusted.sigma.change[at] * unit,
                    known: is_known(adjusted.sigma.change[at], ANY.change[at]),
                })
                .in_words(name)
        });
        let when = self.course_in_words(likely.change.course);
        let about = likely.change.about * 1e3;
        let turned = format!(
            ", turned by {turn} about ({:.1}, {:.1}, {:.1}) mm",
            about.x, about.y, about.z
        );
        let clamp =
            "clamp the part, see that the tracker does not start again, and record it again";
        match likely.change.cause {
            ChangeCause::PartShifted => (
                InputCause::PartMoved,
                format!("{when} the part lies {shift} further"),
                clamp,
            ),
            ChangeCause::PartMoved => (
                InputCause::PartMoved,
                format!("{when} the part lies {shift} further{turned}"),
                clamp,
            ),
            ChangeCause::TipBent => (
                InputCause::TipBent,
                format!("{when} the ball is {shift} from where it was, in the axes of the stylus"),
                "measure the tip again (touchup calibrate tip), and record the part again",
            ),
            ChangeCause::StiffnessChanged => (
                InputCause::StiffnessChanged,
                format!(
                    "{when} the ball sinks by {:.4} ± {:.4} mm/N more",
                    adjusted.found.change[0] * 1e3,
                    adjusted.sigma.change[0] * 1e3
                ),
                "tighten the tip in its holder, and record the part again",
            ),
        }
    }

    pub(super) fn since_first(&self, stamp_ns: i64) -> f64 {
        let first = self
            .records
            .first()
            .map_or(stamp_ns, |record| record.stamp_ns);
        stamp_ns.saturating_sub(first) as f64 * 1e-9
    }

    pub(super) fn course_in_words(&self, course: ChangeCourse) -> String {
        match course {
            ChangeCourse::At(at) => format!("from {:.1} s on", self.since_first(at)),
            ChangeCourse::Between(from, to) => format!(
                "slowly, from {:.1} to {:.1} s,",
                self.since_first(from),
                self.since_first(to)
            ),
        }
    }

    fn change_numbers(
        &self,
        adjusted: &SessionAdjustment,
        likely: &LikelyChange,
    ) -> Vec<FoundNumber> {
        let cause = likely.change.cause;
        let names = match cause {
            ChangeCause::PartShifted | ChangeCause::PartMoved => [
                "shift_x_mm",
                "shift_y_mm",
                "shift_z_mm",
                "turn_x_deg",
                "turn_y_deg",
                "turn_z_deg",
            ],
            ChangeCause::TipBent => ["bend_x_mm", "bend_y_mm", "bend_z_mm", "", "", ""],
            ChangeCause::StiffnessChanged => ["compliance_more_mm_per_n", "", "", "", "", ""],
        };
        let sizes = adjusted.found.change.iter().zip(&adjusted.sigma.change);
        let sizes = names
            .into_iter()
            .zip(sizes)
            .enumerate()
            .take(cause.freedoms());
        let sizes = sizes.map(|(at, (name, (value, sigma)))| {
            let unit = if at < 3 { 1e3 } else { 1f64.to_degrees() };
            FoundNumber::new(name, value * unit, sigma * unit)
        });
        let about = ["about_x_mm", "about_y_mm", "about_z_mm"]
            .into_iter()
            .zip(&likely.change.about.coords);
        let about = about.map(|(name, value)| FoundNumber::new(name, value * 1e3, 0.0));
        let at = match likely.change.course {
            ChangeCourse::At(at) => Some(FoundNumber::new("at_s", self.since_first(at), 0.0)),
            ChangeCourse::Between(..) => None,
        };
        sizes.chain(about).chain(at).collect()
    }
}

/// Way of the ball from shortly before a press to shortly after it, m, in O; 0 if it rests there.
fn course_around(pressing: &[&InputRecord], at: usize) -> Vector3<f64> {
    let now = pressing[at];
    let beside = |step: isize| {
        let others = (1..=COURSE_REACH).map_while(|by| {
            let other = pressing.get(at.checked_add_signed(step * by)?)?;
            let between = pressing[at.checked_add_signed(step * (by - 1))?];
            let pause_ns = other.stamp_ns.saturating_sub(between.stamp_ns).abs();
            (pause_ns <= STROKE_PAUSE_NS).then_some(*other)
        });
        others.last().unwrap_or(now)
    };
    let way = beside(1).centre - beside(-1).centre;
    if way.norm() < LEAST_COURSE {
        Vector3::zeros()
    } else {
        way
    }
}

/// A size along one axis.
struct SizeFound {
    value: f64,
    sigma: f64,
    /// the presses determine it
    known: bool,
}

trait InWords {
    fn in_words(&self, unit: &str) -> String;
}

impl InWords for [SizeFound; 3] {
    fn in_words(&self, unit: &str) -> String {
        let words = self.each_ref().map(|of| {
            if of.known {
                format!("{:.2} ± {:.2}", of.value, of.sigma)
            } else {
                "unknown".to_owned()
            }
        });
        format!("({}) {unit}", words.join(", "))
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
    let off = (found.max(0.0) - told).abs() / sigma.hypot(of_told * told);
    let unit = FORCE_UNITS.iter().find(|(_, unit)| {
        (found / unit - told).abs() < 3.0 * sigma / unit && sigma < UNIT_SHARE * found
    });
    let unit = unit.map_or_else(String::new, |(name, _)| {
        format!(", as forces in {name} would have it")
    });
    let measured = format!(
        "{} presses on {} surfaces agree if the ball sinks by {:.4} ± {:.4} mm/N, and by its stiffness it sinks by {:.4} mm/N{unit}",
        adjusted.presses,
        adjusted.surfaces,
        found * 1e3,
        sigma * 1e3,
        told * 1e3
    );
    let remedy = "give the stiffness in N/mm (--stiffness-n-per-mm, tip.stiffness_n_per_mm; touchup calibrate tip)";
    (is_possible && off > DOUBTED_SIGMAS).then(|| {
        let number = FoundNumber::new("compliance_mm_per_n", found * 1e3, sigma * 1e3);
        InputFinding::new(InputCause::Stiffness, off > SURE_SIGMAS, measured, remedy)
            .with(vec![number])
            .corrected_by(InputCorrection::of_compliance(found, sigma))
    })
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
    (off > DOUBTED_SIGMAS).then(|| {
        let names = ["offset_x_mm", "offset_y_mm", "offset_z_mm"].into_iter();
        let numbers = names
            .zip(found.iter().zip(sigma))
            .map(|(name, (found, sigma))| FoundNumber::new(name, found * 1e3, sigma * 1e3));
        InputFinding::new(InputCause::TipOffset, off > SURE_SIGMAS, measured, remedy)
            .with(numbers.collect())
            .corrected_by(Some(InputCorrection::of_place(found, sigma)))
    })
}
