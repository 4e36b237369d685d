//! A property for each formula of the method, over the whole range of numbers: denormals, overflow
//! and cancellation on purpose. The worst cases of long runs have tests of their own. [`Counts`]
//! counts cases that show little, and a predicate of each test decides the permitted refusals.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;
use touchup::haptic::turn;
use touchup::haptic::{
    ContactModel, DynamicsParams, FaceDynamics, FaceState, MotionDirection, RefineParams, Refiner,
    SigmoidParams, StepRule,
};
use touchup::mesh::{TriMesh, VertexId};
use touchup::stylus::{Sample, TipParams, Wrench};

use super::counted::{Counts, Shown, tried};

const EPSILON: f64 = f64::EPSILON;
const UP: FaceState = FaceState {
    b: Point3::new(0.0, 0.0, 0.0),
    n: Vector3::new(0.0, 0.0, 1.0),
};

/// Any size, down to the smallest number.
fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-323.0..300.0f64).prop_map(|x| 10f64.powf(x)),
        (-12.0..12.0f64).prop_map(|x| 10f64.powf(x)),
        Just(5e-324)
    ]
}

/// Ten to the power of the drawn number.
fn power(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|x| 10f64.powf(x))
}

fn any_signed() -> impl Strategy<Value = f64> {
    (any_size(), any::<bool>()).prop_map(|(x, sign)| if sign { x } else { -x })
}

fn unit() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0f64]
        .prop_map(Vector3::from)
        .prop_filter("too short to have a direction", |v| v.norm() > 0.1)
        .prop_map(|v| v.normalize())
}

fn dynamics(model: ContactModel, alpha: f64, beta: f64) -> FaceDynamics {
    let params = DynamicsParams {
        model,
        alpha_m_per_n_s: alpha,
        beta_per_n2_s: beta,
        rule: StepRule::Lie,
        along: MotionDirection::InitialNormal,
        take_out_rigid_offset: false,
    };
    FaceDynamics::new(params).unwrap()
}

fn sigmoid(f_max_n: f64, h_min_m: f64, delta: f64) -> ContactModel {
    ContactModel::Sigmoid(SigmoidParams {
        f_max: f_max_n,
        h_min: h_min_m,
        delta,
    })
}

/// Eq 3 is f_max e^(−u/2) / (2 cosh(u/2)): nothing cancels.
fn force_by_cosh(f_max: f64, u: f64) -> f64 {
    let half = 0.5 * u.clamp(-1400.0, 1400.0);
    f_max * ((-half).exp() / (2.0 * half.cosh()))
}

fn check_force(f_max: f64, h_min: f64, delta: f64, h: f64) -> Shown {
    let u = h / h_min + delta;
    let (force, expected) = (
        sigmoid(f_max, h_min, delta).force(h),
        force_by_cosh(f_max, u),
    );
    assert!((0.0..=f_max).contains(&force), "{force}");
    // a few roundings, and underflow
    let tolerance = 16.0 * EPSILON * expected + (1.0 + f_max) * 1e-307;
    assert!(
        u.is_infinite() || (force - expected).abs() <= tolerance,
        "{force:e} {expected:e} at u {u}"
    );
    // neither nothing nor all of f_max
    if u.abs() < 36.0 && tolerance < 1e-12 * expected {
        Shown::Value
    } else {
        Shown::Little
    }
}

/// f(f⁻¹(F)) is F again, up to the effect of a rounding of u = ln(f_max/F − 1).
fn check_inverse(f_max: f64, delta: f64, share: f64) -> Shown {
    let (model, force) = (sigmoid(f_max, 1.0, delta), f_max * share);
    if !(force > 0.0 && force < f_max) {
        return Shown::Little;
    }
    let h = model.distance(force);
    assert!(h.is_finite(), "f_max {f_max:e} reaches {force:e}");
    let back = model.force(h);
    let size = h.abs() + delta.abs() + 1.0;
    let tolerance = 8.0 * EPSILON * size * force + 1e-322;
    assert!(
        (back - force).abs() <= tolerance,
        "{back:e} {force:e} at h {h}"
    );
    // near f_max the force determines the distance poorly: a millionth of h_min must show
    if tolerance < 1e-6 * force * (1.0 - share) {
        Shown::Value
    } else {
        Shown::Little
    }
}

