//! Closest face of a mesh that changes: a bounding volume tree that is exact and tight after every edit.
//!
//! A binary tree over the faces. Boxes are kept in single precision relative to the middle of the mesh and rounded
//! outward, so a query that prunes by them never misses a face; distances to faces are computed in double precision.
//! [`FaceTree::refit`] recomputes the boxes of the leaves that hold moved faces and all boxes above them: boxes never
//! only grow, so nothing is left to be tightened later.

use nalgebra::{Point3, Vector3};

use super::triangle::closest_point;
use super::{FaceId, TriMesh};

/// Faces in a leaf at most. Two to four are equally fast within noise; four makes the smallest tree.
const LEAF_FACES: usize = 4;
/// A split at the middle is taken only if it leaves at least this share on either side (1/4), so that the depth is at
/// most log(2^32) / log(4/3) = 78.
const SMALLEST_SHARE: usize = 4;
/// Slots of the traversal stack: one for each level, see [`SMALLEST_SHARE`].
const STACK: usize = 96;
/// Roundings of the largest coordinate M by which the distances of two faces that meet at the closest point may differ.
///
/// The point a + v·ab + w·ac is rounded by ε/2 · M at each sum, which makes ε M along each axis, √3 ε M in length. The
/// products add ε times the longest edge, at most the diagonal D of the mesh; difference to `p`, squares and their sum
/// 5/4 ε times the distance d. Two faces: 2√3 ε M + 2 ε D + 5/2 ε d. That v and w are rounded too moves the point along
/// the face, where the distance is stationary; only for a `p` on the surface to rounding it is not, and that has no side.
const TIE_COORDINATE: f64 = 4.0 * f64::EPSILON;
/// The same for the diagonal of the mesh, see [`TIE_COORDINATE`].
const TIE_DIAGONAL: f64 = 2.0 * f64::EPSILON;
/// The same for the distance, see [`TIE_COORDINATE`].
const TIE_DISTANCE: f64 = 3.0 * f64::EPSILON;
/// What cancellation may take from the precision of a squared height, where the angle is not below [`NEEDLE`].
const PLANE_MARGIN: f64 = 1e-6;
/// Squared sine of the least angle at which a normal is trusted: 0.06°.
const NEEDLE: f64 = 1e-6;
/// The reach of a query with a hint over the distance to the hinted face.
const HINT_WIDTH: f64 = 1.0 + 1e-6;
/// No node.
const NONE: u32 = u32::MAX;

/// The face that was asked for, and the point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceHit {
    /// the face
    pub face: FaceId,
    /// closest point (surface distance) or barycentre (Eq 12), m, in O
    pub point: Point3<f64>,
    /// barycentric coordinates of `point` in the order of the face's corners; sum 1
    pub barycentric: [f64; 3],
    /// squared distance from the query point to `point`, m²
    pub distance_squared: f64,
}

/// An axis-aligned box in single precision, relative to the tree's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Aabb {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Aabb {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|i| lesser(self.lo[i], other.lo[i])),
            hi: std::array::from_fn(|i| greater(self.hi[i], other.hi[i])),
        }
    }

    /// Takes in the corners of a face, rounded to nearest; [`Self::rounded_outward`] makes up for that.
    #[inline]
    fn take(&mut self, mesh: &TriMesh, face: FaceId, origin: &Point3<f64>) {
        for corner in mesh.triangle(face) {
            let corner = [corner.x - origin.x, corner.y - origin.y, corner.z - origin.z].map(|x| x as f32);
            self.lo = std::array::from_fn(|i| lesser(self.lo[i], corner[i]));
            self.hi = std::array::from_fn(|i| greater(self.hi[i], corner[i]));
        }
    }

    /// One unit in the last place wider on each side: rounding is monotone, so all corners are inside.
    #[inline]
    fn rounded_outward(&self) -> Self {
        let unit = |x: f32| x.abs() * f32::EPSILON + f32::MIN_POSITIVE;
        Self { lo: self.lo.map(|x| x - unit(x)), hi: self.hi.map(|x| x + unit(x)) }
    }

    /// Squared distance to a point (relative to the tree's origin), in single precision; 0 inside.
    #[inline]
    fn distance_squared(&self, p: &[f32; 3]) -> f32 {
        let outside = |i: usize| greater(greater(self.lo[i] - p[i], p[i] - self.hi[i]), 0.0);
        let (x, y, z) = (outside(0), outside(1), outside(2));
        x * x + y * y + z * z
    }

    /// The largest box of single precision within a box: it overlaps the same boxes of single precision.
    fn within(lo: &Vector3<f64>, hi: &Vector3<f64>) -> Self {
        let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
        Self { lo: [lo.x, lo.y, lo.z].map(up), hi: [hi.x, hi.y, hi.z].map(|x| -up(-x)) }
    }

    /// Whether two boxes meet; without branches, for which way it goes cannot be foretold.
    #[inline]
    fn overlaps(&self, other: &Self) -> bool {
        (0..3).fold(true, |all, i| all & (self.lo[i] <= other.hi[i]) & (self.hi[i] >= other.lo[i]))
    }
}

