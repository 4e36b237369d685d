//! Signed distance of points from a surface.

use nalgebra::Point3;

use super::CompareError;
use touchup_geometry::mesh::{
    FaceHit, FaceTree, TriMesh, Workers, coherent_order, map_by, pseudo_normal,
};

/// Finds the place of `mesh` closest to each of `points` and passes it to `take` with the index of
/// the point: each point once, neighbours after each other, for a warm cache.
///
/// - `points`: m, in the frame of `mesh`.
///
/// # Errors
/// [`CompareError::NotFinite`]; [`CompareError::NoFaces`] for an empty mesh.
pub fn closest_places(
    points: &[Point3<f64>],
    mesh: &TriMesh,
    tree: &FaceTree,
    mut take: impl FnMut(usize, &FaceHit),
) -> Result<(), CompareError> {
    let (order, ordered) = in_order(points)?;
    for (at, p) in order.into_iter().zip(&ordered) {
        take(
            at as usize,
            &tree
                .closest(mesh, p, f64::INFINITY)
                .ok_or(CompareError::NoFaces)?,
        );
    }
    Ok(())
}

/// Results of `evaluate` for each of `points` and its closest place, in their order; the same for
/// any `workers`.
///
/// # Errors
/// As [`closest_places`].
pub(super) fn at_closest_places<T: Send>(
    points: &[Point3<f64>],
    mesh: &TriMesh,
    tree: &FaceTree,
    workers: &dyn Workers,
    evaluate: impl Fn(&Point3<f64>, &FaceHit) -> T + Sync,
) -> Result<Vec<T>, CompareError> {
    let (order, ordered) = in_order(points)?;
    let values = map_by(workers, ordered.len(), |at| {
        tree.closest(mesh, &ordered[at], f64::INFINITY)
            .map(|hit| evaluate(&ordered[at], &hit))
    });
    let mut in_place: Vec<Option<T>> = points.iter().map(|_| None).collect();
    order
        .into_iter()
        .zip(values)
        .for_each(|(at, value)| in_place[at as usize] = value);
    in_place
        .into_iter()
        .map(|value| value.ok_or(CompareError::NoFaces))
        .collect()
}

/// Indices of the points with neighbours after each other, and the points in this order, for
/// contiguous reads.
fn in_order(points: &[Point3<f64>]) -> Result<(Vec<u32>, Vec<Point3<f64>>), CompareError> {
    check_finite(points)?;
    let order = coherent_order(points);
    let ordered = order.iter().map(|&at| points[at as usize]).collect();
    Ok((order, ordered))
}

/// Signed distance of each point from a surface, m: positive outside of it, negative in the
/// material.
///
/// - `points`: m, in the frame of `truth`.
/// - `workers`: threads for the search of closest places; the distances are the same to the last
///   bit.
///
/// # Errors
/// As [`closest_places`].
///
/// # Example
/// ```
/// use nalgebra::Point3;
/// use touchup_features::compare::deviations;
/// use touchup_geometry::mesh::{SerialWorkers, FaceTree, TriMesh};
/// let p = |x, y| Point3::new(x, y, 0.0);
/// let truth = TriMesh::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)], vec![[0, 1, 2]])?;
/// let points = [Point3::new(0.2, 0.2, 0.5), Point3::new(0.2, 0.2, -0.25)];
/// assert_eq!(deviations(&points, &truth, &FaceTree::new(&truth), &SerialWorkers)?, [0.5, -0.25]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn deviations(
    points: &[Point3<f64>],
    truth: &TriMesh,
    tree: &FaceTree,
    workers: &dyn Workers,
) -> Result<Vec<f64>, CompareError> {
    at_closest_places(points, truth, tree, workers, |p, hit| signed(p, truth, hit))
}

/// The distance between `p` and its closest place, m, negative behind the surface.
#[inline]
pub(super) fn signed(p: &Point3<f64>, mesh: &TriMesh, hit: &FaceHit) -> f64 {
    let is_inside = hit.barycentric.iter().all(|&share| share > 0.0);
    let normal = if is_inside {
        mesh.double_area_normal(hit.face)
    } else {
        pseudo_normal(mesh, hit)
    };
    hit.distance_squared
        .sqrt()
        .copysign((p - hit.point).dot(&normal))
}

/// Refuses points with non-finite coordinates.
pub(super) fn check_finite(points: &[Point3<f64>]) -> Result<(), CompareError> {
    let bad = points
        .iter()
        .position(|p| !p.coords.iter().all(|x| x.is_finite()));
    bad.map_or(Ok(()), |point| Err(CompareError::NotFinite { point }))
}
