//! Moves a handle face and the region around it, as far as the mesh stays sound.

use nalgebra::{Point3, Vector3};

use super::followed::{FollowedPatch, NEVER};
use super::guard::{GuardEvidence, GuardParams, GuardVerdict};
use super::params::ScanRegion;
use super::roi::{Roi, RoiSize};
use super::stroke_undo::StrokeUndo;
use crate::reconstruct::{PatchDelta, Support};
use touchup_geometry::mesh::{
    FaceHit, FaceId, FaceTree, MeshError, NearbyLeaves, RefitPlan, Region, TriMesh, VertexId,
    is_place,
};

/// Factor on the length of an update that would break the mesh, for the next try.
const CUT: f64 = 0.35;
/// Maximum number of tries of an update.
const TRIES: usize = 3;
/// Distance of other faces in the way of a region while its handle stays, in mean edges.
const MARGIN_EDGES: f64 = 0.2;
/// Margin on the boxes of moving faces, in mean edges: a touch moves vertices by less while it
/// stays on a face.
const BOX_MARGIN_EDGES: f64 = 0.05;

/// Outcome of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegionFit {
    /// As computed.
    Whole,
    /// Shortened, or omitted, because the mesh would have folded, flipped, starved or met itself.
    CutBack,
}

/// Memory of a mesh under refinement, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Footprint {
    /// positions, faces, adjacency, scanned positions of vertices, measured normals of faces
    pub mesh: usize,
    /// tree over the faces
    pub tree: usize,
    /// data of a followed patch
    pub patch: usize,
}

/// A mesh under refinement: the triangles, the tree over them, and the scanned or measured
/// evidence.
#[derive(Clone, Debug)]
pub(super) struct DeformableMesh {
    pub mesh: TriMesh,
    pub tree: FaceTree,
    /// positions as scanned, m
    scanned: Vec<Point3<f64>>,
    /// for each face the last normal scanned or measured there
    evidence: Vec<[f32; 3]>,
    guard: Option<GuardParams>,
    /// mean edge length, m
    pub mean_edge: f64,
    /// maximum distance of vertices from their scanned positions, m
    pub largest_move: f64,
    /// vertices scanned outside of it stay; `None`: all may move
    movable: Option<Region>,
    /// stamp of the current sample, ns
    pub now_ns: i64,
    /// number of edits, by which a region detects edits by others
    edits: u64,
    displacements: Vec<Vector3<f64>>,
    before: Vec<Point3<f64>>,
    pub patch: Option<FollowedPatch>,
    strokes: Option<StrokeUndo>,
}

/// A region of interest with the edit after its last check.
#[derive(Clone, Debug)]
pub(super) struct HandleRegion {
    pub roi: Roi,
    size: RoiSize,
    refit: RefitPlan,
    seen: Option<u64>,
    /// whether a bound on unchecked motion exists since the last refresh
    is_bounded: bool,
    /// distance within which other faces are in its way, m
    margin: f64,
}

impl DeformableMesh {
    pub(crate) fn new(
        mesh: TriMesh,
        guard: Option<GuardParams>,
        touched: Option<&ScanRegion>,
    ) -> Self {
        let tree = FaceTree::new(&mesh);
        let mut evidence = vec![[0.0; 3]; mesh.face_slots()];
        for (face, _) in mesh.faces() {
            evidence[face.0 as usize] = mesh.normal(face).cast::<f32>().into();
        }
        let mean_edge = touched.map_or_else(|| mesh.mean_edge(), |touched| touched.mean_edge);
        Self {
            scanned: mesh.positions().to_vec(),
            evidence,
            guard,
            mean_edge,
            largest_move: f64::INFINITY,
            movable: touched.map(|touched| touched.region.grown(touched.margin)),
            now_ns: i64::MIN,
            edits: 0,
            displacements: Vec::new(),
            before: Vec::new(),
            patch: None,
            strokes: None,
            mesh,
            tree,
        }
    }

