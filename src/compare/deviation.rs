//! How far points are from a surface, and on which side of it.

use nalgebra::Point3;

use super::CompareError;
use crate::mesh::{FaceHit, FaceTree, TriMesh, coherent_order, pseudo_normal};

/// Finds the place of `mesh` closest to each of `points` and hands it to `take` with the number of the point: each point
/// once, in an order in which neighbours follow each other, so that what one query has read is still at hand for the next.
///
/// - `points`: m, in the frame of `mesh`.
///
/// # Errors
/// [`CompareError::NotFinite`]; [`CompareError::NoFaces`] where the mesh has none.
pub fn closest_places(
    points: &[Point3<f64>],
    mesh: &TriMesh,
    tree: &FaceTree,
    mut take: impl FnMut(usize, &FaceHit),
) -> Result<(), CompareError> {
    check_finite(points)?;
    for at in coherent_order(points) {
        let at = at as usize;
        let hit = tree.closest(mesh, &points[at], f64::INFINITY).ok_or(CompareError::NoFaces)?;
        take(at, &hit);
    }
    Ok(())
}

/// Signed distance of each point from a surface, m: positive outside of it, negative in the material.
///
/// - `points`: m, in the frame of `truth`.
///
/// # Errors
/// As [`closest_places`].
///
/// # Example
/// ```
/// use nalgebra::Point3;
/// use touchup::compare::deviations;
/// use touchup::mesh::{FaceTree, TriMesh};
/// let p = |x, y| Point3::new(x, y, 0.0);
/// let truth = TriMesh::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)], vec![[0, 1, 2]])?;
/// let points = [Point3::new(0.2, 0.2, 0.5), Point3::new(0.2, 0.2, -0.25)];
/// assert_eq!(deviations(&points, &truth, &FaceTree::new(&truth))?, [0.5, -0.25]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn deviations(points: &[Point3<f64>], truth: &TriMesh, tree: &FaceTree) -> Result<Vec<f64>, CompareError> {
    let mut found = vec![0.0; points.len()];
    closest_places(points, truth, tree, |at, hit| found[at] = signed(&points[at], truth, hit))?;
    Ok(found)
}

/// The distance between `p` and its closest place, m, negative where `p` is behind it.
#[inline]
pub(super) fn signed(p: &Point3<f64>, mesh: &TriMesh, hit: &FaceHit) -> f64 {
    let is_inside = hit.barycentric.iter().all(|&share| share > 0.0);
    let normal = if is_inside { mesh.double_area_normal(hit.face) } else { pseudo_normal(mesh, hit) };
    hit.distance_squared.sqrt().copysign((p - hit.point).dot(&normal))
}

/// Refuses what is no place.
pub(super) fn check_finite(points: &[Point3<f64>]) -> Result<(), CompareError> {
    match points.iter().position(|p| !p.coords.iter().all(|x| x.is_finite())) {
        Some(point) => Err(CompareError::NotFinite { point }),
        None => Ok(()),
    }
}
