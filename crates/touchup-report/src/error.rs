//! Errors of the measurements.

use touchup_features::compare::CompareError;
use touchup_geometry::mesh::MeshError;
use touchup_method::haptic::RefineError;
use touchup_method::stylus::SettingError;
use touchup_session::live::LiveError;
use touchup_session::replay::ReplayError;
use touchup_session::scene::SceneError;
use touchup_sim::SimError;

/// A measurement, or its error.
pub type MeasureResult<T> = Result<T, MeasureError>;

/// Reason for a missing measurement.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// Error of a simulated surface or stylus.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// Impossible mesh: a plate, or a patch that is too large.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Setting of a given part, or of a stage.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// Error of a push.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// Error of the engine's construction.
    #[error(transparent)]
    Engine(#[from] LiveError),
    /// The scan is not comparable with the part.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Error of a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Error of the replayed recording.
    #[error(transparent)]
    Recording(#[from] ReplayError),
    /// No temporary folder for the recording.
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
    /// The given part is absent at its touches.
    #[error("none of the {samples} samples of {name} touches the part: are they in its frame?")]
    NothingTouched {
        /// name of the case
        name: String,
        /// number of samples
        samples: usize,
    },
}
