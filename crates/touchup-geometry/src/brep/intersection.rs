//! Curves in which two surfaces meet.

use nalgebra::{Point3, Vector2, Vector3};

use super::circles::{circles, line_and_circle};
use super::curve::SpaceCurve;
use super::meridian::coaxial;
use super::placement::{AxisPlacement, COINCIDENT, PARALLEL};
use super::ruling::ruled;
use super::surface::{AnalyticSurface, SurfaceShape};

/// The curves in which two whole surfaces meet: none of apart or coincident ones, one at a
/// tangency. `None` of a pair without a form here.
///
/// Lines, circles and ellipses are exact: of two planes; of a plane and a cylinder; of two surfaces
/// of revolution about one axis, such as a sphere and any plane; of parallel cylinders; of equal
/// cylinders with crossing axes. A cylinder meets a skew cylinder, a sphere aside, and a cone that
/// its lines cross, in splines no farther from both than 10⁻⁶ of the radius. Missing are a cone cut
/// aslant or with a sphere aside, and two skew cones.
pub fn intersection(a: &AnalyticSurface, b: &AnalyticSurface) -> Option<Vec<SpaceCurve>> {
    use SurfaceShape::{Cylinder, Plane};
    if let Some(circles) = coaxial(a, b) {
        return Some(circles);
    }
    match (a.shape, b.shape) {
        (Plane, Plane) => Some(of_planes(&a.placement, &b.placement)),
        (Plane, Cylinder { radius }) => Some(cut(&b.placement, radius, &a.placement)),
        (Cylinder { radius }, Plane) => Some(cut(&a.placement, radius, &b.placement)),
        (Cylinder { radius: r }, Cylinder { radius: s }) => {
            let (a_axis, b_axis) = (&a.placement, &b.placement);
            let parallel = parallel_cylinders(a_axis, r, b_axis, s);
            let exact = parallel.or_else(|| equal_cylinders(a_axis, r, b_axis, s));
            // along the lines of the smaller one
            let (small, large) = if r <= s { (a, b) } else { (b, a) };
            exact.or_else(|| ruled(small, large))
        }
        (Cylinder { .. }, _) => ruled(a, b),
        (_, Cylinder { .. }) => ruled(b, a),
        _ => None,
    }
}

fn of_planes(a: &AxisPlacement, b: &AxisPlacement) -> Vec<SpaceCurve> {
    let along = a.axis.cross(&b.axis);
    let squared = along.norm_squared();
    if squared <= PARALLEL * PARALLEL {
        return Vec::new();
    }
    // the point of both planes nearest to the origin of the first
    let height = b.axis.dot(&(b.origin - a.origin));
    vec![SpaceCurve::Line {
        origin: a.origin + along.cross(&a.axis) * (height / squared),
        direction: along / squared.sqrt(),
    }]
}

/// Of a cylinder by a plane that is not square to it: lines or an ellipse.
fn cut(cylinder: &AxisPlacement, radius: f64, plane: &AxisPlacement) -> Vec<SpaceCurve> {
    let axis = cylinder.axis;
    let share = plane.axis.dot(&axis);
    let height = plane.axis.dot(&(plane.origin - cylinder.origin));
    if share.abs() > PARALLEL {
        // of a cut almost square to the axis the first difference is mostly rounding
        let steepest = (axis - plane.axis * share).normalize();
        let steepest = steepest - plane.axis * steepest.dot(&plane.axis);
        return vec![SpaceCurve::Ellipse {
            placement: AxisPlacement {
                origin: cylinder.origin + axis * (height / share),
                axis: plane.axis,
                reference: steepest.normalize(),
            },
            major: radius / share.abs(),
            minor: radius,
        }];
    }
    // across the axis
    let local =
        |v: Vector3<f64>| Vector2::new(v.dot(&cylinder.reference), v.dot(&cylinder.second()));
    let (point, aside) = (local(plane.axis * height), local(axis.cross(&plane.axis)));
    let points = line_and_circle(&point, &aside, &Vector2::zeros(), radius);
    lines(cylinder, &points)
}

/// Along the axis through these places across it.
fn lines(axis: &AxisPlacement, places: &[Vector2<f64>]) -> Vec<SpaceCurve> {
    let line = |place: &Vector2<f64>| SpaceCurve::Line {
        origin: axis.place(place.x, place.y, 0.0),
        direction: axis.axis,
    };
    places.iter().map(line).collect()
}

