//! The patch as a mesh: closed, without intersections, on the surface, and one with the scan around
//! it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::io::mesh_file::{MeshUnit, read_mesh};
use touchup::mesh::triangle::shape_quality;
use touchup::mesh::{FaceId, FaceTree, TriMesh, VertexId, signed_distance};
use touchup::reconstruct::{
    Crossing, Cut, Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, OpenSquare, Owner, Patch,
    contour,
};

use crate::common::{grid, within};
use crate::soundness::{Soundness, intersections, rim_length, soundness};

type Field<'a> = &'a dyn Fn(&Point3<f64>) -> f64;

/// Pitch of most lattices here, m.
const PITCH: f64 = 0.75e-3;

fn lattice(pitch: f64) -> Lattice {
    Lattice {
        origin: Point3::new(0.137, -0.0931, 0.2713) * pitch,
        pitch,
    }
}

/// All cells from `-n` to `n` on each axis.
fn cube(n: i32) -> LatticeRegion {
    let side = || -n..=n;
    side()
        .flat_map(|x| side().flat_map(move |y| side().map(move |z| [x, y, z])))
        .collect()
}

fn node_values(lattice: &Lattice, region: &LatticeRegion, field: Field) -> NodeValues {
    let mut values = NodeValues::default();
    for (cell, ()) in region.iter() {
        for corner in 0..8 {
            let node: LatticeNode = std::array::from_fn(|i| cell[i] + (corner >> i & 1));
            values.insert_with(node, || field(&lattice.position(node)));
        }
    }
    values
}

/// Sign change of the field, by bisection; its normal by differences.
fn crossing(lattice: &Lattice, field: Field, edge: &Edge) -> Crossing {
    let [mut a, mut b] = [edge.node, edge.end()].map(|node| lattice.position(node));
    let is_inside = field(&a) < 0.0;
    for _ in 0..50 {
        let middle = nalgebra::center(&a, &b);
        if (field(&middle) < 0.0) == is_inside {
            a = middle
        } else {
            b = middle
        }
    }
    let h = 1e-4 * lattice.pitch;
    let slope = |i: usize| field(&(a + Vector3::ith(i, h))) - field(&(a - Vector3::ith(i, h)));
    Crossing {
        point: a,
        normal: vector![slope(0), slope(1), slope(2)].normalize(),
    }
}

fn patch_of(
    lattice: &Lattice,
    region: &LatticeRegion,
    scan: &TriMesh,
    tree: &FaceTree,
    field: Field,
) -> Patch {
    let values = node_values(lattice, region, field);
    let cut = Cut::new(lattice, region, scan, tree);
    assert!(cut.lost.is_empty());
    contour(lattice, region, &values, &cut, |edge| {
        crossing(lattice, field, edge)
    })
}

fn nothing() -> TriMesh {
    TriMesh::new(vec![], vec![]).unwrap()
}

/// The zero set of a field in a region, without a scan.
fn surface(lattice: &Lattice, region: &LatticeRegion, field: Field) -> TriMesh {
    let scan = nothing();
    patch_of(lattice, region, &scan, &FaceTree::new(&scan), field)
        .applied_to(scan.clone())
        .unwrap()
        .0
}

/// Closed, two-sided, without intersections, and of the given Euler characteristic.
fn assert_skin(mesh: &TriMesh, pitch: f64, euler: i64) {
    let sound = soundness(mesh);
    assert_eq!(
        sound,
        Soundness {
            euler,
            ..Default::default()
        }
    );
    assert!(intersections(mesh, pitch, |_| true).is_empty());
}

fn largest_distance(mesh: &TriMesh, field: Field) -> f64 {
    mesh.faces()
        .flat_map(|(face, _)| mesh.triangle(face))
        .map(|p| field(&p).abs())
        .fold(0.0, f64::max)
}

fn turn() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Unit::new_normalize(vector![0.3, -0.5, 0.8]), 0.7)
}

// ---- known surfaces

#[test]
fn a_sphere_is_a_sphere() {
    let radius = 6.3 * PITCH;
    let field = |p: &Point3<f64>| p.coords.norm() - radius;
    let mesh = surface(&lattice(PITCH), &cube(8), &field);
    assert_skin(&mesh, PITCH, 2);
    // between two tangents a cell apart the vertex is off by (pitch √3 / 2)² / 2 radius at most
    let bound = 0.75 * PITCH * PITCH / (2.0 * radius);
    assert!(largest_distance(&mesh, &field) < bound);
    for (face, _) in mesh.faces() {
        assert!(
            mesh.normal(face)
                .dot(&mesh.barycentre(face).coords.normalize())
                > 0.9,
            "normals point out"
        );
    }
}

