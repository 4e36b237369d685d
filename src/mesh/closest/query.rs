//! Queries of the tree: closest face, closest barycentre, faces in a box.

use nalgebra::{Point3, Vector3};

use super::aabb::Aabb;
use super::{FaceTree, LEAF_FACES, STACK};
use crate::mesh::triangle::closest_point;
use crate::mesh::{FaceId, TriMesh};

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
/// By how much the triple product (ab × ac)·ap is rounded, as a share of |ab| |ac| |ap|: 2 ε for each component of the
/// cross product and 3 ε for the sum, √3 of it in length; 16 ε to be sure.
const HEIGHT_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// What the quotient of two squares may lose beside that.
const PLANE_MARGIN: f64 = 1e-6;
/// Squared sine of the least angle at which a normal is trusted: 0.06°.
const NEEDLE: f64 = 1e-6;
/// The reach of a query with a hint over the distance to the hinted face.
const HINT_WIDTH: f64 = 1.0 + 1e-6;

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

/// The faces found by [`FaceTree::faces_in_box`], with the buffers of the search.
#[derive(Clone, Debug, Default)]
pub struct BoxQuery {
    /// in no particular order
    pub faces: Vec<FaceId>,
    /// pairs met, in order
    pairs: Vec<u32>,
    /// place and number of faces of the leaves met
    leaves: Vec<(u32, u32)>,
}

impl BoxQuery {
    /// A query with room for so many faces.
    pub fn with_room(faces: usize) -> Self {
        let (pairs, leaves) = (vec![0; faces + STACK], vec![(0, 0); faces + STACK]);
        Self { faces: Vec::with_capacity(faces + LEAF_FACES), pairs, leaves }
    }
}

impl FaceTree {
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
            if node.is_leaf() {
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
            } else {
                let pair = &self.pairs[node.first as usize];
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
        if self.root.is_leaf() {
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
                    let (is_met, is_leaf) = (node.bounds.overlaps(&wanted), node.is_leaf());
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
            faces.extend_from_slice(&self.leaf_faces[first as usize]);
            faces.truncate(faces.len() + count as usize - LEAF_FACES);
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
            if node.is_leaf() {
                return at;
            }
            at = node.first;
        }
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
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(&ac);
    let (height, size) = (normal.dot(&ap), normal.norm_squared());
    let sides = ab.norm_squared() * ac.norm_squared();
    // (√l + e)² ≤ l (1 + m) + e² (1 + 1/m)
    let rounding = HEIGHT_ROUNDING * HEIGHT_ROUNDING * sides * ap.norm_squared() * (1.0 + 1.0 / PLANE_MARGIN);
    // the normal of a needle is mostly rounding
    size > NEEDLE * sides && height * height > limit * size * (1.0 + PLANE_MARGIN) + rounding
}

/// |(p − point)·n|: how squarely `p` lies above or below the face that was hit.
fn squareness(mesh: &TriMesh, p: &Point3<f64>, hit: &FaceHit) -> f64 {
    (p - hit.point).dot(&mesh.normal(hit.face)).abs()
}
