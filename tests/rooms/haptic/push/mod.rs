//! The refiner from outside: the permitted, required and forbidden effects of a push.

mod adversary;
mod extreme;
mod paper;
mod plate;
mod refusal;
mod region;
mod strokes;

use nalgebra::{Isometry3, Point3, Vector3, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::haptic::{CarveParams, RefineParams, Refiner};
use touchup::mesh::{TriMesh, VertexId};
use touchup::stylus::{Sample, TipParams, TipShape, Wrench};

use crate::common::{grid, within};

/// Radius of the ball, m.
const RADIUS: f64 = 1.5e-3;
/// Stiffness of the tip, N/m.
const STIFFNESS: f64 = 20e3;
/// Time between samples, ns.
const TICK_NS: i64 = 1_000_000;
/// Edge of the scans, m.
const EDGE: f64 = 2.4e-3;

const BALL: TipParams = TipParams {
    radius: RADIUS,
    stiffness: Some(STIFFNESS),
};

/// The reported centre of the ball and the force on it, both in O, `tick` samples after the start.
fn sample(tick: i64, centre: Point3<f64>, force: Vector3<f64>) -> Sample {
    let wrench = Wrench {
        force,
        torque: Vector3::zeros(),
    };
    Sample {
        stamp_ns: tick * TICK_NS,
        pose_ot: Isometry3::translation(centre.x, centre.y, centre.z),
        wrench,
    }
}

/// A ball that slides over the true plane z = 0 in a raster of `lines` per direction, there and
/// across.
///
/// `force` gives N over the path length (m); friction `mu` pulls against the motion; the tip
/// deflects by F/k as a real one.
fn raster(
    half: f64,
    lines: usize,
    mu: f64,
    tip: &TipParams,
    force: impl Fn(f64) -> f64,
) -> Vec<Sample> {
    // 25 mm/s
    let step = 25e-3 * TICK_NS as f64 * 1e-9;
    let steps = (2.0 * half / step) as usize;
    let mut samples = vec![];
    for (across, line) in (0..2).flat_map(|across| (0..lines).map(move |line| (across == 1, line)))
    {
        let forth = line % 2 == 0;
        for i in 0..=steps {
            let along = if forth {
                -half + i as f64 * step
            } else {
                half - i as f64 * step
            };
            let aside = -half + 2.0 * half * line as f64 / (lines - 1) as f64;
            let (x, y) = if across {
                (aside, along)
            } else {
                (along, aside)
            };
            let back = if forth { -1.0 } else { 1.0 };
            let friction = if across {
                vector![0.0, back, 0.0]
            } else {
                vector![back, 0.0, 0.0]
            };
            let applied = (Vector3::z() + friction * mu) * force(samples.len() as f64 * step);
            let given = tip
                .stiffness
                .map_or(Vector3::zeros(), |stiffness| applied / stiffness);
            samples.push(sample(
                samples.len() as i64,
                Point3::new(x, y, tip.radius) - given,
                applied,
            ));
        }
    }
    samples
}

fn push_all(refiner: &mut Refiner, samples: &[Sample]) {
    samples.iter().for_each(|sample| {
        refiner.push(sample).unwrap();
    });
}

/// Every coordinate bit by bit.
fn bits(mesh: &TriMesh) -> Vec<[u64; 3]> {
    mesh.positions()
        .iter()
        .map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()])
        .collect()
}

/// A square of 15 × 15 cells with bumps of ±0.3 mm.
fn bumpy(seed: u64) -> TriMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    grid(15, EDGE, |_, _| within(&mut rng, -0.3e-3, 0.3e-3))
}

/// A rigid motion of up to half a turn and 0.3 m.
fn rigid() -> impl Strategy<Value = Isometry3<f64>> {
    (
        prop::array::uniform3(-0.3..0.3),
        prop::array::uniform3(-1.8..1.8),
    )
        .prop_map(|(shift, turn)| Isometry3::new(Vector3::from(shift), Vector3::from(turn)))
}

