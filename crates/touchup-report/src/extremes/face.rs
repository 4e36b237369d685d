//! Extremes of one face and one held sample.

use nalgebra::{Point3, Vector3};

use super::case::{CaseOutcome, Extreme, refused};
use touchup_method::haptic::{
    DynamicsError, DynamicsParams, FaceDynamics, FaceState, MotionDirection,
};

/// The paper's h_min, m, and f_max, N, and α, m/(N·s), and δ.
const H_MIN: f64 = 0.5e-3;
const F_MAX: f64 = 10.0;
const ALPHA: f64 = 0.1;
const DELTA: f64 = 5.0;
const UP: FaceState = FaceState {
    b: Point3::new(0.0, 0.0, 0.0),
    n: Vector3::new(0.0, 0.0, 1.0),
};

fn robust() -> DynamicsParams {
    DynamicsParams::default()
}

fn paper() -> DynamicsParams {
    DynamicsParams {
        along: MotionDirection::InitialNormal,
        take_out_rigid_offset: false,
        ..DynamicsParams::default()
    }
}

type StepResult = Result<FaceState, DynamicsError>;

/// One step of a face that looks up, with the tip `h` above it.
fn step(params: DynamicsParams, h: f64, force: [f64; 3], dt: f64) -> StepResult {
    FaceDynamics::new(params)?.step(&UP, &Point3::new(0.0, 0.0, h), &force.into(), dt)
}

/// One such step under a force along the normal.
fn pressed(params: DynamicsParams, h: f64, force: f64, dt: f64) -> StepResult {
    step(params, h, [0.0, 0.0, force], dt)
}

/// Outcome in words, with a test of the final state.
fn outcome(
    stepped: StepResult,
    is_right: impl Fn(&FaceState) -> bool,
) -> CaseOutcome<DynamicsError> {
    let face = stepped?;
    let words = format!(
        "b at {:.4e} m along the normal, normal turned by {:.1e} rad",
        face.b.z,
        turned(&face)
    );
    Ok((words, is_right(&face)))
}

/// Outcome of a face that should come to `z` along its first normal.
fn comes_to(stepped: StepResult, z: f64, tolerance: f64) -> CaseOutcome<DynamicsError> {
    outcome(stepped, |face| near(face.b.z, z, tolerance))
}

fn turned(face: &FaceState) -> f64 {
    face.n.cross(&UP.n).norm().atan2(face.n.dot(&UP.n))
}

fn near(value: f64, expected: f64, tolerance: f64) -> bool {
    (value - expected).abs() <= tolerance
}

pub(super) fn rows() -> Vec<Extreme> {
    [refusals(), forces_and_depths(), times_and_places()].concat()
}

fn refusals() -> Vec<Extreme> {
    let is_not_finite = |error: &DynamicsError| matches!(error, DynamicsError::NotFinite { .. });
    let why = "a refusal that names it: a NaN or an infinity that is let in never goes away";
    let no_normal = FaceState {
        n: Vector3::zeros(),
        ..UP
    };
    let no_normal = FaceDynamics::new(robust()).and_then(|dynamics| {
        dynamics.step(
            &no_normal,
            &Point3::new(0.0, 0.0, 1e-3),
            &(2.0 * UP.n),
            1e-3,
        )
    });
    vec![
        Extreme::fed("a force with a NaN").should(why).gave(refused(
            step(robust(), 1e-3, [0.0, f64::NAN, 1.0], 1e-3),
            is_not_finite,
        )),
        Extreme::fed("a tip at infinity").should(why).gave(refused(
            pressed(robust(), f64::INFINITY, 2.0, 1e-3),
            is_not_finite,
        )),
        Extreme::fed("a face without a normal")
            .should("a refusal: without a direction there is nothing to move along")
            .gave(refused(no_normal, |error| {
                matches!(error, DynamicsError::NotUnit { .. })
            })),
        Extreme::fed("a step of -1 ms")
            .should("a refusal: time does not run backward")
            .gave(refused(pressed(robust(), 1e-3, 2.0, -1e-3), |error| {
                matches!(error, DynamicsError::BadTimeStep { .. })
            })),
    ]
}

