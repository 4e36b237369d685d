//! A wavy plate as a structured grid, smooth, open, of any number of faces, and a sliding ball, for
//! measuring the cost of a push.

use nalgebra::{Isometry3, Point3, Vector3};

use touchup_geometry::mesh::{MeshError, TriMesh};
use touchup_method::stylus::{Sample, Wrench};

/// Default side of the plate, m.
pub const SIDE: f64 = 0.3;
/// Radius of the ball, m.
pub const RADIUS: f64 = 1.5e-3;
/// Stiffness of its stylus, N/m.
pub const STIFFNESS: f64 = 2e4;
/// Pressing force of the ball, N.
pub const FORCE: f64 = 2.0;
/// Time between two samples, ns.
pub const STEP_NS: i64 = 1_000_000;
/// Depth of the part below the scan, m: every contact moves vertices.
const DEPTH: f64 = 0.05e-3;
/// Noise of the tracker on each axis, of [`noisy_slide_on`], m.
const NOISE: f64 = 0.03e-3;
/// m/s
const SPEED: f64 = 0.05;
/// Distance between two lines of the raster, m.
const LINE: f64 = 0.7e-3;

/// Height over (x, y), m: waves of 40 mm and 2 mm amplitude.
pub fn height(x: f64, y: f64) -> f64 {
    let wave = std::f64::consts::TAU / 0.04;
    2e-3 * (wave * x).sin() * (wave * y).cos()
}

/// About `faces` triangles over the square from 0 to [`SIDE`].
///
/// # Errors
/// As [`plate`].
pub fn wavy_plate(faces: usize) -> Result<TriMesh, MeshError> {
    plate(faces, SIDE)
}

/// About `faces` triangles over the square from 0 to `side` (m).
///
/// # Errors
/// [`MeshError::TooMany`] beyond the range of 32-bit ids.
pub fn plate(faces: usize, side: f64) -> Result<TriMesh, MeshError> {
    let n = ((faces as f64 / 2.0).sqrt().round() as u32).max(1);
    height_field(n, |i| side * f64::from(i) / f64::from(n), height)
}

/// The surface z = `height`(x, y) over a square grid of `n` by `n` cells, two triangles each,
/// outward up.
///
/// - `at`: x or y of line `i` of the grid, m.
pub(crate) fn height_field(
    n: u32,
    at: impl Fn(u32) -> f64,
    height: impl Fn(f64, f64) -> f64,
) -> Result<TriMesh, MeshError> {
    let on = |i: u32, j: u32| Point3::new(at(i), at(j), height(at(i), at(j)));
    let positions = (0..=n)
        .flat_map(|j| (0..=n).map(move |i| (i, j)))
        .map(|(i, j)| on(i, j))
        .collect();
    let id = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        [
            [id(i, j), id(i + 1, j), id(i + 1, j + 1)],
            [id(i, j), id(i + 1, j + 1), id(i, j + 1)],
        ]
    });
    TriMesh::new(positions, triangles.collect())
}

/// Sample `i` of a raster over the middle of the plate of [`SIDE`], at 50 mm/s and 1 kHz.
///
/// - `width`: of the raster, m; it starts over at its end.
pub fn slide(i: usize, width: f64) -> Sample {
    slide_on(SIDE, i, width)
}

/// As [`slide`], on a plate of `side` (m).
pub fn slide_on(side: f64, i: usize, width: f64) -> Sample {
    let (contact, normal) = contact_on(side, i, width);
    let reported = contact + normal * (RADIUS - FORCE / STIFFNESS);
    let wrench = Wrench {
        force: normal * FORCE,
        torque: Vector3::zeros(),
    };
    Sample {
        stamp_ns: i as i64 * STEP_NS,
        pose_ot: Isometry3::translation(reported.x, reported.y, reported.z),
        wrench,
    }
}

/// Sample `i` of [`slide_on`] with evenly spread noise of the tracker, the same each time.
pub fn noisy_slide_on(side: f64, i: usize, width: f64) -> Sample {
    let mut sample = slide_on(side, i, width);
    let mut state = i as u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 12f64.sqrt() * NOISE
    };
    draw();
    sample.pose_ot.translation.vector += Vector3::new(draw(), draw(), draw());
    sample
}

/// Contact point of ball and part at sample `i` of [`slide_on`], m, and the outward normal there.
pub fn contact_on(side: f64, i: usize, width: f64) -> (Point3<f64>, Vector3<f64>) {
    let length = 0.8 * side;
    let travel = SPEED * i as f64 * STEP_NS as f64 * 1e-9;
    let (line, along) = ((travel / length).floor(), travel % length);
    let x = 0.1 * side
        + if line % 2.0 == 0.0 {
            along
        } else {
            length - along
        };
    let y = 0.1 * side + (line * LINE) % width;
    let slope = 1e-6;
    let normal = Vector3::new(
        (height(x - slope, y) - height(x + slope, y)) / (2.0 * slope),
        (height(x, y - slope) - height(x, y + slope)) / (2.0 * slope),
        1.0,
    )
    .normalize();
    (Point3::new(x, y, height(x, y)) - normal * DEPTH, normal)
}