/// A push rounds coordinates below 0.5 m a few dozen times; bumps and normals hand a rounding on by
/// at most the size of the region over an edge. 2,000 pushes × 100 roundings.
const RIGID_TOL: f64 = 2_000.0 * 100.0 * 0.5 * f64::EPSILON;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn rigid_motion_commutes(motion in rigid(), seed in 0u64..1000, paper: bool) {
        let params = if paper { RefineParams::paper(BALL) } else { RefineParams::robust(BALL) };
        let scan = bumpy(seed);
        let there: Vec<_> = scan.positions().iter().map(|p| motion * p).collect();
        let faces: Vec<_> = scan.faces().map(|(_, corners)| corners.map(|v| v.0)).collect();
        let mut here = Refiner::new(scan, params).unwrap();
        let mut away = Refiner::new(TriMesh::new(there, faces).unwrap(), params).unwrap();
        // off the symmetry lines of the grid, which have two equally near faces
        let shift = vector![0.137e-3, 0.291e-3, 0.0];
        for sample in raster(8e-3, 2, 0.2, &BALL, |_| 2.0).iter().take(2_000) {
            let pose_ot = Isometry3::from_parts((sample.pose_ot.translation.vector + shift).into(), sample.pose_ot.rotation);
            here.push(&Sample { pose_ot, ..*sample }).unwrap();
            // the wrench is in the axes of the stylus, which turn with it
            away.push(&Sample { pose_ot: motion * pose_ot, ..*sample }).unwrap();
        }
        prop_assert!(here.counts().moved > 100);
        prop_assert_eq!(here.counts(), away.counts());
        let off = here.mesh().positions().iter().zip(away.mesh().positions()).map(|(p, q)| (motion * p - q).amax());
        let off = off.fold(0.0, f64::max);
        prop_assert!(off <= RIGID_TOL, "{off:e} m");
    }

    #[test]
    fn the_same_samples_give_the_same_bytes(seed: u64) {
        let run = || {
            let mut refiner = Refiner::new(bumpy(seed), RefineParams::robust(BALL)).unwrap();
            push_all(&mut refiner, &raster(6e-3, 3, 0.1, &BALL, |_| 2.0));
            (bits(refiner.mesh()), *refiner.counts())
        };
        prop_assert_eq!(run(), run());
    }
}

/// METHOD 2.3: the expected force of a hovering stylus would push the mesh away for ever.
#[test]
fn a_hovering_stylus_without_force_changes_nothing_for_ever() {
    for tip in [
        BALL,
        TipParams {
            stiffness: None,
            ..BALL
        },
    ] {
        let scan = bumpy(1);
        let before = bits(&scan);
        let mut refiner = Refiner::new(scan, RefineParams::robust(tip)).unwrap();
        let mut rng = Pcg64::seed_from_u64(7);
        for tick in 0..100_000 {
            // noise of a usual sensor, below the gate
            let noise = Vector3::from_fn(|_, _| within(&mut rng, -0.1, 0.1));
            // 1 mm above the highest bump
            let centre = Point3::new(
                within(&mut rng, -1e-2, 1e-2),
                within(&mut rng, -1e-2, 1e-2),
                RADIUS + 1.3e-3,
            );
            refiner
                .push(&sample(
                    tick,
                    centre,
                    if tick < 50_000 {
                        Vector3::zeros()
                    } else {
                        noise
                    },
                ))
                .unwrap();
        }
        assert!(bits(refiner.mesh()) == before);
        let counts = refiner.counts();
        assert_eq!(
            (counts.accepted, counts.moved, counts.contacts),
            (100_000, 0, 0)
        );
    }
}

// ---- carving

/// Depth of the ball in the mesh, m.
fn depth(mesh: &Refiner, centre: &Point3<f64>) -> f64 {
    RADIUS
        - mesh
            .closest_face(centre, f64::INFINITY)
            .unwrap()
            .distance_squared
            .sqrt()
}

