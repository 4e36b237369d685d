//! Whether the samples of a session are recorded as they come, or come from what was recorded of it.

use crate::session::{SessionRecorder, StrokeChanges, StrokeReplay, Unrecorded};

/// Whether a session is recorded or replayed.
pub enum Keeping {
    /// what is accepted is taken down
    Recorded(SessionRecorder),
    /// it is there already, and stays as it is
    Replayed(Box<ReplayedSession>),
}

impl Keeping {
    /// What takes the session down; `None` where it is replayed.
    pub fn recorder(&self) -> Option<&SessionRecorder> {
        if let Self::Recorded(recorder) = self { Some(recorder) } else { None }
    }

    /// Whether it is replayed.
    pub fn is_replayed(&self) -> bool {
        matches!(self, Self::Replayed(_))
    }

    /// Messages missing in its recording so far.
    pub fn unrecorded(&self) -> Unrecorded {
        self.recorder().map(SessionRecorder::unrecorded).unwrap_or_default()
    }
}

/// What a session that is replayed has beside its messages.
#[derive(Clone, Debug)]
pub struct ReplayedSession {
    changes: StrokeChanges,
    strokes: StrokeReplay,
    run: u32,
    seen_ns: Option<i64>,
}

impl ReplayedSession {
    /// Before its first message.
    ///
    /// - `changes`: of strokes, as its record has them.
    pub fn new(changes: StrokeChanges) -> Self {
        Self { strokes: changes.replay(), changes, run: 1, seen_ns: None }
    }

    /// The same from the beginning, once more.
    pub fn again(&self) -> Self {
        Self { run: self.run.saturating_add(1), ..Self::new(self.changes.clone()) }
    }

    /// How often it was begun, this time among them.
    pub fn run(&self) -> u32 {
        self.run
    }

    /// A sample comes: whether it is left. Before that [`Self::next_undo_before`] is asked for its stamp, ns.
    pub fn takes(&mut self, stamp_ns: i64) -> bool {
        self.seen_ns = Some(stamp_ns);
        self.strokes.takes(stamp_ns)
    }

    /// Whether a stroke was taken back next (true), or done again (false), before the sample of this stamp, ns; `None`: neither.
    pub fn next_undo_before(&mut self, stamp_ns: i64) -> Option<bool> {
        self.strokes.next_before(stamp_ns).map(|(_, is_undo)| is_undo)
    }

    /// Whether a stroke was taken back or done again next after the last sample that has come. What was recorded later, of a session that
    /// goes on, is of strokes that have not come.
    pub fn next_undo_at_end(&mut self) -> Option<bool> {
        let seen_ns = self.seen_ns?;
        self.next_undo_before(seen_ns.saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::StrokeSpan;
    use crate::session::{Exchange, StrokeChange};

    #[test]
    fn strokes_are_taken_back_after_the_sample_that_the_record_names_and_again_in_the_next_run() {
        let exchange = |after_ns, stroke_ns| Exchange { after_ns, stroke_ns: Some(stroke_ns) };
        let changes = [
            StrokeChange::Undo(exchange(20, 10)),
            StrokeChange::Redo(exchange(20, 10)),
            StrokeChange::TakeOut(StrokeSpan { from_ns: 30, until_ns: 40 }),
            StrokeChange::Undo(exchange(50, 45)),
            StrokeChange::Undo(exchange(70, 60)),
        ];
        let mut session = ReplayedSession::new(changes.into_iter().collect());
        for run in 1..=2 {
            assert_eq!(session.run(), run);
            assert_eq!(session.next_undo_at_end(), None, "nothing has come");
            let mut seen = Vec::new();
            for stamp_ns in [10, 20, 21, 35, 50] {
                let before: Vec<_> = std::iter::from_fn(|| session.next_undo_before(stamp_ns)).collect();
                seen.push((before, session.takes(stamp_ns)));
            }
            let none = Vec::new;
            let expected = [(none(), true), (none(), true), (vec![true, false], true), (none(), false), (none(), true)];
            assert_eq!(seen, expected);
            // that of the sample at 70 belongs to what has not come
            assert_eq!((session.next_undo_at_end(), session.next_undo_at_end()), (Some(true), None));
            session = session.again();
        }
    }
}
