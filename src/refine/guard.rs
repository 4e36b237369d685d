//! What an update may not do to the faces around it: flip, fold, starve or pierce one.
//!
//! A scan may come with such faithless faces; an update may not make one worse.

use nalgebra::{Point3, Vector3};

use super::roi::Marks;
use crate::mesh::{FaceId, FaceTree, TriMesh, VertexId, triangle};

/// Limits that keep a mesh sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuardParams {
    /// Smallest twice area over longest edge squared. Default 0.15: a triangle stretched sixfold.
    pub smallest_quality: f64,
    /// Smallest cosine between normals before and after one update. Default 0.5: 60°.
    pub smallest_turn_cosine: f64,
    /// Smallest cosine between a face's normal and the last that was scanned or felt there. Default 0: a lid may become
    /// a wall, but not an overhang.
    pub smallest_evidence_cosine: f64,
    /// Smallest cosine between neighbours. Default −0.75: 139° apart is a knife's edge, beyond it is a fold.
    pub smallest_fold_cosine: f64,
    /// Faces nearer than this share of the mean edge count as touching. Default 0.01.
    pub gap_share: f64,
}

impl Default for GuardParams {
    fn default() -> Self {
        Self {
            smallest_quality: 0.15,
            smallest_turn_cosine: 0.5,
            smallest_evidence_cosine: 0.0,
            smallest_fold_cosine: -0.75,
            gap_share: 0.01,
        }
    }
}

/// Normals of a smooth region are within this cosine of their mean: 70°. Such a region is a height field over the plane
/// across its mean normal and cannot meet itself.
const SMOOTH_COSINE: f64 = 0.35;
/// While each normal stays within this cosine (75°), the region remains a height field.
const STILL_SMOOTH_COSINE: f64 = 0.25;

/// A face of the region, or the rim around it.
#[derive(Clone, Copy, Debug)]
struct Shape {
    normal: Vector3<f64>,
    quality: f64,
}

/// Two faces that could come to meet: one that moves, and how many corners they share.
#[derive(Clone, Copy, Debug)]
struct Suspects {
    moving: u32,
    other: FaceId,
    shared: u8,
}

/// The faces that change when the vertices of a region move, and what they could run into.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbourhood {
    /// faces with a moving vertex, then the faces that share an edge with one of these
    faces: Vec<FaceId>,
    /// how many of them move
    moving: usize,
    /// indices into `faces` of faces that share an edge, the first one moving
    edges: Vec<(u32, u32)>,
    /// state before the update, for each of `faces`
    before: Vec<Shape>,
    /// state after it, for the moving ones
    after: Vec<Shape>,
    /// pairs to be looked at when the region is not smooth
    suspects: Vec<Suspects>,
    /// mean normal of a smooth region
    smooth: Option<Vector3<f64>>,
    /// how far vertices may still move before `suspects` must be collected again, m
    allowance: f64,
    near: Vec<FaceId>,
    marks: Marks,
}

/// Twice the area vector split into unit normal and shape quality.
#[inline]
fn shape_of(mesh: &TriMesh, face: FaceId) -> Shape {
    let corners = mesh.triangle(face);
    let double = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let length = double.norm();
    let normal = if length > 0.0 { double / length } else { Vector3::zeros() };
    Shape { normal, quality: triangle::shape_quality(&corners, length) }
}

impl Neighbourhood {
    /// Faces whose corners move with the region.
    pub fn moving(&self) -> &[FaceId] {
        &self.faces[..self.moving]
    }

    /// Collects the faces around `vertices`.
    pub fn rebuild(&mut self, mesh: &TriMesh, vertices: &[VertexId]) {
        self.faces.clear();
        self.edges.clear();
        self.marks.clear(mesh.face_slots());
        for &vertex in vertices {
            for &face in mesh.star(vertex) {
                if self.marks.of(face.0).is_none() {
                    self.marks.set(face.0, self.faces.len() as u32);
                    self.faces.push(face);
                }
            }
        }
        self.moving = self.faces.len();
        for index in 0..self.moving {
            let corners = mesh.corners(self.faces[index]);
            for side in 0..3 {
                self.link(mesh, index as u32, corners[side], corners[(side + 1) % 3]);
            }
        }
        self.allowance = f64::NEG_INFINITY;
    }

