//! Weighted least squares by the normal equations: linear, or by damped steps if nonlinear.

use nalgebra::{SMatrix, SVector};

/// Sums over rows a, values z and weights w that determine the x of least Σ w (a·x − z)².
///
/// The sum is Σ w z² − 2 `right`·x + x·`information` x, and least for `information` x = `right`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalEquations<const N: usize> {
    /// Σ w a aᵀ: symmetric to rounding, positive semi-definite
    pub information: SMatrix<f64, N, N>,
    /// Σ w z a
    pub right: SVector<f64, N>,
    /// Σ w z²
    pub square: f64,
}

impl<const N: usize> Default for NormalEquations<N> {
    fn default() -> Self {
        Self {
            information: SMatrix::zeros(),
            right: SVector::zeros(),
            square: 0.0,
        }
    }
}

impl<const N: usize> NormalEquations<N> {
    /// Sums of rows and values of weight 1.
    pub fn of(rows: impl IntoIterator<Item = (SVector<f64, N>, f64)>) -> Self {
        let mut sums = Self::default();
        rows.into_iter()
            .for_each(|(row, value)| sums.add(&row, value, 1.0));
        sums
    }

    /// Adds w (a·x − z)².
    #[inline]
    pub fn add(&mut self, row: &SVector<f64, N>, value: f64, weight: f64) {
        self.information.ger(weight, row, row, 1.0);
        self.right.axpy(weight * value, row, 1.0);
        self.square += weight * value * value;
    }

    /// These sums without those of some rows.
    pub fn without(&self, some: &Self) -> Self {
        Self {
            information: self.information - some.information,
            right: self.right - some.right,
            square: self.square - some.square,
        }
    }

    /// Adds rows and values with weights that depend on the residuals at `x`; returns the sum of
    /// the weights.
    ///
    /// - `weight`: from the number of a row and its residual at `x`.
    pub fn add_reweighted(
        &mut self,
        rows: impl IntoIterator<Item = (SVector<f64, N>, f64)>,
        x: &SVector<f64, N>,
        mut weight: impl FnMut(usize, f64) -> f64,
    ) -> f64 {
        let add = |(at, (row, value)): (usize, (SVector<f64, N>, f64))| {
            let weight = weight(at, value - row.dot(x));
            self.add(&row, value, weight);
            weight
        };
        rows.into_iter().enumerate().map(add).sum()
    }

    /// These equations with a share of the diagonal added to the information; a larger share
    /// shortens the solution.
    pub fn damped(mut self, share: f64) -> Self {
        self.information += SMatrix::from_diagonal(&(self.information.diagonal() * share));
        self
    }

    /// The x of least squares; `None` if the rows do not determine it.
    pub fn solution(&self) -> Option<SVector<f64, N>> {
        Some(self.information.cholesky()?.solve(&self.right))
    }

    /// Σ w (a·x − z)² at a [`NormalEquations::solution`].
    pub fn residual_square(&self, solution: &SVector<f64, N>) -> f64 {
        self.square - solution.dot(&self.right)
    }
}

/// Damped least squares \[Levenberg 1944, Marquardt 1963\]: rules of damping and stopping.
#[derive(Clone, Copy, Debug)]
pub struct DampedSearch {
    /// damping of the first step
    pub first: f64,
    /// factor of the damping after a step that helps, and after one that does not
    pub factors: [f64; 2],
    /// lower bound of the damping
    pub least: f64,
    /// damping beyond which no step can help
    pub most: f64,
    /// maximum number of steps
    pub tries: usize,
}

/// Reason for the end of a [`DampedSearch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchEnd {
    /// at the least cost, to rounding
    Converged,
    /// the equations determine no step
    Singular,
    /// after the last step
    Unsettled,
}

