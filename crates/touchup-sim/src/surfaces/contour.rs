//! Triangles for the zero level of a field: one vertex per cell, relaxed afterwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::field::{GridField, cells};
use touchup_geometry::mesh::triangle::intersect;
use touchup_geometry::mesh::{BoxQuery, FaceId, FaceTree, MeshError, TriMesh};

/// Rounds of flipping, relaxing and returning to the level.
const ROUNDS: usize = 12;
/// Relaxation: share of the step towards the middle of its neighbours in one round.
const EVEN: f64 = 0.5;
/// Minimum cosine between a face and the level's normal after a vertex moves.
const UPRIGHT: f64 = 0.3;
/// Cosine between a face and the gradient below which it counts as folded over.
const FOLDED: f64 = 0.05;
/// Steps back to the level in one round.
const RETURN_STEPS: usize = 3;

/// A triangle mesh in the making.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshDraft {
    /// m, in V
    pub(crate) positions: Vec<Point3<f64>>,
    pub(crate) faces: Vec<[u32; 3]>,
}

/// The zero level of `field` by surface nets with cells of `side` (m): every cell that the level
/// passes gets a vertex, every lattice edge that crosses it two triangles [Gibson 1998].
pub(crate) fn contour(field: &GridField, side: f64) -> MeshDraft {
    let count = field
        .nodes
        .map(|n| ((n - 1) as f64 * field.pitch / side).floor() as usize);
    let corner = |c: [usize; 3]| field.origin + Vector3::from(c.map(|i| i as f64)) * side;
    let corners = count.map(|n| n + 1);
    let index = |[i, j, k]: [usize; 3]| (k * corners[1] + j) * corners[0] + i;
    let values: Vec<f64> = cells(corners).map(|c| field.at(&corner(c))).collect();
    let inside = |c: [usize; 3]| values[index(c)] < 0.0;
    let mut soup = MeshDraft::default();
    let mut vertex = vec![u32::MAX; values.len()];
    for cell in cells(count) {
        let corner_of = |k: usize| {
            [
                cell[0] + (k & 1),
                cell[1] + (k >> 1 & 1),
                cell[2] + (k >> 2),
            ]
        };
        // crossings of the level with the cell's twelve edges
        let edges = (0..8)
            .flat_map(|k| [1, 2, 4].map(|bit| (k, k | bit)))
            .filter(|(k, l)| k != l);
        let crossing = |(k, l): (usize, usize)| {
            let (c, d) = (corner_of(k), corner_of(l));
            let (u, v) = (values[index(c)], values[index(d)]);
            (inside(c) != inside(d)).then(|| corner(c) + (corner(d) - corner(c)) * (u / (u - v)))
        };
        let crossings: Vec<_> = edges.filter_map(crossing).collect();
        if !crossings.is_empty() {
            vertex[index(cell)] = soup.positions.len() as u32;
            let sum: Vector3<f64> = crossings.iter().map(|p| p.coords).sum();
            soup.positions.push((sum / crossings.len() as f64).into());
        }
    }
    for c in cells(count) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut next = c;
            next[axis] += 1;
            if c[u] == 0 || c[v] == 0 || inside(c) == inside(next) {
                continue;
            }
            // the four cells around this lattice edge, counter-clockwise seen along −axis
            let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(du, dv)| {
                let mut cell = c;
                (cell[u], cell[v]) = (c[u] - du, c[v] - dv);
                vertex[index(cell)]
            });
            let [p, q, r, s] = if inside(c) {
                around
            } else {
                [around[3], around[2], around[1], around[0]]
            };
            soup.faces.extend([[p, q, r], [p, r, s]]);
        }
    }
    soup
}

/// The point moved along the gradient to the field's zero level, at most half a cell at a time.
fn on_level(field: &GridField, mut p: Point3<f64>, side: f64) -> Point3<f64> {
    for _ in 0..RETURN_STEPS {
        let gradient = field.gradient(&p);
        // a flat field (clamped far from the surface) gives no direction
        let step = gradient * (field.at(&p) / gradient.norm_squared().max(0.1));
        p -= step.cap_magnitude(side / 2.0);
    }
    p
}

