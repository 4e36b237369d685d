//! Undone, redone, excluded and restored strokes of a session, and its remaining samples.

use std::iter::Peekable;
use std::vec::IntoIter;

use serde::{Deserialize, Serialize};

use touchup_method::reconstruct::StrokeSpan;

/// A change of strokes in the record of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "change", rename_all = "snake_case", deny_unknown_fields)]
pub enum StrokeChange {
    /// undoes the last stroke
    Undo(UndoStep),
    /// redoes the last undone stroke
    Redo(UndoStep),
    /// excludes the samples of a stroke, as if they had never come
    TakeOut(Removal),
    /// restores the samples of a stroke, as if never excluded
    PutBack(Removal),
}

impl StrokeChange {
    /// Stamp of the sample before the change, ns.
    pub fn after_ns(&self) -> i64 {
        match self {
            Self::Undo(exchange) | Self::Redo(exchange) => exchange.after_ns,
            Self::TakeOut(removal) | Self::PutBack(removal) => removal.after_ns,
        }
    }
}

/// Time and stroke of an undo or redo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UndoStep {
    /// stamp of the sample before, ns
    pub after_ns: i64,
    /// touch-down of the stroke, ns; `None` without a patch
    pub stroke_ns: Option<i64>,
}

/// Time and stroke of an exclusion or restoration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Removal {
    /// stamp of the sample before, ns
    pub after_ns: i64,
    /// from touch-down until the next
    pub stroke: StrokeSpan,
}

/// All changes of strokes in a session, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StrokeChanges(Vec<StrokeChange>);

impl FromIterator<StrokeChange> for StrokeChanges {
    fn from_iter<I: IntoIterator<Item = StrokeChange>>(changes: I) -> Self {
        Self(changes.into_iter().collect())
    }
}

impl StrokeChanges {
    /// Whether there are no changes.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a change.
    pub fn push(&mut self, change: StrokeChange) {
        self.0.push(change);
    }

    /// The strokes excluded in the end, the last one last.
    pub fn taken_out(&self) -> Vec<StrokeSpan> {
        let mut spans = Vec::new();
        for change in &self.0 {
            match change {
                StrokeChange::TakeOut(removal) => spans.push(removal.stroke),
                StrokeChange::PutBack(removal) => spans.retain(|out| *out != removal.stroke),
                StrokeChange::Undo(_) | StrokeChange::Redo(_) => {}
            }
        }
        spans
    }

    /// Whether there is an undo or redo.
    pub fn has_exchanges(&self) -> bool {
        self.0
            .iter()
            .any(|change| matches!(change, StrokeChange::Undo(_) | StrokeChange::Redo(_)))
    }

    /// The changes to apply along the samples for the final state of the session: excluded strokes
    /// never come.
    pub fn replay(&self) -> StrokeReplay {
        let taken_out = self.taken_out();
        let is_left = |exchange: &UndoStep| {
            let is_out = |stroke_ns| taken_out.iter().any(|span| span.contains(stroke_ns));
            !exchange.stroke_ns.is_some_and(is_out)
        };
        let exchanges = self.0.iter().filter_map(|change| match change {
            StrokeChange::Undo(exchange) if is_left(exchange) => Some((*exchange, true)),
            StrokeChange::Redo(exchange) if is_left(exchange) => Some((*exchange, false)),
            _ => None,
        });
        let exchanges = exchanges.collect::<Vec<_>>().into_iter().peekable();
        StrokeReplay {
            taken_out,
            exchanges,
        }
    }

    /// All changes along the samples of the session, in order.
    pub fn history(self) -> StrokeHistory {
        StrokeHistory {
            changes: self,
            done: 0,
        }
    }
}

/// Walks along the samples of a session.
#[derive(Clone, Debug)]
pub struct StrokeReplay {
    taken_out: Vec<StrokeSpan>,
    exchanges: Peekable<IntoIter<(UndoStep, bool)>>,
}

impl StrokeReplay {
    /// Whether the sample of this stamp remains.
    pub fn takes(&self, stamp_ns: i64) -> bool {
        !self.taken_out.iter().any(|span| span.contains(stamp_ns))
    }

    /// The next undo (true) or redo (false) before the sample of this stamp; skips excluded
    /// strokes.
    pub fn next_before(&mut self, stamp_ns: i64) -> Option<(UndoStep, bool)> {
        self.exchanges
            .next_if(|(exchange, _)| exchange.after_ns < stamp_ns)
    }
}