fn check_turn(n: &Vector3<f64>, to: &Vector3<f64>, exponent: f64) -> Shown {
    let turned = turn(n, to, exponent);
    assert!(
        (turned.norm() - 1.0).abs() <= 2.0 * EPSILON,
        "{}",
        turned.norm()
    );
    let angle = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm().atan2((a + b).norm());
    // half angles: tan falls by e^−exponent; the sum of nearly opposite vectors is off by a
    // rounding
    let (before, after) = (angle(n, to), angle(&turned, to));
    let left = (before.tan() * (-exponent).exp()).atan();
    // turning away makes more of a rounding
    let grown = (-exponent).exp().max(1.0);
    let sine = (n + to).norm().min((n - to).norm()).max(1e-300);
    let tolerance = 8.0 * EPSILON * grown * (1.0 + before / sine);
    assert!(
        (after - left).abs() <= tolerance,
        "{after} {left} of {before} by {exponent:e}"
    );
    // it stays in the plane of both
    let across = n.cross(to);
    assert!(
        turned.dot(&across).abs() <= 8.0 * EPSILON,
        "{}",
        turned.dot(&across)
    );
    // it has turned, and neither fully nor to the other side
    let open = before
        .min(left)
        .min(std::f64::consts::FRAC_PI_2 - before.max(left));
    let is_meaningful = tolerance < 1e-6 * open.min((before - left).abs());
    if is_meaningful {
        Shown::Value
    } else {
        Shown::Little
    }
}

/// Whether a product is beyond the largest number, or so near that a factor of two might be: by its
/// factors' powers of ten.
fn is_huge(factors: &[f64]) -> bool {
    factors.iter().map(|x| x.abs().log10()).sum::<f64>() > 307.0
}

/// A spring falls to e^−αkt of its distance to rest. It refuses only a huge product in its travel h
/// + F/k, its impulse k ∫ h dt or their terms.
fn check_spring(stiffness: f64, alpha: f64, dt: f64, h: f64, force: f64) -> Shown {
    let model = ContactModel::Spring {
        stiffness_n_per_m: stiffness,
    };
    let z = alpha * stiffness * dt;
    let Ok(after) = dynamics(model, alpha, 0.0).step(
        &UP,
        &Point3::new(0.0, 0.0, h),
        &(Vector3::z() * force),
        dt,
    ) else {
        let products: [&[f64]; 8] = [
            &[alpha, stiffness],
            &[alpha, dt],
            &[stiffness, dt],
            &[stiffness, h],
            &[stiffness, dt, h],
            &[alpha, dt, force.abs().max(stiffness * h.abs())],
            &[alpha, force],
            &[stiffness, dt, alpha, dt, force],
        ];
        let is_allowed = products.iter().any(|factors| is_huge(factors));
        assert!(
            is_allowed,
            "k {stiffness:e}, α {alpha:e}, t {dt:e}, h {h:e}, F {force:e} is refused"
        );
        return Shown::Refused;
    };
    let left = h + force / stiffness;
    let expected = if z < 1e-17 {
        alpha * dt * (stiffness * h + force)
    } else {
        left * -(-z).exp_m1()
    };
    // both terms of the sum have a rounding of their own; underflow in between is below the
    // smallest normal number
    let terms = (h.abs() + (force / stiffness).abs()) * z.min(1.0);
    let underflow = f64::MIN_POSITIVE * (1.0 + alpha * dt) * (1.0 + stiffness.recip().min(1e300));
    let tolerance = 16.0 * EPSILON * terms + underflow;
    let is_meaningful = [z, expected, terms, underflow, stiffness * h]
        .iter()
        .all(|x| x.is_finite())
        && z.is_normal();
    // few digits in αk or αt leave few in the result: less than a rounding of h
    let is_meaningful =
        is_meaningful && (alpha * stiffness).is_normal() && (alpha * dt).is_normal();
    assert!(
        !is_meaningful || (after.b.z - expected).abs() <= tolerance,
        "{:e} {expected:e}",
        after.b.z
    );
    if is_meaningful && tolerance < 1e-9 * expected.abs() {
        Shown::Value
    } else {
        Shown::Little
    }
}

