//! The touches themselves, downsampled in time, of which features are measured.

use crate::reconstruct::evidence::contact_map::Verdict;
use crate::reconstruct::evidence::touches::{SurfaceContact, TipTouch};
use crate::reconstruct::incremental::history::Direction;
use crate::stylus::ProbedPoint;

/// Touches in order of time. A bounded number: when there are too many, every second one is dropped.
#[derive(Clone, Debug)]
pub(crate) struct ProbedLog {
    /// radius of the tip when it is a ball, m
    ball: Option<f64>,
    points: Vec<ProbedPoint>,
    undone: Vec<ProbedPoint>,
    /// strokes begun and not undone
    strokes: u32,
    spacing_ns: i64,
}

/// Touches closer together in time are redundant: the window in which they are smoothed is eight times as long.
const SPACING_NS: i64 = 4_000_000;
/// So many touches are kept: over an hour of them.
const MOST_POINTS: usize = 1 << 20;

impl ProbedLog {
    /// An empty log.
    ///
    /// - `ball`: radius of the tip when it is a ball, m.
    pub fn new(ball: Option<f64>) -> Self {
        Self { ball, points: Vec::new(), undone: Vec::new(), strokes: 0, spacing_ns: SPACING_NS }
    }

    /// All touches, in order of time.
    pub fn points(&self) -> &[ProbedPoint] {
        &self.points
    }

    /// Later touches belong to a new stroke.
    pub(in crate::reconstruct) fn begin_stroke(&mut self) {
        self.undone.clear();
        self.strokes += 1;
    }

    /// Keeps a contact, which may be one of two of its touch, unless the last one is too recent.
    pub(in crate::reconstruct) fn note(&mut self, touch: &TipTouch, contact: &SurfaceContact, verdict: Verdict) {
        let is_of_last = self.points.last().is_some_and(|last| last.stamp_ns == touch.stamp_ns);
        let is_due = self.points.last().is_none_or(|last| touch.stamp_ns - last.stamp_ns >= self.spacing_ns);
        if !is_due && !is_of_last {
            return;
        }
        if self.points.len() >= MOST_POINTS {
            let mut at = 0;
            self.points.retain(|_| {
                at += 1;
                at % 2 == 0
            });
            self.spacing_ns *= 2;
        }
        self.points.push(ProbedPoint {
            stamp_ns: touch.stamp_ns,
            stroke: self.strokes.saturating_sub(1),
            centre: if self.ball.is_some() { touch.centre } else { contact.point },
            radius: self.ball.unwrap_or(0.0),
            point: contact.point,
            normal: contact.normal,
            sigma: contact.sigma.noise,
            calibration: contact.sigma.calibration,
            weight: contact.weight,
            is_rejected: verdict == Verdict::Rejected,
        });
    }

    /// Takes the last stroke back, or does the one again that was undone last.
    pub(in crate::reconstruct) fn exchange(&mut self, direction: Direction) {
        match direction {
            Direction::Undo => {
                self.strokes = self.strokes.saturating_sub(1);
                let first = self.points.partition_point(|point| point.stroke < self.strokes);
                self.undone.extend(self.points.drain(first..).rev());
            }
            Direction::Redo => {
                self.strokes += 1;
                while self.undone.last().is_some_and(|next| next.stroke < self.strokes) {
                    self.points.extend(self.undone.pop());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::ContactSigma;
    use nalgebra::{Point3, Vector3};

    fn noted(log: &mut ProbedLog, ms: i64) {
        let (point, normal) = (Point3::new(ms as f64, 0.0, 0.0), Vector3::z());
        let stamp_ns = ms * 1_000_000;
        let contact = SurfaceContact { point, normal, weight: 1.0, stamp_ns, sigma: ContactSigma::default() };
        let touch = TipTouch { stamp_ns, centre: point + normal * 1.5e-3, axis: normal, contact: Some(contact) };
        log.note(&touch, &contact, Verdict::Taken);
    }

    #[test]
    fn strokes_are_undone_and_done_again_in_order() {
        let mut log = ProbedLog::new(Some(1.5e-3));
        for start in [0, 1000, 2000] {
            log.begin_stroke();
            (0..5).for_each(|i| noted(&mut log, start + 4 * i));
        }
        let all = log.points().to_vec();
        assert_eq!(all.len(), 15);
        log.exchange(Direction::Undo);
        log.exchange(Direction::Undo);
        assert_eq!(log.points(), &all[..5]);
        log.exchange(Direction::Redo);
        assert_eq!(log.points(), &all[..10]);
        log.exchange(Direction::Redo);
        assert_eq!(log.points(), &all[..]);
        log.exchange(Direction::Undo);
        log.begin_stroke();
        noted(&mut log, 5000);
        log.exchange(Direction::Redo);
        assert_eq!(log.points().len(), 11, "what was undone is gone once something else was touched");
    }

    #[test]
    fn touches_that_say_the_same_are_left_out() {
        let mut log = ProbedLog::new(None);
        log.begin_stroke();
        (0..100).for_each(|ms| noted(&mut log, ms));
        assert_eq!(log.points().len(), 25);
    }
}
