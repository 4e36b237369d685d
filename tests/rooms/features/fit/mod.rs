//! Fits against known surfaces: bias, stated uncertainty, outliers, few and lopsided points.

mod laws;
mod monte_carlo;
mod outliers;
mod refusals;
mod slots;
mod wander;

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;
use touchup::features::fit::{Cylinder, Observation};

const MM: f64 = 1e-3;

fn generator(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

fn between(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    let share: f64 = StandardUniform.sample(rng);
    low + (high - low) * share
}

fn shaken(rng: &mut Pcg64, sigma: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(rng)) * sigma
}

/// Points on a cylinder of radius `r` about z, over an arc (rad) and a height, each a group of its
/// own, without errors.
fn on_cylinder(rng: &mut Pcg64, r: f64, arc: f64, height: f64, count: u32) -> Vec<Observation> {
    (0..count)
        .map(|i| {
            let angle = arc * (f64::from(i) + between(rng, 0.0, 1.0)) / f64::from(count);
            let z = between(rng, -0.5, 0.5) * height;
            Observation {
                point: Point3::new(r * angle.cos(), r * angle.sin(), z),
                offset: 0.0,
                sigma: 1e-6,
                group: i,
            }
        })
        .collect()
}

/// A hole about z of another frame, near the true one.
fn hole_near(pose: &Isometry3<f64>, r: f64) -> Cylinder {
    let off = Vector3::new(0.1, -0.05, 0.02) * r;
    Cylinder::new(
        pose * Point3::from(off),
        &(pose * Vector3::new(0.03, -0.02, 1.0)),
        1.1 * r,
        true,
    )
}

/// Mean and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (
        mean,
        (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt(),
    )
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}