/// One node; `count == 0` marks an inner node whose children are the pair `first`, else a leaf of `count` faces from
/// `first` in the list of faces.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    first: u32,
    count: u32,
}

/// Two siblings share a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Pair([Node; 2]);

/// Bounding volume tree over the faces of one [`TriMesh`].
#[derive(Clone, Debug)]
pub struct FaceTree {
    origin: Point3<f64>,
    root: Node,
    pairs: Vec<Pair>,
    /// for each pair: the node above it (2 · pair + side), [`NONE`] at the root
    parents: Vec<u32>,
    /// faces of the leaves, leaf after leaf
    leaf_faces: Vec<FaceId>,
    /// leaf (2 · pair + side) of each face, [`NONE`] for the root and for removed faces
    leaf_of_face: Vec<u32>,
}

/// The boxes that depend on certain faces: leaves, and the pairs above them from the root down.
#[derive(Clone, Debug, Default)]
pub struct RefitPlan {
    leaves: Vec<u32>,
    pairs: Vec<u32>,
}

impl RefitPlan {
    /// A plan with room for so many faces.
    pub fn with_room(faces: usize) -> Self {
        // the way from the leaves to the root adds a level or so for each halving of the mesh
        Self { leaves: Vec::with_capacity(faces), pairs: Vec::with_capacity(2 * faces + STACK) }
    }
}

/// The faces found by [`FaceTree::faces_in_box`], with the buffers of the search.
#[derive(Clone, Debug, Default)]
pub struct BoxQuery {
    /// in no particular order
    pub faces: Vec<FaceId>,
    /// pairs met, in order
    pairs: Vec<u32>,
    /// first face and number of faces of the leaves met
    leaves: Vec<(u32, u32)>,
}

impl BoxQuery {
    /// A query with room for so many faces.
    pub fn with_room(faces: usize) -> Self {
        let (pairs, leaves) = (vec![0; faces + STACK], vec![(0, 0); faces + STACK]);
        Self { faces: Vec::with_capacity(faces + LEAF_FACES), pairs, leaves }
    }
}

/// A face while the tree is built.
#[derive(Clone, Copy)]
struct Item {
    middle: [f32; 3],
    face: FaceId,
}

impl FaceTree {
    /// Builds the tree; O(F log F).
    pub fn new(mesh: &TriMesh) -> Self {
        let origin = middle_of(mesh);
        let mut items: Vec<Item> = mesh
            .faces()
            .map(|(face, _)| {
                let middle = mesh.barycentre(face) - origin;
                Item { middle: [middle.x as f32, middle.y as f32, middle.z as f32], face }
            })
            .collect();
        let mut tree = Self {
            origin,
            root: Node { bounds: Aabb::EMPTY, first: 0, count: 0 },
            pairs: Vec::with_capacity(items.len() / 2),
            parents: Vec::with_capacity(items.len() / 2),
            leaf_faces: Vec::with_capacity(items.len() + LEAF_FACES),
            leaf_of_face: vec![NONE; mesh.face_slots()],
        };
        tree.root = tree.build(mesh, &mut items, NONE);
        // so that any leaf can be read as if it were full
        tree.leaf_faces.extend([FaceId(NONE); LEAF_FACES]);
        tree
    }

    fn build(&mut self, mesh: &TriMesh, items: &mut [Item], at: u32) -> Node {
        if items.len() <= LEAF_FACES {
            let first = self.leaf_faces.len() as u32;
            let mut bounds = Aabb::EMPTY;
            for item in items.iter() {
                bounds.take(mesh, item.face, &self.origin);
                self.leaf_of_face[item.face.0 as usize] = at;
                self.leaf_faces.push(item.face);
            }
            return Node { bounds: bounds.rounded_outward(), first, count: items.len() as u32 };
        }
        let split = split(items);
        let pair = self.pairs.len() as u32;
        let blank = Node { bounds: Aabb::EMPTY, first: 0, count: 0 };
        self.pairs.push(Pair([blank; 2]));
        self.parents.push(at);
        let (left, right) = items.split_at_mut(split);
        let children = [self.build(mesh, left, 2 * pair), self.build(mesh, right, 2 * pair + 1)];
        self.pairs[pair as usize] = Pair(children);
        Node { bounds: children[0].bounds.union(&children[1].bounds), first: pair, count: 0 }
    }

