//! The least largest residual of linear equations, exactly.
//!
//! For rows a and values r it finds the x with the least t such that |r − a·x| ≤ t. That is a
//! linear programme; its dual has a basis of as many rows as there are unknowns, t included, and
//! each exchange replaces one row by another until no residual is above t \[Stiefel 1960\].

use nalgebra::{SMatrix, SVector};

/// Maximum number of exchanges for each unknown; sound problems need two to five.
const MOST_EXCHANGES: usize = 60;
/// Least excess of a residual above t, as a share of the largest value: some thousand roundings.
const ABOVE: f64 = 1e-12;
/// Largest distance from the best result if rounding ends the exchange, as a share of the largest
/// value.
const NEAR: f64 = 1e-6;
/// Bound of each unknown, in units of the largest value over the largest entry of its column:
/// beyond it the rows do not determine it.
const BOUND: f64 = 1e5;
/// Least motion of a row that may leave the basis: below is rounding.
const LEAST_PIVOT: f64 = 1e-11;
/// Scaled turn of the aim, against two rows that leave the basis at once: rows of regular grids
/// would, and the exchange might go in a circle. It costs the same share of t.
const TURN: f64 = 1e-10;

/// One inequality g·y ≥ h of the basis.
#[derive(Clone, Copy)]
struct Inequality<const N: usize> {
    row: SVector<f64, N>,
    least: f64,
}

/// The equations with a largest value of 1, and 1 as the largest entry of each column.
struct ScaledEquations<'a, const N: usize> {
    rows: &'a [SVector<f64, N>],
    values: &'a [f64],
    /// largest value
    largest: f64,
    /// largest entry of each column; 1 for the residual itself
    scale: SVector<f64, N>,
}

impl<'a, const N: usize> ScaledEquations<'a, N> {
    const LAST: usize = N - 1;

    fn new(rows: &'a [SVector<f64, N>], values: &'a [f64], largest: f64) -> Self {
        let column = |j: usize| {
            rows.iter()
                .fold(0.0, |most: f64, row| most.max(row[j].abs()))
        };
        let scale = SVector::from_fn(|j, _| {
            if j == Self::LAST {
                1.0
            } else {
                column(j).max(f64::MIN_POSITIVE)
            }
        });
        Self {
            rows,
            values,
            largest,
            scale,
        }
    }

    /// a·x + t ≥ r of an equation.
    fn upper(&self, i: usize) -> Inequality<N> {
        Inequality {
            row: SVector::from_fn(|j, _| {
                if j == Self::LAST {
                    1.0
                } else {
                    self.rows[i][j] / self.scale[j]
                }
            }),
            least: self.values[i] / self.largest,
        }
    }

    /// −a·x + t ≥ −r of an equation.
    fn lower(&self, i: usize) -> Inequality<N> {
        let Inequality { row, least } = self.upper(i);
        Inequality {
            row: SVector::from_fn(|j, _| if j == Self::LAST { 1.0 } else { -row[j] }),
            least: -least,
        }
    }

    /// The first equation, and the bound of each unknown.
    fn first_basis(&self, aim: &SVector<f64, N>) -> [Inequality<N>; N] {
        let first = self.upper(0);
        std::array::from_fn(|j| {
            if j == Self::LAST {
                return first;
            }
            let side = (aim[j] - first.row[j]).signum();
            Inequality {
                row: SVector::from_fn(|k, _| if k == j { side } else { 0.0 }),
                least: -BOUND,
            }
        })
    }

