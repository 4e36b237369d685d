//! Flatness of planes of known form, touched with noise.

use nalgebra::{Point3, Rotation3, Vector3};
use rand::SeedableRng;
use rand::distr::Distribution;
use rand_distr::StandardNormal;
use touchup::form::{Estimate, FlatForm, FormPoint, flat_form, flatness};

/// Half sides of the touched part, m.
const SIDES: [f64; 2] = [20e-3, 12e-3];

/// A raster of 15 lines with noise that groups of ten points share.
fn touched(seed: u64, height: impl Fn(f64, f64) -> f64) -> FlatForm {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut normal =
        |sigma: f64| -> f64 { sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let turned = Rotation3::from_euler_angles(0.3, -0.8, 1.7);
    let mut points = Vec::new();
    for line in 0..15 {
        let y = SIDES[1] * (f64::from(line) / 7.0 - 1.0);
        for group in 0..20 {
            let shared = normal(10e-6);
            for i in 0..10 {
                let x = SIDES[0] * (f64::from(group * 10 + i) / 99.5 - 1.0);
                let z = height(x, y) + shared + normal(5e-6);
                points.push(FormPoint {
                    point: turned * Point3::new(x, y, z),
                    sigma: 11e-6,
                    group: line * 20 + group,
                });
            }
        }
    }
    let normal = turned * Vector3::new(1e-4, 2e-4, 1.0).normalize();
    flat_form(&points, &(turned * Point3::new(0.0, 0.0, 2e-6)), &normal).unwrap()
}

#[test]
fn flatness_is_off_by_its_uncertainty() {
    let saddle = |x: f64, y: f64| 25e-6 * x * y / (SIDES[0] * SIDES[1]);
    let bow = |x: f64, _: f64| 60e-6 * (x / SIDES[0]).powi(2);
    let wave =
        |x: f64, y: f64| 20e-6 * (4.0 * x / SIDES[0]).sin() + 10e-6 * (2.0 * y / SIDES[1]).cos();
    for (name, height) in [
        ("saddle", &saddle as &dyn Fn(f64, f64) -> f64),
        ("bow", &bow),
        ("wave", &wave),
    ] {
        let at = |i: i32, side: f64| side * f64::from(i) / 30.0;
        let places = (-30..=30).flat_map(|i| (-30..=30).map(move |j| (i, j)));
        let points: Vec<_> = places
            .map(|(i, j)| (at(i, SIDES[0]), at(j, SIDES[1])))
            .map(|(x, y)| Point3::new(x, y, height(x, y)))
            .collect();
        let truth = flatness(&points).unwrap();
        let (seeds, mut squares) = (150, 0.0);
        let (mut mean, mut std) = (0.0, 0.0);
        for seed in 0..seeds {
            let FlatForm { flatness, coverage } = touched(seed, height);
            assert!(coverage == 1.0, "{coverage}");
            let Estimate { value, std: own } = flatness.minimum_zone;
            squares += ((value - truth.minimum_zone) / own).powi(2) / f64::from(seeds as u32);
            mean += (value - truth.minimum_zone) * 1e6 / f64::from(seeds as u32);
            std += own * 1e6 / f64::from(seeds as u32);
        }
        let rms = squares.sqrt();
        println!(
            "{name}: truth {:.2}, mean error {mean:.2}, std {std:.2} µm; error/std {rms:.2}",
            truth.minimum_zone * 1e6
        );
        assert!((0.8..=1.25).contains(&rms), "{name}: {rms}");
    }
}

#[test]
fn a_flat_wall_is_found_flat_to_its_uncertainty() {
    let all: Vec<Estimate> = (0..60)
        .map(|seed| touched(seed, |_, _| 0.0).flatness.minimum_zone)
        .collect();
    let inside = all.iter().filter(|e| e.value <= e.std).count();
    println!("{inside} of 60 contain 0; std {:.1} µm", all[0].std * 1e6);
    assert!(inside >= 57, "{inside} of 60");
    assert_eq!(flat_form(&[], &Point3::origin(), &Vector3::z()), None);
}
