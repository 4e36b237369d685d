//! Queries of the tree: closest face, closest barycentre, faces in a box.

use nalgebra::{Point3, Vector3};

use super::aabb::{Aabb, greater, lesser};
use super::{FaceTree, LEAF_FACES, STACK};
use crate::mesh::triangle::closest_point;
use crate::mesh::{FaceId, TriMesh};

/// Tolerance in roundings of the largest coordinate M for the distances of two faces that meet at
/// the closest point.
///
/// The point a + v·ab + w·ac is rounded by ε/2 · M at each sum, which makes ε M along each axis, √3
/// ε M in length. The products add ε times the longest edge, at most the diagonal D of the mesh;
/// difference to `p`, squares and their sum 5/4 ε times the distance d. For two faces the sum is
/// 2√3 ε M + 2 ε D + 5/2 ε d. The roundings of v and w move the point along the face, on which the distance is
/// stationary, except for a `p` on the surface to rounding, which has no side.
const TIE_COORDINATE: f64 = 4.0 * f64::EPSILON;
/// The same for the diagonal of the mesh, see [`TIE_COORDINATE`].
const TIE_DIAGONAL: f64 = 2.0 * f64::EPSILON;
/// The same for the distance, see [`TIE_COORDINATE`].
const TIE_DISTANCE: f64 = 3.0 * f64::EPSILON;
/// Relative rounding of the squared distance to a box: differences, squares and sums, 4 ε; 8 ε for
/// safety.
const BOX_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The closest face to a query point, and its closest point or barycentre.
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

/// Results of [`FaceTree::faces_in_box`], with the buffers of the search.
#[derive(Clone, Debug, Default)]
pub struct BoxQuery {
    /// in no particular order
    pub faces: Vec<FaceId>,
    /// pairs that overlap the box, in order
    pairs: Vec<u32>,
    /// place and number of faces of the leaves that overlap the box
    leaves: Vec<(u32, u32)>,
}

impl BoxQuery {
    /// A query with room for `faces` faces.
    pub fn with_room(faces: usize) -> Self {
        let (pairs, leaves) = (vec![0; faces + STACK], vec![(0, 0); faces + STACK]);
        Self {
            faces: Vec::with_capacity(faces + LEAF_FACES),
            pairs,
            leaves,
        }
    }
}

/// State of a search: the best hit, and the remaining reach.
pub(super) struct SearchState {
    pub best: Option<FaceHit>,
    /// the point, relative to the tree's origin
    pub q: [f32; 3],
    /// squared distance beyond which no box can hold a better hit
    pub far: f32,
    /// least squared distance up to now, m²
    limit: f64,
    /// tolerance of squared distances about `limit` for one point, m²
    width: f64,
    tie: f64,
    slack: f64,
}

impl SearchState {
    #[inline]
    pub(crate) fn new(tree: &FaceTree, p: &Point3<f64>, reach: f64) -> Self {
        let (q, tie, reach) = (p - tree.origin, tree.tie(), reach.max(0.0));
        let slack = tree.slack(&q) + tie;
        let q = [q.x as f32, q.y as f32, q.z as f32];
        let mut found = Self {
            best: None,
            q,
            far: 0.0,
            limit: 0.0,
            width: 0.0,
            tie,
            slack,
        };
        found.shorten(reach * reach);
        found
    }

    #[inline]
    fn shorten(&mut self, limit: f64) {
        self.limit = limit;
        self.width = tie_squared(limit, self.tie);
        self.far = beyond(limit, self.slack);
    }

    /// Updates the best hit by the faces of a leaf; see [`FaceTree::search`].
    #[inline]
    pub(crate) fn take(
        &mut self,
        faces: &[FaceId],
        measure: impl Fn(FaceId, f64) -> Option<FaceHit>,
        yields: impl Fn(&FaceHit, &FaceHit) -> bool,
    ) {
        for &face in faces {
            let (limit, width) = (self.limit, self.width);
            let Some(hit) = measure(face, limit + width) else {
                continue;
            };
            let nearer = match &self.best {
                _ if hit.distance_squared > limit + width => false,
                None => hit.distance_squared < limit,
                Some(best) if hit.distance_squared < best.distance_squared - width => true,
                Some(best) => yields(best, &hit) || (!yields(&hit, best) && hit.face < best.face),
            };
            // also if the other face wins, which then is no farther than this one and a tie
            if hit.distance_squared < limit {
                self.shorten(hit.distance_squared);
            }
            if nearer {
                self.best = Some(hit);
            }
        }
    }
}

