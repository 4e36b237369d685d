//! Touches of a region of a scan: the result equals that of the whole scan, and the rest stays
//! unchanged.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::haptic::Refiner;
use touchup::live::{Engine, Renewal};
use touchup::mesh::{FaceTree, MeshError, Region, TriMesh, VertexId};
use touchup::scene::{CutScan, Scene};
use touchup::sim::wavy::{FORCE, RADIUS, STIFFNESS, height, wavy_plate};
use touchup::stylus::{Sample, Wrench, WrenchFrame};

/// 30 mm of a plate of 300 mm, in its middle.
const SCENE: &str = "
contact:
tip:
scan: { noise_mm: 0.3, region_low_mm: [135, 135, -20], region_high_mm: [165, 165, 20] }
sliding:
carve:
guard:
patch:
uncertainty:
refine:
";

fn scene(yaml: &str) -> Scene {
    Scene::from_yaml(yaml).unwrap()
}

/// The same scene without its region.
fn whole_scene() -> Scene {
    scene(&SCENE.replace(
        ", region_low_mm: [135, 135, -20], region_high_mm: [165, 165, 20]",
        "",
    ))
}

/// A ball pressed onto a surface 0.1 mm below the plate, in lines from `from` (m) to 20 mm farther
/// along x and y; lifted off between the lines.
fn touches(from: f64) -> Vec<Sample> {
    let mut samples = Vec::new();
    for line in 0..14 {
        for step in 0..500 {
            let (x, y) = (
                from + f64::from(step) * 40e-6,
                from + f64::from(line) * 1.4e-3,
            );
            let slope = 1e-6;
            let normal = Vector3::new(
                (height(x - slope, y) - height(x + slope, y)) / (2.0 * slope),
                (height(x, y - slope) - height(x, y + slope)) / (2.0 * slope),
                1.0,
            )
            .normalize();
            let is_free = step > 400;
            let (force, above) = if is_free {
                (0.0, 3e-3)
            } else {
                (FORCE, -FORCE / STIFFNESS)
            };
            let centre =
                Point3::new(x, y, height(x, y)) - normal * 0.1e-3 + normal * (RADIUS + above);
            samples.push(Sample {
                stamp_ns: samples.len() as i64 * 1_000_000,
                pose_ot: Isometry3::translation(centre.x, centre.y, centre.z),
                wrench: Wrench {
                    force: normal * force,
                    torque: Vector3::zeros(),
                },
            });
        }
    }
    samples
}

fn refiner(scene: &Scene, scan: &TriMesh) -> (CutScan, Refiner) {
    let cut = scene.cut(scan.clone()).unwrap();
    let params = cut
        .cut
        .refine_params(scene.refine_params(WrenchFrame::Object).unwrap());
    let refiner = Refiner::new(cut.mesh.clone(), params).unwrap();
    (cut, refiner)
}

fn corners(mesh: &TriMesh) -> Vec<[VertexId; 3]> {
    mesh.faces().map(|(_, corners)| corners).collect()
}

