//! Extremes of meshes and streams: a refiner in the robust mode.

use nalgebra::{Isometry3, Point3, Vector3};

use super::{CaseOutcome, Extreme, extreme};
use touchup_core::haptic::{RefineError, RefineParams, Refiner, TipParams};
use touchup_core::mesh::{MeshError, TriMesh};
use touchup_core::stylus::{Sample, SampleError, Wrench};

/// Longest leg of a triangle, m.
const EDGE: f64 = 2e-3;
const RADIUS: f64 = 1.5e-3;
/// N/m
const STIFFNESS: f64 = 2e4;
const FORCE_N: f64 = 2.0;
/// Depth of the true surface below the scan, m.
const DEPTH: f64 = 0.05e-3;
const MILLISECOND_NS: i64 = 1_000_000;

/// A flat square of 6 × 6 cells in the plane z = 0 around `centre`.
fn square(edge: f64, centre: &Vector3<f64>) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let cells = 6u32;
    let at = |i: u32| (f64::from(i) - 0.5 * f64::from(cells)) * edge;
    let nodes = (0..=cells).flat_map(|j| (0..=cells).map(move |i| (i, j)));
    let positions = nodes.map(|(i, j)| Point3::new(at(i), at(j), 0.0) + centre).collect();
    let id = |i: u32, j: u32| j * (cells + 1) + i;
    let faces = (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j)));
    let faces = faces
        .flat_map(|(i, j)| [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]]);
    (positions, faces.collect())
}

fn plain() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    square(EDGE, &Vector3::zeros())
}

fn tip(radius: f64) -> TipParams {
    TipParams { radius, stiffness: Some(STIFFNESS) }
}

fn refiner((positions, faces): (Vec<Point3<f64>>, Vec<[u32; 3]>), radius: f64) -> Result<Refiner, RefineError> {
    Refiner::new(TriMesh::new(positions, faces)?, RefineParams::robust(tip(radius)))
}

/// A ball at rest under `force`, its lowest point at `point` where nothing bends.
fn sample(tick: i64, point: Point3<f64>, radius: f64, force: Vector3<f64>) -> Sample {
    let reported = point + Vector3::z() * radius - force / STIFFNESS;
    let wrench = Wrench { force, torque: Vector3::zeros() };
    Sample {
        stamp_ns: tick * MILLISECOND_NS,
        pose_ot: Isometry3::translation(reported.x, reported.y, reported.z),
        wrench,
    }
}

fn down() -> Vector3<f64> {
    Vector3::z() * FORCE_N
}

/// One second of pressing at (x, y), with the true surface [`DEPTH`] below the scan.
fn press(refiner: &mut Refiner, [x, y]: [f64; 2]) -> Result<(), RefineError> {
    (1..=1000).try_for_each(|tick| refiner.push(&sample(tick, Point3::new(x, y, -DEPTH), RADIUS, down())).map(drop))
}

/// All finite, and no face turned over.
fn is_sound(mesh: &TriMesh) -> bool {
    mesh.positions().iter().all(|p| p.iter().all(|x| x.is_finite()))
        && mesh.faces().all(|(face, _)| mesh.normal(face).z >= 0.0)
}

/// The depth of the surface under (x, y), m.
fn depth_at(refiner: &Refiner, [x, y]: [f64; 2]) -> f64 {
    refiner.closest_face(&Point3::new(x, y, 0.0), 1.0).map_or(f64::NAN, |hit| -hit.point.z)
}

/// Presses at a place: sound, and down to the true surface within a fifth of the depth.
fn pressed(shape: (Vec<Point3<f64>>, Vec<[u32; 3]>), place: [f64; 2]) -> CaseOutcome {
    let outcome = refiner(shape, RADIUS).and_then(|mut refiner| press(&mut refiner, place).map(|()| refiner));
    match outcome {
        Ok(refiner) => {
            let depth = depth_at(&refiner, place);
            let words = format!("surface {:.1} um down, {} updates cut back", 1e6 * depth, refiner.counts().cut_back);
            (words, is_sound(refiner.mesh()) && (depth - DEPTH).abs() < 0.2 * DEPTH)
        }
        Err(error) => (format!("refused: {error}"), false),
    }
}

/// One refused sample among good ones leaves every bit of the mesh.
fn unchanged(pushes: &[Sample], is_right: impl Fn(&RefineError) -> bool) -> CaseOutcome {
    let Ok(mut refiner) = refiner(plain(), RADIUS) else { return ("the square was refused".to_owned(), false) };
    let mut last = None;
    let mut before = refiner.mesh().positions().to_vec();
    for push in pushes {
        before = refiner.mesh().positions().to_vec();
        last = refiner.push(push).err();
    }
    match last {
        Some(error) => (format!("refused: {error}"), is_right(&error) && refiner.mesh().positions() == before),
        None => ("taken".to_owned(), false),
    }
}

