//! Implicit moving least squares [Kolluri 2005]: mean distance from the planes of nearby points.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::contour::crossing::Crossing;
use crate::reconstruct::contour::dual_contouring::contour;
use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::contour::scan_clipping::Cut;
use crate::reconstruct::lattice::{Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, node_at};
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{PointTree, Workers, map_by};

/// Maximum number of points averaged at a place.
const AVERAGED: u32 = 24;
/// Standard deviation of the Gaussian weights of the averaged points: in spacings, or in standard
/// deviations of the noise, the larger of both.
const WIDTH: (f64, f64) = (1.2, 2.0);
/// Points farther than this many widths have negligible weight.
const FARTHEST_WIDTHS: f64 = 3.0;
/// Steps of the search for a crossing on a lattice edge.
const STEPS: usize = 3;
/// Value of f, in spacings, that ends the search for a crossing early: linear interpolation between
/// the last two places removes the rest.
const ENOUGH: f64 = 1e-3;
/// Points with their normals, and the tree over them.
pub(super) struct OrientedPoints {
    /// m
    pub positions: Vec<Point3<f64>>,
    normals: Vec<Vector3<f64>>,
    pub tree: PointTree,
    /// distance of neighbouring points, m
    pub spacing: f64,
    /// standard deviation of the weights about a place, m
    width: f64,
}

impl OrientedPoints {
    pub(crate) fn new(
        positions: Vec<Point3<f64>>,
        normals: Vec<Vector3<f64>>,
        spacing: f64,
        noise: f64,
    ) -> Self {
        let tree = PointTree::new(&positions);
        Self {
            positions,
            normals,
            tree,
            spacing,
            width: (WIDTH.0 * spacing).max(WIDTH.1 * noise),
        }
    }

    /// f and its unit gradient at a place, from nearby points that face alike; `None` without any.
    ///
    /// On a curved surface the planes of the points lie outside of it by d² κ / 2 in the mean and
    /// the middle of the points inside by as much (d: their distance, κ: curvature), so half the
    /// sum of both cancels this bias.
    fn plane_at(&self, p: &Point3<f64>) -> Option<(f64, Vector3<f64>)> {
        let mut facing = None;
        let (mut weights, mut to_planes, mut arms, mut normal) =
            (0.0, 0.0, Vector3::zeros(), Vector3::zeros());
        for (at, far) in self.tree.nearest(p, AVERAGED, FARTHEST_WIDTHS * self.width) {
            // the opposite side of a thin sheet is a different surface
            let n = self.normals[at];
            if n.dot(facing.get_or_insert(n)) <= 0.0 {
                continue;
            }
            let weight = (-0.5 * (far / self.width).powi(2)).exp();
            weights += weight;
            let arm = p - self.positions[at];
            to_planes += weight * n.dot(&arm);
            arms += arm * weight;
            normal += n * weight;
        }
        let normal = normal.try_normalize(0.0)?;
        (weights > 0.0).then(|| (0.5 * (to_planes + normal.dot(&arms)) / weights, normal))
    }

    /// The zero set of f in the cells of the points and their neighbours: vertices, m, and faces.
    pub(crate) fn contoured(
        &self,
        lattice: &Lattice,
        workers: &dyn Workers,
    ) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let (mut region, mut last) = (LatticeRegion::default(), None);
        for p in &self.positions {
            let cell = lattice.cell_of(p);
            // successive points are neighbours
            if last.replace(cell) == Some(cell) {
                continue;
            }
            for beside in (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]) {
                region.insert_with(std::array::from_fn(|i| cell[i] + beside[i]), || ());
            }
        }
        let values = self.values_in(&region, lattice, workers);
        let crossings = self.crossings(&values, lattice, workers);
        let crossing = |edge: &Edge| match crossings.get(edge) {
            Some(crossing) => *crossing,
            None => self.crossing(edge, &values, lattice),
        };
        let Patch {
            vertices, faces, ..
        } = contour(lattice, &region, &values, &Cut::default(), crossing);
        let positions = vertices.iter().map(|(_, position)| *position).collect();
        (positions, faces.iter().map(|face| face.corners).collect())
    }

    /// f at the corners of the cells.
    fn values_in(
        &self,
        region: &LatticeRegion,
        lattice: &Lattice,
        workers: &dyn Workers,
    ) -> NodeValues {
        let mut nodes = LatticeRegion::default();
        for (cell, ()) in region.iter() {
            for corner in 0..8 {
                nodes.insert_with(node_at(cell, corner), || ());
            }
        }
        let found = map_by(workers, nodes.len(), |at| {
            self.plane_at(&lattice.position(nodes.entry(at as u32).0))
        });
        let mut values = NodeValues::default();
        for ((node, ()), found) in nodes.iter().zip(found) {
            found
                .into_iter()
                .for_each(|(value, _)| values.insert(node, value));
        }
        values
    }

    /// Crossings of all edges with ends of opposite sign.
    fn crossings(
        &self,
        values: &NodeValues,
        lattice: &Lattice,
        workers: &dyn Workers,
    ) -> CellTable<Edge, Crossing> {
        let is_crossed = |edge: &Edge, value: f64| {
            values
                .get(&edge.end())
                .is_some_and(|beyond| (*beyond < 0.0) != (value < 0.0))
        };
        let edges_at = |(node, &value): (LatticeNode, &f64)| {
            let edges = (0..3).map(move |axis| Edge { node, axis });
            edges.filter(move |edge| is_crossed(edge, value))
        };
        let edges: Vec<Edge> = values.iter().flat_map(edges_at).collect();
        let found = map_by(workers, edges.len(), |at| {
            self.crossing(&edges[at], values, lattice)
        });
        let mut crossings = CellTable::default();
        edges
            .into_iter()
            .zip(found)
            .for_each(|(edge, crossing)| crossings.insert(edge, crossing));
        crossings
    }

    /// Sign change of f on an edge.
    fn crossing(&self, edge: &Edge, values: &NodeValues, lattice: &Lattice) -> Crossing {
        let nodes = [edge.node, edge.end()];
        let mut ends = nodes.map(|node| lattice.position(node));
        let mut values = nodes.map(|node| values.get(&node).copied().unwrap_or_default());
        let [a, b] = ends;
        let mut normal = (b - a) * (values[1] - values[0]).signum();
        for _ in 0..STEPS {
            let point = ends[0] + (ends[1] - ends[0]) * (values[0] / (values[0] - values[1]));
            let Some((value, grows)) = self.plane_at(&point) else {
                break;
            };
            normal = grows;
            // the end of the same sign moves to the point
            let side = usize::from((value < 0.0) == (values[1] < 0.0));
            (ends[side], values[side]) = (point, value);
            if value.abs() <= ENOUGH * self.spacing {
                break;
            }
        }
        let share = if values[0] == values[1] {
            0.5
        } else {
            values[0] / (values[0] - values[1])
        };
        let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
        Crossing {
            point: ends[0] + (ends[1] - ends[0]) * share,
            normal,
        }
    }
}
