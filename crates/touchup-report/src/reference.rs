//! One held sample solved in numbers of 32 digits, by an independent method: the reference for each
//! step of the face dynamics.
//!
//! In the plane of normal and force, with the exponent x = β|F| ∫ f dt for the second unknown,
//!
//! ```text
//! ds/dt = α (|F| cos θ − f)      dx/dt = β |F| f      tan(θ/2) = tan(θ₀/2) e^−x      n = cos θ F̂ + sin θ ê
//! ```
//!
//! by collocation at the seven points of Radau IIA, of order 13 \[Hairer Wanner 1999\]; halves each
//! time interval until one step and two half steps agree.

use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector, Matrix2, Point3, Vector3};
use touchup_method::haptic::{
    ContactModel, DynamicsParams, FaceState, MotionDirection, SigmoidParams,
};

use super::double_double::Double2;

/// Points of collocation.
const STAGES: usize = 7;
/// One step and two half steps agree to this share of the size of the unknown.
const AGREEMENT: f64 = 1e-17;
/// Newton's method stops at this share of the size of the unknown.
const CONVERGED: f64 = 1e-24;
const MOST_ITERATIONS: usize = 30;
/// Most steps, accepted or not; a longer path counts as failed.
const MOST_STEPS: usize = 4_000;
/// A step times the rate of growth within it.
const LONGEST_GROWTH: f64 = 2.0;
/// Largest exponent without overflow risk.
const LARGEST_EXPONENT: f64 = 690.0;

/// A face and its held sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldFace {
    /// α, β, the contact model and the direction of motion; the rigid offset stays in
    pub params: DynamicsParams,
    /// n* at the start, and n*(0)
    pub normal: Vector3<f64>,
    /// tip from the barycentre of the face at the start, m
    pub arm: Vector3<f64>,
    /// F on the stylus, N
    pub force: Vector3<f64>,
    /// hold time of the sample, s
    pub dt_s: f64,
}

/// Final state of the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// barycentre relative to its start, m, and normal
    pub face: FaceState,
    /// farthest travel on the way, m
    pub farthest_m: f64,
}

impl HeldFace {
    /// The solution; `None` if the path fails or is unbounded.
    pub fn reference(&self) -> Option<Reference> {
        let plane = ForcePlane::of(self)?;
        let (travel, exponent, farthest_m) = plane.follow(self.dt_s)?;
        let along = plane.along_axis.map(|x| (x * travel).value());
        let [towards, across] = plane.cosine_and_sine(exponent);
        let n = Vector3::from_fn(|i, _| {
            (plane.towards[i] * towards + plane.across[i] * across).value()
        });
        Some(Reference {
            face: FaceState {
                b: Point3::from(along),
                n,
            },
            farthest_m,
        })
    }
}

type Wide3 = [Double2; 3];
/// Travel and exponent.
type Pair = [Double2; 2];

fn wide(v: &Vector3<f64>) -> Wide3 {
    [v.x, v.y, v.z].map(Double2::from)
}

fn dot(a: &Wide3, b: &Wide3) -> Double2 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Length, and direction; zero for a zero vector.
fn split(a: &Wide3) -> (Double2, Wide3) {
    let length = dot(a, a).sqrt();
    if length.high == 0.0 {
        (length, *a)
    } else {
        (length, a.map(|x| x / length))
    }
}

/// The plane of normal and force.
struct ForcePlane<'a> {
    held: &'a HeldFace,
    /// |F|, N
    magnitude: Double2,
    /// F̂, and ê orthogonal to it, towards the normal
    towards: Wide3,
    across: Wide3,
    /// a
    along_axis: Wide3,
    /// tan(θ₀/2)
    half_tangent: Double2,
    /// arm and a in these axes
    arm: Pair,
    along: Pair,
}

