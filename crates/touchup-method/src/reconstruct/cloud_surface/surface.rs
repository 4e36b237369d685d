//! From points to faces: normals, field, contour; without the faces that no point supports.

use nalgebra::{Point3, Vector3};

use super::clean::UsablePoints;
use super::moving_least_squares::OrientedPoints;
use super::normals::{PointNeighbourhood, oriented};
use super::summary::CloudSummary;
use crate::reconstruct::lattice::Lattice;
use touchup_geometry::mesh::{PointCloud, PointTree, Workers, map_by};
use touchup_geometry::numeric::{DisjointSets, median};

/// Minimum number of points: a plane fit takes half of them as neighbours, the others lie farther
/// away.
const FEWEST: usize = 50;
/// Maximum number of points: more need some 10 GB.
const MOST: usize = 20_000_000;
/// Points without others within this many spacings are left out: one stray point would coarsen all
/// cells.
const ISOLATED: f64 = 10.0;
/// Edge of the cells, in spacings: each cell on the surface holds points, and each point yields two
/// to three faces.
const CELL: f64 = 1.3;
/// Offset of the lattice planes, in cells, off the coordinates to which scanners round.
const ORIGIN: [f64; 3] = [0.164_607_9, 0.312_756_1, 0.460_895_1];
/// Error of a smooth surface, in standard deviations of the averaged noise: 0.29 on a plate, 0.31
/// and 0.33 on balls.
const ERROR_SHARE: f64 = 1.0 / 3.0;
/// Spacings to the nearest point beyond which a vertex is unsupported.
const FARTHEST: f64 = 2.2;
/// Rim test of a vertex: number of neighbours, their range in spacings, and the offset of their
/// middle, as a share of the farthest, above which the vertex is outside the scanned area. On the
/// rim of an even surface the middle is 4/(3π) = 0.42 away, at the corner of a cube 0.49.
const RIM_NEIGHBOURS: (u32, f64, f64) = (64, 3.0, 0.5);

/// Maximum number of adjacent vertices in a chance hole: of a million random points some form a
/// rim.
const PINHOLE: usize = 3;

/// Reasons why points make no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// Too few usable points.
    #[error(
        "only {left} of its {points} points are of use and at least {FEWEST} are needed: scan the part more densely"
    )]
    TooFew {
        /// usable points
        left: usize,
        /// points of the file
        points: usize,
    },
    /// More points than memory allows.
    #[error("{points} points are more than {MOST}: thin it out first, by a voxel grid for example")]
    TooMany {
        /// points of the file
        points: usize,
    },
    /// The field has no zero set near the points.
    #[error(
        "no surface passes through its {points} points: look at it in a viewer, and export it again or as a mesh"
    )]
    NoSurface {
        /// points of the file
        points: usize,
    },
}

/// Triangle surface of a point cloud.
#[derive(Clone, Debug)]
pub struct CloudSurface {
    /// V, m, in O
    pub positions: Vec<Point3<f64>>,
    /// F × 3, counter-clockwise seen from outside; not every vertex is in one
    pub faces: Vec<[u32; 3]>,
    /// report on the reconstruction
    pub summary: CloudSummary,
}

/// The surface through the points of a scan, open at its limits: the zero set of implicit moving
/// least squares of the points \[Kolluri 2005\], by dual contouring in cells of 1.3 point spacings.
///
/// Leaves out non-finite, duplicate and isolated points. The result does not depend on the number
/// of workers.
///
/// # Errors
/// [`CloudError`]: one line with the remedy.
pub fn surface_of_cloud(
    cloud: PointCloud,
    workers: &dyn Workers,
) -> Result<CloudSurface, CloudError> {
    let (points, mut summary) = UsablePoints::of(cloud);
    let (count, left) = (summary.points, points.positions.len());
    if left > MOST {
        return Err(CloudError::TooMany { points: count });
    }
    if left < FEWEST {
        return Err(CloudError::TooFew {
            left,
            points: count,
        });
    }
    let tree = PointTree::new(&points.positions);
    let near = PointNeighbourhood::of_all(&points.positions, &tree, workers);
    let median_of = |number: fn(&PointNeighbourhood) -> f64| {
        median(&mut near.iter().map(number).collect::<Vec<_>>()).unwrap_or_default()
    };
    let spacing = median_of(|near| near.spacing);
    let noise = median_of(|near| near.noise);
    let (normals, source) = oriented(&points, &near);
    let kept: Vec<usize> = (0..left)
        .filter(|&at| near[at].spacing <= ISOLATED * spacing)
        .collect();
    if kept.len() < FEWEST {
        return Err(CloudError::TooFew {
            left: kept.len(),
            points: count,
        });
    }
    drop((tree, near));
    let positions = kept.iter().map(|&at| points.positions[at]).collect();
    let points = OrientedPoints::new(
        positions,
        kept.iter().map(|&at| normals[at]).collect(),
        spacing,
        noise,
    );
    let lattice = Lattice {
        origin: Point3::from(Vector3::from(ORIGIN) * CELL * spacing),
        pitch: CELL * spacing,
    };
    let (positions, mut faces) = points.contoured(&lattice, workers);
    let made = faces.len();
    cut_invented(&positions, &mut faces, &points, workers);
    if faces.is_empty() {
        return Err(CloudError::NoSurface { points: count });
    }
    summary.isolated = left - kept.len();
    summary.normals = source;
    summary.reconstruction = "implicit moving least squares";
    summary.spacing_mm = spacing * 1e3;
    summary.noise_mm = noise * 1e3;
    summary.error_mm = ERROR_SHARE * noise * 1e3;
    summary.resolution_mm = lattice.pitch * 1e3;
    summary.faces = faces.len();
    summary.cut_faces = made - faces.len();
    Ok(CloudSurface {
        positions,
        faces,
        summary,
    })
}

