//! A surface through points: Poisson reconstruction [Kazhdan 2006] by the library threecrate, without what it makes where nothing was scanned.

use nalgebra::{Point3, Vector3};
use threecrate_core::{NormalPoint3f, PointCloud, TriangleMesh};
use threecrate_reconstruction::{PoissonConfig, poisson_reconstruction};

use super::super::soup::Soup;
use super::cloud::Cloud;
use super::normals::{Neighbourhood, oriented};
use super::parallel;
use super::summary::CloudSummary;
use touchup_core::mesh::PointTree;

/// Fewer points make no surface: a plane is laid through as many neighbours, and half of them again are no neighbours.
const FEWEST: usize = 50;
/// More would take 16 GiB.
const MOST: usize = 20_000_000;
/// Points without others within this many spacings are left out, or one stray point would make the cells of all coarse.
const ISOLATED: f64 = 10.0;
/// Depths of the grid that the library takes, in powers of 2; each takes eight times the time and memory of the one before.
const DEPTHS: std::ops::RangeInclusive<u32> = 4..=8;
/// Cells of at most this many spacings: two to three faces for each point, and none of the detail that the noise leaves is lost.
const CELL: f64 = 1.5;
/// Squares on a side of the box of the grid for each point at most: few points in pieces far apart do not take the finest grid.
const SQUARES: usize = 64;
/// The box of the grid is larger than that of the points by as much of it on either side, as the library has it.
const PADDING: f64 = 0.1;
/// Residual at which the solution is left: at a tenth of it vertices come out within a hundredth of the noise of the same places.
const TOLERANCE: f64 = 1e-3;
/// A vertex without a point within this many spacings, or cells where they are larger, is invented.
const FARTHEST: f64 = 2.0;
/// Neighbours of a vertex, within this many spacings or cells, whose middle is farther from it than this part of the farthest: it lies
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
    let positions: Vec<_> = kept.iter().map(|&at| cloud.positions[at]).collect();
    let grid = PoissonGrid::around(&positions, spacing);
    let oriented_points = kept.iter().map(|&at| grid.point(&cloud.positions[at], &normals[at])).collect();
    summary.isolated = left - kept.len();
    summary.normals = source;
    summary.reconstruction = "Poisson (threecrate)";
    summary.spacing_mm = spacing * 1e3;
    summary.noise_mm = median(near.iter().map(|near| near.noise).collect()) * 1e3;
    summary.resolution_mm = grid.cell() * 1e3;
    drop((cloud, near, normals, kept));
    let mut soup = grid.solve(oriented_points)?;
    let made = soup.faces.len();
    cut_invented(&mut soup, &positions, spacing.max(grid.cell()));
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

/// The grid on which the library solves, in its own unit: the larger side of the points, so that `f32` is fine enough for any part.
#[derive(Clone, Copy, Debug)]
struct PoissonGrid {
    middle: Point3<f64>,
    /// m
    side: f64,
    depth: u32,
}

impl PoissonGrid {
    /// As coarse as the points allow, if the library can be as fine.
    fn around(positions: &[Point3<f64>], spacing: f64) -> Self {
        let [low, high] = positions.iter().fold([positions[0]; 2], |[low, high], p| [low.inf(p), high.sup(p)]);
        let grid = Self { middle: nalgebra::center(&low, &high), side: (high - low).amax(), depth: *DEPTHS.end() };
        let is_fine = |depth: &u32| Self { depth: *depth, ..grid }.cell() <= CELL * spacing;
        let holds_points = |depth: &u32| 1usize << (2 * depth) <= SQUARES * positions.len();
        let depths = DEPTHS.take_while(|depth| depth == DEPTHS.start() || holds_points(depth));
        let depth = depths.clone().find(is_fine).or(depths.last()).unwrap_or(*DEPTHS.start());
        Self { depth, ..grid }
    }

    /// m
    fn cell(&self) -> f64 {
        let cells = (1u64 << self.depth) - 1;
        self.side * (1.0 + 2.0 * PADDING) / cells as f64
    }

    fn point(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> NormalPoint3f {
        let position = Point3::from((p - self.middle) / self.side).cast();
        NormalPoint3f { position, normal: normal.cast() }
    }

    fn solve(&self, points: Vec<NormalPoint3f>) -> Result<Soup, CloudError> {
        let config = PoissonConfig { depth: self.depth, tolerance: TOLERANCE, ..PoissonConfig::default() };
        let made = poisson_reconstruction(&PointCloud::from_points(points), &config);
        let TriangleMesh { vertices, faces, .. } =
            made.map_err(|why| CloudError::NoSurface { reason: why.to_string() })?;
        let positions = vertices.iter().map(|v| self.middle + v.coords.cast() * self.side).collect();
        let faces = faces.iter().map(|corners| corners.map(|v| v as u32)).collect();
        Ok(Soup { positions, faces, unused: 0 })
    }
}

/// Leaves out the faces of which a vertex is not among the points.
///
/// - `reach`: spacing of the points or cell of the grid, whichever is larger, m.
fn cut_invented(soup: &mut Soup, positions: &[Point3<f64>], reach: f64) {
    let tree = PointTree::new(positions);
    let (count, within, part) = RIM_NEIGHBOURS;
    let is_scanned = parallel::map(soup.positions.len(), |at| {
        let vertex = soup.positions[at];
        let near: Vec<_> = tree.nearest(&vertex, count, within * reach).collect();
        let [Some((_, nearest)), Some((_, farthest))] = [near.first(), near.last()] else { return false };
        let middle = near.iter().map(|(at, _)| positions[*at] - vertex).sum::<Vector3<f64>>() / near.len() as f64;
        *nearest <= FARTHEST * reach && middle.norm() <= part * farthest
    });
    soup.faces.retain(|corners| corners.iter().all(|&v| is_scanned[v as usize]));
}