fn forces_and_depths() -> Vec<Extreme> {
    // u + e^u grows as T: METHOD's closed form for no force, solved by fixed-point iteration of ln
    let grown = 7.0 + 7f64.exp() + ALPHA * F_MAX * 1.0 / H_MIN;
    let u = (0..50).fold(8.0, |u: f64, _| (grown - u).ln());
    let pushed = -(u - 7.0) * H_MIN;
    let turning = DynamicsParams {
        alpha_m_per_n_s: 0.0,
        ..paper()
    };
    let far = 1e9 * H_MIN;
    vec![
        Extreme::fed("no force, tip 1 mm above the face, 1 s, rule as printed")
            .should(
                "the face flees by 0.52 mm: f(0) is not 0 and u + e^u grows with time; only a contact gate \
                 prevents it",
            )
            .gave(outcome(pressed(paper(), 1e-3, 0.0, 1.0), |face| {
                near(face.b.z, pushed, 1e-12) && near(pushed, -0.52e-3, 0.5e-5)
            })),
        Extreme::fed("12 N at f_max 10 N, tip 1 mm above, robust, 1000 s")
            .should("the face comes to the tip and stays: a force without an equilibrium is clamped")
            .gave(comes_to(pressed(robust(), 1e-3, 12.0, 1e3), 1e-3, 1e-12)),
        Extreme::fed("12 N at f_max 10 N, rule as printed, deep inside, 1 s")
            .should("it runs away at alpha (12 N - 10 N) = 0.2 m/s: Eq 6 has no rest point there")
            .gave(comes_to(pressed(paper(), -60.0 * H_MIN, 12.0, 1.0), 0.2, 1e-12)),
        Extreme::fed("1e7 N, tip 1 mm above, robust, 1000 s")
            .should("the face comes to the tip, not beyond: how hard it is pressed says nothing about where")
            .gave(comes_to(pressed(robust(), 1e-3, 1e7, 1e3), 1e-3, 1e-12)),
        Extreme::fed("2 N against the normal, tip on the face, robust, 1 s")
            .should(
                "finite, and not turned: exactly opposite has no direction to turn to; a refiner lets no such \
                 force act on the face",
            )
            .gave(outcome(pressed(robust(), 0.0, -2.0, 1.0), |face| face.b.z.is_finite() && turned(face) == 0.0)),
        Extreme::fed("2 N exactly against the normal, deep inside, 1e9 s, only turning")
            .should("not turned: dn/dt is zero there, though it is no stable rest")
            .gave(outcome(pressed(turning, -1e-2, -2.0, 1e9), |face| face.n == UP.n && face.b == UP.b)),
        Extreme::fed("a force of 5e-324 N, the smallest there is, tip on the face")
            .should("at rest to rounding: the direction is kept, the size is no force at all")
            .gave(outcome(pressed(robust(), 0.0, 5e-324, 1e-3), |face| {
                near(face.b.z, 0.0, 1e-18) && turned(face) == 0.0
            })),
        Extreme::fed("h/h_min = +1e9, 2 N, 1 ms")
            .should("alpha F dt = 0.2 mm towards the tip: nothing is expected that far outside")
            .gave(comes_to(pressed(paper(), far, 2.0, 1e-3), ALPHA * 2.0 * 1e-3, 1e-16)),
        Extreme::fed("h/h_min = -1e9, 2 N, 1 ms")
            .should("alpha (F - f_max) dt = -0.8 mm: all of f_max is expected that deep")
            .gave(comes_to(pressed(paper(), -far, 2.0, 1e-3), ALPHA * (2.0 - F_MAX) * 1e-3, 1e-16)),
        Extreme::fed("a depth of 5e-324 m, 2 N, robust")
            .should("at rest to rounding: that is on the surface")
            .gave(comes_to(pressed(robust(), 5e-324, 2.0, 1e-3), 0.0, 1e-17)),
    ]
}

fn times_and_places() -> Vec<Extreme> {
    let rest = H_MIN * (DELTA - 4f64.ln());
    let is_at_rest = |face: &FaceState| near(face.b.z, rest, 1e-16);
    let too_long = pressed(paper(), 0.0, 2.0, 1e303);
    vec![
        Extreme::fed("a step of 0 s")
            .should("the same bits: no time, no change")
            .gave(outcome(step(robust(), 1e-3, [1.0, 0.0, 2.0], 0.0), |face| *face == UP)),
        Extreme::fed("a step of 5e-324 s").should("at rest: less than a rounding happens").gave(comes_to(
            pressed(robust(), 1e-3, 2.0, 5e-324),
            0.0,
            1e-300,
        )),
        Extreme::fed("a step of 1e12 s, 2 N, rule as printed")
            .should("at the rest point h_min (delta - ln(f_max/F - 1)) = 1.81 mm, the bias of a rigid contact")
            .gave(outcome(pressed(paper(), 0.0, 2.0, 1e12), is_at_rest)),
        Extreme::fed("a step of 1e303 s")
            .should("a refusal, or the rest point: the scaled time is at the end of the numbers")
            .gave(if too_long.is_ok() {
                outcome(too_long, is_at_rest)
            } else {
                refused(too_long, |error| matches!(error, DynamicsError::NotFinite { .. }))
            }),
        Extreme::fed("a face 1e6 m from the origin")
            .should("the same step as at the origin, but for roundings of a coordinate of 1e6 m, 1e-10 m each")
            .gave(far_away()),
    ]
}

fn far_away() -> CaseOutcome<DynamicsError> {
    let far = 1e6;
    let from = |shift: Vector3<f64>| -> Result<Point3<f64>, DynamicsError> {
        let face = FaceState {
            b: UP.b + shift,
            ..UP
        };
        let tip = Point3::new(1e-4, 0.0, 1e-3) + shift;
        Ok(FaceDynamics::new(robust())?
            .step(&face, &tip, &Vector3::new(0.5, 0.3, 2.0), 5e-3)?
            .b
            - shift)
    };
    let off = (from(Vector3::new(far, -far, far))? - from(Vector3::zeros())?).norm();
    Ok((
        format!("{off:.1e} m from the same step at the origin"),
        off <= 8.0 * far * f64::EPSILON,
    ))
}