/// Removes faces with a vertex outside the scanned area.
fn cut_invented(
    vertices: &[Point3<f64>],
    faces: &mut Vec<[u32; 3]>,
    points: &OrientedPoints,
    workers: &dyn Workers,
) {
    let (count, within, part) = RIM_NEIGHBOURS;
    let mut is_scanned = map_by(workers, vertices.len(), |at| {
        let vertex = vertices[at];
        let near: Vec<_> = points
            .tree
            .nearest(&vertex, count, within * points.spacing)
            .collect();
        let [Some((_, nearest)), Some((_, farthest))] = [near.first(), near.last()] else {
            return false;
        };
        let arms = near.iter().map(|(at, _)| points.positions[*at] - vertex);
        let middle = arms.sum::<Vector3<f64>>() / near.len() as f64;
        *nearest <= FARTHEST * points.spacing && middle.norm() <= part * farthest
    });
    keep_pinholes_closed(faces, &mut is_scanned);
    faces.retain(|corners| corners.iter().all(|&v| is_scanned[v as usize]));
}

/// Marks the vertices of the smallest holes as scanned; gaps open to a rim stay.
fn keep_pinholes_closed(faces: &[[u32; 3]], is_scanned: &mut [bool]) {
    let is_invented = |v: &u32| !is_scanned[*v as usize];
    let at_invented = faces
        .iter()
        .filter(|corners| corners.iter().any(is_invented));
    let mut edges: Vec<[u32; 2]> = at_invented
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    edges.sort_unstable();
    let mut sets = DisjointSets::of(is_scanned.len());
    edges
        .iter()
        .filter(|edge| edge.iter().all(is_invented))
        .for_each(|&[a, b]| sets.join(a, b));
    let mut sizes = vec![0; is_scanned.len()];
    let invented: Vec<u32> = (0..is_scanned.len() as u32).filter(is_invented).collect();
    invented
        .iter()
        .for_each(|&v| sizes[sets.root(v) as usize] += 1);
    for &[a, b] in edges
        .iter()
        .filter(|[a, b]| edges.binary_search(&[*b, *a]).is_err())
    {
        [a, b]
            .iter()
            .filter(|v| is_invented(v))
            .for_each(|&v| sizes[sets.root(v) as usize] = usize::MAX);
    }
    for v in invented {
        is_scanned[v as usize] = sizes[sets.root(v) as usize] <= PINHOLE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pinhole_closes_and_a_hole_and_a_rim_stay_as_they_are() {
        // a square of 12 by 12 vertices
        let at = |x: u32, y: u32| 12 * y + x;
        let cells = (0..11).flat_map(|y| (0..11).map(move |x| (x, y)));
        let halves = |(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        let faces: Vec<_> = cells.flat_map(halves).collect();
        let pinhole = [at(3, 3), at(4, 3)];
        let hole = [at(7, 7), at(8, 7), at(7, 8), at(8, 8)];
        let rim = [at(0, 5), at(1, 5)];
        let mut is_scanned = vec![true; 144];
        [&pinhole[..], &hole, &rim]
            .concat()
            .iter()
            .for_each(|&v| is_scanned[v as usize] = false);
        keep_pinholes_closed(&faces, &mut is_scanned);
        let left: Vec<u32> = (0..144).filter(|&v| !is_scanned[v as usize]).collect();
        assert_eq!(
            left,
            [at(0, 5), at(1, 5), at(7, 7), at(8, 7), at(7, 8), at(8, 8)]
        );
    }
}
