//! The wavy plate and the point that slides over it, for the peers and for touchup.

use std::time::Instant;

use nalgebra::{Isometry3, Point3, Vector3};

use super::TouchupTimes;
use crate::mesh::{FaceTree, TriMesh};
use crate::refine::{RefineError, RefineParams, Refiner, TipParams};
use crate::report::{Effort, Spread};
use crate::touch::{Sample, Wrench};

/// Side of the plate, m; its waves: 40 mm, 2 mm high.
const SIDE: f64 = 0.3;
const WAVE: f64 = 0.04;
const AMPLITUDE: f64 = 2e-3;
/// How far the part lies below the scan, m.
const DEPTH: f64 = 0.05e-3;
/// The ball, m, and the probe, N/m, and what it is pressed with.
const RADIUS: f64 = 1.5e-3;
const STIFFNESS: f64 = 2e4;
const FORCE_N: f64 = 2.0;
/// Between two samples: 1 kHz and 50 mm/s.
const STEP_NS: i64 = 1_000_000;
const STEP: f64 = 50e-6;
/// Farther than any query from the plate, m.
const REACH: f64 = 0.01;
/// Pushes before those that count.
const WARM: usize = 2_000;

/// Mesh, queries and samples of one size.
#[derive(Clone, Debug)]
pub struct PeersInput {
    mesh: TriMesh,
    queries: Vec<Point3<f64>>,
    distances: Vec<f64>,
}

fn height(x: f64, y: f64) -> f64 {
    let wave = std::f64::consts::TAU / WAVE;
    AMPLITUDE * (wave * x).sin() * (wave * y).cos()
}

fn normal(x: f64, y: f64) -> Vector3<f64> {
    let wave = std::f64::consts::TAU / WAVE;
    let (dx, dy) = ((wave * x).cos() * (wave * y).cos(), -(wave * x).sin() * (wave * y).sin());
    Vector3::new(-AMPLITUDE * wave * dx, -AMPLITUDE * wave * dy, 1.0).normalize()
}

fn wavy_plate(faces: usize) -> TriMesh {
    let n = ((faces as f64 / 2.0).sqrt().round() as u32).max(1);
    let at = |i: u32| SIDE * f64::from(i) / f64::from(n);
    let nodes = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let positions = nodes.map(|(i, j)| Point3::new(at(i), at(j), height(at(i), at(j)))).collect();
    let id = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let faces = cells
        .flat_map(|(i, j)| [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]]);
    TriMesh::new(positions, faces.collect()).unwrap_or_else(|error| unreachable!("the plate is sound: {error}"))
}

/// Where the surface is touched at sample `i`, m, and its normal there: lines of 0.24 m, 0.7 mm apart.
fn touched(i: usize) -> (Point3<f64>, Vector3<f64>) {
    let length = 0.8 * SIDE;
    let way = STEP * i as f64;
    let (line, along) = ((way / length).floor(), way % length);
    let x = 0.1 * SIDE + if line % 2.0 == 0.0 { along } else { length - along };
    let y = 0.1 * SIDE + (line * 0.7e-3) % length;
    let normal = normal(x, y);
    (Point3::new(x, y, height(x, y)) - normal * DEPTH, normal)
}

fn sample(i: usize) -> Sample {
    let (point, normal) = touched(i);
    let reported = point + normal * (RADIUS - FORCE_N / STIFFNESS);
    let wrench = Wrench { force: normal * FORCE_N, torque: Vector3::zeros() };
    let pose_ot = Isometry3::translation(reported.x, reported.y, reported.z);
    Sample { stamp_ns: i as i64 * STEP_NS, pose_ot, wrench }
}

fn microseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e6
}

impl PeersInput {
    /// About so many faces, and the queries with their distances.
    pub fn new(faces: usize, effort: Effort) -> Self {
        let mesh = wavy_plate(faces);
        let queries: Vec<_> = (0..effort.choose(1_000, 4_000)).map(|i| touched(i).0).collect();
        let tree = FaceTree::new(&mesh);
        let distance = |p| tree.closest(&mesh, p, REACH).map_or(f64::INFINITY, |hit| hit.distance_squared.sqrt());
        let distances = queries.iter().map(distance).collect();
        Self { mesh, queries, distances }
    }

    /// The plate.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Distance of each query from the plate, m.
    pub fn distances(&self) -> &[f64] {
        &self.distances
    }

    /// The file `positions.f64`: V × 3, m, little-endian doubles.
    pub fn positions(&self) -> Vec<u8> {
        bytes(self.mesh.positions())
    }

    /// The file `queries.f64`: Q × 3, m, little-endian doubles.
    pub fn queries(&self) -> Vec<u8> {
        bytes(&self.queries)
    }

    /// The file `faces.i32`: F × 3, little-endian.
    pub fn triangles(&self) -> Vec<u8> {
        self.mesh.faces().flat_map(|(_, corners)| corners).flat_map(|vertex| vertex.0.to_le_bytes()).collect()
    }

    /// Measures touchup: each query and each push by itself.
    ///
    /// # Errors
    /// Those of [`Refiner::new`] and [`Refiner::push`]: none is expected.
    pub fn measure(&self) -> Result<TouchupTimes, RefineError> {
        let tree = FaceTree::new(&self.mesh);
        let (mut queries, mut next) = (Vec::new(), Vec::new());
        let mut last = None;
        for p in &self.queries {
            let start = Instant::now();
            let hit = std::hint::black_box(tree.closest(&self.mesh, p, REACH));
            queries.push(microseconds(start));
            let hint = last.or(hit.map(|hit| hit.face));
            let start = Instant::now();
            let hit = std::hint::black_box(hint.and_then(|hint| tree.closest_from(&self.mesh, p, hint, REACH)));
            next.push(microseconds(start));
            last = hit.map(|hit| hit.face);
        }
        let tip = TipParams { radius: RADIUS, stiffness: Some(STIFFNESS) };
        let mut refiner = Refiner::new(self.mesh.clone(), RefineParams::robust(tip))?;
        let mut pushes = Vec::new();
        for i in 0..WARM + 5 * self.queries.len() {
            let sample = sample(i);
            let start = Instant::now();
            std::hint::black_box(refiner.push(&sample))?;
            let time = microseconds(start);
            if i >= WARM {
                pushes.push(time);
            }
        }
        let spread = |times| Spread::of(times).unwrap_or(f64::NAN.into());
        Ok(TouchupTimes { query_us: spread(queries), next_query_us: spread(next), push_us: spread(pushes) })
    }
}

fn bytes(points: &[Point3<f64>]) -> Vec<u8> {
    points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f64::to_le_bytes).collect()
}
