//! Hand-written loop with the least work of any refiner: closest face, move its corners, update the
//! tree.

use nalgebra::Point3;

use touchup_geometry::mesh::{FaceId, FaceTree, NearbyLeaves, RefitPlan, TriMesh, VertexId};
use touchup_method::stylus::Sample;
use touchup_sim::wavy::{FORCE, RADIUS, STIFFNESS};

/// Share of the mismatch that relaxes per second, 1/s: as in the refiner.
const RELAXATION: f64 = 25.0;
/// Sample period, s.
const STEP: f64 = 1e-3;
/// Margin of planned boxes: far more than a sample moves, m.
const MARGIN: f64 = 2e-5;
/// Search radius of a contact, m.
pub(super) const REACH: f64 = 0.01;

/// Share of the mismatch that relaxes per sample.
pub(super) fn gain() -> f64 {
    -(-RELAXATION * STEP).exp_m1()
}

/// A mesh that follows the ball of [`touchup_sim::wavy`], and nothing else.
#[derive(Clone, Debug)]
pub struct MinimalLoop {
    /// current mesh
    pub mesh: TriMesh,
    tree: FaceTree,
    gain: f64,
    faces: Vec<FaceId>,
    plan: Option<StaleBoxes>,
}

/// Boxes to update as long as the face stays, and leaves nearby.
#[derive(Clone, Debug, Default)]
struct StaleBoxes {
    face: Option<FaceId>,
    plan: RefitPlan,
    nearby: NearbyLeaves,
}

impl MinimalLoop {
    /// Builds the tree.
    pub fn new(mesh: TriMesh) -> Self {
        let tree = FaceTree::new(&mesh);
        Self {
            mesh,
            tree,
            gain: gain(),
            faces: Vec::new(),
            plan: None,
        }
    }

    /// As [`Self::new`], and keeps its look-ups, as the refiner does: boxes to update, and near
    /// leaves.
    pub fn keeping(mesh: TriMesh) -> Self {
        Self {
            plan: Some(StaleBoxes::default()),
            ..Self::new(mesh)
        }
    }

    /// Takes one sample of known force; returns whether it moved anything.
    pub fn push(&mut self, sample: &Sample) -> bool {
        let Self {
            mesh,
            tree,
            gain,
            faces,
            plan,
        } = self;
        let normal = sample.wrench.force / FORCE;
        let p = Point3::from(sample.pose_ot.translation.vector) + sample.wrench.force / STIFFNESS
            - normal * RADIUS;
        let hit = match plan {
            Some(StaleBoxes {
                face: Some(last),
                nearby,
                ..
            }) => tree.closest_nearby(mesh, &p, *last, REACH, nearby),
            _ => tree.closest(mesh, &p, REACH),
        };
        let Some(hit) = hit else { return false };
        let step = normal * (*gain * (p - hit.point).dot(&normal));
        let corners = mesh.corners(hit.face);
        corners
            .into_iter()
            .for_each(|vertex: VertexId| mesh.set_position(vertex, mesh.position(vertex) + step));
        let is_known = plan
            .as_ref()
            .is_some_and(|kept| kept.face == Some(hit.face));
        if !is_known {
            faces.clear();
            corners
                .into_iter()
                .for_each(|vertex| faces.extend_from_slice(mesh.star(vertex)));
        }
        match plan {
            None => tree.refit(mesh, faces),
            Some(StaleBoxes { face, plan, .. }) => {
                if !is_known {
                    *face = Some(hit.face);
                    tree.plan(faces, plan);
                }
                tree.refit_planned(mesh, plan, step.norm(), MARGIN);
            }
        }
        true
    }
}
