//! One run of touching a part: its result and its files.
//!
//! [`Outcome`] is what `touchup refine` and the node write alike: the refined mesh, the features on
//! it, the touches they rest on. [`SessionRecord`] keeps in a folder all that it takes to get the
//! same again, up to the last moment before a crash.

mod outcome;
mod outliers;
mod record;
mod remade;
mod strokes;

pub use outcome::{
    Origins, Outcome, OutcomeError, OutcomePlaces, PatchSummary, RefinedMesh, found, moved_faces,
    origins, sewn,
};
pub use outliers::UncertaintySummary;
pub use record::{SessionError, SessionFacts, SessionRecord, SessionRecorder, Unrecorded};
pub use remade::{EvidenceSource, RemakeError};
pub use strokes::{Exchange, Removal, StrokeChange, StrokeChanges, StrokeHistory, StrokeReplay};