    /// Memory, bytes.
    pub(crate) fn footprint(&self) -> Footprint {
        let scanned = self.scanned.capacity() * size_of::<Point3<f64>>();
        let evidence = self.evidence.capacity() * size_of::<[f32; 3]>();
        Footprint {
            mesh: self.mesh.bytes() + scanned + evidence,
            tree: self.tree.bytes(),
            patch: self.patch.as_ref().map_or(0, FollowedPatch::bytes),
        }
    }

    /// Closest face nearer than `reach` (m); faster near `hint`, and for `p` near the last query
    /// with `nearby`.
    pub(crate) fn closest(
        &self,
        p: &Point3<f64>,
        hint: Option<FaceId>,
        reach: f64,
        nearby: &mut NearbyLeaves,
    ) -> Option<FaceHit> {
        match hint {
            Some(hint) => self.tree.closest_nearby(&self.mesh, p, hint, reach, nearby),
            None => self.tree.closest(&self.mesh, p, reach),
        }
    }

    /// Stores the normal measured on `face`.
    pub(crate) fn note_normal(&mut self, face: FaceId, normal: &Vector3<f64>) {
        if let Some(strokes) = &mut self.strokes {
            strokes.note_evidence(face, self.evidence[face.0 as usize]);
        }
        self.evidence[face.0 as usize] = normal.cast::<f32>().into();
    }

    /// An empty region with room for this size.
    pub(crate) fn region(&mut self, size: RoiSize) -> HandleRegion {
        let vertices = size.room(self.mean_edge);
        self.displacements.reserve(vertices);
        self.before.reserve(vertices);
        HandleRegion {
            roi: Roi::with_room(vertices),
            size,
            refit: RefitPlan::with_room(3 * vertices),
            seen: None,
            is_bounded: false,
            margin: MARGIN_EDGES * self.mean_edge,
        }
    }

    /// Makes `region` the region of `handle`, and checks it again after edits elsewhere.
    pub(crate) fn prepare(&mut self, region: &mut HandleRegion, handle: FaceId) {
        if region.roi.handle != Some(handle) {
            region
                .roi
                .rebuild(&self.mesh, handle, region.size, self.guard.is_some());
            self.tree
                .plan(region.roi.neighbourhood.ring.moving(), &mut region.refit);
            region.seen = None;
        }
        if region.seen != Some(self.edits) {
            if let Some(guard) = &self.guard {
                let gap = self.evidence(guard).gap;
                region
                    .roi
                    .neighbourhood
                    .refresh(&self.mesh, &self.tree, region.margin, gap);
            }
            region.refit.spend();
            (region.seen, region.is_bounded) = (Some(self.edits), false);
        }
    }

    /// Whether `region` is the region of `handle` in the current mesh.
    pub(crate) fn is_prepared(&self, region: &HandleRegion, handle: FaceId) -> bool {
        region.roi.handle == Some(handle) && region.seen == Some(self.edits)
    }

    /// Moves the corners of `handle` by `steps` (m) and the region around it after them.
    pub(crate) fn deform(
        &mut self,
        region: &mut HandleRegion,
        handle: FaceId,
        steps: &[Vector3<f64>; 3],
    ) -> RegionFit {
        if region.size == RoiSize::Handle {
            // it moves once, by no more than the longest step
            let longest = steps.iter().map(Vector3::norm).fold(0.0, f64::max);
            region.margin =
                2.0 * longest + self.guard.map_or(0.0, |guard| self.evidence(&guard).gap);
        }
        self.prepare(region, handle);
        if let Some(strokes) = &mut self.strokes {
            strokes.note_positions(&region.roi.vertices, &self.mesh);
        }
        let longest = self.displace(&region.roi, steps);
        let fit = match self.guard {
            Some(guard) => self.place_soundly(region, longest, &guard),
            None => {
                self.place(&region.roi, 1.0);
                RegionFit::Whole
            }
        };
        self.tree.refit_planned(
            &self.mesh,
            &mut region.refit,
            longest,
            BOX_MARGIN_EDGES * self.mean_edge,
        );
        self.edits += 1;
        region.seen = Some(self.edits);
        if let Some(patch) = &mut self.patch {
            patch.note_moved(&region.roi.vertices, self.now_ns);
        }
        fit
    }

