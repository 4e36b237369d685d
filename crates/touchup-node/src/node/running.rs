//! A node from its preparation to its end.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;

use super::arm::{self, ArmOfNode};
use super::error::NodeError;
use super::feature_worker::FeatureWorker;
use super::keeping::ReplayedSession;
use super::refinement::RefinementWorker;
use super::session::{NodeEnd, NodeSession};
use super::setup::Setup;
use super::side_work::{begin, begin_behind};
use super::viewing::view::ViewWorker;
use crate::ros::inbox::Arrivals;
use crate::ros::mesh_feed::{Edits, MeshFeed};
use crate::ros::parameters::{ParameterValue, Parameters};
use crate::ros::port::Port;
use crate::ros::stop::ALLOW_MOTION;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::session_folder::SessionFolder;
use touchup_session::clock::Clock;
use touchup_session::scene::{LeftOut, Memory, Scene, SceneCost};

/// Maximum number of inputs waiting for the view: its frames drop first.
const VIEW_QUEUE: usize = 256;
/// Maximum number of inputs waiting for the feature thread.
const FEATURE_QUEUE: usize = 256;
/// Number of circulating lists of mesh changes.
const EDITS_ROUND: usize = 2;
/// Maximum number of samples waiting for the node: two seconds of both streams.
pub const INBOX: usize = 4096;

/// A running node.
#[derive(Debug)]
pub struct Node {
    haptic: JoinHandle<Result<NodeEnd, NodeError>>,
    others: Vec<JoinHandle<()>>,
    folder: PathBuf,
}

/// A node that has read scene and scan and begun a session, and does not listen yet: loading a
/// large scan takes seconds, in which no message may be lost.
pub struct PreparedNode {
    setup: Arc<Setup>,
    session: NodeSession,
}

impl PreparedNode {
    /// Reads scene and scan and begins a session.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn new(parameters: Parameters) -> Result<Self, NodeError> {
        Self::on(Clock::system(), parameters)
    }

    /// As [`Self::new`], with all deadlines on `clock`.
    ///
    /// # Errors
    /// As there.
    pub fn on(clock: Clock, parameters: Parameters) -> Result<Self, NodeError> {
        let setup = Arc::new(Setup::new(parameters, clock)?);
        let session = NodeSession::begin(&setup)?;
        setup.shared.mesh.name_session(&session.name);
        Ok(Self { setup, session })
    }

    /// Reads scene and scan of a recorded session for a replay: arrivals have to be its messages,
    /// with [`ReplayStep`](crate::ros::port::ReplayStep)s between. It keeps nothing, refuses calls,
    /// and does not report on streams.
    ///
    /// - `parameters`: its scene, scan, unit and source.
    /// - `replayed`: before its first message.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn replayed(
        parameters: Parameters,
        folder: SessionFolder,
        replayed: ReplayedSession,
    ) -> Result<Self, NodeError> {
        let setup = Arc::new(Setup::new(parameters, Clock::system())?);
        let session = NodeSession::replayed(&setup, folder, replayed)?;
        setup.shared.mesh.name_session(&session.name);
        Ok(Self { setup, session })
    }

    /// Folder of the session.
    pub fn folder(&self) -> &Path {
        self.session.folder.path()
    }

    /// The scan: its path, and its number of faces.
    pub fn scan(&self) -> (&Path, usize) {
        (&self.setup.scan_path, self.setup.input.scan.0.face_count())
    }

    /// Unit of the coordinates in files of meshes.
    pub fn mesh_unit(&self) -> MeshUnit {
        self.setup.mesh_unit
    }

    /// The mesh, for followers in this process.
    pub fn mesh_feed(&self) -> Arc<MeshFeed> {
        Arc::clone(&self.setup.shared.mesh)
    }

    /// The scene as read.
    pub fn scene(&self) -> &Scene {
        &self.setup.input.scene
    }

    /// Text of the scene.
    pub fn scene_yaml(&self) -> &str {
        &self.setup.scene_yaml
    }

    /// The parts built of the scene, and their memory.
    ///
    /// - `has_arm`: whether an arm probes.
    pub fn cost(&self, has_arm: bool) -> SceneCost {
        let Self { setup, session } = self;
        let unused = [
            LeftOut {
                part: "clock",
                reason: "the node estimates none",
            },
            LeftOut {
                part: "markers",
                reason: "poses come as such",
            },
            LeftOut {
                part: "robot",
                reason: "no arm was asked for",
            },
        ];
        let unused = if has_arm { &unused[..2] } else { &unused };
        let memory = Memory::of(session.engine.refiner().footprint(), setup.input.bytes());
        SceneCost {
            parts: setup.input.scene.built(unused, &crate::FEATURES),
            memory,
        }
    }

    /// Starts the threads.
    ///
    /// - `arm`: probes flagged features; without one, orders are refused.
    /// - `arrivals`: input from the port; the node ends with
    ///   [`Shutdown`](crate::ros::port::Arrival::Shutdown), or after the end of all senders.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn start(
        self,
        port: Arc<dyn Port>,
        arrivals: Arrivals,
        arm: Option<ArmOfNode>,
    ) -> Result<Node, NodeError> {
        let Self { setup, session } = self;
        let (folder, name) = (session.folder.path().to_owned(), session.name.clone());
        let (to_view, view_inputs) = sync_channel(VIEW_QUEUE);
        let (to_features, feature_inputs) = sync_channel(FEATURE_QUEUE);
        let (to_spare, spare) = sync_channel(EDITS_ROUND);
        for _ in 0..EDITS_ROUND {
            to_spare
                .send(Box::<Edits>::default())
                .map_err(|_| NodeError::Stopped)?;
        }
        let clock = setup.clock.clone();
        let stops = Arc::clone(arrivals.stops());
        // every start allows false
        let _ = stops.allow(&ParameterValue::Bool(
            setup.shared.parameters().bool(ALLOW_MOTION),
        ));
        let view = ViewWorker::new(
            clock.clone(),
            Arc::clone(&port),
            Arc::clone(&setup.shared),
            to_spare,
        );
        let features = FeatureWorker::new(
            clock.clone(),
            Arc::clone(&port),
            Arc::clone(&setup.shared),
            name,
        );
        let arm = arm
            .map(|arm| arm::start(&setup, &port, arm, to_features.clone(), &stops))
            .transpose()?;
        let (handle, arm) = arm.unzip();
        let haptic =
            RefinementWorker::new(setup, port, session, to_view, to_features, spare, stops)
                .with_arm(handle);
        let view = begin_behind(&clock, "view", move || view.run(&view_inputs))?;
        let features = begin_behind(&clock, "features", move || features.run(&feature_inputs))?;
        let haptic = begin(&clock, "haptic", move || haptic.run(arrivals))?;
        Ok(Node {
            haptic,
            others: arm.into_iter().chain([features, view]).collect(),
            folder,
        })
    }
}

impl Node {
    /// Folder of the first session.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// [`NodeError`] if the result was not written, or a thread ended by a fault.
    pub fn join(self) -> Result<NodeEnd, NodeError> {
        let ended = self.haptic.join().map_err(|_| NodeError::Stopped)?;
        self.others
            .into_iter()
            .try_for_each(JoinHandle::join)
            .map_err(|_| NodeError::Stopped)?;
        ended
    }
}