/// Towards rest, not over it, and as far as the rate allows. With F inside (0, f_max) the rate only
/// falls, and the distance g to rest obeys s′(u) g with a slope s′ = s (1 − s) between that of both
/// ends and 1/4: so the travel lies between the last rate and the first times t, and between g (1 −
/// e^−mT) and g (1 − e^−T/4).
///
/// It refuses only a huge scaled time α f_max t / h_min or a huge travel α F t.
#[expect(clippy::too_many_lines)]
fn check_position(h_min: f64, f_max: f64, alpha: f64, share: f64, u: f64, dt: f64) -> Shown {
    let model = sigmoid(f_max, h_min, 0.0);
    let (h, force) = (u * h_min, share * f_max);
    if !(h.is_finite() && h_min.is_normal() && force > 0.0 && force < f_max) {
        return Shown::Little;
    }
    // below the smallest normal number a force has few digits, and another share than the drawn one
    let share = force / f_max;
    let Ok(after) = dynamics(model, alpha, 0.0).step(
        &UP,
        &Point3::new(0.0, 0.0, h),
        &(Vector3::z() * force),
        dt,
    ) else {
        let products: [&[f64]; 3] = [
            &[alpha, f_max, dt],
            &[alpha, f_max, dt, 1e28, h_min.recip()],
            &[f_max, dt],
        ];
        let is_allowed = products.iter().any(|factors| is_huge(factors));
        assert!(
            is_allowed,
            "h_min {h_min:e}, f_max {f_max:e}, α {alpha:e}, t {dt:e}, u {u}, c {share} is refused"
        );
        return Shown::Refused;
    };
    // ln(f_max/F − 1), the force apart from the code
    let at_rest = if share > 1e-290 {
        (1.0 - share).ln() - share.ln()
    } else {
        -share.ln()
    };
    let (travel, rest) = (after.b.z, h - h_min * at_rest);
    // the rest point carries the rounding of F near f_max
    let near = share.min(1.0 - share).max(EPSILON);
    let rounding = 16.0 * EPSILON * (h.abs() + h_min * at_rest.abs() + h_min / near);
    assert!(
        travel * rest >= 0.0 || travel.abs() <= rounding,
        "{travel:e} away from rest at {rest:e}"
    );
    assert!(
        travel.abs() <= rest.abs() + rounding,
        "{travel:e} beyond rest at {rest:e}"
    );
    let rate = |u: f64| alpha * (force - force_by_cosh(f_max, u)).abs();
    let reach = alpha * f_max * dt;
    let scaled = reach / h_min;
    let lost = reach * EPSILON * (32.0 + u.abs() + at_rest.abs());
    // an underflowing rate bounds nothing
    let is_meaningful = [alpha * f_max, rate(u), reach, scaled, lost]
        .iter()
        .all(|x| x.is_normal());
    if !is_meaningful {
        return Shown::Little;
    }
    let slope = |u: f64| 0.25 / (0.5 * u).cosh().powi(2);
    let slowest = -slope(u).min(slope(at_rest)) * scaled;
    let least = (rate(u - travel / h_min) * dt - lost).max(rest.abs() * -slowest.exp_m1());
    let most = (rate(u) * dt + lost).min(rest.abs() * -(-0.25 * scaled).exp_m1());
    assert!(
        travel.abs() <= most * (1.0 + 1e-12) + rounding,
        "{travel:e} farther than {most:e}"
    );
    assert!(
        travel.abs() >= least * (1.0 - 1e-12) - rounding,
        "{travel:e} not as far as {least:e}"
    );
    if rounding < 1e-3 * least && least > 0.01 * most {
        Shown::Value
    } else {
        Shown::Little
    }
}

