//! The face dynamics against closed forms, laws and the paper's one-face experiment.
//! `tests/python/test_step.py` compares numbers to 50 digits.

use std::f64::consts::PI;

use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;
use touchup::haptic::{
    ContactModel, DynamicsError, DynamicsParams, FaceDynamics, FaceState, MotionDirection,
    SigmoidParams, StepRule,
};
use touchup::sim::coupled::GuidedStylus;

use super::counted::{Shown, tried};

const H_MIN: f64 = 0.5e-3;
const F_MAX: f64 = 10.0;
const SIGMOID: ContactModel = ContactModel::Sigmoid(SigmoidParams {
    f_max: F_MAX,
    h_min: H_MIN,
    delta: 5.0,
});
const UP: FaceState = FaceState {
    b: Point3::new(0.0, 0.0, 0.0),
    n: Vector3::new(0.0, 0.0, 1.0),
};

fn paper(alpha: f64, beta: f64) -> DynamicsParams {
    DynamicsParams {
        model: SIGMOID,
        alpha_m_per_n_s: alpha,
        beta_per_n2_s: beta,
        along: MotionDirection::InitialNormal,
        take_out_rigid_offset: false,
        ..DynamicsParams::default()
    }
}

fn step(
    params: DynamicsParams,
    face: &FaceState,
    p: Point3<f64>,
    force: Vector3<f64>,
    dt: f64,
) -> FaceState {
    FaceDynamics::new(params)
        .unwrap()
        .step(face, &p, &force, dt)
        .unwrap()
}

fn above(u: f64) -> Point3<f64> {
    Point3::new(0.0, 0.0, H_MIN * (u - 5.0))
}

fn press(force_n: f64) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, force_n)
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

#[track_caller]
fn assert_near(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{value} is not {expected} within {tolerance}"
    );
}

#[test]
fn without_force_u_plus_its_exponential_grows_with_time() {
    let params = paper(0.1, 0.0);
    for (from, to) in [
        (-30.0, -29.0),
        (-3.0, 2.0),
        (0.0, 0.001),
        (1.0, 6.0),
        (8.0, 8.1),
    ] {
        let (from, to): (f64, f64) = (from, to);
        let scaled = to + to.exp() - from - from.exp();
        let dt = scaled * H_MIN / (0.1 * F_MAX);
        let moved = step(params, &UP, above(from), Vector3::zeros(), dt).b.z;
        // dt carries the rounding of e^u, p that of 5
        assert_near(moved / -H_MIN, to - from, 1e-13 * (1.0 + to - from));
    }
}

#[test]
fn at_half_of_f_max_the_flow_is_a_hyperbolic_sine() {
    // c = 1/2: du/dT = −tanh(u/2)/2, so sinh(u/2) falls by e^(−T/4)
    let (from, scaled): (f64, f64) = (3.0, 2.5);
    let to = 2.0 * ((from / 2.0).sinh() * (-scaled / 4.0).exp()).asinh();
    let dt = scaled * H_MIN / (0.1 * F_MAX);
    for sign in [1.0, -1.0] {
        let moved = step(paper(0.1, 0.0), &UP, above(sign * from), press(5.0), dt)
            .b
            .z;
        assert_near(moved / -H_MIN, sign * (to - from), 1e-14);
    }
}

#[test]
fn rigid_contact_leaves_the_paper_off_by_1_81_mm_and_the_robust_rule_on_the_surface() {
    // h_min (δ − ln(f_max/F − 1)) at 2 N
    let bias = 0.5e-3 * (5.0 - 4f64.ln());
    assert_near(bias, 1.81e-3, 5e-6);
    let tip = Point3::origin();
    assert_near(
        step(paper(0.1, 0.1), &UP, tip, press(2.0), 1e6).b.z,
        bias,
        1e-17,
    );
    assert_near(SIGMOID.rigid_offset(2.0), -bias, 1e-17);
    let robust = DynamicsParams {
        take_out_rigid_offset: true,
        ..paper(0.1, 0.1)
    };
    for force_n in [0.0, 0.01, 2.0, 9.9, 10.0, 11.0, 1e9] {
        let low = FaceState {
            b: Point3::new(0.0, 0.0, -1e-3),
            ..UP
        };
        assert_near(step(robust, &low, tip, press(force_n), 1e6).b.z, 0.0, 1e-17);
    }
    assert!(SIGMOID.rigid_offset(1e9).is_finite());
}

