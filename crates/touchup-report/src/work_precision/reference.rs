//! The reference solution, by an independent method: the equations in the plane of normal and force, with the angle θ between
//! them for an unknown, by Radau IIA of order 5 with Newton's method, each stretch of time halved until one step and two half
//! steps agree.
//!
//! ```text
//! ds/dt = α (|F| cos θ − f)      dθ/dt = −β |F| f sin θ      n = cos θ F̂ + sin θ ê
//! ```

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::problem::{ALPHA_M_PER_N_S, BETA_PER_N2_S, Problem};
use touchup_core::haptic::FaceState;

/// One step and two half steps agree to this share of the size of the unknown.
const AGREEMENT: f64 = 1e-13;
/// A stretch is not halved more often than this: it is then below a rounding of the whole.
const MOST_HALVINGS: u32 = 46;
/// Newton's method has converged, or never will.
const MOST_ITERATIONS: usize = 12;

/// Where the face is at the end of the sample; `None` where the path could not be followed.
pub fn reference(problem: &Problem) -> Option<FaceState> {
    let plane = ForcePlane::of(problem);
    let end = plane.follow(Vector2::new(0.0, plane.angle), problem.dt_s, 0)?;
    Some(FaceState { b: problem.face().b + end.x * problem.normal, n: plane.normal(end.y) })
}

/// The plane of normal and force.
struct ForcePlane<'a> {
    problem: &'a Problem,
    /// |F|, N
    magnitude: f64,
    /// F̂
    along: Vector3<f64>,
    /// ê: unit, orthogonal to F̂, towards the normal; zero where that is parallel to the force
    across: Vector3<f64>,
    /// θ at the start
    angle: f64,
}

type Pair = Vector2<f64>;

impl<'a> ForcePlane<'a> {
    fn of(problem: &'a Problem) -> Self {
        let magnitude = problem.force.norm();
        let along = problem.force / magnitude;
        let beside = problem.normal - problem.normal.dot(&along) * along;
        let sine = beside.norm();
        let across = if sine > 0.0 { beside / sine } else { Vector3::zeros() };
        Self { problem, magnitude, along, across, angle: sine.atan2(problem.normal.dot(&along)) }
    }

    fn normal(&self, angle: f64) -> Vector3<f64> {
        angle.cos() * self.along + angle.sin() * self.across
    }

    fn rate(&self, y: &Pair) -> Pair {
        let n = self.normal(y.y);
        let f = self.problem.expected((self.problem.arm - y.x * self.problem.normal).dot(&n)).0;
        let turning = -BETA_PER_N2_S * self.magnitude * f * y.y.sin();
        Pair::new(ALPHA_M_PER_N_S * (self.magnitude * y.y.cos() - f), turning)
    }

    fn jacobian(&self, y: &Pair) -> Matrix2<f64> {
        let (sine, cosine) = y.y.sin_cos();
        let n = self.normal(y.y);
        let arm = self.problem.arm - y.x * self.problem.normal;
        let (f, slope) = self.problem.expected(arm.dot(&n));
        let by_travel = -slope * self.problem.normal.dot(&n);
        let by_angle = slope * arm.dot(&(cosine * self.across - sine * self.along));
        let turn = BETA_PER_N2_S * self.magnitude;
        Matrix2::new(
            -ALPHA_M_PER_N_S * by_travel,
            -ALPHA_M_PER_N_S * (self.magnitude * sine + by_angle),
            -turn * sine * by_travel,
            -turn * (sine * by_angle + f * cosine),
        )
    }

    /// One step and two halves; halved again where they do not agree.
    fn follow(&self, y: Pair, dt: f64, halvings: u32) -> Option<Pair> {
        let whole = self.step(&y, dt);
        let halves = self.step(&y, 0.5 * dt).and_then(|middle| self.step(&middle, 0.5 * dt));
        if let (Some(whole), Some(halves)) = (whole, halves) {
            let apart = (whole - halves).abs();
            let size = self.problem.h_min_m.max(y.x.abs().max(halves.x.abs()) * f64::EPSILON / AGREEMENT);
            if apart.x <= AGREEMENT * size && apart.y <= AGREEMENT {
                return Some(halves);
            }
        }
        if halvings == MOST_HALVINGS {
            return None;
        }
        let middle = self.follow(y, 0.5 * dt, halvings + 1)?;
        self.follow(middle, 0.5 * dt, halvings + 1)
    }

    /// A step of Radau IIA; `None` where Newton's method does not converge.
    fn step(&self, y: &Pair, dt: f64) -> Option<Pair> {
        let weights = coefficients() * dt;
        let factors = (SMatrix::<f64, 6, 6>::identity() - weights.kronecker(&self.jacobian(y))).lu();
        let mut z = SVector::<f64, 6>::zeros();
        let mut last = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let rates = [0, 1, 2].map(|i| self.rate(&(y + z.fixed_rows::<2>(2 * i))));
            let mut residual = -z;
            for i in 0..3 {
                let mut part = residual.fixed_rows_mut::<2>(2 * i);
                (0..3).for_each(|j| part += weights[(i, j)] * rates[j]);
            }
            let change = factors.solve(&residual)?;
            z += change;
            let size = [0, 2, 4].map(|i| (change[i] / self.problem.h_min_m).abs().max(change[i + 1].abs()));
            let size = size.into_iter().fold(0.0, f64::max);
            // below a tenth of what is asked for, or as near as roundings let it come
            let rounding = 4.0 * f64::EPSILON * (1.0 + (y.x + z[4]).abs() / self.problem.h_min_m);
            if size <= (0.1 * AGREEMENT).max(rounding) {
                return Some(y + z.fixed_rows::<2>(4));
            }
            if !size.is_finite() || size > 2.0 * last {
                return None;
            }
            last = size;
        }
        None
    }
}

/// Of the three stages at (4 ∓ √6)/10 and 1 \[Hairer Wanner 1996, table IV.5.6\].
fn coefficients() -> Matrix3<f64> {
    let root = 6f64.sqrt();
    let rows = [
        [(88.0 - 7.0 * root) / 360.0, (296.0 - 169.0 * root) / 1800.0, (-2.0 + 3.0 * root) / 225.0],
        [(296.0 + 169.0 * root) / 1800.0, (88.0 + 7.0 * root) / 360.0, (-2.0 - 3.0 * root) / 225.0],
        [(16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0],
    ];
    Matrix3::from(rows).transpose()
}
