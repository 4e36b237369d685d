//! The published rule on one face: figures that follow from its equations alone.

use touchup::haptic::Case;

use super::*;

/// h_min, δ, f_max, α of METHOD 1, in SI.
const H_MIN: f64 = 0.5e-3;
const DELTA: f64 = 5.0;
const F_MAX: f64 = 10.0;
const ALPHA: f64 = 0.1;

/// One face of 20 mm in the plane z = 0, under a point.
fn one_face() -> Refiner {
    let p = |x, y| Point3::new(x, y, 0.0);
    let face = TriMesh::new(
        vec![p(-10e-3, -6e-3), p(10e-3, -6e-3), p(0.0, 12e-3)],
        vec![[0, 1, 2]],
    )
    .unwrap();
    Refiner::new(
        face,
        RefineParams::paper(TipParams {
            radius: 0.0,
            stiffness: None,
        }),
    )
    .unwrap()
}

/// Height of the face after holding the tip at `tip_z` with `force` along z for `ticks`; it stays
/// level.
fn height(tip_z: f64, force: f64, ticks: i64) -> f64 {
    let mut refiner = one_face();
    for tick in 0..=ticks {
        refiner
            .push(&sample(
                tick,
                Point3::new(0.0, 0.0, tip_z),
                Vector3::z() * force,
            ))
            .unwrap();
    }
    let heights: Vec<_> = refiner.mesh().positions().iter().map(|p| p.z).collect();
    assert!(
        heights.iter().all(|z| (z - heights[0]).abs() < 1e-12),
        "{heights:?}"
    );
    heights[0]
}

/// METHOD 2.2: f(h) = F at h = −h_min (δ − ln(f_max/F − 1)); the face floats that far above the
/// tip.
#[test]
fn one_face_rests_off_the_surface_by_the_rigid_contact_bias() {
    let figures = [(1.0, 1.401), (2.0, 1.807), (4.0, 2.297)];
    for (force, millimetres) in figures {
        let bias = H_MIN * (DELTA - (F_MAX / force - 1.0f64).ln());
        assert!(
            (bias * 1e3 - millimetres).abs() < 1e-3,
            "the figure by hand"
        );
        let found = height(0.0, force, 20_000);
        println!("{force} N: {:.3} mm above the tip", found * 1e3);
        assert!(
            (found - bias).abs() < 1e-9,
            "{force} N: {found:e} m, {bias:e} m expected"
        );
    }
}

/// METHOD 2.3: hovering 1 mm above a face with no force pushes it away, 0.52 mm in the first
/// second. With F = 0, du/dt = α f(h) / h_min and u + e^u = u₀ + e^u₀ + α f_max t / h_min.
#[test]
fn one_face_flees_from_a_stylus_that_hovers() {
    let start = 1e-3 / H_MIN + DELTA;
    let right = start + start.exp() + ALPHA * F_MAX / H_MIN;
    // the left side rises: halve the bracket
    let (mut lo, mut hi) = (start, start + 10.0);
    for _ in 0..100 {
        let middle = (lo + hi) / 2.0;
        if middle + middle.exp() < right {
            lo = middle
        } else {
            hi = middle
        }
    }
    let travel = (lo - start) * H_MIN;
    let found = -height(1e-3, 0.0, 1_000);
    println!("{:.3} mm in one second", found * 1e3);
    assert!(
        (found - travel).abs() < 1e-9,
        "{found:e} m, {travel:e} m expected"
    );
    assert!((found * 1e3 - 0.52).abs() < 0.01, "the figure of METHOD");
}

/// At F ≥ f_max the printed rule has no equilibrium: the face rises by α (F − f_max) and more,
/// which a count reports. Just below it there is one, far away: h_min (δ + ln 199) = 5.15 mm at
/// 9.95 N.
#[test]
fn beyond_f_max_the_printed_rule_runs_away_and_is_counted() {
    let bias = H_MIN * (DELTA + 199f64.ln());
    let found = height(0.0, 9.95, 60_000);
    assert!(
        (found - bias).abs() < 1e-6,
        "{found:e} m, {bias:e} m expected"
    );
    let mut refiner = one_face();
    for tick in 0..=2_000 {
        refiner
            .push(&sample(tick, Point3::origin(), Vector3::z() * 10.5))
            .unwrap();
    }
    let found = refiner.mesh().position(VertexId(0)).z;
    let least = ALPHA * (10.5 - F_MAX) * 2.0;
    assert!(found > least && found < 2.0 * least, "{found} m");
    assert_eq!(refiner.counts().clamped, 2_001);
}

/// Fig 5: the measured force is above f(0), the expected one is above f(0) for a tip in the face.
/// F* and both mismatches are those of Eq 2, 4 and 5 in each case.
#[test]
fn all_four_cases_have_an_expected_force_and_both_mismatches() {
    let at_face = F_MAX / (1.0 + DELTA.exp());
    for (tip_z, force, case) in [
        (1e-3, 0.9 * at_face, Case::Free),
        (-1e-3, 0.9 * at_face, Case::MeshOnly),
        (1e-3, 1.1 * at_face, Case::SurfaceOnly),
        (-1e-3, 1.1 * at_face, Case::Both),
    ] {
        let mut refiner = one_face();
        let felt = Vector3::new(0.6, 0.0, 0.8) * force;
        let update = refiner
            .push(&sample(0, Point3::new(0.0, 0.0, tip_z), felt))
            .unwrap();
        let mismatch = update.mismatch.unwrap();
        let expected = Vector3::z() * (F_MAX / (1.0 + (tip_z / H_MIN + DELTA).exp()));
        assert_eq!(update.case, case, "tip at {tip_z}, {force} N");
        assert!(
            (mismatch.distance - tip_z).abs() < 1e-15
                && (mismatch.expected_force_o - expected).norm() < 1e-14 * F_MAX
        );
        assert!((mismatch.linear - (felt - expected)).norm() < 1e-14 * F_MAX);
        assert!((mismatch.rotational - expected.cross(&felt)).norm() < 1e-14 * F_MAX);
    }
}
