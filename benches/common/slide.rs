//! A ball slides over the wavy plate at 50 mm/s and 1 kHz.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::touch::{Sample, Wrench};

use crate::wavy::{SIDE, height};

/// Of the ball, m.
pub const RADIUS: f64 = 1.5e-3;
/// N/m
pub const STIFFNESS: f64 = 2e4;
/// Pressed with.
pub const FORCE_N: f64 = 2.0;
/// The part lies this much below the scan, m.
const DEPTH: f64 = 0.05e-3;
/// m/s
const SPEED: f64 = 0.05;
/// Time between two samples, ns.
pub const STEP_NS: i64 = 1_000_000;

/// Sample `i` of a raster over the middle of the plate, one line each 0.7 mm, again and again over `width` (m) of it.
pub fn sample(i: usize, width: f64) -> Sample {
    let length = 0.8 * SIDE;
    let way = SPEED * i as f64 * STEP_NS as f64 * 1e-9;
    let (line, along) = ((way / length).floor(), way % length);
    let x = 0.1 * SIDE + if line % 2.0 == 0.0 { along } else { length - along };
    let y = 0.1 * SIDE + (line * 0.7e-3) % width;
    let slope = 1e-6;
    let normal = Vector3::new(
        (height(x - slope, y) - height(x + slope, y)) / (2.0 * slope),
        (height(x, y - slope) - height(x, y + slope)) / (2.0 * slope),
        1.0,
    )
    .normalize();
    let contact = Point3::new(x, y, height(x, y)) - normal * DEPTH;
    let reported = contact + normal * (RADIUS - FORCE_N / STIFFNESS);
    let wrench = Wrench { force: normal * FORCE_N, torque: Vector3::zeros() };
    Sample { stamp_ns: i as i64 * STEP_NS, pose_ot: Isometry3::translation(reported.x, reported.y, reported.z), wrench }
}
