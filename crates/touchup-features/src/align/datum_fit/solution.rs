//! Solution stage by stage, each within the freedoms left by those before it.

use nalgebra::{DMatrix, DVector, SVD, Vector3, Vector6};

use super::equations::Equations;
use super::error::DatumFitError;

/// Least change of the equations by a step of a fixed freedom, as a share of the step: chance
/// evidence fixes none, such as that of an axis with a lean of a degree for the turn about itself.
const LEAST_SHARE: f64 = 0.05;

/// The solution of the equations: step = −gain · misfits; open freedoms stay.
pub(super) struct Solution {
    pub gain: DMatrix<f64>,
    /// orthonormal columns: the open freedoms
    open: DMatrix<f64>,
}

impl Solution {
    /// Solves the equations; `None` if numbers are out of all proportion.
    pub(crate) fn of(equations: &Equations, stages: &[Vec<usize>]) -> Option<Self> {
        let mut gain = DMatrix::<f64>::zeros(6, equations.len());
        let mut open = DMatrix::<f64>::identity(6, 6);
        for stage in stages {
            let numbers: Vec<usize> = stage.iter().flat_map(|&pair| equations.all(pair)).collect();
            if open.ncols() == 0 || numbers.is_empty() {
                continue;
            }
            let rows = equations.rows.select_rows(&numbers);
            let [fixed, left] = parted(&(&rows * &open));
            if fixed.ncols() > 0 {
                let fixed = &open * fixed;
                let weights = numbers.iter().map(|&row| 1.0 / equations.stds[row]);
                let weights =
                    DMatrix::from_diagonal(&DVector::from_iterator(numbers.len(), weights));
                let weighted = &weights * &rows * &fixed;
                let inverse = weighted.pseudo_inverse(0.0).ok()?;
                // misfits left by the earlier stages
                let mut left_over = -(&rows * &gain);
                numbers
                    .iter()
                    .enumerate()
                    .for_each(|(at, &row)| left_over[(at, row)] += 1.0);
                gain += &fixed * inverse * weights * left_over;
            }
            open = &open * left;
        }
        Some(Self { gain, open })
    }

    /// # Errors
    /// [`DatumFitError::Free`]
    pub(crate) fn check_open(&self) -> Result<(), DatumFitError> {
        if self.open.ncols() == 0 {
            Ok(())
        } else {
            Err(free(&self.open))
        }
    }

    /// Step: shift, and turn as the shift at the lever, m.
    pub(crate) fn step(&self, equations: &Equations) -> Vector6<f64> {
        let step = -(&self.gain * &equations.misfits);
        Vector6::from_fn(|i, _| step[i])
    }
}

/// Orthonormal combinations of the columns that the rows fix, and those left open.
fn parted(rows: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    let columns = rows.ncols();
    // as many rows as columns, for a decomposition with all directions
    let square = rows
        .clone()
        .resize_vertically(rows.nrows().max(columns), 0.0);
    let svd = SVD::new(square, false, true);
    let of = |is_fixed: bool| {
        let chosen: Vec<_> = match &svd.v_t {
            Some(v_t) => (0..columns)
                .filter(|&i| (svd.singular_values[i] > LEAST_SHARE) == is_fixed)
                .map(|i| v_t.row(i).transpose())
                .collect(),
            None => Vec::new(),
        };
        if chosen.is_empty() {
            DMatrix::zeros(columns, 0)
        } else {
            DMatrix::from_columns(&chosen)
        }
    };
    [of(true), of(false)]
}

/// Splits the open freedoms into turns about axes, and shifts without a turn.
fn free(open: &DMatrix<f64>) -> DatumFitError {
    let [shift, turn] = [0, 3].map(|first| open.rows(first, 3).into_owned());
    let columns = open.ncols();
    let svd = SVD::new(turn.resize_vertically(3.max(columns), 0.0), false, true);
    let (mut turns, mut shifts) = (Vec::new(), Vec::new());
    for (i, row) in svd.v_t.iter().flat_map(|v_t| v_t.row_iter().enumerate()) {
        let along = row.transpose();
        let of = |part: &DMatrix<f64>| {
            (part * &along)
                .fixed_view::<3, 1>(0, 0)
                .into_owned()
                .try_normalize(0.0)
        };
        let is_turn = svd.singular_values[i] > LEAST_SHARE;
        let (part, all) = if is_turn {
            (&open.rows(3, 3).into_owned(), &mut turns)
        } else {
            (&shift, &mut shifts)
        };
        all.extend(of(part).map(|v: Vector3<f64>| upward(&v)));
    }
    DatumFitError::Free { turns, shifts }
}

/// The one of two opposite directions with a positive largest coordinate.
fn upward(direction: &Vector3<f64>) -> Vector3<f64> {
    if direction[direction.iamax()] < 0.0 {
        -direction
    } else {
        *direction
    }
}