/// du/dT = 1/(1 + eᵘ) − c by the classical Runge–Kutta method in even steps, with an error of at
/// most 1e-8.
fn flowed(u: f64, c: f64, scaled: f64) -> f64 {
    let (steps, rate) = (4000, |u: f64| force_by_cosh(1.0, u) - c);
    let step = scaled / f64::from(steps);
    (0..steps).fold(u, |u, _| {
        let first = rate(u);
        let second = rate(u + 0.5 * step * first);
        let third = rate(u + 0.5 * step * second);
        let fourth = rate(u + step * third);
        u + step / 6.0 * (first + 2.0 * (second + third) + fourth)
    })
}

/// Against a solver that knows no closed form.
fn check_flow(u: f64, share: f64, scaled: f64) -> Shown {
    let (h_min, f_max, alpha) = (0.5e-3, 10.0, 0.1);
    let (p, force) = (
        Point3::new(0.0, 0.0, u * h_min),
        Vector3::z() * (share * f_max),
    );
    let after = dynamics(sigmoid(f_max, h_min, 0.0), alpha, 0.0).step(
        &UP,
        &p,
        &force,
        scaled * h_min / (alpha * f_max),
    );
    // u falls while b rises
    let (moved, expected) = (after.unwrap().b.z / -h_min, flowed(u, share, scaled) - u);
    let tolerance = 1e-7 * expected.abs() + 1e-12 * (1.0 + u.abs());
    assert!(
        (moved - expected).abs() <= tolerance,
        "{moved} {expected} from {u} at {share} after {scaled}"
    );
    if tolerance < 1e-6 * expected.abs() {
        Shown::Value
    } else {
        Shown::Little
    }
}

/// A lattice of triangles of a millimetre, shaken, some far from the origin.
fn lattice(shake: &[f64], centre: &Vector3<f64>) -> TriMesh {
    let (cells, edge) = (8u32, 1e-3);
    let id = |i: u32, j: u32| j * (cells + 1) + i;
    let nodes = (0..=cells)
        .flat_map(|j| (0..=cells).map(move |i| (f64::from(i) - 4.0, f64::from(j) - 4.0)));
    let positions = nodes.enumerate().map(|(at, (x, y))| {
        let [a, b, c] = [0, 1, 2].map(|k| shake[(3 * at + k) % shake.len()]);
        Point3::new((x + 0.3 * a) * edge, (y + 0.3 * b) * edge, 0.2 * c * edge) + centre
    });
    let faces = (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j)));
    let faces = faces.flat_map(|(i, j)| {
        [
            [id(i, j), id(i + 1, j), id(i + 1, j + 1)],
            [id(i, j), id(i + 1, j + 1), id(i, j + 1)],
        ]
    });
    TriMesh::new(positions.collect(), faces.collect()).unwrap()
}

/// Three quarters of a 25th of the mean edge of [`lattice`], m: a step of the refiner below it is
/// not shortened.
const LONGEST_STEP: f64 = 0.75 * 0.04e-3;

fn refiner(mesh: &TriMesh) -> Refiner {
    let tip = TipParams {
        radius: 1.5e-3,
        stiffness: Some(2e4),
    };
    // carving moves a region of its own
    Refiner::new(
        mesh.clone(),
        RefineParams {
            carve: None,
            ..RefineParams::robust(tip)
        },
    )
    .unwrap()
}

fn pressed(tick: i64, centre: Point3<f64>, force: Vector3<f64>) -> Sample {
    let pose_ot = Isometry3::from_parts(centre.coords.into(), UnitQuaternion::identity());
    Sample {
        stamp_ns: tick * 1_000_000,
        pose_ot,
        wrench: Wrench {
            force,
            torque: Vector3::zeros(),
        },
    }
}

