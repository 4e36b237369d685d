//! The mesh that follows while an arm probes.

use std::sync::Arc;

use nalgebra::Point3;

use crate::cli::CliError;
use crate::cli::progress::WorkProgress as Bar;
use crate::live::{Engine, Gate, LiveError, Pace, Renewal};
use crate::mesh::{FaceHit, FaceTree, TriMesh};
use crate::probing::arm::{ArmState, Observer, StopRequest};
use crate::probing::execute::{Cell, Progress, World};
use crate::scene::Scene;
use crate::stylus::{Message, Sample, StampedPose, StampedWrench, Wrench, WrenchFrame};

/// Room reserved for new faces.
const ROOM: usize = 1 << 16;

/// The mesh is read before each touch alone, not in between: a renewal each 200 ms, ns.
const EVERY_NS: i64 = 200_000_000;

/// Takes each state of the arm for a sample, and keeps it.
pub(super) struct LiveWorld<'a> {
    engine: Engine,
    cell: &'a Cell,
    messages: Vec<Message>,
    failed: Option<LiveError>,
    bar: Bar,
}

impl<'a> LiveWorld<'a> {
    pub fn new(
        scan: Arc<(TriMesh, FaceTree)>,
        scene: &Scene,
        cell: &'a Cell,
        is_simulated: bool,
    ) -> Result<Self, CliError> {
        let nothing = || CliError::usage("the scene names no `refine`, so nothing would move the mesh");
        let params = scene.refine_params(WrenchFrame::Sensor).ok_or_else(nothing)?;
        // what a simulated arm does next does not depend on how fast this computer is; a real one goes on in that time
        let pace = Pace { is_patient: is_simulated, every_ns: EVERY_NS, ..Pace::default() };
        let mesh = scan.0.clone();
        let renewal = Renewal::Beside { scan, pace, room: ROOM, gate: Gate::default() };
        let engine = Engine::new(mesh, params, scene.patcher_params(), renewal)?;
        Ok(Self { engine, cell, messages: Vec::new(), failed: None, bar: Bar::new("probe", None) })
    }

    /// All samples.
    pub fn finish(self) -> Result<Vec<Message>, CliError> {
        self.failed.map_or(Ok(self.messages), |error| Err(error.into()))
    }
}

impl Observer for LiveWorld<'_> {
    fn on_state(&mut self, state: &ArmState) {
        self.bar.step();
        let turned = |v| state.pose_bt.rotation.inverse() * v;
        // in the axes of the probe, as its sensor would have it
        let wrench = Wrench { force: turned(state.wrench_b.force), torque: turned(state.wrench_b.torque) };
        let (stamp_ns, pose_ot) = (state.stamp_ns, self.cell.pose_bo.inverse() * state.pose_bt);
        if self.messages.last().is_some_and(|last| last.stamp_ns() >= stamp_ns) {
            return;
        }
        // recorded where the arm has it: the scene says where the part is
        self.messages.push(Message::Pose(StampedPose { stamp_ns, pose_ot: state.pose_bt }));
        self.messages.push(Message::Wrench(StampedWrench { stamp_ns, wrench }));
        let sample = Sample { stamp_ns, pose_ot, wrench };
        match self.engine.push(&sample) {
            Ok(_) | Err(LiveError::Refine(_)) => {}
            Err(error) => self.failed = Some(error),
        }
    }

    fn stop_request(&self) -> Option<StopRequest> {
        self.failed.as_ref().map(|_| StopRequest::Retract)
    }
}

impl World for LiveWorld<'_> {
    fn mesh(&self) -> &TriMesh {
        self.engine.refiner().mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.engine.refiner().closest_face(place, reach)
    }

    fn publish(&mut self, progress: &Progress) {
        let uncertainty_um = progress.uncertainty.map(|sigma| sigma * 1e6);
        tracing::debug!(
            feature = progress.flag,
            touch = progress.touch,
            of = progress.budget,
            uncertainty_um,
            "touching"
        );
    }
}
