//! Strokes that were taken back, done again, taken out and put back in a session, and what is left of its samples.

use std::iter::Peekable;
use std::vec::IntoIter;

use serde::{Deserialize, Serialize};

use touchup_core::reconstruct::StrokeSpan;

/// A change of strokes, as the record of a session has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "change", rename_all = "snake_case", deny_unknown_fields)]
pub enum StrokeChange {
    /// the last stroke was taken back
    Undo(Exchange),
    /// the stroke was done again that was taken back last
    Redo(Exchange),
    /// the samples of a stroke were taken out, as if they had never come
    TakeOut(StrokeSpan),
    /// … and put back, as if they had never been taken out
    PutBack(StrokeSpan),
}

/// When a stroke was taken back or done again, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exchange {
    /// after the sample of this stamp, ns
    pub after_ns: i64,
    /// its touch-down, ns; `None` where there is no patch
    pub stroke_ns: Option<i64>,
}

/// All changes of strokes in a session, in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StrokeChanges(Vec<StrokeChange>);

impl FromIterator<StrokeChange> for StrokeChanges {
    fn from_iter<I: IntoIterator<Item = StrokeChange>>(changes: I) -> Self {
        Self(changes.into_iter().collect())
    }
}

impl StrokeChanges {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// One more.
    pub fn push(&mut self, change: StrokeChange) {
        self.0.push(change);
    }

    /// What is taken out in the end, the last one last.
    pub fn taken_out(&self) -> Vec<StrokeSpan> {
        let mut spans = Vec::new();
        for change in &self.0 {
            match change {
                StrokeChange::TakeOut(span) => spans.push(*span),
                StrokeChange::PutBack(span) => spans.retain(|out| out != span),
                StrokeChange::Undo(_) | StrokeChange::Redo(_) => {}
            }
        }
        spans
    }

    /// Whether a stroke was taken back or done again.
    pub fn has_exchanges(&self) -> bool {
        self.0.iter().any(|change| matches!(change, StrokeChange::Undo(_) | StrokeChange::Redo(_)))
    }

    /// What is to be done along the samples of the session.
    pub fn replay(&self) -> StrokeReplay {
        let taken_out = self.taken_out();
        let is_left = |exchange: &Exchange| {
            let is_out = |stroke_ns| taken_out.iter().any(|span| span.contains(stroke_ns));
            !exchange.stroke_ns.is_some_and(is_out)
        };
        let exchanges = self.0.iter().filter_map(|change| match change {
            StrokeChange::Undo(exchange) if is_left(exchange) => Some((*exchange, true)),
            StrokeChange::Redo(exchange) if is_left(exchange) => Some((*exchange, false)),
            _ => None,
        });
        let exchanges = exchanges.collect::<Vec<_>>().into_iter().peekable();
        StrokeReplay { taken_out, exchanges }
    }
}

/// Walks along the samples of a session.
#[derive(Clone, Debug)]
pub struct StrokeReplay {
    taken_out: Vec<StrokeSpan>,
    exchanges: Peekable<IntoIter<(Exchange, bool)>>,
}

impl StrokeReplay {
    /// Whether the sample of this stamp is left.
    pub fn takes(&self, stamp_ns: i64) -> bool {
        !self.taken_out.iter().any(|span| span.contains(stamp_ns))
    }

    /// The next stroke that was taken back (true) or done again (false) before the sample of this stamp; strokes that are taken out are
    /// not among them.
    pub fn next_before(&mut self, stamp_ns: i64) -> Option<(Exchange, bool)> {
        self.exchanges.next_if(|(exchange, _)| exchange.after_ns < stamp_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(from_ns: i64) -> StrokeSpan {
        StrokeSpan { from_ns, until_ns: from_ns + 100 }
    }

    fn exchange(after_ns: i64, stroke_ns: i64) -> Exchange {
        Exchange { after_ns, stroke_ns: Some(stroke_ns) }
    }

    #[test]
    fn a_stroke_that_is_taken_out_is_neither_taken_back_nor_done_again() {
        use StrokeChange::{PutBack, Redo, TakeOut, Undo};
        // strokes at 100, 200 and 300; two are taken back, one is done again; then that one goes
        let back = [Undo(exchange(390, 300)), Undo(exchange(390, 200)), Redo(exchange(390, 200))];
        let changes: StrokeChanges = back.into_iter().chain([TakeOut(span(200)), TakeOut(span(100))]).collect();
        let mut replay = changes.replay();
        assert!(replay.takes(99) && !replay.takes(100) && !replay.takes(299) && replay.takes(300));
        assert_eq!(replay.next_before(390), None);
        assert_eq!(replay.next_before(391), Some((exchange(390, 300), true)));
        assert_eq!(replay.next_before(i64::MAX), None);

        let changes: StrokeChanges = changes.0.into_iter().chain([PutBack(span(200))]).collect();
        assert_eq!(changes.taken_out(), [span(100)]);
        let mut replay = changes.replay();
        assert!(!replay.takes(199) && replay.takes(200));
        let left: Vec<_> = std::iter::from_fn(|| replay.next_before(i64::MAX)).map(|(_, is_undo)| is_undo).collect();
        assert_eq!(left, [true, true, false]);
    }

    /// The lines of `strokes.jsonl`.
    #[test]
    fn a_change_is_one_object_that_names_itself() {
        let lines = [
            (StrokeChange::Undo(exchange(5, 3)), r#"{"change":"undo","after_ns":5,"stroke_ns":3}"#),
            (StrokeChange::TakeOut(span(7)), r#"{"change":"take_out","from_ns":7,"until_ns":107}"#),
        ];
        for (change, line) in lines {
            assert_eq!(serde_json::to_string(&change).unwrap(), line);
            assert_eq!(serde_json::from_str::<StrokeChange>(line).unwrap(), change);
        }
        assert!(serde_json::from_str::<StrokeChange>(r#"{"after_ns":5,"is_undo":true}"#).is_err());
    }
}