#[test]
fn a_box_keeps_its_edges_and_corners() {
    let half = vector![5.21, 4.03, 3.37] * PITCH;
    let turn = turn();
    let field = |p: &Point3<f64>| {
        (turn.inverse() * p.coords)
            .abs()
            .zip_map(&half, |x, h| x - h)
            .max()
    };
    let mesh = surface(&lattice(PITCH), &cube(8), &field);
    assert_skin(&mesh, PITCH, 2);
    let tree = FaceTree::new(&mesh);
    let (mut worst, mut sum): (f64, f64) = (0.0, 0.0);
    for i in 0..=40 {
        for axis in 0..3 {
            let mut at = half;
            at[axis] *= f64::from(i - 20) / 20.0;
            let p = Point3::from(turn * at);
            let distance = tree
                .closest(&mesh, &p, 1.0)
                .unwrap()
                .distance_squared
                .sqrt();
            worst = worst.max(distance);
            sum += distance / 123.0;
        }
    }
    // a cell that the edge passes without a crossing on either side of it cannot detect it: there
    // the contour cuts off a corner
    assert!(
        worst < 0.3 * PITCH && sum < 0.05 * PITCH,
        "worst {}, mean {} pitches",
        worst / PITCH,
        sum / PITCH
    );
    assert!(largest_distance(&mesh, &field) < 0.25 * PITCH);
}

#[test]
fn two_thin_sheets_stay_apart() {
    let turn = turn();
    for gap in [1.0, 0.7, 1.3] {
        // two plates, each a little over a cell thick, with a gap of about a cell, within a rounded
        // rim
        let field = |p: &Point3<f64>| {
            let x = turn.inverse() * p.coords / PITCH;
            let plate = |middle: f64| {
                ((x.z - middle).abs() - 0.6).max((x.x * x.x + x.y * x.y).sqrt() - 5.0)
            };
            plate(0.6 + gap / 2.0).min(plate(-0.6 - gap / 2.0)) * PITCH
        };
        let mesh = surface(&lattice(PITCH), &cube(8), &field);
        let sound = soundness(&mesh);
        assert_eq!(
            (sound.rims.len(), sound.bad_edges, sound.bad_vertices),
            (0, 0, 0),
            "gap {gap}"
        );
        assert!(intersections(&mesh, PITCH, |_| true).is_empty());
    }
}

#[test]
fn a_torus_has_its_hole() {
    let turn = turn();
    let field = |p: &Point3<f64>| {
        let x = turn.inverse() * p.coords;
        (x.xy().norm() - 5.0 * PITCH).hypot(x.z) - 1.9 * PITCH
    };
    assert_skin(&surface(&lattice(PITCH), &cube(9), &field), PITCH, 0);
}

/// A sum of cosines with wavelengths down to `shortest` pitches.
fn waves(seed: u64, shortest: f64) -> impl Fn(&Point3<f64>) -> f64 {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut direction = || Vector3::from_fn(|_, _| within(&mut rng, -1.0, 1.0));
    let list: Vec<_> = (0..12)
        .map(|_| {
            (
                direction().normalize() * (std::f64::consts::TAU / (shortest * PITCH)),
                direction() * 3.0,
            )
        })
        .collect();
    move |p| {
        list.iter()
            .map(|(k, phase)| {
                (k.dot(&p.coords) + phase.x).cos() + 0.3 * (0.5 * k.dot(&p.coords) + phase.y).sin()
            })
            .sum::<f64>()
            * PITCH
    }
}

/// f = 0 within a ball, so that the surface closes.
fn enclosed(field: impl Fn(&Point3<f64>) -> f64, radius: f64) -> impl Fn(&Point3<f64>) -> f64 {
    move |p| field(p).max(p.coords.norm() - radius)
}

#[test]
fn random_waves_give_closed_skins_without_intersections() {
    for seed in 0..12 {
        let shortest = [2.2, 3.0, 4.5][seed as usize % 3];
        let field = enclosed(waves(seed, shortest), 6.0 * PITCH);
        let mesh = surface(&lattice(PITCH), &cube(8), &field);
        let sound = soundness(&mesh);
        assert_eq!(
            (sound.rims.len(), sound.bad_edges, sound.bad_vertices),
            (0, 0, 0),
            "seed {seed}"
        );
        assert!(
            intersections(&mesh, PITCH, |_| true).is_empty(),
            "seed {seed}"
        );
    }
}