/// Eq 1, 2, 4, 5, 6 and the weights of the region, on three pushes.
#[expect(clippy::too_many_lines)]
fn check_push(shake: &[f64], centre: &Vector3<f64>, force: &Vector3<f64>, depth: f64) -> Shown {
    let mesh = lattice(shake, centre);
    let mut refiner = refiner(&mesh);
    let normal = force.normalize();
    let at = Point3::from(*centre) + normal * (1.5e-3 + depth);
    let mut before = mesh.positions().to_vec();
    let mut meaningful = 0;
    for tick in 1..4 {
        let update = refiner.push(&pressed(tick, at, *force)).unwrap();
        let Some(mismatch) = update.mismatch else {
            continue;
        };
        let [a, b, c] = mesh.corners(mismatch.face).map(|v| before[v.0 as usize]);
        let n = (b - a).cross(&(c - a)).normalize();
        // the corners relative to the first, without subtraction of large numbers
        let barycentre = (b - a + (c - a)) / 3.0;
        let h = (at - a - normal * 1.5e-3 - barycentre).dot(&n);
        let rounding = 64.0 * EPSILON * (centre.norm() + 1e-2);
        assert!(
            (mismatch.distance - h).abs() <= rounding * (1.0 + 1e-3 / 1e-4),
            "{:e} {h:e}",
            mismatch.distance
        );
        let measured = normal * force.dot(&normal);
        // a spring of 20 N/mm, which does not pull
        let expected = n * (-2e4 * h).max(0.0);
        assert!(
            (mismatch.expected_force_o - expected).norm() <= 2e4 * rounding * 11.0,
            "{}",
            mismatch.expected_force_o
        );
        let size = measured.norm() + mismatch.expected_force_o.norm();
        assert!(
            (mismatch.linear + mismatch.expected_force_o - measured).norm() <= 8.0 * EPSILON * size
        );
        // the cross product is normal to both, and its length is the area of their parallelogram
        let squared = mismatch.expected_force_o.norm_squared() * measured.norm_squared();
        let cosine = mismatch.expected_force_o.dot(&measured);
        let area = mismatch.rotational.norm_squared() + cosine * cosine;
        assert!(
            (area - squared).abs() <= 32.0 * EPSILON * squared,
            "{area:e} {squared:e}"
        );
        let travel = |v: VertexId| (refiner.mesh().position(v) - before[v.0 as usize]).norm();
        let handle = mesh
            .corners(mismatch.face)
            .map(travel)
            .into_iter()
            .fold(0.0, f64::max);
        for vertex in (0..mesh.vertex_count() as u32).map(VertexId) {
            if update.fit.is_some() && refiner.moved_vertices().contains(&vertex) {
                // weights are not negative and sum to 1 at most: nothing moves farther than the
                // handle
                assert!(
                    travel(vertex) <= handle * (1.0 + 1e-12) + rounding,
                    "{:e} {handle:e}",
                    travel(vertex)
                );
            }
        }
        let barycentre = |at: &dyn Fn(VertexId) -> Vector3<f64>| {
            mesh.corners(mismatch.face)
                .iter()
                .fold(Vector3::zeros(), |sum, v| sum + at(*v))
                / 3.0
        };
        let step = barycentre(&|v| refiner.mesh().position(v) - before[v.0 as usize]).dot(&normal);
        // in a millisecond the handle goes e^−0.025 a·n of its distance to rest along the force, or
        // less, so that no corner goes farther than a step may; a turn about the barycentre does
        // not move that
        let cosine = normal.dot(&n);
        let free = (h + measured.dot(&n) / 2e4) / cosine * -(-0.025 * cosine).exp_m1();
        let is_free = handle < LONGEST_STEP && refiner.counts().cut_back == 0 && tick > 1;
        assert!(
            step.abs() <= free.abs() + 2.0 * rounding,
            "{step:e} {free:e}"
        );
        if is_free {
            assert!(
                (step - free).abs() <= 20.0 * rounding + 1e-12 * free.abs(),
                "{step:e} {free:e}"
            );
        }
        meaningful += u32::from(handle > 1e3 * rounding);
        before = refiner.mesh().positions().to_vec();
    }
    if meaningful == 2 {
        Shown::Value
    } else {
        Shown::Little
    }
}

const CASES: u32 = 4096;

/// At least `percent` per cent of the cases determine a value.
#[track_caller]
fn assert_meaningful(counts: Counts, percent: u32) {
    let Counts {
        values,
        little,
        refused,
    } = counts;
    assert!(
        100 * values >= percent * (values + little + refused),
        "{counts:?}: less than {percent} %"
    );
}