#[test]
fn beyond_f_max_the_face_escapes_at_constant_speed() {
    // at u = −60 the face answers f_max to rounding: 12 N drive it at α · 2 N
    let params = paper(0.1, 0.0);
    assert_near(
        step(params, &UP, above(-60.0), press(12.0), 3.0).b.z,
        0.1 * 2.0 * 3.0,
        1e-15,
    );
    // at f_max exactly it creeps: e^−u grows as T
    let scaled = 100.0;
    let dt = scaled * H_MIN / (0.1 * F_MAX);
    let to = -f64::ln(1.0 + scaled);
    let slow = step(params, &UP, above(0.0), press(F_MAX), dt).b.z / -H_MIN;
    // −u + e^−u = 1 + T
    assert_near(-slow + (-slow).exp(), 1.0 + scaled, 1e-12);
    assert!(slow > to);
}

#[test]
fn a_pull_many_times_f_max_moves_the_face_away_at_its_own_rate() {
    // u grows from 13.85 by |c| T = 963 and by less than e^−13.85 T more
    let (u, c, scaled): (f64, f64, f64) = (13.85, -62.4, 15.43);
    let moved = step(
        paper(0.1, 0.0),
        &UP,
        above(u),
        press(c * F_MAX),
        scaled * H_MIN / (0.1 * F_MAX),
    )
    .b
    .z / -H_MIN;
    let more = moved + c * scaled;
    // ∫ e^−u dT with u growing at |c|; six roundings of 963
    assert_near(more, (-u).exp() / -c, 6.0 * 963.0 * f64::EPSILON);
}

#[test]
fn a_spring_halves_its_distance_to_rest() {
    let params = DynamicsParams {
        model: ContactModel::Spring {
            stiffness_n_per_m: 1e4,
        },
        ..paper(0.1, 0.0)
    };
    // rest at h = −F/k = −0.2 mm, from h = 1 mm; half after ln 2/(α k)
    let moved = step(
        params,
        &UP,
        Point3::new(0.0, 0.0, 1e-3),
        press(2.0),
        2f64.ln() / 1e3,
    )
    .b
    .z;
    assert_near(moved, 0.6e-3, 1e-18);
}

#[test]
fn half_the_tangent_of_half_the_angle_after_ln_2() {
    let params = paper(0.0, 0.1);
    for tilt in [1e-9, 0.3, 1.5, 3.1, PI - 1e-6] {
        let force = 2.0 * Vector3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
        let expected_force = SIGMOID.force(-2e-3);
        let dt = 2f64.ln() / (0.1 * 2.0 * expected_force);
        let turned = step(params, &UP, Point3::new(0.0, 0.0, -2e-3), force, dt).n;
        let left = 2.0 * (0.5 * (tilt / 2.0).tan()).atan();
        assert_near(angle(&turned, &force), left, 4e-16 + 1e-15 / (PI - tilt));
        assert!(turned.y == 0.0);
    }
}

#[test]
fn opposite_force_and_no_force_do_not_turn_and_a_long_one_turns_fully() {
    let params = paper(0.0, 1e3);
    let deep = Point3::new(0.0, 0.0, -1.0);
    assert_eq!(step(params, &UP, deep, press(-2.0), 1e9).n, UP.n);
    assert_eq!(step(params, &UP, deep, Vector3::zeros(), 1e9).n, UP.n);
    let nearly = Vector3::new(1e-12, 0.0, -1.0);
    assert_near(
        (step(params, &UP, deep, nearly, 1e9).n - nearly).norm(),
        0.0,
        1e-15,
    );
}