// ---- in a scan

/// Cells that come within `radius` of one of `points`, none within `margin` of a rim of the scan.
fn region_around(
    lattice: &Lattice,
    scan: &TriMesh,
    points: &[Point3<f64>],
    radius: f64,
    margin: f64,
) -> LatticeRegion {
    let rims: Vec<Point3<f64>> = soundness(scan)
        .rims
        .iter()
        .flatten()
        .map(|&v| scan.positions()[v as usize])
        .collect();
    let steps = (radius / lattice.pitch).ceil() as i32 + 1;
    let mut region = LatticeRegion::default();
    for p in points {
        let middle = lattice.cell_of(p);
        for (step, ()) in cube(steps).iter() {
            let cell: LatticeNode = std::array::from_fn(|i| middle[i] + step[i]);
            let centre = lattice.position(cell) + Vector3::repeat(lattice.pitch / 2.0);
            let is_near = |q: &Point3<f64>, limit: f64| (q - centre).norm() < limit;
            if is_near(p, radius) && !rims.iter().any(|q| is_near(q, margin)) {
                region.insert(cell, ());
            }
        }
    }
    region
}

/// Adds the cells beyond open squares that the scan crosses, until none remain: no region grows by
/// more rounds than this.
fn close_region(
    lattice: &Lattice,
    region: &mut LatticeRegion,
    scan: &TriMesh,
    tree: &FaceTree,
    field: Field,
) {
    for _ in 0..60 {
        let (cut, values) = (
            Cut::new(lattice, region, scan, tree),
            node_values(lattice, region, field),
        );
        let crossing = |edge: &Edge| Crossing {
            point: lattice.position(edge.node),
            normal: Vector3::z(),
        };
        let open = contour(lattice, region, &values, &cut, crossing).open;
        let beyond: Vec<LatticeNode> = open
            .iter()
            .filter(|open| open.is_scanned)
            .map(|open| open.beyond)
            .collect();
        if beyond.is_empty() {
            return;
        }
        beyond.into_iter().for_each(|cell| region.insert(cell, ()));
    }
}

fn new_faces(scan: &TriMesh, mesh: &TriMesh) -> Vec<FaceId> {
    mesh.faces()
        .filter(|(f, c)| !scan.has_face(*f) || scan.corners(*f) != *c)
        .map(|(face, _)| face)
        .collect()
}

fn area(mesh: &TriMesh) -> f64 {
    mesh.faces()
        .map(|(face, _)| mesh.double_area_normal(face).norm() / 2.0)
        .sum()
}

/// The spliced mesh against the scan: one skin with the same rims, and no other change. Rims of
/// their own surround open squares alone.
fn spliced(scan: &TriMesh, patch: &Patch, pitch: f64) -> TriMesh {
    let mesh = patch.applied_to(scan.clone()).unwrap().0;
    let (before, after) = (soundness(scan), soundness(&mesh));
    let new = new_faces(scan, &mesh);
    assert_eq!(after.bad_edges, before.bad_edges);
    assert!(intersections(&mesh, pitch, |face| new.contains(&face)).is_empty());
    for (face, corners) in scan
        .faces()
        .filter(|(face, _)| !patch.removed.contains(face))
    {
        assert_eq!(mesh.corners(face), corners);
    }
    assert_eq!(&mesh.positions()[..scan.vertex_count()], scan.positions());
    let positions = mesh.positions();
    if patch.open.is_empty() {
        assert_eq!(after.bad_vertices, before.bad_vertices);
        let change = rim_length(&mesh, &after.rims) - rim_length(scan, &before.rims);
        assert!(change.abs() < 1e-9, "rims are longer by {change} m");
    }
    let corner = |square: &OpenSquare| lattice(pitch).position(square.square.node);
    for rim in after
        .rims
        .difference(&before.rims)
        .map(|rim| rim.map(|v| positions[v as usize]))
    {
        // a rim of the scan in two parts is no new one
        let is_on_old = before.rims.iter().any(|old| {
            let [a, b] = old.map(|v| positions[v as usize]);
            rim.iter()
                .all(|p| (p - a).norm() + (p - b).norm() < (b - a).norm() * (1.0 + 1e-12))
        });
        let is_announced = patch
            .open
            .iter()
            .any(|open| (rim[0] - corner(open)).norm() < 3.0 * pitch);
        assert!(is_on_old || is_announced, "a rim at {}", rim[0]);
    }
    mesh
}

