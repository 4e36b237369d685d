//! Guard of an update: no face around it may flip, fold, degenerate or be pierced.
//!
//! A scan may have such faces already; an update may not make one worse.

use nalgebra::{Point3, Vector3};

use super::collision::Pairs;
use super::fans::Fans;
use super::ring::Ring;
use super::scratch_map::ScratchMap;
use crate::parameters;
use touchup_geometry::mesh::triangle::{Extent, extent};
use touchup_geometry::mesh::{BoxQuery, FaceId, FaceTree, TriMesh, VertexId, triangle};
use touchup_geometry::numeric::{direction, length_and_direction};

parameters! {
    /// Limits that keep a mesh sound.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct GuardParams in "guard" {
        /// Smallest quality of a triangle, twice its area over its longest edge squared: 0.15 is a
        /// sixfold stretch. For a thin triangle of the scan, nine tenths of its scanned quality if
        /// that is less.
        ///
        /// [`Self::SCANNED_SHARE`] of the scanned value, if less: it must not hold all around it.
        smallest_quality: f64 = 0.15, "smallest_quality" [ONE, 0, 0.87];
        /// Smallest cosine between the normals of a face before and after one update.
        ///
        /// 0.5 is 60°.
        smallest_turn_cosine: f64 = 0.5, "smallest_turn_cosine" [ONE, -1, 1];
        /// Smallest cosine between the normal of a face and its last scanned or measured normal.
        ///
        /// At 0 a lid may become a wall, but not an overhang.
        smallest_evidence_cosine: f64 = 0.0, "smallest_evidence_cosine" [ONE, -1, 1];
        /// Smallest cosine between the normals of neighbouring faces: -0.85 is an angle of 148
        /// degrees.
        ///
        /// That is a knife's edge, beyond it is a fold.
        smallest_fold_cosine: f64 = -0.85, "smallest_fold_cosine" [ONE, -1, 1];
        /// Distance in mean edge lengths below which faces count as touching.
        gap_share: f64 = 0.01, "gap_edges" [EDGES, 0, 1];
    }
}

impl GuardParams {
    /// See [`Self::smallest_quality`]. To follow a touch a thin triangle needs to lose little. With
    /// a share of 0.8 a vertex of a crumpled scan strayed, with 0.3 one more face inverted onto
    /// another.
    pub const SCANNED_SHARE: f64 = 0.9;
}

/// Smallest cosine between the normals of a smooth region and their mean: 70°. Such a region is a
/// height field over the plane across its mean normal and cannot meet itself.
const SMOOTH_COSINE: f64 = 0.35;
/// Smallest cosine of the normals at which the region remains a height field: 75°.
const STILL_SMOOTH_COSINE: f64 = 0.25;
/// Motion of the vertices of a smooth region since the last check, as a share of the smallest
/// altitude, that needs no new check: below it a normal turns by less than 0.04 rad and a quality
/// changes by less than 12 %, within the margins below. Proof: a normal turns by at most the sum of
/// two corner motions over the altitude.
const UNSEEN_SHARE: f64 = 0.02;
/// Margin on the cosine of a normal with a fixed direction; 0.04 rad change it by no more than
/// 0.04.
const COSINE_MARGIN: f64 = 0.05;
/// Margin on the cosine between two turning normals.
const FOLD_MARGIN: f64 = 0.1;
/// Margin on the quality.
const QUALITY_MARGIN: f64 = 1.15;

/// Scanned or measured evidence for judging an update, and the limits.
#[derive(Clone, Copy, Debug)]
pub(super) struct GuardEvidence<'a> {
    pub params: &'a GuardParams,
    /// distance below which faces touch, m
    pub gap: f64,
    /// positions as scanned, m
    pub scanned: &'a [Point3<f64>],
    /// for each face the last normal scanned or measured there; zero for a face scanned without
    /// area and never touched: it has no side to keep, and must not hold the others
    pub normals: &'a [[f32; 3]],
}

impl GuardEvidence<'_> {
    /// Smallest allowed twice area over longest edge squared of a face.
    fn smallest_quality(&self, mesh: &TriMesh, face: FaceId) -> f64 {
        let corners = mesh
            .corners(face)
            .map(|vertex| self.scanned[vertex.0 as usize]);
        let double_area = (corners[1] - corners[0])
            .cross(&(corners[2] - corners[0]))
            .norm();
        self.params
            .smallest_quality
            .min(GuardParams::SCANNED_SHARE * triangle::shape_quality(&corners, double_area))
    }
}

