//! The part of an analytic surface between its places.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector2, Vector3};

use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};

/// Widest gap between the places around an axis that a surface goes across, rad: three places a
/// third of a turn apart fix a circle, two places across do not.
const WIDEST_GAP: f64 = TAU * 0.4;

/// Hull of places on a surface, in its own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SurfaceExtent {
    /// corners of a convex polygon in a plane, m, counter-clockwise; one or two for a point or a
    /// segment
    Flat(Vec<Vector2<f64>>),
    /// part of a surface about its axis
    Round {
        /// angle at which it starts, rad, and its turn from there
        angles: [f64; 2],
        /// lowest and highest place along the axis, m
        heights: [f64; 2],
        /// largest distance from the axis, m
        radius: f64,
    },
}

impl SurfaceExtent {
    /// - `places`: on the surface, at least one, m, in O.
    pub(super) fn of(surface: &AnalyticSurface, places: &[Point3<f64>]) -> Self {
        let local: Vec<_> = places
            .iter()
            .map(|place| surface.placement.local(place))
            .collect();
        if surface.shape == SurfaceShape::Plane {
            return Self::Flat(convex_hull(local.iter().map(|at| at.xy()).collect()));
        }
        let range = |of: fn(&Vector3<f64>) -> f64| {
            let values = local.iter().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            })
        };
        Self::Round {
            angles: arc_of(local.iter().map(|at| at.y.atan2(at.x)).collect()),
            heights: range(|at| at.z),
            radius: range(|at| at.xy().norm())[1],
        }
    }

    /// Distance along the surface from a place on it to the extent, m; 0 within.
    ///
    /// - `at`: the place, in the coordinates of the surface's placement.
    pub(super) fn beyond(&self, at: &Vector3<f64>) -> f64 {
        match self {
            Self::Flat(corners) => from_polygon(corners, &at.xy()),
            Self::Round {
                angles: [start, turn],
                heights: [low, high],
                ..
            } => {
                let from_start = (at.y.atan2(at.x) - start).rem_euclid(TAU);
                let past = (from_start - turn).max(0.0).min(TAU - from_start);
                let aside = if from_start <= *turn { 0.0 } else { past };
                let above = (at.z - high).max(low - at.z).max(0.0);
                (aside * at.xy().norm()).hypot(above)
            }
        }
    }

    /// Number of places at this distance of neighbours, m, that cover it.
    pub(super) fn count(&self, spacing: f64) -> f64 {
        self.steps(spacing)
            .iter()
            .map(|steps| steps + 1.0)
            .product()
    }

    /// Steps of this length, m, along both of its coordinates.
    fn steps(&self, spacing: f64) -> [f64; 2] {
        let lengths = match self {
            Self::Flat(corners) => {
                let [low, high] = box_of(corners);
                [high.x - low.x, high.y - low.y]
            }
            Self::Round {
                angles: [_, turn],
                heights: [low, high],
                radius,
            } => [turn * radius, high - low],
        };
        lengths.map(|length| (length / spacing).ceil())
    }

    /// Places that cover it, neighbours at most this far apart, m: on the surface, in O.
    pub(super) fn places(&self, surface: &AnalyticSurface, spacing: f64) -> Vec<Point3<f64>> {
        let steps = self.steps(spacing);
        let shares = |count: f64| (0..=count as u32).map(move |at| f64::from(at) / count.max(1.0));
        let grid = shares(steps[0]).flat_map(|u| shares(steps[1]).map(move |v| [u, v]));
        let frame = &surface.placement;
        match self {
            Self::Flat(corners) => {
                let [low, high] = box_of(corners);
                grid.map(|[u, v]| low + (high - low).component_mul(&Vector2::new(u, v)))
                    .filter(|at| from_polygon(corners, at) <= spacing)
                    .map(|at| frame.place(at.x, at.y, 0.0))
                    .collect()
            }
            Self::Round {
                angles: [start, turn],
                heights: [low, high],
                radius,
            } => grid
                .map(|[u, v]| {
                    let angle = start + turn * u;
                    let off = [angle.cos() * radius, angle.sin() * radius];
                    let place = frame.place(off[0], off[1], low + (high - low) * v);
                    place - surface.normal(&place) * surface.signed_distance(&place)
                })
                .collect(),
        }
    }
}

fn box_of(corners: &[Vector2<f64>]) -> [Vector2<f64>; 2] {
    let first = corners[0];
    corners.iter().fold([first, first], |[low, high], corner| {
        [low.inf(corner), high.sup(corner)]
    })
}

/// Start and length of the shortest arc over all angles; a full turn if its gap is not too wide.
fn arc_of(mut angles: Vec<f64>) -> [f64; 2] {
    angles.sort_by(f64::total_cmp);
    let next = |at: usize| {
        let wraps = if at + 1 < angles.len() { 0.0 } else { TAU };
        angles[(at + 1) % angles.len()] + wraps
    };
    let (at, gap) = (0..angles.len())
        .map(|at| (at, next(at) - angles[at]))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, TAU));
    let turn = if gap <= WIDEST_GAP { TAU } else { TAU - gap };
    [next(at), turn]
}