/// Mean and largest distance from the new faces' corners and middles to the scan, m.
fn distances(mesh: &TriMesh, scan: &TriMesh, tree: &FaceTree) -> (f64, f64) {
    let (mut sum, mut worst, mut count): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for face in new_faces(scan, mesh) {
        for p in mesh
            .triangle(face)
            .into_iter()
            .chain([mesh.barycentre(face)])
        {
            let distance = tree.closest(scan, &p, 1.0).unwrap().distance_squared.sqrt();
            (sum, worst, count) = (sum + distance, worst.max(distance), count + 1.0);
        }
    }
    (sum / count, worst)
}

fn shared_scan(name: &str) -> Option<TriMesh> {
    let path = crate::shared::shared(&format!("cases/{name}/scan.ply"))?;
    Some(read_mesh(&path, MeshUnit::Millimetre).unwrap().mesh)
}

fn some_points(scan: &TriMesh, count: usize, seed: u64) -> Vec<Point3<f64>> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| {
            scan.barycentre(FaceId(
                within(&mut rng, 0.0, scan.face_count() as f64) as u32
            ))
        })
        .collect()
}

/// Closes and splices a region; the field is the scan's own distance.
fn splice_own(lattice: &Lattice, region: &mut LatticeRegion, scan: &TriMesh) -> (Patch, TriMesh) {
    let tree = FaceTree::new(scan);
    let field = |p: &Point3<f64>| signed_distance(scan, &tree, p, 1.0).unwrap();
    close_region(lattice, region, scan, &tree, &field);
    let patch = patch_of(lattice, region, scan, &tree, &field);
    let mesh = spliced(scan, &patch, lattice.pitch);
    (patch, mesh)
}

const SCANS: [&str; 3] = ["plate", "flange", "featuretype"];

#[test]
fn a_scan_remeshed_by_its_own_distance_is_the_same_surface() {
    for (name, seed) in SCANS.into_iter().flat_map(|name| [(name, 0), (name, 1)]) {
        let Some(scan) = shared_scan(name) else {
            return;
        };
        let lattice = lattice(PITCH);
        let mut region =
            region_around(&lattice, &scan, &some_points(&scan, 12, seed), 3e-3, 2.5e-3);
        let (patch, mesh) = splice_own(&lattice, &mut region, &scan);
        assert!(patch.open.is_empty() && patch.removed.len() > 100);
        assert_eq!(soundness(&mesh).euler, soundness(&scan).euler);
        let (mean, worst) = distances(&mesh, &scan, &FaceTree::new(&scan));
        assert!(
            mean < 0.02 * PITCH && worst < 0.5 * PITCH,
            "{name}: {mean}, {worst}"
        );
        assert!((area(&mesh) / area(&scan) - 1.0).abs() < 1e-3);
        let slivers = new_faces(&scan, &mesh).into_iter().filter(|&face| {
            shape_quality(&mesh.triangle(face), mesh.double_area_normal(face).norm()) < 0.02
        });
        println!(
            "{name} {seed}: {} cells, {} faces gone, {} new, {} of them thin; off the scan by {:.4} pitch, at most {:.3}",
            region.len(),
            patch.removed.len(),
            patch.faces.len(),
            slivers.count(),
            mean / PITCH,
            worst / PITCH
        );
    }
}

#[test]
fn a_dent_is_pressed_into_a_scan() {
    let depth = 0.5e-3;
    for (name, seed) in SCANS
        .into_iter()
        .flat_map(|name| [(name, 3), (name, 4), (name, 5)])
    {
        let Some(scan) = shared_scan(name) else {
            return;
        };
        let tree = FaceTree::new(&scan);
        let lattice = lattice(PITCH);
        let mut middle = some_points(&scan, 50, seed);
        let rims = soundness(&scan).rims;
        let is_far = |p: &Point3<f64>| {
            rims.iter()
                .all(|rim| (p - scan.positions()[rim[0] as usize]).norm() > 8e-3)
        };
        middle.retain(is_far);
        middle.truncate(1);
        let field = |p: &Point3<f64>| {
            let share = ((3.5e-3 - (p - middle[0]).norm()) / 1.5e-3).clamp(0.0, 1.0);
            signed_distance(&scan, &tree, p, 1.0).unwrap()
                + depth * share * share * (3.0 - 2.0 * share)
        };
        let mut region = region_around(&lattice, &scan, &middle, 5e-3, 0.0);
        close_region(&lattice, &mut region, &scan, &tree, &field);
        let patch = patch_of(&lattice, &region, &scan, &tree, &field);
        let mesh = spliced(&scan, &patch, PITCH);
        let heights = new_faces(&scan, &mesh)
            .into_iter()
            .map(|face| signed_distance(&scan, &tree, &mesh.barycentre(face), 1.0).unwrap());
        let deepest = heights.fold(0.0, f64::min);
        // over an edge of the scan the new faces are chords
        assert!((deepest + depth).abs() < 0.2 * PITCH, "{name}: {deepest}");
    }
}

