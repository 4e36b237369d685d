//! The node: wrench and pose in, the refined mesh and its features out.
//!
//! Four threads. `haptic` has the refiner and takes samples, `view` shows the mesh, `seeker` knows the features, `recorder`
//! takes down what was accepted. Between them go bounded queues; where something must give, it is what is only for viewing,
//! and it is counted.

mod calls;
mod convert;
mod diagnostics;
mod edits;
mod engine;
mod feature_messages;
mod frames;
mod haptic;
mod mesh_patches;
mod placing;
mod replica;
mod seeker;
mod shared;
mod sitting;
mod streams;
mod tiles;
mod tip;
mod view;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};

pub use frames::{FrameBuffer, FrameError};
pub use sitting::Report;

use self::edits::Edits;
use self::engine::Scan;
use self::haptic::Haptic;
use self::placing::FrameNames;
use self::replica::Replica;
use self::seeker::Seeker;
use self::shared::Shared;
use self::sitting::Sitting;
use self::view::View;
use super::parameters::Parameters;
use super::port::{Arrival, Port};
use crate::io::mesh_file::{MeshFile, MeshFileError, MeshUnit, read_mesh};
use crate::io::recording::Topics;
use crate::live::LiveError;
use crate::mesh::FaceTree;
use crate::refine::RefineError;
use crate::scene::{Scene, SceneError};
use crate::session::{OutcomeError, SessionError};
use crate::touch::{Compensator, SettingError, WrenchFrame};

/// Inputs that wait for the view at most: frames of it are dropped first.
const VIEW_QUEUE: usize = 256;
/// Inputs that wait for the thread of the features at most.
const SEEKER_QUEUE: usize = 256;
/// Changes of the mesh that go round.
const EDITS_ROUND: usize = 2;
/// Arrivals that wait for the node at most: two seconds of both streams.
pub const INBOX: usize = 4096;
/// The scene of who names none.
const DEFAULT_SCENE: &str = include_str!("../../../config/default.yaml");

/// Why the node does not start, or its session was not kept.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// The parameter `scan` is empty.
    #[error("there is no scan to refine: name one by -p scan:=FILE")]
    NoScan,
    /// The scene cannot be used.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The scene has no `refine`.
    #[error("the scene names no `refine`, so nothing would move the mesh: add `refine:` to it")]
    NothingMoves,
    /// The scan cannot be read.
    #[error("{0}")]
    Scan(Box<MeshFileError>),
    /// A setting of the scene.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scan cannot be refined.
    #[error("the scan cannot be refined: {0}")]
    Refine(#[from] RefineError),
    /// The thread of the patch.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// The folder of sessions cannot be used.
    #[error("{}: {source}; name another by -p session_folder:=FOLDER", path.display())]
    Folder {
        /// which one
        path: PathBuf,
        /// what the system says
        source: std::io::Error,
    },
    /// The session cannot be kept.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The result cannot be written.
    #[error(transparent)]
    Outcome(Box<OutcomeError>),
    /// The result is written, the recording is not whole.
    #[error("{count} messages are not in the session's recording: {reason}")]
    Unrecorded {
        /// how many
        count: u64,
        /// why
        reason: String,
    },
    /// The system gives no thread.
    #[error("no thread for the node: {0}; end other programs")]
    NoThread(String),
    /// A thread ended by a fault.
    #[error("a thread of the node ended by a fault of touchup: please report it with the session's folder")]
    Stopped,
}

impl From<SceneError> for NodeError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<OutcomeError> for NodeError {
    fn from(error: OutcomeError) -> Self {
        Self::Outcome(Box::new(error))
    }
}

impl NodeError {
    fn no_thread(error: std::io::Error) -> Self {
        Self::NoThread(error.to_string())
    }
}

/// All that does not change while the node runs.
pub(crate) struct Setup {
    port: Arc<dyn Port>,
    shared: Arc<Shared>,
    scan: Scan,
    scan_path: PathBuf,
    mesh_unit: MeshUnit,
    scene: Scene,
    scene_yaml: String,
    topics: Topics,
    source: &'static str,
    tool: String,
}

