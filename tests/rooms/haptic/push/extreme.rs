//! Numbers at the ends of the range of floats: every vertex keeps finite coordinates.

use super::*;
use touchup::haptic::GuardParams;
use touchup::mesh::is_place;

use crate::full::either;

/// Samples of each.
const SAMPLES: i64 = 40;

/// A number of either sign, of any size that floats have, or at one of their ends.
fn any_size(rng: &mut Pcg64) -> f64 {
    let ends = [
        0.0,
        5e-324,
        f64::MIN_POSITIVE,
        1e-200,
        1e-162,
        1e-154,
        1e-81,
        f64::EPSILON,
        1.0,
    ];
    let size = match within(rng, 0.0, 3.0) as usize {
        0 => ends[within(rng, 0.0, ends.len() as f64) as usize],
        1 => 10f64.powf(within(rng, -323.0, -3.0)),
        _ => 10f64.powf(within(rng, -20.0, -2.0)),
    };
    if within(rng, -1.0, 1.0) < 0.0 {
        -size
    } else {
        size
    }
}

fn any_vector(rng: &mut Pcg64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| any_size(rng))
}

/// Triangles in a fan, each corner a number of any size off another: needles, points that coincide,
/// faces without area.
fn needles(rng: &mut Pcg64) -> TriMesh {
    let mut positions = vec![
        Point3::origin(),
        Point3::new(1e-2, 0.0, 0.0),
        Point3::new(0.0, 1e-2, 0.0),
    ];
    let mut faces = vec![[0, 1, 2]];
    for next in 3..12u32 {
        let near = positions[within(rng, 0.0, f64::from(next)) as usize];
        positions.push(near + any_vector(rng));
        faces.push([next - 2, next - 1, next]);
        faces.push([next - 3, next, next - 1]);
    }
    TriMesh::new(positions, faces).unwrap()
}

fn all_settings() -> Vec<RefineParams> {
    let robust = RefineParams::robust(BALL);
    let rigid = RefineParams::robust(TipParams {
        stiffness: None,
        ..BALL
    });
    vec![
        robust,
        rigid,
        RefineParams {
            guard: None,
            ..robust
        },
        RefineParams {
            gate: None,
            ..robust
        },
        RefineParams::paper(BALL),
    ]
}

/// Balls whose centre, and points of contact that, are a number of any size off a vertex, an edge
/// or a face, pressed by any force.
#[test]
fn no_float_brings_a_vertex_to_nowhere() {
    let runs = either(400, 20_000);
    let (mut moved, mut refused) = (0, 0);
    for seed in 0..runs {
        let rng = &mut Pcg64::seed_from_u64(seed);
        let mesh = needles(rng);
        let settings = all_settings();
        let params = settings[seed as usize % settings.len()];
        let mut refiner = Refiner::new(mesh, params).unwrap();
        for tick in 0..SAMPLES {
            let faces: Vec<_> = refiner.mesh().faces().map(|(face, _)| face).collect();
            let [a, b, c] = refiner
                .mesh()
                .triangle(faces[within(rng, 0.0, faces.len() as f64) as usize]);
            let [u, v] = [within(rng, 0.0, 1.0), within(rng, 0.0, 1.0)];
            let on = match within(rng, 0.0, 3.0) as usize {
                0 => a,
                1 => a + (b - a) * u,
                _ => a + (b - a) * u + (c - a) * (v * (1.0 - u)),
            };
            let out = if within(rng, -1.0, 1.0) < 0.0 {
                Vector3::zeros()
            } else {
                Vector3::z() * RADIUS
            };
            let force = match within(rng, 0.0, 3.0) as usize {
                0 => Vector3::zeros(),
                1 => any_vector(rng) * 1e3,
                _ => Vector3::new(any_size(rng), any_size(rng), 2.0),
            };
            match refiner.push(&sample(tick, on + out + any_vector(rng), force)) {
                Ok(_) => {}
                Err(_) => refused += 1,
            }
            let nowhere = refiner.mesh().positions().iter().position(|p| !is_place(p));
            assert_eq!(nowhere, None, "seed {seed}, sample {tick}");
        }
        moved += refiner.counts().moved;
    }
    // the runs are no runs of refusals
    assert!(
        moved > 2 * runs && refused < runs,
        "{moved} moved, {refused} refused of {}",
        runs * SAMPLES as u64
    );
}

/// The case that wrote NaN: a ball without force, its centre 1e-200 m off a face.
#[test]
fn a_ball_a_hair_off_a_face_carves_it_as_one_right_on_it() {
    for off in [0.0, 5e-324, 1e-200, -1e-200, 1e-162, 1e-100, 1e-15] {
        let params = RefineParams {
            guard: Some(GuardParams::default()),
            ..RefineParams::robust(BALL)
        };
        let mut refiner = Refiner::new(grid(15, EDGE, |_, _| 0.0), params).unwrap();
        for tick in 0..50 {
            refiner
                .push(&sample(
                    tick,
                    Point3::new(0.3e-3, 0.2e-3, off),
                    Vector3::zeros(),
                ))
                .unwrap();
        }
        let lowest = refiner
            .mesh()
            .positions()
            .iter()
            .map(|p| p.z)
            .fold(0.0, f64::min);
        let highest = refiner
            .mesh()
            .positions()
            .iter()
            .map(|p| p.z)
            .fold(0.0, f64::max);
        // carving moves a face along its normal, into the part
        assert!(
            lowest < -1e-6 && lowest.abs() < 2.0 * RADIUS && highest <= 1e-12,
            "{off:e}: {lowest:e} to {highest:e}"
        );
    }
}
