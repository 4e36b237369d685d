//! Results of a check as a table and as its record.

use std::fmt;

use serde::Serialize;

use crate::cli::{Losses, reported};
use touchup_features::calibrate::{CheckedPlace, ReferenceSphere, WorkspaceCheck};
use touchup_features::features::fit::SphereFit;
use touchup_probing::execute::{
    NotReached, Repeatability, SphereOrientation, SphereTouches, SpotTouch,
};
use touchup_session::scene::CheckRecord;

/// Gates of a check, and the uncertainty of the sphere diameters.
#[derive(Clone, Copy, Debug, Serialize)]
pub(in crate::cli) struct Gates {
    /// Largest distance between two touches of the spot.
    pub spot_um: f64,
    /// Largest error of a centre over the workspace, and largest scatter of a centre over the
    /// orientations.
    pub sphere_um: f64,
    /// Standard uncertainty of the diameters.
    pub diameter_sigma_um: f64,
}

impl Default for Gates {
    /// For a UR, with ±0.03 mm by its maker: ten touches of 0.03 mm are within 0.15 mm in 98 of 100
    /// checks.
    fn default() -> Self {
        Self {
            spot_um: 150.0,
            sphere_um: 150.0,
            diameter_sigma_um: 1.0,
        }
    }
}

/// Limit for a jump between two radii, in standard uncertainties of the difference.
const JUMPS: f64 = 3.0;

/// Record of a check, and its sources.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct CheckReport {
    #[serde(flatten)]
    pub record: CheckRecord,
    gates: Gates,
    #[serde(skip_serializing_if = "Option::is_none")]
    spot: Option<CheckedSpot>,
    #[serde(skip_serializing_if = "Option::is_none")]
    workspace: Option<SphereResults>,
}

impl CheckReport {
    /// - `record`: time and arm; `radii`: name, radius and standard uncertainty, mm.
    pub(super) fn judged(
        record: CheckRecord,
        spot: Option<&Repeatability>,
        workspace: Option<SphereResults>,
        gates: Gates,
        radii: &[(&str, Option<f64>, f64)],
    ) -> Self {
        let spot = spot.map(CheckedSpot::of);
        // pooled, weighted by degrees of freedom
        let scatters = [
            spot.as_ref()
                .map(|spot| (spot.std_um / 1e3, spot.touches.len() - 1)),
            workspace
                .as_ref()
                .map(|all| (all.repeatability_um / 1e3, all.degrees_of_freedom)),
        ];
        let scatters: Vec<_> = scatters.into_iter().flatten().collect();
        let repeatability_degrees_of_freedom: usize = scatters.iter().map(|(_, count)| count).sum();
        let squares: f64 = scatters
            .iter()
            .map(|(std, count)| std * std * *count as f64)
            .sum();
        let failures = Self::failures(&gates, spot.as_ref(), workspace.as_ref());
        let jump = |all: &SphereResults| {
            let jumped = radii.iter().filter_map(|(whose, radius_mm, sigma_mm)| {
                all.jump(whose, (*radius_mm)?, *sigma_mm)
            });
            jumped.collect::<Vec<_>>()
        };
        let record = CheckRecord {
            passed: failures.is_empty(),
            failures,
            warnings: workspace.as_ref().map_or(Vec::new(), jump),
            repeatability_mm: (squares / repeatability_degrees_of_freedom as f64).sqrt(),
            repeatability_degrees_of_freedom,
            growth_mm_per_m: workspace.as_ref().and_then(|all| all.growth_mm_per_m),
            tip_radius_mm: workspace.as_ref().map(|all| all.tip_radius_mm),
            tip_radius_sigma_mm: workspace.as_ref().map(|all| all.tip_radius_sigma_mm),
            ..record
        };
        Self {
            record,
            gates,
            spot,
            workspace,
        }
    }

    fn failures(
        gates: &Gates,
        spot: Option<&CheckedSpot>,
        workspace: Option<&SphereResults>,
    ) -> Vec<String> {
        let Gates {
            spot_um, sphere_um, ..
        } = gates;
        let of_spot = spot.filter(|spot| spot.range_um > *spot_um).map(|CheckedSpot { range_um, .. }| {
            format!(
                "the touches of one spot are {range_um:.1} µm apart, the gate is {spot_um} µm: look for play in probe, flange and joints"
            )
        });
        let worst = workspace.and_then(|all| {
            all.spheres
                .iter()
                .max_by(|a, b| a.error_um().total_cmp(&b.error_um()))
        });
        let of_place = worst.filter(|sphere| sphere.error_um() > *sphere_um).map(|sphere| {
            format!(
                "sphere {} is {:.1} µm from where the others have it, the gate is {sphere_um} µm: look at its place, or calibrate the arm",
                sphere.sphere,
                sphere.error_um()
            )
        });
        let scatter_um = workspace.and_then(|all| all.orientation_scatter_um);
        let of_turns = scatter_um.filter(|scatter_um| scatter_um > sphere_um).map(|scatter_um| {
            format!(
                "the centre of a sphere scatters by {scatter_um:.1} µm when the probe leans, the gate is {sphere_um} µm: `touchup calibrate tip`"
            )
        });
        [of_spot, of_place, of_turns]
            .into_iter()
            .flatten()
            .collect()
    }

