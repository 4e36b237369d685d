//! Moves a handle face and the region around it, as far as the mesh stays sound.

use nalgebra::{Point3, Vector3};

use super::guard::GuardParams;
use super::roi::{Roi, RoiSize};
use crate::mesh::{FaceId, FaceTree, TriMesh, VertexId};

/// An update that would break the mesh is tried again at this share of its length …
const CUT: f64 = 0.35;
/// … this often, and then given up.
const TRIES: usize = 3;
/// Faces looked at to find the mean edge.
const EDGE_SAMPLE: usize = 20_000;

/// How an update ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// As computed.
    Whole,
    /// Shortened, or not made at all, because the mesh would have folded, flipped, starved or met itself.
    CutBack,
}

/// A mesh under refinement: the triangles, the tree over them, and what was scanned or felt where.
#[derive(Clone, Debug)]
pub(super) struct Clay {
    pub mesh: TriMesh,
    pub tree: FaceTree,
    /// positions as scanned, m
    scanned: Vec<Point3<f64>>,
    /// for each face the last normal scanned or felt there
    evidence: Vec<[f32; 3]>,
    guard: GuardParams,
    /// mean edge length, m
    pub mean_edge: f64,
    /// vertices stay within this distance of where they were scanned, m
    pub largest_move: f64,
    /// counts the edits, so that a region knows whether others came between
    edits: u64,
    displacements: Vec<Vector3<f64>>,
    before: Vec<Point3<f64>>,
}

/// A region of interest with the edit after which it was last looked at.
#[derive(Clone, Debug, Default)]
pub(super) struct Grip {
    roi: Roi,
    seen: Option<u64>,
}

impl Grip {
    /// The faces that the last update changed.
    pub fn faces(&self) -> &[FaceId] {
        self.roi.neighbourhood.moving()
    }

    /// The vertices that the last update moved.
    pub fn vertices(&self) -> &[VertexId] {
        &self.roi.vertices
    }
}

impl Clay {
    pub fn new(mesh: TriMesh, guard: GuardParams) -> Self {
        let tree = FaceTree::new(&mesh);
        let mut evidence = vec![[0.0; 3]; mesh.face_slots()];
        for (face, _) in mesh.faces() {
            evidence[face.0 as usize] = mesh.normal(face).cast::<f32>().into();
        }
        let mean_edge = mean_edge(&mesh);
        Self {
            scanned: mesh.positions().to_vec(),
            evidence,
            guard,
            mean_edge,
            largest_move: f64::INFINITY,
            edits: 0,
            displacements: Vec::new(),
            before: Vec::new(),
            mesh,
            tree,
        }
    }

    /// Remembers that a surface facing `normal` was felt on `face`.
    pub fn feel(&mut self, face: FaceId, normal: &Vector3<f64>) {
        self.evidence[face.0 as usize] = normal.cast::<f32>().into();
    }

    /// Moves the corners of `handle` by `steps` (m) and the region around it after them.
    pub fn deform(&mut self, grip: &mut Grip, handle: FaceId, size: RoiSize, steps: &[Vector3<f64>; 3]) -> Fit {
        let margin = 0.5 * self.mean_edge;
        if !grip.roi.is_for(handle) {
            grip.roi.rebuild(&self.mesh, handle, size);
            grip.seen = None;
        }
        if grip.seen != Some(self.edits) {
            grip.roi.neighbourhood.refresh(&self.mesh, &self.tree, margin);
        }
        let longest = self.displace(&grip.roi, steps);
        let gap = self.guard.gap_share * self.mean_edge;
        let mut share = 1.0;
        for tried in 0..TRIES {
            self.place(&grip.roi, share);
            let (roi, before) = (&mut grip.roi, &self.before);
            let marks = &roi.marks;
            let was = |v: VertexId| marks.of(v.0).map_or_else(|| self.mesh.position(v), |i| before[i as usize]);
            if roi.neighbourhood.is_sound(&self.mesh, &self.guard, &self.evidence, gap, was) {
                self.edits += 1;
                grip.seen = Some(self.edits);
                self.tree.refit(&self.mesh, roi.neighbourhood.moving());
                roi.neighbourhood.accept(&self.mesh, &self.tree, share * longest, margin);
                return if tried == 0 { Fit::Whole } else { Fit::CutBack };
            }
            share *= CUT;
        }
        self.place(&grip.roi, 0.0);
        grip.seen = Some(self.edits);
        Fit::CutBack
    }

    /// The displacement of each vertex of the region; returns the longest, m.
    fn displace(&mut self, roi: &Roi, steps: &[Vector3<f64>; 3]) -> f64 {
        self.displacements.clear();
        self.before.clear();
        let mut longest = 0.0f64;
        for (&vertex, weights) in roi.vertices.iter().zip(&roi.weights) {
            let here = self.mesh.position(vertex);
            let mut step = steps[0] * weights[0] + steps[1] * weights[1] + steps[2] * weights[2];
            let (way, next) = (here - self.scanned[vertex.0 as usize], here + step - self.scanned[vertex.0 as usize]);
            if next.norm_squared() > self.largest_move * self.largest_move && next.norm() > way.norm() {
                step = Vector3::zeros();
            }
            longest = longest.max(step.norm_squared());
            self.displacements.push(step);
            self.before.push(here);
        }
        longest.sqrt()
    }

    /// Puts the region at a share of its displacement.
    fn place(&mut self, roi: &Roi, share: f64) {
        for (i, &vertex) in roi.vertices.iter().enumerate() {
            self.mesh.set_position(vertex, self.before[i] + self.displacements[i] * share);
        }
    }
}

/// Mean edge length, m, of up to [`EDGE_SAMPLE`] faces spread over the mesh.
fn mean_edge(mesh: &TriMesh) -> f64 {
    let step = (mesh.face_count() / EDGE_SAMPLE).max(1);
    let (mut sum, mut count) = (0.0, 0.0);
    for (face, _) in mesh.faces().step_by(step) {
        let [a, b, c] = mesh.triangle(face);
        sum += (b - a).norm() + (c - b).norm() + (a - c).norm();
        count += 3.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}
