//! The node's interface to ROS 2: arrivals, publications, and replies.
//!
//! Its implementations are native DDS, r2r, or in-process without a network, for tests and the
//! demo. Their types stay in their files: messages are the plain structs of [`crate::ros::messages`],
//! and a request carries the closure that answers it.

use std::fmt;
use std::time::Instant;

use crate::ros::messages::*;
use crate::ros::parameters::ParameterValue;
use touchup_io::recording::LiveMessage;

/// Number of latest tiles that a port keeps for late joiners, and maximum number in flight: 4 MB.
pub const TILES_KEPT: usize = 64;

/// The topic for followers of the mesh.
pub const MESH_PATCH_TOPIC: &str = "mesh_patch";

/// An arrival.
#[derive(Debug)]
pub enum Arrival {
    /// `SOURCE/wrench` or `SOURCE/pose`, and its arrival
    Message(LiveMessage, Instant),
    /// `/tf`
    Tf(TFMessage),
    /// `/tf_static`
    TfStatic(TFMessage),
    /// `/clicked_point`
    ClickedPoint(PointStamped),
    /// `/clock`
    Clock(Clock),
    /// a pose (0) or wrench (1) refused before its numbers are checked: name of the reason, and
    /// arrival
    Refused(usize, &'static str, Instant),
    /// an unreadable message: its topic, and the cause
    Unreadable(&'static str, String),
    /// a call of a service
    Call(Call),
    /// a request to change a parameter
    SetParameter(String, ParameterValue, Reply<Result<(), String>>),
    /// a change of the other participants on a topic: for the diagnostics
    Matched(Endpoint),
    /// number of listeners to `mesh`; one if the port does not know
    Viewers(usize),
    /// end or restart of a replayed session; answered after completion
    Replay(ReplayStep, Reply<Result<(), String>>),
    /// a request to end the process
    Shutdown,
}

/// Step between the messages of a replayed session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayStep {
    /// from the scan on, before the first message
    Again,
    /// after the last message
    End,
}

/// A call of a service, with its reply.
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
    /// an order to the arm
    Arm(ArmOrder),
}

/// An order to an arm, with its reply.
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
    /// accepts or refuses the goal
    pub accept: Reply<bool>,
    /// feedback; may be called often, drops unwanted messages
    pub feedback: Feedback,
    /// ends the goal
    pub result: Reply<(GoalEnd, ProbeResponse)>,
    /// whether a cancel was requested
    pub is_cancelled: std::sync::Arc<std::sync::atomic::AtomicBool>,
}

/// End of a goal, as named by actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalEnd {
    /// done
    Succeeded,
    /// stopped on request
    Canceled,
    /// not done
    Aborted,
}

/// Sends feedback of a goal.
pub struct Feedback(pub Box<dyn Fn(ProbeFeedback) + Send>);

/// Answers once. If dropped without an answer, the caller gets none.
pub struct Reply<T>(Box<dyn FnOnce(T) + Send>);

impl<T> Reply<T> {
    /// A reply that passes the answer to `send`, which must not block.
    pub fn new(send: impl FnOnce(T) + Send + 'static) -> Self {
        Self(Box::new(send))
    }

    /// Sends the answer.
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

/// A publication.
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

/// Other participants on a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// name on the wire
    pub topic: String,
    /// their current number
    pub count: usize,
    /// reason why one does not fit, if any: quality of service, type, service mapping
    pub mismatch: Option<String>,
}

/// Output of the node. Arrivals go to the [`Inbox`](crate::ros::inbox::Inbox) given at the port's start,
/// which counts drops ([`Port::dropped`]).
pub trait Port: Send + Sync {
    /// Sends; blocks only for writing the message down.
    fn publish(&self, publication: Publication);

    /// Name of the node with its namespace: `/cell/touchup`.
    fn node_name(&self) -> &str;

    /// Topics of wrenches and poses, absolute, as in [`Endpoint::topic`].
    fn sample_topics(&self) -> [&str; 2];

    /// Topic for followers of the mesh, absolute, as in [`Endpoint::topic`].
    fn mesh_patch_topic(&self) -> &str;

    /// Time of ROS, ns: the system's, or that of `/clock` with `use_sim_time`.
    fn now_ns(&self) -> i64;

    /// Arrivals dropped up to now for a busy node: wrenches and poses, others.
    fn dropped(&self) -> [u64; 2];

    /// Wrenches and poses sent but not received: gaps in the numbers of their senders, if the port
    /// sees them.
    fn lost(&self) -> [u64; 2];

    /// Publications dropped up to now for slow listeners: tiles, others.
    fn unsent(&self) -> [u64; 2];

    /// Tiles waiting for slow listeners.
    fn tiles_waiting(&self) -> usize;
}

/// Publisher of the measurements of a stylus or a probe: for stand-ins of one.
pub trait SamplePort: Send {
    /// Publishes on `SOURCE/wrench` or `SOURCE/pose`, best effort; returns whether it was sent.
    fn publish(&self, message: LiveMessage) -> bool;

    /// Current number of listeners: to wrenches, to poses.
    fn listeners(&mut self) -> [usize; 2];
}

/// A message from an arm behind ros2_control.
#[derive(Clone, Debug)]
pub enum ArmReport {
    /// joint states
    Joints(JointState),
    /// wrench of its sensor
    Wrench(WrenchStamped),
    /// cause of an unreadable message
    Unreadable(String),
}

/// Connection to an arm behind ros2_control: two topics in, one out.
pub trait ArmPort: Send {
    /// The next message, as soon as there is one; `None` after the timeout.
    fn next_report(&mut self, timeout: std::time::Duration) -> Option<ArmReport>;

    /// Sends an order, reliably; returns whether it was sent.
    fn publish_trajectory(&mut self, order: JointTrajectory) -> bool;

    /// Current number of listeners to orders; `None` if the port does not know.
    fn order_listeners(&mut self) -> Option<usize>;
}