    /// The face whose surface is closest to `p`, among those nearer than `reach` (m); `None` when there is none.
    ///
    /// Where faces meet at the closest point (an edge or a corner), the one that `p` lies most squarely above or below
    /// is named, so that the sign of (p − point)·n tells inside from outside; among equals the smallest id.
    pub fn closest(&self, mesh: &TriMesh, p: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.search(
            p,
            reach,
            |face, limit| {
                let triangle = mesh.triangle(face);
                if is_plane_beyond(p, &triangle, limit) {
                    return None;
                }
                let (point, barycentric) = closest_point(p, &triangle);
                Some(FaceHit { face, point, barycentric, distance_squared: (p - point).norm_squared() })
            },
            |a, b| squareness(mesh, p, a) < squareness(mesh, p, b),
        )
    }

    /// [`Self::closest`] of a point that is likely near `hint`: the same answer, sooner.
    pub fn closest_from(&self, mesh: &TriMesh, p: &Point3<f64>, hint: FaceId, reach: f64) -> Option<FaceHit> {
        let (point, _) = closest_point(p, &mesh.triangle(hint));
        // a little farther, so that the hint itself is found too; a touching point still has some reach
        let known = (p - point).norm() * HINT_WIDTH + f64::MIN_POSITIVE.sqrt();
        self.closest(mesh, p, reach.min(known))
    }

    /// The face whose barycentre is closest to `p` (Eq 12), among those nearer than `reach` (m).
    pub fn closest_barycentre(&self, mesh: &TriMesh, p: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.search(
            p,
            reach,
            |face, _| {
                let (point, barycentric) = (mesh.barycentre(face), [1.0 / 3.0; 3]);
                Some(FaceHit { face, point, barycentric, distance_squared: (p - point).norm_squared() })
            },
            |_, _| false,
        )
    }

    /// Branch and bound over the tree. `measure` gives the hit of one face, whose point must lie in the face's box, or
    /// nothing where its squared distance is surely above a limit;
    /// `yields(a, b)` whether `a` steps back behind `b` when both are equally near.
    #[inline]
    fn search(
        &self,
        p: &Point3<f64>,
        reach: f64,
        measure: impl Fn(FaceId, f64) -> Option<FaceHit>,
        yields: impl Fn(&FaceHit, &FaceHit) -> bool,
    ) -> Option<FaceHit> {
        let q = p - self.origin;
        let tie = self.tie();
        let slack = self.slack(&q) + tie;
        let q = [q.x as f32, q.y as f32, q.z as f32];
        let mut best: Option<FaceHit> = None;
        let reach = reach.max(0.0);
        let mut limit = reach * reach;
        let mut width = tie_squared(limit, tie);
        let mut far = beyond(limit, slack);
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut depth = 0;
        let mut node = &self.root;
        loop {
            if node.count > 0 {
                for &face in self.faces_of(node) {
                    let Some(hit) = measure(face, limit + width) else { continue };
                    let nearer = match &best {
                        _ if hit.distance_squared > limit + width => false,
                        None => hit.distance_squared < limit,
                        Some(best) if hit.distance_squared < best.distance_squared - width => true,
                        Some(best) => yields(best, &hit) || (!yields(&hit, best) && hit.face < best.face),
                    };
                    // also where the other face is named, which then is no farther than this one and a tie
                    if hit.distance_squared < limit {
                        limit = hit.distance_squared;
                        width = tie_squared(limit, tie);
                        far = beyond(limit, slack);
                    }
                    if nearer {
                        best = Some(hit);
                    }
                }
            } else if let Some(pair) = self.pairs.get(node.first as usize) {
                let d = [pair.0[0].bounds.distance_squared(&q), pair.0[1].bounds.distance_squared(&q)];
                let near = usize::from(d[1] < d[0]);
                if d[1 - near] <= far {
                    stack[depth] = (d[1 - near], 2 * node.first + (1 - near) as u32);
                    depth += 1;
                }
                if d[near] <= far {
                    node = &pair.0[near];
                    continue;
                }
            }
            node = loop {
                if depth == 0 {
                    return best;
                }
                depth -= 1;
                let (distance, at) = stack[depth];
                if distance <= far {
                    break self.node(at);
                }
            };
        }
    }

