//! The curve of a chain: in which both surfaces beside it meet, or on the one surface beside it.

use nalgebra::{Point3, Vector3};

use super::polyline::smoothed;
use super::scale::BoundaryScale;
use super::settle::{farthest, on_all};
use super::surfaces::PartSurface;
use touchup_geometry::brep::{
    AnalyticSurface, AxisPlacement, CurveNode, SpaceCurve, SurfaceShape, intersection,
};
use touchup_geometry::numeric::{direction, length_and_direction, mean};

/// Maximum distance of a spline from its surfaces between nodes, m.
const FIT: f64 = 1e-7;
/// Minimum distance of its nodes, m.
const SHORTEST: f64 = 1e-9;
/// Maximum number of its nodes.
const MOST_NODES: usize = 4096;
/// Sine of the least angle in which surfaces cross: 1°.
const CROSSING: f64 = 0.0175;
/// Sine of the maximum angle between a plane or cylinder and the axis of a cylinder along which
/// they touch: 3°.
const PARALLEL: f64 = 0.05;
/// Maximum ratio of the axes of an ellipse: beyond it its arcs are described as splines.
const LONGEST: f64 = 100.0;

/// The curve of a chain between two surfaces.
#[derive(Clone, Debug)]
pub(super) struct MeetingCurve {
    pub curve: SpaceCurve,
    /// whether the surfaces touch along it: they are apart by up to twice its distance from them
    pub is_tangent: bool,
}

/// The curve of both surfaces along a chain; `None` without one nearby.
pub(super) fn meeting(
    surfaces: [&PartSurface; 2],
    points: &[Point3<f64>],
    scale: &BoundaryScale,
) -> Option<MeetingCurve> {
    let pair = surfaces.map(|one| &one.surface);
    let (gap, reach) = (tolerance_of(surfaces), scale.reach);
    let is_near = |curve: &SpaceCurve| reach_of(curve, points) <= reach;
    // within their tolerance tangent surfaces are one, and the border is anywhere there
    let blur = (8.0 * radius_of(pair) * gap).sqrt();
    if let Some(curve) = tangency(pair, points)
        && reach_of(&curve, points) <= reach + blur
        && points_along(&curve, points).all(|p| farthest(&pair, &p) <= gap)
    {
        return Some(MeetingCurve {
            curve,
            is_tangent: true,
        });
    }
    let is_short = |curve: &SpaceCurve| match curve {
        SpaceCurve::Ellipse { major, minor, .. } => major < &(LONGEST * minor),
        _ => true,
    };
    let found = intersection(pair[0], pair[1]).unwrap_or_default();
    let known = found
        .into_iter()
        .filter(|curve| is_short(curve) && is_near(curve));
    let nearest = known.min_by(|a, b| reach_of(a, points).total_cmp(&reach_of(b, points)));
    let traced = || {
        let traced = traced(&pair, &smoothed(points.to_vec(), scale.step)).map(SpaceCurve::Spline);
        traced.filter(|curve| is_near(curve))
    };
    let curve = nearest.or_else(traced)?;
    Some(MeetingCurve {
        curve,
        is_tangent: false,
    })
}

/// Radius of the smaller cylinder or sphere, m; 0 without one.
fn radius_of(pair: [&AnalyticSurface; 2]) -> f64 {
    let radii = pair.map(|one| match one.shape {
        SurfaceShape::Cylinder { radius } | SurfaceShape::Sphere { radius } => radius,
        _ => f64::INFINITY,
    });
    let least = radii[0].min(radii[1]);
    if least.is_finite() { least } else { 0.0 }
}

/// Maximum distance of a common place from both surfaces, m: of the rougher one.
pub(super) fn tolerance_of(surfaces: [&PartSurface; 2]) -> f64 {
    surfaces[0].tolerance.max(surfaces[1].tolerance)
}

/// Largest distance of points from a curve, m.
fn reach_of(curve: &SpaceCurve, points: &[Point3<f64>]) -> f64 {
    points.iter().map(|p| curve.distance(p)).fold(0.0, f64::max)
}

/// The feet of points on a line or circle.
fn points_along(curve: &SpaceCurve, points: &[Point3<f64>]) -> impl Iterator<Item = Point3<f64>> {
    let foot = |p: &Point3<f64>| match curve {
        SpaceCurve::Line { origin, direction } => origin + direction * (p - origin).dot(direction),
        SpaceCurve::Circle { placement, radius } => {
            let at = placement.local(p);
            let (_, away) = length_and_direction(&Vector3::new(at.x, at.y, 0.0));
            placement.place(radius * away.x, radius * away.y, 0.0)
        }
        _ => *p,
    };
    points.iter().map(foot)
}