    /// Keeps an undo history of strokes from here on, unless there is a patch.
    pub(crate) fn keep_strokes(&mut self) {
        self.strokes = self.patch.is_none().then(StrokeUndo::default);
    }

    /// Notes that the current sample is in contact.
    pub(crate) fn touch(&mut self) {
        if let Some(strokes) = &mut self.strokes {
            strokes.touch(self.now_ns);
        }
    }

    /// Undoes the last stroke, or redoes the last undone one; returns whether there was one.
    pub(crate) fn change_strokes(&mut self, is_undo: bool) -> bool {
        let Self {
            strokes,
            mesh,
            tree,
            evidence,
            ..
        } = self;
        let Some(moved) = strokes
            .as_mut()
            .and_then(|strokes| strokes.change(is_undo, mesh, evidence))
        else {
            return false;
        };
        let faces: Vec<FaceId> = moved
            .iter()
            .flat_map(|&vertex| mesh.star(vertex))
            .copied()
            .collect();
        tree.refit(mesh, &faces);
        self.edits += 1;
        true
    }

    /// Prepares to follow a patch, with room for `faces` new faces.
    pub(crate) fn expect_patch(&mut self, faces: usize) -> Result<(), MeshError> {
        self.mesh.reserve(faces / 2, faces)?;
        self.tree.reserve(faces)?;
        self.scanned.reserve(faces / 2);
        self.evidence.reserve(faces);
        self.strokes = None;
        self.patch = Some(FollowedPatch::new(&self.mesh, faces / 2));
        Ok(())
    }

    /// Whether all corners of a face were touched: the patch alone moves it then.
    #[inline]
    pub(crate) fn is_stiff(&self, face: FaceId) -> bool {
        self.patch.as_ref().is_some_and(|patch| {
            self.mesh
                .corners(face)
                .into_iter()
                .all(|v| patch.is_touched(v))
        })
    }

    /// Begins to take up the changes of the patch: vertices that moved last before them return to
    /// their scanned or patch positions; returns whether there were any.
    pub(crate) fn begin_delta(&mut self, delta: &PatchDelta) -> bool {
        let Self {
            patch: Some(patch),
            mesh,
            tree,
            scanned,
            ..
        } = self
        else {
            return false;
        };
        patch.splice.begin();
        let FollowedPatch {
            moved,
            moved_ns,
            refit,
            ..
        } = patch;
        refit.clear();
        moved.retain(|&vertex| {
            let at = vertex.0 as usize;
            let is_late = moved_ns[at] > delta.until_ns;
            if !is_late {
                moved_ns[at] = NEVER;
                if mesh.position(vertex) != scanned[at] {
                    mesh.set_position(vertex, scanned[at]);
                    refit.extend_from_slice(mesh.star(vertex));
                }
            }
            is_late
        });
        tree.refit(mesh, refit);
        self.edits += u64::from(!refit.is_empty());
        !refit.is_empty()
    }

    /// Takes up to `most` more parts of the changes, as [`crate::reconstruct::Splice::go_on`];
    /// returns whether they are complete.
    pub(crate) fn go_on(&mut self, delta: &PatchDelta, most: usize) -> Result<bool, MeshError> {
        let Self {
            patch: Some(patch),
            mesh,
            tree,
            scanned,
            evidence,
            ..
        } = self
        else {
            return Ok(true);
        };
        let before = patch.splice.placed().len();
        let is_done = patch.splice.go_on(delta, most, mesh, tree)?;
        patch.support.resize(mesh.vertex_slots(), Support::Scan);
        patch.moved_ns.resize(mesh.vertex_slots(), NEVER);
        scanned.resize(mesh.vertex_slots(), Point3::origin());
        for (vertex, placed) in patch
            .splice
            .placed()
            .iter()
            .zip(&delta.vertices)
            .skip(before)
        {
            patch.support[vertex.0 as usize] = placed.support;
            scanned[vertex.0 as usize] = placed.position;
        }
        evidence.resize(mesh.face_slots(), [0.0; 3]);
        for &face in patch.splice.added() {
            evidence[face.0 as usize] = mesh.normal(face).cast::<f32>().into();
        }
        self.edits += 1;
        Ok(is_done)
    }

