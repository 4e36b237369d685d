//! The straight lines of a cylinder against a cylinder, a cone or a sphere: along each, the other
//! surface is the root of a quadratic, and the roots over the turn are the common curves.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::curve::SpaceCurve;
use super::placement::COINCIDENT;
use super::spline::{CurveNode, evaluate};
use super::surface::{AnalyticSurface, SurfaceShape};
use crate::numeric::direction;

/// Steps of the turn in which the lines that meet the other surface are sought: a curve over less
/// than one of them is not found.
const STEPS: usize = 720;
/// Nodes of a curve, at first.
const FEWEST_NODES: usize = 64;
/// Nodes of a curve, at most: one that needs more has a corner.
const MOST_NODES: usize = 4096;
/// Largest distance of a curve from its surfaces, relative to the radius of the cylinder: 10 nm at
/// 10 mm.
const FIT: f64 = 1e-6;

/// A t² + 2 B t + C, negative inside the other surface, at the length t along one line.
struct Quadratic {
    a: f64,
    b: f64,
    c: f64,
}

impl Quadratic {
    fn discriminant(&self) -> f64 {
        self.b * self.b - self.a * self.c
    }

    /// - `side`: sign of the root.
    fn root(&self, side: f64) -> f64 {
        (-self.b + side * self.discriminant().max(0.0).sqrt()) / self.a
    }
}

/// A cylinder by its lines, and the other surface.
struct Ruling<'a> {
    cylinder: &'a AnalyticSurface,
    radius: f64,
    other: &'a AnalyticSurface,
    /// of the other surface: radius at its origin, and its growth along the axis
    other_radius: f64,
    growth: f64,
}

/// Closed curves of a cylinder and a cylinder, cone or sphere.
///
/// `None` of other surfaces, of lines that meet a cone less steeply than its wall does, and of
/// curves with a corner.
pub(super) fn ruled(a: &AnalyticSurface, b: &AnalyticSurface) -> Option<Vec<SpaceCurve>> {
    let SurfaceShape::Cylinder { radius } = a.shape else {
        return None;
    };
    let (other_radius, growth) = match b.shape {
        SurfaceShape::Cylinder { radius } => (radius, 0.0),
        SurfaceShape::Cone { radius, half_angle } => (radius, half_angle.tan()),
        SurfaceShape::Sphere { radius } => (radius, 0.0),
        SurfaceShape::Plane => return None,
    };
    let ruling = Ruling {
        cylinder: a,
        radius,
        other: b,
        other_radius,
        growth,
    };
    if ruling.quadratic(0.0).a <= COINCIDENT {
        return None;
    }
    ruling.curves()
}