/// Largest distance between vertices of the same id, m.
fn apart(a: &TriMesh, b: &TriMesh) -> f64 {
    assert_eq!(a.vertex_slots(), b.vertex_slots());
    a.positions()
        .iter()
        .zip(b.positions())
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

#[test]
fn a_part_that_was_not_touched_is_sewn_back_bit_by_bit() {
    let scan = wavy_plate(5_000).unwrap();
    let region = Region {
        low: Point3::new(0.1, 0.05, -1.0),
        high: Point3::new(0.2, 0.1, 1.0),
    };
    let (part, outside) = scan.cut(&region);
    // 2 · 50² faces: a box of 100 × 50 mm meets 18 × 10 of the cells of 6 mm at most, and 17 × 9 at
    // least
    assert!(
        (2 * 17 * 9..=2 * 18 * 10).contains(&part.face_count()),
        "{}",
        part.face_count()
    );
    for (vertex, p) in part
        .positions()
        .iter()
        .enumerate()
        .filter(|(_, p)| region.contains(p))
    {
        let all = scan.positions().iter().position(|q| q == p).unwrap();
        let around = |mesh: &TriMesh, vertex: usize| mesh.star(VertexId(vertex as u32)).len();
        assert_eq!(
            around(&part, vertex),
            around(&scan, all),
            "all faces around a vertex of the region are in the part"
        );
    }
    let sewn = outside.sew_to(&part).unwrap();
    assert_eq!(
        (sewn.mesh.positions(), corners(&sewn.mesh)),
        (scan.positions(), corners(&scan))
    );
    let marked = sewn.column(&vec![true; part.vertex_slots()], false);
    assert_eq!(
        marked.iter().filter(|&&is_part| is_part).count(),
        part.vertex_count()
    );
}

#[test]
fn a_part_whose_rim_was_moved_or_torn_is_refused() {
    let scan = wavy_plate(2_000).unwrap();
    let region = Region {
        low: Point3::new(0.1, 0.1, -1.0),
        high: Point3::new(0.2, 0.2, 1.0),
    };
    let (part, outside) = scan.cut(&region);
    let rim: Vec<_> = (0..part.vertex_slots() as u32)
        .map(VertexId)
        .filter(|v| !region.contains(&part.position(*v)))
        .collect();
    let mut moved = part.clone();
    moved.set_position(rim[0], part.position(rim[0]) + Vector3::z() * 1e-9);
    assert_eq!(outside.sew_to(&moved).unwrap_err(), MeshError::TornRim);
    let mut torn = part.clone();
    let face = torn.star(rim[0])[0];
    let around: Vec<_> = torn.star(rim[0]).to_vec();
    around
        .iter()
        .for_each(|&face| assert!(torn.remove_face(face)));
    assert!(!torn.has_face(face));
    assert_eq!(outside.sew_to(&torn).unwrap_err(), MeshError::TornRim);
    // inside of it anything goes
    let inner = (0..part.vertex_slots() as u32).map(VertexId).find(|v| {
        let far = Region {
            low: Point3::new(0.13, 0.13, -1.0),
            high: Point3::new(0.17, 0.17, 1.0),
        };
        far.contains(&part.position(*v))
    });
    let mut moved = part.clone();
    moved.set_position(inner.unwrap(), Point3::new(0.15, 0.15, 0.5));
    let sewn = outside.sew_to(&moved).unwrap().mesh;
    assert_eq!(
        sewn.positions()
            .iter()
            .zip(scan.positions())
            .filter(|(a, b)| a != b)
            .count(),
        1
    );
}

/// The reference is the whole scan, refined without a region.
#[test]
fn touches_in_the_region_do_what_they_do_to_the_whole_scan() {
    let scan = wavy_plate(60_000).unwrap();
    let (_, mut whole) = refiner(&whole_scene(), &scan);
    let (cut, mut part) = refiner(&scene(SCENE), &scan);
    for sample in touches(0.14) {
        whole.push(&sample).unwrap();
        part.push(&sample).unwrap();
    }
    assert_eq!(
        (part.counts(), part.counts().outside_region),
        (whole.counts(), 0)
    );
    let outside = cut.cut.outside.unwrap();
    let sewn = outside.sew_to(part.mesh()).unwrap();
    assert_eq!(corners(&sewn.mesh), corners(&scan));
    let moved = apart(whole.mesh(), &scan);
    assert!(moved > 50e-6, "{moved}");
    let off = apart(&sewn.mesh, whole.mesh());
    assert!(off <= 1e-9, "{off}");
    let part_vertices: Vec<_> = sewn.vertices.iter().map(|vertex| vertex.0).collect();
    for (id, (now, before)) in sewn
        .mesh
        .positions()
        .iter()
        .zip(scan.positions())
        .enumerate()
    {
        assert!(
            part_vertices.binary_search(&(id as u32)).is_ok() || now == before,
            "vertex {id} is outside and as it was"
        );
    }
    // memory goes with the faces of the part
    let share = cut.mesh.face_count() as f64 / scan.face_count() as f64;
    assert!(share < 0.1, "{share}");
    let of_tree = FaceTree::new(&cut.mesh).bytes() as f64 / FaceTree::new(&scan).bytes() as f64;
    let of_mesh = cut.mesh.bytes() as f64 / scan.bytes() as f64;
    assert!(
        of_tree < 1.2 * share && of_mesh < 1.3 * share,
        "{of_tree} and {of_mesh} of {share}"
    );
}

#[test]
fn the_patch_of_the_region_is_that_of_the_whole_scan() {
    let scan = wavy_plate(60_000).unwrap();
    let patched = |scene: &Scene| {
        let cut = scene.cut(scan.clone()).unwrap();
        let patch = cut.cut.patcher_params(scene.patcher_params().unwrap());
        let refine = cut
            .cut
            .refine_params(scene.refine_params(WrenchFrame::Object).unwrap());
        let mut engine =
            Engine::new(cut.mesh.clone(), refine, Some(patch), Renewal::AtEnd).unwrap();
        touches(0.14)
            .iter()
            .for_each(|sample| assert!(engine.push(sample).is_ok()));
        let mut patcher = engine.finish().unwrap().patcher.unwrap();
        patcher.flush();
        let patched = patcher
            .patched(&cut.mesh, &FaceTree::new(&cut.mesh))
            .unwrap();
        (cut, patched)
    };
    let (_, whole) = patched(&whole_scene());
    let (cut, part) = patched(&scene(SCENE));
    assert!(whole.added_faces > 500, "{}", whole.added_faces);
    assert_eq!(
        (part.added_faces, part.removed_faces),
        (whole.added_faces, whole.removed_faces)
    );
    let sewn = cut.cut.outside.unwrap().sew_to(&part.mesh).unwrap();
    assert_eq!(sewn.mesh.face_count(), whole.mesh.face_count());
    let off = apart(&sewn.mesh, &whole.mesh);
    assert!(off <= 1e-9, "{off}");
    assert_eq!(
        sewn.column(&part.support, touchup::reconstruct::Support::Scan),
        whole.support
    );
}

#[test]
fn touches_outside_the_region_are_counted_and_move_nothing() {
    let scan = wavy_plate(20_000).unwrap();
    let (cut, mut part) = refiner(&scene(SCENE), &scan);
    let samples = touches(0.05);
    samples.iter().for_each(|sample| {
        part.push(sample).unwrap();
    });
    // 401 of 500 samples of each of 14 lines press; the smoothed force lets go some ms later
    let pressed = 14 * 401;
    let outside = part.counts().outside_region;
    assert!((pressed..pressed + 14 * 20).contains(&outside), "{outside}");
    assert_eq!(
        (part.counts().moved, part.counts().accepted),
        (0, samples.len() as u64)
    );
    assert_eq!(part.mesh().positions(), cut.mesh.positions());
}

#[test]
fn a_region_needs_two_corners_the_right_way_round_and_faces() {
    let error = |yaml: &str| Scene::from_yaml(yaml).unwrap_err().to_string();
    let one = error("scan: { region_low_mm: [0, 0, 0] }");
    assert!(
        one.contains("scan.region_low_mm needs scan.region_high_mm"),
        "{one}"
    );
    let other = error("scan: { region_high_mm: [0, 0, 0] }");
    assert!(
        other.contains("scan.region_high_mm needs scan.region_low_mm"),
        "{other}"
    );
    let turned = error("scan: { region_low_mm: [0, 5, 0], region_high_mm: [1, 5, 1] }");
    assert!(
        turned.contains("scan.region_high_mm is 5; it must be more than scan.region_low_mm"),
        "{turned}"
    );
    let far = scene(
        &SCENE
            .replace("[135, 135, -20]", "[9e5, 135, -20]")
            .replace("[165,", "[9.5e5,"),
    );
    assert!(
        far.cut(wavy_plate(200).unwrap())
            .unwrap_err()
            .to_string()
            .contains("no face of the scan is in or near")
    );
}
