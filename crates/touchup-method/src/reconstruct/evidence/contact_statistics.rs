//! Contact statistics: sums over the contacts of one place, its independent passes, and the
//! innovation of a further contact.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_uncertainty::ContactSigma;
use crate::reconstruct::evidence::touches::SurfaceContact;
use touchup_geometry::numeric::direction;

/// One pass over a place, or several merged ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::reconstruct) struct Pass {
    /// start of the last merged pass, ns
    pub began_ns: i64,
    /// sum of the weights of the contacts
    pub weight: f64,
    /// number of merged passes
    pub count: u32,
}

/// Number of separate passes in memory; further passes merge into them.
const REMEMBERED: usize = 4;

/// The passes over one place: samples in one smoothing window share their noise. A pass lasts one
/// window: later contacts are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::reconstruct) struct IndependentPasses {
    slots: [Pass; REMEMBERED],
    /// number of passes
    pub count: u32,
}

impl IndependentPasses {
    /// Counts a contact of this weight; returns whether it is independent of earlier ones.
    pub(crate) fn note(&mut self, stamp_ns: i64, weight: f64, window_ns: i64) -> bool {
        let newest = self.slots[(self.count.wrapping_sub(1)) as usize % REMEMBERED];
        let is_new = self.count == 0 || stamp_ns.saturating_sub(newest.began_ns) > window_ns;
        if is_new {
            self.count = self.count.saturating_add(1);
        }
        let slot = &mut self.slots[(self.count - 1) as usize % REMEMBERED];
        slot.weight += weight;
        if is_new {
            (slot.began_ns, slot.count) = (stamp_ns, slot.count.saturating_add(1));
        }
        is_new
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Pass> + '_ {
        self.slots.iter().take(self.count as usize)
    }
}

/// Minimum standard deviation of a normal, rad: 1°.
const LEAST_TILT: f64 = 0.017;

/// Sums over contacts.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::reconstruct) struct ContactStatistics {
    pub point: Vector3<f64>,
    pub normal: Vector3<f64>,
    pub weight: f64,
    /// Σ w σ² of noise and reach, m², and of the normal, rad²
    noise: f64,
    reach: f64,
    tilt: f64,
    /// Σ w σ of the calibration and of the place, m
    calibration: f64,
    place: f64,
    pub passes: IndependentPasses,
}

impl ContactStatistics {
    pub(crate) fn add(&mut self, contact: &SurfaceContact) {
        let SurfaceContact {
            point,
            normal,
            weight,
            sigma,
            ..
        } = contact;
        self.point += point.coords * *weight;
        self.normal += normal * *weight;
        self.weight += weight;
        self.noise += weight * sigma.noise * sigma.noise;
        self.reach += weight * sigma.reach * sigma.reach;
        self.tilt += weight * sigma.normal * sigma.normal;
        self.calibration += weight * sigma.calibration;
        self.place += weight * sigma.place;
    }

    pub(crate) fn point(&self) -> Point3<f64> {
        Point3::from(self.point / self.weight)
    }

    /// Uncertainty of the place from one pass.
    pub(crate) fn sigma(&self) -> ContactSigma {
        let [noise, reach, tilt] =
            [self.noise, self.reach, self.tilt].map(|sum| (sum / self.weight).sqrt());
        let [calibration, place] = [self.calibration, self.place].map(|sum| sum / self.weight);
        ContactSigma {
            noise,
            reach,
            calibration,
            place,
            normal: tilt,
        }
    }

    /// Distance of a contact from the chord to the mean, m, and the same in standard deviations.
    /// The chord is at right angles to the mean of both normals, unless one is known much better.
    /// Both share the calibration error, which cancels.
    ///
    /// - `roughness`: distance of the surface itself from a chord, m.
    pub(crate) fn innovation(&self, contact: &SurfaceContact, roughness: f64) -> (f64, f64) {
        let normal = direction(&self.normal).unwrap_or(contact.normal);
        let arm = contact.point - self.point();
        let own = self.sigma();
        let [tilt, of_contact] =
            [own.normal, contact.sigma.normal].map(|tilt| tilt * tilt + LEAST_TILT * LEAST_TILT);
        let share = of_contact / (tilt + of_contact);
        let off = (normal * share + contact.normal * (1.0 - share)).dot(&arm);
        let across = (arm.norm_squared() - off * off).max(0.0);
        let [of_mean, of_one] =
            [own, contact.sigma].map(|sigma| sigma.noise.powi(2) + sigma.reach.powi(2));
        let variance = of_one
            + of_mean / f64::from(self.passes.count.max(1))
            + across * tilt * of_contact / (tilt + of_contact)
            + roughness * roughness;
        (off, off.abs() / variance.sqrt().max(f64::MIN_POSITIVE))
    }
}
