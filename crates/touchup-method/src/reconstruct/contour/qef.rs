//! The point of least squared distance from a set of planes: the quadratic error function of dual
//! contouring \[Ju et al. 2002\].

use nalgebra::{Matrix3, Point3, Vector3};

/// Sweeps of the Jacobi iteration; five bring a 3 × 3 matrix to rounding.
const SWEEPS: usize = 6;
/// Steps to the best point on the rim of a box; each at least halves the error.
const STEPS: usize = 16;
/// Shares of the step from the start to try if the best point turns the surface over.
const BACK: [f64; 3] = [0.5, 0.25, 0.0];
/// Tolerance of a vertex on a plane, as a share of the distance of the crossings from their mean.
const ON_PLANE: f64 = 0.1;
/// Pull of the start, as a share of the trace; decides only in directions without planes.
const PULL: f64 = 1e-3;

/// Weighted planes n·(x − p) = 0, to meet in the least-squares sense near the mean of their points.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Planes(pub Vec<WeightedPlane>);

/// A point, its unit normal, its weight.
pub(in crate::reconstruct) type WeightedPlane = (Point3<f64>, Vector3<f64>, f64);

impl Planes {
    /// Weighted mean of the points.
    pub(crate) fn mean(&self) -> Point3<f64> {
        let total: f64 = self.0.iter().map(|(.., weight)| weight).sum();
        Point3::from(
            self.0
                .iter()
                .map(|(p, _, weight)| p.coords * *weight)
                .sum::<Vector3<f64>>()
                / total,
        )
    }

    /// The point nearest to `start` that minimises Σ w (n·(x − p))² within the box from `lo` to
    /// `hi`, which holds `start`; no part of the loop is back-facing from there. Ignores directions
    /// in which the sum of the w n nᵀ has an eigenvalue below `threshold` times their sum.
    pub(crate) fn solve(
        &self,
        start: &Point3<f64>,
        threshold: f64,
        [lo, hi]: &[Point3<f64>; 2],
    ) -> Point3<f64> {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for (p, n, weight) in &self.0 {
            let weighted = n * *weight;
            a += weighted * n.transpose();
            b += weighted * n.dot(&(p - start));
        }
        let trace = a.trace();
        let (values, vectors) = eigen(a);
        let (mut x, mut kept) = (Vector3::zeros(), Matrix3::identity() * (PULL * trace));
        for i in 0..3 {
            let direction: Vector3<f64> = vectors.column(i).into();
            if values[i] > threshold * trace {
                x += direction * (direction.dot(&b) / values[i]);
                kept += direction * direction.transpose() * values[i];
            }
        }
        let (lo, hi) = (lo - start, hi - start);
        if !(0..3).all(|i| (lo[i]..=hi[i]).contains(&x[i])) {
            x = least_in_box(&kept, &(kept * x), &lo, &hi);
        }
        self.unturned(start, &x)
    }

    /// `start` + `best`, or the first point on the segment back to `start` from which no step of
    /// the loop through the planes' points, in their order, is back-facing; without any, the point
    /// with the least back-facing step.
    fn unturned(&self, start: &Point3<f64>, best: &Vector3<f64>) -> Point3<f64> {
        // a point on all planes is their edge or corner, however its loop looks from there
        let size = self
            .steps()
            .map(|(a, _)| (a.0 - start).norm())
            .fold(0.0, f64::max);
        if self
            .steps()
            .all(|(a, _)| a.1.dot(&(start + best - a.0)).abs() < ON_PLANE * size)
        {
            return start + best;
        }
        let sum = |term: &dyn Fn(&WeightedPlane, &WeightedPlane) -> Vector3<f64>| {
            self.steps().map(|(a, b)| term(a, b)).sum::<Vector3<f64>>()
        };
        let area = sum(&|a, b| (a.0 - start).cross(&(b.0 - start)));
        let side = area.dot(&sum(&|a, _| a.1)).signum();
        let volume = |from: &Point3<f64>| {
            let of_step = |(a, b): (&WeightedPlane, &WeightedPlane)| {
                side * (a.0 - from).cross(&(b.0 - from)).dot(&(a.1 + b.1))
            };
            self.steps().map(of_step).fold(f64::INFINITY, f64::min)
        };
        let mut found = (start + best, volume(&(start + best)));
        for share in BACK {
            let from = start + best * share;
            let here = volume(&from);
            if found.1 < 0.0 && here > found.1 {
                found = (from, here);
            }
        }
        found.0
    }

    /// Each plane with the next, the last with the first.
    fn steps(&self) -> impl Iterator<Item = (&WeightedPlane, &WeightedPlane)> {
        self.0.iter().zip(self.0.iter().cycle().skip(1))
    }
}

