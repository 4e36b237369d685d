//! Clock offset: delay of the wrench clock, from the samples themselves.
//!
//! Onsets of contact ([`ContactOnsets`]) and sliding ([`CourseBlocks`]) are parts of one sum over
//! trial delays within ± 148 ms: it tells the course of the delay ([`ClockCourse`]), steady or with
//! one change. The onsets, if there are enough, then tell it finely, with its uncertainty; lifting
//! tells it if nothing else does.

use super::clock_course::{ClockCourse, CourseShape, LEAST_PARTS, changes, odds, steady};
use super::clock_offset::{ClockChange, ClockDrift, ClockEvidence, ClockOffset, ClockStep};
use super::course_blocks::CourseBlocks;
use super::delay_part::{DelayPart, MOST, SPAN_NS, TimedDelay};
use super::onsets::{ContactOnsets, LARGEST_DELAY, OnsetWindow};
use crate::stylus::{ContactSample, SettingError};

/// Rounds in which onsets tell the delay around which they are seen.
const ROUNDS: usize = 3;
/// Error of the onset of a force that does not rise exponentially, and of friction that is not
/// against the motion, s. Half a period of the wrench adds to it: the part of the period over which
/// a sensor averages is unknown.
const SHAPE: f64 = 0.3e-3;
const COARSE: f64 = 2e-3;
/// Maximum uncertainty of an estimate by onsets, and by the course, s.
const LARGEST_SIGMA: f64 = 3e-3;
const LARGEST_COARSE_SIGMA: f64 = 12e-3;
/// Minimum odds of a change against none, and of a delay by sliding or lifting against none, as a
/// natural logarithm.
const CLEAR_ODDS: f64 = 10.0;
/// Minimum of a sure change, in standard uncertainties, and of one worth removing, s.
const SURE_SIGMAS: f64 = 5.0;
const LEAST_CHANGE: f64 = 5e-3;
/// Standard uncertainties within which an estimate may be elsewhere.
const CLEAR_SIGMAS: f64 = 3.0;

/// Collects onsets of contact, sliding and lifting, in bounded memory.
#[derive(Clone, Debug)]
pub struct ClockEstimator {
    /// compliance of stylus and probe, m/N
    bend: f64,
    onsets: ContactOnsets,
    course: CourseBlocks,
}

/// A likely onset.
type LikelyOnset<'a> = (DelayPart, &'a OnsetWindow);

impl ClockEstimator {
    /// - `stiffness`: of stylus and probe, N/m; `None`: rigid.
    ///
    /// # Errors
    /// [`SettingError`] for a stiffness that is not positive and finite.
    pub fn new(stiffness: Option<f64>) -> Result<Self, SettingError> {
        let value = stiffness.unwrap_or(1.0);
        SettingError::check("tip stiffness (N/m)", value, value > 0.0, "more than 0")?;
        Ok(Self {
            bend: stiffness.map_or(0.0, f64::recip),
            onsets: ContactOnsets::default(),
            course: CourseBlocks::default(),
        })
    }

    /// Takes the next sample, later than the previous one.
    pub fn push(&mut self, sample: &ContactSample) {
        self.course.push(sample);
        self.onsets.push(sample);
    }

    /// Delay by onsets and sliding; if they do not determine it together, by sliding, which overrules
    /// the onsets, or by lifting; `None` if none of them does.
    pub fn offset(&self) -> Option<ClockOffset> {
        let onsets = self.onsets.onsets.iter();
        let onsets = onsets.filter_map(|onset| {
            let time = self.course.since_first(onset.stamp_ns);
            Some((onset.part(time, self.bend)?, onset))
        });
        let mut onsets: Vec<LikelyOnset> = onsets.collect();
        if onsets.len() < LEAST_PARTS {
            onsets.clear();
        }
        let [sliding, lifting] = [self.course.sliding(), self.course.lifting()];
        let slides = Some(&sliding).filter(|sliding| sliding.len() >= LEAST_PARTS);
        let of_onsets = onsets.iter().map(|(part, _)| part.clone());
        let mut both: Vec<DelayPart> = slides
            .into_iter()
            .flatten()
            .cloned()
            .chain(of_onsets)
            .collect();
        both.sort_by(|one, other| one.time.total_cmp(&other.time));
        let [slid, lifted] = self.course.seconds();
        // a change that onsets do not show is none
        let is_shown = onsets.is_empty();
        self.by(&both, &onsets, slid, true)
            .or_else(|| self.by(&sliding, &[], slid, is_shown))
            .or_else(|| self.by(&lifting, &[], lifted, is_shown))
    }

