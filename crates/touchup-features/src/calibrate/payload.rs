//! Payload identification: weight, centre of mass and bias, from static poses.
//!
//! At rest and in free air the sensor measures f_S = R_WSᵀ w + b_f and τ_S = p_SC × R_WSᵀ w + b_τ
//! with the weight w = m g in the frame of the poses. The first is linear in w and b_f; gravity's
//! direction is found, not assumed. With w known the second is linear in p_SC and b_τ.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::StaticPose;
use super::fit::{CalibrationFit, Equation, UndeterminedDirection, fit, least_determined};
use touchup_method::stylus::{Payload, WrenchFrame};

/// Settings of [`fit_payload`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PayloadParams {
    /// Axes of the wrench: the sensor's own, or those of the poses.
    pub wrench_frame: WrenchFrame,
    /// Orientation of the sensor in the frame of the tip.
    pub r_ts: UnitQuaternion<f64>,
    /// Acceleration of gravity, m/s²: the weight divided by it is the mass. Default 9.81.
    pub gravity: f64,
}

impl Default for PayloadParams {
    fn default() -> Self {
        Self {
            wrench_frame: WrenchFrame::Sensor,
            r_ts: UnitQuaternion::identity(),
            gravity: 9.81,
        }
    }
}

/// A vector and the standard uncertainty of each component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorEstimate {
    /// the vector
    pub value: Vector3<f64>,
    /// its standard uncertainty
    pub sigma: Vector3<f64>,
}

impl VectorEstimate {
    pub(super) fn new(value: Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        Self {
            value,
            sigma: covariance
                .diagonal()
                .map(|variance| variance.max(0.0).sqrt()),
        }
    }
}

/// The identified payload and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadFit {
    /// m |g|, and its standard uncertainty, N.
    pub weight: [f64; 2],
    /// Weight in the frame of the poses, N.
    pub weight_w: VectorEstimate,
    /// Centre of mass from So, expressed in S, m.
    pub p_sc: VectorEstimate,
    /// Bias of the force, expressed in S, N.
    pub bias_force: VectorEstimate,
    /// Bias of the torque, expressed in S, N·m.
    pub bias_torque: VectorEstimate,
    /// √(mean |residual|²) of the force over the kept poses, N.
    pub rms_force: f64,
    /// √(mean |residual|²) of the torque over the kept poses, N·m.
    pub rms_torque: f64,
    /// `rms_force` expected from the noise of the sensor, N; `None` if no noise is known. If much
    /// less than `rms_force`, something else pulls: a cable, a contact, a sensor in another
    /// orientation.
    pub expected_force: Option<f64>,
    /// Number of static poses.
    pub poses: usize,
    /// Indices of the poses left out as outliers.
    pub rejected: Vec<usize>,
    /// Least angle between the poses about any axis, rms to either side, rad.
    pub tilt: f64,
    gravity: f64,
}

impl PayloadFit {
    /// Payload for the compensator, with gravity in the frame of the poses.
    pub fn payload(&self) -> Payload {
        let gravity_w = self.weight_w.value * (self.gravity / self.weight[0]);
        Payload {
            mass: self.weight[0] / self.gravity,
            p_sc: self.p_sc.value,
            gravity_o: gravity_w,
        }
    }
}