#[test]
fn eq_3_is_an_exponential_over_a_hyperbolic_cosine() {
    let bent = (
        power(-250.0, 300.0),
        power(-200.0, 200.0),
        -20.0..20.0f64,
        -36.0..36.0f64,
    );
    let counts = tried(
        "Eq 3 where it bends",
        CASES,
        bent,
        |(f_max, h_min, delta, u)| check_force(f_max, h_min, delta, (u - delta) * h_min),
    );
    assert_meaningful(counts, 95);
    tried(
        "Eq 3 anywhere",
        CASES,
        (any_size(), any_size(), -800.0..800.0f64, any_signed()),
        |(f_max, h_min, delta, h)| check_force(f_max, h_min, delta, h),
    );
}

#[test]
fn the_inverse_of_eq_3_is_reached_wherever_the_force_is() {
    let share = || {
        prop_oneof![
            0.0..1.0,
            power(-300.0, 0.0),
            power(-16.0, -1.0).prop_map(|x| 1.0 - x)
        ]
    };
    let usual = (power(-6.0, 6.0), -20.0..20.0f64, share());
    let counts = tried("inverse of Eq 3", CASES, usual, |(f_max, delta, share)| {
        check_inverse(f_max, delta, share)
    });
    assert_meaningful(counts, 60);
    let anywhere = (any_size(), -20.0..20.0f64, share());
    tried("… anywhere", CASES, anywhere, |(f_max, delta, share)| {
        check_inverse(f_max, delta, share)
    });
}

#[test]
fn eq_7_lets_the_tangent_of_half_the_angle_fall() {
    let tilt = prop_oneof![
        2 => 0.0..3.0f64,
        1 => power(-300.0, 0.0),
        1 => power(-12.0, 0.0).prop_map(|x| std::f64::consts::PI - x),
    ];
    let exponent = prop_oneof![3 => -6.0..6.0f64, 1 => any_signed()];
    let counts = tried(
        "Eq 7",
        2 * CASES,
        (unit(), unit(), tilt, exponent),
        |(n, to, tilt, exponent)| {
            let axis = Unit::new_normalize(
                n.cross(&to) + 1e-3 * n.cross(&Vector3::x()) + 1e-3 * n.cross(&Vector3::y()),
            );
            let to = (UnitQuaternion::from_axis_angle(&axis, tilt) * n).normalize();
            assert!((turn(&n, &to, exponent).norm() - 1.0).abs() <= 2.0 * EPSILON);
            check_turn(&n, &to, exponent.clamp(-30.0, 30.0))
        },
    );
    assert_meaningful(counts, 35);
}

#[test]
fn a_spring_falls_exponentially() {
    let signed = |low, high| {
        (power(low, high), any::<bool>()).prop_map(|(x, is_up)| if is_up { x } else { -x })
    };
    // by α k t, so that it neither rests nor stays
    let usual = (
        power(-3.0, 9.0),
        power(-6.0, 3.0),
        power(-6.0, 1.5),
        signed(-9.0, 1.0),
        signed(-6.0, 4.0),
    );
    let counts = tried(
        "a spring of any usual size",
        CASES,
        usual,
        |(stiffness, alpha, z, h, force)| {
            check_spring(stiffness, alpha, z / (alpha * stiffness), h, force)
        },
    );
    assert_meaningful(counts, 95);
    assert_eq!(counts.refused, 0);
    let anywhere = (
        any_size(),
        any_size(),
        any_size(),
        any_signed(),
        any_signed(),
    );
    tried(
        "a spring anywhere",
        2 * CASES,
        anywhere,
        |(stiffness, alpha, dt, h, force)| check_spring(stiffness, alpha, dt, h, force),
    );
}

