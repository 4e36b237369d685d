//! A sphere with noise, touched by a ball all over: the error before and after.
//!
//! cargo run --release --example refine_sphere

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use touchup::haptic::{RefineParams, Refiner};
use touchup::mesh::TriMesh;
use touchup::sim::add_vertex_noise;
use touchup::stylus::{Sample, TipParams, Wrench};

/// Of the sphere, m.
const RADIUS: f64 = 20e-3;
/// Per axis, m.
const NOISE: f64 = 0.2e-3;
const BALL: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(20e3),
};
/// Pressing force of the ball, N.
const FORCE: f64 = 2.5;

fn main() -> anyhow::Result<()> {
    let mut scan = sphere(60, 30)?;
    add_vertex_noise(&mut scan, NOISE, &Vector3::zeros(), 1);
    let before = mean_error(&scan);

    let params = RefineParams {
        scan_noise: NOISE,
        ..RefineParams::robust(BALL)
    };
    let mut refiner = Refiner::new(scan, params)?;
    for sample in spiral(60, 60_000) {
        refiner.push(&sample)?;
    }
    let after = mean_error(refiner.mesh());
    println!(
        "mean error {:.3} mm -> {:.3} mm, {:?}",
        before * 1e3,
        after * 1e3,
        refiner.counts()
    );
    Ok(())
}

/// The point of the unit sphere at `turns` around z and `down` (0 to 1) from pole to pole.
fn on_unit_sphere(turns: f64, down: f64) -> Vector3<f64> {
    let (longitude, polar) = (turns * TAU, down * TAU / 2.0);
    Vector3::new(
        polar.sin() * longitude.cos(),
        polar.sin() * longitude.sin(),
        polar.cos(),
    )
}

/// One minute at 1 kHz: from pole to pole in `turns`, pressed along the normal. The tip deflects by
/// FORCE / stiffness.
fn spiral(turns: u32, samples: u32) -> impl Iterator<Item = Sample> {
    let reach = RADIUS + BALL.radius - BALL.stiffness.map_or(0.0, |stiffness| FORCE / stiffness);
    (0..samples).map(move |i| {
        let share = f64::from(i) / f64::from(samples);
        let normal = on_unit_sphere(share * f64::from(turns), share);
        let pose_ot = Isometry3::from_parts((normal * reach).into(), UnitQuaternion::identity());
        let wrench = Wrench {
            force: normal * FORCE,
            torque: Vector3::zeros(),
        };
        Sample {
            stamp_ns: i64::from(i) * 1_000_000,
            pose_ot,
            wrench,
        }
    })
}

/// Rings of vertices between two poles, faces counter-clockwise seen from outside.
fn sphere(around: u32, rings: u32) -> anyhow::Result<TriMesh> {
    let at = |i: u32, ring: u32| {
        f64::from(i) / f64::from(around) + f64::from(ring) / f64::from(2 * around)
    };
    let ring_points = |ring: u32| {
        (0..around).map(move |i| on_unit_sphere(at(i, ring), f64::from(ring) / f64::from(rings)))
    };
    let points = [Vector3::z()]
        .into_iter()
        .chain((1..rings).flat_map(ring_points))
        .chain([-Vector3::z()]);
    let positions: Vec<_> = points.map(|p| Point3::from(p * RADIUS)).collect();
    let (last, vertex) = (positions.len() as u32 - 1, |i: u32, ring: u32| {
        1 + (ring - 1) * around + i % around
    });
    let mut faces = Vec::new();
    for i in 0..around {
        faces.extend([
            [0, vertex(i, 1), vertex(i + 1, 1)],
            [last, vertex(i + 1, rings - 1), vertex(i, rings - 1)],
        ]);
        for ring in 1..rings - 1 {
            let [a, b, c, d] = [
                vertex(i, ring),
                vertex(i + 1, ring),
                vertex(i, ring + 1),
                vertex(i + 1, ring + 1),
            ];
            faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    Ok(TriMesh::new(positions, faces)?)
}

/// Mean distance of the vertices from the true sphere, m.
fn mean_error(mesh: &TriMesh) -> f64 {
    mesh.positions()
        .iter()
        .map(|p| (p.coords.norm() - RADIUS).abs())
        .sum::<f64>()
        / mesh.vertex_count() as f64
}
