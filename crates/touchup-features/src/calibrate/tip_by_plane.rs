//! Tip (TCP) calibration by a plane: the centre of the ball in the flange, from touches of one
//! plane with the tip in several orientations.
//!
//! A ball on a plane has its centre at a height h over the plane, in any orientation: n · (p + R d)
//! = h, with the place p of the nominal centre, the axes R of the flange, and the offset d of the
//! true centre from there, in these axes. Unknown are d, n and h. The radius of the ball is in h:
//! it is neither determined nor necessary. If Rᵀ n stays in a plane, d across that is undetermined.

use nalgebra::{Isometry3, Matrix3, SVector, SymmetricEigen, Unit, Vector3};

use super::payload::VectorEstimate;
use touchup_geometry::numeric::{NormalEquations, mean, scatter, tangent_basis};

/// The calibrated tip and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneTipFit {
    /// Offset of the centre of the ball from the nominal one, in the axes of the flange, m.
    pub offset: VectorEstimate,
    /// √(mean r²) of the heights, m.
    pub rms: f64,
    /// Number of touches.
    pub touches: usize,
}

/// Reason why touches of a plane do not determine the offset.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaneTipError {
    /// Too few touches.
    #[error(
        "{count} touches do not determine the tip: {FEWEST} are needed, upright and leaning to all sides"
    )]
    TooFew {
        /// number of touches
        count: usize,
    },
    /// The orientations differ too little.
    #[error(
        "the probe did not lean enough to determine where the ball is along ({:.2}, {:.2}, {:.2}) of the flange: touch a spot where the arm \
         gets to leans of 20° and 40° to all sides", axis[0], axis[1], axis[2]
    )]
    TooAlike {
        /// axis along which the offset is undetermined, in the axes of the flange
        axis: [f64; 3],
    },
    /// The touches leave the orientation of the plane open.
    #[error(
        "the touches lie on one line, which does not determine the orientation of the plane: touch the spot upright to all sides of it too"
    )]
    OnOneLine,
    /// The heights do not fit a plane.
    #[error(
        "the touches are {rms_mm:.3} mm rms off one plane: touch a flat spot of a stiff part that does not move"
    )]
    NotFlat {
        /// rms distance from the plane, mm
        rms_mm: f64,
    },
}

/// Six unknowns, and redundancy for their residuals.
const FEWEST: usize = 9;
/// Least spread of Rᵀ n along any axis, rms: it amplifies the uncertainty of one touch at most
/// tenfold in the offset.
const LEAST_SPREAD: f64 = 0.03;
/// Flatness of a touched plane, rms, m.
const FLAT: f64 = 0.1e-3;
/// Number of Newton steps: each squares the error; plenty from some mm and degrees.
const ROUNDS: usize = 12;

type PlaneTipUnknowns = SVector<f64, 6>;

/// Offset of the ball.
///
/// - `poses`: axes of the flange, about the nominal centre of the ball, at the touches; `normal`:
///   approximate one, out of the plane; both in the base.
///
/// # Errors
/// [`PlaneTipError`]
pub fn fit_tip_by_plane(
    poses: &[Isometry3<f64>],
    normal: &Unit<Vector3<f64>>,
) -> Result<PlaneTipFit, PlaneTipError> {
    let count = poses.len();
    if count < FEWEST {
        return Err(PlaneTipError::TooFew { count });
    }
    check_spread(poses, normal)?;
    let n = count as f64;
    let middle = mean(poses.iter().map(|pose| pose.translation.vector));
    let [u, v] = tangent_basis(normal);
    // d, two slopes of the plane, h
    let mut x = PlaneTipUnknowns::zeros();
    let equations = |x: &PlaneTipUnknowns| {
        let (offset, out) = (
            x.fixed_rows::<3>(0).into_owned(),
            normal.into_inner() + u * x[3] + v * x[4],
        );
        let row = |pose: &Isometry3<f64>| {
            let centre = pose.translation.vector - middle + pose.rotation * offset;
            let by_offset = pose.rotation.inverse() * out;
            let by = PlaneTipUnknowns::new(
                by_offset.x,
                by_offset.y,
                by_offset.z,
                u.dot(&centre),
                v.dot(&centre),
                -1.0,
            );
            // as a height: the normal with slopes is longer than one
            (by / out.norm(), (out.dot(&centre) - x[5]) / out.norm())
        };
        NormalEquations::of(poses.iter().map(row))
    };
    for _ in 0..ROUNDS {
        x -= equations(&x).solution().ok_or(PlaneTipError::OnOneLine)?;
    }
    let NormalEquations {
        information,
        square,
        ..
    } = equations(&x);
    let rms = (square / n).sqrt();
    // NaN is no plane either
    if rms.is_nan() || rms > FLAT {
        return Err(PlaneTipError::NotFlat { rms_mm: rms * 1e3 });
    }
    // the residuals of few touches know their own scale badly: the error is Student's t of n − 6,
    // with a variance larger by (n − 6)/(n − 8) (JCGM 101:2008, 6.4.9.4)
    let covariance =
        information.try_inverse().ok_or(PlaneTipError::OnOneLine)? * (square / (n - 8.0));
    let covariance: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let offset = VectorEstimate::new(x.fixed_rows::<3>(0).into_owned(), &covariance);
    Ok(PlaneTipFit {
        offset,
        rms,
        touches: count,
    })
}