pub(super) fn rows() -> Vec<Extreme> {
    [samples(), shapes(), sizes()].concat()
}

fn samples() -> Vec<Extreme> {
    let good = sample(5, Point3::new(0.3e-3, 0.1e-3, -DEPTH), RADIUS, down());
    let with = |change: fn(&mut Sample)| {
        let mut bad = Sample { stamp_ns: 6 * MILLISECOND_NS, ..good };
        change(&mut bad);
        [good, bad]
    };
    let nan = with(|bad| bad.wrench.force.y = f64::NAN);
    let infinite = with(|bad| bad.pose_ot.translation.vector.x = f64::INFINITY);
    let huge = with(|bad| bad.wrench.force.z = 1e7);
    let backward = with(|bad| bad.stamp_ns = 4 * MILLISECOND_NS);
    let is_not_finite = |error: &RefineError| matches!(error, RefineError::Sample(SampleError::NotFinite { .. }));
    let kept = "a refusal that names it, and not one bit of the mesh changed";
    vec![
        extreme("a sample with a NaN", kept, unchanged(&nan, is_not_finite)),
        extreme("a sample at infinity", kept, unchanged(&infinite, is_not_finite)),
        extreme(
            "a sample of 1e7 N",
            "a refusal, and not one bit changed: no sensor measures that, a unit is wrong",
            unchanged(&huge, |error| matches!(error, RefineError::Sample(SampleError::Absurd { .. }))),
        ),
        extreme(
            "a sample older than the last",
            "a refusal, and not one bit changed: what happened in between is done",
            unchanged(&backward, |error| matches!(error, RefineError::Sample(SampleError::NotAfter { .. }))),
        ),
        extreme(
            "no force 1 mm above the mesh for 1 s",
            "not one bit changed: a stylus that hovers touches nothing",
            hovering(),
        ),
        extreme(
            "2 N against the normal for 1 s",
            "not one bit changed: the contact is on another surface, or a fault",
            pulling(),
        ),
        extreme(
            "10 s without a sample, then one",
            "the step of a held sample ends after 30 ms: what happened in the pause is not known",
            paused(),
        ),
    ]
}

fn unmoved(pushes: impl Iterator<Item = Sample>) -> CaseOutcome {
    let Ok(mut refiner) = refiner(plain(), RADIUS) else { return ("the square was refused".to_owned(), false) };
    let before = refiner.mesh().positions().to_vec();
    for push in pushes {
        if let Err(error) = refiner.push(&push) {
            return (format!("refused: {error}"), false);
        }
    }
    let moved = refiner.mesh().positions().iter().zip(&before).filter(|(p, q)| p != q).count();
    (format!("{moved} vertices moved"), moved == 0)
}

fn hovering() -> CaseOutcome {
    unmoved((1..=1000).map(|tick| sample(tick, Point3::new(0.3e-3, 0.1e-3, 1e-3), RADIUS, Vector3::zeros())))
}

fn pulling() -> CaseOutcome {
    unmoved((1..=1000).map(|tick| {
        // the ball above the mesh: one inside it would rightly carve
        sample(tick, Point3::new(0.3e-3, 0.1e-3, 1e-3), RADIUS, -down())
    }))
}

fn paused() -> CaseOutcome {
    let run = |pause_ms: i64| {
        refiner(plain(), RADIUS).and_then(|mut refiner| {
            let point = Point3::new(0.3e-3, 0.1e-3, -DEPTH);
            refiner.push(&sample(1, point, RADIUS, down()))?;
            refiner.push(&sample(1 + pause_ms, point, RADIUS, down()))?;
            Ok(refiner.mesh().positions().to_vec())
        })
    };
    match (run(30), run(10_000)) {
        (Ok(short), Ok(long)) => {
            let off = short.iter().zip(&long).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
            (format!("{off:.1e} m from what a pause of 30 ms does"), off <= 1e-9)
        }
        (Err(error), _) | (_, Err(error)) => (format!("refused: {error}"), false),
    }
}