    /// Failed gates; logs the warnings.
    pub(super) fn losses(&self) -> Losses {
        let CheckRecord {
            failures, warnings, ..
        } = &self.record;
        warnings
            .iter()
            .for_each(|warning| tracing::warn!("{warning}"));
        failures.clone()
    }
}

reported! {
    /// Results of one spot.
    struct CheckedSpot, fn of(found: &Repeatability) {
        spot_mm: [f64; 3] = (found.place * 1e3).coords.into(),
        normal: [f64; 3] = found.normal.into_inner().into(),
        touches: Vec<CheckedTouch> = found.touches.iter().map(|touch| CheckedTouch::of(touch, found.mean_height)).collect(),
        range_um: f64 = found.range * 1e6,
        std_um: f64 = found.deviation * 1e6,
        /// First side minus the other.
        reversal_um: f64 = found.reversal * 1e6,
        stiffness_n_per_mm: f64 = found.stiffness[0] / 1e3,
        stiffness_std_n_per_mm: f64 = found.stiffness[1] / 1e3,
    }
}

reported! {
    struct CheckedTouch, fn of(touch: &SpotTouch, mean_height: f64) {
        side: i8 = touch.side,
        /// Outward from the mean of all.
        deviation_um: f64 = (touch.height - mean_height) * 1e6,
        std_um: f64 = touch.sigma * 1e6,
        stiffness_n_per_mm: f64 = touch.stiffness[0] / 1e3,
        verdict: &'static str = touch.verdict.name(),
    }
}

reported! {
    /// Results of all spheres.
    pub(super) struct SphereResults, pub(super) fn of(found: &WorkspaceCheck, told: &[ReferenceSphere], touched: &[SphereTouches]) {
        repeatability_um: f64 = found.repeatability * 1e6,
        degrees_of_freedom: usize = found.degrees_of_freedom,
        tip_radius_mm: f64 = found.tip_radius * 1e3,
        tip_radius_sigma_mm: f64 = found.tip_radius_sigma * 1e3,
        /// Along each axis.
        orientation_scatter_um?: f64 = found.orientation_scatter.map(|scatter| scatter * 1e6),
        growth_mm_per_m?: f64 = found.growth.map(|growth| growth * 1e3),
        growth_degrees_of_freedom: usize = found.growth_degrees_of_freedom,
        spheres: Vec<CheckedSphere> = {
            let mut fits = found.fits.iter();
            let sphere = |(sphere, (told, touched)): (usize, (&ReferenceSphere, &SphereTouches))| {
                let fits: Vec<_> = fits.by_ref().take(touched.orientations.len()).collect();
                let place = found.places.iter().find(|place| place.sphere == sphere);
                CheckedSphere::of(sphere + 1, told, place, &fits, touched)
            };
            told.iter().zip(touched).enumerate().map(sphere).collect()
        },
    }
}

reported! {
    struct CheckedSphere, fn of(
        number: usize,
        told: &ReferenceSphere,
        place: Option<&CheckedPlace>,
        fits: &[&SphereFit],
        touched: &SphereTouches
    ) {
        sphere: usize = number,
        told_mm: [f64; 3] = (told.centre * 1e3).coords.into(),
        diameter_mm: f64 = told.radius * 2e3,
        /// Centre from the arm's touches.
        found_mm?: [f64; 3] = place.map(|place| (place.found * 1e3).coords.into()),
        /// Residual after the best-fit rigid motion of all spheres.
        error_mm?: [f64; 3] = place.map(|place| (place.error * 1e3).into()),
        orientations: Vec<CheckedOrientation> =
            touched.orientations.iter().zip(fits).map(|(one, fit)| CheckedOrientation::of(one, fit, told)).collect(),
        /// Orientations out of the arm's reach, with reasons.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        not_reached: Vec<String> = touched.not_reached.iter().map(NotReached::to_string).collect(),
    }
}

reported! {
    struct CheckedOrientation, fn of(one: &SphereOrientation, fit: &SphereFit, told: &ReferenceSphere) {
        lean_deg: f64 = one.orientation.lean.to_degrees(),
        towards_deg: f64 = one.orientation.towards.to_degrees(),
        touches: usize = one.centres.len(),
        center_mm: [f64; 3] = (fit.centre * 1e3).coords.into(),
        tip_radius_mm: f64 = (fit.radius - told.radius) * 1e3,
        /// Residual standard deviation of the touches from the sphere.
        residual_um: f64 = (fit.residual_square / fit.degrees_of_freedom as f64).sqrt() * 1e6,
    }
}

