//! Whether the samples of a session are recorded live, or replayed from a recording.

use std::path::{Path, PathBuf};

use touchup_io::recording::Topics;
use touchup_session::replay::RecordedSurfaces;
use touchup_session::session::{
    RecordingLoss, SessionRecorder, StrokeChange, StrokeChanges, StrokeHistory,
};

/// Whether a session is recorded or replayed.
pub enum Keeping {
    /// records accepted messages
    Recorded(SessionRecorder),
    /// replays an existing recording, which stays unchanged
    Replayed(Box<ReplayedSession>),
}

impl Keeping {
    /// The recorder of the session; `None` for a replay.
    pub fn recorder(&self) -> Option<&SessionRecorder> {
        if let Self::Recorded(recorder) = self {
            Some(recorder)
        } else {
            None
        }
    }

    /// Whether the session is a replay.
    pub fn is_replayed(&self) -> bool {
        matches!(self, Self::Replayed(_))
    }

    /// Messages missing in its recording up to now.
    pub fn unrecorded(&self) -> RecordingLoss {
        self.recorder()
            .map(SessionRecorder::unrecorded)
            .unwrap_or_default()
    }
}

/// Data of a replayed session besides its messages.
#[derive(Clone, Debug)]
pub struct ReplayedSession {
    recording: PathBuf,
    topics: Topics,
    known: RecordedSurfaces,
    history: StrokeHistory,
    run: u32,
    seen_ns: Option<i64>,
}

impl ReplayedSession {
    /// Before its first message.
    ///
    /// - `recording`, `topics`: its messages, to recompute the touches without a removed one.
    /// - `known`: surfaces beside it.
    /// - `changes`: recorded stroke changes.
    pub fn new(
        recording: PathBuf,
        topics: Topics,
        known: RecordedSurfaces,
        changes: StrokeChanges,
    ) -> Self {
        Self {
            recording,
            topics,
            known,
            history: changes.history(),
            run: 1,
            seen_ns: None,
        }
    }

    /// The same session, once more from the beginning.
    pub fn again(&self) -> Self {
        let history = self.history.clone().again();
        Self {
            history,
            run: self.run.saturating_add(1),
            seen_ns: None,
            ..self.clone()
        }
    }

    /// Number of runs, including this one.
    pub fn run(&self) -> u32 {
        self.run
    }

    /// Its messages, in the form for [`EvidenceSource`](touchup_session::session::EvidenceSource).
    pub fn recording(&self) -> (&Path, &Topics) {
        (&self.recording, &self.topics)
    }

    /// Its known surfaces.
    pub fn known(&self) -> &RecordedSurfaces {
        &self.known
    }

    /// The stroke changes returned up to now.
    pub fn changes_so_far(&self) -> StrokeChanges {
        self.history.so_far()
    }

    /// Notes a sample, after [`Self::next_change_before`] for its stamp, ns.
    pub fn comes(&mut self, stamp_ns: i64) {
        self.seen_ns = Some(stamp_ns);
    }

    /// The next stroke change before the sample of this stamp, ns.
    pub fn next_change_before(&mut self, stamp_ns: i64) -> Option<StrokeChange> {
        self.history.next_before(stamp_ns)
    }

    /// The next stroke change after the last sample to date. Later changes in a continuing
    /// recording belong to future strokes.
    pub fn next_change_at_end(&mut self) -> Option<StrokeChange> {
        let seen_ns = self.seen_ns?;
        self.next_change_before(seen_ns.saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_method::reconstruct::StrokeSpan;
    use touchup_session::session::{Removal, UndoStep};

    #[test]
    fn strokes_change_after_the_sample_that_the_record_names_and_again_in_the_next_run() {
        let exchange = |after_ns, stroke_ns| UndoStep {
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
        let known = RecordedSurfaces::default();
        let recording = PathBuf::from("recording");
        let mut session = ReplayedSession::new(recording, Topics::default(), known, all);
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
            // the change after the sample at 70 belongs to a future stroke
            assert_eq!(
                (session.next_change_at_end(), session.next_change_at_end()),
                (Some(changes[3]), None)
            );
            session = session.again();
        }
    }
}
