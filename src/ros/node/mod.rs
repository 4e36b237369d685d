//! The node: wrench and pose in, the refined mesh and its features out.
//!
//! Five threads. `haptic` has the refiner and takes samples, `view` shows the mesh, `seeker` knows the features, `recorder`
//! takes down what was accepted, `arm` moves one where there is one. Between them go bounded queues; where something must give, it is what is only for viewing,
//! and it is counted.

mod arm;
mod calls;
mod convert;
mod diagnostics;
mod edits;
mod engine;
mod feature_messages;
mod feature_worker;
mod frame_resolver;
mod frames;
mod mesh_patches;
mod publishing;
mod refinement;
mod replica;
mod session;
mod shared;
mod side_work;
mod streams;
mod tiles;
mod tip;
mod view;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};

pub use arm::{ArmKind, ArmOfNode};
pub use convert::{as_pose, as_wrench};
pub use frame_resolver::CELL;
pub use frames::{FrameBuffer, FrameError};
pub use session::SessionReport;

use self::edits::Edits;
use self::engine::Scan;
use self::feature_worker::FeatureWorker;
use self::frame_resolver::FrameNames;
use self::refinement::RefinementWorker;
use self::replica::MeshReplica;
use self::session::NodeSession;
use self::shared::Shared;
use self::view::View;
use super::parameters::Parameters;
use super::port::{Arrival, Port};
use crate::clock::Clock;
use crate::io::mesh_file::{MeshFile, MeshFileError, MeshUnit, read_mesh};
use crate::io::recording::Topics;
use crate::live::LiveError;
use crate::mesh::FaceTree;
use crate::refine::RefineError;
use crate::scene::{CutScan, Memory, RegionCut, Scene, SceneCost, SceneError};
use crate::session::{OutcomeError, SessionError};
use crate::touch::SettingError;

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
    /// Neither the parameter `scan` nor the scene names one.
    #[error("there is no scan to refine: name one by -p scan:=FILE, or as `scan: {{ file: … }}` in the scene")]
    NoScan,
    /// An arm must keep clear of the whole scan.
    #[error(
        "an arm keeps clear of the whole scan, of which scan.region_low_mm and scan.region_high_mm leave only a part: take \
         them out of the scene, or start without robot"
    )]
    RegionWithRobot,
    /// The scene cannot be used.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The scene has no `refine`.
    #[error("the scene names no `refine`, so nothing would move the mesh: add `refine:` to it")]
    NothingMoves,
    /// The scene has no `robot`.
    #[error(
        "robot:= needs `robot:` in the scene: nobody knows where the arm stands and what it must never leave (config/probe.yaml is an example)"
    )]
    NoRobot,
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
    clock: Clock,
    shared: Arc<Shared>,
    scan: Scan,
    scan_path: PathBuf,
    mesh_unit: MeshUnit,
    scene: Scene,
    cut: RegionCut,
    scene_yaml: String,
    topics: Topics,
    source: &'static str,
    tool: String,
}

