//! A property for each formula of the method, over the whole range of numbers: denormals, overflow and cancellation are looked
//! for on purpose. What was the worst in long runs stands as a case of its own.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;
use touchup::mesh::{TriMesh, VertexId};
use touchup::refine::dynamics::turn;
use touchup::refine::{
    Along, ContactModel, DynamicsParams, FaceDynamics, FaceState, RefineParams, Refiner, StepRule, TipParams,
};
use touchup::touch::{Sample, Wrench};

const EPSILON: f64 = f64::EPSILON;
const UP: FaceState = FaceState { b: Point3::new(0.0, 0.0, 0.0), n: Vector3::new(0.0, 0.0, 1.0) };

/// Any size, down to the smallest number.
fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-323.0..300.0f64).prop_map(|x| 10f64.powf(x)),
        (-12.0..12.0f64).prop_map(|x| 10f64.powf(x)),
        Just(5e-324)
    ]
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
        along: Along::InitialNormal,
        take_out_rigid_offset: false,
    };
    FaceDynamics::new(params).unwrap()
}

fn sigmoid(f_max_n: f64, h_min_m: f64, delta: f64) -> ContactModel {
    ContactModel::Sigmoid { f_max_n, h_min_m, delta }
}

/// Eq 3 is f_max e^(−u/2) / (2 cosh(u/2)): nothing cancels.
fn force_by_cosh(f_max: f64, u: f64) -> f64 {
    let half = 0.5 * u.clamp(-1400.0, 1400.0);
    f_max * ((-half).exp() / (2.0 * half.cosh()))
}

fn check_force(f_max: f64, h_min: f64, delta: f64, h: f64) {
    let u = h / h_min + delta;
    let (force, expected) = (sigmoid(f_max, h_min, delta).force(h), force_by_cosh(f_max, u));
    assert!((0.0..=f_max).contains(&force), "{force}");
    // a few roundings, and what underflows
    let tolerance = 16.0 * EPSILON * expected + (1.0 + f_max) * 1e-307;
    assert!(u.is_infinite() || (force - expected).abs() <= tolerance, "{force:e} {expected:e} at u {u}");
}

/// f(f⁻¹(F)) is F again, but for what a rounding of u = ln(f_max/F − 1) does to it.
fn check_inverse(f_max: f64, delta: f64, share: f64) {
    let (model, force) = (sigmoid(f_max, 1.0, delta), f_max * share);
    if !(force > 0.0 && force < f_max) {
        return;
    }
    let h = model.distance(force);
    assert!(h.is_finite(), "f_max {f_max:e} reaches {force:e}");
    let back = model.force(h);
    let size = h.abs() + delta.abs() + 1.0;
    assert!((back - force).abs() <= 8.0 * EPSILON * size * force + 1e-322, "{back:e} {force:e} at h {h}");
}

fn check_turn(n: &Vector3<f64>, to: &Vector3<f64>, exponent: f64) {
    let turned = turn(n, to, exponent);
    assert!((turned.norm() - 1.0).abs() <= 2.0 * EPSILON, "{}", turned.norm());
    let angle = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm().atan2((a + b).norm());
    // half angles: tan falls by e^−exponent; the sum of nearly opposite vectors is off by a rounding
    let (before, after) = (angle(n, to), angle(&turned, to));
    let left = (before.tan() * (-exponent).exp()).atan();
    // turning away makes more of a rounding
    let grown = (-exponent).exp().max(1.0);
    let sine = (n + to).norm().min((n - to).norm()).max(1e-300);
    assert!(
        (after - left).abs() <= 8.0 * EPSILON * grown * (1.0 + before / sine),
        "{after} {left} of {before} by {exponent:e}"
    );
    // it stays in the plane of both
    let across = n.cross(to);
    assert!(turned.dot(&across).abs() <= 8.0 * EPSILON, "{}", turned.dot(&across));
}

