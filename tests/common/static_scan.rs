//! A scan that no touch changes, as the world of an arm: it can stop the arm, and keeps its
//! observations.

use nalgebra::Point3;
use touchup::mesh::{FaceHit, FaceTree, TriMesh};
use touchup::probing::arm::{ArmState, Observer, StopRequest};
use touchup::probing::execute::{ProbedTouch, Progress, RobotCell, World};
use touchup::sim::{Plate, Surface};

/// A mesh that stays unchanged; it can stop the arm.
pub struct StaticScan {
    pub mesh: TriMesh,
    pub tree: FaceTree,
    /// cancels after this many states
    pub patience: Option<usize>,
    /// makes the arm stay after this many states, and the time of that, ns
    pub stays_after: Option<usize>,
    pub stayed_ns: i64,
    pub seen: usize,
    pub touches: Vec<usize>,
    /// touches in order
    pub made: Vec<ProbedTouch>,
    /// mesh after a force above 2 N
    pub after: Option<TriMesh>,
    /// height of the tip in B at the wish to end, and the least since then, m
    pub since_then: Option<[f64; 2]>,
    /// the true part in its cell, and the least distance of the ball's centre from it, m
    pub part: Option<(Plate, RobotCell)>,
    pub nearest: f64,
}

impl StaticScan {
    pub fn new(mesh: TriMesh) -> Self {
        let tree = FaceTree::new(&mesh);
        let (patience, stays_after, stayed_ns) = (None, None, 0);
        let (seen, touches, made, after, since_then) = (0, Vec::new(), Vec::new(), None, None);
        let (part, nearest) = (None, f64::INFINITY);
        Self {
            mesh,
            tree,
            patience,
            stays_after,
            stayed_ns,
            seen,
            touches,
            made,
            after,
            since_then,
            part,
            nearest,
        }
    }
}

impl Observer for StaticScan {
    fn on_state(&mut self, state: &ArmState) {
        self.seen += 1;
        if state.wrench_b.force.norm() > 2.0
            && let Some(after) = self.after.take()
        {
            self.tree = FaceTree::new(&after);
            self.mesh = after;
        }
        if Some(self.seen) == self.stays_after {
            self.stayed_ns = state.stamp_ns;
        }
        if let Some((part, cell)) = &self.part {
            self.nearest = self
                .nearest
                .min(part.signed_distance(&cell.place(&state.pose_bt)));
        }
        let z = state.pose_bt.translation.z;
        if self.stop_request().is_some() {
            let [first, least] = self.since_then.unwrap_or([z; 2]);
            self.since_then = Some([first, least.min(z)]);
        }
    }

    fn stop_request(&self) -> Option<StopRequest> {
        let is_over =
            |patience: Option<usize>| patience.is_some_and(|patience| self.seen > patience);
        let request = is_over(self.patience).then_some(StopRequest::Retract);
        if is_over(self.stays_after) {
            Some(StopRequest::Stay)
        } else {
            request
        }
    }
}

impl World for StaticScan {
    fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.tree.closest(&self.mesh, place, reach)
    }

    fn publish(&mut self, progress: &Progress) {
        self.touches.push(progress.touch);
    }

    fn touched(&mut self, _: u32, touch: &ProbedTouch) {
        self.made.push(touch.clone());
    }
}