    fn evidence<'a>(&'a self, params: &'a GuardParams) -> GuardEvidence<'a> {
        let gap = params.gap_share * self.mean_edge;
        GuardEvidence {
            params,
            gap,
            scanned: &self.scanned,
            normals: &self.evidence,
        }
    }

    /// Puts the region at the largest share of its displacement that leaves the mesh sound.
    fn place_soundly(
        &mut self,
        region: &mut HandleRegion,
        longest: f64,
        guard: &GuardParams,
    ) -> RegionFit {
        let (margin, gap) = (region.margin, self.evidence(guard).gap);
        if !std::mem::replace(&mut region.is_bounded, true) {
            region
                .roi
                .neighbourhood
                .bound_unseen(&self.mesh, &self.evidence(guard));
        }
        if region.roi.neighbourhood.is_outdated(longest) {
            region
                .roi
                .neighbourhood
                .collect(&self.mesh, &self.tree, margin, gap);
        }
        if region.roi.neighbourhood.pass_unseen(longest) {
            self.place(&region.roi, 1.0);
            return RegionFit::Whole;
        }
        let mut share = 1.0;
        for _ in 0..TRIES {
            let mut verdict = self.judge_at(region, share, longest, guard);
            if verdict == GuardVerdict::Rough {
                self.place(&region.roi, 0.0);
                region
                    .roi
                    .neighbourhood
                    .roughen(&self.mesh, &self.tree, margin, gap);
                verdict = self.judge_at(region, share, longest, guard);
            }
            if verdict == GuardVerdict::Sound {
                region.roi.neighbourhood.accept(share * longest);
                return if share == 1.0 {
                    RegionFit::Whole
                } else {
                    RegionFit::CutBack
                };
            }
            share *= CUT;
        }
        self.place(&region.roi, 0.0);
        RegionFit::CutBack
    }

    fn judge_at(
        &mut self,
        region: &mut HandleRegion,
        share: f64,
        longest: f64,
        guard: &GuardParams,
    ) -> GuardVerdict {
        self.place(&region.roi, share);
        let (mesh, before, numbers) = (&self.mesh, &self.before, &region.roi.numbers);
        let moved = |v: VertexId| numbers.of(v.0).and_then(|i| before.get(i as usize));
        let was = |v: VertexId| moved(v).copied().unwrap_or_else(|| mesh.position(v));
        region
            .roi
            .neighbourhood
            .judge(mesh, &self.evidence(guard), share * longest, was)
    }

    /// Displacement of each vertex of the region; returns the longest, m.
    fn displace(&mut self, roi: &Roi, steps: &[Vector3<f64>; 3]) -> f64 {
        self.displacements.clear();
        self.before.clear();
        let mut longest = 0.0f64;
        for (&vertex, weights) in roi.vertices.iter().zip(&roi.weights) {
            let (here, scanned) = (self.mesh.position(vertex), self.scanned[vertex.0 as usize]);
            let is_outside = self
                .movable
                .is_some_and(|movable| !movable.contains(&scanned));
            let is_stiff = is_outside
                || self
                    .patch
                    .as_ref()
                    .is_some_and(|patch| patch.is_touched(vertex));
            let mut step = steps[0] * weights[0] + steps[1] * weights[1] + steps[2] * weights[2];
            let (moved, next) = (here - scanned, here + step - scanned);
            let is_far = next.norm_squared() > self.largest_move * self.largest_move
                && next.norm() > moved.norm();
            // last check after all formulas: a vertex never goes to an invalid place
            if is_stiff || is_far || !is_place(&(here + step)) {
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
        for ((&vertex, before), displacement) in roi
            .vertices
            .iter()
            .zip(&self.before)
            .zip(&self.displacements)
        {
            self.mesh
                .set_position(vertex, before + displacement * share);
        }
    }
}
