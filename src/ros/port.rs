//! What the node needs of ROS 2, and no more: what comes in, what goes out, and a way to answer.
//!
//! Behind it stand native DDS, r2r, or nothing at all (in-process, for tests and the demo). No type
//! of theirs leaves their file: messages are the plain structs of [`super::messages`], a request
//! carries the closure that answers it.

use std::fmt;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use super::messages::*;
use super::parameters::ParameterValue;
use crate::reconstruct::Patcher;

/// Tiles that a port keeps for who joins late, the latest, and that are on their way at most: 4 MB.
pub const TILES_KEPT: usize = 64;

/// The topic that followers of the mesh listen to.
pub const MESH_PATCH_TOPIC: &str = "mesh_patch";

/// Something that came in.
#[derive(Debug)]
pub enum Arrival {
    /// `SOURCE/wrench`, and when it came
    Wrench(WrenchStamped, Instant),
    /// `SOURCE/pose`, and when it came
    Pose(PoseStamped, Instant),
    /// `/tf`
    Tf(TFMessage),
    /// `/tf_static`
    TfStatic(TFMessage),
    /// `/clicked_point`
    ClickedPoint(PointStamped),
    /// `/clock`
    Clock(Clock),
    /// a pose (0) or wrench (1) that is refused before its numbers are looked at: why, by the name
    /// of the reason, and when it came
    Refused(usize, &'static str, Instant),
    /// a message that could not be read: its topic, and why
    Unreadable(&'static str, String),
    /// a service was called
    Call(Call),
    /// somebody wants a parameter changed
    SetParameter(String, ParameterValue, Reply<Result<(), String>>),
    /// other software that listens or sends came or went on a topic: for the diagnostics
    Matched(Endpoint),
    /// so many listen to `mesh` now; a port that does not say has one
    Viewers(usize),
    /// somebody wants to see how well the mesh is known: a copy of the evidence, once it is made;
    /// `None` where nothing was touched
    Evidence(Reply<Option<Receiver<Patcher>>>),
    /// a session that is replayed is at its end, or begins again; answered when that is done
    Replay(ReplayStep, Reply<Result<(), String>>),
    /// the process is asked to end
    Shutdown,
}

/// What is between the messages of a session that is replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayStep {
    /// from the scan on, as if none had come
    Again,
    /// none comes any more
    End,
}

/// A call of a service, with what answers it.
#[derive(Debug)]
pub enum Call {
    /// `~/flag_feature`
    Flag(FlagFeatureRequest, Reply<FlagFeatureResponse>),
    /// `~/unflag_feature`
    Unflag(UnflagFeatureRequest, Reply<UnflagFeatureResponse>),
    /// `~/detect_features`
    Detect(DetectFeaturesRequest, Reply<DetectFeaturesResponse>),
    /// `~/save_mesh`
    Save(SaveMeshRequest, Reply<SaveMeshResponse>),
    /// `~/resync_mesh`
    Resync(ResyncMeshRequest, Reply<ResyncMeshResponse>),
    /// `~/undo`
    Undo(UndoRequest, Reply<UndoResponse>),
    /// `~/redo`
    Redo(UndoRequest, Reply<UndoResponse>),
    /// `~/take_out_touch`
    TakeOut(TakeOutTouchRequest, Reply<TakeOutTouchResponse>),
    /// `~/reset`
    Reset(Reply<TriggerResponse>),
    /// `~/arm_state`
    ArmState(Reply<TriggerResponse>),
    /// what an arm works at
    Arm(ArmOrder),
}

/// An order to an arm, with what answers it.
#[derive(Debug)]
pub enum ArmOrder {
    /// `~/probe_feature`
    Feature(ProbeFeatureRequest, Reply<ProbeFeatureResponse>),
    /// `~/probe`
    Goal(ProbeGoal, Goal),
    /// `~/probe_all`
    All(Reply<TriggerResponse>),
    /// `~/recover`
    Recover(Reply<TriggerResponse>),
}

/// A goal of the action `~/probe`.
#[derive(Debug)]
pub struct Goal {
    /// takes it up, or refuses it
    pub accept: Reply<bool>,
    /// feedback; may be called often, drops what nobody waits for
    pub feedback: Feedback,
    /// ends it
    pub result: Reply<(GoalEnd, ProbeResponse)>,
    /// whether a cancel was asked for
    pub is_cancelled: std::sync::Arc<std::sync::atomic::AtomicBool>,
}

/// How a goal ended, as actions name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalEnd {
    /// done
    Succeeded,
    /// stopped because somebody asked for it
    Canceled,
    /// not done
    Aborted,
}

