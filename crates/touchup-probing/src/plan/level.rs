//! True pose of the surface around a flag: before touches only the scan gives its normal.

use std::f64::consts::SQRT_2;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::search_context::SearchContext;
use touchup_features::features::fit::{FitParams, Observation, Plane, fit};
use touchup_geometry::numeric::{mean, scatter, thinnest_direction};

/// Maximum distance of a plane's touches from it, m.
const OF_PLANE: f64 = 60e-6;
/// Minimum height of the triangle of three touches that determine a plane, over the ball's radius.
const SPREAD: f64 = 1.0;

/// Standard deviation of the scan's normal, in each of two directions, rad: near an edge that the
/// scan has rounded it is off by 0.16.
pub(super) const UNTOUCHED: f64 = 0.1;
/// Minimum distance of other touches from a plane, in standard deviations.
const GATE: f64 = 4.0;
/// Cosine of the maximum error of the scan's normal: 25°.
const ALIKE: f64 = 0.9;

impl SearchContext {
    /// Turns and lifts the frame so that its z = 0 is the plane of most touches; returns whether
    /// there is one.
    ///
    /// - `is_top`: no touch may lie above it.
    /// - `places`: in the frame as it was, in its plane of the surface; they stay in place.
    pub(crate) fn level(
        &mut self,
        observations: &mut Vec<Observation>,
        is_top: bool,
        places: &mut [&mut Point3<f64>],
    ) -> bool {
        let Some((normal, inliers)) = self.most_plane(observations, is_top) else {
            return false;
        };
        observations.clone_from(&inliers);
        let mean = Point3::from(mean(inliers.iter().map(|o| o.point.coords)));
        let before = self.pose_of;
        let turn = UnitQuaternion::rotation_between(&self.out(), &normal)
            .unwrap_or_else(UnitQuaternion::identity);
        let rotation = turn * before.rotation;
        // the flag, seen along the normal
        let flag = Point3::from(before.translation.vector);
        let ball = self.params.ball_radius;
        let origin = flag + normal.into_inner() * ((mean - flag).dot(&normal) - ball);
        let height = self.height;
        self.pose_of = Isometry3::from_parts(origin.coords.into(), rotation);
        self.height = 0.0;
        let plane = fit(&Plane::new(mean, &normal), &inliers, &FitParams::default()).ok();
        self.lean = plane
            .and_then(|plane| plane.axis_std())
            .map_or(UNTOUCHED, |both| both / SQRT_2);
        for place in places {
            let moved = self.in_f(&(before * Point3::new(place.x, place.y, height)));
            **place = Point3::new(moved.x, moved.y, 0.0);
        }
        true
    }

    /// Normal of the plane of most touches, and these touches: of the planes through three of them,
    /// it has the least truncated squares \[Torr Zisserman 2000, MSAC\], with the normal of the
    /// scan as one more observation.
    fn most_plane(
        &self,
        observations: &[Observation],
        is_top: bool,
    ) -> Option<(Unit<Vector3<f64>>, Vec<Observation>)> {
        let least = SPREAD * self.params.ball_radius;
        let of_plane = self.params.beyond(OF_PLANE);
        let (mut best, mut least_cost) = (Vec::new(), f64::INFINITY);
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
                    let is_allowed = !is_top || observations.iter().all(|o| off(o) < of_plane);
                    let alike = normal.dot(&self.out());
                    // −ln of the probability, without constants
                    let of_touch =
                        |o: &Observation| (off(o) / of_plane).powi(2).min(1.0) * GATE.powi(2) / 2.0;
                    let turned = alike.clamp(-1.0, 1.0).acos() / UNTOUCHED;
                    let cost =
                        observations.iter().map(of_touch).sum::<f64>() + turned.powi(2) / 2.0;
                    if is_allowed && alike > ALIKE && cost < least_cost {
                        least_cost = cost;
                        best = observations
                            .iter()
                            .filter(|o| off(o).abs() < of_plane)
                            .copied()
                            .collect();
                    }
                }
            }
        }
        let normal = thinnest_direction(scatter(best.iter().map(|o| o.point.coords)));
        let normal = Unit::try_new(normal * normal.dot(&self.out()).signum(), 0.0)?;
        (best.len() >= 3).then_some((normal, best))
    }
}