impl FaceTree {
    /// The face with the surface closest to `p` among those nearer than `reach` (m), if any.
    ///
    /// If faces meet at the closest point (an edge or a corner), the result is the one most
    /// squarely above or below `p`, which makes the sign of (p − point)·n distinguish inside from
    /// outside; among equals the smallest id.
    pub fn closest(&self, mesh: &TriMesh, p: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.search(
            p,
            reach,
            |face, limit| surface_hit(mesh, p, face, limit),
            |a, b| is_less_square(mesh, p, a, b),
        )
    }

    /// The face with the barycentre closest to `p` (Eq 12), among those nearer than `reach` (m).
    pub fn closest_barycentre(
        &self,
        mesh: &TriMesh,
        p: &Point3<f64>,
        reach: f64,
    ) -> Option<FaceHit> {
        self.search(
            p,
            reach,
            |face, _| {
                let (point, barycentric) = (mesh.barycentre(face), [1.0 / 3.0; 3]);
                Some(FaceHit {
                    face,
                    point,
                    barycentric,
                    distance_squared: (p - point).norm_squared(),
                })
            },
            |_, _| false,
        )
    }

    /// Branch and bound over the tree. `measure` returns the hit of one face, with its point in the
    /// face's box, or `None` if its squared distance is surely above a limit; `yields(a, b)`
    /// whether `a` steps back behind `b` if both are equally near.
    #[inline]
    fn search(
        &self,
        p: &Point3<f64>,
        reach: f64,
        measure: impl Fn(FaceId, f64) -> Option<FaceHit>,
        yields: impl Fn(&FaceHit, &FaceHit) -> bool,
    ) -> Option<FaceHit> {
        let mut found = SearchState::new(self, p, reach);
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut depth = 0;
        let mut node = &self.root;
        loop {
            if node.is_leaf() {
                found.take(self.faces_of(node), &measure, &yields);
            } else {
                let pair = &self.pairs[node.first as usize];
                let d = [&pair.0[0], &pair.0[1]].map(|node| node.bounds.distance_squared(&found.q));
                let near = usize::from(d[1] < d[0]);
                if d[1 - near] <= found.far {
                    stack[depth] = (d[1 - near], 2 * node.first + (1 - near) as u32);
                    depth += 1;
                }
                if d[near] <= found.far {
                    node = &pair.0[near];
                    continue;
                }
            }
            node = loop {
                if depth == 0 {
                    return found.best;
                }
                depth -= 1;
                let (distance, at) = stack[depth];
                if distance <= found.far {
                    break self.node(at);
                }
            };
        }
    }

    /// Error bound of a single-precision distance between `q` and a box, m: three roundings of the
    /// largest coordinate in it.
    fn slack(&self, q: &Vector3<f64>) -> f64 {
        let bounds = &self.root.bounds;
        let largest = (0..3)
            .map(|i| f64::from(bounds.hi[i].max(-bounds.lo[i])).max(q[i].abs()))
            .fold(0.0, f64::max);
        4.0 * f64::from(f32::EPSILON) * largest
    }

    /// Tolerance for the distances of faces that meet at the closest point, without the part of the
    /// distance, m.
    fn tie(&self) -> f64 {
        let Aabb { lo, hi } = self.root.bounds;
        let largest = |i: usize| self.origin[i].abs() + f64::from(hi[i].max(-lo[i]));
        let diagonal = Vector3::from_fn(|i, _| f64::from(hi[i] - lo[i])).norm();
        let tie =
            TIE_COORDINATE * largest(0).max(largest(1)).max(largest(2)) + TIE_DIAGONAL * diagonal;
        // an empty box, or one beyond single precision, gives no tolerance
        if tie.is_finite() { tie } else { 0.0 }
    }

