//! The region that a simulated stylus really touched, and how far a mesh is from the part there.

use std::collections::{HashMap, HashSet};

use nalgebra::Point3;
use serde::Serialize;

use crate::mesh::{FaceTree, TriMesh};
use crate::sim::{Moment, Surface, measure_badness};

/// A point of the part belongs to the touched region when a contact is within this distance, m.
const REACH: f64 = 1e-3;
/// One contact is kept in each cell of this size, m: a ball that rests does not count a thousandfold.
const SPACING: f64 = 0.25e-3;

/// Where the ball really touched the part.
#[derive(Debug)]
pub(super) struct Touched {
    /// thinned out, m, in O
    contacts: Vec<Point3<f64>>,
    /// indices into `contacts` by cells of [`REACH`]
    cells: HashMap<[i64; 3], Vec<usize>>,
}

/// Distances between part and mesh in the touched region, mean and 95th percentile, mm.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct RegionError {
    /// from the points that were touched to the mesh: what is missing
    pub part_to_mesh_mm: [f64; 2],
    /// from the mesh to the part, where its closest point belongs to the region: what is wrong
    pub mesh_to_part_mm: [f64; 2],
}

fn cell_of(p: &Point3<f64>, size: f64) -> [i64; 3] {
    [p.x, p.y, p.z].map(|x| (x / size).floor() as i64)
}

impl Touched {
    /// The true contacts of a simulated touch.
    pub fn of(moments: &[Moment]) -> Self {
        let mut kept = HashSet::new();
        let mut touched = Self { contacts: Vec::new(), cells: HashMap::new() };
        for contact in moments.iter().flat_map(|moment| &moment.contacts) {
            if kept.insert(cell_of(&contact.point, SPACING)) {
                touched.cells.entry(cell_of(&contact.point, REACH)).or_default().push(touched.contacts.len());
                touched.contacts.push(contact.point);
            }
        }
        touched
    }

    /// Whether a contact is within [`REACH`] of `p`.
    fn is_near(&self, p: &Point3<f64>) -> bool {
        let [x, y, z] = cell_of(p, REACH);
        let around = |at: i64| at - 1..=at + 1;
        around(x).flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z]))).any(|cell| {
            self.cells.get(&cell).is_some_and(|some| some.iter().any(|&i| (self.contacts[i] - p).norm() <= REACH))
        })
    }

    /// How far `mesh` and `part` are from each other here.
    pub fn error(&self, part: &dyn Surface, mesh: &TriMesh) -> RegionError {
        let tree = FaceTree::new(mesh);
        let to_mesh = |p: &Point3<f64>| tree.closest(mesh, p, f64::INFINITY).map(|hit| (hit.point - p).norm());
        let mut distances: Vec<f64> = self.contacts.iter().filter_map(to_mesh).collect();
        distances.sort_by(f64::total_cmp);
        let mean = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
        let p95 = distances.get(distances.len() * 95 / 100).copied().unwrap_or_default();
        let from_mesh = measure_badness(mesh, part, |p| self.is_near(&part.closest(p).point));
        RegionError {
            part_to_mesh_mm: [mean * 1e3, p95 * 1e3],
            mesh_to_part_mm: from_mesh.map_or([0.0; 2], |quality| [quality.mean * 1e3, quality.p95 * 1e3]),
        }
    }
}
