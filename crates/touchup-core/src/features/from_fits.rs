//! Features whose surfaces were fitted to single touches, before any mesh shows them.

use nalgebra::{Point3, Vector3};

use super::borders::on_both;
use super::detect::{lateral_std, middle_std};
use super::feature::{Feature, FittedTo, Kind, Measured, SizedSurface};
use super::fit::{Cylinder, Fit, Freedom, Plane, Stadium, Surface as Fitted};

/// Numbers of touches, in ascending order.
type Touches = Vec<u32>;

/// A place where a hole or slot ends, or the top of a boss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// on the surface, m in O
    pub point: Point3<f64>,
    /// standard deviation along the axis, m
    pub sigma: f64,
}

impl Feature {
    /// A hole, or a boss when the wall is convex.
    ///
    /// - `top`: around the opening, or the foot of the boss; `end`: of the floor, or the boss' top, where it was touched.
    /// - `touches`: those used.
    pub fn round(wall: &Fit<Cylinder>, top: &Fit<Plane>, end: Option<&End>, touches: Touches) -> Self {
        let out = top.surface.normal();
        let centre = met(&top.surface, &wall.surface.center(), &wall.surface.axis());
        let kind = if wall.surface.concave { Kind::Hole } else { Kind::Boss };
        Self {
            axis: Some(axis_of(wall, &out, &touches)),
            diameter: Some(number(wall, 2.0 * wall.surface.radius, &[(Freedom::Size, 2.0)], &touches)),
            depth: end.map(|end| apart(top, end, &touches)),
            through: end.filter(|_| kind == Kind::Hole).map(|_| false),
            surface: SizedSurface::Round(wall.surface.clone()),
            ..Self::touched(kind, centre, lateral_std(wall, &centre), touches)
        }
    }

    /// A slot: its walls, the surface around its opening, and its floor where it was touched.
    pub fn slot(wall: &Fit<Stadium>, top: &Fit<Plane>, floor: Option<&End>, touches: Touches) -> Self {
        let centre = met(&top.surface, &wall.surface.center(), &wall.surface.axis());
        let direction = wall.surface.direction();
        let half = direction * (wall.surface.length / 2.0);
        Self {
            axis: Some(axis_of(wall, &top.surface.normal(), &touches)),
            direction: Some(direction),
            width: Some(number(wall, wall.surface.width, &[(Freedom::Size, 1.0)], &touches)),
            length: Some(number(wall, wall.surface.length, &[(Freedom::Second, 1.0)], &touches)),
            depth: floor.map(|floor| apart(top, floor, &touches)),
            through: floor.map(|_| false),
            points: vec![centre - half, centre + half],
            surface: SizedSurface::Slot(wall.surface.clone()),
            ..Self::touched(Kind::Slot, centre, middle_std(wall), touches)
        }
    }

    /// The edge between two planes, as far as from one place on it to another; `None` when they are parallel.
    ///
    /// - `ends`: near the edge, m in O.
    pub fn edge(sides: [&Fit<Plane>; 2], ends: &[Point3<f64>; 2], is_convex: bool, touches: Touches) -> Option<Self> {
        let normals = sides.map(|side| side.surface.normal());
        let direction = normals[0].cross(&normals[1]);
        let sine = direction.norm();
        let direction = direction.try_normalize(0.0)? * (ends[1] - ends[0]).dot(&direction).signum();
        let ends = ends.map(|end| on_both(sides.map(|side| side.surface.point()), normals, &end));
        let middle = nalgebra::center(&ends[0], &ends[1]);
        let [s, t] = sides.map(|side| side.std_at(&middle));
        // two planes that may be shifted by s and t displace their line of intersection by √(s² + t²) / sin of the angle between them
        let std = s.zip(t).map(|(s, t)| s.hypot(t) / sine);
        // a plane that leans along the edge takes the edge with it
        let leans = [0, 1].map(|at| {
            let along = sides[at].surface.pose_of.inverse_transform_vector(&direction);
            sides[at].estimate(0.0, &[(Freedom::TiltX, along.x), (Freedom::TiltY, along.y)])
        });
        let axis_std = leans[0].zip(leans[1]).map(|(a, b)| a.std.hypot(b.std) / sine);
        Some(Self {
            axis: Some(Measured { value: direction, std: axis_std, touches: touches.clone() }),
            length: Some(Measured { value: (ends[1] - ends[0]).norm(), ..Measured::default() }),
            points: ends.to_vec(),
            is_convex: Some(is_convex),
            ..Self::touched(Kind::Edge, middle, std, touches)
        })
    }

    /// A plane, at the place of it that is nearest to `middle`.
    pub fn plane(plane: &Fit<Plane>, middle: &Point3<f64>, touches: Touches) -> Self {
        let normal = plane.surface.normal();
        let centre = met(&plane.surface, middle, &normal);
        Self {
            axis: Some(axis_of(plane, &normal, &touches)),
            ..Self::touched(Kind::Plane, centre, plane.std_at(&centre), touches)
        }
    }

    fn touched(kind: Kind, centre: Point3<f64>, std: Option<f64>, touches: Touches) -> Self {
        Self::new(kind, Measured { value: centre, std, touches }, 1.0, FittedTo::Touches)
    }
}

/// Where a line meets a plane, m in O.
fn met(plane: &Plane, from: &Point3<f64>, direction: &Vector3<f64>) -> Point3<f64> {
    let normal = plane.normal();
    from + direction * ((plane.point() - from).dot(&normal) / direction.dot(&normal))
}

fn axis_of<S: Fitted>(fit: &Fit<S>, out: &Vector3<f64>, touches: &Touches) -> Measured<Vector3<f64>> {
    let axis = fit.surface.axis();
    let value = if axis.dot(out) < 0.0 { -axis } else { axis };
    Measured { value, std: fit.axis_std(), touches: touches.clone() }
}

fn number<S: Fitted>(fit: &Fit<S>, value: f64, by: &[(Freedom, f64)], touches: &Touches) -> Measured<f64> {
    Measured { value, std: fit.estimate(value, by).map(|estimate| estimate.std), touches: touches.clone() }
}

/// Distance of a place from a plane, m.
fn apart(plane: &Fit<Plane>, end: &End, touches: &Touches) -> Measured<f64> {
    let value = (end.point - plane.surface.point()).dot(&plane.surface.normal()).abs();
    let std = plane.std_at(&end.point).map(|std| std.hypot(end.sigma));
    Measured { value, std, touches: touches.clone() }
}