impl Setup {
    fn new(parameters: Parameters, port: Arc<dyn Port>) -> Result<Self, NodeError> {
        let scan_path = PathBuf::from(parameters.string("scan"));
        if scan_path.as_os_str().is_empty() {
            return Err(NodeError::NoScan);
        }
        let (scene, scene_yaml) = match parameters.string("scene") {
            "" => (Scene::from_yaml(DEFAULT_SCENE)?, DEFAULT_SCENE.to_owned()),
            path => Scene::read_with_text(Path::new(path))?,
        };
        let mesh_unit = match parameters.string("mesh_unit") {
            "m" => MeshUnit::Metre,
            "inch" => MeshUnit::Inch,
            _ => MeshUnit::Millimetre,
        };
        let MeshFile { mesh, .. } =
            read_mesh(&scan_path, mesh_unit).map_err(|error| NodeError::Scan(Box::new(error)))?;
        let tree = FaceTree::new(&mesh);
        let source = if parameters.string("source") == "probe" { "probe" } else { "stylus" };
        let tool = match parameters.string("tool_frame") {
            "" => source.to_owned(),
            named => named.to_owned(),
        };
        let known = scene.patcher_params(WrenchFrame::default()).and_then(|params| params.uncertainty);
        let scan_sigma = known.map(|known| known.scan).filter(|sigma| *sigma > 0.0);
        Ok(Self {
            port,
            shared: Arc::new(Shared::new(parameters, scan_sigma)),
            scan: Arc::new((mesh, tree)),
            scan_path,
            mesh_unit,
            scene,
            scene_yaml,
            topics: Topics { pose: format!("/{source}/pose"), wrench: format!("/{source}/wrench"), markers: None },
            source,
            tool,
        })
    }

    fn frame_names(&self) -> FrameNames {
        FrameNames {
            object: self.shared.frame.clone(),
            tool: self.tool.clone(),
            sensor: format!("{}_sensor", self.source),
        }
    }

    fn compensator(&self, axes: WrenchFrame) -> Result<Compensator, NodeError> {
        Ok(Compensator::new(self.scene.compensator_params(axes))?)
    }
}

/// What is left of a node.
#[derive(Debug)]
pub struct NodeEnd {
    /// folder of the last session, with the refined mesh in it
    pub folder: PathBuf,
    /// what became of it
    pub report: Report,
}

/// A node that runs.
#[derive(Debug)]
pub struct Node {
    haptic: JoinHandle<Result<NodeEnd, NodeError>>,
    view: JoinHandle<()>,
    seeker: JoinHandle<()>,
    folder: PathBuf,
}

impl Node {
    /// Reads scene and scan, begins a session, and starts the threads.
    ///
    /// - `inbox`: where the port puts what arrives; the node ends with [`Arrival::Shutdown`], or when nothing can arrive any
    ///   more.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn start(parameters: Parameters, port: Arc<dyn Port>, inbox: Receiver<Arrival>) -> Result<Self, NodeError> {
        let setup = Arc::new(Setup::new(parameters, port)?);
        let sitting = Sitting::begin(&setup)?;
        let (folder, session) = (sitting.folder.path().to_owned(), sitting.folder.name().to_owned());
        let (to_view, view_inputs) = sync_channel(VIEW_QUEUE);
        let (to_seeker, seeker_inputs) = sync_channel(SEEKER_QUEUE);
        let (to_spare, spare) = sync_channel(EDITS_ROUND);
        for _ in 0..EDITS_ROUND {
            to_spare.send(Box::<Edits>::default()).map_err(|_| NodeError::Stopped)?;
        }
        let replica = Replica::of(&setup.scan.0, &session);
        let view = View::new(Arc::clone(&setup.port), Arc::clone(&setup.shared), to_spare, replica);
        let seeker = Seeker::new(Arc::clone(&setup.shared), to_view.clone(), session);
        let haptic = Haptic::new(setup, sitting, to_view, to_seeker, spare)?;
        let thread = |name: &str| Builder::new().name(name.to_owned());
        let view = thread("view").spawn(move || view.run(&view_inputs)).map_err(NodeError::no_thread)?;
        let seeker = thread("seeker").spawn(move || seeker.run(&seeker_inputs)).map_err(NodeError::no_thread)?;
        let haptic = thread("haptic").spawn(move || haptic.run(&inbox)).map_err(NodeError::no_thread)?;
        Ok(Self { haptic, view, seeker, folder })
    }

    /// Folder of the session that it began with.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// [`NodeError`] when the result was not written, or a thread ended by a fault.
    pub fn join(self) -> Result<NodeEnd, NodeError> {
        let Self { haptic, view, seeker, .. } = self;
        let ended = haptic.join().map_err(|_| NodeError::Stopped)?;
        for thread in [seeker, view] {
            thread.join().map_err(|_| NodeError::Stopped)?;
        }
        ended
    }
}