impl DampedSearch {
    /// Searches from a place with its cost for the least cost nearby.
    ///
    /// - `equations`: undamped equations of a step from a place.
    /// - `damped`: the same with the given damping.
    /// - `better`: the place after a step and its cost, if better than the cost before.
    /// - `is_last`: whether a completed step is the last.
    pub fn run<T, const N: usize>(
        &self,
        (mut place, mut cost): (T, f64),
        equations: impl Fn(&T) -> NormalEquations<N>,
        damped: impl Fn(NormalEquations<N>, f64) -> NormalEquations<N>,
        better: impl Fn(&T, &SVector<f64, N>, f64) -> Option<(T, f64)>,
        is_last: impl Fn(&SVector<f64, N>, &NormalEquations<N>) -> bool,
    ) -> (T, f64, SearchEnd) {
        let (mut damping, mut here) = (self.first, equations(&place));
        for _ in 0..self.tries {
            let Some(step) = damped(here, damping).solution() else {
                return (place, cost, SearchEnd::Singular);
            };
            let factor = if let Some(next) = better(&place, &step, cost) {
                (place, cost) = next;
                if is_last(&step, &here) {
                    return (place, cost, SearchEnd::Converged);
                }
                here = equations(&place);
                self.factors[0]
            } else {
                self.factors[1]
            };
            damping = (damping * factor).max(self.least);
            if damping > self.most {
                return (place, cost, SearchEnd::Converged);
            }
        }
        (place, cost, SearchEnd::Unsettled)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    /// For the line through (0, 1), (1, 2), (2, 5): slope 2, height 2/3 at 0, residual 2/3.
    #[test]
    fn a_line_through_three_points_is_that_of_the_textbook() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, 5.0)];
        let sums = NormalEquations::of(points.map(|(x, y)| (Vector2::new(1.0, x), y)));
        let line = sums.solution().unwrap();
        assert!(
            (line - Vector2::new(2.0 / 3.0, 2.0)).norm() < 1e-14,
            "{line}"
        );
        assert!((sums.residual_square(&line) - 2.0 / 3.0).abs() < 1e-13);
    }

    #[test]
    fn a_weight_of_two_counts_as_two_rows() {
        let (row, other) = (Vector2::new(1.0, -2.0), Vector2::new(0.5, 1.0));
        let mut weighted = NormalEquations::of([(other, 3.0)]);
        weighted.add(&row, 4.0, 2.0);
        assert_eq!(
            weighted,
            NormalEquations::of([(other, 3.0), (row, 4.0), (row, 4.0)])
        );
    }

    #[test]
    fn parallel_rows_determine_nothing() {
        assert_eq!(
            NormalEquations::of([(Vector2::new(1.0, 0.0), 1.0)]).solution(),
            None
        );
    }

    /// The bent valley of Rosenbrock, as two residuals 1 − x and 10 (y − x²): its least is 0 at (1,
    /// 1).
    #[test]
    fn damped_steps_follow_a_bent_valley_to_its_end() {
        let residuals = |p: &Vector2<f64>| [1.0 - p.x, 10.0 * (p.y - p.x * p.x)];
        let cost = |p: &Vector2<f64>| residuals(p).map(|r| r * r).iter().sum::<f64>();
        let rows = |p: &Vector2<f64>| [Vector2::new(-1.0, 0.0), Vector2::new(-20.0 * p.x, 10.0)];
        let search = DampedSearch {
            first: 1e-3,
            factors: [0.1, 10.0],
            least: 1e-12,
            most: 1e9,
            tries: 200,
        };
        let start = Vector2::new(-1.2, 1.0);
        let (end, left, why) = search.run(
            (start, cost(&start)),
            |p| NormalEquations::of(rows(p).into_iter().zip(residuals(p).map(|r| -r))),
            NormalEquations::damped,
            |p, step, before| {
                Some((p + step, cost(&(p + step)))).filter(|(_, after)| *after <= before)
            },
            |step, _| step.norm() < 1e-12,
        );
        assert!(
            (end - Vector2::new(1.0, 1.0)).norm() < 1e-9 && left < 1e-18,
            "{end} {left}"
        );
        assert_eq!(why, SearchEnd::Converged);
    }
}
