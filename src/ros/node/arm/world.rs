//! What is around the arm of the node: the mesh as it was sent, the topics, and whoever may cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3};

use super::common::Common;
use crate::clock::Clock;
use crate::mesh::{FaceHit, TriMesh};
use crate::probing::arm::{ArmState, Observer};
use crate::probing::execute::{Phase, Progress, StaticWorld, World};
use crate::ros::messages::{PoseStamped, ProbeFeedback};
use crate::ros::node::convert::{as_pose, as_wrench};
use crate::ros::node::replica::MeshReplica;
use crate::ros::port::{Feedback, SamplePort};
use crate::stylus::{StampedPose, StampedWrench, Wrench};

/// Feedback comes at least so often while the arm moves.
const FEEDBACK_EVERY: Duration = Duration::from_millis(100);
/// How long a change of the mesh may take until it is complete.
const COPY_WAIT: Duration = Duration::from_secs(15);

/// Has something made of the mesh as it is now, beside the loop of the arm, which must not wait for it. Nothing comes where the
/// mesh is not complete in time, or the memory has no room.
pub fn ask_mesh<T: Send + 'static>(
    clock: &Clock,
    mesh: &MeshReplica,
    make_of: impl FnOnce(StaticWorld) -> T + Send + 'static,
) -> Receiver<T> {
    let (to, ready) = sync_channel(1);
    let snapshot = mesh.complete();
    let (working, clock) = (clock.begin_work(), clock.clone());
    let make = move || {
        // the snapshot goes at once: the next version of the mesh need not be a copy
        let mesh = clock.recv_timeout(&snapshot, COPY_WAIT).ok().and_then(|snapshot| snapshot.mesh().ok());
        if let Some(mesh) = mesh {
            // who asked may have gone
            let _ = to.send(make_of(StaticWorld::new(mesh)));
        }
        drop(working);
    };
    // without a thread the receiver finds its sender gone, as it does where nothing comes
    let _ = Builder::new().name("arm mesh".to_owned()).spawn(make);
    ready
}

/// Publishes a state as a probe does: the pose in the frame in which the scene has poses, the wrench in the axes of the probe.
pub fn publish(samples: &dyn SamplePort, base: &str, tool: &str, state: &ArmState, offset_ns: i64) {
    let stamp_ns = state.stamp_ns + offset_ns;
    let turned = |v| state.pose_bt.rotation.inverse() * v;
    let wrench = Wrench { force: turned(state.wrench_b.force), torque: turned(state.wrench_b.torque) };
    samples.publish_pose(as_pose(&StampedPose { stamp_ns, pose_ot: state.pose_bt }, base));
    samples.publish_wrench(as_wrench(&StampedWrench { stamp_ns, wrench }, tool));
}

/// The world during one probing.
pub struct ArmWorld<'a> {
    pub clock: &'a Clock,
    pub still: StaticWorld,
    /// as it will be
    pub next: Option<Receiver<StaticWorld>>,
    pub mesh: &'a MeshReplica,
    pub samples: &'a dyn SamplePort,
    pub base: &'a str,
    pub object: &'a str,
    pub tool: &'a str,
    pub offset_ns: i64,
    pub feedback: Option<&'a Feedback>,
    pub is_cancelled: Option<&'a Arc<AtomicBool>>,
    pub common: &'a Common,
    /// number of the feature, from 1 on, and how many
    pub feature: [u32; 2],
    /// when the order was taken up
    pub begun: Instant,
    pub progress: Option<Progress>,
    pub phase: Phase,
    pub feedback_sent: Instant,
    pub last: Option<ArmState>,
}

impl<'a> ArmWorld<'a> {
    /// Takes the mesh that has become ready, and asks for the next: it is behind by a touch, or by as long as it takes to make.
    fn renew(&mut self) {
        match self.next.as_ref().map(Receiver::try_recv) {
            Some(Ok(still)) => self.still = still,
            Some(Err(TryRecvError::Empty)) => return,
            Some(Err(TryRecvError::Disconnected)) | None => {}
        }
        self.next = Some(ask_mesh(self.clock, self.mesh, |still| still));
    }

    fn send_feedback(&mut self) {
        self.feedback_sent = self.clock.now();
        let (Some(Feedback(send)), Some(progress)) = (self.feedback, &self.progress) else { return };
        send(ProbeFeedback {
            id: progress.flag,
            feature: self.feature[0],
            feature_count: self.feature[1],
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
            force: self.last.map_or(f64::NAN, |last| last.wrench_b.force.norm()),
            uncertainty: progress.uncertainty.unwrap_or(f64::NAN),
            elapsed: self.clock.since(self.begun).as_secs_f64(),
        });
    }

    /// Places of the object as a path.
    pub fn path(&self, places: &[Point3<f64>]) -> Vec<PoseStamped> {
        let pose = |place: &Point3<f64>| {
            let pose_ot = Isometry3::from_parts(place.coords.into(), nalgebra::UnitQuaternion::identity());
            as_pose(&StampedPose { stamp_ns: 0, pose_ot }, self.object)
        };
        places.iter().map(pose).collect()
    }
}

impl Observer for ArmWorld<'_> {
    fn on_state(&mut self, state: &ArmState) {
        self.last = Some(*state);
        self.common.see(state);
        publish(self.samples, self.base, self.tool, state, self.offset_ns);
        if self.clock.since(self.feedback_sent) >= FEEDBACK_EVERY {
            self.send_feedback();
        }
    }

    fn is_cancelled(&self) -> bool {
        self.common.why_not().is_some() || self.is_cancelled.is_some_and(|cancelled| cancelled.load(Ordering::Acquire))
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
        self.send_feedback();
    }
}
