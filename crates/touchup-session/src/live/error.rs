//! Errors of the engine.

use touchup_method::haptic::RefineError;
use touchup_method::reconstruct::KnownSurfaceError;
use touchup_method::stylus::SettingError;

/// Error of the engine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LiveError {
    /// The haptic update refused the sample.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A known surface that is none.
    #[error(transparent)]
    Known(#[from] KnownSurfaceError),
    /// The system provides no thread.
    #[error("no thread for the patch: {0}; end other programs, or leave `patch` out of the scene")]
    NoThread(String),
    /// The thread of the patch ended.
    #[error(
        "the thread of the patch ended by a fault of touchup: please report it with the recording"
    )]
    Stopped,
}
