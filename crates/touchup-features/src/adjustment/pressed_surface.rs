//! Surfaces in the presses of a session.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};

use super::numbers::SessionNumbers;
use super::recorded_press::RecordedPress;
use super::session_change::SessionChange;
use crate::features::fit::{Steps, SurfaceModel};
use crate::features::{Primitive, touched_surfaces};
use touchup_method::stylus::ProbedPoint;

/// A surface, and the numbers of the presses on it.
#[derive(Clone)]
pub(super) struct PressedSurface {
    pub primitive: Primitive,
    pub presses: Vec<u32>,
}

/// The surfaces that presses show with these numbers of the session, and the presses that are on none
/// and at no edge.
///
/// - `radius`: of the ball, m.
pub(super) fn pressed_surfaces(
    presses: &[RecordedPress],
    radius: f64,
    session: &SessionNumbers,
    change: Option<&SessionChange>,
) -> (Vec<PressedSurface>, Vec<u32>) {
    let touch = |(number, press): (usize, &RecordedPress)| {
        let placed = press.placed(session, change);
        let (centre, normal) = (placed.centre, placed.force);
        ProbedPoint {
            stamp_ns: number as i64,
            stroke: press.stroke,
            centre,
            radius,
            point: centre - normal * radius,
            normal,
            sigma: 0.0,
            calibration: 0.0,
            place: 0.0,
            weight: 1.0,
            is_rejected: false,
        }
    };
    let touches: Vec<ProbedPoint> = presses.iter().enumerate().map(touch).collect();
    let surfaces = touched_surfaces(&touches);
    let felt = surfaces.iter().flat_map(|surface| &surface.felt);
    let felt: BTreeSet<u32> = felt.map(|felt| felt.touch).collect();
    let lost = (0..presses.len() as u32).filter(|touch| !felt.contains(touch));
    let pressed = surfaces.iter().map(|surface| {
        let on_face = surface.felt.iter().filter(|felt| felt.at_edge.is_none());
        PressedSurface {
            primitive: surface.primitive,
            presses: on_face.map(|felt| felt.touch).collect(),
        }
    });
    let pressed = pressed.filter(|surface| !surface.presses.is_empty());
    (pressed.collect(), lost.collect())
}

impl PressedSurface {
    /// Signed distance of a point from it, m, its outward unit normal there, and the derivatives of
    /// the distance by the freedoms of the surface.
    pub(super) fn at(&self, centre: &Point3<f64>) -> (f64, Vector3<f64>, Steps) {
        fn of<S: SurfaceModel>(surface: &S, centre: &Point3<f64>) -> (f64, Vector3<f64>, Steps) {
            let (distance, steps) = surface.derivatives(centre);
            (distance, surface.distance_and_normal(centre).1, steps)
        }
        match &self.primitive {
            Primitive::Plane(plane) => of(plane, centre),
            Primitive::Cylinder(cylinder) => of(cylinder, centre),
            Primitive::Cone(cone) => of(cone, centre),
            Primitive::Sphere(sphere) => of(sphere, centre),
        }
    }

    /// The surface after small steps; as it is if they leave the range of its sizes.
    pub(super) fn move_by(&mut self, steps: &Steps) {
        fn moved<S: SurfaceModel>(surface: &S, steps: &Steps) -> Option<S> {
            let moved = surface.moved(steps);
            moved.check().is_ok().then_some(moved)
        }
        let moved = match &self.primitive {
            Primitive::Plane(plane) => moved(plane, steps).map(Primitive::Plane),
            Primitive::Cylinder(cylinder) => moved(cylinder, steps).map(Primitive::Cylinder),
            Primitive::Cone(cone) => moved(cone, steps).map(Primitive::Cone),
            Primitive::Sphere(sphere) => moved(sphere, steps).map(Primitive::Sphere),
        };
        self.primitive = moved.unwrap_or(self.primitive);
    }
}