    /// The equation of the largest residual, and that residual.
    fn worst(&self, y: &SVector<f64, N>) -> Option<(usize, f64)> {
        let x_of = |i: usize| {
            (0..Self::LAST)
                .map(|j| self.rows[i][j] / self.scale[j] * y[j])
                .sum::<f64>()
        };
        let residual = |i: usize| self.values[i] / self.largest - x_of(i);
        (0..self.rows.len())
            .map(|i| (i, residual(i)))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// The unknowns of the unscaled equations.
    fn unscaled(&self, y: &SVector<f64, N>) -> SVector<f64, N> {
        SVector::from_fn(|j, _| {
            if j == Self::LAST {
                0.0
            } else {
                y[j] * self.largest / self.scale[j]
            }
        })
    }
}

/// The x of the least largest |value − row·x|, and that residual; `None` if the exchange does not
/// end.
///
/// - `rows`: each with an unused last entry, in the place of the residual itself; x has 0 there.
pub(super) fn chebyshev<const N: usize>(
    rows: &[SVector<f64, N>],
    values: &[f64],
) -> Option<(SVector<f64, N>, f64)> {
    let last = N - 1;
    let largest = values
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    let is_finite = values.iter().all(|x| x.is_finite())
        && rows.iter().all(|row| row.iter().all(|x| x.is_finite()));
    if !is_finite || rows.is_empty() || rows.len() != values.len() {
        return None;
    }
    if largest == 0.0 {
        return Some((SVector::zeros(), 0.0));
    }
    let equations = ScaledEquations::new(rows, values, largest);
    // different entries, which break ties
    let aim = SVector::<f64, N>::from_fn(|j, _| {
        if j == last {
            1.0
        } else {
            TURN * (1.0 + (j as f64 + 2.0).sqrt())
        }
    });
    let mut basis = equations.first_basis(&aim);
    // the residual of any x is at least the best one, and t of a basis at most
    let (mut best, mut most, mut least) = (SVector::zeros(), f64::MAX, 0.0);
    for _ in 0..MOST_EXCHANGES * N {
        let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| basis[i].row[j]);
        let Some(inverse) = matrix.try_inverse() else {
            break;
        };
        let y = inverse * SVector::<f64, N>::from_fn(|i, _| basis[i].least);
        let worst = equations.worst(&y)?;
        least = y[last].max(least);
        if worst.1.abs() < most {
            most = worst.1.abs();
            best = equations.unscaled(&y);
        }
        if worst.1.abs() <= y[last] + ABOVE {
            break;
        }
        let entering = if worst.1 > 0.0 {
            equations.upper(worst.0)
        } else {
            equations.lower(worst.0)
        };
        let (shares, moves) = (inverse.tr_mul(&aim), inverse.tr_mul(&entering.row));
        let can_leave = (0..N).filter(|&i| moves[i] > LEAST_PIVOT);
        let leaving =
            can_leave.min_by(|&i, &j| (shares[i] / moves[i]).total_cmp(&(shares[j] / moves[j])));
        let Some(leaving) = leaving else { break };
        basis[leaving] = entering;
    }
    (most <= least + NEAR).then_some((best, most * largest))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// The best line of x² on [0, 1] is x − 1/8, which is off by 1/8 at 0, 1/2 and 1.
    #[test]
    fn the_best_line_of_a_parabola_touches_it_three_times() {
        let at: Vec<f64> = (0..=100).map(|i| f64::from(i) / 100.0).collect();
        let rows: Vec<_> = at.iter().map(|x| Vector3::new(1.0, *x, 0.0)).collect();
        let values: Vec<f64> = at.iter().map(|x| x * x).collect();
        let (line, off) = chebyshev(&rows, &values).unwrap();
        assert!(
            (line - Vector3::new(-0.125, 1.0, 0.0)).norm() < 1e-8 && (off - 0.125).abs() < 1e-9,
            "{line} {off}"
        );
    }

    /// The middle of the smallest and largest value, among repeated values.
    #[test]
    fn the_best_constant_is_between_the_ends() {
        let values = [3.0, -1.0, 3.0, 2.0, -1.0, -1.0, 3.0];
        let (x, off) = chebyshev(&[Vector2::new(2.0, 0.0); 7], &values).unwrap();
        assert!(
            (x[0] - 0.5).abs() < 1e-12 && (off - 2.0).abs() < 1e-12,
            "{x} {off}"
        );
        assert_eq!(chebyshev::<2>(&[], &[]), None);
        assert_eq!(chebyshev(&[Vector2::new(1.0, 0.0)], &[f64::NAN]), None);
        assert_eq!(
            chebyshev(&[Vector2::new(1.0, 0.0)], &[0.0]),
            Some((Vector2::zeros(), 0.0))
        );
    }

    /// No small step in any direction makes the largest residual less; as the problem is convex, it
    /// is the least.
    #[test]
    fn no_step_makes_the_largest_residual_less() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        for _ in 0..20 {
            let mut random = || rng.random_range(-1.0..1.0);
            let rows: Vec<SVector<f64, 6>> = (0..200)
                .map(|_| {
                    SVector::from([
                        random(),
                        1e-3 * random(),
                        random(),
                        1.0,
                        50.0 * random(),
                        0.0,
                    ])
                })
                .collect();
            let values: Vec<f64> = rows.iter().map(|_| 1e-5 * random()).collect();
            let (x, off) = chebyshev(&rows, &values).unwrap();
            let worst = |x: &SVector<f64, 6>| {
                rows.iter()
                    .zip(&values)
                    .map(|(row, value)| (value - row.dot(x)).abs())
                    .fold(0.0, f64::max)
            };
            assert!((worst(&x) - off).abs() < 1e-15);
            for _ in 0..300 {
                let step = SVector::from([
                    random(),
                    1e3 * random(),
                    random(),
                    random(),
                    0.02 * random(),
                    0.0,
                ]) * 1e-8;
                assert!(worst(&(x + step)) > off * (1.0 - 1e-9));
            }
        }
    }
}