/// A spring falls to e^−αkt of its distance to rest.
fn check_spring(stiffness: f64, alpha: f64, dt: f64, h: f64, force: f64) {
    let model = ContactModel::Spring { stiffness_n_per_m: stiffness };
    let z = alpha * stiffness * dt;
    let Ok(after) = dynamics(model, alpha, 0.0).step(&UP, &Point3::new(0.0, 0.0, h), &(Vector3::z() * force), dt)
    else {
        return;
    };
    let left = h + force / stiffness;
    let expected = if z < 1e-17 { alpha * dt * (stiffness * h + force) } else { left * -(-z).exp_m1() };
    // both terms of the sum are rounded before they meet; what underflows on the way is below the smallest normal number
    let terms = (h.abs() + (force / stiffness).abs()) * z.min(1.0);
    let underflow = f64::MIN_POSITIVE * (1.0 + alpha * dt) * (1.0 + stiffness.recip().min(1e300));
    let tolerance = 16.0 * EPSILON * terms + underflow;
    let is_told = [z, expected, terms, underflow, stiffness * h].iter().all(|x| x.is_finite()) && z.is_normal();
    // with few digits left in αk or αt there are no more in what comes of it: less than a rounding of h
    let is_told = is_told && (alpha * stiffness).is_normal() && (alpha * dt).is_normal();
    assert!(!is_told || (after.b.z - expected).abs() <= tolerance, "{:e} {expected:e}", after.b.z);
}

/// Towards rest, not over it, and no farther than the first rate: with F inside (0, f_max) the rate only falls.
fn check_position(h_min: f64, f_max: f64, alpha: f64, share: f64, u: f64, dt: f64) {
    let model = sigmoid(f_max, h_min, 0.0);
    let (h, force) = (u * h_min, share * f_max);
    if !(h.is_finite() && h_min.is_normal() && force > 0.0 && force < f_max) {
        return;
    }
    let Ok(after) = dynamics(model, alpha, 0.0).step(&UP, &Point3::new(0.0, 0.0, h), &(Vector3::z() * force), dt)
    else {
        return;
    };
    let (way, rest) = (after.b.z, h - model.distance(force));
    // the rest point ln(f_max/F − 1) carries the rounding of F near f_max
    let near = share.min(1.0 - share).max(EPSILON);
    let rounding = 16.0 * EPSILON * (h.abs() + model.distance(force).abs() + h_min / near);
    assert!(way * rest >= 0.0 || way.abs() <= rounding, "{way:e} away from rest at {rest:e}");
    assert!(way.abs() <= rest.abs() + rounding, "{way:e} beyond rest at {rest:e}");
    let mismatch = (force - model.force(h)).abs();
    let rate = alpha * mismatch;
    // where the rate underflows it says nothing
    let first = if rate.is_normal() || mismatch == 0.0 { rate * dt } else { f64::INFINITY };
    let lost = alpha * dt * f_max * 32.0 * EPSILON;
    assert!(!first.is_finite() || way.abs() <= first + lost + rounding, "{way:e} farther than {first:e}");
}

/// A lattice of triangles of a millimetre, shaken, some far from the origin.
fn lattice(shake: &[f64], centre: &Vector3<f64>) -> TriMesh {
    let (cells, edge) = (8u32, 1e-3);
    let id = |i: u32, j: u32| j * (cells + 1) + i;
    let nodes = (0..=cells).flat_map(|j| (0..=cells).map(move |i| (f64::from(i) - 4.0, f64::from(j) - 4.0)));
    let positions = nodes.enumerate().map(|(at, (x, y))| {
        let [a, b, c] = [0, 1, 2].map(|k| shake[(3 * at + k) % shake.len()]);
        Point3::new((x + 0.3 * a) * edge, (y + 0.3 * b) * edge, 0.2 * c * edge) + centre
    });
    let faces = (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j)));
    let faces = faces
        .flat_map(|(i, j)| [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]]);
    TriMesh::new(positions.collect(), faces.collect()).unwrap()
}

fn refiner(mesh: &TriMesh) -> Refiner {
    let tip = TipParams { radius: 1.5e-3, stiffness: Some(2e4) };
    // carving moves a region of its own
    Refiner::new(mesh.clone(), RefineParams { carve: None, ..RefineParams::robust(tip) }).unwrap()
}

fn pressed(tick: i64, centre: Point3<f64>, force: Vector3<f64>) -> Sample {
    let pose_ot = Isometry3::from_parts(centre.coords.into(), UnitQuaternion::identity());
    Sample { stamp_ns: tick * 1_000_000, pose_ot, wrench: Wrench { force, torque: Vector3::zeros() } }
}