impl<'a> ForcePlane<'a> {
    fn of(held: &'a HeldFace) -> Option<Self> {
        let (magnitude, towards) = split(&wide(&held.force));
        let (_, normal) = split(&wide(&held.normal));
        let cosine = dot(&normal, &towards);
        let beside: Vec<_> = (0..3).map(|i| normal[i] - towards[i] * cosine).collect();
        let (sine, across) = split(&[beside[0], beside[1], beside[2]]);
        let one = Double2::from(1.0);
        let half_tangent = if cosine.high > 0.0 {
            sine / (one + cosine)
        } else if sine.high > 0.0 {
            (one - cosine) / sine
        } else {
            return None;
        };
        let along_axis = if held.params.along == MotionDirection::Force {
            towards
        } else {
            normal
        };
        let in_plane = |v: &Wide3| [dot(v, &towards), dot(v, &across)];
        let (arm, along) = (in_plane(&wide(&held.arm)), in_plane(&along_axis));
        Some(Self {
            held,
            magnitude,
            towards,
            across,
            along_axis,
            half_tangent,
            arm,
            along,
        })
    }

    /// cos θ and sin θ after the exponent x.
    fn cosine_and_sine(&self, exponent: Double2) -> Pair {
        let one = Double2::from(1.0);
        if exponent.high > LARGEST_EXPONENT {
            return [one, Double2::from(0.0)];
        }
        if exponent.high < -LARGEST_EXPONENT {
            return [-one, Double2::from(0.0)];
        }
        let tangent = self.half_tangent * (-exponent).exp();
        if tangent.high > 1.0 {
            let inverse = one / tangent;
            let length = one + inverse * inverse;
            return [
                (inverse * inverse - one) / length,
                (inverse + inverse) / length,
            ];
        }
        let length = one + tangent * tangent;
        [
            (one - tangent * tangent) / length,
            (tangent + tangent) / length,
        ]
    }

    /// f, N, and df/dh, N/m.
    fn expected(&self, h: Double2) -> (Double2, f64) {
        let one = Double2::from(1.0);
        match self.held.params.model {
            ContactModel::Spring { stiffness_n_per_m } => {
                (-h * stiffness_n_per_m.into(), -stiffness_n_per_m)
            }
            ContactModel::Sigmoid(SigmoidParams {
                f_max,
                h_min,
                delta,
            }) => {
                let u = h / h_min.into() + delta.into();
                let size = if u.high > 0.0 { u } else { -u };
                let e = if size.high > LARGEST_EXPONENT {
                    Double2::from(0.0)
                } else {
                    (-size).exp()
                };
                let share = if u.high > 0.0 {
                    e / (one + e)
                } else {
                    one / (one + e)
                };
                let slope = (e / ((one + e) * (one + e))).value();
                (share * f_max.into(), -f_max / h_min * slope)
            }
        }
    }

    /// The rates of both unknowns, and their derivatives.
    fn rate(&self, y: &Pair) -> (Pair, Matrix2<f64>) {
        let params = &self.held.params;
        let (alpha, beta) = (
            Double2::from(params.alpha_m_per_n_s),
            Double2::from(params.beta_per_n2_s),
        );
        let [cosine, sine] = self.cosine_and_sine(y[1]);
        let arm = [
            self.arm[0] - self.along[0] * y[0],
            self.arm[1] - self.along[1] * y[0],
        ];
        let (f, slope) = self.expected(arm[0] * cosine + arm[1] * sine);
        let turning = beta * self.magnitude;
        let rate = [alpha * (self.magnitude * cosine - f), turning * f];
        // θ falls by sin θ for each unit of the exponent
        let by_travel = -(self.along[0] * cosine + self.along[1] * sine).value();
        let by_exponent = ((arm[0] * sine - arm[1] * cosine) * sine).value();
        let force_by_exponent = (self.magnitude * sine * sine).value();
        let (alpha, turning) = (alpha.value(), turning.value());
        let jacobian = Matrix2::new(
            -alpha * slope * by_travel,
            alpha * (force_by_exponent - slope * by_exponent),
            turning * slope * by_travel,
            turning * slope * by_exponent,
        );
        (rate, jacobian)
    }