    fn link(&mut self, mesh: &TriMesh, index: u32, a: VertexId, b: VertexId) {
        for face in mesh.faces_at_edge(a, b) {
            let other = self.marks.of(face.0).unwrap_or_else(|| {
                self.marks.set(face.0, self.faces.len() as u32);
                self.faces.push(face);
                self.faces.len() as u32 - 1
            });
            // pairs of moving faces are met from both sides
            if other > index {
                self.edges.push((index, other));
            }
        }
    }

    /// Brings the state before the update up to date after the mesh was changed elsewhere.
    pub fn refresh(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64) {
        self.before.clear();
        self.before.extend(self.faces.iter().map(|&face| shape_of(mesh, face)));
        self.collect(mesh, tree, margin);
    }

    /// Looks for faces that could be met within `margin` (m) of motion.
    fn collect(&mut self, mesh: &TriMesh, tree: &FaceTree, margin: f64) {
        self.allowance = 0.5 * margin;
        let (mut lo, mut hi) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for &face in &self.faces[..self.moving] {
            for p in mesh.triangle(face) {
                (lo, hi) = (lo.inf(&p.coords), hi.sup(&p.coords));
            }
        }
        let margin_box = Vector3::repeat(margin);
        self.near.clear();
        tree.faces_in_box(&Point3::from(lo - margin_box), &Point3::from(hi + margin_box), &mut self.near);
        self.suspects.clear();
        self.smooth = self.smooth_normal(mesh);
        if self.smooth.is_none() {
            self.collect_suspects(mesh, margin);
        }
    }

    /// The mean normal, if all faces nearby are within [`SMOOTH_COSINE`] of it and hang together.
    fn smooth_normal(&mut self, mesh: &TriMesh) -> Option<Vector3<f64>> {
        let sum: Vector3<f64> = self.before[..self.moving].iter().map(|shape| shape.normal).sum();
        let mean = sum.try_normalize(0.0)?;
        self.marks.clear(mesh.face_slots());
        for &face in &self.near {
            let double = mesh.double_area_normal(face);
            if double.dot(&mean) <= SMOOTH_COSINE * double.norm() {
                return None;
            }
            self.marks.set(face.0, 0);
        }
        self.all_connected(mesh).then_some(mean)
    }

    /// Whether the marked faces hang together over common corners; sorts `near` by that.
    fn all_connected(&mut self, mesh: &TriMesh) -> bool {
        let total = self.near.len();
        self.near.clear();
        self.near.push(self.faces[0]);
        self.marks.set(self.faces[0].0, 1);
        let mut next = 0;
        while next < self.near.len() {
            for vertex in mesh.corners(self.near[next]) {
                for &face in mesh.star(vertex) {
                    if self.marks.of(face.0) == Some(0) {
                        self.marks.set(face.0, 1);
                        self.near.push(face);
                    }
                }
            }
            next += 1;
        }
        self.near.len() == total
    }

    fn collect_suspects(&mut self, mesh: &TriMesh, margin: f64) {
        self.marks.clear(mesh.face_slots());
        for (index, &face) in self.faces[..self.moving].iter().enumerate() {
            self.marks.set(face.0, index as u32);
        }
        for moving in 0..self.moving {
            let face = self.faces[moving];
            let (corners, bounds) = (mesh.corners(face), bounds(&mesh.triangle(face)));
            for &other in &self.near {
                // two moving faces are one pair
                if self.marks.of(other.0).is_some_and(|index| index as usize <= moving) {
                    continue;
                }
                if apart(&bounds, &self::bounds(&mesh.triangle(other)), margin) {
                    continue;
                }
                let others = mesh.corners(other);
                let shared = corners.iter().filter(|corner| others.contains(corner)).count() as u8;
                if shared < 2 {
                    self.suspects.push(Suspects { moving: moving as u32, other, shared });
                }
            }
        }
    }

