//! Extremes of meshes and streams: a refiner in the robust mode.

use nalgebra::{Isometry3, Point3, Vector3};

use super::case::{CaseOutcome, Extreme, extreme, refused};
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
/// Where most samples touch, m.
const PLACE: [f64; 2] = [0.3e-3, 0.1e-3];

/// Vertices and faces.
type Shape = (Vec<Point3<f64>>, Vec<[u32; 3]>);
type Outcome = CaseOutcome<RefineError>;

/// A flat square of 6 × 6 cells in the plane z = 0 around `centre`.
fn square(edge: f64, centre: &Vector3<f64>) -> Shape {
    let (cells, row) = (6, 7);
    let at = |i: u32| (f64::from(i) - 0.5 * f64::from(cells)) * edge;
    let positions = (0..row * row).map(|k| Point3::new(at(k % row), at(k / row), 0.0) + centre);
    let corners = (0..cells * cells).map(|k| k % cells + k / cells * row);
    let faces = corners.flat_map(|a| [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
    (positions.collect(), faces.collect())
}

fn plain() -> Shape {
    square(EDGE, &Vector3::zeros())
}

fn refiner((positions, faces): Shape) -> Result<Refiner, RefineError> {
    let tip = TipParams { radius: RADIUS, stiffness: Some(STIFFNESS) };
    Refiner::new(TriMesh::new(positions, faces)?, RefineParams::robust(tip))
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

/// At [`PLACE`], `z` above the plane of the square.
fn over(z: f64) -> Point3<f64> {
    Point3::new(PLACE[0], PLACE[1], z)
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

/// Presses at a place for one second, the true surface [`DEPTH`] below the scan: sound, and down to it within a fifth of the
/// depth.
fn pressed(shape: Shape, [x, y]: [f64; 2]) -> Outcome {
    let mut refiner = refiner(shape)?;
    for tick in 1..=1000 {
        refiner.push(&sample(tick, Point3::new(x, y, -DEPTH), RADIUS, down()))?;
    }
    let depth = depth_at(&refiner, [x, y]);
    let words = format!("surface {:.1} um down, {} updates cut back", 1e6 * depth, refiner.counts().cut_back);
    Ok((words, is_sound(refiner.mesh()) && (depth - DEPTH).abs() < 0.2 * DEPTH))
}

/// One refused sample after a good one leaves every bit of the mesh.
fn unchanged([good, bad]: [Sample; 2], is_right: impl Fn(&RefineError) -> bool) -> Outcome {
    let mut refiner = refiner(plain())?;
    refiner.push(&good)?;
    let before = refiner.mesh().positions().to_vec();
    let pushed = refiner.push(&bad).map(drop);
    refused(pushed, |error| is_right(error) && refiner.mesh().positions() == before)
}

pub(super) fn rows() -> Vec<Extreme> {
    [samples(), shapes(), sizes()].concat()
}

fn samples() -> Vec<Extreme> {
    let good = sample(5, over(-DEPTH), RADIUS, down());
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
        extreme("a sample with a NaN", kept, unchanged(nan, is_not_finite)),
        extreme("a sample at infinity", kept, unchanged(infinite, is_not_finite)),
        extreme(
            "a sample of 1e7 N",
            "a refusal, and not one bit changed: no sensor measures that, a unit is wrong",
            unchanged(huge, |error| matches!(error, RefineError::Sample(SampleError::Absurd { .. }))),
        ),
        extreme(
            "a sample older than the last",
            "a refusal, and not one bit changed: what happened in between is done",
            unchanged(backward, |error| matches!(error, RefineError::Sample(SampleError::NotAfter { .. }))),
        ),
        extreme(
            "no force 1 mm above the mesh for 1 s",
            "not one bit changed: a stylus that hovers touches nothing",
            unmoved(Vector3::zeros()),
        ),
        extreme(
            "2 N against the normal for 1 s",
            "not one bit changed: the contact is on another surface, or a fault",
            unmoved(-down()),
        ),
        extreme(
            "10 s without a sample, then one",
            "the step of a held sample ends after 30 ms: what happened in the pause is not known",
            paused(),
        ),
    ]
}

/// A second of `force` with the ball above the mesh: one inside it would rightly carve.
fn unmoved(force: Vector3<f64>) -> Outcome {
    let mut refiner = refiner(plain())?;
    let before = refiner.mesh().positions().to_vec();
    for tick in 1..=1000 {
        refiner.push(&sample(tick, over(1e-3), RADIUS, force))?;
    }
    let moved = refiner.mesh().positions().iter().zip(&before).filter(|(p, q)| p != q).count();
    Ok((format!("{moved} vertices moved"), moved == 0))
}

fn paused() -> Outcome {
    let run = |pause_ms: i64| -> Result<_, RefineError> {
        let mut refiner = refiner(plain())?;
        for tick in [1, 1 + pause_ms] {
            refiner.push(&sample(tick, over(-DEPTH), RADIUS, down()))?;
        }
        Ok(refiner.mesh().positions().to_vec())
    };
    let (short, long) = (run(30)?, run(10_000)?);
    let off = short.iter().zip(&long).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
    Ok((format!("{off:.1e} m from what a pause of 30 ms does"), off <= 1e-9))
}

fn shapes() -> Vec<Extreme> {
    let (positions, faces) = plain();
    // one vertex more, and a face of it with two others
    let with = |corner: Point3<f64>, [a, b]: [u32; 2]| {
        let added = [a, b, positions.len() as u32];
        ([&positions[..], &[corner]].concat(), [&faces[..], &[added]].concat())
    };
    // a face of one edge, laid along a side in the middle; a fin on an edge of two faces
    let flat = with(positions[24] + (positions[25] - positions[24]) * 0.5, [24, 25]);
    let fin = with(positions[17] - Vector3::z() * EDGE, [17, 18]);
    let doubled = (positions.clone(), faces.repeat(2));
    let corner = [-3.0 * EDGE + 0.2e-3, -3.0 * EDGE + 0.1e-3];
    let mut bad = positions.clone();
    bad[3].y = f64::NAN;
    vec![
        extreme(
            "a face without area among good ones",
            "the mesh comes down to the true surface and stays sound: such a face has no say",
            pressed(flat, PLACE),
        ),
        extreme(
            "a press at a corner of an open mesh",
            "down to the true surface, sound: a border is no wall",
            pressed(plain(), corner),
        ),
        extreme(
            "an edge of three faces",
            "down to the true surface, sound: scans have such edges",
            pressed(fin, PLACE),
        ),
        extreme(
            "every face twice",
            "down to the true surface, sound: both copies share their corners",
            pressed(doubled, PLACE),
        ),
        extreme(
            "a vertex that is NaN",
            "a refusal that names the vertex",
            refused(TriMesh::new(bad, faces), |error| *error == MeshError::NotFinite { vertex: 3 }),
        ),
        extreme(
            "a mesh without faces",
            "a refusal: there is nothing to touch",
            refused(refiner((positions, vec![])), |error| *error == RefineError::Mesh(MeshError::Empty)),
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

fn far_away() -> Outcome {
    let centre = Vector3::new(1e6, 0.0, 0.0);
    let mut refiner = match refiner(square(EDGE, &centre)) {
        Ok(refiner) => refiner,
        error => return refused(error, |_| true),
    };
    let before = refiner.mesh().positions().to_vec();
    let pushed = refiner.push(&sample(1, over(-DEPTH) + centre, RADIUS, down())).map(drop);
    refused(pushed, |error| {
        let is_named = matches!(error, RefineError::Sample(SampleError::Absurd { .. }));
        is_named && refiner.mesh().positions() == before
    })
}

fn tiny() -> Outcome {
    let (edge, radius, depth, place) = (2e-7, 1e-7, 5e-9, [3e-8, 1e-8]);
    // a probe so stiff that it does not bend by more than such a mesh is large
    let stiffness = 2e9;
    let params = RefineParams::robust(TipParams { radius, stiffness: Some(stiffness) });
    let (positions, faces) = square(edge, &Vector3::zeros());
    let mut refiner = Refiner::new(TriMesh::new(positions, faces)?, params)?;
    for tick in 1..=1000 {
        let point = Point3::new(place[0], place[1], -depth) + down() / STIFFNESS - down() / stiffness;
        refiner.push(&sample(tick, point, radius, down()))?;
    }
    let found = depth_at(&refiner, place);
    let (nm, of_nm, cut_back) = (1e9 * found, 1e9 * depth, refiner.counts().cut_back);
    let words = format!("surface {nm:.2} nm down of {of_nm:.2} nm, {cut_back} updates cut back");
    Ok((words, is_sound(refiner.mesh()) && (found - depth).abs() < 0.2 * depth))
}
