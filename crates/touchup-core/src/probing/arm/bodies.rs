//! The room that an arm takes up: capsules along its links.

use nalgebra::{Isometry3, Point3, Vector3};

use super::kinematics::{Joints, UrGeometry};

/// All points within a radius of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// the ends of the segment, m
    pub ends: [Point3<f64>; 2],
    /// m
    pub radius: f64,
}

impl Capsule {
    /// Gap between two capsules, m; negative: they overlap.
    pub fn gap(&self, other: &Self) -> f64 {
        segment_distance(&self.ends, &other.ends) - self.radius - other.radius
    }
}

/// A link of an arm, by the name that its maker gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Link {
    /// on the floor
    #[error("base")]
    Base,
    /// from shoulder to elbow
    #[error("upper arm")]
    UpperArm,
    /// from elbow to wrist
    #[error("forearm")]
    Forearm,
    /// from the forearm to the second joint of the wrist
    #[error("first link of the wrist")]
    Wrist1,
    /// to the third
    #[error("second link of the wrist")]
    Wrist2,
    /// to the flange
    #[error("third link of the wrist")]
    Wrist3,
    /// from the flange to the tip
    #[error("probe")]
    Probe,
}

/// Pairs of links that may collide; those that share a joint, or lie side by side whatever the joints are, cannot.
const MEETING: [(Link, Link); 11] = [
    (Link::Base, Link::Forearm),
    (Link::Base, Link::Wrist1),
    (Link::Base, Link::Wrist2),
    (Link::Base, Link::Wrist3),
    (Link::Base, Link::Probe),
    (Link::UpperArm, Link::Wrist1),
    (Link::UpperArm, Link::Wrist2),
    (Link::UpperArm, Link::Wrist3),
    (Link::UpperArm, Link::Probe),
    (Link::Forearm, Link::Wrist3),
    (Link::Forearm, Link::Probe),
];

/// The links of an arm at some joint angles, in the base B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmBodies([(Link, Capsule); 7]);

impl ArmBodies {
    /// - `pose_ft`: the tip in the flange. The probe is the line between them: how thick it is the margin of a check has to hold.
    pub fn new(geometry: &UrGeometry, joints: &Joints, pose_ft: &Isometry3<f64>) -> Self {
        let poses = geometry.link_poses(joints);
        let joint = |number: usize| poses[number].translation.vector;
        // along the axes of shoulder, elbow and first wrist, which are parallel
        let across = poses[0].rotation * Vector3::z();
        let [upper, fore] = [geometry.upper_arm_beside, geometry.forearm_beside].map(|by| across * by);
        let tip = (poses[5] * pose_ft).translation.vector;
        let [base, upper_arm, forearm, wrist] = geometry.radii;
        let capsule = |link, from: Vector3<f64>, to: Vector3<f64>, radius| {
            (link, Capsule { ends: [from.into(), to.into()], radius })
        };
        Self([
            capsule(Link::Base, Vector3::zeros(), joint(0), base),
            capsule(Link::UpperArm, joint(0) + upper, joint(1) + upper, upper_arm),
            capsule(Link::Forearm, joint(1) + fore, joint(2) + fore, forearm),
            capsule(Link::Wrist1, joint(2) + fore, joint(3), wrist),
            capsule(Link::Wrist2, joint(3), joint(4), wrist),
            capsule(Link::Wrist3, joint(4), joint(5), wrist),
            capsule(Link::Probe, joint(5), tip, 0.0),
        ])
    }

    /// All of them, from the base outward.
    pub fn links(&self) -> impl Iterator<Item = (Link, Capsule)> {
        self.0.into_iter()
    }

    /// The pair of links with the smallest gap, m, of those that may collide.
    pub fn nearest_pair(&self) -> (Link, Link, f64) {
        let body = |link: Link| self.0[link as usize].1;
        let gaps = MEETING.map(|(one, other)| (one, other, body(one).gap(&body(other))));
        gaps.into_iter().min_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or((Link::Base, Link::Probe, f64::INFINITY))
    }
}

