//! One run of touching a part: its result and its files.
//!
//! [`Outcome`] describes the common result of `touchup refine` and the node: the refined mesh, its
//! features, and their touches. [`SessionRecord`] keeps in a folder everything to reproduce the
//! result, up to the last moment before a crash.

mod outcome;
mod outliers;
mod record;
mod remade;
mod step_result;
mod strokes;

pub use outcome::{
    Origins, Outcome, OutcomeError, PatchSummary, RefinedMesh, ResultFiles, found,
    found_with_boundary, moved_faces, origins, sewn,
};
pub use outliers::UncertaintySummary;
pub use record::{RecordingLoss, SessionError, SessionFacts, SessionRecord, SessionRecorder};
pub use remade::{EvidenceSource, RemakeError};
pub use step_result::{StepFileError, StepFileOutcome, StepFileSummary, write_boundary};
pub use strokes::{Removal, StrokeChange, StrokeChanges, StrokeHistory, StrokeReplay, UndoStep};