/// Reason why static poses do not determine the payload.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PayloadError {
    /// Too few static poses.
    #[error(
        "{count} still phases do not determine weight and bias: hold the stylus still in free air for a second in each of at \
         least {FEWEST_POSES} orientations, better 12"
    )]
    TooFew {
        /// number of poses
        count: usize,
    },
    /// Poses that differ too little.
    #[error(
        "besides turning about ({:.2}, {:.2}, {:.2}) of the poses' frame the stylus was tilted by {tilt_deg:.1}° only, so the \
         weight along that axis cannot be separated from the bias: tilt it by 30° or more about axes across that one too",
        axis[0],
        axis[1],
        axis[2]
    )]
    TooAlike {
        /// rms to either side, degrees
        tilt_deg: f64,
        /// axis along which the weight is undetermined, in W
        axis: [f64; 3],
    },
    /// Gravity always pulls in the same direction through the sensor.
    #[error(
        "the centre of mass along ({:.2}, {:.2}, {:.2}) of the sensor is not determined: gravity pulls along it in most poses; \
         lay the stylus down to the other side too", axis[0], axis[1], axis[2]
    )]
    CentreUndetermined {
        /// axis along which the centre is undetermined, in S
        axis: [f64; 3],
    },
    /// No weight.
    #[error(
        "the weight is {weight_n:.3} N, no more than three times its uncertainty of {sigma_n:.3} N: the driver takes it off \
         already, or nothing hangs on the sensor; leave compensation.payload out"
    )]
    NoWeight {
        /// N
        weight_n: f64,
        /// N
        sigma_n: f64,
    },
    /// The other axes explain the wrench far better.
    #[error(
        "the wrench is in the axes of the {other} and not of the {given}: residuals are {other_rms_n:.3} N instead of {rms_n:.3} N; \
         say --wrench-axes {other}, and where they are recorded mend the frame_id of the wrench"
    )]
    WrongAxes {
        /// given axes
        given: &'static str,
        /// axes that fit
        other: &'static str,
        /// rms with the given axes, N
        rms_n: f64,
        /// rms with the other axes, N
        other_rms_n: f64,
    },
    /// Too many outliers among the poses.
    #[error(
        "{rejected} of {poses} still phases do not fit the others: the stylus must touch nothing, and nothing may touch it"
    )]
    Inconsistent {
        /// number of rejected poses
        rejected: usize,
        /// number of all poses
        poses: usize,
    },
}

/// Six unknowns of the force, three equations for each pose, and redundancy for the residuals.
const FEWEST_POSES: usize = 4;
/// sin² of the smallest tilt to either side: 5°. The uncertainty is then ten times that of a wide
/// tilt.
const SMALLEST_SPREAD: f64 = 0.0076;
/// The same for the centre of mass, by the rotation of gravity in the sensor: 2°. A worse condition
/// shows in its uncertainty, and harms little: the force does not need it.
const SMALLEST_CENTRE_SPREAD: f64 = 0.0012;
/// Ratio of the residuals from which the other axes of the wrench are the right ones.
const AXES_RATIO: f64 = 2.0;
/// Smallest number of poses that decide on the axes.
const FEWEST_FOR_AXES: usize = 6;
/// Largest share of wrong poses.
const LARGEST_REJECTED: f64 = 0.4;

/// Weight, centre of mass and bias.
///
/// # Errors
/// [`PayloadError`]: too few poses or too alike (with the undetermined direction), no weight, wrong
/// axes, too many outliers.
pub fn fit_payload(
    poses: &[StaticPose],
    params: &PayloadParams,
) -> Result<PayloadFit, PayloadError> {
    if poses.len() < FEWEST_POSES {
        return Err(PayloadError::TooFew { count: poses.len() });
    }
    let forces = equations(poses, params);
    let too_alike = |least: UndeterminedDirection| PayloadError::TooAlike {
        tilt_deg: least.angle().to_degrees(),
        axis: least.axis.into(),
    };
    let force = fit(&forces, SMALLEST_SPREAD).map_err(too_alike)?;
    check_axes(poses, params, &force)?;
    if force.rejected() as f64 > LARGEST_REJECTED * poses.len() as f64 {
        return Err(PayloadError::Inconsistent {
            rejected: force.rejected(),
            poses: poses.len(),
        });
    }
    let weight = force.x.norm();
    let direction = force.x / weight.max(f64::MIN_POSITIVE);
    let sigma = direction
        .dot(&(force.covariance_x * direction))
        .max(0.0)
        .sqrt();
    // NaN is no weight either
    if !(weight > 3.0 * sigma && weight > f64::MIN_POSITIVE) {
        return Err(PayloadError::NoWeight {
            weight_n: weight,
            sigma_n: sigma,
        });
    }
    let torque = fit_torque(poses, params, &force)?;
    let variance = |pose: &StaticPose| {
        pose.noise
            .map(|noise| 3.0 * noise * noise / pose.samples as f64)
    };
    let expected: Option<f64> = poses.iter().map(variance).sum();
    Ok(PayloadFit {
        weight: [weight, sigma],
        weight_w: VectorEstimate::new(force.x, &force.covariance_x),
        p_sc: VectorEstimate::new(torque.x, &torque.covariance_x),
        bias_force: VectorEstimate::new(force.y, &force.covariance_y),
        bias_torque: VectorEstimate::new(torque.y, &torque.covariance_y),
        rms_force: force.rms,
        rms_torque: torque.rms,
        expected_force: expected.map(|sum| (sum / poses.len() as f64).sqrt()),
        poses: poses.len(),
        rejected: (0..poses.len()).filter(|&i| !force.kept[i]).collect(),
        tilt: least_determined(&forces, &force.kept).angle(),
        gravity: params.gravity,
    })
}