impl SphereResults {
    /// Message if the radius differs from another by more than chance.
    fn jump(&self, whose: &str, radius_mm: f64, sigma_mm: f64) -> Option<String> {
        let Self {
            tip_radius_mm,
            tip_radius_sigma_mm,
            ..
        } = self;
        let by_mm = tip_radius_mm - radius_mm;
        (by_mm.abs() > JUMPS * tip_radius_sigma_mm.hypot(sigma_mm)).then(|| {
            format!(
                "the radius of the ball is {tip_radius_mm:.4} ± {tip_radius_sigma_mm:.4} mm, {by_mm:+.4} mm from what {whose}: look at the ball, \
                 for wear, dirt or a loose stem; else put it into the scene as tip.radius_mm"
            )
        })
    }
}

impl CheckedSphere {
    fn error_um(&self) -> f64 {
        self.error_mm.map_or(0.0, |error| {
            error.iter().map(|mm| mm * mm).sum::<f64>().sqrt() * 1e3
        })
    }
}

impl fmt::Display for CheckedSpot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, touch) in (1..).zip(&self.touches) {
            let CheckedTouch {
                side,
                deviation_um,
                std_um,
                verdict,
                ..
            } = touch;
            let side = if *side > 0 { "one side" } else { "the other" };
            writeln!(
                f,
                "touch {number:3} from {side}: {deviation_um:+6.1} µm ± {std_um:.1}, {verdict}"
            )?;
        }
        let Self {
            spot_mm: [x, y, z],
            range_um,
            std_um,
            reversal_um,
            stiffness_n_per_mm,
            ..
        } = self;
        let count = self.touches.len();
        writeln!(
            f,
            "{count} touches of ({x:.1} {y:.1} {z:.1}) mm: {range_um:.1} µm apart, standard deviation {std_um:.1} µm"
        )?;
        writeln!(
            f,
            "the sides differ by {reversal_um:+.1} µm; arm and probe have {stiffness_n_per_mm:.1} N/mm"
        )
    }
}

impl fmt::Display for SphereResults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for sphere in &self.spheres {
            let CheckedSphere {
                sphere: number,
                told_mm: [x, y, z],
                orientations,
                not_reached,
                ..
            } = sphere;
            let count = orientations.len();
            write!(
                f,
                "sphere {number} at ({x:.1} {y:.1} {z:.1}) mm, {count} orientations: "
            )?;
            match (sphere.found_mm, self.spheres.len()) {
                (None, _) => writeln!(f, "not reached")?,
                (Some([x, y, z]), 1) => writeln!(f, "found at ({x:.4} {y:.4} {z:.4})")?,
                (Some(_), _) => writeln!(
                    f,
                    "{:.1} µm from where the others have it",
                    sphere.error_um()
                )?,
            }
            not_reached
                .iter()
                .try_for_each(|line| writeln!(f, "  left out: {line}"))?;
        }
        let Self {
            repeatability_um,
            tip_radius_mm,
            tip_radius_sigma_mm,
            ..
        } = self;
        writeln!(
            f,
            "one touch repeats within {repeatability_um:.1} µm (standard deviation)"
        )?;
        if let Some(scatter_um) = self.orientation_scatter_um {
            writeln!(
                f,
                "a centre scatters by {scatter_um:.1} µm along each axis when the probe leans"
            )?;
        }
        writeln!(
            f,
            "radius of the ball {tip_radius_mm:.4} ± {tip_radius_sigma_mm:.4} mm"
        )?;
        match self.growth_mm_per_m {
            Some(growth) => writeln!(
                f,
                "places are {growth:.3} mm/m less certain with the distance from robot.registered_at_mm, by {} numbers",
                self.growth_degrees_of_freedom
            ),
            None => writeln!(
                f,
                "one sphere says nothing of the growth over the workspace: touch it at several places"
            ),
        }
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.spot.iter().try_for_each(|spot| write!(f, "{spot}"))?;
        self.workspace
            .iter()
            .try_for_each(|all| write!(f, "{all}"))?;
        let CheckRecord {
            passed,
            failures,
            warnings,
            ..
        } = &self.record;
        warnings
            .iter()
            .try_for_each(|warning| writeln!(f, "WARNING: {warning}"))?;
        let Gates {
            spot_um, sphere_um, ..
        } = self.gates;
        match passed {
            true => write!(
                f,
                "passed: the gates are {spot_um} µm for a spot, {sphere_um} µm for spheres"
            ),
            false => write!(f, "FAILED: {}", failures.join("; ")),
        }
    }
}
