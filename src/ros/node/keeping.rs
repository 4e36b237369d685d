//! Whether the samples of a session are recorded as they come, or come from what was recorded of
//! it.

use std::path::{Path, PathBuf};

use crate::io::recording::Topics;
use crate::session::{SessionRecorder, StrokeChange, StrokeChanges, StrokeHistory, Unrecorded};

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
        if let Self::Recorded(recorder) = self {
            Some(recorder)
        } else {
            None
        }
    }

    /// Whether it is replayed.
    pub fn is_replayed(&self) -> bool {
        matches!(self, Self::Replayed(_))
    }

    /// Messages missing in its recording so far.
    pub fn unrecorded(&self) -> Unrecorded {
        self.recorder()
            .map(SessionRecorder::unrecorded)
            .unwrap_or_default()
    }
}

/// What a session that is replayed has beside its messages.
#[derive(Clone, Debug)]
pub struct ReplayedSession {
    recording: PathBuf,
    topics: Topics,
    history: StrokeHistory,
    run: u32,
    seen_ns: Option<i64>,
}

impl ReplayedSession {
    /// Before its first message.
    ///
    /// - `recording`, `topics`: its messages, to make touches again without one that was taken out.
    /// - `changes`: of strokes, as its record has them.
    pub fn new(recording: PathBuf, topics: Topics, changes: StrokeChanges) -> Self {
        Self {
            recording,
            topics,
            history: changes.history(),
            run: 1,
            seen_ns: None,
        }
    }

    /// The same from the beginning, once more.
    pub fn again(&self) -> Self {
        let history = self.history.clone().again();
        Self {
            history,
            run: self.run.saturating_add(1),
            seen_ns: None,
            ..self.clone()
        }
    }

    /// How often it was begun, this time among them.
    pub fn run(&self) -> u32 {
        self.run
    }

    /// Its messages, as [`EvidenceSource`](crate::session::EvidenceSource) reads them.
    pub fn recording(&self) -> (&Path, &Topics) {
        (&self.recording, &self.topics)
    }

    /// The changes of strokes that were returned so far.
    pub fn changes_so_far(&self) -> StrokeChanges {
        self.history.so_far()
    }

    /// A sample comes. Before that [`Self::next_change_before`] is asked for its stamp, ns.
    pub fn comes(&mut self, stamp_ns: i64) {
        self.seen_ns = Some(stamp_ns);
    }

    /// The next change of strokes that was made before the sample of this stamp, ns.
    pub fn next_change_before(&mut self, stamp_ns: i64) -> Option<StrokeChange> {
        self.history.next_before(stamp_ns)
    }

    /// The next change of strokes that was made after the last sample that has come. What was
    /// recorded later, of a session that goes on, is of strokes that have not come.
    pub fn next_change_at_end(&mut self) -> Option<StrokeChange> {
        let seen_ns = self.seen_ns?;
        self.next_change_before(seen_ns.saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::StrokeSpan;
    use crate::session::{Exchange, Removal};

    #[test]
    fn strokes_change_after_the_sample_that_the_record_names_and_again_in_the_next_run() {
        let exchange = |after_ns, stroke_ns| Exchange {
            after_ns,
            stroke_ns: Some(stroke_ns),
        };
        let changes = [
            StrokeChange::Undo(exchange(20, 10)),
            StrokeChange::Redo(exchange(20, 10)),
            StrokeChange::TakeOut(Removal {
                after_ns: 35,
                stroke: StrokeSpan {
                    from_ns: 30,
                    until_ns: 40,
                },
            }),
            StrokeChange::Undo(exchange(50, 45)),
            StrokeChange::Undo(exchange(70, 60)),
        ];
        let all = changes.into_iter().collect();
        let mut session = ReplayedSession::new(PathBuf::from("recording"), Topics::default(), all);
        for run in 1..=2 {
            assert_eq!(session.run(), run);
            assert_eq!(session.next_change_at_end(), None, "nothing has come");
            let mut seen = Vec::new();
            for stamp_ns in [10, 20, 21, 35, 50] {
                seen.push(
                    std::iter::from_fn(|| session.next_change_before(stamp_ns)).collect::<Vec<_>>(),
                );
                session.comes(stamp_ns);
            }
            assert_eq!(
                seen,
                [&[], &[], &changes[..2], &[], &changes[2..3]].map(<[StrokeChange]>::to_vec)
            );
            assert_eq!(
                session.changes_so_far(),
                changes[..3].iter().copied().collect()
            );
            // that of the sample at 70 belongs to what has not come
            assert_eq!(
                (session.next_change_at_end(), session.next_change_at_end()),
                (Some(changes[3]), None)
            );
            session = session.again();
        }
    }
}
