//! Replay of a recorded session: strokes are undone, redone, removed and restored at their recorded
//! times, and nothing else acts on it.

use crate::node::keeping::{Keeping, ReplayedSession};
use crate::node::refinement::RefinementWorker;
use crate::node::take_out::{NO_PATCH, recorded_evidence};
use crate::ros::messages::ProbeResult;
use crate::ros::port::{Arrival, Call, ReplayStep};
use touchup_session::session::{Removal, StrokeChange};

/// Answer to calls.
pub(in crate::node) const REPLAYED: &str =
    "this is the replay of a session, in which nothing can be changed";

impl RefinementWorker {
    /// Refuses a call.
    pub(in crate::node) fn refuse_in_replay(call: Call) {
        Arrival::Call(call).refuse(ProbeResult::NO_ARM, REPLAYED);
    }

    /// Applies the recorded changes before a sample of a replayed session.
    pub(in crate::node) fn follow_record(&mut self, stamp_ns: i64) {
        self.change_strokes_as_recorded(|replayed| replayed.next_change_before(stamp_ns));
        if let Keeping::Replayed(replayed) = &mut self.session.keeping {
            replayed.comes(stamp_ns);
        }
    }

    /// Continues a replay.
    pub(in crate::node) fn replay_step(&mut self, step: ReplayStep) -> Result<(), String> {
        if !self.session.keeping.is_replayed() {
            return Err("this session is not replayed".to_owned());
        }
        match step {
            ReplayStep::Again => self
                .begin_again()
                .map(drop)
                .map_err(|error| error.to_string()),
            ReplayStep::End => {
                self.finish_samples();
                self.change_strokes_as_recorded(ReplayedSession::next_change_at_end);
                self.fault.clone().map_or(Ok(()), Err)
            }
        }
    }

    /// Applies the next stroke changes.
    fn change_strokes_as_recorded(
        &mut self,
        mut next: impl FnMut(&mut ReplayedSession) -> Option<StrokeChange>,
    ) {
        while let Keeping::Replayed(replayed) = &mut self.session.keeping {
            let Some(change) = next(replayed) else { return };
            let done = match change {
                StrokeChange::Undo(_) => self
                    .session
                    .engine
                    .undo()
                    .map(drop)
                    .map_err(|error| error.to_string()),
                StrokeChange::Redo(_) => self
                    .session
                    .engine
                    .redo()
                    .map(drop)
                    .map_err(|error| error.to_string()),
                StrokeChange::TakeOut(removal) | StrokeChange::PutBack(removal) => {
                    self.remake_as_recorded(removal)
                }
            };
            match done {
                Ok(()) => self.session.version += 1,
                Err(error) => return self.fail(&error),
            }
        }
    }

    /// Recomputes the evidence with or without a stroke, according to the changes up to then.
    /// Samples wait meanwhile.
    fn remake_as_recorded(&mut self, removal: Removal) -> Result<(), String> {
        let Keeping::Replayed(replayed) = &self.session.keeping else {
            return Ok(());
        };
        let engine = &mut self.session.engine;
        let replay = engine
            .begin_replay()
            .map_err(|error| error.to_string())?
            .ok_or(NO_PATCH)?;
        let (recording, topics) = replayed.recording();
        let scene = &self.setup.input.scene;
        let source = recorded_evidence(recording, topics, scene, removal.after_ns);
        let evidence = source
            .replayed(&replayed.changes_so_far(), replay)
            .map_err(|error| error.to_string())?;
        engine
            .end_replay(Some(evidence))
            .and_then(|_| engine.catch_up())
            .map_err(|error| error.to_string())
    }
}
