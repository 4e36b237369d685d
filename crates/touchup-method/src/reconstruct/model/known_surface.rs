//! A surface that a fit knows, and the contacts that it explains.

use nalgebra::{Point3, Vector3};

use super::extent::SurfaceExtent;
use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};

/// A surface of the part known by a fit to touches.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownSurface {
    /// the fit, in O; the outward side of a plane is out of the material
    pub surface: AnalyticSurface,
    /// whether the material is outside of a surface about an axis, as of a hole
    pub is_concave: bool,
    /// standard deviation along the normal, at most, between contacts and ends, m
    pub sigma: f64,
    /// the contacts on it: places of the part, m, in O; it is known as long as all of them are
    /// among the touches
    pub contacts: Vec<Point3<f64>>,
    /// further contacts of its fit, on other surfaces; as necessary as those on it
    pub others: Vec<Point3<f64>>,
    /// untouched places of the surface, m, in O, up to which it is known to go on: of its edges
    pub ends: Vec<Point3<f64>>,
}

/// Most contacts of a surface, and most further places: those of an arm are some tens.
const MOST_PLACES: usize = 10_000;
/// Largest coordinate and size, m: beyond it differences of a micrometre are lost.
const FARTHEST: f64 = 1e6;

/// Reason against a known surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnownSurfaceError {
    /// Axis or size out of range.
    #[error(
        "its axis is no unit vector, or a number of it is not finite, or not positive as a size"
    )]
    Unsound,
    /// Bad uncertainty.
    #[error("its uncertainty is {sigma_mm} mm, and not 0 or more")]
    Sigma {
        /// mm
        sigma_mm: f64,
    },
    /// Number of contacts or ends.
    #[error(
        "it has {contacts} contacts and {further} further places; 1 to {MOST_PLACES} contacts, and at most as many further places, are possible"
    )]
    Places {
        /// number of contacts on it
        contacts: usize,
        /// number of other contacts and ends
        further: usize,
    },
    /// A place elsewhere.
    #[error("a contact or end at ({:.3}, {:.3}, {:.3}) mm is {off_mm:.3} mm off it; {most_mm:.3} mm is the most", at_mm[0], at_mm[1], at_mm[2])]
    Off {
        /// the place, mm in O
        at_mm: [f64; 3],
        /// mm
        off_mm: f64,
        /// mm
        most_mm: f64,
    },
    /// Too large for its contacts.
    #[error("it covers more than {most} cells as wide as the tip; that is the most")]
    Wide {
        /// number of cells
        most: f64,
    },
}

impl KnownSurface {
    /// Signed distance, m, positive outside the part, and its unit gradient.
    pub(super) fn value(&self, x: &Point3<f64>) -> (f64, Vector3<f64>) {
        let side = if self.is_concave { -1.0 } else { 1.0 };
        (
            side * self.surface.signed_distance(x),
            self.surface.normal(x) * side,
        )
    }

    /// # Errors
    /// [`KnownSurfaceError`]
    ///
    /// - `most_off`: largest distance of a contact or an end from the surface, m.
    pub(super) fn check(&self, most_off: f64) -> Result<(), KnownSurfaceError> {
        let far = |p: &Point3<f64>| !p.iter().all(|x| x.abs() <= FARTHEST);
        let is_small = match self.surface.shape {
            SurfaceShape::Plane => !self.is_concave,
            SurfaceShape::Cylinder { radius }
            | SurfaceShape::Cone { radius, .. }
            | SurfaceShape::Sphere { radius } => radius <= FARTHEST,
        };
        if !self.surface.is_sound() || !is_small || far(&self.surface.placement.origin) {
            return Err(KnownSurfaceError::Unsound);
        }
        if !(0.0..=FARTHEST).contains(&self.sigma) {
            let sigma_mm = self.sigma * 1e3;
            return Err(KnownSurfaceError::Sigma { sigma_mm });
        }
        let (contacts, further) = (self.contacts.len(), self.others.len() + self.ends.len());
        if !(1..=MOST_PLACES).contains(&contacts) || further > MOST_PLACES {
            return Err(KnownSurfaceError::Places { contacts, further });
        }
        for place in self.contacts.iter().chain(&self.ends) {
            let off = self.value(place).0.abs();
            // a place that is no number is off as well
            if far(place) || off.is_nan() || off > most_off {
                return Err(KnownSurfaceError::Off {
                    at_mm: (place * 1e3).coords.into(),
                    off_mm: off * 1e3,
                    most_mm: most_off * 1e3,
                });
            }
        }
        Ok(())
    }

    /// The part of the surface between its contacts and ends.
    pub(super) fn extent(&self) -> SurfaceExtent {
        let on_surface = |place: &Point3<f64>| {
            let (off, normal) = self.value(place);
            place - normal * off
        };
        let places: Vec<_> = self
            .contacts
            .iter()
            .chain(&self.ends)
            .map(on_surface)
            .collect();
        SurfaceExtent::of(&self.surface, &places)
    }
}