/// Random cells at the surface of a scan, in clumps: single ones, rows, and cells that meet at an
/// edge or a corner only.
fn crumbs(lattice: &Lattice, scan: &TriMesh, seed: u64, count: usize) -> LatticeRegion {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut region = LatticeRegion::default();
    for p in some_points(scan, count, seed) {
        let mut cell = lattice.cell_of(&p);
        for _ in 0..within(&mut rng, 1.0, 9.0) as u32 {
            region.insert(cell, ());
            cell = cell.map(|x| x + within(&mut rng, -1.0, 2.0).floor() as i32);
        }
    }
    region
}

#[test]
fn crumbs_of_any_size_leave_a_scan_whole() {
    for (name, seed) in SCANS
        .into_iter()
        .flat_map(|name| [(name, 0), (name, 1), (name, 2)])
    {
        let Some(scan) = shared_scan(name) else {
            return;
        };
        let lattice = lattice(PITCH * [0.3, 1.0, 2.5][seed as usize]);
        splice_own(&lattice, &mut crumbs(&lattice, &scan, seed, 60), &scan);
    }
}

#[test]
fn what_is_done_far_away_changes_no_face_here() {
    let Some(scan) = shared_scan("flange") else {
        return;
    };
    let tree = FaceTree::new(&scan);
    let field = |p: &Point3<f64>| signed_distance(&scan, &tree, p, 1.0).unwrap();
    let lattice = lattice(PITCH);
    let points = some_points(&scan, 30, 1);
    let here = region_around(&lattice, &scan, &points[..1], 3e-3, 0.0);
    let far: Vec<_> = points
        .iter()
        .copied()
        .filter(|p| (p - points[0]).norm() > 12e-3)
        .collect();
    let mut both = region_around(&lattice, &scan, &far, 3e-3, 0.0);
    here.iter().for_each(|(cell, ())| both.insert(cell, ()));
    // owner, names and places of the corners
    let faces = |region: &LatticeRegion| -> BTreeMap<_, Vec<_>> {
        let patch = patch_of(&lattice, region, &scan, &tree, &field);
        let mut faces: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for face in &patch.faces {
            let corners = face
                .corners
                .map(|at| *patch.vertices.entry(at))
                .map(|(key, p)| (key, p.coords.data.0[0].map(f64::to_bits)));
            faces.entry(face.owner).or_default().push(corners);
        }
        faces
    };
    let (alone, together) = (faces(&here), faces(&both));
    assert!(alone.len() > 20 && together.len() > 10 * alone.len());
    assert!(
        alone
            .iter()
            .all(|(owner, faces)| together.get(owner) == Some(faces))
    );
    assert!(far.len() > 10);
}

#[test]
fn a_field_that_contradicts_the_scan_is_not_joined_to_it() {
    let scan = rough_plate(1e-3, 0.1e-3, 5);
    let tree = FaceTree::new(&scan);
    let lattice = lattice(PITCH);
    let region = region_around(&lattice, &scan, &[Point3::new(0.0, 0.0, 1e-3)], 3e-3, 0.0);
    let own = |p: &Point3<f64>| signed_distance(&scan, &tree, p, 1.0).unwrap();
    let joined = patch_of(&lattice, &region, &scan, &tree, &own);
    assert!(joined.open.is_empty());
    let shared: BTreeSet<_> = joined
        .faces
        .iter()
        .filter(|face| matches!(face.owner, Owner::Square(_)))
        .map(|face| face.owner)
        .collect();
    // material above instead of below; and a plane that misses the scan
    let (turned, apart) = (|p: &Point3<f64>| -own(p), |p: &Point3<f64>| p.z + 1.4e-3);
    for field in [&turned as Field, &apart] {
        let patch = patch_of(&lattice, &region, &scan, &tree, field);
        assert!(
            patch
                .faces
                .iter()
                .all(|face| !matches!(face.owner, Owner::Square(_)))
        );
        assert_eq!(
            patch.open.iter().filter(|open| open.is_scanned).count(),
            shared.len()
        );
        spliced(&scan, &patch, PITCH);
    }
}

