//! Errors of an arm over its workspace, from touches of spheres of known diameter at known places.
//!
//! - Repeatability s of a touch along its direction: s² = Σ r² / Σ (n − 4) over the residuals r of
//!   all sphere fits.
//! - Tip radius: the fitted radius less the radius of the sphere, the mean of all fits. Its
//!   uncertainty is the larger of the one from the residuals and the scatter of the fits, with half
//!   of the uncertainty of the diameter.
//! - Errors over the workspace: eₖ = remainder of found less nominal centres after the rigid motion
//!   of least squares, free of the place of the scan in the base. With n spheres f = 3n − 6 numbers
//!   remain (3n − 5 on one line: with two spheres their distance).
//! - Growth g with the distance d from the place of registration of the part: a place has the
//!   standard deviation g d along each axis, so g² = Σ |eₖ|² / (f Σ dₖ² / n). The noise of the
//!   centres stays in it: with few spheres close together it comes out too large rather than too
//!   small.

use nalgebra::{Point3, Vector3};

use super::sphere::ReferenceSphere;
use crate::align::{PointPair, closest_motion};
use crate::features::fit::{SphereFit, fit_sphere};
use touchup_geometry::numeric::{mean, spreads};

/// Touches of one sphere with one orientation of the probe.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereReading {
    /// index of the sphere, from 0
    pub sphere: usize,
    /// centres of the ball at contact, m in O
    pub centres: Vec<Point3<f64>>,
}

/// A sphere, and its place by the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedPlace {
    /// index of the sphere, from 0
    pub sphere: usize,
    /// mean of its centres over the orientations, m in O
    pub found: Point3<f64>,
    /// found less nominal centre, after the rigid motion that fits all spheres best, m; 0 for a
    /// sphere by itself
    pub error: Vector3<f64>,
}

/// Findings on the arm from touches of spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceCheck {
    /// fit of each reading, in their order
    pub fits: Vec<SphereFit>,
    /// standard deviation of one touch along its direction, m
    pub repeatability: f64,
    /// degrees of freedom of the repeatability
    pub degrees_of_freedom: usize,
    /// standard deviation of a centre along each axis from one orientation to the next, m; `None`
    /// if each sphere has touches in one alone
    pub orientation_scatter: Option<f64>,
    /// effective radius of the ball, m
    pub tip_radius: f64,
    /// its standard uncertainty, m
    pub tip_radius_sigma: f64,
    /// each touched sphere
    pub places: Vec<CheckedPlace>,
    /// standard deviation of a place along each axis over its distance from the place of
    /// registration of the part, m per m; `None` for a sphere by itself
    pub growth: Option<f64>,
    /// degrees of freedom of the growth
    pub growth_degrees_of_freedom: usize,
}

/// Reason why the touches give no result.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WorkspaceError {
    /// No sphere was touched.
    #[error("no sphere was touched in any orientation, so nothing is known of the arm")]
    Nothing,
    /// The touches do not lie on a sphere.
    #[error(
        "{touches} touches of sphere {sphere} determine no sphere: touch it at five places that lie in no plane, or more"
    )]
    NoSphere {
        /// number of the sphere, from 1
        sphere: usize,
        /// number of touches
        touches: usize,
    },
}

/// Scatter across a line as a share of the scatter along it, below which it counts as none: 1°.
const LINE_SHARE: f64 = 0.02;