/// Smallest distance between two segments, m.
///
/// The squared distance is convex in the two shares of the way along them: its smallest value is inside, where both derivatives are
/// zero, or on the border, where one share is 0 or 1.
fn segment_distance([a, b]: &[Point3<f64>; 2], [c, d]: &[Point3<f64>; 2]) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let determinant = uu * vv - uv * uv;
    let inside = (determinant > PARALLEL * uu * vv).then(|| {
        let s = (uv * v.dot(&w) - vv * u.dot(&w)) / determinant;
        let t = (uu * v.dot(&w) - uv * u.dot(&w)) / determinant;
        ((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)).then(|| (w + u * s - v * t).norm())
    });
    let ends =
        [point_distance(a, [c, d]), point_distance(b, [c, d]), point_distance(c, [a, b]), point_distance(d, [a, b])];
    ends.into_iter().chain(inside.flatten()).fold(f64::INFINITY, f64::min)
}

/// Sine² of an angle below which two segments are parallel: then an end of one of them is nearest.
const PARALLEL: f64 = 1e-12;

fn point_distance(point: &Point3<f64>, [from, to]: [&Point3<f64>; 2]) -> f64 {
    let along = to - from;
    let share = ((point - from).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (point - (from + along * share)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn gaps_between_capsules_are_those_made_by_hand() {
        let capsule = |ends: [[f64; 3]; 2], radius| Capsule { ends: ends.map(Point3::from), radius };
        let along_x = capsule([[0.0; 3], [1.0, 0.0, 0.0]], 0.1);
        for (other, gap) in [
            // crossing above the middle, parallel beside, beyond an end, one in the other, a point
            (capsule([[0.5, -1.0, 0.5], [0.5, 1.0, 0.5]], 0.2), 0.2),
            (capsule([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], 0.2), 0.7),
            (capsule([[4.0, 4.0, 0.0], [9.0, 9.0, 0.0]], 0.0), 4.9),
            (capsule([[0.2, 0.0, 0.0], [0.3, 0.0, 0.0]], 0.1), -0.2),
            (capsule([[0.5, 0.3, 0.0], [0.5, 0.3, 0.0]], 0.1), 0.1),
        ] {
            assert!((along_x.gap(&other) - gap).abs() < 1e-12, "{other:?}: {}", along_x.gap(&other));
            assert!((other.gap(&along_x) - gap).abs() < 1e-12, "{other:?}");
        }
    }

    #[test]
    fn the_distance_of_segments_is_that_of_their_sampled_points() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        for _ in 0..200 {
            let mut point = || Point3::from(std::array::from_fn::<f64, 3, _>(|_| rng.random_range(-1.0..1.0)));
            let (one, other) = ([point(), point()], [point(), point()]);
            let places =
                |[from, to]: [Point3<f64>; 2]| (0..=200).map(move |at| from + (to - from) * (f64::from(at) / 200.0));
            let sampled =
                places(one).flat_map(|p| places(other).map(move |q| (p - q).norm())).fold(f64::INFINITY, f64::min);
            let exact = segment_distance(&one, &other);
            assert!(exact <= sampled + 1e-12 && exact > sampled - 0.02, "{one:?} {other:?}: {exact}, {sampled}");
        }
    }

    /// The upper arm is upright. With the forearm at a right angle nothing is near anything; folded down it is in the base's column, as
    /// forearm and upper arm are nearly as long as each other.
    #[test]
    fn a_stretched_arm_is_free_and_one_folded_onto_itself_is_not() {
        let probe = Isometry3::translation(0.0, 0.0, 0.15);
        let pair = |joints: Joints| ArmBodies::new(&UrGeometry::UR5E, &joints, &probe).nearest_pair();
        let (_, _, gap) = pair([0.0, -1.6, 1.6, -1.6, -1.6, 0.0]);
        assert!(gap > 0.05, "{gap}");
        let (one, other, gap) = pair([0.0, -1.6, 3.0, -1.6, -1.6, 0.0]);
        assert!(gap < 0.0 && (one, other) == (Link::Base, Link::Forearm), "{one} {other} {gap}");
        // the wrist bends the probe back along the forearm
        let (one, other, gap) = pair([0.0, -1.6, 1.6, 0.0, 3.1, 0.0]);
        assert!(gap < 0.0 && one == Link::Forearm, "{one} {other} {gap}");
    }
}
