//! Cost of one held sample for each step rule and each contact model.
//!
//! `usual`: 1 kHz, h_min 0.5 mm, tips within 2 mm of the face, 0.5–5 N, tilts up to 20°. `stiff`:
//! h_min 1e-3 mm, 5 ms.

use divan::{Bencher, black_box};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use touchup::haptic::{
    ContactModel, DynamicsParams, FaceDynamics, FaceState, MotionDirection, SigmoidParams, StepRule,
};

fn main() {
    divan::main();
}

const SAMPLES: usize = 1024;
const RULES: [&str; 4] = ["lie", "corrected", "bounded", "dp5"];
const SPRING: ContactModel = ContactModel::Spring {
    stiffness_n_per_m: 1e4,
};

fn sigmoid(h_min_m: f64) -> ContactModel {
    ContactModel::Sigmoid(SigmoidParams {
        f_max: 10.0,
        h_min: h_min_m,
        delta: 5.0,
    })
}

fn dynamics(rule: &str, model: ContactModel, along: MotionDirection) -> FaceDynamics {
    let rule = match rule {
        "lie" => StepRule::Lie,
        "corrected" => StepRule::DriftCorrected,
        "bounded" => StepRule::Bounded,
        _ => StepRule::DormandPrince,
    };
    let params = DynamicsParams {
        model,
        rule,
        along,
        ..DynamicsParams::default()
    };
    FaceDynamics::new(params).expect("the parameters are in range")
}

/// Tips and forces around a face at the origin that looks up.
fn samples(h_max_m: f64) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    (0..SAMPLES)
        .map(|_| {
            let p = Point3::new(
                between(-1e-3, 1e-3),
                between(-1e-3, 1e-3),
                between(-h_max_m, h_max_m),
            );
            (
                p,
                between(0.5, 5.0)
                    * Vector3::new(between(-0.25, 0.25), between(-0.25, 0.25), 1.0).normalize(),
            )
        })
        .collect()
}

fn run(bencher: Bencher, dynamics: FaceDynamics, h_max_m: f64, dt: f64) {
    let face = FaceState {
        b: Point3::origin(),
        n: Vector3::z(),
    };
    let samples = samples(h_max_m);
    for (p, force) in &samples {
        let end = dynamics
            .step(&face, p, force, dt)
            .expect("the samples are finite and not too stiff");
        assert!(
            (end.n.norm() - 1.0).abs() < 1e-15 && end.b.coords.norm() < 0.01 && end.b != face.b
        );
    }
    let mut next = samples.iter().cycle();
    bencher.bench_local(|| {
        let (p, force) = next.next().expect("a cycle does not end");
        dynamics.step(
            black_box(&face),
            black_box(p),
            black_box(force),
            black_box(dt),
        )
    });
}

#[divan::bench(args = RULES, sample_size = 100)]
fn usual(bencher: Bencher, rule: &str) {
    run(
        bencher,
        dynamics(rule, sigmoid(0.5e-3), MotionDirection::Force),
        2e-3,
        1e-3,
    );
}

#[divan::bench(args = RULES, sample_size = 100)]
fn usual_along_normal(bencher: Bencher, rule: &str) {
    run(
        bencher,
        dynamics(rule, sigmoid(0.5e-3), MotionDirection::InitialNormal),
        2e-3,
        1e-3,
    );
}

#[divan::bench(args = RULES, sample_size = 100)]
fn stiff(bencher: Bencher, rule: &str) {
    run(
        bencher,
        dynamics(rule, sigmoid(1e-6), MotionDirection::Force),
        1e-4,
        5e-3,
    );
}

#[divan::bench(args = RULES, sample_size = 100)]
fn spring(bencher: Bencher, rule: &str) {
    run(
        bencher,
        dynamics(rule, SPRING, MotionDirection::Force),
        2e-3,
        1e-3,
    );
}
