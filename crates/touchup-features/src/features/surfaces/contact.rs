//! A contact: touches of one cell, the element of touched surfaces.

use nalgebra::{Point3, Vector3};

use crate::features::segmentation::primitive::Primitive;
use crate::features::segmentation::segment::FeltPlace;
use touchup_method::stylus::ProbedPoint;

/// Minimum weight of a touch.
pub(super) const LEAST_WEIGHT: f64 = 0.01;
/// Heights of a ball that rolls over an edge above the land beside it, in its radii: leans of 30° to
/// 85°, of which the lesser ones hardly show the place of the edge.
const OVER_EDGE: std::ops::Range<f64> = 0.09..0.87;
/// Minimum component of a normal along a land for a direction.
const LEAST_LEAN: f64 = 0.05;

/// Touches of one cell with like normals.
pub(super) struct ContactCell {
    /// numbers of the touches
    pub touches: Vec<u32>,
    /// number of the first one's stroke
    pub stroke: u32,
    /// mean centre of the ball, m; of an edge its place
    pub centre: Point3<f64>,
    /// mean point of the surface, m
    pub point: Point3<f64>,
    /// mean outward unit normal
    pub normal: Vector3<f64>,
    /// distance of the centre from the surface, m: radius of the ball, 0 at an edge
    pub radius: f64,
    /// its standard deviation, in those of contacts with a face
    pub slack: f64,
    /// the surface whose edge it shows; `None`: a contact with a face
    pub land: Option<LandSurface>,
}

/// The surface beside an edge.
#[derive(Clone, Copy)]
pub(super) struct LandSurface {
    pub surface: Primitive,
    /// outward unit normal at the edge
    pub normal: Vector3<f64>,
}

impl ContactCell {
    /// Its touches as places of a surface.
    pub(super) fn places(&self, touches: &[ProbedPoint]) -> Vec<FeltPlace> {
        let place = |&number: &u32| {
            let touch = &touches[number as usize];
            let Some(land) = &self.land else {
                return Some(FeltPlace {
                    touch: number,
                    place: touch.point,
                    at_edge: None,
                });
            };
            let edge = EdgePlace::of(touch, &land.surface)?;
            Some(FeltPlace {
                touch: number,
                place: edge.place,
                at_edge: Some(edge.slack),
            })
        };
        self.touches.iter().filter_map(place).collect()
    }
}

/// The edge of a surface under a ball that rolls over it.
struct EdgePlace {
    /// m
    place: Point3<f64>,
    /// unit vector along the surface, away from its material
    outward: Vector3<f64>,
    /// normal of the surface
    up: Vector3<f64>,
    /// standard deviation of the place, in those of the ball's centre
    slack: f64,
}

impl EdgePlace {
    fn of(touch: &ProbedPoint, land: &Primitive) -> Option<Self> {
        let (height, up) = land.distance_and_normal(&touch.centre);
        let cosine = height / touch.radius;
        if !OVER_EDGE.contains(&cosine) {
            return None;
        }
        let lean = touch.normal - up * touch.normal.dot(&up);
        let outward = lean.try_normalize(LEAST_LEAN)?;
        let sine = (1.0 - cosine * cosine).sqrt();
        Some(Self {
            place: touch.centre - up * height - outward * (sine * touch.radius),
            outward,
            up,
            slack: f64::hypot(1.0, cosine / sine),
        })
    }
}

/// The edge of a surface that a contact shows, as one more contact.
pub(super) fn edge_of(
    leaning: &ContactCell,
    touches: &[ProbedPoint],
    surface: &Primitive,
) -> Option<ContactCell> {
    let (mut weight, mut slack) = (0.0, 0.0);
    let [mut place, mut outward, mut up] = [Vector3::zeros(); 3];
    for &number in &leaning.touches {
        let touch = &touches[number as usize];
        let Some(edge) = EdgePlace::of(touch, surface) else {
            continue;
        };
        let own = touch.weight.max(LEAST_WEIGHT) / edge.slack.powi(2);
        weight += own;
        place += edge.place.coords * own;
        outward += edge.outward * own;
        slack += edge.slack * own;
        up += edge.up;
    }
    let place = Point3::from(place / weight);
    Some(ContactCell {
        touches: leaning.touches.clone(),
        stroke: leaning.stroke,
        centre: place,
        point: place,
        normal: outward.try_normalize(0.0)?,
        radius: 0.0,
        slack: slack / weight,
        land: Some(LandSurface {
            surface: *surface,
            normal: up.try_normalize(0.0)?,
        }),
    })
}