#[test]
fn eq_6_goes_to_rest_and_as_far_as_its_rate_allows() {
    let share = || {
        prop_oneof![
            0.0..1.0,
            power(-300.0, 0.0),
            power(-15.0, -1.0).prop_map(|x| 1.0 - x)
        ]
    };
    // by α f_max t / h_min
    let usual = (
        power(-6.0, -2.0),
        power(-1.0, 3.0),
        power(-3.0, 1.0),
        -12.0..12.0f64,
        0.001..0.999f64,
        power(-5.0, 2.0),
    );
    let counts = tried(
        "Eq 6 of any usual size",
        CASES,
        usual,
        |(h_min, f_max, alpha, u, share, scaled)| {
            check_position(
                h_min,
                f_max,
                alpha,
                share,
                u,
                scaled * h_min / (alpha * f_max),
            )
        },
    );
    assert_meaningful(counts, 90);
    assert_eq!(counts.refused, 0);
    let saturated = (
        prop_oneof![-40.0..40.0f64, -700.0..700.0],
        share(),
        -12.0..12.0f64,
    );
    let counts = tried(
        "Eq 6 at any depth",
        CASES,
        saturated,
        |(u, share, scaled)| check_position(1e-3, 10.0, 0.1, share, u, 10f64.powf(scaled) * 1e-3),
    );
    assert_meaningful(counts, 25);
    assert_eq!(counts.refused, 0);
    let anywhere = (
        any_size(),
        any_size(),
        any_size(),
        any_size(),
        prop_oneof![-40.0..40.0f64, -700.0..700.0],
        share(),
    );
    tried(
        "Eq 6 anywhere",
        2 * CASES,
        anywhere,
        |(h_min, f_max, alpha, dt, u, share)| check_position(h_min, f_max, alpha, share, u, dt),
    );
}

#[test]
fn eq_6_is_what_small_steps_come_to() {
    let usual = (
        -15.0..15.0f64,
        prop_oneof![-1.0..2.0f64, 0.001..0.999f64],
        power(-3.0, 2.5),
    );
    let counts = tried("Eq 6 in small steps", CASES, usual, |(u, share, scaled)| {
        check_flow(u, share, scaled)
    });
    assert_meaningful(counts, 90);
}

#[test]
fn eq_1_4_and_5_hold_on_a_mesh_and_nothing_moves_farther_than_the_handle() {
    let far = prop_oneof![Just(0.0), 0.0..900.0f64];
    let cases = (
        prop::collection::vec(-1.0..1.0f64, 50..51),
        far,
        [-0.3..0.3f64, -0.3..0.3f64],
        1.0..50.0f64,
        -1e-4..1e-4f64,
    );
    let counts = tried(
        "a push on a mesh",
        256,
        cases,
        |(shake, far, [x, y], size, depth)| {
            let force = size * Vector3::new(x, y, 1.0).normalize();
            check_push(
                &shake,
                &Vector3::new(far, -0.5 * far, 0.1 * far),
                &force,
                depth,
            )
        },
    );
    assert_meaningful(counts, 80);
}

/// The same samples, again and on another thread at the same time: the same bits.
#[test]
fn a_refiner_gives_the_same_bits_again_and_on_another_thread() {
    let shake: Vec<f64> = (0..50).map(|i| (f64::from(i) * 12.9898).sin()).collect();
    let run = || {
        let mut refiner = refiner(&lattice(&shake, &Vector3::zeros()));
        for tick in 1..2_000 {
            let travel = 1e-6 * tick as f64;
            let force = Vector3::new(0.3 * (travel * 3e3).sin(), 0.2, 2.0);
            refiner
                .push(&pressed(
                    tick,
                    Point3::new(travel - 1e-3, 0.3e-3, 1.4e-3),
                    force,
                ))
                .unwrap();
        }
        assert!(refiner.counts().moved > 1_000, "{:?}", refiner.counts());
        refiner
            .mesh()
            .positions()
            .iter()
            .flat_map(|p| p.coords.map(f64::to_bits).data.0[0])
            .collect::<Vec<u64>>()
    };
    let alone = run();
    let (here, there) = std::thread::scope(|threads| {
        let other = threads.spawn(run);
        (run(), other.join().unwrap())
    });
    assert!(alone == here && alone == there);
}

/// (f_max − F)/F is more than the largest number.
#[test]
fn a_denormal_force_is_reached_at_a_finite_distance() {
    check_inverse(10.0, 5.0, 1e-309);
    let h = sigmoid(10.0, 1.0, 0.0).distance(5e-324);
    // ln 10 + 1074 ln 2
    assert!((h - (10f64.ln() + 1074.0 * 2f64.ln())).abs() < 1e-12, "{h}");
}

