//! Features with surfaces fitted to single touches, before any mesh shows them.

use nalgebra::{Point3, Vector3};

use super::borders::on_both;
use super::feature::{Feature, FeatureKind, FittedTo, MeasuredValue, Walls};
use super::fit::{Cylinder, Fit, Freedom, Plane, Stadium, SurfaceModel};

/// Numbers of touches, in ascending order.
pub(super) type Touches = Vec<u32>;

/// The end of a hole or slot, or the top of a boss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// on the surface, m in O
    pub point: Point3<f64>,
    /// standard deviation along the axis, m
    pub sigma: f64,
}

impl Feature {
    /// A hole, or a boss if the wall is convex.
    ///
    /// - `top`: plane around the opening, or the foot of the boss; `end`: on the floor, or the
    ///   boss' top, if touched.
    /// - `touches`: used touches.
    pub fn round(
        wall: &Fit<Cylinder>,
        top: &Fit<Plane>,
        end: Option<&End>,
        touches: Touches,
    ) -> Self {
        let out = top.surface.normal();
        let centre = met(&top.surface, &wall.surface.center(), &wall.surface.axis());
        let kind = if wall.surface.concave {
            FeatureKind::Hole
        } else {
            FeatureKind::Boss
        };
        Self {
            axis: Some(axis_of(wall, &out, &touches)),
            diameter: Some(number(
                wall,
                2.0 * wall.surface.radius,
                &[(Freedom::Size, 2.0)],
                &touches,
            )),
            depth: end.map(|end| apart(top, end, &touches)),
            through: end.filter(|_| kind == FeatureKind::Hole).map(|_| false),
            walls: Some(Walls::Round(wall.surface)),
            ..Self::touched(kind, centre, wall.lateral_std(&centre), touches)
        }
    }

    /// A slot: its walls, the plane around its opening, and its floor if touched.
    pub fn slot(
        wall: &Fit<Stadium>,
        top: &Fit<Plane>,
        floor: Option<&End>,
        touches: Touches,
    ) -> Self {
        let centre = met(&top.surface, &wall.surface.center(), &wall.surface.axis());
        let direction = wall.surface.direction();
        let half = direction * (wall.surface.length / 2.0);
        Self {
            axis: Some(axis_of(wall, &top.surface.normal(), &touches)),
            direction: Some(direction),
            width: Some(number(
                wall,
                wall.surface.width,
                &[(Freedom::Size, 1.0)],
                &touches,
            )),
            length: Some(number(
                wall,
                wall.surface.length,
                &[(Freedom::Second, 1.0)],
                &touches,
            )),
            depth: floor.map(|floor| apart(top, floor, &touches)),
            through: floor.map(|_| false),
            points: vec![centre - half, centre + half],
            walls: Some(Walls::Slot(wall.surface)),
            ..Self::touched(FeatureKind::Slot, centre, wall.middle_std(), touches)
        }
    }

    /// The edge between two planes, from the first of `ends` to the second; `None` if the planes
    /// are parallel.
    ///
    /// - `ends`: near the edge, m in O.
    pub fn edge(
        sides: [&Fit<Plane>; 2],
        ends: &[Point3<f64>; 2],
        is_convex: bool,
        touches: Touches,
    ) -> Option<Self> {
        let planes = sides.map(|side| &side.surface);
        let std_at = |side: usize, point: &Point3<f64>| sides[side].std_at(point);
        let (mut axis, sine, edge) = Self::crossing(planes, std_at, ends, is_convex, touches)?;
        // a plane that leans along the edge takes the edge with it
        let leans = sides.map(|side| {
            let along = side.surface.pose_of.inverse_transform_vector(&axis.value);
            side.std_by(&[(Freedom::TiltX, along.x), (Freedom::TiltY, along.y)])
        });
        axis.std = leans[0].zip(leans[1]).map(|(a, b)| a.hypot(b) / sine);
        Some(Self {
            axis: Some(axis),
            ..edge
        })
    }

    /// The edge between two planes, from the first of `ends` to the second: its axis, the sine of
    /// the angle between the planes, and the feature; `None` if the planes are parallel.
    ///
    /// - `std_at`: standard deviation of a plane along its normal at one of its points, m.
    pub(super) fn crossing(
        planes: [&Plane; 2],
        std_at: impl Fn(usize, &Point3<f64>) -> Option<f64>,
        ends: &[Point3<f64>; 2],
        is_convex: bool,
        touches: Touches,
    ) -> Option<(MeasuredValue<Vector3<f64>>, f64, Self)> {
        let direction = planes[0].normal().cross(&planes[1].normal());
        let sine = direction.norm();
        let value = direction.try_normalize(0.0)? * (ends[1] - ends[0]).dot(&direction).signum();
        let ends = ends.map(|end| on_both(planes, &end));
        let middle = nalgebra::center(&ends[0], &ends[1]);
        // two planes that may be shifted by s and t displace their line of intersection by √(s² +
        // t²) / sin of the angle between them
        let std = std_at(0, &middle)
            .zip(std_at(1, &middle))
            .map(|(s, t)| s.hypot(t) / sine);
        let axis = MeasuredValue::new(value, None, touches.clone());
        let edge = Self {
            length: Some(MeasuredValue::new(
                (ends[1] - ends[0]).norm(),
                None,
                Vec::new(),
            )),
            points: ends.to_vec(),
            is_convex: Some(is_convex),
            ..Self::touched(FeatureKind::Edge, middle, std, touches)
        };
        Some((axis, sine, edge))
    }

    /// A plane, centred at its point nearest to `middle`.
    pub fn plane(plane: &Fit<Plane>, middle: &Point3<f64>, touches: Touches) -> Self {
        let normal = plane.surface.normal();
        let centre = met(&plane.surface, middle, &normal);
        Self {
            axis: Some(axis_of(plane, &normal, &touches)),
            ..Self::touched(FeatureKind::Plane, centre, plane.std_at(&centre), touches)
        }
    }

    fn touched(kind: FeatureKind, centre: Point3<f64>, std: Option<f64>, touches: Touches) -> Self {
        Self::new(
            kind,
            MeasuredValue::new(centre, std, touches),
            1.0,
            FittedTo::Touches,
        )
    }
}

/// Intersection of a line with a plane, m in O.
fn met(plane: &Plane, from: &Point3<f64>, direction: &Vector3<f64>) -> Point3<f64> {
    let normal = plane.normal();
    from + direction * ((plane.point() - from).dot(&normal) / direction.dot(&normal))
}

/// Direction of a fit, with the sign of `out`.
pub(super) fn axis_of<S: SurfaceModel>(
    fit: &Fit<S>,
    out: &Vector3<f64>,
    touches: &Touches,
) -> MeasuredValue<Vector3<f64>> {
    MeasuredValue::new(
        fit.surface.axis_towards(out),
        fit.axis_std(),
        touches.clone(),
    )
}

/// A number with its uncertainty, from its derivatives by the freedoms.
pub(super) fn number<S: SurfaceModel>(
    fit: &Fit<S>,
    value: f64,
    by: &[(Freedom, f64)],
    touches: &Touches,
) -> MeasuredValue<f64> {
    MeasuredValue::new(value, fit.std_by(by), touches.clone())
}

/// Distance of an end from a plane, m.
fn apart(plane: &Fit<Plane>, end: &End, touches: &Touches) -> MeasuredValue<f64> {
    let value = (end.point - plane.surface.point())
        .dot(&plane.surface.normal())
        .abs();
    let std = plane.std_at(&end.point).map(|std| std.hypot(end.sigma));
    MeasuredValue::new(value, std, touches.clone())
}