/// Eq 1, 4, 5 and the weights of the region, on one push.
fn check_push(shake: &[f64], centre: &Vector3<f64>, force: &Vector3<f64>, depth: f64) {
    let mesh = lattice(shake, centre);
    let mut refiner = refiner(&mesh);
    let normal = force.normalize();
    let at = Point3::from(*centre) + normal * (1.5e-3 + depth);
    let mut before = mesh.positions().to_vec();
    for tick in 1..4 {
        let update = refiner.push(&pressed(tick, at, *force)).unwrap();
        let Some(mismatch) = update.mismatch else { continue };
        let [a, b, c] = mesh.corners(mismatch.face).map(|v| before[v.0 as usize]);
        let n = (b - a).cross(&(c - a)).normalize();
        // the corners relative to the first: nothing large is subtracted
        let barycentre = (b - a + (c - a)) / 3.0;
        let h = (at - a - normal * 1.5e-3 - barycentre).dot(&n);
        let rounding = 64.0 * EPSILON * (centre.norm() + 1e-2);
        assert!((mismatch.distance - h).abs() <= rounding * (1.0 + 1e-3 / 1e-4), "{:e} {h:e}", mismatch.distance);
        let felt = normal * force.dot(&normal);
        let size = felt.norm() + mismatch.expected_force_o.norm();
        assert!((mismatch.linear + mismatch.expected_force_o - felt).norm() <= 8.0 * EPSILON * size);
        // the cross product stands across both, and is as long as its parallelogram
        let squared = mismatch.expected_force_o.norm_squared() * felt.norm_squared();
        let cosine = mismatch.expected_force_o.dot(&felt);
        let area = mismatch.rotational.norm_squared() + cosine * cosine;
        assert!((area - squared).abs() <= 32.0 * EPSILON * squared, "{area:e} {squared:e}");
        let way = |v: VertexId| (refiner.mesh().position(v) - before[v.0 as usize]).norm();
        let handle = mesh.corners(mismatch.face).map(way).into_iter().fold(0.0, f64::max);
        for vertex in (0..mesh.vertex_count() as u32).map(VertexId) {
            if update.fit.is_some() && refiner.moved_vertices().contains(&vertex) {
                // weights are not negative and sum to 1 at most: nothing moves farther than the handle
                assert!(way(vertex) <= handle * (1.0 + 1e-12) + rounding, "{:e} {handle:e}", way(vertex));
            }
        }
        before = refiner.mesh().positions().to_vec();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn eq_3_is_an_exponential_over_a_hyperbolic_cosine(f_max in any_size(), h_min in any_size(), delta in -800.0..800.0f64, h in any_signed()) {
        check_force(f_max, h_min, delta, h);
        check_force(f_max, h_min, delta, h_min * h.clamp(-700.0, 700.0));
    }

    #[test]
    fn the_inverse_of_eq_3_is_reached_wherever_the_force_is(f_max in any_size(), delta in -20.0..20.0f64, share in prop_oneof![
        0.0..1.0, (-308.0..0.0f64).prop_map(|x| 10f64.powf(x)), (-16.0..-1.0f64).prop_map(|x| 1.0 - 10f64.powf(x)),
    ]) {
        check_inverse(f_max, delta, share);
    }

    #[test]
    fn eq_7_lets_the_tangent_of_half_the_angle_fall(n in unit(), to in unit(), tilt in prop_oneof![
        0.0..3.0f64, (-300.0..0.0f64).prop_map(|x| 10f64.powf(x)), (-12.0..0.0f64).prop_map(|x| std::f64::consts::PI - 10f64.powf(x)),
    ], exponent in any_signed()) {
        let axis = Unit::new_normalize(n.cross(&to) + 1e-3 * n.cross(&Vector3::x()) + 1e-3 * n.cross(&Vector3::y()));
        let to = (UnitQuaternion::from_axis_angle(&axis, tilt) * n).normalize();
        check_turn(&n, &to, exponent.clamp(-30.0, 30.0));
        prop_assert!((turn(&n, &to, exponent).norm() - 1.0).abs() <= 2.0 * EPSILON);
    }

    #[test]
    fn a_spring_falls_exponentially(stiffness in any_size(), alpha in any_size(), dt in any_size(), h in any_signed(), force in any_signed()) {
        check_spring(stiffness, alpha, dt, h, force);
    }

    #[test]
    fn eq_6_goes_to_rest_and_not_over_it(
        h_min in any_size(), f_max in any_size(), alpha in any_size(), dt in any_size(), u in prop_oneof![-40.0..40.0f64, -700.0..700.0f64],
        share in prop_oneof![0.0..1.0, (-300.0..0.0f64).prop_map(|x| 10f64.powf(x)), (-15.0..-1.0f64).prop_map(|x| 1.0 - 10f64.powf(x))],
        scaled in -12.0..12.0f64,
    ) {
        check_position(h_min, f_max, alpha, share, u, dt);
        check_position(1e-3, 10.0, 0.1, share, u, 10f64.powf(scaled) * 1e-3);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn eq_1_4_and_5_hold_on_a_mesh_and_nothing_moves_farther_than_the_handle(
        shake in prop::collection::vec(-1.0..1.0f64, 50..51), far in prop_oneof![Just(0.0), 0.0..900.0f64], tilt_x in -0.3..0.3f64,
        tilt_y in -0.3..0.3f64, size in 1.0..50.0f64, depth in -1e-4..1e-4f64,
    ) {
        let force = size * Vector3::new(tilt_x, tilt_y, 1.0).normalize();
        check_push(&shake, &Vector3::new(far, -0.5 * far, 0.1 * far), &force, depth);
    }
}

/// The same samples, again and on another thread at the same time: the same bits.
#[test]
fn a_refiner_gives_the_same_bits_again_and_on_another_thread() {
    let shake: Vec<f64> = (0..50).map(|i| (f64::from(i) * 12.9898).sin()).collect();
    let run = || {
        let mut refiner = refiner(&lattice(&shake, &Vector3::zeros()));
        for tick in 1..2_000 {
            let way = 1e-6 * tick as f64;
            let force = Vector3::new(0.3 * (way * 3e3).sin(), 0.2, 2.0);
            refiner.push(&pressed(tick, Point3::new(way - 1e-3, 0.3e-3, 1.4e-3), force)).unwrap();
        }
        assert!(refiner.counts().moved > 1_000, "{:?}", refiner.counts());
        refiner.mesh().positions().iter().flat_map(|p| p.coords.map(f64::to_bits).data.0[0]).collect::<Vec<u64>>()
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

/// h/h_min beyond the largest number on either side; a denormal h_min; cancellation of h/h_min with δ.
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

/// So nearly opposite that the square of the difference underflows (the normal was NaN then), opposite to rounding, equal to rounding, and an exponent whose exponential is denormal or nothing.
#[test]
fn the_worst_turns_of_eq_7() {
    let n = Vector3::z();
    for tilt in [0.0, 5e-324, 1e-160, 1e-16, 1.0, std::f64::consts::PI - 1e-15, std::f64::consts::PI] {
        let to = Vector3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
        for exponent in [5e-324, 1e-300, 1e-16, 0.7, 36.0, 709.0, 745.2, 1e300] {
            for sign in [1.0, -1.0] {
                let turned = turn(&n, &to, sign * exponent);
                assert!((turned.norm() - 1.0).abs() <= 2.0 * EPSILON, "{tilt:e} {exponent:e}: {}", turned.norm());
                let (before, after) = (n.dot(&to), turned.dot(&to));
                assert!(sign * (after - before) >= -4.0 * EPSILON, "{tilt:e} {exponent:e} turns the wrong way");
            }
        }
    }
}

/// At the joint of series and closed form, and where −αkt is denormal or its exponential nothing.
#[test]
fn the_worst_springs() {
    for z in [5e-324, 1e-300, 1e-16, 0.999_999_999_999_999_9, 1.0, 1.000_000_000_000_000_2, 745.2, 1e300] {
        for (h, force) in
            [(1.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, -1.0 + EPSILON), (1e-300, 5e-324), (1e150, -1e150)]
        {
            check_spring(1.0, 1.0, z, h, force);
        }
    }
}

/// α f_max underflowed though α f_max dt does not, and the face went 1e118 times as far as its rest point.
#[test]
fn a_product_that_underflows_on_its_way_does_not_pass_for_no_time() {
    check_position(
        4.763_543_788_795_485e-264,
        2.071_989_792_837_727_6e-73,
        5e-324,
        0.892_780_769_709_675_7,
        0.0,
        4.2e251,
    );
    let face = dynamics(sigmoid(1e-200, 1e-200, 0.0), 1e-200, 0.0)
        .step(&UP, &Point3::new(0.0, 0.0, 1e-200), &(Vector3::z() * 5e-201), 1e250)
        .unwrap();
    // T = 1e50: at rest, where f is half of f_max, at h = 0
    assert!((face.b.z - 1e-200).abs() < 1e-214, "{:e}", face.b.z);
}

/// At 1e299 scaled times overflowed on the way from u = −700, and the face was 1e299 m away: that is refused now.
#[test]
fn the_worst_positions_of_eq_6() {
    for u in [-700.0, -40.0, -1e-16, 0.0, 1e-16, 36.7, 40.0, 700.0] {
        for share in [5e-324, 1e-300, 1e-16, 0.5, 0.5 + EPSILON, 1.0 - 0.5 * EPSILON] {
            for dt in [5e-324, 1e-200, 1e-16, 1.0, 1e16, 1e279, 1e299] {
                check_position(1.0, 1.0, 1.0, share, u, dt);
            }
        }
    }
}
