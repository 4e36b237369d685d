//! Extremes of one face and one held sample.

use nalgebra::{Point3, Vector3};

use super::{CaseOutcome, Extreme, extreme};
use touchup_core::haptic::{Along, DynamicsError, DynamicsParams, FaceDynamics, FaceState};

/// The paper's h_min, m, and f_max, N, and α, m/(N·s), and δ.
const H_MIN: f64 = 0.5e-3;
const F_MAX: f64 = 10.0;
const ALPHA: f64 = 0.1;
const DELTA: f64 = 5.0;
const UP: FaceState = FaceState { b: Point3::new(0.0, 0.0, 0.0), n: Vector3::new(0.0, 0.0, 1.0) };

fn robust() -> DynamicsParams {
    DynamicsParams::default()
}

fn paper() -> DynamicsParams {
    DynamicsParams { along: Along::InitialNormal, take_out_rigid_offset: false, ..DynamicsParams::default() }
}

type Stepped = Result<FaceState, DynamicsError>;

fn step(params: DynamicsParams, p: Point3<f64>, force: Vector3<f64>, dt: f64) -> Stepped {
    FaceDynamics::new(params)?.step(&UP, &p, &force, dt)
}

fn at(h: f64) -> Point3<f64> {
    Point3::new(0.0, 0.0, h)
}

fn press(force: f64) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, force)
}

/// In words, with what must hold of it.
fn outcome(stepped: Stepped, is_right: impl Fn(&FaceState) -> bool) -> CaseOutcome {
    match stepped {
        Ok(face) => (
            format!("b at {:.4e} m along the normal, normal turned by {:.1e} rad", face.b.z, turned(&face)),
            is_right(&face),
        ),
        Err(error) => (format!("refused: {error}"), false),
    }
}

fn refused(stepped: Stepped, is_right: impl Fn(&DynamicsError) -> bool) -> CaseOutcome {
    match stepped {
        Ok(face) => (format!("taken: b at {} m", face.b.z), false),
        Err(error) => (format!("refused: {error}"), is_right(&error)),
    }
}

fn turned(face: &FaceState) -> f64 {
    face.n.cross(&UP.n).norm().atan2(face.n.dot(&UP.n))
}

fn near(value: f64, expected: f64, tolerance: f64) -> bool {
    (value - expected).abs() <= tolerance
}

pub(super) fn rows() -> Vec<Extreme> {
    [refusals(), forces(), depths(), times(), places()].concat()
}

fn refusals() -> Vec<Extreme> {
    let is_not_finite = |error: &DynamicsError| matches!(error, DynamicsError::NotFinite { .. });
    let why = "a refusal that names it: a NaN or an infinity that is let in never goes away";
    let nan = step(robust(), at(1e-3), Vector3::new(0.0, f64::NAN, 1.0), 1e-3);
    let infinite = step(robust(), at(f64::INFINITY), press(2.0), 1e-3);
    let no_normal = FaceDynamics::new(robust())
        .and_then(|dynamics| dynamics.step(&FaceState { n: Vector3::zeros(), ..UP }, &at(1e-3), &press(2.0), 1e-3));
    let backward = step(robust(), at(1e-3), press(2.0), -1e-3);
    vec![
        extreme("a force with a NaN", why, refused(nan, is_not_finite)),
        extreme("a tip at infinity", why, refused(infinite, is_not_finite)),
        extreme(
            "a face without a normal",
            "a refusal: without a direction there is nothing to move along",
            refused(no_normal, |error| matches!(error, DynamicsError::NotUnit { .. })),
        ),
        extreme(
            "a step of -1 ms",
            "a refusal: time does not run backward",
            refused(backward, |error| matches!(error, DynamicsError::BadTimeStep { .. })),
        ),
    ]
}

