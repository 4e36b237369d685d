//! Distance from point to point: both shapes as clouds, as in the paper's Fig 20.

use nalgebra::Point3;

use super::CompareError;
use super::deviation::check_finite;
use touchup_geometry::mesh::{PointTree, Workers, coherent_order, map_pieces_by};

/// Points in one run of consecutive searches.
const RUN: usize = 1024;
/// Minimum number of runs for a thread.
const FEWEST_RUNS: usize = 4;
/// Factor that widens a distance bound, so that rounding never excludes the point behind it.
const WIDENED: f64 = 1.0 + 1e-9;

/// Distance from each of `points` to the nearest point of `cloud`, m.
///
/// It approximates the distance of the surfaces only for a dense cloud: it includes half the
/// spacing.
///
/// - `workers`: threads for the search; the distances are the same to the last bit.
///
/// # Errors
/// [`CompareError::NotFinite`] of either; [`CompareError::NoPoints`],
/// [`CompareError::TooManyPoints`].
pub fn cloud_distances(
    points: &[Point3<f64>],
    cloud: &[Point3<f64>],
    workers: &dyn Workers,
) -> Result<Vec<f64>, CompareError> {
    check_finite(points)?;
    check_finite(cloud)?;
    if cloud.len() > PointTree::MOST_POINTS {
        return Err(CompareError::TooManyPoints {
            points: cloud.len(),
            most: PointTree::MOST_POINTS,
        });
    }
    if cloud.is_empty() {
        return Err(CompareError::NoPoints);
    }
    let tree = PointTree::new(cloud);
    let order = coherent_order(points);
    let runs: Vec<&[u32]> = order.chunks(RUN).collect();
    let found = map_pieces_by(workers, runs.len(), FEWEST_RUNS, |run| {
        run_distances(points, runs[run], cloud, &tree)
    });
    let mut distances = vec![f64::INFINITY; points.len()];
    order
        .iter()
        .zip(found.into_iter().flatten())
        .for_each(|(&at, distance)| distances[at as usize] = distance);
    Ok(distances)
}

/// Distances of one run of neighbours, in its order. A point's nearest cloud point bounds the
/// distance of the next point: far away, many cloud points are almost equally near, and the bound
/// leaves fewer to search.
fn run_distances(
    points: &[Point3<f64>],
    run: &[u32],
    cloud: &[Point3<f64>],
    tree: &PointTree,
) -> Vec<f64> {
    let mut last: Option<usize> = None;
    let distance = |at: &u32| {
        let p = &points[*at as usize];
        let bound = last.map_or(f64::INFINITY, |near| {
            (p - cloud[near]).norm() * WIDENED + tree.resolution()
        });
        last = tree.nearest(p, 1, bound).next().map(|(near, _)| near);
        last.map_or(f64::INFINITY, |near| (p - cloud[near]).norm())
    };
    run.iter().map(distance).collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardUniform};
    use rand_pcg::Pcg64;

    use super::*;
    use touchup_geometry::mesh::SerialWorkers;

    #[test]
    fn the_nearest_of_a_lattice_is_found_also_from_far_away() {
        let lattice: Vec<_> = (0..1000)
            .map(|i| Point3::new((i % 10).into(), (i / 10 % 10).into(), (i / 100).into()))
            .collect();
        let points = [
            Point3::new(3.1, 4.0, 5.0),
            Point3::new(-3.0, 0.0, 4.0),
            Point3::new(9.0, 9.0, 109.0),
        ];
        let found = cloud_distances(&points, &lattice, &SerialWorkers).unwrap();
        for (found, by_hand) in found.iter().zip([0.1, 3.0, 100.0]) {
            assert!((found - by_hand).abs() < 1e-12, "{found}");
        }
    }

    /// More than one run, near, on and far beside the cloud: against every distance.
    #[test]
    fn many_points_have_the_distances_that_all_pairs_give() {
        let mut rng = Pcg64::new(1, 1);
        let mut random = || -> f64 { StandardUniform.sample(&mut rng) };
        let mut spread = |count: usize, low: f64| -> Vec<Point3<f64>> {
            (0..count)
                .map(|_| Point3::new(low + random(), random(), 0.1 * random()))
                .collect()
        };
        let cloud = spread(500, 0.0);
        let points = [spread(1500, 0.0), cloud.clone(), spread(1500, 40.0)].concat();
        let found = cloud_distances(&points, &cloud, &SerialWorkers).unwrap();
        for (p, found) in points.iter().zip(found) {
            let by_hand = cloud
                .iter()
                .map(|near| (p - near).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                (found - by_hand).abs() < 1e-12,
                "{p}: {found} and {by_hand}"
            );
        }
    }

    #[test]
    fn points_closer_than_the_tree_can_halve_are_no_trouble() {
        let x = 0.1_f64;
        let cloud: Vec<_> = (0..40)
            .map(|i| Point3::new(if i % 2 == 0 { x } else { x.next_up() }, 0.0, 0.0))
            .collect();
        assert_eq!(
            cloud_distances(&[Point3::new(x, 1.0, 0.0)], &cloud, &SerialWorkers).unwrap(),
            [1.0]
        );
        assert_eq!(
            cloud_distances(&[Point3::origin()], &[], &SerialWorkers),
            Err(CompareError::NoPoints)
        );
    }
}