fn shapes() -> Vec<Extreme> {
    let middle = [0.3e-3, 0.1e-3];
    let (positions, faces) = plain();
    let of_faces = |more: Vec<[u32; 3]>| (positions.clone(), more);
    // a face of one edge, laid along a side in the middle
    let flat = {
        let (mut positions, mut faces) = plain();
        let (a, b) = (positions[24], positions[25]);
        positions.push(a + (b - a) * 0.5);
        faces.push([24, 25, positions.len() as u32 - 1]);
        (positions, faces)
    };
    // a fin on an edge of two faces
    let fin = {
        let (mut positions, mut faces) = plain();
        positions.push(positions[17] - Vector3::z() * EDGE);
        faces.push([17, 18, positions.len() as u32 - 1]);
        (positions, faces)
    };
    let mut doubled = faces.clone();
    doubled.extend(&faces);
    let corner = [-3.0 * EDGE + 0.2e-3, -3.0 * EDGE + 0.1e-3];
    let mut bad = positions.clone();
    bad[3].y = f64::NAN;
    vec![
        extreme(
            "a face without area among good ones",
            "the mesh comes down to the true surface and stays sound: such a face has no say",
            pressed(flat, middle),
        ),
        extreme(
            "a press at a corner of an open mesh",
            "down to the true surface, sound: a border is no wall",
            pressed(plain(), corner),
        ),
        extreme(
            "an edge of three faces",
            "down to the true surface, sound: scans have such edges",
            pressed(fin, middle),
        ),
        extreme(
            "every face twice",
            "down to the true surface, sound: both copies share their corners",
            pressed(of_faces(doubled), middle),
        ),
        extreme(
            "a vertex that is NaN",
            "a refusal that names the vertex",
            match TriMesh::new(bad, faces.clone()) {
                Err(error) => (format!("refused: {error}"), error == MeshError::NotFinite { vertex: 3 }),
                Ok(_) => ("taken".to_owned(), false),
            },
        ),
        extreme(
            "a mesh without faces",
            "a refusal: there is nothing to touch",
            match refiner(of_faces(vec![]), RADIUS) {
                Err(error) => (format!("refused: {error}"), error == RefineError::Mesh(MeshError::Empty)),
                Ok(_) => ("taken".to_owned(), false),
            },
        ),
    ]
}

fn sizes() -> Vec<Extreme> {
    vec![
        extreme(
            "a mesh 1e6 m from the origin",
            "a refusal of the sample that says so, or a mesh refined as at the origin: never a mesh quietly off by roundings",
            far_away(),
        ),
        extreme(
            "a mesh 1e-6 m large under a ball of 1e-7 m",
            "down to the true surface, sound: only ratios of lengths count",
            tiny(),
        ),
    ]
}

fn far_away() -> CaseOutcome {
    let centre = Vector3::new(1e6, 0.0, 0.0);
    let Ok(mut refiner) = refiner(square(EDGE, &centre), RADIUS) else {
        return ("the mesh was refused".to_owned(), true);
    };
    let before = refiner.mesh().positions().to_vec();
    match refiner.push(&sample(1, Point3::new(0.3e-3, 0.1e-3, -DEPTH) + centre, RADIUS, down())) {
        Err(error) => {
            let is_named = matches!(error, RefineError::Sample(SampleError::Absurd { .. }));
            (format!("refused: {error}"), is_named && refiner.mesh().positions() == before)
        }
        Ok(_) => ("taken".to_owned(), false),
    }
}

fn tiny() -> CaseOutcome {
    let (edge, radius, depth) = (2e-7, 1e-7, 5e-9);
    // a probe so stiff that it does not bend by more than such a mesh is large
    let stiffness = 2e9;
    let params = RefineParams::robust(TipParams { radius, stiffness: Some(stiffness) });
    let (positions, faces) = square(edge, &Vector3::zeros());
    let run = TriMesh::new(positions, faces).map_err(RefineError::from).and_then(|mesh| {
        let mut refiner = Refiner::new(mesh, params)?;
        for tick in 1..=1000 {
            let point = Point3::new(3e-8, 1e-8, -depth) + down() / STIFFNESS - down() / stiffness;
            refiner.push(&sample(tick, point, radius, down()))?;
        }
        Ok(refiner)
    });
    match run {
        Ok(refiner) => {
            let found = refiner.closest_face(&Point3::new(3e-8, 1e-8, 0.0), 1.0).map_or(f64::NAN, |hit| -hit.point.z);
            let words = format!(
                "surface {:.2} nm down of {:.2} nm, {} updates cut back",
                1e9 * found,
                1e9 * depth,
                refiner.counts().cut_back
            );
            (words, is_sound(refiner.mesh()) && (found - depth).abs() < 0.2 * depth)
        }
        Err(error) => (format!("refused: {error}"), false),
    }
}
