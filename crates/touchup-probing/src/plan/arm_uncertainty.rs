//! Uncertainty common to all touches of an arm, which no number of them averages out: it enters
//! each number by its derivatives.
//!
//! A radius off by ρ, and a part that lies off by t and is turned by ω (both in O) about the place
//! p₀ of its best registration shift a feature at p by t + ω × (p − p₀), turn its axis by ω, and
//! change a diameter or a width by 2ρ, a plane by ρ, an edge by both of its faces. With standard
//! uncertainties u_t and u_ω for each axis the shift has the covariance u_t² I + u_ω² (|l|² I − l
//! lᵀ), l = p − p₀ \[JCGM 100:2008, 5.2\].

use nalgebra::{Matrix3, Point3, Vector3};

use touchup_features::features::{Feature, FeatureKind, MeasuredValue};
use touchup_method::parameters;

parameters! {
    /// Standard uncertainties of an arm and of the place of its part.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ArmUncertainty in "robot" {
        /// Standard uncertainty of the radius of the ball: each diameter, width and length contains
        /// it twice, the place of a plane once.
        ///
        /// In m. A ruby ball is round within 0.2 µm; a gauge block or a ring says its size within 1
        /// µm.
        radius: f64 = 0.001, "radius_sigma_mm" [MM, 0, 10];
        /// Standard uncertainty of the position of the scan in the base (scan_to_space), along each
        /// axis; 0: places are relative to the scan as the scene puts it.
        ///
        /// In m. 0: a registration that nobody has compared with the part has no figure, and a
        /// made-up one would be in each result.
        place: f64 = 0.0, "place_sigma_mm" [MM, 0, 100];
        /// Standard uncertainty of the orientation of the scan in the base, about each axis; its
        /// effect grows with the distance from registered_at_mm.
        ///
        /// In rad. As for the place.
        turn: f64 = 0.0, "turn_sigma_deg" [DEG, 0, 20];
        /// Growth of the uncertainty of places with each metre from registered_at_mm, due to the
        /// kinematics of the arm: joints and lengths.
        ///
        /// m per m. 0 until it was measured.
        growth: f64 = 0.0, "growth_mm_per_m" [MM_PER_M, 0, 100];
        /// Best known place of the scan, in the frame of the scan: the middle of the features or
        /// spheres of its registration.
        ///
        /// m, in O.
        registered_at: Vector3<f64> = [0.0, 0.0, 0.0], "registered_at_mm" [MM, -1e6, 1e6];
    }
}

impl ArmUncertainty {
    /// Covariance of the shift of a place of O, m².
    fn shift(&self, place: &Point3<f64>) -> Matrix3<f64> {
        let lever = place.coords - self.registered_at;
        let (distance, square) = (lever.norm(), Matrix3::identity() * lever.norm_squared());
        let along_each = self.place.powi(2) + (self.growth * distance).powi(2);
        Matrix3::identity() * along_each + (square - lever * lever.transpose()) * self.turn.powi(2)
    }

    /// Standard uncertainty of a surface along its unit normal, m.
    pub(super) fn along(&self, place: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        along(&self.shift(place), normal).hypot(self.radius)
    }

    /// Standard uncertainty of a feature's place in its most uncertain direction, m.
    ///
    /// - `out`: of the surface, unit vector.
    pub(super) fn position(
        &self,
        kind: FeatureKind,
        place: &Point3<f64>,
        out: &Vector3<f64>,
    ) -> f64 {
        let shift = self.shift(place);
        let largest = shift.symmetric_eigenvalues().max().max(0.0).sqrt();
        match kind {
            FeatureKind::Plane => along(&shift, out).hypot(self.radius),
            // each face is one number
            FeatureKind::Edge => largest.hypot(self.radius),
            _ => largest,
        }
    }

    /// The feature with the common uncertainty in each of its numbers.
    pub(super) fn widened(&self, mut feature: Feature) -> Feature {
        let (radius, shift) = (self.radius, self.shift(&feature.centre.value));
        if let Some(axis) = feature.axis.as_ref().map(|axis| axis.value) {
            let across = (shift.trace() - along(&shift, &axis).powi(2))
                .max(0.0)
                .sqrt();
            let place = match feature.kind {
                FeatureKind::Plane => along(&shift, &axis).hypot(radius),
                // perpendicular faces; both move outward with the radius
                FeatureKind::Edge => across.hypot(std::f64::consts::SQRT_2 * radius),
                _ => across,
            };
            widen(&mut feature.centre, place);
        }
        // about each of two axes across it
        feature
            .axis
            .iter_mut()
            .for_each(|axis| widen(axis, std::f64::consts::SQRT_2 * self.turn));
        // the ends of a slot are round
        let length = feature
            .length
            .as_mut()
            .filter(|_| feature.kind == FeatureKind::Slot);
        [feature.diameter.as_mut(), feature.width.as_mut(), length]
            .into_iter()
            .flatten()
            .for_each(|size| widen(size, 2.0 * radius));
        feature
    }
}

/// Standard deviation along a unit vector.
fn along(covariance: &Matrix3<f64>, direction: &Vector3<f64>) -> f64 {
    direction.dot(&(covariance * direction)).max(0.0).sqrt()
}

/// An undetermined number stays so.
fn widen<T>(measured: &mut MeasuredValue<T>, by: f64) {
    measured.std = measured.std.map(|std| std.hypot(by));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hole 30 mm along x from the best-known place of the part, its axis along z: a turn about z
    /// moves it along y, a turn about y along z, which does not count; a turn about x does nothing.
    #[test]
    fn shared_parts_are_those_reckoned_by_hand() {
        let known = ArmUncertainty {
            radius: 50e-6,
            place: 0.2e-3,
            turn: 4e-3,
            ..ArmUncertainty::default()
        };
        let number = |std| Some(MeasuredValue::new(8e-3, Some(std), Vec::new()));
        let hole = Feature {
            kind: FeatureKind::Hole,
            centre: MeasuredValue {
                value: Point3::new(30e-3, 0.0, 0.0),
                std: Some(10e-6),
                touches: Vec::new(),
                ..MeasuredValue::default()
            },
            axis: Some(MeasuredValue::new(Vector3::z(), Some(1e-3), Vec::new())),
            diameter: number(20e-6),
            depth: number(7e-6),
            ..Feature::default()
        };
        let wide = known.widened(hole);
        let near = |value: Option<f64>, square: f64| {
            (value.unwrap().powi(2) - square).abs() < 1e-9 * square
        };
        assert!(near(
            wide.centre.std,
            10e-6f64.powi(2) + 2.0 * 0.2e-3f64.powi(2) + 0.12e-3f64.powi(2)
        ));
        assert!(near(wide.axis.unwrap().std, 1e-6 + 2.0 * 16e-6));
        assert!(near(
            wide.diameter.unwrap().std,
            20e-6f64.powi(2) + 100e-6f64.powi(2)
        ));
        assert_eq!(wide.depth.unwrap().std, Some(7e-6));
    }
}