#[test]
fn bad_input_is_named() {
    let dynamics = FaceDynamics::new(paper(0.1, 0.1)).unwrap();
    let refused = |face: FaceState, p, force, dt| dynamics.step(&face, &p, &force, dt).unwrap_err();
    let nan = Vector3::new(0.0, f64::NAN, 0.0);
    assert_eq!(
        refused(UP, Point3::from(nan), press(1.0), 1.0),
        DynamicsError::NotFinite { what: "p" }
    );
    assert_eq!(
        refused(UP, Point3::origin(), nan, 1.0),
        DynamicsError::NotFinite { what: "force" }
    );
    assert_eq!(
        refused(
            FaceState { n: nan, ..UP },
            Point3::origin(),
            press(1.0),
            1.0
        ),
        DynamicsError::NotFinite { what: "n" }
    );
    assert_eq!(
        refused(
            FaceState {
                n: press(2.0),
                ..UP
            },
            Point3::origin(),
            press(1.0),
            1.0
        ),
        DynamicsError::NotUnit { length: 2.0 }
    );
    assert_eq!(
        refused(UP, Point3::origin(), press(1.0), -1.0),
        DynamicsError::BadTimeStep { dt_s: -1.0 }
    );
    let bad = |params| FaceDynamics::new(params).unwrap_err().to_string();
    assert!(bad(paper(-1.0, 0.1)).contains("alpha_m_per_n_s is -1"));
    assert!(
        bad(DynamicsParams {
            model: ContactModel::Spring {
                stiffness_n_per_m: 0.0
            },
            ..paper(0.1, 0.1)
        })
        .contains("k_n_per_m")
    );
}

#[test]
fn the_explicit_solver_gives_up_on_stiff_steps() {
    let params = DynamicsParams {
        rule: StepRule::DormandPrince,
        ..paper(1e6, 0.1)
    };
    let refused = FaceDynamics::new(params).unwrap().step(
        &UP,
        &above(0.0),
        &Vector3::new(1.0, 0.0, 2.0),
        1.0,
    );
    assert!(
        matches!(refused, Err(DynamicsError::Stiff { .. })),
        "{refused:?}"
    );
}

/// Distance in units of h_min plus angle after 40 ms in `steps` steps, against the tight explicit
/// solver.
fn error_after(rule: StepRule, along: MotionDirection, offset: bool, steps: u32) -> f64 {
    let params = DynamicsParams {
        rule,
        along,
        take_out_rigid_offset: offset,
        ..paper(0.05, 2.0)
    };
    let (p, force) = (
        Point3::new(0.3e-3, -0.2e-3, -0.5e-3),
        Vector3::new(0.9, -0.4, 2.0),
    );
    let reference = step(
        DynamicsParams {
            rule: StepRule::DormandPrince,
            ..params
        },
        &UP,
        p,
        force,
        0.0,
    );
    assert_eq!(reference, UP);
    let mut face = UP;
    // the direction a must stay that of the first step for the comparison: only `Force` is the same
    // ODE throughout
    for _ in 0..steps {
        face = step(params, &face, p, force, 0.04 / f64::from(steps));
    }
    let mut exact = UP;
    for _ in 0..4 {
        exact = step(
            DynamicsParams {
                rule: StepRule::DormandPrince,
                ..params
            },
            &exact,
            p,
            force,
            0.01,
        );
    }
    (face.b - exact.b).norm() / H_MIN + angle(&face.n, &exact.n)
}

#[test]
fn lie_is_first_order_and_corrected_second() {
    for offset in [false, true] {
        for (rule, order) in [(StepRule::Lie, 1.0), (StepRule::DriftCorrected, 2.0)] {
            let errors = [64, 128, 256]
                .map(|steps| error_after(rule, MotionDirection::Force, offset, steps));
            println!("{rule:?}, offset taken out: {offset}: {errors:?}");
            assert_near((errors[0] / errors[1]).log2(), order, 0.15);
            assert_near((errors[1] / errors[2]).log2(), order, 0.15);
        }
    }
}