    /// Whether the mesh as it stands now is sound around the region, or at least no worse than before.
    ///
    /// - `evidence`: for each face the last normal scanned or felt there.
    /// - `gap`: faces nearer than this touch, m.
    /// - `before`: the position of a vertex before the update, m.
    pub fn is_sound(
        &mut self,
        mesh: &TriMesh,
        params: &GuardParams,
        evidence: &[[f32; 3]],
        gap: f64,
        before: impl Fn(VertexId) -> Point3<f64>,
    ) -> bool {
        self.after.clear();
        let mut still_smooth = true;
        for index in 0..self.moving {
            let face = self.faces[index];
            let (new, old) = (shape_of(mesh, face), self.before[index]);
            let seen = Vector3::from(evidence[face.0 as usize].map(f64::from));
            let worse = |new: f64, old: f64, limit: f64| new < limit && new < old;
            if worse(new.quality, old.quality, params.smallest_quality)
                || worse(new.normal.dot(&seen), old.normal.dot(&seen), params.smallest_evidence_cosine)
                || new.normal.dot(&old.normal) < params.smallest_turn_cosine
            {
                return false;
            }
            still_smooth &= self.smooth.is_some_and(|mean| mean.dot(&new.normal) > STILL_SMOOTH_COSINE);
            self.after.push(new);
        }
        if !self.folds_no_edge(params) {
            return false;
        }
        if self.smooth.is_some() {
            return still_smooth || self.rough_and_clear(mesh, gap, before);
        }
        self.is_clear(mesh, gap, before)
    }

    fn folds_no_edge(&self, params: &GuardParams) -> bool {
        self.edges.iter().all(|&(a, b)| {
            let new_b = self.after.get(b as usize).unwrap_or(&self.before[b as usize]);
            let cosine = self.after[a as usize].normal.dot(&new_b.normal);
            cosine >= params.smallest_fold_cosine
                || cosine >= self.before[a as usize].normal.dot(&self.before[b as usize].normal)
        })
    }

    /// A region that ceases to be smooth is looked at pair by pair from now on.
    fn rough_and_clear(&mut self, mesh: &TriMesh, gap: f64, before: impl Fn(VertexId) -> Point3<f64>) -> bool {
        self.smooth = None;
        self.collect_suspects(mesh, 2.0 * self.allowance);
        self.is_clear(mesh, gap, before)
    }

    fn is_clear(&self, mesh: &TriMesh, gap: f64, before: impl Fn(VertexId) -> Point3<f64>) -> bool {
        self.suspects.iter().all(|pair| {
            let face = self.faces[pair.moving as usize];
            let corners = [mesh.corners(face), mesh.corners(pair.other)];
            !meet(&corners, pair.shared, gap, |v| mesh.position(v)) || meet(&corners, pair.shared, gap, &before)
        })
    }

    /// Takes the state after the update as the new state before; `moved` is the longest way of a vertex, m.
    pub fn accept(&mut self, mesh: &TriMesh, tree: &FaceTree, moved: f64, margin: f64) {
        self.before[..self.moving].copy_from_slice(&self.after);
        self.allowance -= moved;
        if self.allowance < 0.0 {
            self.collect(mesh, tree, margin);
        }
    }
}

type Bounds = (Vector3<f64>, Vector3<f64>);

#[inline]
fn bounds([a, b, c]: &[Point3<f64>; 3]) -> Bounds {
    (a.coords.inf(&b.coords).inf(&c.coords), a.coords.sup(&b.coords).sup(&c.coords))
}

#[inline]
fn apart(a: &Bounds, b: &Bounds, gap: f64) -> bool {
    (0..3).any(|i| a.0[i] > b.1[i] + gap || b.0[i] > a.1[i] + gap)
}

/// Whether two faces that share no edge meet, other than in their common corner.
fn meet(corners: &[[VertexId; 3]; 2], shared: u8, gap: f64, position: impl Fn(VertexId) -> Point3<f64>) -> bool {
    let [t, u] = corners.map(|face| face.map(&position));
    if apart(&bounds(&t), &bounds(&u), gap) {
        return false;
    }
    if shared == 0 {
        return triangle::intersect(&t, &u, gap);
    }
    let opposite = |face: usize, other: usize| {
        let at = (0..3).find(|&i| corners[other].contains(&corners[face][i])).unwrap_or(0);
        ((at + 1) % 3, (at + 2) % 3)
    };
    let ((a, b), (c, d)) = (opposite(0, 1), opposite(1, 0));
    triangle::segment_crosses(&t[a], &t[b], &u, 0.0) || triangle::segment_crosses(&u[c], &u[d], &t, 0.0)
}