impl Ruling<'_> {
    fn on_circle(&self, turn: f64) -> Point3<f64> {
        let (sin, cos) = turn.sin_cos();
        let placement = &self.cylinder.placement;
        placement.place(self.radius * cos, self.radius * sin, 0.0)
    }

    fn quadratic(&self, turn: f64) -> Quadratic {
        let line = self.cylinder.placement.axis;
        let off = self.on_circle(turn) - self.other.placement.origin;
        // a sphere has the same distance in each direction
        let along = match self.other.shape {
            SurfaceShape::Sphere { .. } => Vector3::zeros(),
            _ => self.other.placement.axis,
        };
        let (rise, height) = (line.dot(&along), off.dot(&along));
        let (across, away) = (line - along * rise, off - along * height);
        let (wider, wide) = (self.growth * rise, self.other_radius + self.growth * height);
        Quadratic {
            a: across.norm_squared() - wider * wider,
            b: across.dot(&away) - wider * wide,
            c: away.norm_squared() - wide * wide,
        }
    }

    fn point(&self, turn: f64, side: f64) -> Point3<f64> {
        let along = self.quadratic(turn).root(side);
        self.on_circle(turn) + self.cylinder.placement.axis * along
    }

    /// Whether a line at `turn` is on the nappe of a cone, not on its mirror image.
    fn is_on_nappe(&self, turn: f64) -> bool {
        let height = |side| self.other.placement.local(&self.point(turn, side)).z;
        let middle = (height(-1.0) + height(1.0)) / 2.0;
        self.other_radius + self.growth * middle > 0.0
    }

    fn curves(&self) -> Option<Vec<SpaceCurve>> {
        let angle = |step: usize| TAU * step as f64 / STEPS as f64;
        let reaches = |turn: f64| self.quadratic(turn).discriminant() > 0.0;
        let at: Vec<bool> = (0..=STEPS)
            .map(|step| reaches(angle(step % STEPS)))
            .collect();
        if at.iter().all(|reaches| *reaches) {
            if !self.is_on_nappe(0.0) {
                return Some(Vec::new());
            }
            let each = [-1.0, 1.0].map(|side| self.fitted(&|share| (TAU * share, side)));
            return each.into_iter().collect();
        }
        let changes = (0..STEPS).filter(|&step| at[step] != at[step + 1]);
        let mut ends: Vec<(f64, bool)> = changes
            .map(|step| {
                let end = bisected(angle(step), angle(step + 1), &reaches);
                (end, at[step + 1])
            })
            .collect();
        // each interval from its beginning
        if ends.first().is_some_and(|(_, begins)| !begins) {
            let (end, begins) = ends.remove(0);
            ends.push((end + TAU, begins));
        }
        let intervals = ends.chunks(2).filter_map(|pair| match pair {
            [(begin, _), (end, _)] => Some(((begin + end) / 2.0, (end - begin) / 2.0)),
            _ => None,
        });
        intervals
            .filter(|(middle, _)| self.is_on_nappe(*middle))
            .map(|(middle, half)| {
                // out along one root and back along the other, evenly at both ends
                self.fitted(&move |share| {
                    let side = if share > 0.5 { -1.0 } else { 1.0 };
                    (middle - half * (TAU * share).cos(), side)
                })
            })
            .collect()
    }

    /// A closed curve with as many nodes as it needs.
    ///
    /// - `at`: turn and side at a share of the curve.
    fn fitted(&self, at: &dyn Fn(f64) -> (f64, f64)) -> Option<SpaceCurve> {
        let mut count = FEWEST_NODES;
        while count <= MOST_NODES {
            let nodes = self.nodes(count, at)?;
            let is_off = |span: usize| {
                let (middle, _) = evaluate(&nodes, span as f64 + 0.5);
                let off = [self.cylinder, self.other].map(|s| s.signed_distance(&middle).abs());
                off[0].max(off[1]) > FIT * self.radius
            };
            if !(0..count).any(is_off) {
                return Some(SpaceCurve::Spline(nodes));
            }
            count *= 2;
        }
        None
    }

    fn nodes(&self, count: usize, at: &dyn Fn(f64) -> (f64, f64)) -> Option<Vec<CurveNode>> {
        let point = |step: usize| {
            let (turn, side) = at((step % count) as f64 / count as f64);
            self.point(turn, side)
        };
        let points: Vec<_> = (0..count).map(point).collect();
        let node = |step: usize| {
            let point = points[step % count];
            let chord = points[(step + 1) % count] - points[(step + count - 1) % count];
            let [one, other] = [self.cylinder, self.other].map(|s| s.normal(&point));
            let tangent = direction(&one.cross(&other))?;
            let tangent = tangent * tangent.dot(&chord).signum();
            Some(CurveNode { point, tangent })
        };
        (0..=count).map(node).collect()
    }
}

/// The place of the change between two arguments.
fn bisected(mut low: f64, mut high: f64, is: &dyn Fn(f64) -> bool) -> f64 {
    /// From 0.01 rad down to a rounding.
    const HALVINGS: usize = 48;
    let at_low = is(low);
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        if is(middle) == at_low {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low + high) / 2.0
}