#[test]
fn the_corrected_step_stays_accurate_when_stiff() {
    let model = ContactModel::Sigmoid(SigmoidParams {
        f_max: F_MAX,
        h_min: 1e-6,
        delta: 5.0,
    });
    let params = |rule| DynamicsParams {
        model,
        rule,
        along: MotionDirection::Force,
        ..paper(0.1, 0.1)
    };
    let (p, force) = (
        Point3::new(1e-3, 0.5e-3, -0.2e-3),
        Vector3::new(0.5, 0.3, 2.0),
    );
    let [lie, corrected, exact] = [
        StepRule::Lie,
        StepRule::DriftCorrected,
        StepRule::DormandPrince,
    ]
    .map(|r| step(params(r), &UP, p, force, 5e-3));
    let error = |face: &FaceState| (face.b - exact.b).norm();
    println!(
        "5 ms at h_min 1e-3 mm: lie {:.1e} m, corrected {:.1e} m",
        error(&lie),
        error(&corrected)
    );
    assert!(error(&corrected) < 1e-9 && error(&lie) > 1e-8);
}

fn unit() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0f64]
        .prop_map(Vector3::from)
        .prop_filter("too short to have a direction", |v| v.norm() > 0.1)
        .prop_map(|v| v.normalize())
}

fn params() -> impl Strategy<Value = DynamicsParams> {
    let rule = prop_oneof![Just(StepRule::Lie), Just(StepRule::DriftCorrected)];
    let along = prop_oneof![
        Just(MotionDirection::InitialNormal),
        Just(MotionDirection::Force)
    ];
    let model = prop_oneof![
        Just(SIGMOID),
        Just(ContactModel::Spring {
            stiffness_n_per_m: 1e3
        })
    ];
    (rule, along, model, any::<bool>()).prop_map(|(rule, along, model, take_out_rigid_offset)| {
        DynamicsParams {
            rule,
            along,
            model,
            take_out_rigid_offset,
            ..paper(0.1, 0.1)
        }
    })
}

fn nearby() -> impl Strategy<Value = Point3<f64>> {
    [-4e-3..4e-3, -4e-3..4e-3, -4e-3..4e-3f64].prop_map(Point3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rotating_everything_commutes(params in params(), n in unit(), p in nearby(), f in unit(), size in 0.0..15.0, turn in unit(), by in 0.0..3.0) {
        let face = FaceState { b: Point3::new(1e-3, 0.0, 2e-3), n };
        let turn = Rotation3::from_scaled_axis(by * turn);
        let after = step(params, &face, p, size * f, 5e-3);
        let turned = FaceState { b: turn * face.b, n: turn * n };
        let turned_after = step(params, &turned, turn * p, turn * (size * f), 5e-3);
        // an amplifying flow (f·n < 0) grows by at most e^(slope t) = e^5; coordinates of
        // millimetres, forces of 10 N
        prop_assert!((turn * after.b - turned_after.b).norm() < 1e-15);
        prop_assert!((turn * after.n - turned_after.n).norm() < 1e-12);
    }

    #[test]
    fn two_short_position_flows_are_one_long_one(params in params(), n in unit(), p in nearby(), f in unit(), size in 0.0..15.0, first in 0.0..0.01) {
        let params = DynamicsParams { beta_per_n2_s: 0.0, ..params };
        let face = FaceState { b: Point3::origin(), n };
        let twice = step(params, &step(params, &face, p, size * f, first), p, size * f, 0.01 - first);
        let once = step(params, &face, p, size * f, 0.01);
        // millimetres, and an amplification (f·n < 0) by at most e^5
        prop_assert!((twice.b - once.b).norm() <= 1e-14 * (1.0 + 10.0 * once.b.coords.norm()));
        prop_assert_eq!(twice.n, n);
    }

    #[test]
    fn two_short_rotations_are_one_long_one(n in unit(), f in unit(), size in 0.0..15.0, first in 0.0..10.0) {
        // the tip at b: h and with it the expected force stay while the face turns
        let params = paper(0.0, 0.1);
        let face = FaceState { b: Point3::origin(), n };
        let twice = step(params, &step(params, &face, face.b, size * f, first), face.b, size * f, 10.0 - first);
        let once = step(params, &face, face.b, size * f, 10.0);
        // turning away from −f amplifies roundings by up to 2/|n + f|
        prop_assert!((twice.n - once.n).norm() <= 4e-16 + 4e-15 / (n + f).norm());
        prop_assert_eq!(twice.b, face.b);
    }

    #[test]
    fn a_face_at_rest_stays(n in unit(), force_n in 0.01..9.9, beta in 0.0..1.0, dt in 0.0..1e3, rule in prop_oneof![Just(StepRule::Lie), Just(StepRule::DriftCorrected)]) {
        let params = DynamicsParams { rule, ..paper(0.1, beta) };
        let face = FaceState { b: Point3::origin(), n };
        let p = Point3::from(SIGMOID.distance(force_n) * n);
        let after = step(params, &face, p, force_n * n, dt);
        // h and δ meet at the size of δ (five roundings of h_min δ), and u is ln(1/c − 1) of a
        // rounded c (four)
        let c = force_n / F_MAX;
        prop_assert!(after.b.coords.norm() <= (5.0 * 5.0 + 4.0 / (c * (1.0 - c))) * H_MIN * f64::EPSILON);
        prop_assert!((after.n - n).norm() <= 4.0 * f64::EPSILON);
    }
}

/// Sizes of the quantities of a step: all numbers, by their powers of ten.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    /// h_min or the stiffness, f_max, α, β, time, force, distance
    exponents: [f64; 7],
    delta: f64,
    spring: bool,
}

