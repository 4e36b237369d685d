//! Extremes of meshes and streams: a refiner in the robust mode.

use nalgebra::{Isometry3, Point3, Vector3};

use super::case::{CaseOutcome, Extreme, refused};
use touchup_geometry::mesh::{MeshError, TriMesh};
use touchup_method::haptic::{RefineError, RefineParams, Refiner};
use touchup_method::stylus::{Sample, SampleError, TipParams, Wrench};

/// Longest leg of a triangle, m.
const EDGE: f64 = 2e-3;
const RADIUS: f64 = 1.5e-3;
/// N/m
const STIFFNESS: f64 = 2e4;
const FORCE_N: f64 = 2.0;
/// Depth of the true surface below the scan, m.
const DEPTH: f64 = 0.05e-3;
const MILLISECOND_NS: i64 = 1_000_000;
/// Place of most touches, m.
const PLACE: [f64; 2] = [0.3e-3, 0.1e-3];

/// Vertices and faces.
type MeshShape = (Vec<Point3<f64>>, Vec<[u32; 3]>);
type MeshOutcome = CaseOutcome<RefineError>;

/// A flat square of 6 × 6 cells in the plane z = 0 around `centre`.
fn square(edge: f64, centre: &Vector3<f64>) -> MeshShape {
    let (cells, row) = (6, 7);
    let at = |i: u32| (f64::from(i) - 0.5 * f64::from(cells)) * edge;
    let positions = (0..row * row).map(|k| Point3::new(at(k % row), at(k / row), 0.0) + centre);
    let corners = (0..cells * cells).map(|k| k % cells + k / cells * row);
    let faces = corners.flat_map(|a| [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
    (positions.collect(), faces.collect())
}

fn plain() -> MeshShape {
    square(EDGE, &Vector3::zeros())
}

fn refiner((positions, faces): MeshShape) -> Result<Refiner, RefineError> {
    let tip = TipParams {
        radius: RADIUS,
        stiffness: Some(STIFFNESS),
    };
    Refiner::new(TriMesh::new(positions, faces)?, RefineParams::robust(tip))
}

/// A ball at rest under `force`, its lowest point at `point` if nothing bends.
fn sample(tick: i64, point: Point3<f64>, radius: f64, force: Vector3<f64>) -> Sample {
    let reported = point + Vector3::z() * radius - force / STIFFNESS;
    let wrench = Wrench {
        force,
        torque: Vector3::zeros(),
    };
    Sample {
        stamp_ns: tick * MILLISECOND_NS,
        pose_ot: Isometry3::translation(reported.x, reported.y, reported.z),
        wrench,
    }
}

fn down() -> Vector3<f64> {
    Vector3::z() * FORCE_N
}

/// A point at [`PLACE`], `z` above the plane of the square.
fn over(z: f64) -> Point3<f64> {
    Point3::new(PLACE[0], PLACE[1], z)
}

/// Presses for one second on a true surface `depth` below the scan: final depth of the mesh, m, and
/// whether the mesh is sound (all finite, no face turned over) and within a fifth of the depth.
fn press(
    refiner: &mut Refiner,
    point: Point3<f64>,
    radius: f64,
    depth: f64,
) -> Result<(f64, bool), RefineError> {
    for tick in 1..=1000 {
        refiner.push(&sample(tick, point, radius, down()))?;
    }
    let mesh = refiner.mesh();
    let is_sound = mesh
        .positions()
        .iter()
        .all(|p| p.iter().all(|x| x.is_finite()))
        && mesh.faces().all(|(face, _)| mesh.normal(face).z >= 0.0);
    let hit = refiner.closest_face(&Point3::new(point.x, point.y, 0.0), 1.0);
    let found = hit.map_or(f64::NAN, |hit| -hit.point.z);
    Ok((found, is_sound && (found - depth).abs() < 0.2 * depth))
}

/// Presses at a place, with the true surface [`DEPTH`] below the scan.
fn pressed(shape: MeshShape, [x, y]: [f64; 2]) -> MeshOutcome {
    let mut refiner = refiner(shape)?;
    let (depth, is_right) = press(&mut refiner, Point3::new(x, y, -DEPTH), RADIUS, DEPTH)?;
    Ok((
        format!(
            "surface {:.1} um down, {} updates cut back",
            1e6 * depth,
            refiner.counts().cut_back
        ),
        is_right,
    ))
}

/// A refused sample leaves every bit of the mesh unchanged.
fn unchanged(
    mut refiner: Refiner,
    bad: &Sample,
    is_right: impl Fn(&RefineError) -> bool,
) -> MeshOutcome {
    let before = refiner.mesh().positions().to_vec();
    let pushed = refiner.push(bad).map(drop);
    refused(pushed, |error| {
        is_right(error) && refiner.mesh().positions() == before
    })
}

fn is_absurd(error: &RefineError) -> bool {
    matches!(error, RefineError::Sample(SampleError::Absurd { .. }))
}

pub(super) fn rows() -> Vec<Extreme> {
    [samples(), shapes_and_sizes()].concat()
}

fn samples() -> Vec<Extreme> {
    // after a good sample
    let bad = |change: fn(&mut Sample), is_right: fn(&RefineError) -> bool| -> MeshOutcome {
        let good = sample(5, over(-DEPTH), RADIUS, down());
        let mut bad = Sample {
            stamp_ns: 6 * MILLISECOND_NS,
            ..good
        };
        change(&mut bad);
        let mut refiner = refiner(plain())?;
        refiner.push(&good)?;
        unchanged(refiner, &bad, is_right)
    };
    let is_not_finite =
        |error: &RefineError| matches!(error, RefineError::Sample(SampleError::NotFinite { .. }));
    let is_late =
        |error: &RefineError| matches!(error, RefineError::Sample(SampleError::NotAfter { .. }));
    let kept = "a refusal that names it, and not one bit of the mesh changed";
    vec![
        Extreme::fed("a sample with a NaN").should(kept).gave(bad(|bad| bad.wrench.force.y = f64::NAN, is_not_finite)),
        Extreme::fed("a sample at infinity")
            .should(kept)
            .gave(bad(|bad| bad.pose_ot.translation.vector.x = f64::INFINITY, is_not_finite)),
        Extreme::fed("a sample of 1e7 N")
            .should("a refusal, and not one bit changed: no sensor measures that, a unit is wrong")
            .gave(bad(|bad| bad.wrench.force.z = 1e7, is_absurd)),
        Extreme::fed("a sample older than the last")
            .should("a refusal, and not one bit changed: what happened in between is done")
            .gave(bad(|bad| bad.stamp_ns = 4 * MILLISECOND_NS, is_late)),
        Extreme::fed("no force 1 mm above the mesh for 1 s")
            .should("not one bit changed: a stylus that hovers touches nothing")
            .gave(unmoved(Vector3::zeros())),
        Extreme::fed("2 N against the normal for 1 s")
            .should("not one bit changed: the contact is on another surface, or a fault")
            .gave(unmoved(-down())),
        Extreme::fed("10 s without a sample, then one")
            .should("the step of a held sample ends after 30 ms: what happened in the pause is not known")
            .gave(paused()),
    ]
}

/// A second of `force` with the ball above the mesh: inside the mesh it would rightly carve.
fn unmoved(force: Vector3<f64>) -> MeshOutcome {
    let mut refiner = refiner(plain())?;
    let before = refiner.mesh().positions().to_vec();
    for tick in 1..=1000 {
        refiner.push(&sample(tick, over(1e-3), RADIUS, force))?;
    }
    let moved = refiner
        .mesh()
        .positions()
        .iter()
        .zip(&before)
        .filter(|(p, q)| p != q)
        .count();
    Ok((format!("{moved} vertices moved"), moved == 0))
}

fn paused() -> MeshOutcome {
    let run = |pause_ms: i64| -> Result<_, RefineError> {
        let mut refiner = refiner(plain())?;
        for tick in [1, 1 + pause_ms] {
            refiner.push(&sample(tick, over(-DEPTH), RADIUS, down()))?;
        }
        Ok(refiner.mesh().positions().to_vec())
    };
    let (short, long) = (run(30)?, run(10_000)?);
    let off = short
        .iter()
        .zip(&long)
        .map(|(p, q)| (p - q).norm())
        .fold(0.0, f64::max);
    Ok((
        format!("{off:.1e} m from what a pause of 30 ms does"),
        off <= 1e-9,
    ))
}

fn shapes_and_sizes() -> Vec<Extreme> {
    let (positions, faces) = plain();
    // one extra vertex, and a face of it with two others
    let with = |corner: Point3<f64>, [a, b]: [u32; 2]| {
        let added = [a, b, positions.len() as u32];
        (
            [&positions[..], &[corner]].concat(),
            [&faces[..], &[added]].concat(),
        )
    };
    // a face of one edge, along a side in the middle; a fin on an edge of two faces
    let flat = with(
        positions[24] + (positions[25] - positions[24]) * 0.5,
        [24, 25],
    );
    let fin = with(positions[17] - Vector3::z() * EDGE, [17, 18]);
    let doubled = (positions.clone(), faces.repeat(2));
    let corner = [-3.0 * EDGE + 0.2e-3, -3.0 * EDGE + 0.1e-3];
    let mut bad = positions.clone();
    bad[3].y = f64::NAN;
    vec![
        Extreme::fed("a face without area among good ones")
            .should("the mesh comes down to the true surface and stays sound: such a face has no say")
            .gave(pressed(flat, PLACE)),
        Extreme::fed("a press at a corner of an open mesh")
            .should("down to the true surface, sound: a border is no wall")
            .gave(pressed(plain(), corner)),
        Extreme::fed("an edge of three faces")
            .should("down to the true surface, sound: scans have such edges")
            .gave(pressed(fin, PLACE)),
        Extreme::fed("every face twice")
            .should("down to the true surface, sound: both copies share their corners")
            .gave(pressed(doubled, PLACE)),
        Extreme::fed("a vertex that is NaN")
            .should("a refusal that names the vertex")
            .gave(refused(TriMesh::new(bad, faces), |error| *error == MeshError::NotFinite { vertex: 3 })),
        Extreme::fed("a mesh without faces")
            .should("a refusal: there is nothing to touch")
            .gave(refused(refiner((positions, vec![])), |error| *error == RefineError::Mesh(MeshError::Empty))),
        Extreme::fed("a mesh 1e6 m from the origin")
            .should(
                "a refusal of the sample that says so, or a mesh refined as at the origin: never a mesh quietly \
                 off by roundings",
            )
            .gave(far_away()),
        Extreme::fed("a mesh 1e-6 m large under a ball of 1e-7 m")
            .should("down to the true surface, sound: only ratios of lengths count")
            .gave(tiny()),
    ]
}

fn far_away() -> MeshOutcome {
    let centre = Vector3::new(1e6, 0.0, 0.0);
    match refiner(square(EDGE, &centre)) {
        Ok(refiner) => unchanged(
            refiner,
            &sample(1, over(-DEPTH) + centre, RADIUS, down()),
            is_absurd,
        ),
        error => refused(error, |_| true),
    }
}

fn tiny() -> MeshOutcome {
    let (edge, radius, depth) = (2e-7, 1e-7, 5e-9);
    // a probe so stiff that it bends by less than the size of the mesh
    let stiffness = 2e9;
    let params = RefineParams::robust(TipParams {
        radius,
        stiffness: Some(stiffness),
    });
    let (positions, faces) = square(edge, &Vector3::zeros());
    let mut refiner = Refiner::new(TriMesh::new(positions, faces)?, params)?;
    let point = Point3::new(3e-8, 1e-8, -depth) + down() / STIFFNESS - down() / stiffness;
    let (found, is_right) = press(&mut refiner, point, radius, depth)?;
    let (nm, of_nm, cut_back) = (1e9 * found, 1e9 * depth, refiner.counts().cut_back);
    Ok((
        format!("surface {nm:.2} nm down of {of_nm:.2} nm, {cut_back} updates cut back"),
        is_right,
    ))
}