/// Corners of the convex hull, counter-clockwise \[Andrew 1979\].
fn convex_hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(point - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter());
    hull.extend(chain(&mut points.iter().rev()));
    hull
}

/// Distance from a convex polygon; 0 within.
fn from_polygon(corners: &[Vector2<f64>], at: &Vector2<f64>) -> f64 {
    let sides = || corners.iter().zip(corners.iter().cycle().skip(1));
    if corners.len() > 2 && sides().all(|(a, b)| (b - a).perp(&(at - a)) >= 0.0) {
        return 0.0;
    }
    let from_side = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
        let along = b - a;
        let share = (at - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        (at - a - along * share.clamp(0.0, 1.0)).norm()
    };
    sides().map(from_side).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bore() -> AnalyticSurface {
        AnalyticSurface::along(
            Point3::new(1.0, 2.0, 3.0),
            Vector3::z(),
            SurfaceShape::Cylinder { radius: 4.0 },
        )
    }

    fn at(surface: &AnalyticSurface, degrees: f64, height: f64) -> Point3<f64> {
        let angle = degrees.to_radians();
        let SurfaceShape::Cylinder { radius } = surface.shape else {
            unreachable!()
        };
        surface
            .placement
            .place(radius * angle.cos(), radius * angle.sin(), height)
    }

    #[test]
    fn a_polygon_holds_what_lies_between_its_places() {
        let plane = AnalyticSurface::along(Point3::origin(), Vector3::z(), SurfaceShape::Plane);
        let places = [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [1.0, 1.0]];
        let places = places.map(|[x, y]| plane.placement.place(x, y, 0.0));
        let extent = SurfaceExtent::of(&plane, &places);
        let beyond = |x: f64, y: f64| extent.beyond(&Vector3::new(x, y, 0.0));
        assert_eq!(beyond(1.0, 1.0), 0.0);
        assert_eq!((beyond(-2.0, 1.0), beyond(6.0, -4.0)), (2.0, 5.0));
        // 3-4-5: the middle of the long side, and 1 outward from there
        assert!((beyond(1.5 + 0.8, 2.0 + 0.6) - 1.0).abs() < 1e-12);
        let one = SurfaceExtent::of(&plane, &places[..1]);
        assert_eq!(one.beyond(&Vector3::new(3.0, 4.0, 0.0)), 5.0);
        let two = SurfaceExtent::of(&plane, &places[..2]);
        assert_eq!(two.beyond(&Vector3::new(1.0, -2.0, 0.0)), 2.0);
    }

    #[test]
    fn places_around_an_axis_close_a_turn_unless_a_wide_part_is_open() {
        let bore = bore();
        let extent = |degrees: &[f64]| {
            let places: Vec<_> = degrees
                .iter()
                .flat_map(|angle| [at(&bore, *angle, -1.0), at(&bore, *angle, -3.0)])
                .collect();
            SurfaceExtent::of(&bore, &places)
        };
        let beyond = |extent: &SurfaceExtent, degrees: f64, height: f64| {
            extent.beyond(&bore.placement.local(&at(&bore, degrees, height)))
        };
        let all = extent(&[10.0, 130.0, 250.0]);
        assert_eq!(beyond(&all, 70.0, -2.0), 0.0);
        assert!((beyond(&all, 310.0, 2.0) - 3.0).abs() < 1e-12);
        // a half turn across 0°: 30° before its start are 4 π/6 on the wall
        let half = extent(&[-90.0, 0.0, 90.0]);
        assert!(beyond(&half, 45.0, -2.0) < 1e-12 && beyond(&half, -45.0, -2.0) < 1e-12);
        let aside = 4.0 * 30f64.to_radians();
        for degrees in [-120.0, 120.0] {
            assert!((beyond(&half, degrees, -2.0) - aside).abs() < 1e-9);
            assert!((beyond(&half, degrees, 0.0) - aside.hypot(1.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn places_cover_the_extent_and_lie_on_the_surface() {
        let bore = bore();
        let places = [0.0, 90.0, 180.0, 270.0].map(|angle| at(&bore, angle, angle / 100.0));
        let extent = SurfaceExtent::of(&bore, &places);
        let found = extent.places(&bore, 1.0);
        // 8π around in 26 steps, 2.7 up in 3
        assert_eq!(found.len(), 27 * 4);
        assert_eq!(extent.count(1.0), found.len() as f64);
        assert!(
            found
                .iter()
                .all(|place| bore.signed_distance(place).abs() < 1e-12)
        );
        for degrees in 0..36 {
            let wanted = at(&bore, f64::from(10 * degrees), 1.3);
            assert!(found.iter().any(|place| (place - wanted).norm() < 1.0));
        }
    }
}