fn sizes(reach: f64) -> impl Strategy<Value = Sizes> {
    let powers = prop::array::uniform7(-1.0..1.0f64)
        .prop_map(move |shares| shares.map(|x| (reach * x).min(300.0)));
    (powers, -1e9..1e9, any::<bool>()).prop_map(|(exponents, delta, spring)| Sizes {
        exponents,
        delta,
        spring,
    })
}

/// Finite and of length 1, turned in the plane of n and F, and no farther than α (|F| + f_max) t
/// for a sigmoid with its largest force f_max.
#[expect(clippy::too_many_lines)]
fn check_extremes(
    sizes: &Sizes,
    [n, f, side]: [Vector3<f64>; 3],
    params: DynamicsParams,
    may_overflow: bool,
) -> Shown {
    let Sizes {
        exponents,
        delta,
        spring,
    } = *sizes;
    let [
        h_min_m,
        f_max_n,
        alpha_m_per_n_s,
        beta_per_n2_s,
        dt,
        size,
        far,
    ] = exponents.map(|x| 10f64.powf(x));
    let model = if spring {
        ContactModel::Spring {
            stiffness_n_per_m: h_min_m,
        }
    } else {
        ContactModel::Sigmoid(SigmoidParams {
            f_max: f_max_n,
            h_min: h_min_m,
            delta,
        })
    };
    let params = DynamicsParams {
        model,
        alpha_m_per_n_s,
        beta_per_n2_s,
        ..params
    };
    let face = FaceState {
        b: Point3::origin(),
        n,
    };
    let (mut shown, mut refused) = (false, false);
    for force in [
        size * f,
        f_max_n * f,
        f_max_n * n,
        -size * n,
        Vector3::zeros(),
    ] {
        for p in [Point3::from(far * side), Point3::origin()] {
            let Ok(after) = FaceDynamics::new(params)
                .unwrap()
                .step(&face, &p, &force, dt)
            else {
                // a stretched spring moves away from its rest as e^αkt: only that is beyond the
                // largest number
                let is_away = spring && alpha_m_per_n_s * h_min_m * dt > 300.0;
                assert!(
                    is_away || may_overflow,
                    "{sizes:?} with {params:?} is refused"
                );
                refused = true;
                continue;
            };
            assert!(after.b.coords.iter().all(|x| x.is_finite()));
            assert!((after.n.norm() - 1.0).abs() <= 2.0 * f64::EPSILON);
            // it turns towards F, in the plane of both
            let towards = force.try_normalize(0.0).unwrap_or(n);
            assert!(after.n.dot(&n.cross(&towards)).abs() <= 8.0 * f64::EPSILON);
            let farthest = alpha_m_per_n_s * (force.norm() + f_max_n) * dt * (1.0 + 1e-9);
            // for sizes without underflow
            let is_bounded = !spring && params.rule == StepRule::Lie && !may_overflow;
            assert!(
                !is_bounded || after.b.coords.norm() <= farthest,
                "{:?} farther than {farthest:e}",
                after.b
            );
            shown |= after.b != face.b || after.n != face.n;
        }
    }
    match (refused, shown) {
        (true, _) => Shown::Refused,
        (false, true) => Shown::Value,
        (false, false) => Shown::Little,
    }
}

