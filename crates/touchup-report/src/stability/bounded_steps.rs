//! The error-bounded step against the solution in numbers of 32 digits.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::face_runs::log_uniform;
use crate::reference::{HeldFace, Reference};
use touchup_method::haptic::RELATIVE_ERROR;
use touchup_method::haptic::{
    ContactModel, DynamicsError, DynamicsParams, FaceDynamics, FaceState, MotionDirection,
    SigmoidParams, StepRule,
};

/// Roundings of |F| and of the tip's distance, beyond the step's control.
const ROUNDINGS: f64 = 8.0 * f64::EPSILON;

/// The largest errors over the bound in one group of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundedStepError {
    /// contact model and direction of motion
    pub name: String,
    /// cases compared
    pub cases: usize,
    /// unnecessary refusals by the step
    pub refused: usize,
    /// refusals because roundings decide the direction of the face
    pub undetermined: usize,
    /// without a reference: the path leaves the range of numbers
    pub without_reference: usize,
    /// cases over the bound, judged again with the effect of the input's roundings added
    pub ill_conditioned: usize,
    /// error of the position, over the bound
    pub position: f64,
    /// error of the normal, over the bound
    pub normal: f64,
    /// case of the larger error
    pub worst: String,
}

/// All groups, `cases` in each.
pub fn bounded_steps(seed: u64, cases: usize) -> Vec<BoundedStepError> {
    let rng = &mut Pcg64::seed_from_u64(seed);
    let groups = [
        ("sigmoid, along the force", false, MotionDirection::Force),
        (
            "sigmoid, along n*(0)",
            false,
            MotionDirection::InitialNormal,
        ),
        ("spring, along the force", true, MotionDirection::Force),
        ("spring, along n*(0)", true, MotionDirection::InitialNormal),
    ];
    groups
        .map(|(name, is_spring, along)| group(rng, name, is_spring, along, cases))
        .into()
}

fn group(
    rng: &mut Pcg64,
    name: &str,
    is_spring: bool,
    along: MotionDirection,
    cases: usize,
) -> BoundedStepError {
    let mut found = BoundedStepError {
        name: name.to_owned(),
        cases: 0,
        refused: 0,
        undetermined: 0,
        without_reference: 0,
        ill_conditioned: 0,
        position: 0.0,
        normal: 0.0,
        worst: String::new(),
    };
    for _ in 0..cases {
        let held = draw(rng, is_spring, along);
        let Some(reference) = held.reference() else {
            found.without_reference += 1;
            continue;
        };
        found.cases += 1;
        let face = match stepped(&held) {
            Ok(face) => face,
            Err(DynamicsError::Undetermined { .. }) => {
                found.undetermined += 1;
                continue;
            }
            Err(error) => {
                found.refused += 1;
                found.worst = format!("refused: {error}, {held:?}");
                continue;
            }
        };
        let mut errors = errors(
            &face,
            &reference,
            [RELATIVE_ERROR * reference.farthest_m, RELATIVE_ERROR],
        );
        if errors.iter().any(|error| *error > 1.0) {
            found.ill_conditioned += 1;
            errors = errors_beside_roundings(&held, &face, &reference);
        }
        if errors[0].max(errors[1]) > found.position.max(found.normal) {
            found.worst = format!("{held:?}");
        }
        found.position = found.position.max(errors[0]);
        found.normal = found.normal.max(errors[1]);
    }
    found
}

/// A stiff sample: time constants of the position down to a billionth of it, of the normal down to
/// a millionth, the force at any angle.
fn draw(rng: &mut Pcg64, is_spring: bool, along: MotionDirection) -> HeldFace {
    let (h_min, f_max) = (log_uniform(rng, -9.0..-3.0), log_uniform(rng, -2.0..3.0));
    let dt = log_uniform(rng, -4.0..0.0);
    let model = if is_spring {
        ContactModel::Spring {
            stiffness_n_per_m: f_max / h_min,
        }
    } else {
        ContactModel::Sigmoid(SigmoidParams {
            f_max,
            h_min,
            delta: 5.0,
        })
    };
    // a pulling spring turns the face away from the force without end: milder
    let turning = if is_spring { -3.0..2.0 } else { -3.0..6.0 };
    let stiffness = if is_spring { -1.0..5.0 } else { -1.0..9.0 };
    let params = DynamicsParams {
        model,
        alpha_m_per_n_s: log_uniform(rng, stiffness) * h_min / (f_max * dt),
        beta_per_n2_s: log_uniform(rng, turning) / (f_max * f_max * dt),
        rule: StepRule::Bounded,
        along,
        take_out_rigid_offset: false,
    };
    // a spring along n*(0) with a face turned beyond a right angle diverges exponentially
    let widest = if is_spring { 1.3 } else { 2.8 };
    let tilt: f64 = rng.random_range(1e-3..widest);
    let depth = if is_spring {
        rng.random_range(-3.0..0.5)
    } else {
        rng.random_range(-25.0..15.0)
    };
    let beside = log_uniform(rng, -2.0..1.5) * rng.random_range(-1.0..1.0);
    let arm = h_min * Vector3::new(beside, 0.3 * beside, depth);
    let magnitude = f_max
        * if rng.random_bool(0.9) {
            rng.random_range(0.01..0.9)
        } else {
            rng.random_range(1.1..3.0)
        };
    let axis = Unit::new_normalize(Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
    let turn = UnitQuaternion::from_axis_angle(&axis, rng.random_range(0.0..3.0));
    HeldFace {
        params,
        normal: turn * Vector3::z(),
        arm: turn * arm,
        force: turn * Vector3::new(tilt.sin(), 0.0, tilt.cos()) * magnitude,
        dt_s: dt,
    }
}

fn stepped(held: &HeldFace) -> Result<FaceState, DynamicsError> {
    let dynamics = FaceDynamics::new(held.params)?;
    let face = FaceState {
        b: Point3::origin(),
        n: held.normal,
    };
    dynamics.step(&face, &Point3::from(held.arm), &held.force, held.dt_s)
}

/// Errors of position and normal, over the allowed ones.
fn errors(face: &FaceState, reference: &Reference, allowed: [f64; 2]) -> [f64; 2] {
    [
        (face.b - reference.face.b).norm() / allowed[0],
        (face.n - reference.face.n).norm() / allowed[1],
    ]
}

/// Errors over the bound plus the effect of roundings of |F| and of the tip's place on the
/// reference.
fn errors_beside_roundings(held: &HeldFace, face: &FaceState, reference: &Reference) -> [f64; 2] {
    let away = held.normal * (held.arm.norm() + 5.0 * length_scale(&held.params.model)) * ROUNDINGS;
    let moved = [
        HeldFace {
            force: held.force * (1.0 + ROUNDINGS),
            ..*held
        },
        HeldFace {
            arm: held.arm + away,
            ..*held
        },
    ];
    let mut allowed = [RELATIVE_ERROR * reference.farthest_m, RELATIVE_ERROR];
    for other in moved.iter().filter_map(HeldFace::reference) {
        allowed[0] += (other.face.b - reference.face.b).norm();
        allowed[1] += (other.face.n - reference.face.n).norm();
    }
    errors(face, reference, allowed)
}

/// Width of a sigmoid, m, whose shift shares a sum with the distance.
fn length_scale(model: &ContactModel) -> f64 {
    match *model {
        ContactModel::Sigmoid(curve) => curve.h_min,
        ContactModel::Spring { .. } => 0.0,
    }
}
