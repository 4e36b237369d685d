//! Position of the ball against the scan.

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{FaceTree, TriMesh, is_on_rim};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, median};

/// Minimum share of contacts on the scan: a scan that lacks a wall or a hole misses the others.
pub(super) const SHARE_ON_SCAN: f64 = 0.5;

/// Maximum tolerance, m, for a noisy scan: a wider one would hide a wrong unit.
const LARGEST_TOLERANCE: f64 = 6e-3;
/// Minimum tolerance, m: no pose is better.
pub(super) const LEAST_TOLERANCE: f64 = 0.3e-3;
/// Vertices for the noise estimate.
const NOISE_VERTICES: usize = 4000;

/// Minimum cosine between an outward force and the normal.
const LEANS: f64 = 0.5;

/// Scale and noise of a scan, from its mesh.
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
    /// Noise: distance of a vertex from the mean of its neighbours along its normal; for n
    /// independent neighbours that is σ √(1 + 1/n).
    pub(crate) fn of(scan: &TriMesh) -> Self {
        let step = (scan.vertex_slots() / NOISE_VERTICES).max(1);
        let (mut off, mut edges) = (Vec::new(), Vec::new());
        for vertex in (0..scan.vertex_slots())
            .step_by(step)
            .map(|at| touchup_geometry::mesh::VertexId(at as u32))
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

    /// Tolerance of the distance between ball centre and surface about one radius, m.
    ///
    /// - `unit`: length of a true 1 m in the scan as read, m.
    pub(crate) fn tolerance(&self, told_noise: f64, radius: f64, unit: f64) -> f64 {
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

/// Fit of a set of ball centres to the scan.
#[derive(Clone, Debug)]
pub(super) struct BallFit {
    /// median signed distance of the centre from the surface, m; centres below a lid over a hole
    /// and beyond a rim, which has no inside, do not count
    pub distance: f64,
    /// median deviation from that, m
    pub scatter: f64,
    /// share within the tolerance, of the centres not below the surface
    pub share: f64,
    /// signed distance of each centre, m
    pub distances: Vec<f64>,
    /// outward normal under each centre
    pub normals: Vec<Vector3<f64>>,
}

/// Whether a press is against a wall that the scan lacks: lower than a ball can rest on the scan,
/// as under a lid over a hole.
pub(super) fn is_in_hole(
    distance: f64,
    normal: &Vector3<f64>,
    force: &Vector3<f64>,
    radius: f64,
) -> bool {
    distance < radius && force.dot(normal).abs() <= LEANS * force.norm()
}

/// Number of presses that the scan explains.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanAgreement {
    on_scan: usize,
    /// against walls that the scan lacks
    in_holes: usize,
    count: usize,
}

impl ScanAgreement {
    /// Share on the scan; presses in holes that it lacks do not count, unless they are most of all.
    pub(crate) fn on_scan(&self) -> f64 {
        let is_lid = self.in_holes as f64 <= MOST_UNDER_LIDS * self.count as f64;
        let count = self.count - if is_lid { self.in_holes } else { 0 };
        self.on_scan as f64 / count.max(1) as f64
    }

    /// Share on the scan, or in holes that it lacks.
    pub(crate) fn on_scan_or_in_holes(&self) -> f64 {
        (self.on_scan + self.in_holes) as f64 / self.count.max(1) as f64
    }
}

/// Number of consecutive touches that share one error of the scan and count as one.
pub(super) const ALIKE: f64 = 10.0;

/// Maximum share of contacts under lids of the scan, and beyond its rims.
const MOST_UNDER_LIDS: f64 = 0.6;
const MOST_BEYOND_RIMS: f64 = 0.8;

/// Standard uncertainty of the median of `count` distances, m.
///
/// - `scatter`: their median deviation from it, m.
pub(super) fn error_of_median(scatter: f64, count: usize) -> f64 {
    1.25 * SIGMA_OF_MEDIAN * scatter / (count as f64 / ALIKE).max(1.0).sqrt()
}

impl BallFit {
    pub(crate) fn of(
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

    /// Number of presses that the scan explains: the centre is one radius off it, and the force
    /// points out of it.
    ///
    /// - `forces`: of each centre, in O.
    pub(crate) fn explained(
        &self,
        forces: &[Vector3<f64>],
        radius: f64,
        tolerance: f64,
    ) -> ScanAgreement {
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

    /// Share of the centres farther off the surface than `distance`, m, on either side: beside the
    /// part and over holes of the scan the side is unknown.
    pub(crate) fn share_beyond(&self, distance: f64) -> f64 {
        self.distances.iter().filter(|x| x.abs() > distance).count() as f64
            / self.distances.len().max(1) as f64
    }
}