    /// Delay by some parts, in order of time; a change is clear by all of them, and by the onsets.
    ///
    /// - `seconds`: time of sliding or lifting, s. `may_change`: whether it may change.
    fn by(
        &self,
        parts: &[DelayPart],
        onsets: &[LikelyOnset],
        seconds: f64,
        may_change: bool,
    ) -> Option<ClockOffset> {
        if parts.len() < LEAST_PARTS {
            return None;
        }
        let of_onsets: Vec<DelayPart> = onsets.iter().map(|(part, _)| part.clone()).collect();
        let steady = steady(parts);
        let is_odd =
            |change: &ClockCourse, parts: &[DelayPart]| odds(change, &steady, parts) > CLEAR_ODDS;
        let is_change = |change: &ClockCourse| {
            may_change && is_odd(change, parts) && (onsets.is_empty() || is_odd(change, &of_onsets))
        };
        let changes = changes(parts).into_iter().filter(is_change);
        let mut courses = changes.chain([steady]);
        courses.find_map(|course| self.refined(course, parts, onsets, seconds))
    }

    /// The offset, if it is clear, inside of what was searched, and sure; by the onsets, if enough
    /// of them agree.
    ///
    /// - `seconds`: time of sliding or lifting, s.
    fn refined(
        &self,
        course: ClockCourse,
        parts: &[DelayPart],
        onsets: &[LikelyOnset],
        seconds: f64,
    ) -> Option<ClockOffset> {
        if !course.is_clear(parts) {
            return None;
        }
        let by_onsets = self.through_onsets(course, onsets);
        let (course, error, period, evidence) = if let Some((course, count)) = by_onsets {
            let evidence = ClockEvidence::Onsets(count);
            (course, SHAPE, self.onsets.period, evidence)
        } else {
            let delays = parts
                .iter()
                .filter_map(|part| part.delay(course.at(part.time)));
            let course = course.through(&delays.collect::<Vec<_>>())?;
            let evidence = ClockEvidence::Course(seconds);
            (course, COARSE, self.course.period(), evidence)
        };
        let found = self.told(&course, error.hypot(period / 2.0), evidence)?;
        let [limit, largest] = match evidence {
            ClockEvidence::Onsets(_) => [LARGEST_DELAY, LARGEST_SIGMA],
            ClockEvidence::Course(_) => [
                SPAN_NS as f64 * 1e-9 - CLEAR_SIGMAS * found.sigma,
                LARGEST_COARSE_SIGMA,
            ],
        };
        let ends = [parts.first()?.time, parts.last()?.time].map(|time| course.at(time));
        let is_inside = ends.iter().all(|delay| delay.abs() < limit);
        let zero = ClockCourse::steady(0.0);
        let is_seen = found.change.is_some()
            || by_onsets.is_some()
            || found.offset.abs() <= CLEAR_SIGMAS * found.sigma
            || odds(&course, &zero, parts) > CLEAR_ODDS;
        (is_inside && is_seen && found.sigma <= largest).then_some(found)
    }

    /// A course through the onsets that show it, and their number, if they are enough.
    fn through_onsets(
        &self,
        mut course: ClockCourse,
        onsets: &[LikelyOnset],
    ) -> Option<(ClockCourse, usize)> {
        let mut count = 0;
        // each onset is seen around the delay that is expected then
        for _ in 0..ROUNDS {
            let near = onsets.iter().filter_map(|(part, onset)| {
                let delay = course.at(part.time);
                let is_near = part.least_near(delay) < MOST;
                is_near.then(|| onset.delay(part.time, delay, self.bend))?
            });
            let delays: Vec<TimedDelay> = near.collect();
            course = course.through(&delays)?;
            count = delays.len();
        }
        Some((course, count))
    }

    /// The offset with its change; `None` for a change that is not sure, or not worth removing.
    ///
    /// - `error`: that all parts have in common, s.
    fn told(
        &self,
        course: &ClockCourse,
        error: f64,
        evidence: ClockEvidence,
    ) -> Option<ClockOffset> {
        let lasts = self.course.lasts();
        let [one, other]: [f64; 2] = course.unknowns.into();
        let sigmas = course
            .covariance
            .diagonal()
            .map(|variance| variance.max(0.0).sqrt());
        let (change, size, sigma) = match course.shape {
            CourseShape::Steady => (None, 0.0, 0.0),
            CourseShape::Drifting(_) => {
                let drift = ClockDrift {
                    rate: other,
                    rate_sigma: sigmas.y.hypot(error / lasts.max(f64::MIN_POSITIVE)),
                    offset_at_first: course.at(0.0),
                    offset_at_last: course.at(lasts),
                };
                (
                    Some(ClockChange::Drift(drift)),
                    other * lasts,
                    drift.rate_sigma * lasts,
                )
            }
            CourseShape::Stepping([at, at_sigma]) => {
                let step = ClockStep {
                    at,
                    at_sigma,
                    offset_before: one,
                    offset_after: other,
                };
                (
                    Some(ClockChange::Step(step)),
                    other - one,
                    sigmas.norm().hypot(error),
                )
            }
        };
        let is_change = size.abs() > LEAST_CHANGE.max(SURE_SIGMAS * sigma);
        let is_step = matches!(course.shape, CourseShape::Stepping(_));
        (change.is_none() || is_change).then(|| ClockOffset {
            offset: if is_step { (one + other) / 2.0 } else { one },
            sigma: if is_step { sigmas.max() } else { sigmas.x }.hypot(error),
            change,
            evidence,
        })
    }
}