/// Evaluates the touches of spheres.
///
/// - `registered_at`: the best known place of the scan, m in O; `diameter_sigma`: standard
///   uncertainty of the diameters, m.
///
/// # Errors
/// [`WorkspaceError`]
pub fn check_workspace(
    spheres: &[ReferenceSphere],
    readings: &[SphereReading],
    registered_at: &Vector3<f64>,
    diameter_sigma: f64,
) -> Result<WorkspaceCheck, WorkspaceError> {
    let fit = |reading: &SphereReading| {
        let no_sphere = WorkspaceError::NoSphere {
            sphere: reading.sphere + 1,
            touches: reading.centres.len(),
        };
        fit_sphere(&reading.centres).ok_or(no_sphere)
    };
    let fits = readings.iter().map(fit).collect::<Result<Vec<_>, _>>()?;
    if fits.is_empty() {
        return Err(WorkspaceError::Nothing);
    }
    let degrees_of_freedom = fits.iter().map(|fit| fit.degrees_of_freedom).sum::<usize>();
    let squares: f64 = fits.iter().map(|fit| fit.residual_square).sum();
    let repeatability = (squares / degrees_of_freedom as f64).sqrt();

    let [tip_radius, by_touches] = tip_radius_of(spheres, readings, &fits, repeatability);
    let tip_radius_sigma = by_touches.hypot(diameter_sigma / 2.0);
    let (mut places, orientation_scatter) = places_of(spheres, readings, &fits);

    let told = |place: &CheckedPlace| spheres[place.sphere].centre;
    let pairs: Vec<_> = places
        .iter()
        .map(|place| PointPair {
            from: told(place),
            to: place.found,
            sigma: None,
        })
        .collect();
    if let Some(motion) = closest_motion(&pairs) {
        // in the axes of the scan
        places.iter_mut().for_each(|place| {
            place.error = motion.inverse_transform_point(&place.found) - told(place)
        });
    }
    let growth_degrees_of_freedom = free_numbers(&pairs);
    let squares: f64 = places.iter().map(|place| place.error.norm_squared()).sum();
    let distances: f64 = places
        .iter()
        .map(|place| (told(place).coords - registered_at).norm_squared())
        .sum();
    let expected = growth_degrees_of_freedom as f64 * distances / places.len() as f64;
    let growth = (expected > 0.0).then(|| (squares / expected).sqrt());
    Ok(WorkspaceCheck {
        fits,
        repeatability,
        degrees_of_freedom,
        orientation_scatter,
        tip_radius,
        tip_radius_sigma,
        places,
        growth,
        growth_degrees_of_freedom,
    })
}

/// Effective radius of the ball, m, and its standard uncertainty by the touches, m.
fn tip_radius_of(
    spheres: &[ReferenceSphere],
    readings: &[SphereReading],
    fits: &[SphereFit],
    repeatability: f64,
) -> [f64; 2] {
    let radius_of =
        |(fit, reading): (&SphereFit, &SphereReading)| fit.radius - spheres[reading.sphere].radius;
    let radii: Vec<f64> = fits.iter().zip(readings).map(radius_of).collect();
    let count = radii.len() as f64;
    let tip_radius = radii.iter().sum::<f64>() / count;
    let by_residuals = repeatability
        * fits
            .iter()
            .map(|fit| fit.cofactors[(3, 3)])
            .sum::<f64>()
            .sqrt()
        / count;
    let by_scatter = match radii.len() {
        1 => 0.0,
        _ => (radii.iter().map(|r| (r - tip_radius).powi(2)).sum::<f64>() / (count - 1.0) / count)
            .sqrt(),
    };
    [tip_radius, by_residuals.max(by_scatter)]
}

/// Each touched sphere, without its error, and the scatter of its centres over the orientations, m.
fn places_of(
    spheres: &[ReferenceSphere],
    readings: &[SphereReading],
    fits: &[SphereFit],
) -> (Vec<CheckedPlace>, Option<f64>) {
    let centres_of = |sphere: usize| {
        let all = fits
            .iter()
            .zip(readings)
            .filter(move |(_, reading)| reading.sphere == sphere);
        all.map(|(fit, _)| fit.centre.coords)
    };
    let (mut places, mut turned, mut turns) = (Vec::new(), 0.0, 0);
    for sphere in 0..spheres.len() {
        let count = centres_of(sphere).count();
        if count > 0 {
            let found = mean(centres_of(sphere));
            turned += centres_of(sphere)
                .map(|centre| (centre - found).norm_squared())
                .sum::<f64>();
            turns += count - 1;
            places.push(CheckedPlace {
                sphere,
                found: found.into(),
                error: Vector3::zeros(),
            });
        }
    }
    let scatter = (turns > 0).then(|| (turned / (3 * turns) as f64).sqrt());
    (places, scatter)
}