/// A face of the region, or of the rim around it.
#[derive(Clone, Copy, Debug)]
struct FaceShape {
    normal: Vector3<f64>,
    quality: f64,
    /// smallest altitude, m
    altitude: f64,
}

/// Verdict of [`Neighbourhood::judge`] on an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GuardVerdict {
    /// The mesh is no worse than before.
    Sound,
    /// A face would flip, fold, starve or meet another.
    Broken,
    /// The region ceases to be smooth: [`Neighbourhood::roughen`] it and ask again.
    Rough,
}

/// Faces that change when the vertices of a region move, and the faces in their way.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbourhood {
    pub ring: Ring,
    /// state at the last check, for each face of the ring
    before: Vec<FaceShape>,
    /// state after the update, for each moving face
    after: Vec<FaceShape>,
    /// mean normal of a smooth region; without one, the guard tests the fans and the pairs in
    /// `suspects`
    smooth: Option<Vector3<f64>>,
    fans: Fans,
    suspects: Pairs,
    /// motion left to the vertices before a new search for `suspects` or `smooth`, m
    allowance: f64,
    /// motion left to the vertices before a new check of the region, m
    unseen: f64,
    near: BoxQuery,
    /// nearby faces with their boxes
    boxes: Vec<(FaceId, Extent)>,
    /// corners connected with the region
    reached: ScratchMap,
}

/// Normal and proportions of a face.
#[inline]
fn shape_of(mesh: &TriMesh, face: FaceId) -> FaceShape {
    let corners = mesh.triangle(face);
    let double = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let (double_area, normal) = length_and_direction(&double);
    let quality = triangle::shape_quality(&corners, double_area);
    // 2A / L from 2A / L² and 2A
    FaceShape {
        normal,
        quality,
        altitude: (quality * double_area).sqrt(),
    }
}

impl Neighbourhood {
    /// Makes room for a region of `vertices` vertices: two to three faces each, three edges for two
    /// faces.
    pub(crate) fn reserve(&mut self, vertices: usize) {
        let faces = 3 * vertices;
        self.before.reserve(faces);
        self.after.reserve(faces);
        self.ring.reserve(vertices);
        self.near = BoxQuery::with_room(2 * faces);
        self.boxes.reserve(2 * faces);
        self.fans.reserve(faces);
        self.suspects.reserve(faces);
        self.reached.reserve(4 * faces);
    }

    /// Collects the region again after edits elsewhere. No vertex may then move unchecked before
    /// [`Self::bound_unseen`].
    ///
    /// - `gap`: as in [`GuardEvidence`].
    pub(crate) fn refresh(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64, gap: f64) {
        self.before.clear();
        self.before
            .extend(self.ring.faces.iter().map(|&face| shape_of(mesh, face)));
        self.collect(mesh, tree, margin, gap);
        if self.smooth.is_none() {
            self.suspects.measure(mesh, gap);
        }
        self.unseen = 0.0;
    }

    /// Bounds the unchecked motion of the vertices of a refreshed region; `evidence` as in
    /// [`Self::judge`].
    pub(crate) fn bound_unseen(&mut self, mesh: &TriMesh, evidence: &GuardEvidence) {
        if let Some(mean) = self.smooth {
            self.after.clear();
            self.after
                .extend_from_slice(&self.before[..self.ring.moving]);
            let is_safe = self.is_safe(mesh, evidence) == Some(true);
            self.stays_smooth(&mean, is_safe);
        }
    }

    /// Finds other faces within `margin` (m), which both sides of a pair may use up but for the
    /// gap; `gap` as in [`GuardEvidence`].
    pub(crate) fn collect(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64, gap: f64) {
        self.allowance = 0.5 * (margin - gap);
        self.find_near(mesh, tree, margin);
        self.smooth = self.smooth_normal(mesh);
        if self.smooth.is_none() {
            self.roughen(mesh, tree, margin, gap);
        }
    }

    /// Gives up the claim to be smooth: tests pairs of faces from now on; parameters as of
    /// [`Self::collect`].
    pub(crate) fn roughen(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64, gap: f64) {
        self.allowance = 0.5 * (margin - gap);
        self.smooth = None;
        self.find_near(mesh, tree, margin);
        self.suspects.clear();
        self.boxes.clear();
        self.boxes.extend(
            self.near
                .faces
                .iter()
                .map(|&face| (face, extent(&mesh.triangle(face)))),
        );
        let before = &self.before;
        self.fans.find(mesh, &self.ring, SMOOTH_COSINE, |number| {
            before[number as usize].normal
        });
        for (moving, &face) in self.ring.moving().iter().enumerate() {
            // two moving faces are one pair
            let is_wanted = |other| {
                self.ring
                    .number_of(other)
                    .is_none_or(|index| index as usize > moving)
            };
            let is_smooth = |corner| self.fans.is_smooth(corner);
            self.suspects
                .add_near(mesh, face, &self.boxes, margin, is_wanted, is_smooth);
        }
    }

