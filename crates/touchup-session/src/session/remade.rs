//! Rebuilds the evidence of a session from its recording, without excluded strokes.

use std::path::Path;

use touchup_io::recording::{RecordingError, StampSource, Topics};
use touchup_method::reconstruct::StrokeSpan;
use touchup_method::stylus::{Placement, SyncParams};

use super::strokes::{StrokeChanges, StrokeReplay, UndoStep};
use crate::live::EvidenceReplay;
use crate::replay::{Recording, ReplayError, each_sample};

/// Error of rebuilding evidence.
#[derive(Debug, thiserror::Error)]
pub enum RemakeError {
    /// The recording is unreadable.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording is damaged before its first message.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The recording lacks the last sample.
    #[error(
        "the recording of the session lacks samples that were taken: without them the other touches cannot be made again"
    )]
    Incomplete,
    /// The rebuild would undo another stroke than the session did.
    #[error(
        "strokes were undone or redone since, and would be others with this one: redo or undo them first"
    )]
    OtherStroke,
}

/// Source of the evidence, and range of its samples.
#[derive(Clone, Debug)]
pub struct EvidenceSource<'a> {
    /// folder of the recording, possibly still growing
    pub recording: &'a Path,
    /// its topics
    pub topics: &'a Topics,
    /// brings messages into the frames of the scene
    pub placement: Option<Placement>,
    /// pairing parameters
    pub sync: SyncParams,
    /// stamp of the last sample, ns
    pub until_ns: i64,
}

impl EvidenceSource<'_> {
    /// Passes all samples to `replay`, except those of excluded strokes, and repeats undo and redo.
    /// The result is bit by bit that of `touchup refine` for a recording without those samples.
    ///
    /// # Errors
    /// [`RemakeError`].
    pub fn replayed(
        &self,
        changes: &StrokeChanges,
        mut replay: EvidenceReplay,
    ) -> Result<EvidenceReplay, RemakeError> {
        let recording = Recording::open(self.recording, self.topics, StampSource::Header)?;
        let mut strokes = changes.replay();
        let (mut last_ns, mut are_same) = (None, true);
        each_sample(
            recording,
            self.placement.clone(),
            self.sync,
            None,
            &mut || (),
            &mut |_| (),
            |sample| {
                if sample.stamp_ns > self.until_ns {
                    return;
                }
                are_same &= exchanged(&mut replay, &mut strokes, sample.stamp_ns);
                if strokes.takes(sample.stamp_ns) {
                    // a refused sample changes nothing
                    let _ = replay.push(sample);
                }
                last_ns = Some(sample.stamp_ns);
            },
        )?;
        are_same &= exchanged(&mut replay, &mut strokes, i64::MAX);
        if last_ns != Some(self.until_ns) {
            return Err(RemakeError::Incomplete);
        }
        if are_same {
            Ok(replay)
        } else {
            Err(RemakeError::OtherStroke)
        }
    }
}

/// Undoes or redoes strokes before a sample; returns whether they are the strokes of the session.
fn exchanged(replay: &mut EvidenceReplay, strokes: &mut StrokeReplay, before_ns: i64) -> bool {
    let mut are_same = true;
    while let Some((UndoStep { stroke_ns, .. }, is_undo)) = strokes.next_before(before_ns) {
        let changed_ns = if is_undo {
            replay.undo()
        } else {
            replay.redo()
        };
        are_same &= match (stroke_ns, changed_ns) {
            (Some(was_ns), Some(from_ns)) => StrokeSpan {
                from_ns,
                until_ns: i64::MAX,
            }
            .begins_at(was_ns),
            _ => false,
        };
    }
    are_same
}
