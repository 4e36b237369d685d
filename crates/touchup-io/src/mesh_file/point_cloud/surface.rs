//! A surface through points: implicit moving least squares [Kolluri 2005] of the points near the nodes of a lattice, meshed by the dual
//! contouring of the patch. It ends where the points end.

use nalgebra::{Point3, Vector3};

use super::super::soup::Soup;
use super::cloud::Cloud;
use super::normals::{Neighbourhood, oriented};
use super::parallel;
use super::summary::CloudSummary;
use touchup_core::mesh::PointTree;
use touchup_core::reconstruct::{Crossing, Cut, Edge, Lattice, LatticeRegion, NodeValues, Patch, contour};

/// Fewer points make no surface: a plane is laid through as many neighbours, and half of them again are no neighbours.
const FEWEST: usize = 50;
/// More would take some 10 GB.
const MOST: usize = 20_000_000;
/// Points without others within this many spacings are left out, or one stray point would make the cells of all coarse.
const ISOLATED: f64 = 10.0;
/// Edge of the cells, in spacings: a cell that the surface passes through has points, and there are two to three faces for each of them.
const CELL: f64 = 1.3;
/// Places the planes of the lattice, in cells, where no coordinate that a scanner rounded to falls on them.
const ORIGIN: [f64; 3] = [0.164_607_9, 0.312_756_1, 0.460_895_1];
/// Points whose planes are averaged at a place at most …
const AVERAGED: u32 = 24;
/// … weighted by a normal distribution of this many spacings about it, or of this many standard deviations of the noise.
const WIDTH: (f64, f64) = (1.2, 2.0);
/// Points farther than this many widths have no weight that matters.
const FARTHEST_WIDTHS: f64 = 3.0;
/// Steps in which a crossing is looked for on an edge of the lattice.
const STEPS: usize = 3;
/// A vertex without a point within this many spacings is invented.
const FARTHEST: f64 = 1.8;
/// Neighbours of a vertex, within this many spacings, whose middle is farther from it than this part of the farthest: it lies
/// beyond the rim of what was scanned. On the rim of an even surface the middle is 4/(3π) = 0.42 away, at the corner of a cube 0.49.
const RIM_NEIGHBOURS: (u32, f64, f64) = (64, 3.0, 0.5);

/// Why points make no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(in super::super) enum CloudError {
    #[error(
        "only {left} of its {points} points are of use and at least {FEWEST} are needed: scan the part more densely"
    )]
    TooFew { left: usize, points: usize },
    #[error("{points} points are more than {MOST}: thin it out first, by a voxel grid for example")]
    TooMany { points: usize },
    #[error("the points make no surface ({reason}): look at the cloud in a viewer, and export it again or as a mesh")]
    NoSurface { reason: String },
}