/// The line along which a cylinder touches a plane or a parallel cylinder, or the circle along which
/// it touches a sphere about its axis, midway between both.
fn tangency(pair: [&AnalyticSurface; 2], points: &[Point3<f64>]) -> Option<SpaceCurve> {
    use SurfaceShape::{Cylinder, Plane, Sphere};
    let middle = Point3::from(mean(points.iter().map(|p| p.coords)));
    let on_axis = |of: &AnalyticSurface| {
        let (origin, axis) = (of.placement.origin, of.placement.axis);
        origin + axis * (middle - origin).dot(&axis)
    };
    let line = |origin, along: Vector3<f64>| {
        Some(SpaceCurve::Line {
            origin,
            direction: direction(&along)?,
        })
    };
    match (pair[0].shape, pair[1].shape) {
        (Cylinder { .. }, Plane) => tangency([pair[1], pair[0]], points),
        (Plane, Cylinder { radius }) => {
            let (normal, axis) = (pair[0].placement.axis, pair[1].placement.axis);
            if axis.dot(&normal).abs() > PARALLEL {
                return None;
            }
            let centre = on_axis(pair[1]);
            let height = pair[0].signed_distance(&centre);
            let off = (height + radius * height.signum()) / 2.0;
            line(centre - normal * off, axis - normal * axis.dot(&normal))
        }
        (Cylinder { radius: r }, Cylinder { radius: s }) => {
            let [a, b] = pair.map(on_axis);
            let axes = pair.map(|one| one.placement.axis);
            if axes[0].cross(&axes[1]).norm() > PARALLEL {
                return None;
            }
            let apart = b - a;
            let out = direction(&(apart - axes[0] * apart.dot(&axes[0])))?;
            let span = apart.dot(&out);
            // outside each other, and one inside the other
            let pairs = [[r, span - s], [r, span + s], [-r, span - s]];
            let gap = |[one, other]: &[f64; 2]| (one - other).abs();
            let nearest = pairs.into_iter().min_by(|x, y| gap(x).total_cmp(&gap(y)))?;
            let along = axes[0] + axes[1] * axes[0].dot(&axes[1]).signum();
            line(a + out * ((nearest[0] + nearest[1]) / 2.0), along)
        }
        (Sphere { .. }, Cylinder { .. }) => tangency([pair[1], pair[0]], points),
        (Cylinder { radius }, Sphere { radius: of_sphere }) => {
            let [axis, centre] = pair.map(|one| one.placement);
            let off = axis.local(&centre.origin).z;
            Some(SpaceCurve::Circle {
                placement: AxisPlacement {
                    origin: nalgebra::center(&(axis.origin + axis.axis * off), &centre.origin),
                    ..axis
                },
                radius: (radius + of_sphere) / 2.0,
            })
        }
        _ => None,
    }
}

/// Sum of the chain's steps along a curve, m: negative if it runs against it.
pub(super) fn advance(curve: &SpaceCurve, points: &[Point3<f64>]) -> f64 {
    let along = |pair: &[Point3<f64>]| {
        let step = pair[1] - pair[0];
        let middle = pair[0] + step / 2.0;
        let tangent = curve.tangent(&middle);
        step.dot(&tangent) / tangent.norm()
    };
    points.windows(2).map(along).sum()
}

/// Nodes of a curve on one or two surfaces along points; equal first and last points close it.
pub(super) fn traced(
    surfaces: &[&AnalyticSurface],
    points: &[Point3<f64>],
) -> Option<Vec<CurveNode>> {
    let is_closed = points.first() == points.last();
    let (first, off) = on_all(surfaces, points.first()?);
    let mut places = vec![first];
    if off > FIT {
        return None;
    }
    for pair in points.windows(2) {
        let (place, off) = on_all(surfaces, &pair[1]);
        if off > FIT {
            return None;
        }
        let ahead = place - places[places.len() - 1];
        // of a zigzag the curve has no part that runs back
        if ahead.norm() > SHORTEST && ahead.dot(&(pair[1] - pair[0])) > 0.0 {
            places.push(place);
        }
    }
    if is_closed && places.len() > 1 {
        places.pop();
        places.push(places[0]);
    }
    let mut nodes = Vec::new();
    let count = places.len();
    for at in 0..count {
        let before = match at {
            0 if is_closed => places[count.checked_sub(2)?],
            0 => places[0],
            at => places[at - 1],
        };
        let after = match at + 1 {
            next if next < count => places[next],
            _ if is_closed => *places.get(1)?,
            _ => places[at],
        };
        nodes.push(node(surfaces, places[at], &(after - before))?);
    }
    refined(surfaces, nodes)
}

