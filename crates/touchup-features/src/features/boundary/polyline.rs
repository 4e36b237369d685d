//! Polylines along the edges of a mesh.

use nalgebra::Point3;

/// Rounds of smoothing.
const ROUNDS: usize = 8;

/// Length of a polyline, m.
pub(super) fn length_of(points: &[Point3<f64>]) -> f64 {
    let steps = points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    steps.sum()
}

/// Whether a point is within a distance, m, of a polyline.
pub(super) fn is_beside(points: &[Point3<f64>], p: &Point3<f64>, distance: f64) -> bool {
    let off = |pair: &[Point3<f64>]| {
        let chord = pair[1] - pair[0];
        let share = (p - pair[0]).dot(&chord) / chord.norm_squared().max(f64::MIN_POSITIVE);
        (pair[0] + chord * share.clamp(0.0, 1.0) - p).norm()
    };
    points.windows(2).any(|pair| off(pair) <= distance)
}

/// The zigzags of a mesh smoothed, with both ends and points no nearer to each other than a step;
/// equal first and last points close it.
///
/// - `step`: m; 0 for a drawing, which stays as it is.
pub(super) fn smoothed(mut points: Vec<Point3<f64>>, step: f64) -> Vec<Point3<f64>> {
    let count = points.len();
    if step == 0.0 || count < 4 {
        return points;
    }
    let is_closed = points[0] == points[count - 1];
    // a short one would shrink to a point
    for _ in 0..ROUNDS.min(count / 8) {
        let before = points.clone();
        let mean = |a: usize, b: usize, c: usize| {
            before[b] + (before[a] - before[b] + (before[c] - before[b])) / 4.0
        };
        (1..count - 1).for_each(|at| points[at] = mean(at - 1, at, at + 1));
        if is_closed {
            points[0] = mean(count - 2, 0, 1);
            points[count - 1] = points[0];
        }
    }
    let last = points[count - 1];
    let mut kept = vec![points[0]];
    for p in &points[1..count - 1] {
        let is_apart = |from: &Point3<f64>| (p - from).norm() >= step;
        if is_apart(&kept[kept.len() - 1]) && is_apart(&last) {
            kept.push(*p);
        }
    }
    kept.push(last);
    if kept.len() > 3 { kept } else { points }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means with weights 1, 2, 1 cancel a regular zigzag; each round reaches one point farther from
    /// the fixed ends.
    #[test]
    fn a_zigzag_becomes_straight_between_its_ends() {
        let at = |i: i32| Point3::new(f64::from(i), 0.3 * f64::from(1 - 2 * (i % 2)), 0.0);
        let points: Vec<_> = (0..=40).map(at).collect();
        let found = smoothed(points.clone(), 3.0);
        assert_eq!([found[0], found[found.len() - 1]], [points[0], points[40]]);
        let inner: Vec<_> = found
            .iter()
            .filter(|p| (10.0..30.0).contains(&p.x))
            .collect();
        assert!(inner.iter().all(|p| p.y.abs() < 1e-15), "{inner:?}");
        assert!(
            found
                .windows(2)
                .all(|pair| (pair[1] - pair[0]).norm() >= 3.0)
        );
        assert_eq!(smoothed(points.clone(), 0.0), points);
        assert!((length_of(&points) - 40.0 * 1.36f64.sqrt()).abs() < 1e-12);
        assert!(is_beside(&points[..2], &Point3::new(0.0, 1.3, 0.0), 1.0));
        assert!(!is_beside(&points[..2], &Point3::new(0.0, 1.4, 0.0), 1.0));
    }
}