/// A surface through the points, m, and the numbers of it in `summary`.
///
/// - `cloud`: finite and no point twice.
pub(super) fn reconstruct(cloud: Cloud, summary: &mut CloudSummary) -> Result<Soup, CloudError> {
    let (points, left) = (summary.points, cloud.positions.len());
    if left > MOST {
        return Err(CloudError::TooMany { points });
    }
    if left < FEWEST {
        return Err(CloudError::TooFew { left, points });
    }
    let tree = PointTree::new(&cloud.positions);
    let near = Neighbourhood::of_all(&cloud.positions, &tree);
    let spacing = median(near.iter().map(|near| near.spacing).collect());
    let (normals, source) = oriented(&cloud, &near, &tree);
    drop(tree);
    let is_kept = |at: &usize| near[*at].spacing <= ISOLATED * spacing;
    let kept: Vec<usize> = (0..left).filter(is_kept).collect();
    if kept.len() < FEWEST {
        return Err(CloudError::TooFew { left: kept.len(), points });
    }
    let pick = |of: &[Vector3<f64>]| kept.iter().map(|&at| of[at]).collect::<Vec<_>>();
    let positions: Vec<_> = kept.iter().map(|&at| cloud.positions[at]).collect();
    let noise = median(near.iter().map(|near| near.noise).collect());
    let points = OrientedPoints::new(positions, pick(&normals), spacing, noise);
    let lattice = Lattice { origin: Point3::from(Vector3::from(ORIGIN) * CELL * spacing), pitch: CELL * spacing };
    summary.isolated = left - kept.len();
    summary.normals = source;
    summary.reconstruction = "implicit moving least squares";
    summary.spacing_mm = spacing * 1e3;
    summary.noise_mm = noise * 1e3;
    summary.resolution_mm = lattice.pitch * 1e3;
    drop((cloud, near, normals, kept));
    let mut soup = points.contoured(&lattice);
    let made = soup.faces.len();
    cut_invented(&mut soup, &points);
    summary.faces = soup.faces.len();
    summary.cut_faces = made - summary.faces;
    match soup.faces.is_empty() {
        true => Err(CloudError::NoSurface { reason: "none of it is near enough to them".into() }),
        false => Ok(soup),
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Points with their normals, and the tree over them.
struct OrientedPoints {
    positions: Vec<Point3<f64>>,
    normals: Vec<Vector3<f64>>,
    tree: PointTree,
    /// distance of neighbouring points, m
    spacing: f64,
    /// standard deviation of the weights about a place, m
    width: f64,
}

impl OrientedPoints {
    fn new(positions: Vec<Point3<f64>>, normals: Vec<Vector3<f64>>, spacing: f64, noise: f64) -> Self {
        let tree = PointTree::new(&positions);
        Self { positions, normals, tree, spacing, width: (WIDTH.0 * spacing).max(WIDTH.1 * noise) }
    }

    /// f and its direction of growth at a place, by the points near it that face alike; `None` where there are none.
    ///
    /// On a curved surface the planes of the points lie outside of it by d² κ / 2 in the mean and the middle of the points inside by as
    /// much (d: their distance, κ: curvature), so half the sum of both is free of that.
    fn plane_at(&self, p: &Point3<f64>) -> Option<(f64, Vector3<f64>)> {
        let mut facing = None;
        let (mut weights, mut to_planes, mut arms, mut normal) = (0.0, 0.0, Vector3::zeros(), Vector3::zeros());
        for (at, far) in self.tree.nearest(p, AVERAGED, FARTHEST_WIDTHS * self.width) {
            // the other side of a thin sheet is another surface
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

    /// The zero set of f in the cells at the points and beside these.
    fn contoured(&self, lattice: &Lattice) -> Soup {
        let (mut region, mut nodes) = (LatticeRegion::default(), LatticeRegion::default());
        for p in &self.positions {
            let cell = lattice.cell_of(p);
            for beside in (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]) {
                region.insert_with(std::array::from_fn(|i| cell[i] + beside[i]), || ());
            }
        }
        for (cell, ()) in region.iter() {
            for corner in 0..8 {
                nodes.insert_with(std::array::from_fn(|i| cell[i] + (corner >> i & 1)), || ());
            }
        }
        let found = parallel::map(nodes.len(), |at| self.plane_at(&lattice.position(nodes.entry(at as u32).0)));
        let mut values = NodeValues::default();
        for ((node, ()), found) in nodes.iter().zip(found) {
            found.into_iter().for_each(|(value, _)| values.insert(node, value));
        }
        let crossing = |edge: &Edge| {
            let ends = [edge.node, edge.end()];
            let known = ends.map(|node| values.get(&node).copied().unwrap_or_default());
            self.crossing(ends.map(|node| lattice.position(node)), known)
        };
        let Patch { vertices, faces, .. } = contour(lattice, &region, &values, &Cut::default(), crossing);
        let positions = vertices.iter().map(|(_, position)| *position).collect();
        Soup { positions, faces: faces.iter().map(|face| face.corners).collect(), unused: 0 }
    }

    /// Where f changes its sign between two places.
    ///
    /// - `values`: f there, m.
    fn crossing(&self, mut ends: [Point3<f64>; 2], mut values: [f64; 2]) -> Crossing {
        let [a, b] = ends;
        let mut normal = (b - a) * (values[1] - values[0]).signum();
        for _ in 0..STEPS {
            let point = ends[0] + (ends[1] - ends[0]) * (values[0] / (values[0] - values[1]));
            let Some((value, grows)) = self.plane_at(&point) else { break };
            normal = grows;
            // the end of the same sign moves up
            let side = usize::from((value < 0.0) == (values[1] < 0.0));
            (ends[side], values[side]) = (point, value);
            if value == 0.0 {
                break;
            }
        }
        let share = if values[0] == values[1] { 0.5 } else { values[0] / (values[0] - values[1]) };
        let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
        Crossing { point: ends[0] + (ends[1] - ends[0]) * share, normal }
    }
}

/// Leaves out the faces of which a vertex is not among the points.
fn cut_invented(soup: &mut Soup, points: &OrientedPoints) {
    let (count, within, part) = RIM_NEIGHBOURS;
    let is_scanned = parallel::map(soup.positions.len(), |at| {
        let vertex = soup.positions[at];
        let near: Vec<_> = points.tree.nearest(&vertex, count, within * points.spacing).collect();
        let [Some((_, nearest)), Some((_, farthest))] = [near.first(), near.last()] else { return false };
        let arms = near.iter().map(|(at, _)| points.positions[*at] - vertex);
        let middle = arms.sum::<Vector3<f64>>() / near.len() as f64;
        *nearest <= FARTHEST * points.spacing && middle.norm() <= part * farthest
    });
    soup.faces.retain(|corners| corners.iter().all(|&v| is_scanned[v as usize]));
}
