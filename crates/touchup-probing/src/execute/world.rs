//! The environment of a probing: the current mesh, its observer, and a request to cancel.

use nalgebra::{Point3, Unit, Vector3};

use super::ending::ProbedTouch;
use crate::arm::{ArmState, Observer};
use touchup_features::calibrate::StaticPose;
use touchup_geometry::mesh::{FaceHit, FaceTree, TriMesh};

/// Progress of a probing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// number of the feature
    pub flag: u32,
    /// current touch, from 1 on; 0 before the first
    pub touch: usize,
    /// maximum number of touches
    pub budget: usize,
    /// standard uncertainty of the wanted number, m or rad
    pub uncertainty: Option<f64>,
}

/// The environment of a probing. Each observed state may change the mesh.
pub trait World: Observer {
    /// The present mesh, in O.
    fn mesh(&self) -> &TriMesh;

    /// Face nearest to a place of O, within a reach (m).
    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit>;

    /// Publishes the progress.
    fn publish(&mut self, progress: &Progress);

    /// Receives a phase at its beginning.
    fn enter(&mut self, _: Phase) {}

    /// Receives each touch before the arm goes on; also an impossible touch, with the reason.
    ///
    /// - `flag`: number of the feature; 0 for the touches of a spot.
    fn touched(&mut self, _flag: u32, _touch: &ProbedTouch) {}

    /// Receives each static segment of a payload identification, before the arm goes on.
    fn weighed(&mut self, _segment: &StaticPose) {}
}

/// Activity of a probing arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// none yet
    Planning,
    /// goes through free air
    Link,
    /// zeroes its sensor
    Zeroing,
    /// comes near, slowly
    Approach,
    /// touches
    Search,
    /// slides over the surface
    Slide,
    /// goes back into free air
    Retract,
}

/// A mesh that does not change, without an observer.
pub struct StaticWorld {
    mesh: TriMesh,
    tree: FaceTree,
}

impl StaticWorld {
    /// - `mesh`: in O.
    pub fn new(mesh: TriMesh) -> Self {
        Self {
            tree: FaceTree::new(&mesh),
            mesh,
        }
    }
}

impl Observer for StaticWorld {
    fn on_state(&mut self, _: &ArmState) {}
}

impl World for StaticWorld {
    fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.tree.closest(&self.mesh, place, reach)
    }

    fn publish(&mut self, _: &Progress) {}
}

/// Radius of the surface around a flag whose mean normal counts, m.
const AROUND: f64 = 8e-3;
/// Reach of the mesh search from a flag, m.
const NEAR: f64 = 20e-3;
/// Minimum cosine between normals of one surface.
const ALIKE: f64 = 0.7;

/// Distance of a place from the mesh, m; at most the reach.
pub(super) fn distance(world: &dyn World) -> impl Fn(&Point3<f64>, f64) -> f64 {
    |place, reach| {
        world
            .closest_face(place, reach)
            .map_or(reach, |hit| (place - hit.point).norm())
    }
}

/// Outward normal of the surface around a flag: the mean of its faces towards the handle of the
/// probe, weighted by their area; without such faces, the shaft.
pub(super) fn normal_about(
    world: &dyn World,
    flag: &Point3<f64>,
    shaft: &Unit<Vector3<f64>>,
) -> Unit<Vector3<f64>> {
    let mesh = world.mesh();
    let near = mesh
        .faces()
        .filter(|(face, _)| (mesh.barycentre(*face) - flag).norm() < AROUND);
    let areas = near.map(|(face, _)| mesh.double_area_normal(face));
    let sum: Vector3<f64> = areas
        .filter(|area| area.dot(shaft) > ALIKE * area.norm())
        .sum();
    Unit::try_new(sum, 0.0).unwrap_or(*shaft)
}

/// The place of the mesh nearest to a flag; the flag itself if none is near.
pub(super) fn on_mesh(world: &dyn World, flag: &Point3<f64>) -> Point3<f64> {
    world
        .closest_face(flag, NEAR)
        .map_or(*flag, |hit| hit.point)
}

/// Highest place of the mesh along a direction, m from the origin of O.
pub(super) fn highest(mesh: &TriMesh, up: &Unit<Vector3<f64>>) -> f64 {
    let [low, high] = mesh.bounds();
    (0..3).map(|i| (low[i] * up[i]).max(high[i] * up[i])).sum()
}
