//! Errors of the measurements.

use touchup_core::compare::CompareError;
use touchup_core::haptic::RefineError;
use touchup_core::mesh::MeshError;
use touchup_core::stylus::SettingError;
use touchup_session::live::LiveError;
use touchup_session::replay::ReplayError;
use touchup_session::scene::SceneError;
use touchup_sim::SimError;

/// What was measured, or why it was not.
pub type Measured<T> = Result<T, MeasureError>;

/// Why something was not measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A simulated surface or stylus.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A mesh that cannot be: a plate, or a patch that is too large.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A setting of a given part, or of a stage.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A push.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// An engine that could not be built.
    #[error(transparent)]
    Engine(#[from] LiveError),
    /// A scan that cannot be compared with the part.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The recording that is replayed.
    #[error(transparent)]
    Recording(#[from] ReplayError),
    /// Nowhere to put it.
    #[error("no temporary folder for a recording: {0}; name one with room by TMPDIR")]
    Folder(std::io::Error),
    /// A scene without `refine`.
    #[error(
        "a scene that moves nothing has no cost of a push: it needs `refine`, and `patch` for the patch"
    )]
    NothingMoves,
    /// No block of samples.
    #[error("nothing was timed: the raster of the ball is not on the plate, or has no samples")]
    NothingTimed,
    /// A given part that is not there where it is touched.
    #[error("none of the {samples} samples of {name} touches the part: are they in its frame?")]
    NothingTouched {
        /// of the case
        name: String,
        /// how many there are
        samples: usize,
    },
}