fn node(
    surfaces: &[&AnalyticSurface],
    point: Point3<f64>,
    along: &Vector3<f64>,
) -> Option<CurveNode> {
    let tangent = match surfaces {
        [one, other] => {
            let common = one.normal(&point).cross(&other.normal(&point));
            if common.norm() < CROSSING {
                return None;
            }
            common * common.dot(along).signum()
        }
        _ => surfaces.iter().fold(*along, |along, one| {
            let normal = one.normal(&point);
            along - normal * along.dot(&normal)
        }),
    };
    let tangent = direction(&tangent)?;
    Some(CurveNode { point, tangent })
}

/// With more nodes until each span is on the surfaces.
fn refined(surfaces: &[&AnalyticSurface], mut nodes: Vec<CurveNode>) -> Option<Vec<CurveNode>> {
    let mut at = 0;
    while at + 1 < nodes.len() {
        let [a, b] = [nodes[at], nodes[at + 1]];
        let chord = b.point - a.point;
        // the middle of the Hermite span
        let middle = a.point + chord / 2.0 + (a.tangent - b.tangent) * (chord.norm() / 8.0);
        if farthest(surfaces, &middle) <= FIT / 2.0 {
            at += 1;
            continue;
        }
        if nodes.len() >= MOST_NODES {
            return None;
        }
        let place = on_all(surfaces, &middle).0;
        nodes.insert(at + 1, node(surfaces, place, &chord)?);
    }
    (nodes.len() > 1).then_some(nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part_surface(origin: [f64; 3], axis: [f64; 3], shape: SurfaceShape) -> PartSurface {
        PartSurface {
            surface: AnalyticSurface::along(origin.into(), axis.into(), shape),
            is_outward: true,
            is_touched: false,
            uncertainties: Vec::new(),
            tolerance: 20e-6,
        }
    }

    fn scale(step: f64) -> BoundaryScale {
        BoundaryScale {
            near_touched: 0.0,
            width: 2e-3,
            least_area: 0.0,
            short: 0.0,
            step,
            reach: 1e-3,
        }
    }

    /// Half a turn of radius 3 at 3.02 above a wall ends 0.02 above it: midway is 0.01.
    #[test]
    fn an_end_that_touches_its_wall_meets_it_midway() {
        let wall = part_surface([0.0; 3], [0.0, 1.0, 0.0], SurfaceShape::Plane);
        let shape = SurfaceShape::Cylinder { radius: 3e-3 };
        let end = part_surface([0.0, 3.02e-3, 0.0], [0.0, 0.0, 1.0], shape);
        let chain = [0.0, 1.0, 2.0].map(|z| Point3::new(0.2, 0.0, z) * 1e-3);
        let found = meeting([&wall, &end], &chain, &scale(0.0)).unwrap();
        assert!(found.is_tangent);
        let SpaceCurve::Line { origin, direction } = found.curve else {
            panic!("{:?}", found.curve)
        };
        assert!((origin - Point3::new(0.0, 0.01e-3, origin.z)).norm() < 1e-15);
        assert!(direction.z.abs() > 1.0 - 1e-15);
        // 0.1 apart is no touch within 0.02
        let far = part_surface([0.0, 3.1e-3, 0.0], [0.0, 0.0, 1.0], shape);
        assert!(meeting([&wall, &far], &chain, &scale(0.0)).is_none());
    }

    /// A cone cut aslant has no form, and its points have r = 5 + z / 2 and z = x / 4: nodes of a
    /// zigzag beside it run along it.
    #[test]
    fn the_cut_of_a_cone_is_traced_along_a_zigzag() {
        let half_angle = 0.5f64.atan();
        let radius = 5e-3;
        let shape = SurfaceShape::Cone { radius, half_angle };
        let cone = part_surface([0.0; 3], [0.0, 0.0, 1.0], shape);
        let cut = part_surface([0.0; 3], [-0.25, 0.0, 1.0], SurfaceShape::Plane);
        let place = |step: i32| {
            let turn = f64::from(step) / 60.0 + 0.01 * f64::from(step % 2);
            let r = 5.0 + 0.3 * f64::from(step % 2);
            Point3::new(r * turn.cos(), r * turn.sin(), 0.25 * r * turn.cos()) * 1e-3
        };
        let chain: Vec<_> = (0..=120).map(place).collect();
        let found = meeting([&cone, &cut], &chain, &scale(0.3e-3)).unwrap();
        let SpaceCurve::Spline(nodes) = found.curve else {
            panic!("{:?}", found.curve)
        };
        for CurveNode { point, .. } in &nodes {
            let r = point.x.hypot(point.y);
            assert!((r - 5e-3 - point.z / 2.0).abs() < 1e-9, "{point}");
            assert!((point.z - point.x / 4.0).abs() < 1e-9, "{point}");
        }
        let turn = |node: &CurveNode| node.point.y.atan2(node.point.x);
        assert!(nodes.windows(2).all(|pair| turn(&pair[0]) < turn(&pair[1])));
    }
}
