//! The exact sub-flows against an independent method: the implicit closed form, solved by bisection
//! in numbers of 32 digits.

use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

use super::face_runs::log_uniform;
use crate::double_double::Double2;
use touchup_method::haptic::{
    ContactModel, DynamicsParams, FaceDynamics, FaceState, MotionDirection, SigmoidParams,
};

/// Halvings of the bracket: from 1e9 to below a rounding of the residual.
const BISECTIONS: usize = 140;
/// Largest exponent without overflow risk.
const LARGEST_EXPONENT: f64 = 690.0;
/// Least angle between a compared normal and the force's opposite, rad, in decades: the given force
/// is off by a rounding, and turning away from it makes 1e-11 of that.
const NEAREST_OPPOSITE: std::ops::Range<f64> = -5.0..-1.0;
/// Model without input roundings: lengths in units of h_min, forces of f_max, times of h_min/(α
/// f_max).
const UNIT_MODEL: ContactModel = ContactModel::Sigmoid(SigmoidParams {
    f_max: 1.0,
    h_min: 1.0,
    delta: 0.0,
});

/// Largest error of one sub-flow.
#[derive(Clone, Debug, PartialEq)]
pub struct SubFlowError {
    /// sub-flow and regime
    pub name: String,
    /// cases compared
    pub cases: usize,
    /// largest error over the scale: for a position the travel and h_min, for a normal 1
    pub largest_error: f64,
    /// case of that error
    pub worst: String,
}

/// Force in a regime of the sigmoid, in units of f_max.
type ForceShare = fn(&mut Pcg64) -> f64;

fn either_sign(rng: &mut Pcg64) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

/// Each regime with its own closed form or its own cancellation.
const REGIMES: [(&str, ForceShare); 7] = [
    ("position, 0 < F < f_max", |rng| rng.random_range(0.0..1.0)),
    ("position, F = 0", |_| 0.0),
    ("position, F = f_max", |_| 1.0),
    ("position, F near 0", |rng| {
        log_uniform(rng, -12.0..-2.0) * either_sign(rng)
    }),
    ("position, F near f_max", |rng| {
        1.0 + log_uniform(rng, -12.0..-2.0) * either_sign(rng)
    }),
    ("position, F against the normal", |rng| {
        -log_uniform(rng, -2.0..4.0)
    }),
    ("position, F above f_max", |rng| {
        1.0 + log_uniform(rng, -2.0..4.0)
    }),
];

/// All sub-flows, `cases` of each.
pub(super) fn sub_flows(rng: &mut Pcg64, cases: usize) -> Vec<SubFlowError> {
    let mut errors: Vec<_> = REGIMES
        .iter()
        .map(|(name, share)| of_sigmoid(rng, name, *share, cases))
        .collect();
    errors.push(of_spring(rng, cases));
    errors.push(of_rotation(rng, cases));
    errors
}

/// The worst of `cases`: each gives its error and its description; `None` without a reference.
fn worst_of(
    name: &str,
    cases: usize,
    mut case: impl FnMut(usize) -> Option<(f64, String)>,
) -> SubFlowError {
    let mut worst = SubFlowError {
        name: name.to_owned(),
        cases: 0,
        largest_error: 0.0,
        worst: String::new(),
    };
    for (error, at) in (0..cases).filter_map(&mut case) {
        worst.cases += 1;
        // NaN counts as the worst error
        if error.is_nan() || error > worst.largest_error {
            worst.largest_error = if error.is_nan() { f64::INFINITY } else { error };
            worst.worst = at;
        }
    }
    worst
}

const FACE: FaceState = FaceState {
    b: Point3::new(0.0, 0.0, 0.0),
    n: Vector3::new(0.0, 0.0, 1.0),
};

/// One step of a face at the origin that looks up, by the rule as printed.
fn stepped(
    model: ContactModel,
    [alpha_m_per_n_s, beta_per_n2_s]: [f64; 2],
    (tip, force): (Point3<f64>, Vector3<f64>),
    t: f64,
) -> Option<FaceState> {
    let printed = DynamicsParams {
        along: MotionDirection::InitialNormal,
        take_out_rigid_offset: false,
        ..DynamicsParams::default()
    };
    let params = DynamicsParams {
        model,
        alpha_m_per_n_s,
        beta_per_n2_s,
        ..printed
    };
    FaceDynamics::new(params)
        .ok()?
        .step(&FACE, &tip, &force, t)
        .ok()
}

/// Travel of the face under a force along its normal, in units of h_min.
fn travel(model: ContactModel, h: f64, force: f64, t: f64) -> f64 {
    let after = stepped(
        model,
        [1.0, 0.0],
        (Point3::new(0.0, 0.0, h), Vector3::z() * force),
        t,
    );
    after.map_or(f64::NAN, |face| face.b.z)
}

fn of_sigmoid(rng: &mut Pcg64, name: &str, share: ForceShare, cases: usize) -> SubFlowError {
    worst_of(name, cases, |case| {
        // half of them at the bend of the logistic, half anywhere with a finite exponential
        let u = if case % 2 == 0 {
            rng.random_range(-12.0..12.0)
        } else {
            rng.random_range(-600.0..600.0)
        };
        let (c, t) = (share(rng), log_uniform(rng, -6.0..6.0));
        let exact = exact_travel(u, c, t)?;
        let found = travel(UNIT_MODEL, u, c, t);
        Some((
            (found - exact).abs() / (1.0 + exact.abs()),
            format!("u {u}, F/f_max {c}, T {t}"),
        ))
    })
}

