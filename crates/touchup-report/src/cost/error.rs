//! Errors of the measurements of cost.

use touchup_core::haptic::RefineError;
use touchup_core::mesh::MeshError;
use touchup_core::stylus::SettingError;
use touchup_session::replay::ReplayError;
use touchup_session::scene::SceneError;

/// Why costs could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    /// The plate.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A push.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// A setting of a stage.
    #[error(transparent)]
    Setting(#[from] SettingError),
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
    #[error("a scene that moves nothing has no cost of a push: it needs `refine`, and `patch` for the patch")]
    NothingMoves,
    /// No block of samples.
    #[error("nothing was timed: the raster of the ball is not on the plate, or has no samples")]
    NothingTimed,
}