/// A ball without a force sinks through a thin lid, down to 4 mm, and stays there: the remaining
/// depth is the tolerance plus the exponential's rest after a second. While moving at v = 20 mm/s,
/// carving by 300 per second keeps up at the depth tolerance + v/300 = 0.12 mm, for a face square
/// to the motion; for one that yields at a slant the path is up to three times as long.
#[test]
fn nothing_of_a_lid_stays_inside_the_ball_deeper_than_the_tolerance() {
    let CarveParams {
        tolerance, rate, ..
    } = CarveParams::default();
    let speed = 20e-3;
    for (x, y) in [(0.0, 0.0), (0.7e-3, 0.4e-3), (1.1e-3, 0.1e-3)] {
        let mut refiner =
            Refiner::new(grid(15, EDGE, |_, _| 0.0), RefineParams::robust(BALL)).unwrap();
        let lowest = RADIUS - 4e-3;
        let mut worst = 0.0f64;
        for tick in 0..2_000 {
            // from 1 mm above the lid
            let centre = Point3::new(
                x,
                y,
                (RADIUS + 1e-3 - speed * 1e-3 * tick as f64).max(lowest),
            );
            refiner
                .push(&sample(tick, centre, Vector3::zeros()))
                .unwrap();
            worst = worst.max(depth(&refiner, &centre));
        }
        let left = depth(&refiner, &Point3::new(x, y, lowest));
        println!(
            "ball at {x} {y}: {:.4} mm deep at worst, {:.4} mm at rest",
            worst * 1e3,
            left * 1e3
        );
        assert!(left < 1.02 * tolerance, "{left:e} m");
        assert!(worst < tolerance + 3.0 * speed / rate, "{worst:e} m");
        assert!(refiner.counts().contacts == 0 && refiner.counts().moved > 0);
    }
}

/// One update moves all faces inside the tip and not the closest alone, and none that it does not
/// enter.
#[test]
fn all_faces_inside_the_tip_move_at_once() {
    let flat = TipShape::Flat {
        edge_radius: 0.0,
        length: 6e-3,
    };
    for (shape, lowest) in [(TipShape::Ball, -RADIUS), (flat, 0.0)] {
        // a third of the ball: several faces are inside
        let edge = EDGE / 4.0;
        let mesh = grid(15, edge, |_, _| 0.0);
        // unfiltered, so that the tip gets from one place to the next at once
        let params = RefineParams {
            shape,
            sliding: None,
            ..RefineParams::robust(BALL)
        };
        let mut refiner = Refiner::new(mesh.clone(), params).unwrap();
        // the tip is 0.5 mm deep in the lid, after a stretch in free air
        let centre = Point3::new(0.3e-3, 0.2e-3, -0.5e-3 - lowest);
        (0..100).for_each(|tick| {
            refiner
                .push(&sample(tick, centre + Vector3::z() * 0.1, Vector3::zeros()))
                .unwrap();
        });
        refiner
            .push(&sample(100, centre, Vector3::zeros()))
            .unwrap();
        let moved = |v: &VertexId| refiner.mesh().position(*v) != mesh.position(*v);
        let count = (0..mesh.vertex_count() as u32)
            .map(VertexId)
            .filter(moved)
            .count();
        assert!(count > 3 && refiner.counts().moved > 1, "{count} vertices");
        for (face, corners) in mesh
            .faces()
            .filter(|(_, corners)| corners.iter().all(moved))
        {
            let from_axis = mesh.barycentre(face).xy() - centre.xy();
            assert!(from_axis.norm() < RADIUS + edge, "{corners:?}");
        }
    }
}

/// The lid has gone down; the ball goes up again: unswept parts keep their place.
#[test]
fn a_ball_that_leaves_takes_nothing_with_it() {
    let mut refiner = Refiner::new(grid(15, EDGE, |_, _| 0.0), RefineParams::robust(BALL)).unwrap();
    let centre =
        |tick: i64| Point3::new(0.3e-3, 0.2e-3, RADIUS + 1e-3 - 20e-6 * tick.min(100) as f64);
    (0..1000).for_each(|tick| {
        refiner
            .push(&sample(tick, centre(tick), Vector3::zeros()))
            .unwrap();
    });
    let down = bits(refiner.mesh());
    assert!(refiner.mesh().positions().iter().all(|p| p.z <= 0.0));
    (1000..1100).for_each(|tick| {
        refiner
            .push(&sample(tick, centre(1100 - tick), Vector3::zeros()))
            .unwrap();
    });
    assert!(bits(refiner.mesh()) == down);
}

/// Vertices of a mesh within `half` of the middle, seen from above.
fn inner(mesh: &TriMesh, half: f64) -> impl Iterator<Item = Point3<f64>> + '_ {
    let all = (0..mesh.vertex_count() as u32).map(|v| mesh.position(VertexId(v)));
    all.filter(move |p| p.x.abs() < half && p.y.abs() < half)
}