    fn find_near(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64) {
        let (mut lo, mut hi) = (
            Vector3::repeat(f64::INFINITY),
            Vector3::repeat(f64::NEG_INFINITY),
        );
        for &face in self.ring.moving() {
            for p in mesh.triangle(face) {
                (lo, hi) = (lo.inf(&p.coords), hi.sup(&p.coords));
            }
        }
        let margin_box = Vector3::repeat(margin);
        tree.faces_in_box(
            &Point3::from(lo - margin_box),
            &Point3::from(hi + margin_box),
            &mut self.near,
        );
    }

    /// Mean normal, if all nearby faces are within [`SMOOTH_COSINE`] of it and connected.
    fn smooth_normal(&mut self, mesh: &TriMesh) -> Option<Vector3<f64>> {
        let sum: Vector3<f64> = self.before[..self.ring.moving]
            .iter()
            .map(|shape| shape.normal)
            .sum();
        let mean = direction(&sum)?;
        if self
            .before
            .iter()
            .any(|shape| shape.normal.dot(&mean) <= SMOOTH_COSINE)
        {
            return None;
        }
        let ring = &self.ring;
        retain(&mut self.near.faces, |face| ring.number_of(face).is_none());
        let within = |face: &FaceId| {
            let double = mesh.double_area_normal(*face);
            double.dot(&mean) > SMOOTH_COSINE * double.norm()
        };
        if !self.near.faces.iter().all(within) {
            return None;
        }
        // nearly always the rim's other corners reach all; at a border the moving faces reach some
        self.reached.clear();
        let (moving, rim) = self.ring.faces.split_at(self.ring.moving);
        for faces in [rim, moving] {
            for &face in faces {
                self.reached
                    .number(mesh.corners(face).map(|corner| corner.0));
            }
            if reach_all(mesh, &mut self.near.faces, &mut self.reached) {
                return Some(mean);
            }
        }
        None
    }

    /// Takes a motion of the vertices by `displacement` (m) if it needs no check; returns whether
    /// it took it.
    #[inline]
    pub(crate) fn pass_unseen(&mut self, displacement: f64) -> bool {
        let passes = displacement <= self.unseen;
        if passes {
            self.unseen -= displacement;
            self.allowance -= displacement;
        }
        passes
    }

    /// Judges the current mesh against the mesh before the update.
    ///
    /// - `displacement`: largest motion of a vertex in the update, m.
    /// - `before`: position of a vertex before the update, m.
    pub(crate) fn judge(
        &mut self,
        mesh: &TriMesh,
        evidence: &GuardEvidence,
        displacement: f64,
        before: impl Fn(VertexId) -> Point3<f64>,
    ) -> GuardVerdict {
        self.after.clear();
        self.after.extend(
            self.ring.faces[..self.ring.moving]
                .iter()
                .map(|&face| shape_of(mesh, face)),
        );
        self.unseen = 0.0;
        let Some(is_safe) = self.is_safe(mesh, evidence) else {
            return GuardVerdict::Broken;
        };
        match self.smooth.map(|mean| self.stays_smooth(&mean, is_safe)) {
            Some(true) => GuardVerdict::Sound,
            Some(false) => GuardVerdict::Rough,
            None if self.are_apart(mesh, evidence.gap, displacement, before) => GuardVerdict::Sound,
            None => GuardVerdict::Broken,
        }
    }

    /// Whether no faces have begun to meet.
    fn are_apart(
        &mut self,
        mesh: &TriMesh,
        gap: f64,
        displacement: f64,
        before: impl Fn(VertexId) -> Point3<f64>,
    ) -> bool {
        let after = &self.after;
        let normal = |number: u32| after[number as usize].normal;
        self.fans
            .are_clear(mesh, STILL_SMOOTH_COSINE, normal, gap, &before)
            && self.suspects.are_clear(mesh, gap, displacement, &before)
    }