    /// Finds every face in a leaf whose box overlaps the box from `lo` to `hi` (m, in O); replaces
    /// the results of the last query.
    pub fn faces_in_box(&self, lo: &Point3<f64>, hi: &Point3<f64>, query: &mut BoxQuery) {
        let wanted = Aabb::within(&(lo - self.origin), &(hi - self.origin));
        let BoxQuery {
            faces,
            pairs,
            leaves,
        } = query;
        faces.clear();
        if self.root.is_leaf() {
            faces.extend_from_slice(self.faces_of(&self.root));
            return;
        }
        let (mut level, mut hits) = (0..1, 0);
        pairs.clear();
        pairs.push(self.narrow_down(&wanted));
        // level by level, so the memory accesses for its boxes overlap
        while !level.is_empty() {
            let mut met = level.end;
            pairs.resize(pairs.len().max(met + 2 * level.len()), 0);
            leaves.resize(leaves.len().max(hits + 2 * level.len()), (0, 0));
            let (above, below) = pairs.split_at_mut(met);
            for &pair in &above[level.clone()] {
                for node in &self.pairs[pair as usize].0 {
                    // no branches: which boxes overlap is unpredictable
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
            // copying a full leaf is faster than a part of it
            faces.extend_from_slice(&self.leaf_faces[first as usize]);
            faces.truncate(faces.len() + count as usize - LEAF_FACES);
        }
    }

    /// The lowest pair above all leaves that overlap a box: goes down as long as one side alone
    /// overlaps.
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

/// Tolerance of squared distances about `limit`, for tolerances `tie` and [`TIE_DISTANCE`] of the
/// distances.
#[inline]
fn tie_squared(limit: f64, tie: f64) -> f64 {
    let distance = limit.sqrt();
    let tie = tie + TIE_DISTANCE * distance;
    (2.0 * distance + tie) * tie
}

/// The single-precision squared distance to a box beyond which no face of it can be nearer than
/// √`limit`, nor equally near within the tie contained in `slack`; [`TIE_DISTANCE`] is far below
/// the roundings of single precision.
#[inline]
fn beyond(limit: f64, slack: f64) -> f32 {
    let distance = limit.sqrt() + slack;
    // 8 roundings: the squares, their sum, and this conversion; the smallest normal number covers
    // their underflow
    (distance * distance * (1.0 + 8.0 * f64::from(f32::EPSILON))) as f32 + f32::MIN_POSITIVE
}

/// Whether the box around a triangle is farther from `p` than √`limit`: cheaper than its closest
/// point, and decisive for most faces of a query.
#[inline]
fn is_box_beyond(p: &Point3<f64>, [a, b, c]: [&Point3<f64>; 3], limit: f64) -> bool {
    let outside = |i: usize| {
        let (x, y, z) = (a[i] - p[i], b[i] - p[i], c[i] - p[i]);
        let (lo, hi) = (lesser(lesser(x, y), z), greater(greater(x, y), z));
        greater(greater(lo, -hi), 0.0)
    };
    let [x, y, z] = [0, 1, 2].map(outside);
    x * x + y * y + z * z > limit * (1.0 + BOX_ROUNDING)
}

/// The point of a face closest to `p`; `None` if its squared distance is surely above a limit.
#[inline]
pub(super) fn surface_hit(
    mesh: &TriMesh,
    p: &Point3<f64>,
    face: FaceId,
    limit: f64,
) -> Option<FaceHit> {
    if is_box_beyond(
        p,
        mesh.corners(face)
            .map(|vertex| &mesh.positions()[vertex.0 as usize]),
        limit,
    ) {
        return None;
    }
    let triangle = mesh.triangle(face);
    let (point, barycentric) = closest_point(p, &triangle);
    Some(FaceHit {
        face,
        point,
        barycentric,
        distance_squared: (p - point).norm_squared(),
    })
}

/// Whether `p` lies less squarely above or below the first hit face than the second.
pub(super) fn is_less_square(mesh: &TriMesh, p: &Point3<f64>, a: &FaceHit, b: &FaceHit) -> bool {
    let squareness = |hit: &FaceHit| (p - hit.point).dot(&mesh.normal(hit.face)).abs();
    squareness(a) < squareness(b)
}
