//! Errors of starting the node and keeping its session.

use std::path::PathBuf;

use touchup_io::json_lines::JsonLineError;
use touchup_method::haptic::RefineError;
use touchup_method::stylus::SettingError;
use touchup_session::live::LiveError;
use touchup_session::refinement::RefinementError;
use touchup_session::scan::ScanError;
use touchup_session::scene::SceneError;
use touchup_session::session::{OutcomeError, SessionError};

/// Reason why the node does not start, or its session was not kept.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// Neither the parameter `scan` nor the scene names a scan.
    #[error(
        "there is no scan to refine: name one by -p scan:=FILE, or as `scan: {{ file: … }}` in the scene"
    )]
    NoScan,
    /// An arm must keep clear of the whole scan.
    #[error(
        "an arm keeps clear of the whole scan, of which scan.region_low_mm and scan.region_high_mm leave only a part: take \
         them out of the scene, or start without robot"
    )]
    RegionWithRobot,
    /// The scene is unusable.
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    /// The refinement of the scan does not start.
    #[error(transparent)]
    Refinement(#[from] Box<RefinementError>),
    /// The scene has no `robot`.
    #[error(
        "robot:= needs `robot:` in the scene: nobody knows where the arm stands and what it must never leave (config/probe.yaml is an example)"
    )]
    NoRobot,
    /// The scan is unreadable.
    #[error("{0}")]
    Scan(#[from] Box<ScanError>),
    /// An invalid setting of the scene.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scan cannot be refined.
    #[error("the scan cannot be refined: {0}")]
    Refine(#[from] RefineError),
    /// An error of the patch thread.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// The folder of sessions is unusable.
    #[error("{}: {source}; name another by -p session_folder:=FOLDER", path.display())]
    Folder {
        /// path of the folder
        path: PathBuf,
        /// error of the system
        source: std::io::Error,
    },
    /// The session is not kept.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The result is not written.
    #[error(transparent)]
    Outcome(#[from] Box<OutcomeError>),
    /// The result is written, the recording is incomplete.
    #[error("{count} messages are not in the session's recording: {reason}")]
    Unrecorded {
        /// number of missing messages
        count: u64,
        /// cause
        reason: String,
    },
    /// The known surfaces of a replayed session are unreadable.
    #[error(transparent)]
    Known(#[from] JsonLineError),
    /// The system gives no thread.
    #[error("no thread for the node: {0}; end other programs")]
    NoThread(#[from] std::io::Error),
    /// A thread ended by a fault.
    #[error(
        "a thread of the node ended by a fault of touchup: please report it with the session's folder"
    )]
    Stopped,
}