fn check_spread(
    poses: &[Isometry3<f64>],
    normal: &Unit<Vector3<f64>>,
) -> Result<(), PlaneTipError> {
    let seen = poses
        .iter()
        .map(|pose| pose.rotation.inverse() * normal.into_inner());
    let scatter = scatter(seen);
    let eigen = SymmetricEigen::new(scatter / poses.len() as f64);
    let least = eigen.eigenvalues.imin();
    match eigen.eigenvalues[least] < LEAST_SPREAD * LEAST_SPREAD {
        true => Err(PlaneTipError::TooAlike {
            axis: eigen.eigenvectors.column(least).into_owned().into(),
        }),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Rotation3, Unit, UnitQuaternion, Vector3};

    use super::*;

    /// Touches of the plane n · p = 1.5 mm with a ball that is off by `offset` in the axes of a
    /// flange with these leans, °, towards these angles; on a square, m.
    fn poses(
        leans: &[(f64, f64)],
        offset: Vector3<f64>,
        normal: &Unit<Vector3<f64>>,
    ) -> Vec<Isometry3<f64>> {
        let pose = |(at, (lean, towards)): (usize, &(f64, f64))| {
            let axis = Unit::new_normalize(Vector3::new(
                -towards.to_radians().sin(),
                towards.to_radians().cos(),
                0.0,
            ));
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(
                &axis,
                lean.to_radians(),
            ));
            let aside = normal.cross(&Vector3::new((at % 4) as f64, (at / 4) as f64, 2.0)) * 1e-3;
            let centre =
                aside - normal.into_inner() * aside.dot(normal) + normal.into_inner() * 1.5e-3;
            Isometry3::from_parts((centre - rotation * offset).into(), rotation)
        };
        leans.iter().enumerate().map(pose).collect()
    }

    fn all_sides() -> Vec<(f64, f64)> {
        let ring = |lean: f64| (0..6).map(move |at| (lean, 60.0 * f64::from(at)));
        ring(0.0)
            .take(4)
            .chain(ring(20.0))
            .chain(ring(40.0))
            .collect()
    }

    #[test]
    fn without_noise_the_offset_is_exact() {
        let normal = Unit::new_normalize(Vector3::new(0.05, -0.1, 1.0));
        let offset = Vector3::new(1.2e-3, -0.7e-3, 2.1e-3);
        // the initial normal is 2° off
        let about = Unit::new_normalize(normal.into_inner() + Vector3::new(0.03, 0.0, 0.0));
        let fit = fit_tip_by_plane(&poses(&all_sides(), offset, &normal), &about).unwrap();
        assert!(
            (fit.offset.value - offset).norm() < 1e-12 && fit.rms < 1e-12,
            "{fit:?}"
        );
    }

    #[test]
    fn what_says_nothing_is_refused() {
        let normal = Vector3::z_axis();
        let offset = Vector3::new(1e-3, 0.0, 0.0);
        let to_one_side: Vec<_> = (0..12).map(|at| (4.0 * f64::from(at), 0.0)).collect();
        let error = fit_tip_by_plane(&poses(&to_one_side, offset, &normal), &normal).unwrap_err();
        // it leans about y alone: the offset along y is undetermined
        assert!(
            matches!(error, PlaneTipError::TooAlike { axis } if axis[1].abs() > 0.99),
            "{error}"
        );
        let few = poses(&all_sides()[..8], offset, &normal);
        assert_eq!(
            fit_tip_by_plane(&few, &normal),
            Err(PlaneTipError::TooFew { count: 8 })
        );
        let mut bent = poses(&all_sides(), offset, &normal);
        bent.iter_mut()
            .step_by(2)
            .for_each(|pose| pose.translation.z += 1e-3);
        assert!(matches!(
            fit_tip_by_plane(&bent, &normal),
            Err(PlaneTipError::NotFlat { .. })
        ));
        let mut in_line = poses(&all_sides(), Vector3::zeros(), &normal);
        in_line.iter_mut().for_each(|pose| pose.translation.y = 0.0);
        assert_eq!(
            fit_tip_by_plane(&in_line, &normal),
            Err(PlaneTipError::OnOneLine)
        );
    }
}
