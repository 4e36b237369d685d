//! How the scanner errs, found from scan and touch themselves.

use nalgebra::{Point3, Vector3};

use super::places::Places;
use crate::compare::IndexedMesh;
use crate::mesh::TriMesh;
use crate::numeric::{PointGrid, SIGMA_OF_MEDIAN, median};

/// How the scanner errs where it should see well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scanner {
    /// median of touch − scan, m: negative where the scan lies outside of the part
    pub offset: f64,
    /// standard deviation about it, robustly, m
    pub noise: f64,
    /// correlation length ℓ of the noise, m
    pub correlation: f64,
    /// median edge of the scan's triangles, m
    pub edge: f64,
    /// what is narrower may be closed over, m
    pub sees_from: f64,
    /// on so many places
    pub places: usize,
}

/// The median of a squared normal number of variance 1.
const MEDIAN_OF_SQUARE: f64 = 0.4549;
/// What is so many edges of the scan's triangles wide is seen: a facet on each wall, one on the floor, and one in between.
const NARROW: f64 = 5.0;
/// Edges are rounded within so many edges of the triangles.
const ROUNDED: f64 = 1.5;
/// An edge is one of the surface that a place lies on when it is within so many edges of its tangent plane.
const LEVEL: f64 = 0.2;
/// An edge of the refined mesh turns by more than this, as a cosine: 35°.
const SHARP: f64 = 0.82;
/// A ball of the least seen width touches nothing but its contact point within this share of its radius.
const FITS: f64 = 0.85;
/// Places from which the scanner can be characterised.
const FEWEST: usize = 200;
/// Places whose pairs are examined.
const MOST_PLACES: usize = 1_500;
/// Distances up to so many edges of the triangles, in so many bins.
const LONGEST: f64 = 8.0;
const BINS: usize = 32;
/// Pairs that fill a bin.
const FULL: usize = 50;
/// Where half the mean square difference has grown to 1 − 1/e of the variance, in ℓ.
const GROWN: f64 = std::f64::consts::SQRT_2;
/// Noise below this share of the edges is no noise that matters: nothing is distinguished below it.
const LEAST_NOISE: f64 = 1e-3;

/// Median length of the edges, m.
pub(super) fn median_edge(mesh: &TriMesh) -> f64 {
    let sides = |[a, b, c]: [Point3<f64>; 3]| [(a - b).norm(), (b - c).norm(), (c - a).norm()];
    let mut lengths: Vec<f64> = mesh.faces().flat_map(|(face, _)| sides(mesh.triangle(face))).collect();
    median(&mut lengths).unwrap_or(0.0)
}

/// Vertices at sharp edges between touched faces, by slot: whether one is convex there, and whether one is concave.
fn sharp_vertices(mesh: &TriMesh, is_seen: &[bool]) -> Vec<[bool; 2]> {
    let mut is_sharp = vec![[false; 2]; mesh.vertex_slots()];
    for (face, corners) in mesh.faces() {
        for i in 0..3 {
            let [a, b] = [corners[i], corners[(i + 1) % 3]];
            if !(a < b && (is_seen[a.0 as usize] || is_seen[b.0 as usize])) {
                continue;
            }
            for other in mesh.faces_at_edge(a, b).filter(|&other| other != face) {
                if mesh.normal(face).dot(&mesh.normal(other)) < SHARP {
                    let side = usize::from((mesh.barycentre(other) - mesh.position(a)).dot(&mesh.normal(face)) > 0.0);
                    [a, b].into_iter().for_each(|v| is_sharp[v.0 as usize][side] = true);
                }
            }
        }
    }
    is_sharp
}

/// The edges of a refined mesh that a scanner rounds.
pub(super) struct SharpEdges {
    /// median edge of the scan's triangles, m
    pub resolution: f64,
    /// vertices at them, by slot: whether one is convex there, and whether one is concave
    is_sharp: Vec<[bool; 2]>,
    /// those vertices
    grid: PointGrid,
}

impl SharpEdges {
    pub fn of(scan: &TriMesh, refined: &TriMesh, is_seen: &[bool]) -> Self {
        let (resolution, is_sharp) = (median_edge(scan), sharp_vertices(refined, is_seen));
        let sharp = (0..is_sharp.len()).filter(|&at| is_sharp[at] != [false; 2]);
        let grid = PointGrid::of(refined.positions(), sharp, ROUNDED * resolution);
        Self { resolution, is_sharp, grid }
    }

