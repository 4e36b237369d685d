//! Errors of a run over whole scans.

use touchup_core::compare::CompareError;
use touchup_core::mesh::MeshError;
use touchup_core::stylus::SettingError;
use touchup_session::live::LiveError;
use touchup_sim::SimError;

/// Why whole scans were not measured.
#[derive(Debug, thiserror::Error)]
pub enum WholeScanError {
    /// A simulated part.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A setting of a given part.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// An engine that could not be built.
    #[error(transparent)]
    Engine(#[from] LiveError),
    /// A patch that is too large.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A scan that cannot be compared with the part.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Nothing to measure.
    #[error("none of the {samples} samples of {name} touches the part: are they in its frame?")]
    NothingTouched {
        /// of the case
        name: String,
        /// how many there are
        samples: usize,
    },
}