/// −Δu of du/dT = 1/(1+eᵘ) − c after T: the root of ∫ du / (1/(1+eᵘ) − c) = T between the start and
/// the farthest possible value. `None` if it ends beyond the largest exponential without a start
/// beyond the bend.
fn exact_travel(u: f64, c: f64, t: f64) -> Option<f64> {
    let rate = share(u.into()) - c.into();
    if rate.high == 0.0 {
        return Some(0.0);
    }
    // u moves monotonically, towards the rest point if there is one, and no faster than the larger
    // of the rates at both ends
    let up = rate.high > 0.0;
    let fastest = if up { (1.0 - c).abs() } else { c.abs() }.max(rate.high.abs());
    let farthest = u + if up { fastest * t } else { -fastest * t };
    let rest = (0.0 < c && c < 1.0).then(|| ((1.0 - c) / c).ln());
    let far = match rest {
        Some(rest) if up => farthest.min(rest + 1e-9),
        Some(rest) => farthest.max(rest - 1e-9),
        None => farthest,
    };
    let start = primitive(u.into(), c)?;
    let within = far.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT);
    if far != within
        && primitive(within.into(), c).is_none_or(|there| (there - start - t.into()).high < 0.0)
    {
        return straight(u, c, t, far);
    }
    let (mut near, mut far) = (Double2::from(u), Double2::from(within));
    for _ in 0..BISECTIONS {
        let middle = (near + far) * 0.5.into();
        // the time is undefined beyond the rest point
        let is_before = primitive(middle, c)
            .filter(|_| ((share(middle) - c.into()).high > 0.0) == up)
            .is_some_and(|there| (there - start - t.into()).high < 0.0);
        if is_before {
            near = middle
        } else {
            far = middle
        }
    }
    Some((Double2::from(u) - near).value())
}

/// Travel for u so large that the exponential has no effect: the rate is −c or 1 − c throughout
/// except in the tail of the bend.
fn straight(u: f64, c: f64, t: f64, far: f64) -> Option<f64> {
    let is_flat = |low: f64, high: f64| low > 60.0 || high < -60.0;
    let (low, high) = (u.min(far), u.max(far));
    is_flat(low, high).then_some(if low > 60.0 { c * t } else { (c - 1.0) * t })
}

/// 1/(1 + eᵘ)
fn share(u: Double2) -> Double2 {
    let one = Double2::from(1.0);
    one / (one + u.exp())
}

/// ∫ (1 + E) / (1 − c (1 + E)) du, E = eᵘ, by partial fractions.
fn primitive(u: Double2, c: f64) -> Option<Double2> {
    let (one, share) = (Double2::from(1.0), Double2::from(c));
    if c == 0.0 {
        return Some(u + u.exp());
    }
    if c == 1.0 {
        return Some((-u).exp() - u);
    }
    // u − ln|1 − c − c E| / c, over 1 − c
    let inside = one - share - share * u.exp();
    let size = if inside.high < 0.0 { -inside } else { inside };
    (inside.high != 0.0).then(|| (u - size.ln() / share) / (one - share))
}

fn of_spring(rng: &mut Pcg64, cases: usize) -> SubFlowError {
    let model = ContactModel::Spring {
        stiffness_n_per_m: 1.0,
    };
    worst_of("position, linear spring", cases, |_| {
        let (h, force, t) = (
            either_sign(rng) * log_uniform(rng, -6.0..3.0),
            rng.random_range(-3.0..3.0),
            log_uniform(rng, -6.0..6.0),
        );
        // h + F falls to e^−t of itself
        let fallen = Double2::from(1.0) - Double2::from(-t.min(300.0)).exp();
        let exact = ((Double2::from(h) + force.into()) * fallen).value();
        let found = travel(model, h, force, t);
        Some((
            (found - exact).abs() / (1.0 + exact.abs()),
            format!("h {h}, F {force}, T {t}"),
        ))
    })
}

/// tan(θ/2) falls as e^(−β |F| f t); with the tip held at h = 0, f is half of f_max.
fn of_rotation(rng: &mut Pcg64, cases: usize) -> SubFlowError {
    worst_of("normal", cases, |case| {
        let angle = match case % 3 {
            0 => log_uniform(rng, -12.0..-1.0),
            1 => std::f64::consts::PI - log_uniform(rng, NEAREST_OPPOSITE),
            _ => rng.random_range(0.0..std::f64::consts::PI),
        };
        let exponent = log_uniform(rng, -6.0..2.5);
        let force = Vector3::new(angle.sin(), 0.0, angle.cos());
        let after = stepped(
            UNIT_MODEL,
            [0.0, 1.0],
            (Point3::origin(), force),
            2.0 * exponent,
        );
        let found = after.map_or(Vector3::repeat(f64::NAN), |face| face.n);
        Some((
            (found - exact_normal(&force, exponent)).norm(),
            format!("angle {angle}, exponent {exponent}"),
        ))
    })
}

/// n = z turned towards `force` in the plane y = 0, in numbers of 32 digits.
fn exact_normal(force: &Vector3<f64>, exponent: f64) -> Vector3<f64> {
    let (x, z) = (Double2::from(force.x), Double2::from(force.z));
    let one = Double2::from(1.0);
    let length = ((x * x + z * z).ln() * 0.5.into()).exp();
    // tan(θ/2) = sin / (1 + cos) or (1 − cos) / sin, the form without cancellation
    let tangent = if force.z > 0.0 {
        x / (length + z)
    } else {
        (length - z) / x
    };
    let left = tangent * (-length * exponent.into()).exp();
    // the normal lies at the angle θ − θ′ from z: as the force turned back by θ′
    let (cosine, sine) = (
        (one - left * left) / (one + left * left),
        (left + left) / (one + left * left),
    );
    let (fx, fz) = (x / length, z / length);
    Vector3::new(
        (fx * cosine - fz * sine).value(),
        0.0,
        (fz * cosine + fx * sine).value(),
    )
}
