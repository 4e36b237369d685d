//! The true pose of the surface around a flag: until it was touched, only the scan gives its normal.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::search_context::SearchContext;
use crate::features::fit::Observation;
use crate::numeric::{mean, scatter};

/// Touches within this of a plane are of it, m.
const OF_PLANE: f64 = 60e-6;
/// Three touches determine a plane when the triangle between them is at least this high, over the ball's radius.
const SPREAD: f64 = 1.0;

/// The normal of the scan is not wrong by more than this (cosine): 25°.
const ALIKE: f64 = 0.9;

impl SearchContext {
    /// Turns and lifts the frame so that its z = 0 is the plane that most touches lie on; whether there is one.
    ///
    /// - `is_top`: none may lie above it.
    /// - `places`: of the frame as it was, in its plane of the surface: they stay where they are.
    pub fn level(
        &mut self,
        observations: &mut Vec<Observation>,
        is_top: bool,
        places: &mut [&mut Point3<f64>],
    ) -> bool {
        let Some((normal, inliers)) = self.most_plane(observations, is_top) else { return false };
        observations.clone_from(&inliers);
        let mean = Point3::from(mean(inliers.iter().map(|o| o.point.coords)));
        let before = self.pose_of;
        let turn = UnitQuaternion::rotation_between(&self.out(), &normal).unwrap_or_else(UnitQuaternion::identity);
        let rotation = turn * before.rotation;
        // the flag as it is seen along the normal
        let flag = Point3::from(before.translation.vector);
        let ball = self.params.ball_radius;
        let origin = flag + normal.into_inner() * ((mean - flag).dot(&normal) - ball);
        let height = self.height;
        self.pose_of = Isometry3::from_parts(origin.coords.into(), rotation);
        self.height = 0.0;
        for place in places {
            let moved = self.in_f(&(before * Point3::new(place.x, place.y, height)));
            **place = Point3::new(moved.x, moved.y, 0.0);
        }
        true
    }

    /// Normal of the plane that most touches lie on, and those touches.
    fn most_plane(&self, observations: &[Observation], is_top: bool) -> Option<(Unit<Vector3<f64>>, Vec<Observation>)> {
        let least = SPREAD * self.params.ball_radius;
        let of_plane = self.params.beyond(OF_PLANE);
        let (mut best, mut most) = (Vec::new(), (0, 0.0));
        for (i, a) in observations.iter().enumerate() {
            for (j, b) in observations.iter().enumerate().skip(i + 1) {
                for c in &observations[j + 1..] {
                    let (u, v) = (b.point - a.point, c.point - a.point);
                    let area = u.cross(&v);
                    let longest = u.norm().max(v.norm()).max((u - v).norm());
                    if area.norm() < least * longest {
                        continue;
                    }
                    let normal = area.normalize() * area.dot(&self.out()).signum();
                    let off = |o: &Observation| (o.point - a.point).dot(&normal);
                    let inliers = || observations.iter().filter(|o| off(o).abs() < of_plane);
                    let is_allowed = !is_top || observations.iter().all(|o| off(o) < of_plane);
                    // among equals the one that is most as the scan has it
                    let score = (inliers().count(), normal.dot(&self.out()));
                    let is_better = score.0 > most.0 || score.0 == most.0 && score.1 > most.1;
                    if is_allowed && score.1 > ALIKE && is_better {
                        most = score;
                        best = inliers().copied().collect();
                    }
                }
            }
        }
        let scatter = scatter(best.iter().map(|o| o.point.coords));
        let axes = scatter.symmetric_eigen();
        let normal = axes.eigenvectors.column(axes.eigenvalues.imin()).into_owned();
        let normal = Unit::try_new(normal * normal.dot(&self.out()).signum(), 0.0)?;
        (best.len() >= 3).then_some((normal, best))
    }
}
