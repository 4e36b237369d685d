//! Where the ball is against the scan.

use nalgebra::{Point3, Vector3};

use crate::mesh::{FaceTree, TriMesh, is_on_rim};
use crate::numeric::{SIGMA_OF_MEDIAN, median};

/// Contacts are on the scan when this share of them is: if the scan lacks a wall or a hole, they
/// are not.
pub(super) const SHARE_ON_SCAN: f64 = 0.5;

/// A noisy scan is this much off at most, m: a wider tolerance would hide a wrong unit.
const LARGEST_TOLERANCE: f64 = 6e-3;
/// … and no pose is better than this, m.
pub(super) const LEAST_TOLERANCE: f64 = 0.3e-3;
/// Vertices that the noise is estimated from.
const NOISE_VERTICES: usize = 4000;

/// A force points out of the surface when it is no farther from its normal, as cosine.
const LEANS: f64 = 0.5;

/// What the scan says of itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanScale {
    /// deviation of the vertices along the normal, m
    pub noise: f64,
    /// median edge, m
    pub edge: f64,
    /// half the diagonal of its box, m
    pub extent: f64,
}

impl ScanScale {
    /// Noise: how far a vertex is off the mean of its neighbours along its normal; for n
    /// independent neighbours that is σ √(1 + 1/n).
    pub fn of(scan: &TriMesh) -> Self {
        let step = (scan.vertex_slots() / NOISE_VERTICES).max(1);
        let (mut off, mut edges) = (Vec::new(), Vec::new());
        for vertex in (0..scan.vertex_slots())
            .step_by(step)
            .map(|at| crate::mesh::VertexId(at as u32))
        {
            if !scan.has_vertex(vertex) {
                continue;
            }
            let (mut sum, mut count, mut normal) = (Vector3::zeros(), 0.0, Vector3::zeros());
            let at = scan.position(vertex);
            for &face in scan.star(vertex) {
                normal += scan.double_area_normal(face);
                for corner in scan
                    .corners(face)
                    .into_iter()
                    .filter(|&corner| corner != vertex)
                {
                    let edge = scan.position(corner) - at;
                    edges.push(edge.norm());
                    (sum, count) = (sum + edge, count + 1.0);
                }
            }
            if let Some(normal) = normal.try_normalize(0.0).filter(|_| count > 0.0) {
                // each neighbour comes with two faces
                off.push((sum / count).dot(&normal).abs() / (1.0 + 2.0 / count).sqrt());
            }
        }
        let [low, high] = scan.bounds();
        Self {
            noise: SIGMA_OF_MEDIAN * median(&mut off).unwrap_or(0.0),
            edge: median(&mut edges).unwrap_or(0.0),
            extent: (high - low).norm() / 2.0,
        }
    }

    /// How far the ball's centre may be from one radius off the surface, m.
    ///
    /// - `unit`: how many m the scan as it was read takes for one.
    pub fn tolerance(&self, told_noise: f64, radius: f64, unit: f64) -> f64 {
        let noise = self.noise.max(told_noise);
        (3.0 * noise + 0.2 * self.edge + 0.1 * radius)
            .clamp(LEAST_TOLERANCE * unit, LARGEST_TOLERANCE * unit)
    }
}

/// Half the diagonal of a box around points, m.
pub(super) fn extent_of(points: impl Iterator<Item = Point3<f64>>) -> f64 {
    let mut bounds: Option<[Point3<f64>; 2]> = None;
    for point in points {
        let [low, high] = bounds.get_or_insert([point, point]);
        (*low, *high) = (low.inf(&point), high.sup(&point));
    }
    bounds.map_or(0.0, |[low, high]| (high - low).norm() / 2.0)
}

/// How a set of ball centres lies on the scan.
#[derive(Clone, Debug)]
pub(super) struct BallFit {
    /// median signed distance of the centre from the surface, m, of those that the scan says
    /// something of: neither below it, where it has a lid over a hole, nor beyond its rims, where
    /// it has no inside
    pub distance: f64,
    /// median deviation from that, m
    pub scatter: f64,
    /// share within the tolerance, of those that are not below the surface
    pub share: f64,
    /// of each centre, m
    pub distances: Vec<f64>,
    /// outward normal under each centre
    pub normals: Vec<Vector3<f64>>,
}

/// Whether a press is against a wall that the scan lacks: lower than a ball can rest on it, as under
/// a lid over a hole.
pub(super) fn is_in_hole(
    distance: f64,
    normal: &Vector3<f64>,
    force: &Vector3<f64>,
    radius: f64,
) -> bool {
    distance < radius && force.dot(normal).abs() <= LEANS * force.norm()
}

