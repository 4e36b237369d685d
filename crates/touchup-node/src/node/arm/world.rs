//! Surroundings of the node's arm: the mesh as sent, the topics, and cancel requests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use nalgebra::Point3;

use super::common::SharedArmState;
use crate::node::setup::Setup;
use crate::node::side_work::begin;
use crate::ros::messages::ProbeFeedback;
use crate::ros::parameters::CELL_FRAME;
use crate::ros::port::{Feedback, SamplePort};
use crate::ros::stop::ArmMotion;
use touchup_geometry::mesh::{FaceHit, TriMesh};
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::Message;
use touchup_probing::arm::{ArmState, Observer, StopRequest};
use touchup_probing::execute::{Phase, Progress, StaticWorld, World};

/// Maximum period of feedback while the arm moves.
const FEEDBACK_EVERY: Duration = Duration::from_millis(100);
/// Maximum duration of a mesh change until the mesh is complete.
const COPY_WAIT: Duration = Duration::from_secs(15);

/// Computes a result from the current mesh, outside the loop of the arm, which must not wait for
/// it. No result if the mesh is not complete in time, or memory is short.
pub fn ask_mesh<T: Send + 'static>(
    Setup { clock, shared, .. }: &Setup,
    make_of: impl FnOnce(StaticWorld) -> T + Send + 'static,
) -> Receiver<T> {
    let (to, ready) = sync_channel(1);
    let snapshot = shared.mesh.complete();
    let waiting = clock.clone();
    let make = move || {
        // dropped at once: the next version of the mesh need not be a copy
        let mesh = waiting
            .recv_timeout(&snapshot, COPY_WAIT)
            .ok()
            .and_then(|snapshot| snapshot.mesh().ok());
        if let Some(mesh) = mesh {
            // the receiver may be gone
            let _ = to.send(make_of(StaticWorld::new(mesh)));
        }
    };
    // without a thread the receiver finds its sender gone, as without a result
    let _ = begin(clock, "arm mesh", make);
    ready
}

/// Connections of the arm thread to its streams.
pub struct ArmLink {
    pub setup: Arc<Setup>,
    /// port for the measurements of the arm
    pub samples: Box<dyn SamplePort>,
    pub common: Arc<SharedArmState>,
    /// offset from the arm's clock to ROS time, ns
    pub offset_ns: Option<i64>,
    /// start of the current order
    pub begun: Instant,
}

impl ArmLink {
    /// Publishes a state as a probe does: the pose in the scene's frame of poses, the wrench in the
    /// axes of the probe.
    pub fn publish(&self, state: &ArmState) {
        let setup = &*self.setup;
        // base of the arm, if the scene places the scan in it
        let base = match setup.input.scene.scan_to_space {
            Some(_) => CELL_FRAME,
            None => &setup.shared.frame,
        };
        let stamp_ns = state.stamp_ns + self.offset_ns.unwrap_or(0);
        let (pose, wrench) = state.as_probe(stamp_ns);
        for (frame, message) in [
            (base, Message::Pose(pose)),
            (&setup.tool, Message::Wrench(wrench)),
        ] {
            let frame = frame.to_owned();
            self.samples.publish(LiveMessage { frame, message });
        }
    }
}

/// Follower of a goal: the feedback, and a cancel flag.
pub type GoalWatcher<'a> = (&'a Feedback, &'a Arc<AtomicBool>);

/// Whether the follower has cancelled the goal.
pub fn is_cancelled(watched: Option<GoalWatcher<'_>>) -> bool {
    watched.is_some_and(|(_, cancelled)| cancelled.load(Ordering::Acquire))
}

/// The world during one probing.
pub struct ArmWorld<'a> {
    link: &'a ArmLink,
    still: StaticWorld,
    /// next mesh
    next: Option<Receiver<StaticWorld>>,
    watched: Option<GoalWatcher<'a>>,
    /// number of the feature, from 0 on, and number of features
    feature: [usize; 2],
    progress: Option<Progress>,
    phase: Phase,
    feedback_sent: Instant,
    last: Option<ArmState>,
}

impl<'a> ArmWorld<'a> {
    /// The surroundings of the arm while it probes a feature.
    ///
    /// - `feature`: its number, from 0 on, and the number of features.
    pub fn new(
        link: &'a ArmLink,
        still: StaticWorld,
        watched: Option<GoalWatcher<'a>>,
        feature: [usize; 2],
    ) -> Self {
        let (phase, feedback_sent) = (Phase::Planning, link.begun);
        Self {
            link,
            still,
            next: None,
            watched,
            feature,
            progress: None,
            phase,
            feedback_sent,
            last: None,
        }
    }

    /// Takes a finished mesh and requests the next: it lags by one touch, or by its computing time.
    fn renew(&mut self) {
        match self.next.as_ref().map(Receiver::try_recv) {
            Some(Ok(still)) => self.still = still,
            Some(Err(TryRecvError::Empty)) => return,
            Some(Err(TryRecvError::Disconnected)) | None => {}
        }
        self.next = Some(ask_mesh(&self.link.setup, |still| still));
    }

    fn send_feedback(&mut self) {
        self.feedback_sent = self.link.setup.clock.now();
        let (Some((Feedback(send), _)), Some(progress)) = (self.watched, &self.progress) else {
            return;
        };
        send(ProbeFeedback {
            id: progress.flag,
            feature: self.feature[0] as u32 + 1,
            feature_count: self.feature[1] as u32,
            phase: match self.phase {
                Phase::Planning => ProbeFeedback::PLANNING,
                Phase::Link => ProbeFeedback::LINK,
                Phase::Zeroing => ProbeFeedback::ZEROING,
                Phase::Approach => ProbeFeedback::APPROACH,
                Phase::Search => ProbeFeedback::SEARCH,
                Phase::Slide => ProbeFeedback::SLIDE,
                Phase::Retract => ProbeFeedback::RETRACT,
            },
            touch: progress.touch as u32,
            touch_count: progress.budget as u32,
            force: self
                .last
                .map_or(f64::NAN, |last| last.wrench_b.force.norm()),
            uncertainty: progress.uncertainty.unwrap_or(f64::NAN),
            elapsed: self.link.setup.clock.since(self.link.begun).as_secs_f64(),
        });
    }
}

impl Observer for ArmWorld<'_> {
    fn on_state(&mut self, state: &ArmState) {
        self.last = Some(*state);
        self.link.common.stops.look();
        self.link.common.see(state);
        self.link.publish(state);
        if self.link.setup.clock.since(self.feedback_sent) >= FEEDBACK_EVERY {
            self.send_feedback();
        }
    }

    fn stop_request(&self) -> Option<StopRequest> {
        self.link
            .common
            .stops
            .request()
            .or(is_cancelled(self.watched).then_some(StopRequest::Retract))
    }
}

impl World for ArmWorld<'_> {
    fn mesh(&self) -> &TriMesh {
        self.still.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.still.closest_face(place, reach)
    }

    fn publish(&mut self, progress: &Progress) {
        self.renew();
        self.progress = Some(*progress);
        self.send_feedback();
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.link.common.stops.enter(if phase == Phase::Retract {
            ArmMotion::Retracts
        } else {
            ArmMotion::Moves
        });
        self.send_feedback();
    }
}