    /// How much a distance between `q` and a box may be off in single precision, m: three roundings of the largest
    /// coordinate that enters it.
    fn slack(&self, q: &Vector3<f64>) -> f64 {
        let bounds = &self.root.bounds;
        let largest = (0..3).map(|i| f64::from(bounds.hi[i].max(-bounds.lo[i])).max(q[i].abs())).fold(0.0, f64::max);
        4.0 * f64::from(f32::EPSILON) * largest
    }

    /// How much the distances of faces that meet at the closest point may differ, without the part of the distance, m.
    fn tie(&self) -> f64 {
        let Aabb { lo, hi } = self.root.bounds;
        let largest = |i: usize| self.origin[i].abs() + f64::from(hi[i].max(-lo[i]));
        let diagonal = Vector3::from_fn(|i, _| f64::from(hi[i] - lo[i])).norm();
        let tie = TIE_COORDINATE * largest(0).max(largest(1)).max(largest(2)) + TIE_DIAGONAL * diagonal;
        // an empty box, or one beyond single precision, says nothing
        if tie.is_finite() { tie } else { 0.0 }
    }

    /// Finds every face whose leaf's box meets the box from `lo` to `hi` (m, in O); those of the last query are forgotten.
    pub fn faces_in_box(&self, lo: &Point3<f64>, hi: &Point3<f64>, query: &mut BoxQuery) {
        let wanted = Aabb::within(&(lo - self.origin), &(hi - self.origin));
        let BoxQuery { faces, pairs, leaves } = query;
        faces.clear();
        if self.pairs.is_empty() {
            faces.extend_from_slice(self.faces_of(&self.root));
            return;
        }
        let (mut level, mut hits) = (0..1, 0);
        pairs.clear();
        pairs.push(self.narrow_down(&wanted));
        // level by level: the boxes of one are fetched from memory at the same time
        while !level.is_empty() {
            let mut met = level.end;
            pairs.resize(pairs.len().max(met + 2 * level.len()), 0);
            leaves.resize(leaves.len().max(hits + 2 * level.len()), (0, 0));
            let (above, below) = pairs.split_at_mut(met);
            for &pair in &above[level.clone()] {
                for node in &self.pairs[pair as usize].0 {
                    // no branches: which boxes are met cannot be foretold
                    let (is_met, is_leaf) = (node.bounds.overlaps(&wanted), node.count > 0);
                    below[met - level.end] = node.first;
                    met += usize::from(is_met & !is_leaf);
                    leaves[hits] = (node.first, node.count);
                    hits += usize::from(is_met & is_leaf);
                }
            }
            level = level.end..met;
        }
        for &(first, count) in &leaves[..hits] {
            // a full leaf is copied sooner than a part of it
            let (first, count) = (first as usize, count as usize);
            faces.extend_from_slice(&self.leaf_faces[first..first + LEAF_FACES]);
            faces.truncate(faces.len() + count - LEAF_FACES);
        }
    }

    /// The pair below which all leaves that meet a box are found, from the root down as long as one side alone is met.
    fn narrow_down(&self, wanted: &Aabb) -> u32 {
        let mut at = self.root.first;
        loop {
            let [left, right] = &self.pairs[at as usize].0;
            let node = match [left, right].map(|node| node.bounds.overlaps(wanted)) {
                [true, false] => left,
                [false, true] => right,
                _ => return at,
            };
            if node.count > 0 {
                return at;
            }
            at = node.first;
        }
    }

    /// Makes the tree exact again after the corners of `faces` moved.
    pub fn refit(&mut self, mesh: &TriMesh, faces: &[FaceId]) {
        let mut plan = RefitPlan::default();
        self.plan(faces, &mut plan);
        self.refit_planned(mesh, &plan);
    }

    /// Notes which boxes depend on `faces`, for [`Self::refit_planned`]. Holds as long as no face is added or removed.
    pub fn plan(&self, faces: &[FaceId], plan: &mut RefitPlan) {
        plan.leaves.clear();
        plan.leaves.extend(faces.iter().map(|face| self.leaf_of_face[face.0 as usize]));
        plan.leaves.dedup();
        plan.leaves.sort_unstable();
        plan.leaves.dedup();
        plan.pairs.clear();
        let mut last = None;
        for &leaf in plan.leaves.iter().filter(|&&leaf| leaf != NONE) {
            // pairs are numbered subtree by subtree: one above this leaf and not after the last leaf is above both
            let (known, mut at) = (plan.pairs.len(), leaf);
            while at != NONE && last < Some(at / 2) {
                plan.pairs.push(at / 2);
                at = self.parents[at as usize / 2];
            }
            plan.pairs[known..].reverse();
            last = Some(leaf / 2);
        }
    }