/// Walks along all samples of a session, with each change at its time.
#[derive(Clone, Debug)]
pub struct StrokeHistory {
    changes: StrokeChanges,
    done: usize,
}

impl StrokeHistory {
    /// The next change before the sample of this stamp.
    pub fn next_before(&mut self, stamp_ns: i64) -> Option<StrokeChange> {
        let next = self
            .changes
            .0
            .get(self.done)
            .filter(|change| change.after_ns() < stamp_ns);
        self.done += usize::from(next.is_some());
        next.copied()
    }

    /// All changes that [`Self::next_before`] has returned.
    pub fn so_far(&self) -> StrokeChanges {
        self.changes.0.iter().take(self.done).copied().collect()
    }

    /// The same history from its beginning.
    pub fn again(self) -> Self {
        self.changes.history()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(from_ns: i64) -> StrokeSpan {
        StrokeSpan {
            from_ns,
            until_ns: from_ns + 100,
        }
    }

    fn removal(after_ns: i64, from_ns: i64) -> Removal {
        Removal {
            after_ns,
            stroke: span(from_ns),
        }
    }

    fn exchange(after_ns: i64, stroke_ns: i64) -> UndoStep {
        UndoStep {
            after_ns,
            stroke_ns: Some(stroke_ns),
        }
    }

    #[test]
    fn a_stroke_that_is_taken_out_is_neither_taken_back_nor_done_again() {
        use StrokeChange::{PutBack, Redo, TakeOut, Undo};
        // strokes at 100, 200 and 300: two undone, one redone, then that one excluded
        let back = [
            Undo(exchange(390, 300)),
            Undo(exchange(390, 200)),
            Redo(exchange(390, 200)),
        ];
        let changes: StrokeChanges = back
            .into_iter()
            .chain([TakeOut(removal(395, 200)), TakeOut(removal(395, 100))])
            .collect();
        let mut replay = changes.replay();
        assert!(replay.takes(99) && !replay.takes(100) && !replay.takes(299) && replay.takes(300));
        assert_eq!(replay.next_before(390), None);
        assert_eq!(replay.next_before(391), Some((exchange(390, 300), true)));
        assert_eq!(replay.next_before(i64::MAX), None);

        let changes: StrokeChanges = changes
            .0
            .into_iter()
            .chain([PutBack(removal(399, 200))])
            .collect();
        assert_eq!(changes.taken_out(), [span(100)]);
        let mut replay = changes.replay();
        assert!(!replay.takes(199) && replay.takes(200));
        let left: Vec<_> = std::iter::from_fn(|| replay.next_before(i64::MAX))
            .map(|(_, is_undo)| is_undo)
            .collect();
        assert_eq!(left, [true, true, false]);
    }

    #[test]
    fn a_history_has_each_change_once_where_it_was_made() {
        use StrokeChange::{PutBack, TakeOut, Undo};
        let all = [
            Undo(exchange(150, 100)),
            TakeOut(removal(250, 0)),
            PutBack(removal(250, 0)),
            Undo(exchange(400, 300)),
        ];
        let mut history = all.into_iter().collect::<StrokeChanges>().history();
        for _ in 0..2 {
            assert_eq!(
                (history.next_before(150), history.so_far().is_empty()),
                (None, true)
            );
            assert_eq!(history.next_before(151), Some(all[0]));
            assert_eq!(history.next_before(250), None);
            assert_eq!(
                [300, 300, 300].map(|stamp_ns| history.next_before(stamp_ns)),
                [Some(all[1]), Some(all[2]), None]
            );
            assert_eq!(history.so_far(), all[..3].iter().copied().collect());
            history = history.again();
        }
    }

    /// The lines of `strokes.jsonl`.
    #[test]
    fn a_change_is_one_object_that_names_itself() {
        let lines = [
            (
                StrokeChange::Undo(exchange(5, 3)),
                r#"{"change":"undo","after_ns":5,"stroke_ns":3}"#,
            ),
            (
                StrokeChange::TakeOut(removal(150, 7)),
                r#"{"change":"take_out","after_ns":150,"stroke":{"from_ns":7,"until_ns":107}}"#,
            ),
        ];
        for (change, line) in lines {
            assert_eq!(serde_json::to_string(&change).unwrap(), line);
            assert_eq!(serde_json::from_str::<StrokeChange>(line).unwrap(), change);
        }
        assert!(serde_json::from_str::<StrokeChange>(r#"{"after_ns":5,"is_undo":true}"#).is_err());
    }
}
