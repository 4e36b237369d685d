//! Shapes of touched surfaces, free or held to a known axis, and their fits to contacts.

use nalgebra::{SVector, Vector3};

use super::contact::ContactCell;
use crate::features::fit::{Cone, Cylinder, Plane, Steps, SurfaceModel};
use crate::features::segmentation::primitive::{Primitive, numbers_of_free};
use touchup_geometry::numeric::{NormalEquations, biweight};

/// Widths of the weights of a fit from a rough guess, and from a near one, in the maximum distance of
/// a contact from its surface.
const FROM_FAR: [f64; 6] = [16.0, 8.0, 4.0, 2.0, 1.0, 1.0];
const FROM_NEAR: [f64; 3] = [2.0, 1.0, 1.0];
/// Maximum radius of a cylinder, m: flatter is a plane.
const LARGEST: f64 = 0.5;
/// Half angles of a cone, rad: 6° to 83°.
const HALF_ANGLES: std::ops::Range<f64> = 0.1..1.45;

/// A plane, cylinder or cone, and whether its axis or normal is that of another one. A sphere through
/// touches would take those of short cones: touched spheres are measured where the mesh shows them.
#[derive(Clone, Copy, Debug)]
pub(super) struct TouchedShape {
    pub primitive: Primitive,
    pub is_held: bool,
}

/// Number of kinds of shapes.
pub(super) const KINDS: usize = 6;

impl TouchedShape {
    pub(super) fn free(primitive: Primitive) -> Self {
        Self {
            primitive,
            is_held: false,
        }
    }

    /// Number of its kind, held or free.
    pub(super) fn kind(&self) -> usize {
        let kind = match self.primitive {
            Primitive::Plane(_) => 0,
            Primitive::Cylinder(_) => 1,
            Primitive::Cone(_) | Primitive::Sphere(_) => 2,
        };
        kind + if self.is_held { KINDS / 2 } else { 0 }
    }

    /// Number of its parameters.
    pub(super) fn freedoms(&self) -> f64 {
        [3.0, 5.0, 6.0, 1.0, 3.0, 4.0][self.kind()]
    }

    /// The same surface along known axes, and a plane square to them.
    ///
    /// - `least`: cosine of the maximum turn.
    pub(super) fn held(primitive: &Primitive, axes: &[Vector3<f64>], least: f64) -> Vec<Self> {
        let own = match primitive {
            Primitive::Plane(plane) => plane.normal(),
            Primitive::Cylinder(cylinder) => cylinder.axis(),
            Primitive::Cone(cone) => cone.axis(),
            Primitive::Sphere(_) => return Vec::new(),
        };
        let held_to = |axis: &Vector3<f64>| {
            let lean = axis.dot(&own);
            let is_square = primitive.plane().is_some() && lean * lean < 1.0 - least * least;
            let axis = if lean.abs() > least {
                axis * lean.signum()
            } else if is_square {
                (own - axis * lean).normalize()
            } else {
                return None;
            };
            let primitive = match primitive {
                Primitive::Plane(plane) => Primitive::Plane(Plane::new(plane.point(), &axis)),
                Primitive::Cylinder(c) => {
                    Primitive::Cylinder(Cylinder::new(c.center(), &axis, c.radius, c.concave))
                }
                Primitive::Cone(c) => {
                    let (radius, half_angle) = (c.radius, c.half_angle);
                    Primitive::Cone(Cone::new(c.center(), &axis, radius, half_angle, c.concave))
                }
                Primitive::Sphere(_) => *primitive,
            };
            Some(Self {
                primitive,
                is_held: true,
            })
        };
        axes.iter().filter_map(held_to).collect()
    }

    /// The shape fitted to contacts from a near one.
    ///
    /// - `near`: maximum distance of a contact from its surface, m.
    pub(super) fn refitted(&self, contacts: &[&ContactCell], near: f64) -> Option<Self> {
        self.moved_to(contacts, near, &FROM_NEAR)
    }

    /// As [`Self::refitted`], from a rough guess.
    pub(super) fn fitted(&self, contacts: &[&ContactCell], near: f64) -> Option<Self> {
        self.moved_to(contacts, near, &FROM_FAR)
    }

    fn moved_to(&self, contacts: &[&ContactCell], near: f64, widths: &[f64]) -> Option<Self> {
        let by = Weights { near, widths };
        let primitive = match (&self.primitive, self.is_held) {
            (Primitive::Plane(plane), true) => {
                Primitive::Plane(by.moved::<_, 1>(plane, contacts, true)?)
            }
            (Primitive::Plane(plane), false) => {
                Primitive::Plane(by.moved::<_, 3>(plane, contacts, false)?)
            }
            (Primitive::Cylinder(cylinder), true) => {
                Primitive::Cylinder(by.moved::<_, 3>(cylinder, contacts, true)?)
            }
            (Primitive::Cylinder(cylinder), false) => {
                Primitive::Cylinder(by.moved::<_, 5>(cylinder, contacts, false)?)
            }
            (Primitive::Cone(cone), true) => {
                Primitive::Cone(by.moved::<_, 4>(cone, contacts, true)?)
            }
            (Primitive::Cone(cone), false) => {
                Primitive::Cone(by.moved::<_, 6>(cone, contacts, false)?)
            }
            (Primitive::Sphere(_), _) => return None,
        };
        let is_sound = match &primitive {
            Primitive::Plane(_) | Primitive::Sphere(_) => true,
            Primitive::Cylinder(c) => c.radius > 0.0 && c.radius < LARGEST,
            Primitive::Cone(c) => HALF_ANGLES.contains(&c.half_angle.abs()),
        };
        is_sound.then_some(Self {
            primitive,
            is_held: self.is_held,
        })
    }
}

/// Weights of contacts in a fit.
struct Weights<'a> {
    /// m
    near: f64,
    widths: &'a [f64],
}

impl Weights<'_> {
    /// Least squares over the N freedoms of a surface, far contacts less and less.
    fn moved<S: SurfaceModel, const N: usize>(
        &self,
        start: &S,
        contacts: &[&ContactCell],
        is_held: bool,
    ) -> Option<S> {
        let mut has = S::FREE;
        if is_held {
            (has[3], has[4]) = (false, false);
        }
        let free = numbers_of_free::<N>(has);
        let own = start.to_own();
        let places: Vec<_> = contacts.iter().map(|one| own(&one.centre)).collect();
        let mut surface = start.described_from(&places);
        for width in self.widths {
            let own = surface.to_own();
            let mut equations = NormalEquations::<N>::default();
            for one in contacts {
                let (distance, by) = surface.derivatives_at(&own(&one.centre));
                let off = distance - one.radius;
                let weight = biweight((off / (one.slack * self.near * width)).powi(2));
                let row = SVector::from_fn(|i, _| by[free[i]]);
                equations.add(&row, -off, weight / (one.slack * one.slack));
            }
            let solution = equations.solution()?;
            let mut step = Steps::zeros();
            (0..N).for_each(|i| step[free[i]] = solution[i]);
            surface = surface.moved(&step);
            surface.check().ok()?;
        }
        Some(surface)
    }
}