#[test]
fn extremes_give_a_unit_normal_or_an_error() {
    let cases = |reach| (sizes(reach), [unit(), unit(), unit()], params());
    // the largest product is (α f_max t / h_min) of 10^120
    let counts = tried(
        "sizes of 1e-25 to 1e25",
        2048,
        cases(25.0),
        |(sizes, directions, params)| check_extremes(&sizes, directions, params, false),
    );
    assert!(counts.values > 1500, "{counts:?}");
    // the range of numbers: a product of four sizes may be as far from 1 as 10^100, and each
    // refusal is one of those
    let counts = tried(
        "sizes of 1e-300 to 1e300",
        2048,
        cases(300.0),
        |(sizes, directions, params)| {
            let mut powers = sizes.exponents.map(f64::abs);
            powers.sort_by(f64::total_cmp);
            check_extremes(
                &sizes,
                directions,
                params,
                powers[3..].iter().sum::<f64>() > 100.0,
            )
        },
    );
    assert!(counts.values > 200, "{counts:?}");
}

/// A face in a saturated model moves at one of two speeds, −c at no expected force (u > 0) and 1 −
/// c at f_max (u < 0), up to u = 0, or for ever. Its distance to u = 0 may deviate by the width of
/// the bend, |ln| of the smaller of c and 1 − c.
fn check_saturated(u: f64, c: f64, scaled: f64, rule: StepRule) -> Shown {
    let params = DynamicsParams {
        rule,
        ..paper(0.1, 0.1)
    };
    let after = step(
        params,
        &UP,
        above(u),
        press(c * F_MAX),
        scaled * H_MIN / (0.1 * F_MAX),
    );
    let speed = |u: f64| if u > 0.0 { -c } else { 1.0 - c };
    let to_bend = -u / speed(u);
    let free = speed(u) * scaled;
    let moved = if to_bend < 0.0 || to_bend > scaled {
        free
    } else {
        // at the bend it is at rest, or goes on at the other speed
        let beyond = speed(-u);
        -u + if (beyond > 0.0) == (speed(u) > 0.0) {
            beyond * (scaled - to_bend)
        } else {
            0.0
        }
    };
    let width = 40.0 + c.abs().min((1.0 - c).abs()).ln().abs();
    // a face that goes on also loses time in the bend: its width at the slower of both speeds
    let delay =
        width * (1.0 + speed(-u).abs().max(speed(u).abs()) / speed(-u).abs().min(speed(u).abs()));
    let tolerance = delay + 1e-12 * (u.abs() + moved.abs());
    let found = after.b.z / -H_MIN;
    assert!(
        (found - moved).abs() <= tolerance,
        "{found} {moved} ± {tolerance} from {u} at {c} after {scaled}"
    );
    if tolerance < 1e-2 * moved.abs() {
        Shown::Value
    } else {
        Shown::Little
    }
}

#[test]
fn saturated_depths_and_long_times_go_at_the_speeds_of_both_ends() {
    let rule = prop_oneof![Just(StepRule::Lie), Just(StepRule::DriftCorrected)];
    let scaled = (3.0..15.0f64).prop_map(|x| 10f64.powf(x));
    let counts = tried(
        "saturated",
        4096,
        (-1e9..1e9, -3.0..3.0f64, scaled, rule),
        |(u, c, scaled, rule)| check_saturated(u, c, scaled, rule),
    );
    assert!(counts.values > 3000, "{counts:?}");
}