    /// Edges are rounded within this, m.
    pub fn reach(&self) -> f64 {
        ROUNDED * self.resolution
    }

    /// Vertices at edges that are rounded where a place is.
    fn near(&self, p: &Point3<f64>) -> impl Iterator<Item = usize> {
        self.grid.near(p, self.reach())
    }

    /// Whether the scanner may round an edge where a place is.
    pub fn is_near(&self, p: &Point3<f64>) -> bool {
        self.near(p).next().is_some()
    }

    /// Whether an edge of the surface that a place lies on, near it, is convex, so that a scan may be too low there, and whether one turns
    /// in, so that it may be too high.
    pub fn may_be(&self, mesh: &TriMesh, p: &Point3<f64>, normal: &Vector3<f64>) -> [bool; 2] {
        let is_own = |&other: &usize| (mesh.positions()[other] - p).dot(normal).abs() <= LEVEL * self.resolution;
        let sides = self.near(p).filter(is_own).map(|other| self.is_sharp[other]);
        sides.fold([false; 2], |[out, inward], [convex, concave]| [out || convex, inward || concave])
    }

    /// Whether a place is wide enough for a scanner of this resolution.
    pub fn is_wide(&self, shape: &IndexedMesh<'_>, p: &Point3<f64>, normal: &Vector3<f64>) -> bool {
        let radius = NARROW * self.resolution / 2.0;
        shape.tree.closest(shape.mesh, &(p + normal * radius), FITS * radius).is_none()
    }
}

impl Scanner {
    /// `None` where too few places are open.
    pub(super) fn of(places: &Places) -> Option<Self> {
        let open = places.open();
        if open.len() < FEWEST {
            return None;
        }
        let edge = places.edges.resolution;
        let mut values: Vec<f64> = open.iter().map(|&at| places.off[at]).collect();
        let offset = median(&mut values)?;
        values.iter_mut().for_each(|value| *value = (*value - offset).abs());
        let noise = (SIGMA_OF_MEDIAN * median(&mut values)?).max(LEAST_NOISE * edge);
        let correlation = correlation(places, &open, noise, edge);
        Some(Self { offset, noise, correlation, edge, sees_from: NARROW * edge, places: open.len() })
    }

    /// Whether a disagreement is within so many standard deviations.
    pub(super) fn is_noise(&self, off: f64, sigmas: f64) -> bool {
        (off - self.offset).abs() <= sigmas * self.noise
    }

    /// Whether rounding an edge and noise may explain a disagreement.
    pub(super) fn may_round(&self, off: f64, sigmas: f64) -> bool {
        (off - self.offset).abs() <= self.edge + sigmas * self.noise
    }

    /// Standard deviation of the mean over an area (m²), m.
    pub(crate) fn sigma_of_mean(&self, area: f64) -> f64 {
        let alike = std::f64::consts::TAU * self.correlation.powi(2);
        self.noise / (1.0 + area / alike.max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Distance over which disagreements stay alike, m: half the mean square of their differences grows to 1 − 1/e of the
/// variance within √2 ℓ.
fn correlation(places: &Places, open: &[usize], noise: f64, edge: f64) -> f64 {
    let some: Vec<usize> = open.iter().copied().step_by(open.len().div_ceil(MOST_PLACES)).collect();
    let width = LONGEST * edge / BINS as f64;
    let mut bins: Vec<Vec<f64>> = vec![Vec::new(); BINS];
    for (i, &a) in some.iter().enumerate() {
        for &b in &some[..i] {
            let bin = ((places.positions[a] - places.positions[b]).norm() / width) as usize;
            if bin < BINS && places.normals[a].dot(&places.normals[b]) > SHARP {
                bins[bin].push((places.off[a] - places.off[b]).powi(2) / 2.0);
            }
        }
    }
    let grown = (1.0 - (-1.0f64).exp()) * noise.powi(2);
    let is_grown =
        |bin: &mut Vec<f64>| bin.len() >= FULL && median(bin).is_some_and(|median| median / MEDIAN_OF_SQUARE >= grown);
    let at = bins.iter_mut().position(is_grown).unwrap_or(BINS);
    ((at as f64 + 0.5) * width / GROWN).max(edge / 2.0)
}