    /// Whether a smooth region is still smooth; bounds the unchecked motion of its vertices, if all
    /// of it `is_safe`.
    fn stays_smooth(&mut self, mean: &Vector3<f64>, is_safe: bool) -> bool {
        let lowest = self
            .after
            .iter()
            .map(|shape| shape.normal.dot(mean))
            .fold(1.0, f64::min);
        if is_safe && lowest > STILL_SMOOTH_COSINE + COSINE_MARGIN {
            let altitude = self
                .after
                .iter()
                .map(|shape| shape.altitude)
                .fold(f64::INFINITY, f64::min);
            self.unseen = UNSEEN_SHARE * altitude;
        }
        lowest > STILL_SMOOTH_COSINE
    }

    /// Checks the region: `None` if it is broken, else whether it is sound with margins.
    fn is_safe(&self, mesh: &TriMesh, evidence: &GuardEvidence) -> Option<bool> {
        Some(self.are_faces_safe(mesh, evidence)? & self.are_edges_safe(evidence)?)
    }

    fn are_faces_safe(&self, mesh: &TriMesh, evidence: &GuardEvidence) -> Option<bool> {
        let (params, mut is_safe) = (evidence.params, true);
        for ((&face, old), new) in self.ring.faces.iter().zip(&self.before).zip(&self.after) {
            let seen = Vector3::from(evidence.normals[face.0 as usize].map(f64::from));
            if seen == Vector3::zeros() {
                continue;
            }
            let worse = |new: f64, old: f64, limit: f64| new < limit && new < old;
            let cosine = new.normal.dot(&seen);
            let is_thin = new.quality < params.smallest_quality * QUALITY_MARGIN;
            let smallest_quality = if is_thin {
                evidence.smallest_quality(mesh, face)
            } else {
                0.0
            };
            if worse(new.quality, old.quality, smallest_quality)
                || worse(
                    cosine,
                    old.normal.dot(&seen),
                    params.smallest_evidence_cosine,
                )
                || new.normal.dot(&old.normal) < params.smallest_turn_cosine
            {
                return None;
            }
            is_safe &= !(new.quality < smallest_quality * QUALITY_MARGIN
                || cosine < params.smallest_evidence_cosine + COSINE_MARGIN);
        }
        Some(is_safe)
    }

    fn are_edges_safe(&self, evidence: &GuardEvidence) -> Option<bool> {
        let (limit, mut is_safe) = (evidence.params.smallest_fold_cosine, true);
        let has_side =
            |index: u32| evidence.normals[self.ring.faces[index as usize].0 as usize] != [0.0; 3];
        for &(a, b) in &self.ring.edges {
            let (old_a, old_b) = (&self.before[a as usize], &self.before[b as usize]);
            let new_b = self.after.get(b as usize).unwrap_or(old_b);
            let cosine = self.after[a as usize].normal.dot(&new_b.normal);
            if cosine < limit + FOLD_MARGIN && has_side(a) && has_side(b) {
                if cosine < limit && cosine < old_a.normal.dot(&old_b.normal) {
                    return None;
                }
                is_safe = false;
            }
        }
        Some(is_safe)
    }

    /// Takes the checked state as the new state before; `displacement` is the largest motion of a
    /// vertex, m.
    pub(crate) fn accept(&mut self, displacement: f64) {
        self.before[..self.ring.moving].copy_from_slice(&self.after);
        self.suspects.accept(displacement);
        self.allowance -= displacement;
    }

    /// Whether a motion of `displacement` (m) needs a new collection of the nearby faces.
    #[inline]
    pub(crate) fn is_outdated(&self, displacement: f64) -> bool {
        self.allowance < displacement
    }
}

/// Whether `faces` reach the corners already `reached`, over common corners among themselves;
/// removes the faces that do.
fn reach_all(mesh: &TriMesh, faces: &mut Vec<FaceId>, reached: &mut ScratchMap) -> bool {
    loop {
        let before = faces.len();
        retain(faces, |face| {
            let (corners, known) = (mesh.corners(face).map(|corner| corner.0), reached.len());
            reached.number(corners);
            let is_reached = reached.len() < known + 3;
            if !is_reached {
                reached.take_back(corners);
            }
            !is_reached
        });
        if faces.is_empty() || faces.len() == before {
            return faces.is_empty();
        }
    }
}

/// As [`Vec::retain`], without a branch on the answer, which is unpredictable.
#[inline]
fn retain(faces: &mut Vec<FaceId>, mut stays: impl FnMut(FaceId) -> bool) {
    let mut kept = 0;
    for at in 0..faces.len() {
        let face = faces[at];
        faces[kept] = face;
        kept += usize::from(stays(face));
    }
    faces.truncate(kept);
}