fn forces() -> Vec<Extreme> {
    // u + e^u grows as T: METHOD's closed form for no force, solved by fixed-point iteration of ln
    let grown = 7.0 + 7f64.exp() + ALPHA * F_MAX * 1.0 / H_MIN;
    let u = (0..50).fold(8.0, |u: f64, _| (grown - u).ln());
    let pushed = -(u - 7.0) * H_MIN;
    let hovering = step(paper(), at(1e-3), Vector3::zeros(), 1.0);
    let clamped = step(robust(), at(1e-3), press(12.0), 1e3);
    let runaway = step(paper(), at(-60.0 * H_MIN), press(12.0), 1.0);
    let huge = step(robust(), at(1e-3), press(1e7), 1e3);
    let against = step(robust(), at(0.0), press(-2.0), 1.0);
    let opposite = step(DynamicsParams { alpha_m_per_n_s: 0.0, ..paper() }, at(-1e-2), press(-2.0), 1e9);
    let denormal = step(robust(), at(0.0), press(5e-324), 1e-3);
    vec![
        extreme(
            "no force, tip 1 mm above the face, 1 s, rule as printed",
            "the face flees by 0.52 mm: f(0) is not 0 and u + e^u grows with time; only a contact gate prevents it",
            outcome(hovering, |face| near(face.b.z, pushed, 1e-12) && near(pushed, -0.52e-3, 0.5e-5)),
        ),
        extreme(
            "12 N at f_max 10 N, tip 1 mm above, robust, 1000 s",
            "the face comes to the tip and stays: a force without an equilibrium is clamped",
            outcome(clamped, |face| near(face.b.z, 1e-3, 1e-12)),
        ),
        extreme(
            "12 N at f_max 10 N, rule as printed, deep inside, 1 s",
            "it runs away at alpha (12 N - 10 N) = 0.2 m/s: Eq 6 has no rest point there",
            outcome(runaway, |face| near(face.b.z, 0.2, 1e-12)),
        ),
        extreme(
            "1e7 N, tip 1 mm above, robust, 1000 s",
            "the face comes to the tip, not beyond: how hard it is pressed says nothing about where",
            outcome(huge, |face| near(face.b.z, 1e-3, 1e-12)),
        ),
        extreme(
            "2 N against the normal, tip on the face, robust, 1 s",
            "finite, and not turned: exactly opposite has no direction to turn to; a refiner lets no such force act on the face",
            outcome(against, |face| face.b.z.is_finite() && turned(face) == 0.0),
        ),
        extreme(
            "2 N exactly against the normal, deep inside, 1e9 s, only turning",
            "not turned: dn/dt is zero there, though it is no stable rest",
            outcome(opposite, |face| face.n == UP.n && face.b == UP.b),
        ),
        extreme(
            "a force of 5e-324 N, the smallest there is, tip on the face",
            "at rest to rounding: the direction is kept, the size is no force at all",
            outcome(denormal, |face| near(face.b.z, 0.0, 1e-18) && turned(face) == 0.0),
        ),
    ]
}

fn depths() -> Vec<Extreme> {
    let far = 1e9 * H_MIN;
    let outside = step(paper(), at(far), press(2.0), 1e-3);
    let inside = step(paper(), at(-far), press(2.0), 1e-3);
    let tiny = step(robust(), at(5e-324), press(2.0), 1e-3);
    vec![
        extreme(
            "h/h_min = +1e9, 2 N, 1 ms",
            "alpha F dt = 0.2 mm towards the tip: nothing is expected that far outside",
            outcome(outside, |face| near(face.b.z, ALPHA * 2.0 * 1e-3, 1e-16)),
        ),
        extreme(
            "h/h_min = -1e9, 2 N, 1 ms",
            "alpha (F - f_max) dt = -0.8 mm: all of f_max is expected that deep",
            outcome(inside, |face| near(face.b.z, ALPHA * (2.0 - F_MAX) * 1e-3, 1e-16)),
        ),
        extreme(
            "a depth of 5e-324 m, 2 N, robust",
            "at rest to rounding: that is on the surface",
            outcome(tiny, |face| near(face.b.z, 0.0, 1e-17)),
        ),
    ]
}

fn times() -> Vec<Extreme> {
    let rest = H_MIN * (DELTA - 4f64.ln());
    let nothing = step(robust(), at(1e-3), Vector3::new(1.0, 0.0, 2.0), 0.0);
    let denormal = step(robust(), at(1e-3), press(2.0), 5e-324);
    let long = step(paper(), at(0.0), press(2.0), 1e12);
    let too_long = step(paper(), at(0.0), press(2.0), 1e303);
    vec![
        extreme("a step of 0 s", "the same bits: no time, no change", outcome(nothing, |face| *face == UP)),
        extreme(
            "a step of 5e-324 s",
            "at rest: less than a rounding happens",
            outcome(denormal, |face| near(face.b.z, 0.0, 1e-300)),
        ),
        extreme(
            "a step of 1e12 s, 2 N, rule as printed",
            "at the rest point h_min (delta - ln(f_max/F - 1)) = 1.81 mm, the bias of a rigid contact",
            outcome(long, |face| near(face.b.z, rest, 1e-16)),
        ),
        extreme(
            "a step of 1e303 s",
            "a refusal, or the rest point: the scaled time is at the end of the numbers",
            match too_long {
                Ok(face) => (format!("b at {:e} m", face.b.z), near(face.b.z, rest, 1e-16)),
                Err(error) => (format!("refused: {error}"), matches!(error, DynamicsError::NotFinite { .. })),
            },
        ),
    ]
}

fn places() -> Vec<Extreme> {
    let far = 1e6;
    let shift = Vector3::new(far, -far, far);
    let force = Vector3::new(0.5, 0.3, 2.0);
    let here = step(robust(), Point3::new(1e-4, 0.0, 1e-3), force, 5e-3);
    let there = FaceDynamics::new(robust()).and_then(|dynamics| {
        let face = FaceState { b: UP.b + shift, ..UP };
        dynamics.step(&face, &(Point3::new(1e-4, 0.0, 1e-3) + shift), &force, 5e-3)
    });
    let outcome = match (here, there) {
        (Ok(here), Ok(there)) => {
            let off = (there.b - shift - here.b).norm();
            (format!("{off:.1e} m from the same step at the origin"), off <= 8.0 * far * f64::EPSILON)
        }
        (Err(error), _) | (_, Err(error)) => (format!("refused: {error}"), false),
    };
    vec![extreme(
        "a face 1e6 m from the origin",
        "the same step as at the origin, but for roundings of a coordinate of 1e6 m, 1e-10 m each",
        outcome,
    )]
}