impl Setup {
    fn new(parameters: Parameters, clock: Clock) -> Result<Self, NodeError> {
        let scene_path = Path::new(parameters.string("scene"));
        let (scene, scene_yaml) = match scene_path.as_os_str().is_empty() {
            true => (Scene::from_yaml(DEFAULT_SCENE)?, DEFAULT_SCENE.to_owned()),
            false => Scene::read_with_text(scene_path)?,
        };
        let (scan_path, mesh_unit) = match parameters.string("scan") {
            "" => scene.scan_file(scene_path).ok_or(NodeError::NoScan)?,
            path => (PathBuf::from(path), mesh_unit(&parameters)),
        };
        let MeshFile { mesh, .. } =
            read_mesh(&scan_path, mesh_unit).map_err(|error| NodeError::Scan(Box::new(error)))?;
        if scene.region().is_some() && parameters.string("robot") != "none" {
            return Err(NodeError::RegionWithRobot);
        }
        let CutScan { mesh, cut } = scene.cut(mesh)?;
        let tree = FaceTree::new(&mesh);
        let source = if parameters.string("source") == "probe" { "probe" } else { "stylus" };
        let tool = match parameters.string("tool_frame") {
            "" => source.to_owned(),
            named => named.to_owned(),
        };
        let known = scene.patcher_params().and_then(|params| params.uncertainty);
        let scan_sigma = known.map(|known| known.scan).filter(|sigma| *sigma > 0.0);
        let replica = MeshReplica::new(clock.clone(), &mesh);
        Ok(Self {
            clock,
            shared: Arc::new(Shared::new(parameters, scan_sigma, replica)),
            scan: Arc::new((mesh, tree)),
            scan_path,
            mesh_unit,
            scene,
            cut,
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
}

/// The unit of the files, of the parameter `mesh_unit`.
pub fn mesh_unit(parameters: &Parameters) -> MeshUnit {
    match parameters.string("mesh_unit") {
        "m" => MeshUnit::Metre,
        "inch" => MeshUnit::Inch,
        _ => MeshUnit::Millimetre,
    }
}

/// What is left of a node.
#[derive(Debug)]
pub struct NodeEnd {
    /// folder of the last session, with the refined mesh in it
    pub folder: PathBuf,
    /// what became of it
    pub report: SessionReport,
}

/// A node that runs.
#[derive(Debug)]
pub struct Node {
    haptic: JoinHandle<Result<NodeEnd, NodeError>>,
    view: JoinHandle<()>,
    seeker: JoinHandle<()>,
    arm: Option<JoinHandle<()>>,
    folder: PathBuf,
}

/// A node that has read scene and scan and begun a session, and hears nothing yet: loading a large scan takes seconds, in
/// which nothing that is sent to the node may be lost.
pub struct Prepared {
    setup: Arc<Setup>,
    sitting: NodeSession,
}

impl Prepared {
    /// Reads scene and scan and begins a session.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn new(parameters: Parameters) -> Result<Self, NodeError> {
        Self::on(Clock::system(), parameters)
    }

    /// As [`Self::new`]; all that is due at a time is so on `clock`.
    ///
    /// # Errors
    /// As there.
    pub fn on(clock: Clock, parameters: Parameters) -> Result<Self, NodeError> {
        let setup = Arc::new(Setup::new(parameters, clock)?);
        let sitting = NodeSession::begin(&setup)?;
        setup.shared.mesh.name_session(sitting.folder.name());
        Ok(Self { setup, sitting })
    }

    /// Folder of the session.
    pub fn folder(&self) -> &Path {
        self.sitting.folder.path()
    }

    /// The scan: where it was read from, and how many faces it has.
    pub fn scan(&self) -> (&Path, usize) {
        (&self.setup.scan_path, self.setup.scan.0.face_count())
    }

    /// The scene as it was read.
    pub fn scene(&self) -> &Scene {
        &self.setup.scene
    }

    /// What was built of the scene, and the memory that it took.
    ///
    /// - `has_arm`: whether an arm probes.
    pub fn cost(&self, has_arm: bool) -> SceneCost {
        let Self { setup, sitting } = self;
        // the node looks for no clock, and poses come as such
        let unused = if has_arm { &["clock", "markers"][..] } else { &["clock", "markers", "robot"] };
        let (scan, tree) = &*setup.scan;
        let memory = Memory::of(sitting.engine.refiner().footprint(), scan.bytes() + tree.bytes() + setup.cut.bytes());
        SceneCost { parts: setup.scene.built(unused, &crate::FEATURES), memory }
    }

    /// Starts the threads.
    ///
    /// - `arm`: that probes what is flagged; without one orders are answered so.
    /// - `inbox`: where the port puts what arrives; the node ends with [`Arrival::Shutdown`], or when nothing can arrive any
    ///   more.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn start(
        self,
        port: Arc<dyn Port>,
        inbox: Receiver<Arrival>,
        arm: Option<ArmOfNode>,
    ) -> Result<Node, NodeError> {
        let Self { setup, sitting } = self;
        let (folder, session) = (sitting.folder.path().to_owned(), sitting.folder.name().to_owned());
        let (to_view, view_inputs) = sync_channel(VIEW_QUEUE);
        let (to_seeker, seeker_inputs) = sync_channel(SEEKER_QUEUE);
        let (to_spare, spare) = sync_channel(EDITS_ROUND);
        for _ in 0..EDITS_ROUND {
            to_spare.send(Box::<Edits>::default()).map_err(|_| NodeError::Stopped)?;
        }
        let clock = setup.clock.clone();
        let view = View::new(clock.clone(), Arc::clone(&port), Arc::clone(&setup.shared), to_spare);
        let seeker = FeatureWorker::new(clock.clone(), Arc::clone(&setup.shared), to_view.clone(), session);
        let arm = arm.map(|arm| arm::start(&setup, &port, arm, to_seeker.clone())).transpose()?;
        let (handle, arm) = arm.unzip();
        let haptic = RefinementWorker::new(setup, port, sitting, to_view, to_seeker, spare, handle)?;
        let view = begin(&clock, "view", move || view.run(&view_inputs))?;
        let seeker = begin(&clock, "seeker", move || seeker.run(&seeker_inputs))?;
        let haptic = begin(&clock, "haptic", move || haptic.run(&inbox))?;
        Ok(Node { haptic, view, seeker, arm, folder })
    }
}

/// Starts a thread that waits on `clock`.
fn begin<T: Send + 'static>(
    clock: &Clock,
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, NodeError> {
    let working = clock.begin_work();
    let work = move || {
        let ended = run();
        drop(working);
        ended
    };
    Builder::new().name(name.to_owned()).spawn(work).map_err(NodeError::no_thread)
}

impl Node {
    /// Folder of the session that it began with.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// [`NodeError`] when the result was not written, or a thread ended by a fault.
    pub fn join(self) -> Result<NodeEnd, NodeError> {
        let Self { haptic, view, seeker, arm, .. } = self;
        let ended = haptic.join().map_err(|_| NodeError::Stopped)?;
        for thread in arm.into_iter().chain([seeker, view]) {
            thread.join().map_err(|_| NodeError::Stopped)?;
        }
        ended
    }
}