/// Sends feedback of a goal.
pub struct Feedback(pub Box<dyn Fn(ProbeFeedback) + Send>);

/// Answers once. Dropped without an answer, the caller gets none.
pub struct Reply<T>(Box<dyn FnOnce(T) + Send>);

impl<T> Reply<T> {
    /// A reply that passes the answer to `send`, which must not block.
    pub fn new(send: impl FnOnce(T) + Send + 'static) -> Self {
        Self(Box::new(send))
    }

    /// Answers.
    pub fn send(self, answer: T) {
        (self.0)(answer);
    }
}

impl<T> fmt::Debug for Reply<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Reply")
    }
}

impl fmt::Debug for Feedback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Feedback")
    }
}

/// Something that goes out.
#[derive(Clone, Debug)]
pub enum Publication {
    /// `mesh`: one tile
    Tile(Marker),
    /// `mesh_patch`
    MeshPatch(MeshPatch),
    /// `features`
    Features(FeatureArray),
    /// `feature_markers`
    FeatureMarkers(MarkerArray),
    /// `tip`
    Tip(MarkerArray),
    /// `path`
    Path(Path),
    /// `probe_results`
    ProbeResult(ProbeResult),
    /// `probe_touches`
    ProbeTouch(ProbeTouch),
    /// `mismatch`
    Mismatch(HapticMismatch),
    /// `/diagnostics`
    Diagnostics(DiagnosticArray),
}

/// Who else is on a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// as on the wire
    pub topic: String,
    /// how many there are now
    pub count: usize,
    /// why one does not fit, where one does not: quality of service, type, service mapping
    pub mismatch: Option<String>,
}

/// The way out. What comes in goes to the [`Inbox`](super::inbox::Inbox) that a port is started
/// with, which counts what it drops ([`Port::dropped`]).
pub trait Port: Send + Sync {
    /// Sends; never blocks for longer than it takes to write the message down.
    fn publish(&self, publication: Publication);

    /// Name of the node with its namespace: `/cell/touchup`.
    fn node_name(&self) -> &str;

    /// Names of the topics that wrenches and poses come on, whole, as [`Endpoint::topic`] has them.
    fn sample_topics(&self) -> [&str; 2];

    /// Name of the topic that followers of the mesh listen to, whole, as [`Endpoint::topic`] has
    /// it.
    fn mesh_patch_topic(&self) -> &str;

    /// Time of ROS, ns: the system's, or that of `/clock` with `use_sim_time`.
    fn now_ns(&self) -> i64;

    /// Arrivals dropped so far because the node did not take them: wrenches and poses, others.
    fn dropped(&self) -> [u64; 2];

    /// Wrenches and poses that were sent and did not come: gaps in the numbers of their senders,
    /// where the port sees them.
    fn lost(&self) -> [u64; 2];

    /// Publications not sent so far because nobody took them fast enough: tiles, others.
    fn unsent(&self) -> [u64; 2];

    /// Tiles that wait to be sent, as somebody listens slowly.
    fn tiles_waiting(&self) -> usize;
}

/// Where a stylus or a probe publishes what it measures: for what stands in for one.
pub trait SamplePort: Send {
    /// On `SOURCE/wrench`, best effort; whether it was sent.
    fn publish_wrench(&self, wrench: WrenchStamped) -> bool;

    /// On `SOURCE/pose`, best effort; whether it was sent.
    fn publish_pose(&self, pose: PoseStamped) -> bool;

    /// How many listen now: to wrenches, to poses.
    fn listeners(&mut self) -> [usize; 2];
}

/// Something that came from an arm behind ros2_control.
#[derive(Clone, Debug)]
pub enum ArmReport {
    /// its joints
    Joints(JointState),
    /// its sensor
    Wrench(WrenchStamped),
    /// a message that could not be read: why
    Unreadable(String),
}

/// Where an arm behind ros2_control is spoken to: two topics in, one out.
pub trait ArmPort: Send {
    /// The next message, as soon as one is there; `None`: none came in this time.
    fn next_report(&mut self, timeout: std::time::Duration) -> Option<ArmReport>;

    /// Sends an order, reliably; whether it was sent.
    fn publish_trajectory(&mut self, order: JointTrajectory) -> bool;

    /// How many listen to orders now; `None` where the port does not know.
    fn order_listeners(&mut self) -> Option<usize>;
}