impl MeshDraft {
    /// Turns the lattice's triangles into nearly equilateral ones with all vertices on the field's
    /// zero level.
    pub(crate) fn even_out_mut(&mut self, field: &GridField, side: f64) {
        for _ in 0..ROUNDS {
            let stars = self.stars();
            for (v, star) in stars.iter().enumerate() {
                self.relax_mut(v as u32, star, field, side);
            }
            self.flip_mut();
        }
    }

    /// Moves a vertex onto the level, and along it towards the middle of its neighbours if no face
    /// turns over.
    fn relax_mut(&mut self, vertex: u32, star: &[usize], field: &GridField, side: f64) {
        let old = on_level(field, self.positions[vertex as usize], side);
        self.positions[vertex as usize] = old;
        let corners = star
            .iter()
            .flat_map(|&face| self.faces[face])
            .filter(|&v| v != vertex);
        let sum: Vector3<f64> = corners.map(|v| self.positions[v as usize] - old).sum();
        // inside the mesh every neighbour counts twice
        let shift = sum * (EVEN / (2 * star.len()).max(1) as f64);
        let normal = field
            .gradient(&old)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros);
        let before = self.uprightness(star, &normal);
        let new = on_level(field, old + shift - normal * normal.dot(&shift), side);
        self.positions[vertex as usize] = new;
        let normal = field
            .gradient(&new)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros);
        if self.uprightness(star, &normal) < before.min(UPRIGHT) {
            self.positions[vertex as usize] = old;
        }
    }

    /// Smallest cosine between the normals of some faces and a direction.
    fn uprightness(&self, faces: &[usize], direction: &Vector3<f64>) -> f64 {
        let cosine = |&face: &usize| {
            let normal = self.normal(self.faces[face]);
            normal.dot(direction) / normal.norm().max(f64::MIN_POSITIVE)
        };
        faces.iter().map(cosine).fold(f64::MAX, f64::min)
    }

    /// Faces around each vertex.
    fn stars(&self) -> Vec<Vec<usize>> {
        let mut stars = vec![Vec::new(); self.positions.len()];
        for (face, corners) in self.faces.iter().enumerate() {
            corners.iter().for_each(|&v| stars[v as usize].push(face));
        }
        stars
    }

    /// Faces at each directed edge.
    fn edges(&self) -> BTreeMap<(u32, u32), Vec<usize>> {
        let mut edges: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (face, c) in self.faces.iter().enumerate() {
            (0..3).for_each(|i| edges.entry((c[i], c[(i + 1) % 3])).or_default().push(face));
        }
        edges
    }

    fn normal(&self, [a, b, c]: [u32; 3]) -> Vector3<f64> {
        let at = |v: u32| self.positions[v as usize];
        (at(b) - at(a)).cross(&(at(c) - at(a)))
    }

    /// Flips every edge whose opposite angles sum to more than half a turn, if neither side turns
    /// over; each face takes part once.
    fn flip_mut(&mut self) {
        let edges = self.edges();
        let mut touched = vec![false; self.faces.len()];
        let mut fresh = BTreeSet::new();
        for (&(a, b), left) in edges.iter().filter(|((a, b), _)| a < b) {
            let ([f], Some([g])) = (&left[..], edges.get(&(b, a)).map(|g| &g[..])) else {
                continue;
            };
            let apex = |face: usize| self.faces[face].into_iter().find(|v| *v != a && *v != b);
            let (Some(c), Some(d)) = (apex(*f), apex(*g)) else {
                continue;
            };
            let exists = edges.contains_key(&(c, d))
                || edges.contains_key(&(d, c))
                || fresh.contains(&(c.min(d), c.max(d)));
            if touched[*f] || touched[*g] || exists || c == d || !self.flip_helps([a, b, c, d]) {
                continue;
            }
            fresh.insert((c.min(d), c.max(d)));
            (touched[*f], touched[*g]) = (true, true);
            (self.faces[*f], self.faces[*g]) = ([c, d, b], [d, c, a]);
        }
    }

    fn flip_helps(&self, [a, b, c, d]: [u32; 4]) -> bool {
        let at = |v: u32| self.positions[v as usize];
        let angle = |apex: u32| (at(a) - at(apex)).angle(&(at(b) - at(apex)));
        let old = self.normal([a, b, c]) + self.normal([b, a, d]);
        let upright = |face: [u32; 3]| {
            let normal = self.normal(face);
            normal.dot(&old) > 0.7 * normal.norm() * old.norm()
        };
        angle(c) + angle(d) > std::f64::consts::PI + 1e-6
            && upright([c, d, b])
            && upright([d, c, a])
    }

    /// Keeps the visible faces and the invisible patches of fewer than `fewest` faces between them,
    /// without equally small visible patches; equally small pieces always go.
    pub(crate) fn retain_mut(
        &mut self,
        fewest: usize,
        is_seen: impl Fn(&[Point3<f64>; 3]) -> bool,
    ) {
        let seen: Vec<bool> = self
            .faces
            .iter()
            .map(|f| is_seen(&f.map(|v| self.positions[v as usize])))
            .collect();
        let pieces = self.patch_sizes(&vec![true; seen.len()]);
        let patches = self.patch_sizes(&seen);
        let kept = |face: usize| pieces[face] >= fewest && seen[face] != (patches[face] < fewest);
        self.keep_mut((0..seen.len()).map(kept));
    }

    /// Keeps the faces with a true `kept`, in order.
    fn keep_mut(&mut self, kept: impl IntoIterator<Item = bool>) {
        let mut kept = kept.into_iter();
        self.faces.retain(|_| kept.next().unwrap_or(false));
    }

    /// Size of each face's patch in faces: the faces connected to it over edges with the same mark.
    fn patch_sizes(&self, marked: &[bool]) -> Vec<usize> {
        let edges = self.edges();
        let mut patch = vec![usize::MAX; self.faces.len()];
        let mut sizes = Vec::new();
        for seed in 0..self.faces.len() {
            let (mut open, mut size) = (vec![seed], 0);
            while let Some(face) = open.pop() {
                if patch[face] == usize::MAX && marked[face] == marked[seed] {
                    patch[face] = sizes.len();
                    size += 1;
                    let [a, b, c] = self.faces[face];
                    let beyond = [(b, a), (c, b), (a, c)];
                    open.extend(beyond.iter().filter_map(|side| edges.get(side)).flatten());
                }
            }
            sizes.push(size);
        }
        patch.into_iter().map(|p| sizes[p]).collect()
    }

    /// Drops faces that turn their back on the field's gradient: folds.
    pub(crate) fn drop_folds_mut(&mut self, field: &GridField) {
        let upright = |face: &[u32; 3]| {
            let middle = face
                .iter()
                .map(|&v| self.positions[v as usize].coords)
                .sum::<Vector3<f64>>()
                / 3.0;
            let (normal, gradient) = (self.normal(*face), field.gradient(&middle.into()));
            normal.dot(&gradient) > FOLDED * normal.norm() * gradient.norm()
        };
        let kept: Vec<bool> = self.faces.iter().map(upright).collect();
        self.keep_mut(kept);
    }

    /// Drops faces that cross others.
    ///
    /// # Errors
    /// As [`TriMesh::new`].
    pub(crate) fn drop_crossings_mut(&mut self) -> Result<(), MeshError> {
        let mesh = TriMesh::new(self.positions.clone(), self.faces.clone())?;
        let tree = FaceTree::new(&mesh);
        let mut near = BoxQuery::default();
        let mut kept = vec![true; self.faces.len()];
        for (face, corners) in mesh.faces() {
            let triangle @ [a, b, c] = mesh.triangle(face);
            tree.faces_in_box(&a.inf(&b).inf(&c), &a.sup(&b).sup(&c), &mut near);
            let apart =
                |other: &&FaceId| mesh.corners(**other).iter().all(|v| !corners.contains(v));
            for other in near.faces.iter().filter(apart) {
                if intersect(&triangle, &mesh.triangle(*other), 0.0) {
                    kept[face.0 as usize] = false;
                    kept[other.0 as usize] = false;
                }
            }
        }
        self.keep_mut(kept);
        Ok(())
    }

    /// Drops repeatedly: faces at edges of more than two faces, faces that hang on by one edge or
    /// less, and all faces around vertices at which the mesh meets only in a point.
    pub(crate) fn tidy_mut(&mut self) {
        loop {
            let edges = self.edges();
            let open = |a: u32, b: u32| !edges.contains_key(&(b, a));
            let pinched: Vec<bool> = self
                .stars()
                .iter()
                .enumerate()
                .map(|(v, star)| self.is_pinched(v as u32, star))
                .collect();
            let before = self.faces.len();
            self.faces.retain(|&[a, b, c]| {
                let sides = [(a, b), (b, c), (c, a)];
                let loose = sides.iter().filter(|(a, b)| open(*a, *b)).count() > 1;
                let crowded = sides.iter().any(|side| edges[side].len() > 1);
                !loose && !crowded && ![a, b, c].iter().any(|&v| pinched[v as usize])
            });
            if self.faces.len() == before {
                return;
            }
        }
    }

    /// Whether the faces around a vertex are more than one fan.
    fn is_pinched(&self, vertex: u32, star: &[usize]) -> bool {
        let side = |&face: &usize| {
            let corners = self.faces[face];
            let i = corners.iter().position(|v| *v == vertex).unwrap_or(0);
            (corners[(i + 1) % 3], corners[(i + 2) % 3])
        };
        let next: BTreeMap<u32, u32> = star.iter().map(side).collect();
        let first = next
            .keys()
            .find(|v| !next.values().any(|w| w == *v))
            .or(next.keys().next());
        let Some(&start) = first else { return false };
        let fan = std::iter::successors(next.get(&start), |at| {
            next.get(*at).filter(|_| **at != start)
        });
        fan.take(star.len()).count() < star.len()
    }

    /// Closes rims of at most `longest` edges with a fan around a new vertex in their middle; the
    /// mesh must be tidy: at most one rim goes through a vertex.
    pub(crate) fn fill_mut(&mut self, longest: usize) {
        let edges = self.edges();
        let open = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a)));
        // against the faces' sense, as the filling must go
        let mut next: BTreeMap<u32, u32> = open.map(|&(a, b)| (b, a)).collect();
        while let Some((start, mut at)) = next.pop_first() {
            let mut rim = vec![start];
            while at != start {
                rim.push(at);
                let Some(after) = next.remove(&at) else { break };
                at = after;
            }
            if at == start && rim.len() <= longest {
                let sum: Vector3<f64> =
                    rim.iter().map(|&v| self.positions[v as usize].coords).sum();
                let middle = self.positions.len() as u32;
                self.positions.push((sum / rim.len() as f64).into());
                self.faces
                    .extend((0..rim.len()).map(|i| [rim[i], rim[(i + 1) % rim.len()], middle]));
            }
        }
    }

    /// Drops unused vertices.
    pub(crate) fn drop_unused_mut(&mut self) {
        let mut renamed = vec![u32::MAX; self.positions.len()];
        let mut kept = Vec::new();
        for vertex in self.faces.as_flattened_mut() {
            let old = *vertex as usize;
            if renamed[old] == u32::MAX {
                renamed[old] = kept.len() as u32;
                kept.push(self.positions[old]);
            }
            *vertex = renamed[old];
        }
        self.positions = kept;
    }
}