    /// Makes the tree exact again after the corners of the planned faces moved.
    pub fn refit_planned(&mut self, mesh: &TriMesh, plan: &RefitPlan) {
        for &leaf in &plan.leaves {
            let mut bounds = Aabb::EMPTY;
            for &face in self.faces_of(self.node(leaf)) {
                bounds.take(mesh, face, &self.origin);
            }
            self.node_mut(leaf).bounds = bounds.rounded_outward();
        }
        for &pair in plan.pairs.iter().rev() {
            let [left, right] = &self.pairs[pair as usize].0;
            let bounds = left.bounds.union(&right.bounds);
            self.node_mut(self.parents[pair as usize]).bounds = bounds;
        }
    }

    #[inline]
    fn node(&self, at: u32) -> &Node {
        if at == NONE { &self.root } else { &self.pairs[at as usize / 2].0[at as usize % 2] }
    }

    #[inline]
    fn node_mut(&mut self, at: u32) -> &mut Node {
        if at == NONE { &mut self.root } else { &mut self.pairs[at as usize / 2].0[at as usize % 2] }
    }

    #[inline]
    fn faces_of(&self, leaf: &Node) -> &[FaceId] {
        &self.leaf_faces[leaf.first as usize..(leaf.first + leaf.count) as usize]
    }
}

/// How much squared distances about `limit` may differ where the distances may by `tie` and [`TIE_DISTANCE`].
#[inline]
fn tie_squared(limit: f64, tie: f64) -> f64 {
    let distance = limit.sqrt();
    let tie = tie + TIE_DISTANCE * distance;
    (2.0 * distance + tie) * tie
}

/// The single-precision squared distance to a box beyond which no face of it can be nearer than √`limit`, nor equally
/// near within the tie that `slack` holds; [`TIE_DISTANCE`] is far below the roundings of single precision.
#[inline]
fn beyond(limit: f64, slack: f64) -> f32 {
    let distance = limit.sqrt() + slack;
    // 8 roundings: the squares, their sum, and this conversion; the smallest normal number for where they underflow
    (distance * distance * (1.0 + 8.0 * f64::from(f32::EPSILON))) as f32 + f32::MIN_POSITIVE
}

/// Whether the plane of a triangle is farther from `p` than √`limit`: cheaper than its closest point, and decides for
/// most faces that a query meets.
#[inline]
fn is_plane_beyond(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3], limit: f64) -> bool {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let (height, size) = (normal.dot(&(p - a)), normal.norm_squared());
    // the normal of a needle is mostly rounding
    size > NEEDLE * ab.norm_squared() * ac.norm_squared() && height * height > limit * size * (1.0 + PLANE_MARGIN)
}

/// |(p − point)·n|: how squarely `p` lies above or below the face that was hit.
fn squareness(mesh: &TriMesh, p: &Point3<f64>, hit: &FaceHit) -> f64 {
    (p - hit.point).dot(&mesh.normal(hit.face)).abs()
}

/// Middle of the bounding box, m, in O.
fn middle_of(mesh: &TriMesh) -> Point3<f64> {
    let (mut lo, mut hi) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for p in mesh.positions() {
        (lo, hi) = (lo.inf(&p.coords), hi.sup(&p.coords));
    }
    if mesh.positions().is_empty() { Point3::origin() } else { Point3::from((lo + hi) / 2.0) }
}

/// The lesser of two numbers, neither of which is NaN; one instruction, unlike `f32::min`.
#[inline]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers, neither of which is NaN.
#[inline]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Sorts the items into two groups and gives the size of the first: at the middle of the longest axis, or by count
/// where that would be lopsided.
fn split(items: &mut [Item]) -> usize {
    let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter() {
        for i in 0..3 {
            lo[i] = lesser(lo[i], item.middle[i]);
            hi[i] = greater(hi[i], item.middle[i]);
        }
    }
    let extent: [f32; 3] = std::array::from_fn(|i| hi[i] - lo[i]);
    let axis = if extent[0] >= extent[1] && extent[0] >= extent[2] {
        0
    } else if extent[1] >= extent[2] {
        1
    } else {
        2
    };
    let middle = lo[axis] + extent[axis] / 2.0;
    let mut left = 0;
    for i in 0..items.len() {
        if items[i].middle[axis] < middle {
            items.swap(left, i);
            left += 1;
        }
    }
    if left.min(items.len() - left) * SMALLEST_SHARE < items.len() {
        left = items.len() / 2;
        items.select_nth_unstable_by(left, |a, b| a.middle[axis].total_cmp(&b.middle[axis]).then(a.face.cmp(&b.face)));
    }
    left
}