/// A rough plate: squares of side `edge`, heights off by up to `noise` (m).
fn rough_plate(edge: f64, noise: f64, seed: u64) -> TriMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    grid((12e-3 / edge) as u32, edge, |x, y| {
        1e-3 * ((400.0 * x).sin() + (300.0 * y).cos()) + within(&mut rng, -noise, noise)
    })
}

/// A closed sheet: a rough plate and its shadow `thickness` (m) below, with walls between.
fn thin_sheet(edge: f64, noise: f64, thickness: f64, seed: u64) -> TriMesh {
    let plate = rough_plate(edge, noise, seed);
    let count = plate.vertex_count() as u32;
    let below = plate
        .positions()
        .iter()
        .map(|p| p - vector![0.0, 0.0, thickness]);
    let positions = plate.positions().iter().copied().chain(below).collect();
    let mut faces: Vec<[u32; 3]> = plate.faces().map(|(_, c)| c.map(|v| v.0)).collect();
    for [a, b, c] in faces.clone() {
        faces.push([a + count, c + count, b + count]);
        for [s, e] in [[a, b], [b, c], [c, a]] {
            if plate.faces_at_edge(VertexId(s), VertexId(e)).count() == 1 {
                faces.extend([[s, s + count, e], [e, s + count, e + count]]);
            }
        }
    }
    TriMesh::new(positions, faces).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Scans coarser and finer than the lattice, smooth and rough, and regions of any shape.
    #[test]
    fn regions_of_any_shape_leave_a_rough_plate_whole(
        seed in any::<u64>(),
        share in 0.2..4.0f64,
        noise in 0.0..0.3f64,
        count in 1..30usize,
    ) {
        let edge = 1e-3;
        let scan = rough_plate(edge, noise * edge, seed);
        let lattice = lattice(share * edge);
        splice_own(&lattice, &mut crumbs(&lattice, &scan, seed, count), &scan);
    }

    /// Two sides about a cell apart: cells with several loops, edges crossed twice.
    #[test]
    fn regions_of_any_shape_leave_a_thin_sheet_whole(
        seed in any::<u64>(),
        share in 0.4..2.0f64,
        noise in 0.0..0.2f64,
        thickness in 0.5..2.5f64,
    ) {
        let edge = 1e-3;
        let scan = thin_sheet(edge, noise * edge, thickness * share * edge, seed);
        let lattice = lattice(share * edge);
        let (patch, mesh) = splice_own(&lattice, &mut crumbs(&lattice, &scan, seed, 12), &scan);
        // signs cannot distinguish both sides on one edge; with smaller cells everything closes,
        // and no hole appears
        prop_assert!(thickness < 1.5 || (patch.open.is_empty() && soundness(&mesh).rims.is_empty()));
        prop_assert!(thickness < 2.2 || soundness(&mesh).euler == 2);
    }
}

/// Crossings and normals at random; signs at random as well, so that every ambiguous case comes up,
/// or from waves, so that cells have one loop and their vertices lie anywhere.
#[test]
fn random_crossings_give_a_closed_skin_without_intersections() {
    for seed in 0..40 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let lattice = lattice(PITCH);
        let (region, waves) = (cube(4), waves(seed, 5.0));
        let mut values = node_values(&lattice, &region, &|_| 1.0);
        for (node, ()) in cube(3).iter() {
            let value = if seed % 2 == 0 {
                within(&mut rng, -1.0, 1.0)
            } else {
                waves(&lattice.position(node))
            };
            values.insert(node, value);
        }
        let scan = nothing();
        let cut = Cut::new(&lattice, &region, &scan, &FaceTree::new(&scan));
        let patch = contour(&lattice, &region, &values, &cut, |edge| {
            let mut point = lattice.position(edge.node);
            point[edge.axis as usize] += within(&mut rng, 0.0, PITCH);
            Crossing {
                point,
                normal: Vector3::from_fn(|_, _| within(&mut rng, -1.0, 1.0)).normalize(),
            }
        });
        let mesh = patch.applied_to(scan.clone()).unwrap().0;
        let sound = soundness(&mesh);
        assert_eq!(
            (sound.rims.len(), sound.bad_edges, sound.bad_vertices),
            (0, 0, 0),
            "seed {seed}"
        );
        assert!(
            intersections(&mesh, PITCH, |_| true).is_empty(),
            "seed {seed}"
        );
    }
}
