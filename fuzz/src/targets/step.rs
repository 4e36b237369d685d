//! One held sample of the face dynamics, by every rule: a face somewhere, of unit normal, or an
//! error.

use crate::{number, vector};
use arbitrary::{Result, Unstructured};
use nalgebra::{Point3, Vector3};
use touchup_method::haptic::{
    ContactModel, DynamicsParams, FaceDynamics, FaceState, MotionDirection, SigmoidParams, StepRule,
};

fn step(bytes: &mut Unstructured) -> Result<()> {
    let model = if bytes.arbitrary()? {
        ContactModel::Spring {
            stiffness_n_per_m: number(bytes, 20e3)?,
        }
    } else {
        let (f_max_n, h_min_m, delta) = (
            number(bytes, 10.0)?,
            number(bytes, 1e-3)?,
            number(bytes, 10.0)?,
        );
        ContactModel::Sigmoid(SigmoidParams {
            f_max: f_max_n,
            h_min: h_min_m,
            delta,
        })
    };
    let rules = [
        StepRule::Lie,
        StepRule::DriftCorrected,
        StepRule::Bounded,
        StepRule::DormandPrince,
    ];
    let params = DynamicsParams {
        model,
        alpha_m_per_n_s: number(bytes, 0.1)?,
        beta_per_n2_s: number(bytes, 10.0)?,
        rule: *bytes.choose(&rules)?,
        along: *bytes.choose(&[MotionDirection::InitialNormal, MotionDirection::Force])?,
        take_out_rigid_offset: bytes.arbitrary()?,
    };
    let Ok(dynamics) = FaceDynamics::new(params) else {
        return Ok(());
    };
    let normal = vector(bytes, 1.0)?;
    let normal = if bytes.arbitrary()? {
        normal
    } else {
        normal.try_normalize(1e-9).unwrap_or(Vector3::z())
    };
    let face = FaceState {
        b: Point3::from(vector(bytes, 0.01)?),
        n: normal,
    };
    let (p, force, dt) = (
        Point3::from(vector(bytes, 0.01)?),
        vector(bytes, 5.0)?,
        number(bytes, 0.01)?,
    );
    if let Ok(FaceState { b, n }) = dynamics.step(&face, &p, &force, dt) {
        assert!(
            b.iter().all(|x| x.is_finite()) && (n.norm() - 1.0).abs() < 1e-6,
            "{params:?} {b:?} {n:?}"
        );
    }
    Ok(())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = step(&mut Unstructured::new(data));
}