/// c = F·n/f_max on both sides of every special value.
fn shares() -> impl Strategy<Value = f64> {
    let power = |low: f64, high: f64| (low..high).prop_map(|x| 10f64.powf(x));
    prop_oneof![
        0.0..1.0,
        power(-20.0, 0.0),
        power(-16.0, 0.0).prop_map(|x| 1.0 - x),
        power(-20.0, 6.0).prop_map(|x| -x),
        power(-15.0, 6.0).prop_map(|x| 1.0 + x),
    ]
}

/// Two flows of a share of the time each are the one of all of it; and each travel lies between the
/// rates of its ends, f by f_max e^(−u/2) / (2 cosh(u/2)), as h moves monotonically and f falls
/// with h.
fn check_sum(u: f64, c: f64, t: f64, first: f64, tilted: bool) -> Shown {
    let model = ContactModel::Sigmoid(SigmoidParams {
        f_max: 1.0,
        h_min: 1.0,
        delta: 0.0,
    });
    let along = if tilted {
        MotionDirection::Force
    } else {
        MotionDirection::InitialNormal
    };
    let params = DynamicsParams {
        model,
        along,
        ..paper(1.0, 0.0)
    };
    let flow = |face: &FaceState, u, grow: f64, t: f64| {
        let force = grow * Vector3::new(if tilted { c.abs() } else { 0.0 }, 0.0, c);
        step(params, face, Point3::new(0.0, 0.0, u), force, t)
    };
    let ulps = 1.0 + 8e-16;
    let once = flow(&UP, u, 1.0, t);
    let half = flow(&UP, u, 1.0, first * t);
    let twice = flow(&half, u, 1.0, (1.0 - first) * t);
    // effect of four roundings of u, F, t, and of u half-way on the result
    let moved = [
        flow(&UP, u * ulps + 1e-15, 1.0, t).b - once.b,
        flow(&UP, u, ulps, t).b - once.b,
        flow(&UP, u, 1.0, ulps * t).b - once.b,
        flow(
            &half,
            u * ulps + 1e-15 + 8e-16 * half.b.z.abs(),
            1.0,
            (1.0 - first) * t,
        )
        .b - twice.b,
    ];
    let rounding: f64 = moved.iter().map(|v| v.norm()).sum();
    assert!((twice.b - once.b).norm() <= 1e-12 * once.b.coords.norm() + 4.0 * rounding);
    let rate = |u: f64| {
        let half = 0.5 * u.clamp(-1400.0, 1400.0);
        c - (-half).exp() / (2.0 * half.cosh())
    };
    // along a, which leans by 45° in the tilted case, and points down with F
    let up = once.b.z.signum() * once.b.coords.norm();
    let travel = if tilted { up * c.signum() } else { up };
    let ends = [rate(u) * t, rate(u - once.b.z) * t];
    let [least, most] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
    let slack = 1e-12 * (least.abs() + most.abs())
        + 64.0 * f64::EPSILON * (t * (1.0 + c.abs()) + u.abs())
        + 4.0 * rounding;
    assert!(
        travel >= least - slack && travel <= most + slack,
        "{travel} not in {least} … {most} from {u} at {c}, {t}"
    );
    let is_meaningful = slack + rounding < 1e-3 * travel.abs()
        && least.abs().min(most.abs()) > 0.05 * least.abs().max(most.abs());
    if is_meaningful {
        Shown::Value
    } else {
        Shown::Little
    }
}

#[test]
fn position_flows_add_up_in_every_regime() {
    let depth = prop_oneof![-45.0..45.0, -700.0..700.0];
    let cases = (depth, shares(), -6.0..6.0f64, 0.05..0.95, any::<bool>());
    let counts = tried(
        "sums of flows",
        20_000,
        cases,
        |(u, c, scaled, first, tilted)| check_sum(u, c, 10f64.powf(scaled), first, tilted),
    );
    assert!(counts.values > 8_000, "{counts:?}");
}

