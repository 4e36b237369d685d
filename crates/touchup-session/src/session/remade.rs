//! The evidence of a session made again from its recording, without the strokes that are taken out.

use std::path::Path;

use touchup_core::reconstruct::StrokeSpan;
use touchup_core::stylus::{Placement, SyncParams};
use touchup_io::recording::{RecordingError, StampSource, Topics};

use super::strokes::{Exchange, StrokeChanges, StrokeReplay};
use crate::live::EvidenceReplay;
use crate::replay::{Recording, ReplayError, each_sample};

/// Why the evidence was not made again.
#[derive(Debug, thiserror::Error)]
pub enum RemakeError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It is damaged before its first message.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The last sample is not in it.
    #[error(
        "the recording of the session lacks samples that were taken: without them the other touches cannot be made again"
    )]
    Incomplete,
    /// Undone meanwhile was another stroke than would be undone then.
    #[error(
        "strokes were undone or redone since, and would be others with this one: redo or undo them first"
    )]
    OtherStroke,
}

/// What is made again, and of which samples.
#[derive(Clone, Debug)]
pub struct EvidenceSource<'a> {
    /// folder of the recording, which may be written on meanwhile
    pub recording: &'a Path,
    /// its topics
    pub topics: &'a Topics,
    /// brings messages into the frames of the scene
    pub placement: Option<Placement>,
    /// how they are paired
    pub sync: SyncParams,
    /// up to the sample of this stamp, ns
    pub until_ns: i64,
}

impl EvidenceSource<'_> {
    /// Gives all samples to `replay` but those of strokes that are taken out; takes back and does
    /// again what was. It is bit by bit what `touchup refine` makes of a recording that has never
    /// had those samples.
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
            self.placement,
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

/// Takes strokes back or does them again before a sample; returns whether they are those that it
/// was then.
fn exchanged(replay: &mut EvidenceReplay, strokes: &mut StrokeReplay, before_ns: i64) -> bool {
    let mut are_same = true;
    while let Some((Exchange { stroke_ns, .. }, is_undo)) = strokes.next_before(before_ns) {
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