    /// Travel, exponent, and the farthest travel on the way.
    fn follow(&self, end: f64) -> Option<(Double2, Double2, f64)> {
        let zero = Double2::from(0.0);
        let (mut y, mut time, mut farthest) = ([zero, zero], zero, 0.0_f64);
        // first step short against every time constant
        let (rate, jacobian) = self.rate(&y);
        let length = match self.held.params.model {
            ContactModel::Sigmoid(curve) => curve.h_min,
            ContactModel::Spring { stiffness_n_per_m } => {
                self.held.arm.norm() + self.held.force.norm() / stiffness_n_per_m
            }
        };
        let fastest = jacobian
            .amax()
            .max(rate[0].high.abs() / length)
            .max(rate[1].high.abs());
        let mut dt = end.min(1e-3 / fastest.max(f64::MIN_POSITIVE));
        for _ in 0..MOST_STEPS {
            let left = (Double2::from(end) - time).value();
            if left <= 0.0 {
                return Some((y[0], y[1], farthest));
            }
            let step = dt.min(left);
            let size = |next: &Pair| {
                [
                    farthest.max(next[0].high.abs()).max(f64::MIN_POSITIVE),
                    next[1].high.abs().max(1.0),
                ]
            };
            let halves = self.step(&y, step, &size).and_then(|whole| {
                let middle = self.step(&y, 0.5 * step, &size)?;
                let halves = self.step(&middle, 0.5 * step, &size)?;
                let sizes = size(&halves);
                let apart = [0, 1].map(|i| ((whole[i] - halves[i]).value() / sizes[i]).abs());
                Some((halves, apart[0].max(apart[1]) / AGREEMENT))
            });
            let change = match halves {
                Some((next, error)) if error <= 1.0 => {
                    y = next;
                    farthest = farthest.max(y[0].high.abs());
                    time = time + step.into();
                    0.9 * error.powf(-1.0 / 14.0)
                }
                Some((_, error)) if error.is_finite() => 0.9 * error.powf(-1.0 / 14.0),
                _ => 0.1,
            };
            dt = step * change.clamp(0.1, 6.0);
        }
        None
    }

    /// A step of collocation; `None` if Newton's method does not converge.
    fn step(&self, y: &Pair, dt: f64, size: &impl Fn(&Pair) -> [f64; 2]) -> Option<Pair> {
        let weights = &*WEIGHTS;
        let mut z = [[Double2::from(0.0); 2]; STAGES];
        let mut last = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let slopes = z.map(|z| self.rate(&[y[0] + z[0], y[1] + z[1]]));
            let mut matrix = DMatrix::<f64>::identity(2 * STAGES, 2 * STAGES);
            let mut residual = DVector::<f64>::zeros(2 * STAGES);
            for i in 0..STAGES {
                let mut sum = [-z[i][0], -z[i][1]];
                for (j, (rate, jacobian)) in slopes.iter().enumerate() {
                    let weight = weights[i][j] * dt.into();
                    (0..2).for_each(|k| sum[k] = sum[k] + weight * rate[k]);
                    let mut block = matrix.fixed_view_mut::<2, 2>(2 * i, 2 * j);
                    block -= weight.value() * jacobian;
                }
                (0..2).for_each(|k| residual[2 * i + k] = sum[k].value());
            }
            // an implicit method damps growth in long steps
            let growth = slopes
                .iter()
                .map(|(_, jacobian)| growth(jacobian))
                .fold(0.0, f64::max);
            let change = matrix.lu().solve(&residual)?;
            for (i, z) in z.iter_mut().enumerate() {
                (0..2).for_each(|k| z[k] = z[k] + change[2 * i + k].into());
            }
            let end = [y[0] + z[STAGES - 1][0], y[1] + z[STAGES - 1][1]];
            let sizes = size(&end);
            let left = (0..STAGES)
                .flat_map(|i| [0, 1].map(|k| (change[2 * i + k] / sizes[k]).abs()))
                .fold(0.0, f64::max);
            if left <= CONVERGED || left <= 0.1 * AGREEMENT && left > 0.5 * last {
                return (growth * dt <= LONGEST_GROWTH).then_some(end);
            }
            if !left.is_finite() {
                return None;
            }
            last = left;
        }
        None
    }
}

/// The larger real part of both eigenvalues.
fn growth(jacobian: &Matrix2<f64>) -> f64 {
    jacobian
        .complex_eigenvalues()
        .iter()
        .map(|value| value.re)
        .fold(f64::MIN, f64::max)
}

