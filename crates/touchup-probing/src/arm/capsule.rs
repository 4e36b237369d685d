//! Capsules as bodies of the links of an arm.

use nalgebra::{Isometry3, Point3};

/// All points within a radius of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// ends of the segment, m
    pub ends: [Point3<f64>; 2],
    /// distance of the surface from the segment, m
    pub radius: f64,
}

impl Capsule {
    /// Gap between two capsules, m; negative if they overlap.
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        segment_distance(&self.ends, &other.ends) - self.radius - other.radius
    }

    /// The capsule at a pose of its frame.
    pub(super) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self {
            ends: self.ends.map(|end| pose * end),
            radius: self.radius,
        }
    }
}

/// Smallest distance between two segments, m.
///
/// The squared distance is convex in the two shares along the segments: its minimum is inside, with
/// both derivatives zero, or on the border, with one share 0 or 1.
fn segment_distance([a, b]: &[Point3<f64>; 2], [c, d]: &[Point3<f64>; 2]) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let determinant = uu * vv - uv * uv;
    let inside = (determinant > PARALLEL * uu * vv).then(|| {
        let s = (uv * v.dot(&w) - vv * u.dot(&w)) / determinant;
        let t = (uu * v.dot(&w) - uv * u.dot(&w)) / determinant;
        ((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)).then(|| (w + u * s - v * t).norm())
    });
    let ends = [
        point_distance(a, [c, d]),
        point_distance(b, [c, d]),
        point_distance(c, [a, b]),
        point_distance(d, [a, b]),
    ];
    ends.into_iter()
        .chain(inside.flatten())
        .fold(f64::INFINITY, f64::min)
}

/// Sine² of the angle below which two segments are parallel: then an end of one is nearest.
const PARALLEL: f64 = 1e-12;

fn point_distance(point: &Point3<f64>, [from, to]: [&Point3<f64>; 2]) -> f64 {
    let along = to - from;
    let share =
        ((point - from).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (point - (from + along * share)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn gaps_between_capsules_are_those_made_by_hand() {
        let capsule = |ends: [[f64; 3]; 2], radius| Capsule {
            ends: ends.map(Point3::from),
            radius,
        };
        let along_x = capsule([[0.0; 3], [1.0, 0.0, 0.0]], 0.1);
        for (other, gap) in [
            // crossing above the middle, parallel beside, beyond an end, one in the other, a point
            (capsule([[0.5, -1.0, 0.5], [0.5, 1.0, 0.5]], 0.2), 0.2),
            (capsule([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], 0.2), 0.7),
            (capsule([[4.0, 4.0, 0.0], [9.0, 9.0, 0.0]], 0.0), 4.9),
            (capsule([[0.2, 0.0, 0.0], [0.3, 0.0, 0.0]], 0.1), -0.2),
            (capsule([[0.5, 0.3, 0.0], [0.5, 0.3, 0.0]], 0.1), 0.1),
        ] {
            assert!(
                (along_x.gap(&other) - gap).abs() < 1e-12,
                "{other:?}: {}",
                along_x.gap(&other)
            );
            assert!((other.gap(&along_x) - gap).abs() < 1e-12, "{other:?}");
        }
    }

    #[test]
    fn the_distance_of_segments_is_that_of_their_sampled_points() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        for _ in 0..200 {
            let mut point = || {
                Point3::from(std::array::from_fn::<f64, 3, _>(|_| {
                    rng.random_range(-1.0..1.0)
                }))
            };
            let (one, other) = ([point(), point()], [point(), point()]);
            let places = |[from, to]: [Point3<f64>; 2]| {
                (0..=200).map(move |at| from + (to - from) * (f64::from(at) / 200.0))
            };
            let sampled = places(one)
                .flat_map(|p| places(other).map(move |q| (p - q).norm()))
                .fold(f64::INFINITY, f64::min);
            let exact = segment_distance(&one, &other);
            assert!(
                exact <= sampled + 1e-12 && exact > sampled - 0.02,
                "{one:?} {other:?}: {exact}, {sampled}"
            );
        }
    }
}
