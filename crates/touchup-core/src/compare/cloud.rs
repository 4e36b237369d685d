//! Distance from point to point: both shapes taken for clouds, as in the paper's Fig 20.

use nalgebra::Point3;

use super::CompareError;
use super::deviation::check_finite;
use crate::mesh::{PointTree, coherent_order};

/// Distance from each of `points` to the nearest point of `cloud`, m.
///
/// It is the distance of the surfaces only where the cloud is dense against it: half the spacing is in it.
///
/// # Errors
/// [`CompareError::NotFinite`] of either; [`CompareError::NoPoints`], [`CompareError::TooManyPoints`].
pub fn cloud_distances(points: &[Point3<f64>], cloud: &[Point3<f64>]) -> Result<Vec<f64>, CompareError> {
    check_finite(points)?;
    check_finite(cloud)?;
    if cloud.len() > PointTree::MOST_POINTS {
        return Err(CompareError::TooManyPoints { points: cloud.len(), most: PointTree::MOST_POINTS });
    }
    if cloud.is_empty() {
        return Err(CompareError::NoPoints);
    }
    let tree = PointTree::new(cloud);
    let mut distances = vec![f64::INFINITY; points.len()];
    for at in coherent_order(points) {
        let p = &points[at as usize];
        if let Some((nearest, _)) = tree.nearest(p, 1, f64::INFINITY).next() {
            distances[at as usize] = (p - cloud[nearest]).norm();
        }
    }
    Ok(distances)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_a_lattice_is_found_also_from_far_away() {
        let lattice: Vec<_> =
            (0..1000).map(|i| Point3::new((i % 10).into(), (i / 10 % 10).into(), (i / 100).into())).collect();
        let points = [Point3::new(3.1, 4.0, 5.0), Point3::new(-3.0, 0.0, 4.0), Point3::new(9.0, 9.0, 109.0)];
        let found = cloud_distances(&points, &lattice).unwrap();
        for (found, by_hand) in found.iter().zip([0.1, 3.0, 100.0]) {
            assert!((found - by_hand).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn points_closer_than_the_tree_can_halve_are_no_trouble() {
        let x = 0.1_f64;
        let cloud: Vec<_> = (0..40).map(|i| Point3::new(if i % 2 == 0 { x } else { x.next_up() }, 0.0, 0.0)).collect();
        assert_eq!(cloud_distances(&[Point3::new(x, 1.0, 0.0)], &cloud).unwrap(), [1.0]);
        assert_eq!(cloud_distances(&[Point3::origin()], &[]), Err(CompareError::NoPoints));
    }
}
