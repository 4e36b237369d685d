//! Triangles for the zero level of a field: one vertex per cell, evened out afterwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::field::{Field, cells};

/// Rounds of flipping, evening out and going back to the level.
const ROUNDS: usize = 12;
/// How far a vertex goes towards the middle of its neighbours in one round.
const EVEN: f64 = 0.5;
/// A vertex may not tilt a face more than this (cosine) against the level's normal.
const UPRIGHT: f64 = 0.3;
/// Cosine between a face and the gradient below which it counts as folded over.
const FOLDED: f64 = 0.3;
/// Steps back to the level in one round.
const RETURN_STEPS: usize = 3;

/// A triangle mesh while it is being shaped.
#[derive(Clone, Debug, Default)]
pub(super) struct Soup {
    /// m, in V
    pub(super) positions: Vec<Point3<f64>>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// The zero level of `field` by surface nets with cells of `side` (m): every cell that the level passes gets a vertex,
/// every lattice edge that crosses it two triangles [Gibson 1998].
pub(super) fn contour(field: &Field, side: f64) -> Soup {
    let count = field.nodes.map(|n| ((n - 1) as f64 * field.pitch / side).floor() as usize);
    let corner = |c: [usize; 3]| field.origin + Vector3::from(c.map(|i| i as f64)) * side;
    let corners = count.map(|n| n + 1);
    let index = |[i, j, k]: [usize; 3]| (k * corners[1] + j) * corners[0] + i;
    let values: Vec<f64> = cells(corners).map(|c| field.at(&corner(c))).collect();
    let inside = |c: [usize; 3]| values[index(c)] < 0.0;
    let mut soup = Soup::default();
    let mut vertex = vec![u32::MAX; values.len()];
    for cell in cells(count) {
        let corner_of = |k: usize| [cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)];
        let full = (0..8).filter(|&k| inside(corner_of(k))).count();
        if full != 0 && full != 8 {
            vertex[index(cell)] = soup.positions.len() as u32;
            soup.positions.push(corner(cell) + Vector3::repeat(side / 2.0));
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
            let [p, q, r, s] = if inside(c) { around } else { [around[3], around[2], around[1], around[0]] };
            soup.faces.extend([[p, q, r], [p, r, s]]);
        }
    }
    soup
}

/// The point moved along the gradient to the field's zero level, at most half a cell at a time.
fn on_level(field: &Field, mut p: Point3<f64>, side: f64) -> Point3<f64> {
    for _ in 0..RETURN_STEPS {
        let gradient = field.gradient(&p);
        // a flat field (cut off far from the surface) gives no direction
        let step = gradient * (field.at(&p) / gradient.norm_squared().max(0.1));
        p -= step.cap_magnitude(side / 2.0);
    }
    p
}

impl Soup {
    /// Turns the lattice's triangles into nearly equilateral ones with all vertices on the field's zero level.
    pub(super) fn even_out_mut(&mut self, field: &Field, side: f64) {
        for round in 0..=ROUNDS {
            let stars = self.stars();
            for (v, star) in stars.iter().enumerate() {
                // the first round only goes to the level
                let even = if round == 0 { 0.0 } else { EVEN };
                self.settle_mut(v as u32, star, field, side, even);
            }
            self.flip_mut();
        }
    }

    /// Moves a vertex towards the middle of its neighbours along the level, and onto it; not if a face would turn over.
    fn settle_mut(&mut self, vertex: u32, star: &[usize], field: &Field, side: f64, even: f64) {
        let old = self.positions[vertex as usize];
        let corners = star.iter().flat_map(|&face| self.faces[face]).filter(|&v| v != vertex);
        let sum: Vector3<f64> = corners.map(|v| self.positions[v as usize] - old).sum();
        // inside the mesh every neighbour is counted twice
        let shift = sum * (even / (2 * star.len()).max(1) as f64);
        let normal = field.gradient(&old).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let before = self.uprightness(star, &normal);
        let new = on_level(field, old + shift - normal * normal.dot(&shift), side);
        self.positions[vertex as usize] = new;
        let normal = field.gradient(&new).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
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

    /// Flips every edge whose opposite angles sum to more than half a turn, if neither side turns over; each face takes
    /// part once.
    fn flip_mut(&mut self) {
        let edges = self.edges();
        let mut touched = vec![false; self.faces.len()];
        let mut fresh = BTreeSet::new();
        for (&(a, b), left) in edges.iter().filter(|((a, b), _)| a < b) {
            let ([f], Some([g])) = (&left[..], edges.get(&(b, a)).map(|g| &g[..])) else { continue };
            let apex = |face: usize| self.faces[face].into_iter().find(|v| *v != a && *v != b);
            let (Some(c), Some(d)) = (apex(*f), apex(*g)) else { continue };
            let exists =
                edges.contains_key(&(c, d)) || edges.contains_key(&(d, c)) || fresh.contains(&(c.min(d), c.max(d)));
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
        angle(c) + angle(d) > std::f64::consts::PI + 1e-6 && upright([c, d, b]) && upright([d, c, a])
    }

    /// Keeps the faces that are seen, with unseen patches of fewer than `fewest` faces between them, and without seen
    /// patches as small; pieces as small go in any case.
    pub(super) fn retain_mut(&mut self, fewest: usize, is_seen: impl Fn(&[Point3<f64>; 3]) -> bool) {
        let seen: Vec<bool> = self.faces.iter().map(|f| is_seen(&f.map(|v| self.positions[v as usize]))).collect();
        let pieces = self.patch_sizes(&vec![true; seen.len()]);
        let patches = self.patch_sizes(&seen);
        let kept = |face: usize| pieces[face] >= fewest && seen[face] != (patches[face] < fewest);
        let mut kept = (0..seen.len()).map(kept);
        self.faces.retain(|_| kept.next().unwrap_or(false));
    }

    /// For each face, how many faces its patch has: those connected to it over edges that are marked alike.
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
    pub(super) fn drop_folds_mut(&mut self, field: &Field) {
        let upright = |face: &[u32; 3]| {
            let middle = face.iter().map(|&v| self.positions[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
            let (normal, gradient) = (self.normal(*face), field.gradient(&middle.into()));
            normal.dot(&gradient) > FOLDED * normal.norm() * gradient.norm()
        };
        let kept: Vec<bool> = self.faces.iter().map(upright).collect();
        let mut kept = kept.into_iter();
        self.faces.retain(|_| kept.next().unwrap_or(false));
    }

    /// Drops, until none is left: faces at edges that more than two share, faces that hang on by one edge or less, and
    /// all faces around vertices where two rims meet.
    pub(super) fn tidy_mut(&mut self) {
        loop {
            let edges = self.edges();
            let open = |a: u32, b: u32| !edges.contains_key(&(b, a));
            let mut rims = vec![0; self.positions.len()];
            edges.keys().filter(|(a, b)| open(*a, *b)).for_each(|(a, _)| rims[*a as usize] += 1);
            let before = self.faces.len();
            self.faces.retain(|&[a, b, c]| {
                let sides = [(a, b), (b, c), (c, a)];
                let loose = sides.iter().filter(|(a, b)| open(*a, *b)).count() > 1;
                let crowded = sides.iter().any(|side| edges[side].len() > 1);
                !loose && !crowded && [a, b, c].iter().all(|&v| rims[v as usize] < 2)
            });
            if self.faces.len() == before {
                return;
            }
        }
    }

    /// Drops vertices that no face uses.
    pub(super) fn drop_unused_mut(&mut self) {
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
