//! Mean and spread of points.

use std::ops::{Add, Div};

use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

/// Mean of some numbers or vectors; 0 without any.
pub fn mean<T>(values: impl Iterator<Item = T>) -> T
where
    T: Default + Add<Output = T> + Div<f64, Output = T>,
{
    let (sum, count) = values.fold((T::default(), 0usize), |(sum, count), value| {
        (sum + value, count + 1)
    });
    sum / count.max(1) as f64
}

/// Scatter of some vectors about their mean m, Σ (v − m)(v − m)ᵀ: symmetric, positive
/// semi-definite.
pub fn scatter<const D: usize>(
    vectors: impl Iterator<Item = SVector<f64, D>> + Clone,
) -> SMatrix<f64, D, D>
where
    SVector<f64, D>: Default,
{
    let mean = mean(vectors.clone());
    vectors.map(|v| (v - mean) * (v - mean).transpose()).sum()
}

/// Unit eigenvector of the least eigenvalue of a symmetric matrix: the normal of the plane of least
/// squares through points with this scatter.
pub fn thinnest_direction(scatter: Matrix3<f64>) -> Vector3<f64> {
    let eigen = scatter.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    eigen.eigenvectors.column(least).into_owned()
}

/// Root mean square distances of some vectors from their mean along their principal axes, in rising
/// order.
pub fn spreads(vectors: impl Iterator<Item = Vector3<f64>> + Clone) -> [f64; 3] {
    let count = vectors.clone().count() as f64;
    let mut spreads: [f64; 3] = (scatter(vectors) / count)
        .symmetric_eigenvalues()
        .map(|x| x.max(0.0).sqrt())
        .into();
    spreads.sort_by(f64::total_cmp);
    spreads
}

/// Mean of the points, m, and the root of their mean square distance from it, m.
pub fn centroid_and_spread<'a>(
    points: impl Iterator<Item = &'a Point3<f64>> + Clone,
) -> (Point3<f64>, f64) {
    let centroid = Point3::from(mean(points.clone().map(|p| p.coords)));
    let count = points.clone().count().max(1) as f64;
    (
        centroid,
        (points.map(|p| (p - centroid).norm_squared()).sum::<f64>() / count).sqrt(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> [Point3<f64>; 4] {
        [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| Point3::new(x, y, 5.0))
    }

    #[test]
    fn a_square_is_as_wide_as_its_half_diagonal() {
        assert_eq!(
            centroid_and_spread(corners().iter()),
            (Point3::new(1.0, 1.0, 5.0), 2f64.sqrt())
        );
    }

    #[test]
    fn a_square_scatters_alike_along_its_sides_and_not_across_itself() {
        let scatter = scatter(corners().iter().map(|p| p.coords));
        assert_eq!(
            scatter,
            Matrix3::from_diagonal(&Vector3::new(4.0, 4.0, 0.0))
        );
        assert_eq!(thinnest_direction(scatter).map(f64::abs), Vector3::z());
        assert_eq!(spreads(corners().iter().map(|p| p.coords)), [0.0, 1.0, 1.0]);
        assert_eq!(mean(std::iter::empty::<Vector3<f64>>()), Vector3::zeros());
    }
}