/// Lines of two parallel cylinders; `None` of others.
fn parallel_cylinders(
    a: &AxisPlacement,
    radius: f64,
    b: &AxisPlacement,
    other_radius: f64,
) -> Option<Vec<SpaceCurve>> {
    let is_parallel = a.axis.cross(&b.axis).norm() <= PARALLEL;
    let centre = a.local(&b.origin).xy();
    let points = circles(&Vector2::zeros(), radius, &centre, other_radius);
    is_parallel.then(|| lines(a, &points))
}

/// Ellipses of two cylinders of one radius whose axes cross; `None` of others.
fn equal_cylinders(
    a: &AxisPlacement,
    radius: f64,
    b: &AxisPlacement,
    other_radius: f64,
) -> Option<Vec<SpaceCurve>> {
    let small = COINCIDENT * radius;
    let square = a.axis.cross(&b.axis).normalize();
    let off = b.origin - a.origin;
    if (radius - other_radius).abs() > small || off.dot(&square).abs() > small {
        return None;
    }
    let cosine = a.axis.dot(&b.axis);
    let to_b = off - b.axis * off.dot(&b.axis);
    let crossing: Point3<f64> = a.origin + a.axis * (to_b.dot(&a.axis) / (1.0 - cosine * cosine));
    let ellipse = |other: Vector3<f64>| {
        // half the angle between the axes, seen from the plane of the ellipse
        let half_sine = ((1.0 - a.axis.dot(&other)) / 2.0).sqrt();
        let reference = (a.axis + other).normalize();
        SpaceCurve::Ellipse {
            placement: AxisPlacement {
                origin: crossing,
                axis: reference.cross(&square),
                reference,
            },
            major: radius / half_sine,
            minor: radius,
        }
    };
    Some(vec![ellipse(b.axis), ellipse(-b.axis)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brep::SplineForm;
    use crate::brep::spline_form;

    fn surface(origin: [f64; 3], axis: [f64; 3], shape: SurfaceShape) -> AnalyticSurface {
        AnalyticSurface::along(origin.into(), axis.into(), shape)
    }

    /// No point is missing: changes of sign of the distance along lines of a cylinder.
    fn assert_complete(a: &AnalyticSurface, b: &AnalyticSurface, curves: &[SpaceCurve]) {
        let SurfaceShape::Cylinder { radius } = a.shape else {
            return;
        };
        for step in 0..90 {
            let (sin, cos) = (0.013 + f64::from(step).to_radians() * 4.0).sin_cos();
            let at = |t: f64| a.placement.place(radius * cos, radius * sin, t);
            let off = |t: f64| b.signed_distance(&at(t));
            for tenth in -400..400 {
                let [mut low, mut high] = [tenth, tenth + 1].map(|t| f64::from(t) * 1e-4);
                if off(low) * off(high) >= 0.0 {
                    continue;
                }
                for _ in 0..50 {
                    let middle = (low + high) / 2.0;
                    let half = if off(low) * off(middle) > 0.0 {
                        &mut low
                    } else {
                        &mut high
                    };
                    *half = middle;
                }
                let is_there = |curve: &SpaceCurve| curve.distance(&at(low)) < 1e-7;
                assert!(curves.iter().any(is_there), "{:?}: {a:?} {b:?}", at(low));
            }
        }
    }

    /// All curves lie on both surfaces, by the distance of the surface alone, and none is missing.
    fn checked(a: &AnalyticSurface, b: &AnalyticSurface) -> Vec<SpaceCurve> {
        let curves = intersection(a, b).unwrap();
        let turned = intersection(b, a).unwrap();
        assert_eq!(curves.len(), turned.len());
        assert_complete(a, b, &curves);
        assert_complete(b, a, &curves);
        for curve in curves.iter().chain(&turned) {
            assert!(curve.is_sound(), "{curve:?}");
            let begin = curve.begin();
            let end = match curve {
                SpaceCurve::Line { direction, .. } => begin + direction,
                _ => begin,
            };
            for point in curve.points(&begin, &end) {
                let off = [a, b].map(|s| s.signed_distance(&point).abs());
                assert!(off[0].max(off[1]) < 1e-8, "{off:?} of {curve:?}");
            }
        }
        curves
    }

    fn radii(curves: &[SpaceCurve]) -> Vec<f64> {
        let radius = |curve: &SpaceCurve| match curve {
            SpaceCurve::Circle { radius, .. } => *radius,
            other => panic!("{other:?}"),
        };
        let mut radii: Vec<_> = curves.iter().map(radius).collect();
        radii.sort_by(f64::total_cmp);
        radii
    }

    fn assert_close(found: &[f64], wanted: &[f64]) {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        let pairs = found.iter().zip(wanted);
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-15, "{found:?} {wanted:?}"));
    }

    #[test]
    fn planes_meet_in_a_line_or_nowhere() {
        let floor = surface([0.1, 0.2, 0.03], [0.0, 0.0, 2.0], SurfaceShape::Plane);
        let wall = surface([0.05, 0.0, 0.0], [1.0, 1.0, 0.0], SurfaceShape::Plane);
        let curves = checked(&floor, &wall);
        assert_eq!(curves.len(), 1);
        let above = surface([0.0; 3], [0.0, 0.0, -1.0], SurfaceShape::Plane);
        assert_eq!(intersection(&floor, &above), Some(Vec::new()));
        assert_eq!(intersection(&floor, &floor), Some(Vec::new()));
    }

    #[test]
    fn a_plane_cuts_a_cylinder_in_a_circle_an_ellipse_or_lines() {
        let cylinder = surface(
            [0.01, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            SurfaceShape::Cylinder { radius: 0.005 },
        );
        let plane = |x: f64, axis: [f64; 3]| surface([x, 0.0, 0.02], axis, SurfaceShape::Plane);
        assert_close(
            &radii(&checked(&cylinder, &plane(0.3, [0.0, 0.0, -1.0]))),
            &[0.005],
        );
        // by 60° off the axis the major half axis is twice the radius
        let sine = 0.75f64.sqrt();
        match &checked(&cylinder, &plane(0.01, [sine, 0.0, 0.5]))[..] {
            [
                SpaceCurve::Ellipse {
                    major,
                    minor,
                    placement,
                },
            ] => {
                assert_close(&[*major, *minor], &[0.01, 0.005]);
                assert!((placement.origin - Point3::new(0.01, 0.0, 0.02)).norm() < 1e-15);
            }
            other => panic!("{other:?}"),
        }
        // by less than a minute of arc: its longer axis is a small difference
        assert_eq!(
            checked(&cylinder, &plane(0.01, [5.7e-6, -5.6e-5, 1.0])).len(),
            1
        );
        let lines = |x| checked(&cylinder, &plane(x, [1.0, 0.0, 0.0])).len();
        assert_eq!(
            [0.004, 0.005, 0.012, 0.015, 0.016].map(lines),
            [0, 1, 2, 1, 0]
        );
    }

    #[test]
    fn surfaces_about_one_axis_meet_in_circles() {
        let about = |z: f64, up: f64, shape| surface([0.0, 0.0, z], [0.0, 0.0, up], shape);
        let half_angle = 0.75f64.atan();
        let cone = about(
            0.01,
            -1.0,
            SurfaceShape::Cone {
                radius: 0.003,
                half_angle,
            },
        );
        // the cone of slope 3/4 turned down: radius 3 mm at 10 mm, 6 mm at 6 mm
        let square = about(0.006, 1.0, SurfaceShape::Plane);
        assert_close(&radii(&checked(&cone, &square)), &[0.006]);
        let cylinder = about(0.0, 1.0, SurfaceShape::Cylinder { radius: 0.006 });
        assert_close(&radii(&checked(&cone, &cylinder)), &[0.006]);
        // above the apex, at 14 mm, is nothing
        let above = about(0.02, 1.0, SurfaceShape::Plane);
        assert_eq!(checked(&cone, &above).len(), 0);
    }

    /// Nodes of the crossing of a small cylinder along x with a large one along z, against the
    /// closed form x = ±√(R² − y²).
    #[test]
    fn cylinders_meet_in_lines_ellipses_or_curves() {
        let cylinder =
            |origin, axis, radius| surface(origin, axis, SurfaceShape::Cylinder { radius });
        let shaft = cylinder([0.0; 3], [0.0, 0.0, 1.0], 0.01);
        let hole = cylinder([0.0, 0.0, 0.005], [1.0, 0.0, 0.0], 0.004);
        let curves = checked(&shaft, &hole);
        assert_eq!(curves.len(), 2);
        for curve in &curves {
            let SpaceCurve::Spline(nodes) = curve else {
                panic!("{curve:?}")
            };
            let SplineForm { knots, .. } = spline_form(nodes);
            // an arc of the ellipse-like curve is longer than the circle of the hole
            assert!(
                knots.last().is_some_and(|length| *length > 0.0251),
                "{knots:?}"
            );
            for node in nodes {
                let x = (1e-4 - node.point.y.powi(2)).sqrt();
                assert!((node.point.x.abs() - x).abs() < 1e-12, "{node:?}");
            }
        }
        // an axis beside the shaft: one curve, out and back
        let beside = cylinder([0.0, 0.009, 0.0], [1.0, 0.0, 0.2], 0.004);
        assert_eq!(checked(&shaft, &beside).len(), 1);
        let away = cylinder([0.0, 0.015, 0.0], [1.0, 0.0, 0.0], 0.004);
        assert_eq!(checked(&shaft, &away).len(), 0);
        // equal ones: the plane of each ellipse halves the angle of the axes
        let equal = cylinder([0.002, 0.0, 0.003], [1.0, 0.0, 1.0], 0.01);
        let majors: Vec<_> = checked(&shaft, &equal)
            .iter()
            .map(|curve| match curve {
                SpaceCurve::Ellipse { major, .. } => *major,
                other => panic!("{other:?}"),
            })
            .collect();
        let [narrow, wide] = [22.5f64, 67.5].map(|angle| 0.01 / angle.to_radians().sin());
        assert!((majors[0] - narrow).abs() + (majors[1] - wide).abs() < 1e-15);
        for (x, count) in [(0.012, 2), (0.014, 1), (0.02, 0), (0.006, 1)] {
            let beside = cylinder([x, 0.0, 0.5], [0.0, 0.0, -1.0], 0.004);
            assert_eq!(checked(&shaft, &beside).len(), count, "{x}");
        }
    }

    #[test]
    fn a_cylinder_meets_a_cone_aside_in_curves() {
        let hole = surface(
            [0.002, 0.0, 0.004],
            [1.0, 0.3, 0.0],
            SurfaceShape::Cylinder { radius: 0.002 },
        );
        let cone = surface(
            [0.0; 3],
            [0.0, 0.0, 1.0],
            SurfaceShape::Cone {
                radius: 0.01,
                half_angle: 0.3,
            },
        );
        assert_eq!(checked(&hole, &cone).len(), 2);
        // the same hole through the mirror image of the cone behind its apex
        let apex = -0.01 / 0.3f64.tan();
        let behind = surface(
            [0.0, 0.0, 2.0 * apex],
            [1.0, 0.0, 0.0],
            SurfaceShape::Cylinder { radius: 0.002 },
        );
        assert_eq!(checked(&behind, &cone).len(), 0);
        let aslant = surface([0.0; 3], [1.0, 0.0, 1.0], SurfaceShape::Plane);
        assert_eq!(intersection(&cone, &aslant), None);
    }

    /// Squared radii of right triangles, the height 12 of the triangle 13, 14, 15, and a cone of slope
    /// 3/4 from the middle of its sphere.
    #[test]
    fn a_sphere_meets_what_is_about_a_diameter_in_circles() {
        let sphere =
            |origin, radius| surface(origin, [0.0, 0.0, 1.0], SurfaceShape::Sphere { radius });
        let ball = sphere([0.0; 3], 0.013);
        let cut = surface([0.0, 0.005, 0.0], [0.0, -1.0, 0.0], SurfaceShape::Plane);
        assert_close(&radii(&checked(&ball, &cut)), &[0.012]);
        let aside = surface([0.0, 0.014, 0.0], [0.0, 1.0, 0.0], SurfaceShape::Plane);
        assert_eq!(checked(&ball, &aside).len(), 0);
        let stem = SurfaceShape::Cylinder { radius: 0.005 };
        let stem = surface([0.03, 0.0, 0.0], [1.0, 0.0, 0.0], stem);
        assert_close(&radii(&checked(&ball, &stem)), &[0.005, 0.005]);
        let other = sphere([0.014, 0.0, 0.0], 0.015);
        assert_close(&radii(&checked(&ball, &other)), &[0.012]);
        assert_eq!(
            intersection(&ball, &sphere([0.0; 3], 0.01)),
            Some(Vec::new())
        );
        let (radius, half_angle) = (0.0, 0.75f64.atan());
        let cone = surface(
            [0.0; 3],
            [0.0, 1.0, 0.0],
            SurfaceShape::Cone { radius, half_angle },
        );
        assert_close(&radii(&checked(&cone, &sphere([0.0; 3], 0.01))), &[0.006]);
        // a hole aside enters and leaves
        let hole = SurfaceShape::Cylinder { radius: 0.003 };
        let hole = surface([0.004, 0.0, 0.0], [0.1, 0.2, 1.0], hole);
        assert_eq!(checked(&hole, &ball).len(), 2);
    }
}