/// a_ij = ∫ of the jth Lagrange polynomial from 0 to c_i.
static WEIGHTS: LazyLock<[[Double2; STAGES]; STAGES]> = LazyLock::new(|| {
    let nodes = nodes();
    // Σ_j a_ij c_j^k = c_i^(k+1) / (k+1), by elimination with pivoting in 32 digits
    let mut columns: Vec<Vec<Double2>> = Vec::new();
    let mut powers = [Double2::from(1.0); STAGES];
    let mut ends = nodes;
    for k in 0..STAGES {
        let divisor = Double2::from((k + 1) as f64);
        columns.push(
            powers
                .iter()
                .copied()
                .chain(ends.iter().map(|&end| end / divisor))
                .collect(),
        );
        (0..STAGES).for_each(|i| (powers[i], ends[i]) = (powers[i] * nodes[i], ends[i] * nodes[i]));
    }
    for pivot in 0..STAGES {
        let largest = (pivot..STAGES).max_by(|&a, &b| {
            columns[a][pivot]
                .high
                .abs()
                .total_cmp(&columns[b][pivot].high.abs())
        });
        columns.swap(pivot, largest.unwrap_or(pivot));
        let row = columns[pivot].clone();
        for (_, other) in columns.iter_mut().enumerate().filter(|(k, _)| *k != pivot) {
            let factor = other[pivot] / row[pivot];
            other
                .iter_mut()
                .zip(&row)
                .for_each(|(x, r)| *x = *x - factor * *r);
        }
    }
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][STAGES + i] / columns[j][j]))
});

/// The zeros of P_s(x) − P_{s−1}(x), from (−1, 1] to (0, 1], upwards.
fn nodes() -> [Double2; STAGES] {
    let one = Double2::from(1.0);
    // P_s − P_{s−1} at x
    let difference = |x: Double2| {
        let (mut before, mut now) = (one, x);
        for k in 1..STAGES {
            let n = k as f64;
            let next = (x * now * (2.0 * n + 1.0).into() - before * n.into()) / (n + 1.0).into();
            (before, now) = (now, next);
        }
        now - before
    };
    let mut zeros = Vec::new();
    let count = 1000;
    let place = |i: usize| {
        Double2::from(-1.0) + Double2::from(2.0 * i as f64) / (count as f64 + 0.5).into()
    };
    for i in 0..count {
        let (mut low, mut high) = (place(i), place(i + 1));
        if (difference(low).high > 0.0) == (difference(high).high > 0.0) {
            continue;
        }
        for _ in 0..110 {
            let middle = (low + high) * 0.5.into();
            if (difference(low).high > 0.0) == (difference(middle).high > 0.0) {
                low = middle
            } else {
                high = middle
            }
        }
        zeros.push((low + one) * 0.5.into());
    }
    zeros.push(one);
    std::array::from_fn(|i| zeros[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last row of weights is a quadrature at the points for s = 7, exact for polynomials up to
    /// degree 12.
    #[test]
    fn the_last_row_integrates_polynomials_of_degree_twelve() {
        let nodes = nodes();
        for degree in 0..13 {
            let sum = (0..STAGES).fold(Double2::from(0.0), |sum, j| {
                let power = (0..degree).fold(Double2::from(1.0), |power, _| power * nodes[j]);
                sum + WEIGHTS[STAGES - 1][j] * power
            });
            let exact = Double2::from(1.0) / (f64::from(degree) + 1.0).into();
            assert!((sum - exact).value().abs() < 1e-28, "degree {degree}");
        }
    }

    /// Force along the normal: the spring has a closed form, s = (h + F/k)(1 − e^−αkt).
    #[test]
    fn a_spring_without_tilt_has_its_closed_form() {
        let (stiffness, alpha, dt) = (2e4, 0.3, 1e-3);
        let params = DynamicsParams {
            model: ContactModel::Spring {
                stiffness_n_per_m: stiffness,
            },
            alpha_m_per_n_s: alpha,
            beta_per_n2_s: 7.0,
            take_out_rigid_offset: false,
            ..DynamicsParams::default()
        };
        let held = HeldFace {
            params,
            normal: Vector3::z(),
            arm: Vector3::z() * 1e-3,
            force: Vector3::z() * 2.0,
            dt_s: dt,
        };
        let exact = (1e-3 + 2.0 / stiffness) * -(-alpha * stiffness * dt).exp_m1();
        let found = held.reference().unwrap();
        assert!(
            (found.face.b.z - exact).abs() < 4.0 * f64::EPSILON * exact,
            "{found:?}, {exact}"
        );
        assert_eq!(found.face.n, Vector3::z());
    }
}