/// How many presses the scan explains.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanAgreement {
    on_scan: usize,
    /// against walls that it lacks
    in_holes: usize,
    count: usize,
}

impl ScanAgreement {
    /// Share on the scan; what is in holes that it lacks says nothing, unless it is most of all.
    pub fn on_scan(&self) -> f64 {
        let is_lid = self.in_holes as f64 <= MOST_UNDER_LIDS * self.count as f64;
        let count = self.count - if is_lid { self.in_holes } else { 0 };
        self.on_scan as f64 / count.max(1) as f64
    }

    /// Share on the scan, or in holes that it lacks.
    pub fn on_scan_or_in_holes(&self) -> f64 {
        (self.on_scan + self.in_holes) as f64 / self.count.max(1) as f64
    }
}

/// Touches that follow each other share the same error of the scan: so many count as one.
pub(super) const ALIKE: f64 = 10.0;

/// No more than this share of the contacts is under lids of the scan, and no more beyond its rims.
const MOST_UNDER_LIDS: f64 = 0.6;
const MOST_BEYOND_RIMS: f64 = 0.8;

/// Standard uncertainty of the median of `count` distances, m.
///
/// - `scatter`: their median deviation from it, m.
pub(super) fn error_of_median(scatter: f64, count: usize) -> f64 {
    1.25 * SIGMA_OF_MEDIAN * scatter / (count as f64 / ALIKE).max(1.0).sqrt()
}

impl BallFit {
    pub fn of(
        scan: &TriMesh,
        tree: &FaceTree,
        centres: impl Iterator<Item = Point3<f64>>,
        radius: f64,
        tolerance: f64,
    ) -> Self {
        let (mut distances, mut normals, mut is_beyond) = (Vec::new(), Vec::new(), Vec::new());
        for centre in centres {
            let Some(hit) = tree.closest(scan, &centre, f64::INFINITY) else {
                continue;
            };
            let off = centre - hit.point;
            let normal = scan.normal(hit.face);
            distances.push(off.norm().copysign(off.dot(&normal)));
            normals.push(normal);
            is_beyond.push(is_on_rim(scan, &hit));
        }
        let within = distances
            .iter()
            .filter(|&&distance| (distance - radius).abs() <= tolerance)
            .count();
        let below = distances
            .iter()
            .filter(|&&distance| distance < -tolerance)
            .count();
        let is_lid = below as f64 <= MOST_UNDER_LIDS * distances.len() as f64;
        let count = distances.len() - if is_lid { below } else { 0 };
        let share = within as f64 / count.max(1) as f64;
        // beyond a rim there is no side
        let is_rim = is_beyond.iter().filter(|is| **is).count() as f64
            <= MOST_BEYOND_RIMS * distances.len() as f64;
        let has_side = |distance: f64, is_beyond: bool| {
            !(is_lid && distance < -tolerance || is_rim && is_beyond)
        };
        let sided = distances
            .iter()
            .zip(&is_beyond)
            .filter(|&(&distance, &is_beyond)| has_side(distance, is_beyond));
        let mut sided: Vec<f64> = sided.map(|(&distance, _)| distance).collect();
        let distance = median(&mut sided).unwrap_or(f64::INFINITY);
        sided.iter_mut().for_each(|x| *x = (*x - distance).abs());
        let scatter = median(&mut sided).unwrap_or(f64::INFINITY);
        Self {
            distance,
            scatter,
            share,
            distances,
            normals,
        }
    }

    /// How many of the presses the scan explains: the centre is one radius off it, and the force
    /// points out of it.
    ///
    /// - `forces`: of each centre, in O.
    pub fn explained(&self, forces: &[Vector3<f64>], radius: f64, tolerance: f64) -> ScanAgreement {
        let mut of = ScanAgreement {
            on_scan: 0,
            in_holes: 0,
            count: forces.len(),
        };
        for ((distance, normal), force) in self.distances.iter().zip(&self.normals).zip(forces) {
            let is_near = (distance - radius).abs() <= tolerance;
            let is_outward = force.dot(normal) > LEANS * force.norm();
            of.on_scan += usize::from(is_near && is_outward);
            of.in_holes += usize::from(is_in_hole(*distance, normal, force, radius));
        }
        of
    }

    /// Share of the centres that are farther off the surface than `distance`, m, on whichever side:
    /// beside the part, and where the scan has holes, the side is not known.
    pub fn share_beyond(&self, distance: f64) -> f64 {
        self.distances.iter().filter(|x| x.abs() > distance).count() as f64
            / self.distances.len().max(1) as f64
    }
}