/// The x within a box that minimises ½ xᵀ A x − bᵀ x, by projected Gauss–Seidel steps.
fn least_in_box(
    a: &Matrix3<f64>,
    b: &Vector3<f64>,
    lo: &Vector3<f64>,
    hi: &Vector3<f64>,
) -> Vector3<f64> {
    let mut x: Vector3<f64> = Vector3::zeros();
    for _ in 0..STEPS {
        for i in (0..3).filter(|&i| a[(i, i)] > 0.0) {
            let rest = b[i] - a.row(i).transpose().dot(&x) + a[(i, i)] * x[i];
            x[i] = (rest / a[(i, i)]).clamp(lo[i], hi[i]);
        }
    }
    x
}

/// Eigenvalues and unit eigenvectors (columns) of a symmetric matrix, by cyclic Jacobi rotations.
fn eigen(mut a: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let mut vectors = Matrix3::identity();
    let tiny = f64::EPSILON * f64::EPSILON * a.trace() * a.trace();
    for _ in 0..SWEEPS {
        let off = a[(0, 1)] * a[(0, 1)] + a[(0, 2)] * a[(0, 2)] + a[(1, 2)] * a[(1, 2)];
        if off <= tiny {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut vectors, p, q);
        }
    }
    (a.diagonal(), vectors)
}

/// One rotation that makes element (p, q) zero \[Golub Van Loan 2013, sec. 8.5\].
fn rotate(a: &mut Matrix3<f64>, vectors: &mut Matrix3<f64>, p: usize, q: usize) {
    if a[(p, q)] == 0.0 {
        return;
    }
    let tau = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
    let t = tau.signum() / (tau.abs() + tau.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    let r = 3 - p - q;
    let (shift, ap, aq) = (t * a[(p, q)], a[(r, p)], a[(r, q)]);
    a[(p, p)] -= shift;
    a[(q, q)] += shift;
    (a[(p, q)], a[(q, p)]) = (0.0, 0.0);
    (a[(r, p)], a[(r, q)]) = (c * ap - s * aq, s * ap + c * aq);
    (a[(p, r)], a[(q, r)]) = (a[(r, p)], a[(r, q)]);
    for row in 0..3 {
        let (x, y) = (vectors[(row, p)], vectors[(row, q)]);
        (vectors[(row, p)], vectors[(row, q)]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_rebuild_the_matrix() {
        for a in [
            Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 1e-3),
            Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)),
            Matrix3::repeat(1.0),
            Matrix3::zeros(),
        ] {
            let (values, vectors) = eigen(a);
            let rebuilt = vectors * Matrix3::from_diagonal(&values) * vectors.transpose();
            assert!((rebuilt - a).norm() < 1e-14, "{rebuilt}");
            assert!((vectors.transpose() * vectors - Matrix3::identity()).norm() < 1e-14);
        }
    }

    #[test]
    fn planes_through_a_corner_an_edge_and_a_face_are_met_there() {
        let mut planes = Planes::default();
        let corner = Point3::new(0.3, -0.2, 0.5);
        for (i, wanted) in [[0.0, 0.0, 0.5], [0.3, 0.0, 0.5], [0.3, -0.2, 0.5]]
            .into_iter()
            .enumerate()
        {
            let axis = [2, 0, 1][i];
            planes.0.push((corner, Vector3::ith(axis, 1.0), 1.0));
            let found = planes.solve(
                &Point3::origin(),
                0.1,
                &[Point3::from([-1.0; 3]), Point3::from([1.0; 3])],
            );
            assert!((found - Point3::from(wanted)).norm() < 1e-15, "{found}");
        }
        assert!((planes.mean() - corner).norm() < 1e-15);
    }

    #[test]
    fn a_point_beyond_the_box_is_brought_to_the_best_place_on_its_rim() {
        // the line x = y leaves the box at x = 1: the plane z = 0.5 fixes the point on it
        let mut planes = Planes::default();
        for normal in [
            Vector3::new(1.0, -1.0, 0.0).normalize(),
            Vector3::z(),
            Vector3::x(),
        ] {
            planes.0.push((Point3::new(3.0, 3.0, 0.5), normal, 1.0));
        }
        let bounds = [Point3::origin(), Point3::from([1.0; 3])];
        let found = planes.solve(&Point3::from([0.1; 3]), 0.05, &bounds);
        assert!(
            (found - Point3::new(1.0, 1.0, 0.5)).norm() < 5e-3,
            "{found}"
        );
    }

    #[test]
    fn a_point_that_sees_the_loop_from_behind_goes_back() {
        let mut planes = Planes::default();
        for (x, y) in [(0.3, -0.3), (0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3)] {
            planes.0.push((Point3::new(x, y, 0.0), Vector3::z(), 1.0));
        }
        // over the square every step is front-facing, beside it one is not
        let found = |x: f64| {
            planes
                .unturned(&Point3::origin(), &Vector3::new(x, 0.0, 0.1))
                .x
        };
        assert_eq!(found(0.2), 0.2);
        assert_eq!(found(0.5), 0.25);
        assert_eq!(found(0.9), 0.225);
        // the reverse as well
        planes.0.reverse();
        assert_eq!(
            planes
                .unturned(&Point3::origin(), &Vector3::new(0.9, 0.0, 0.1))
                .x,
            0.225
        );
    }
}
