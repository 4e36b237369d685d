//! Contact statistics: sums over the contacts of one place, and the innovation of another one.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_uncertainty::ContactSigma;
use crate::reconstruct::evidence::passes::IndependentPasses;
use crate::reconstruct::evidence::touches::SurfaceContact;

/// No normal is known better than this, rad: 1°.
const LEAST_TILT: f64 = 0.017;

/// Contacts added up.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct ContactStatistics {
    pub point: Vector3<f64>,
    pub normal: Vector3<f64>,
    pub weight: f64,
    /// Σ w σ² of noise and reach, m², and of the normal, rad²
    noise: f64,
    reach: f64,
    tilt: f64,
    /// Σ w σ of the calibration, m
    calibration: f64,
}

impl ContactStatistics {
    pub const ZERO: Self = Self {
        point: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 0.0),
        weight: 0.0,
        noise: 0.0,
        reach: 0.0,
        tilt: 0.0,
        calibration: 0.0,
    };

    pub fn add(&mut self, contact: &SurfaceContact) {
        let SurfaceContact { point, normal, weight, sigma, .. } = contact;
        self.point += point.coords * *weight;
        self.normal += normal * *weight;
        self.weight += weight;
        self.noise += weight * sigma.noise * sigma.noise;
        self.reach += weight * sigma.reach * sigma.reach;
        self.tilt += weight * sigma.normal * sigma.normal;
        self.calibration += weight * sigma.calibration;
    }

    pub fn point(&self) -> Point3<f64> {
        Point3::from(self.point / self.weight)
    }

    /// Uncertainty of the place by one of the passes that were added.
    pub fn sigma(&self) -> ContactSigma {
        let [noise, reach, tilt] = [self.noise, self.reach, self.tilt].map(|sum| (sum / self.weight).sqrt());
        ContactSigma { noise, reach, calibration: self.calibration / self.weight, normal: tilt }
    }

    /// How far a contact is off the chord to the mean, m, and how many standard deviations that is. The chord is at right
    /// angles to the mean of both normals, unless one is known much better. What calibration leaves is the same in both.
    ///
    /// - `roughness`: by which the surface itself may be off a chord, m.
    pub fn innovation(&self, passes: &IndependentPasses, contact: &SurfaceContact, roughness: f64) -> (f64, f64) {
        let normal = self.normal.try_normalize(0.0).unwrap_or(contact.normal);
        let arm = contact.point - self.point();
        let own = self.sigma();
        let [tilt, of_contact] = [own.normal, contact.sigma.normal].map(|tilt| tilt * tilt + LEAST_TILT * LEAST_TILT);
        let share = of_contact / (tilt + of_contact);
        let off = (normal * share + contact.normal * (1.0 - share)).dot(&arm);
        let across = (arm.norm_squared() - off * off).max(0.0);
        let [of_mean, of_one] = [own, contact.sigma].map(|sigma| sigma.noise.powi(2) + sigma.reach.powi(2));
        let variance = of_one
            + of_mean / f64::from(passes.count().max(1))
            + across * tilt * of_contact / (tilt + of_contact)
            + roughness * roughness;
        (off, off.abs() / variance.sqrt().max(f64::MIN_POSITIVE))
    }
}