/// h/h_min beyond the largest number on either side; a denormal h_min; cancellation of h/h_min with
/// δ.
#[test]
fn the_worst_depths_of_eq_3() {
    for (f_max, h_min, delta, h) in [
        (10.0, 5e-324, 5.0, 1e300),
        (10.0, 5e-324, 5.0, -1e300),
        (1e300, 1e-3, -745.0, 0.745),
        (5e-324, 1e-3, 5.0, -5e-3),
        (10.0, 1e300, 5.0, 5e-324),
        (10.0, 1e-3, 745.2, 0.0),
    ] {
        check_force(f_max, h_min, delta, h);
    }
}

/// So nearly opposite that the square of the difference underflows (the normal was NaN then),
/// opposite to rounding, equal to rounding, and an exponent whose exponential is denormal or
/// nothing.
#[test]
fn the_worst_turns_of_eq_7() {
    let n = Vector3::z();
    for tilt in [
        0.0,
        5e-324,
        1e-160,
        1e-16,
        1.0,
        std::f64::consts::PI - 1e-15,
        std::f64::consts::PI,
    ] {
        let to = Vector3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
        for exponent in [5e-324, 1e-300, 1e-16, 0.7, 36.0, 709.0, 745.2, 1e300] {
            for sign in [1.0, -1.0] {
                let turned = turn(&n, &to, sign * exponent);
                assert!(
                    (turned.norm() - 1.0).abs() <= 2.0 * EPSILON,
                    "{tilt:e} {exponent:e}: {}",
                    turned.norm()
                );
                let (before, after) = (n.dot(&to), turned.dot(&to));
                assert!(
                    sign * (after - before) >= -4.0 * EPSILON,
                    "{tilt:e} {exponent:e} turns in the wrong sense"
                );
            }
        }
    }
}

/// At the joint of series and closed form, and at a denormal −αkt or a vanishing exponential.
#[test]
fn the_worst_springs() {
    for z in [
        5e-324,
        1e-300,
        1e-16,
        0.999_999_999_999_999_9,
        1.0,
        1.000_000_000_000_000_2,
        745.2,
        1e300,
    ] {
        for (h, force) in [
            (1.0, 0.0),
            (0.0, 1.0),
            (1.0, -1.0),
            (1.0, -1.0 + EPSILON),
            (1e-300, 5e-324),
            (1e150, -1e150),
        ] {
            check_spring(1.0, 1.0, z, h, force);
        }
    }
}

/// α f_max underflowed though α f_max dt does not, and the face went to 1e118 times the distance of
/// its rest point.
#[test]
fn an_underflowing_product_does_not_pass_for_no_time() {
    check_position(
        4.763_543_788_795_485e-264,
        2.071_989_792_837_727_6e-73,
        5e-324,
        0.892_780_769_709_675_7,
        0.0,
        4.2e251,
    );
    let face = dynamics(sigmoid(1e-200, 1e-200, 0.0), 1e-200, 0.0)
        .step(
            &UP,
            &Point3::new(0.0, 0.0, 1e-200),
            &(Vector3::z() * 5e-201),
            1e250,
        )
        .unwrap();
    // T = 1e50: at rest, with f half of f_max, at h = 0
    assert!((face.b.z - 1e-200).abs() < 1e-214, "{:e}", face.b.z);
}

/// At 1e299 scaled times overflowed from u = −700 and put the face 1e299 m away; now the step
/// refuses them.
#[test]
fn the_worst_positions_of_eq_6() {
    for u in [-700.0, -40.0, -1e-16, 0.0, 1e-16, 36.7, 40.0, 700.0] {
        for share in [
            5e-324,
            1e-300,
            1e-16,
            0.5,
            0.5 + EPSILON,
            1.0 - 0.5 * EPSILON,
        ] {
            for dt in [5e-324, 1e-200, 1e-16, 1.0, 1e16, 1e279, 1e299] {
                check_position(1.0, 1.0, 1.0, share, u, dt);
            }
        }
    }
    // of a force with three digits
    check_position(1.82e-140, 1.8e-321, 1.088e287, 0.9, 0.0, 1.0);
}
