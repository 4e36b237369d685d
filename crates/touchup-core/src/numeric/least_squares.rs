//! Weighted linear least squares by the normal equations.

use nalgebra::{SMatrix, SVector};

/// Sums over rows a, values z and weights w that determine the x of least Σ w (a·x − z)².
///
/// That is Σ w z² − 2 `right`·x + x·`information` x, and its least is where `information` x = `right`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalEquations<const N: usize> {
    /// Σ w a aᵀ: symmetric to rounding, positive semi-definite
    pub information: SMatrix<f64, N, N>,
    /// Σ w z a
    pub right: SVector<f64, N>,
    /// Σ w z²
    pub square: f64,
}

impl<const N: usize> Default for NormalEquations<N> {
    fn default() -> Self {
        Self { information: SMatrix::zeros(), right: SVector::zeros(), square: 0.0 }
    }
}

impl<const N: usize> NormalEquations<N> {
    /// Of rows and values of weight 1.
    pub fn of(rows: impl IntoIterator<Item = (SVector<f64, N>, f64)>) -> Self {
        let mut sums = Self::default();
        rows.into_iter().for_each(|(row, value)| sums.add(&row, value, 1.0));
        sums
    }

    /// Takes in w (a·x − z)².
    #[inline]
    pub fn add(&mut self, row: &SVector<f64, N>, value: f64, weight: f64) {
        self.information.ger(weight, row, row, 1.0);
        self.right.axpy(weight * value, row, 1.0);
        self.square += weight * value * value;
    }

    /// The x of least squares; `None` where the rows do not determine it.
    pub fn solution(&self) -> Option<SVector<f64, N>> {
        Some(self.information.cholesky()?.solve(&self.right))
    }

    /// Σ w (a·x − z)² at a [`NormalEquations::solution`].
    pub fn residual_square(&self, solution: &SVector<f64, N>) -> f64 {
        self.square - solution.dot(&self.right)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    /// Of a line through (0, 1), (1, 2), (2, 5): slope 2, height 2/3 at 0, and 2/3 is left.
    #[test]
    fn a_line_through_three_points_is_that_of_the_textbook() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, 5.0)];
        let sums = NormalEquations::of(points.map(|(x, y)| (Vector2::new(1.0, x), y)));
        let line = sums.solution().unwrap();
        assert!((line - Vector2::new(2.0 / 3.0, 2.0)).norm() < 1e-14, "{line}");
        assert!((sums.residual_square(&line) - 2.0 / 3.0).abs() < 1e-13);
    }

    #[test]
    fn a_weight_of_two_counts_as_two_rows() {
        let (row, other) = (Vector2::new(1.0, -2.0), Vector2::new(0.5, 1.0));
        let mut weighted = NormalEquations::of([(other, 3.0)]);
        weighted.add(&row, 4.0, 2.0);
        assert_eq!(weighted, NormalEquations::of([(other, 3.0), (row, 4.0), (row, 4.0)]));
    }

    #[test]
    fn parallel_rows_determine_nothing() {
        assert_eq!(NormalEquations::of([(Vector2::new(1.0, 0.0), 1.0)]).solution(), None);
    }
}