/// R_WSᵀ w + b = f, in the axes of S for any axes of the wrench.
fn equations(poses: &[StaticPose], params: &PayloadParams) -> Vec<Equation> {
    let equation = |pose: &StaticPose| {
        let turn = (pose.r_wt * params.r_ts).inverse();
        Equation {
            a: turn.to_rotation_matrix().into_inner(),
            z: in_sensor(params, &turn, pose.wrench.force),
        }
    };
    poses.iter().map(equation).collect()
}

fn in_sensor(
    params: &PayloadParams,
    turn: &UnitQuaternion<f64>,
    vector: Vector3<f64>,
) -> Vector3<f64> {
    match params.wrench_frame {
        WrenchFrame::Sensor => vector,
        WrenchFrame::Object => turn * vector,
    }
}

/// −[R_WSᵀ w]× p + b = τ over the poses kept by the force, with covariances that include the
/// uncertainty of w.
fn fit_torque(
    poses: &[StaticPose],
    params: &PayloadParams,
    force: &CalibrationFit,
) -> Result<CalibrationFit, PayloadError> {
    let kept = || {
        poses
            .iter()
            .zip(&force.kept)
            .filter(|(_, kept)| **kept)
            .map(|(pose, _)| pose)
    };
    let torques = |weight: &Vector3<f64>| -> Vec<Equation> {
        let equation = |pose: &StaticPose| {
            let turn = (pose.r_wt * params.r_ts).inverse();
            Equation {
                a: -(turn * weight).cross_matrix(),
                z: in_sensor(params, &turn, pose.wrench.torque),
            }
        };
        kept().map(equation).collect()
    };
    let smallest = SMALLEST_CENTRE_SPREAD * force.x.norm_squared();
    let equations = torques(&force.x);
    let undetermined = |least: UndeterminedDirection| PayloadError::CentreUndetermined {
        axis: least.axis.into(),
    };
    let mut found = fit(&equations, smallest).map_err(undetermined)?;
    // a step as large as the uncertainty of w: the change is nearly linear over it
    let step = force.covariance_x.trace().sqrt().max(1e-6 * force.x.norm());
    let (mut by_p, mut by_b) = (Matrix3::zeros(), Matrix3::zeros());
    for axis in 0..3 {
        let mut weight = force.x;
        weight[axis] += step;
        let moved = fit(&torques(&weight), smallest).map_err(undetermined)?;
        by_p.set_column(axis, &((moved.x - found.x) / step));
        by_b.set_column(axis, &((moved.y - found.y) / step));
    }
    let carried = |by: Matrix3<f64>| by * force.covariance_x * by.transpose();
    found.covariance_x += carried(by_p);
    found.covariance_y += carried(by_b);
    Ok(found)
}

/// Refuses the given axes if the other ones fit far better.
fn check_axes(
    poses: &[StaticPose],
    params: &PayloadParams,
    given: &CalibrationFit,
) -> Result<(), PayloadError> {
    let (name, other, other_name) = match params.wrench_frame {
        WrenchFrame::Sensor => ("sensor", WrenchFrame::Object, "pose"),
        WrenchFrame::Object => ("pose", WrenchFrame::Sensor, "sensor"),
    };
    if poses.len() < FEWEST_FOR_AXES {
        return Ok(());
    }
    let other = equations(
        poses,
        &PayloadParams {
            wrench_frame: other,
            ..*params
        },
    );
    let few = poses.len() / 5;
    match fit(&other, SMALLEST_SPREAD) {
        Ok(better)
            if better.rejected() <= few.max(given.rejected())
                && AXES_RATIO * better.rms < given.rms =>
        {
            Err(PayloadError::WrongAxes {
                given: name,
                other: other_name,
                rms_n: given.rms,
                other_rms_n: better.rms,
            })
        }
        _ => Ok(()),
    }
}
