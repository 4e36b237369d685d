//! A session that was recorded, replayed: strokes are taken back and done again where they were, and nothing else acts on it.

use super::keeping::Keeping;
use super::refinement::RefinementWorker;
use crate::ros::messages::ProbeResult;
use crate::ros::port::{Arrival, Call, ReplayStep};

/// What calls are answered.
pub(super) const REPLAYED: &str = "this is the replay of a session, in which nothing can be changed";

impl RefinementWorker {
    /// Refuses a call.
    pub(super) fn refuse_in_replay(call: Call) {
        Arrival::Call(call).refuse(ProbeResult::NO_ARM, REPLAYED);
    }

    /// Does what the record of a session that is replayed has before a sample; whether the sample is left.
    pub(super) fn follow_record(&mut self, stamp_ns: i64) -> bool {
        let Keeping::Replayed(replayed) = &mut self.session.keeping else { return true };
        let changes: Vec<bool> = std::iter::from_fn(|| replayed.next_undo_before(stamp_ns)).collect();
        let is_left = replayed.takes(stamp_ns);
        changes.into_iter().for_each(|is_undo| self.change_stroke_as_recorded(is_undo));
        is_left
    }

    /// Goes on with a replay.
    pub(super) fn replay_step(&mut self, step: ReplayStep) -> Result<(), String> {
        if !self.session.keeping.is_replayed() {
            return Err("this session is not replayed".to_owned());
        }
        match step {
            ReplayStep::Again => self.begin_again().map(drop).map_err(|error| error.to_string()),
            ReplayStep::End => {
                self.finish_samples();
                self.end_record();
                self.fault.clone().map_or(Ok(()), Err)
            }
        }
    }

    fn end_record(&mut self) {
        let Keeping::Replayed(replayed) = &mut self.session.keeping else { return };
        let changes: Vec<bool> = std::iter::from_fn(|| replayed.next_undo_at_end()).collect();
        changes.into_iter().for_each(|is_undo| self.change_stroke_as_recorded(is_undo));
    }

    fn change_stroke_as_recorded(&mut self, is_undo: bool) {
        let engine = &mut self.session.engine;
        match if is_undo { engine.undo() } else { engine.redo() } {
            Ok(_) => self.session.version += 1,
            Err(error) => self.fail(&error),
        }
    }
}