/// Number of degrees of freedom left by a rigid motion of these places.
fn free_numbers(pairs: &[PointPair]) -> usize {
    let [_, across, along] = spreads(pairs.iter().map(|pair| pair.from.coords));
    let fitted = match along > 0.0 {
        false => 3,
        true if across <= LINE_SHARE * along => 5,
        true => 6,
    };
    (3 * pairs.len()).saturating_sub(fitted)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;

    const SPHERES: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [0.2, 0.0, 0.0],
        [0.0, 0.2, 0.0],
        [0.0, 0.0, 0.2],
    ];
    const RADIUS: f64 = 12.5e-3;
    const TIP: f64 = 1.512e-3;

    fn spheres() -> Vec<ReferenceSphere> {
        SPHERES
            .map(|centre| ReferenceSphere {
                centre: centre.into(),
                radius: RADIUS,
            })
            .to_vec()
    }

    /// A pole and six around, seven touches.
    fn touches(centre: &Point3<f64>) -> Vec<Point3<f64>> {
        let around = (0..6).map(|at| f64::from(at) * std::f64::consts::FRAC_PI_3);
        let ring =
            around.map(|a| Vector3::new(0.75f64.sqrt() * a.cos(), 0.75f64.sqrt() * a.sin(), 0.5));
        [Vector3::z()]
            .into_iter()
            .chain(ring)
            .map(|out| centre + out * (RADIUS + TIP))
            .collect()
    }

    fn readings(moved: impl Fn(&Point3<f64>) -> Point3<f64>) -> Vec<SphereReading> {
        let all = SPHERES.iter().enumerate();
        all.map(|(sphere, at)| SphereReading {
            sphere,
            centres: touches(&moved(&Point3::from(*at))),
        })
        .collect()
    }

    #[test]
    fn a_part_that_lies_elsewhere_is_no_error_of_the_arm_and_the_tip_is_as_large_as_it_is() {
        let turn = UnitQuaternion::new(Vector3::new(0.02, -0.03, 0.01));
        let motion = Isometry3::from_parts(Vector3::new(1e-3, -2e-3, 0.5e-3).into(), turn);
        let found = check_workspace(
            &spheres(),
            &readings(|p| motion * p),
            &Vector3::zeros(),
            1e-6,
        )
        .unwrap();
        assert!(found.places.iter().all(|place| place.error.norm() < 1e-10));
        assert!(found.growth.unwrap() < 1e-8 && found.repeatability < 1e-10);
        assert!(
            (found.tip_radius - TIP).abs() < 1e-10
                && (found.tip_radius_sigma - 0.5e-6).abs() < 1e-9
        );
        assert_eq!(
            (found.degrees_of_freedom, found.growth_degrees_of_freedom),
            (12, 6)
        );
        assert_eq!(found.orientation_scatter, None);
    }

    /// An arm with lengths 1 mm per m too long, which no motion removes. About the middle of the
    /// spheres the squared distances are 3/4 · 0.2² · 3 = 0.09 m², from the first one on 0.12 m².
    #[test]
    fn a_scale_is_found_as_the_growth_of_its_closed_form() {
        let scaled = readings(|p| Point3::from(p.coords * 1.001));
        let found = check_workspace(&spheres(), &scaled, &Vector3::zeros(), 0.0).unwrap();
        let expected = (0.001f64.powi(2) * 0.09 / (6.0 * 0.12 / 4.0)).sqrt();
        assert!(
            (found.growth.unwrap() - expected).abs() < 1e-9,
            "{:?} {expected}",
            found.growth
        );
        // two of them: their distance is 0.2 mm too long, half of it at each; nearer to the first,
        // d² = 0.2² over two
        let found = check_workspace(&spheres(), &scaled[..2], &Vector3::zeros(), 0.0).unwrap();
        assert!(
            (found.places[1].error - Vector3::x() * 0.1e-3).norm() < 1e-10,
            "{:?}",
            found.places
        );
        assert!(
            (found.growth.unwrap() - 0.1e-3 * 2f64.sqrt() / (0.04f64 / 2.0).sqrt()).abs() < 1e-9
        );
        assert_eq!(found.growth_degrees_of_freedom, 1);
        let alone = check_workspace(&spheres(), &scaled[1..2], &Vector3::zeros(), 0.0).unwrap();
        assert_eq!((alone.growth, alone.growth_degrees_of_freedom), (None, 0));
    }

    /// Two orientations with tips 10 µm apart along x: ±5 µm, one degree of freedom of three axes.
    #[test]
    fn what_turning_the_probe_moves_is_its_scatter() {
        let mut both = readings(|p| *p)[..1].to_vec();
        both.push(SphereReading {
            sphere: 0,
            centres: touches(&Point3::new(10e-6, 0.0, 0.0)),
        });
        let found = check_workspace(&spheres(), &both, &Vector3::zeros(), 0.0).unwrap();
        assert!((found.orientation_scatter.unwrap() - (50e-12f64 / 3.0).sqrt()).abs() < 1e-9);
        assert!((found.places[0].found.x - 5e-6).abs() < 1e-9);
    }

    #[test]
    fn too_few_touches_are_refused_by_the_number_of_the_sphere() {
        let flat = SphereReading {
            sphere: 2,
            centres: touches(&Point3::origin())[1..].to_vec(),
        };
        let refused = |readings: &[SphereReading]| {
            check_workspace(&spheres(), readings, &Vector3::zeros(), 0.0)
        };
        assert_eq!(
            refused(&[flat]),
            Err(WorkspaceError::NoSphere {
                sphere: 3,
                touches: 6
            })
        );
        assert_eq!(refused(&[]), Err(WorkspaceError::Nothing));
    }
}
