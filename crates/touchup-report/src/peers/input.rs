//! The wavy plate and the point that slides over it, for the peers and for touchup.

use nalgebra::Point3;

use super::PeerTimes;
use crate::{Effort, Spread, timed};
use touchup_geometry::mesh::{FaceTree, MeshError, NearbyLeaves, TriMesh};
use touchup_method::haptic::{RefineError, RefineParams, Refiner};
use touchup_method::stylus::TipParams;
use touchup_sim::wavy::{RADIUS, SIDE, STIFFNESS, contact_on, slide, wavy_plate};

/// Search radius beyond any query's distance from the plate, m.
const REACH: f64 = 0.01;
/// Warm-up pushes.
const WARM: usize = 2_000;
/// Width of the raster, m.
const WIDTH: f64 = 0.8 * SIDE;

/// Mesh, queries and samples of one size.
#[derive(Clone, Debug)]
pub struct PeersInput {
    /// the plate
    pub mesh: TriMesh,
    queries: Vec<Point3<f64>>,
    /// distance of each query from the plate, m
    pub distances: Vec<f64>,
}

impl PeersInput {
    /// A plate of about `faces` faces, and the queries with their distances.
    ///
    /// # Errors
    /// Errors of [`wavy_plate`].
    pub fn new(faces: usize, effort: Effort) -> Result<Self, MeshError> {
        let mesh = wavy_plate(faces)?;
        let queries: Vec<_> = (0..effort.choose(1_000, 4_000))
            .map(|i| contact_on(SIDE, i, WIDTH).0)
            .collect();
        let tree = FaceTree::new(&mesh);
        let distance = |p| {
            tree.closest(&mesh, p, REACH)
                .map_or(f64::INFINITY, |hit| hit.distance_squared.sqrt())
        };
        let distances = queries.iter().map(distance).collect();
        Ok(Self {
            mesh,
            queries,
            distances,
        })
    }

    /// Input files of the script by name: V × 3 and Q × 3 doubles in m, F × 3 integers, all
    /// little-endian.
    pub fn files(&self) -> [(&'static str, Vec<u8>); 3] {
        let corners = self.mesh.faces().flat_map(|(_, corners)| corners);
        [
            ("positions.f64", bytes(self.mesh.positions())),
            ("queries.f64", bytes(&self.queries)),
            (
                "faces.i32",
                corners.flat_map(|vertex| vertex.0.to_le_bytes()).collect(),
            ),
        ]
    }

    /// Measures touchup: each query and each push by itself.
    ///
    /// - `turn`: "before" the peers or "after" them.
    ///
    /// # Errors
    /// Errors of [`Refiner::new`] and [`Refiner::push`]: none is expected.
    pub fn measure(&self, turn: &str) -> Result<PeerTimes, RefineError> {
        let tree = FaceTree::new(&self.mesh);
        let (mut queries, mut next) = (Vec::new(), Vec::new());
        let (mut last, mut nearby) = (None, NearbyLeaves::default());
        for p in &self.queries {
            let (seconds, hit) = timed(|| tree.closest(&self.mesh, p, REACH));
            queries.push(seconds * 1e6);
            let hint = last.or(hit.map(|hit| hit.face));
            let near = || {
                hint.and_then(|hint| tree.closest_nearby(&self.mesh, p, hint, REACH, &mut nearby))
            };
            let (seconds, hit) = timed(near);
            next.push(seconds * 1e6);
            last = hit.map(|hit| hit.face);
        }
        let tip = TipParams {
            radius: RADIUS,
            stiffness: Some(STIFFNESS),
        };
        let mut refiner = Refiner::new(self.mesh.clone(), RefineParams::robust(tip))?;
        let mut pushes = Vec::new();
        for i in 0..WARM + 5 * self.queries.len() {
            let sample = slide(i, WIDTH);
            let (seconds, pushed) = timed(|| refiner.push(&sample).map(drop));
            pushed?;
            if i >= WARM {
                pushes.push(seconds * 1e6);
            }
        }
        let spread = |times| Spread::of(times).unwrap_or(f64::NAN.into());
        Ok(PeerTimes {
            peer: format!("touchup, {turn}"),
            update: "boxes of the moved faces refitted".to_owned(),
            query_us: spread(queries),
            batched_query_us: Some(spread(next)),
            pipeline_us: spread(pushes),
            ..PeerTimes::default()
        })
    }
}

fn bytes(points: &[Point3<f64>]) -> Vec<u8> {
    points
        .iter()
        .flat_map(|p| [p.x, p.y, p.z])
        .flat_map(f64::to_le_bytes)
        .collect()
}