/// Distance of the planes at the true barycentre, m, and angle between the normals, rad, before
/// each millisecond.
fn one_face(
    params: DynamicsParams,
    face: FaceState,
    seconds: u32,
) -> Result<Vec<(f64, f64)>, DynamicsError> {
    let dynamics = FaceDynamics::new(params)?;
    let stylus = GuidedStylus::default();
    let surface = |p: &Point3<f64>| SIGMOID.force(p.z) * Vector3::z();
    let (initial_normal, mut p) = (face.n, face.b + 5e-3 * Vector3::z());
    let mut face = face;
    (0..1000 * seconds)
        .map(|_| {
            let errors = (face.b.z.abs(), angle(&face.n, &Vector3::z()));
            face = dynamics.step_from(&initial_normal, &face, &p, &surface(&p), 1e-3)?;
            p = stylus.step(&p, &face.b, &face.n, surface, 1e-3);
            Ok(errors)
        })
        .collect()
}

fn tilted(b_mm: [f64; 3], tilt_deg: f64, azimuth: f64) -> FaceState {
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    FaceState {
        b: Point3::from(b_mm.map(|x| 1e-3 * x)),
        n: Vector3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos),
    }
}

#[test]
fn one_face_comes_to_the_true_plane_distance_first_then_normal() {
    // at rest a tilted face draws the tip F_c sin(tilt)/K aside: with larger tilts the distance
    // waits for the normal
    let starts = [
        ([3.0, -2.0, 2.5], 20.0, 0.3),
        ([-1.0, 4.0, -3.0], 10.0, 2.0),
        ([0.5, 0.5, 4.0], 15.0, 4.0),
    ];
    for (b, tilt, azimuth) in starts {
        for along in [MotionDirection::InitialNormal, MotionDirection::Force] {
            let errors = one_face(
                DynamicsParams {
                    along,
                    ..paper(0.1, 0.1)
                },
                tilted(b, tilt, azimuth),
                40,
            )
            .unwrap();
            let tenth = |error: fn(&(f64, f64)) -> f64| {
                let below = errors
                    .iter()
                    .position(|e| error(e) < 0.1 * error(&errors[0]));
                1e-3 * below.map_or(f64::INFINITY, |sample| sample as f64)
            };
            let (distance_s, normal_s) = (tenth(|e| e.0), tenth(|e| e.1));
            let (distance, normal) = errors[errors.len() - 1];
            println!(
                "{along:?}: b* {b:?} mm, {tilt}°: down to a tenth at {distance_s:.2} s (distance) and {normal_s:.2} s \
                 (normal); after 40 s {:.1e} mm, {:.1e}°",
                1e3 * distance,
                normal.to_degrees()
            );
            assert!(
                distance_s < 0.7 * normal_s,
                "the distance is corrected first"
            );
            // the surface is as soft as the model says, so nothing remains but the rest of the turn
            // after 40 s
            assert!(distance < 1e-9 && normal < 1e-5);
        }
    }
}

#[test]
fn moving_along_the_normal_runs_away_from_100_degrees_and_along_the_force_it_does_not() {
    for (along, tilts, bounded) in [
        (MotionDirection::InitialNormal, [60.0, 80.0], true),
        (MotionDirection::InitialNormal, [100.0, 120.0], false),
        (MotionDirection::Force, [80.0, 120.0], true),
    ] {
        for tilt in tilts {
            let params = DynamicsParams {
                along,
                ..paper(0.1, 0.1)
            };
            let errors = one_face(params, tilted([1.0, -1.0, 2.0], tilt, 1.3), 40).unwrap();
            let (distance, normal) = errors[errors.len() - 1];
            println!(
                "{along:?} from {tilt}°: after 40 s {:.1e} mm, {:.1e}°",
                1e3 * distance,
                normal.to_degrees()
            );
            assert_eq!(distance < 1e-6 && normal < 1e-4, bounded);
            assert_eq!(distance > 0.1, !bounded);
        }
    }
}
