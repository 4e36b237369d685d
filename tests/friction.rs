//! The felt normal and the friction found, against simulated touches of surfaces known in closed form.
//!
//! The stylus of the simulator adds friction, noise and clock errors; the truth is the surface's own normal under the
//! true centre. `--nocapture` or `--show-output` shows the tables.

use nalgebra::{Point3, UnitVector3, Vector3};
use touchup::patch::{TouchFinder, TouchFinderParams};
use touchup::refine::{SlidingParams, TipMotion, TipParams};
use touchup::sim::{Bounds, Moment, SensorParams, Stroke, StylusParams, Surface, SurfacePoint, touch};
use touchup::touch::{
    Compensator, CompensatorParams, ContactGate, ContactGateParams, Friction, LocalMotion, Sample, Sliding, SyncParams,
    Synchroniser,
};

const SEEDS: u64 = 20;
const RADIUS: f64 = 1.5e-3;
const STIFFNESS: f64 = 20e3;

/// A surface whose distance is a formula. All come near the origin from below, normals up there.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// z = 0
    Plane,
    /// of this radius, m
    Sphere(f64),
    /// along x, of this radius, m
    Rod(f64),
    /// the inside of a cylinder along x, of this radius, m
    Trough(f64),
}

impl Surface for Shape {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        (p - self.closest(p).point).dot(&self.closest(p).normal)
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        let from = |centre: Point3<f64>, radius: f64, sign: f64| {
            let away = (p - centre).normalize();
            SurfacePoint { point: centre + away * radius, normal: away * sign }
        };
        match *self {
            Self::Plane => SurfacePoint { point: Point3::new(p.x, p.y, 0.0), normal: Vector3::z() },
            Self::Sphere(radius) => from(Point3::new(0.0, 0.0, -radius), radius, 1.0),
            Self::Rod(radius) => from(Point3::new(p.x, 0.0, -radius), radius, 1.0),
            Self::Trough(radius) => from(Point3::new(p.x, 0.0, radius), radius, -1.0),
        }
    }

    fn bounds(&self) -> Bounds {
        Bounds::around(&[Point3::origin()]).unwrap().grown(20e-3)
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        if self.signed_distance(p) <= reach {
            found.push(self.closest(p));
        }
    }
}

/// Lines to and fro in eight directions, 16 mm long, at 15 to 45 mm/s.
fn lines() -> Vec<Stroke> {
    let press = UnitVector3::new_unchecked(-Vector3::z());
    let mut strokes = Vec::new();
    for line in 0..16u32 {
        let turn = std::f64::consts::TAU * f64::from(line * 5 % 16) / 16.0;
        let along = Vector3::new(turn.cos(), turn.sin(), 0.0) * 8e-3;
        let speed = 15e-3 + 2e-3 * f64::from(line);
        let at = |share: f64, z: f64| Point3::new(0.0, 0.0, z) + along * share;
        strokes.push(Stroke { points: vec![at(-1.0, 8e-3)], press: None, speed: 60e-3 });
        strokes.push(Stroke { points: vec![at(-1.0, -12e-3), at(1.0, -12e-3)], press: Some(press), speed });
        strokes.push(Stroke { points: vec![at(1.0, 8e-3)], press: None, speed: 60e-3 });
    }
    strokes
}

/// What the stylus reported, and what really was.
struct Stream {
    samples: Vec<Sample>,
    moments: Vec<Moment>,
    start_ns: i64,
}

fn stream(shape: Shape, friction: f64, pose_noise: f64, seed: u64) -> Stream {
    // a stylus calibrated well enough: the issue is friction
    let sensor = SensorParams { pose_noise, force_noise: 0.05, force_bias: 0.0, ..SensorParams::default() };
    let stylus = StylusParams { radius: RADIUS, stiffness: STIFFNESS, friction, sensor, ..StylusParams::default() };
    let touched = touch(&shape, &lines(), &stylus, seed).unwrap();
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    let mut samples = Vec::new();
    for message in touched.messages {
        sync.push(message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    Stream { samples, moments: touched.moments, start_ns: sensor.start_ns }
}

impl Stream {
    /// The true normal at a time, where the ball slides faster than 10 mm/s.
    fn truth(&self, shape: Shape, stamp_ns: i64) -> Option<Vector3<f64>> {
        let at = usize::try_from((stamp_ns - self.start_ns + 500_000) / 1_000_000).ok()?;
        let centre = |at: usize| self.moments.get(at).map(|moment| Point3::from(moment.pose_ot.translation.vector));
        let way = centre(at + 10)? - centre(at.checked_sub(10)?)?;
        (way.norm() > 10e-3 * 20e-3).then(|| shape.closest(&centre(at)?).normal.into()).flatten()
    }
}

/// Errors of many normals, degrees.
#[derive(Default)]
struct Errors(Vec<f64>);

impl Errors {
    fn note(&mut self, normal: &Vector3<f64>, truth: &Vector3<f64>) {
        self.0.push(normal.cross(truth).norm().atan2(normal.dot(truth)).to_degrees());
    }

    /// Median and 90th percentile.
    fn figures(&mut self) -> [f64; 2] {
        self.0.sort_unstable_by(f64::total_cmp);
        [0.5, 0.9].map(|share| self.0[(share * (self.0.len() - 1) as f64) as usize])
    }
}
