//! The samples of each stroke.

use serde::{Deserialize, Serialize};

use crate::reconstruct::history::Direction;
use crate::stylus::{STROKE_PAUSE_NS, TouchState};

/// The samples of a stroke: from touch-down to the next touch-down, so including the path of the
/// tip after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StrokeSpan {
    /// stamp of the first sample, ns
    pub from_ns: i64,
    /// stamp of the first sample after it, ns; the maximum without a next stroke
    pub until_ns: i64,
}

impl StrokeSpan {
    /// Whether a sample of this stamp is part of the stroke.
    pub fn contains(&self, stamp_ns: i64) -> bool {
        (self.from_ns..self.until_ns).contains(&stamp_ns)
    }

    /// Whether this stamp, ns, is that of its touch-down. If other samples are missing, the bias,
    /// which follows the samples, may move it by some samples.
    pub fn begins_at(&self, stamp_ns: i64) -> bool {
        self.from_ns.abs_diff(stamp_ns) < STROKE_PAUSE_NS.unsigned_abs() / 2
    }
}

/// Start times of strokes. Grows by some bytes per stroke.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct StrokeLog {
    /// stamps of touch-down, undone strokes included, ns, in order of time
    begun_ns: Vec<i64>,
    /// indices of the strokes that count, in order
    done: Vec<usize>,
    /// indices of the undone strokes, the latest last
    undone: Vec<usize>,
    /// stamp of the first sample since the tip was free, ns
    touched_down_ns: Option<i64>,
    last_contact_ns: Option<i64>,
}

impl StrokeLog {
    /// Records the touch state of the next sample.
    pub(crate) fn note(&mut self, stamp_ns: i64, state: TouchState) {
        if state == TouchState::Free {
            self.touched_down_ns = None;
        } else {
            self.touched_down_ns.get_or_insert(stamp_ns);
        }
    }

    /// Records a contact, the first of a stroke or a further one of the last stroke.
    pub(crate) fn note_contact(&mut self, stamp_ns: i64, is_first: bool) {
        if is_first {
            let down_ns = self.touched_down_ns.unwrap_or(stamp_ns);
            // after an undo during a touch, without a free sample in between, the stroke goes on
            // from there
            let from_ns = self
                .last_contact_ns
                .map_or(down_ns, |last_ns| down_ns.max(last_ns.saturating_add(1)));
            self.undone.clear();
            self.done.push(self.begun_ns.len());
            self.begun_ns.push(from_ns);
        }
        self.last_contact_ns = Some(stamp_ns);
    }

    /// Records an undo of the last stroke, or a redo of the last undone one.
    pub(crate) fn exchange(&mut self, direction: Direction) {
        let (from, to) = match direction {
            Direction::Undo => (&mut self.done, &mut self.undone),
            Direction::Redo => (&mut self.undone, &mut self.done),
        };
        to.extend(from.pop());
    }

    /// Number of strokes that count.
    pub(crate) fn count(&self) -> usize {
        self.done.len()
    }

    /// The samples of a stroke that counts, by its number in order of time.
    pub(crate) fn span(&self, number: usize) -> Option<StrokeSpan> {
        let at = *self.done.get(number)?;
        let until_ns = self.begun_ns.get(at + 1).copied().unwrap_or(i64::MAX);
        Some(StrokeSpan {
            from_ns: self.begun_ns[at],
            until_ns,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A touch of three samples from `ms` on, the middle one a contact.
    fn touch(log: &mut StrokeLog, ms: i64) {
        for (at, state) in [TouchState::Light, TouchState::Contact, TouchState::Free]
            .into_iter()
            .enumerate()
        {
            let stamp_ns = ms + at as i64;
            log.note(stamp_ns, state);
            if state == TouchState::Contact {
                log.note_contact(stamp_ns, true);
            }
        }
    }

    fn spans(log: &StrokeLog) -> Vec<(i64, i64)> {
        let spans = (0..log.count()).filter_map(|number| log.span(number));
        spans
            .map(|StrokeSpan { from_ns, until_ns }| (from_ns, until_ns))
            .collect()
    }

    #[test]
    fn a_stroke_is_what_comes_from_touch_down_to_the_next_touch_down_undone_ones_among_them() {
        let mut log = StrokeLog::default();
        [100, 200, 300]
            .into_iter()
            .for_each(|ms| touch(&mut log, ms));
        assert_eq!(spans(&log), [(100, 200), (200, 300), (300, i64::MAX)]);
        log.exchange(Direction::Undo);
        log.exchange(Direction::Undo);
        assert_eq!(spans(&log), [(100, 200)], "what was undone is not of it");
        log.exchange(Direction::Redo);
        assert_eq!(spans(&log), [(100, 200), (200, 300)]);
        touch(&mut log, 400);
        log.exchange(Direction::Redo);
        assert_eq!(
            spans(&log),
            [(100, 200), (200, 300), (400, i64::MAX)],
            "nothing is left to be done again"
        );
    }

    #[test]
    fn a_stroke_that_goes_on_while_it_is_undone_begins_again_behind_its_last_contact() {
        let mut log = StrokeLog::default();
        (0..4).for_each(|ms| log.note(ms, TouchState::Contact));
        (1..4).for_each(|ms| log.note_contact(ms, ms == 1));
        log.exchange(Direction::Undo);
        log.note(4, TouchState::Contact);
        log.note_contact(4, true);
        assert_eq!(spans(&log), [(4, i64::MAX)]);
    }
}
