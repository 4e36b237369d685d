//! Round holes of CAD meshes, counted and measured by other means.
//!
//! Ray casting (Open3D) rendered each part from six sides, and a person counted its holes in the
//! pictures. Sizes come from a program of its own (trimesh, numpy): the mesh parted at edges
//! sharper than 30° (35° for circles of twelve sides), a circle of least squares through the
//! corners that bound each round patch, heights of those corners. The genus of a closed part is its
//! number of through-openings; its computed value agrees.

use touchup::features::FeatureKind;
use touchup::io::mesh_file::MeshUnit::{Inch, Metre, Millimetre};

use crate::features::detection::expected::{Round, blind, check_holes, countersunk, step, through};
use crate::features::detection::{found, of_kind, part};

const UP: [f64; 3] = [0.0, 0.0, 1.0];
const DOWN: [f64; 3] = [0.0, 0.0, -1.0];
const FRONT: [f64; 3] = [0.0, -1.0, 0.0];
const BACK: [f64; 3] = [0.0, 1.0, 0.0];

/// The picture from above shows eight counterbored holes in two rows, that from the front one hole
/// across the whole width. In the STEP file the radii of CYLINDRICAL_SURFACE are 0.133 in (16 half
/// cylinders: Ø 6.7564 mm), 0.21875 in (16: Ø 11.1125 mm), 0.19472 in (2: Ø 9.8917 mm), and fillets
/// of 0.1, 0.125 and 0.5 in, which are no holes. Genus 9.
#[test]
fn featuretype_has_eight_counterbored_holes_and_one_across() {
    let Some(mesh) = part("trimesh_featuretype.STL", Inch) else {
        return;
    };
    let mut expected = vec![through(9.8917, [-14.211, -31.75, 12.7], FRONT, 63.5)];
    let mut steps = Vec::new();
    for (x, y) in [-57.074, -28.499, 0.076, 28.651]
        .into_iter()
        .flat_map(|x| [(x, -25.4), (x, 25.4)])
    {
        steps.push([expected.len(), expected.len() + 1]);
        expected.push(step(11.1125, [x, y, 25.4], UP, 6.35));
        expected.push(step(6.7564, [x, y, 19.05], UP, 19.05));
    }
    check_holes(&found(&mesh), &expected, &steps);
}

/// Sections at z = 32 and 23 mm: between the pad's rounded recess (x −4.105 to 17.558, y ±9.015)
/// and the square island in it (x 3.404 to 10.094, y ±3.349) run four arms, floor at 29.845, land
/// at 34.925. Beside it a recess of 13.573 × 16.818 with rounded corners, same depth; and on the
/// land at 25.4 a square of 12.7, floor at 22.225.
#[test]
fn featuretype_has_a_ring_groove_of_four_arms_and_two_pockets() {
    let Some(mesh) = part("trimesh_featuretype.STL", Inch) else {
        return;
    };
    let features = found(&mesh);
    // centre, width, length, depth
    let slots = [
        ([-0.3505, 0.0, 34.925], 7.509, 18.030, 5.08),
        ([13.826, 0.0, 34.925], 7.464, 18.030, 5.08),
        ([6.7265, -6.182, 34.925], 5.666, 21.663, 5.08),
        ([6.7265, 6.182, 34.925], 5.666, 21.663, 5.08),
    ];
    let pockets = [
        ([-25.9395, 0.0, 34.925], 13.573, 16.818, 5.08),
        ([38.1, 0.0, 25.4], 12.7, 12.7, 3.175),
    ];
    for (kind, expected) in [
        (FeatureKind::Slot, &slots[..]),
        (FeatureKind::Pocket, &pockets[..]),
    ] {
        let all = of_kind(&features, kind);
        assert_eq!(all.len(), expected.len(), "{kind:?}");
        for (centre, width, length, depth) in expected {
            let is_it = |f: &&&touchup::features::Feature| {
                (f.centre.value.coords * 1e3 - nalgebra::Vector3::from(*centre)).norm() < 0.02
            };
            let one = all
                .iter()
                .find(is_it)
                .unwrap_or_else(|| panic!("no {kind:?} at {centre:?}"));
            let sizes = [&one.width, &one.length, &one.depth]
                .map(|size| size.as_ref().unwrap().value * 1e3);
            let off = [sizes[0] - width, sizes[1] - length, sizes[2] - depth].map(f64::abs);
            assert!(
                off.iter().all(|&off| off < 2e-3),
                "{kind:?} {sizes:?}, expected {width} x {length} x {depth}"
            );
            assert_eq!(one.through, Some(false));
        }
    }
    assert_eq!(
        of_kind(&features, FeatureKind::Boss).len(),
        0,
        "the pad is square"
    );
}

/// From above: four countersunk holes and one counterbored in the middle. Genus 5. The cones go
/// from r 3.3782 at z 9.179 to r 6.4389 at z 12.7: 2 atan(3.0607 / 3.521) = 82.0°.
#[test]
fn plate_holes_has_four_countersunk_holes_and_a_counterbored_one() {
    let Some(mesh) = part("trimesh_plate_holes.STL", Millimetre) else {
        return;
    };
    let corners = [39.898, 163.302]
        .into_iter()
        .flat_map(|x| [47.774, 257.026].map(|y| [x, y, 9.179]));
    let mut expected = vec![
        step(11.1125, [101.6, 154.481, 12.7], UP, 6.35),
        step(6.7564, [101.6, 154.481, 6.35], UP, 6.35),
    ];
    expected.extend(corners.map(|at| countersunk(6.7564, at, UP, 9.179, 82.0)));
    check_holes(&found(&mesh), &expected, &[[0, 1]]);
}

/// From above one large bore, in the front face two small holes. Genus 3. The bore has 50 corners
/// on r 22.225 and 49 more on the chords between them, so that a circle through all is 0.03 mm too
/// small; chamfers of 0.79 mm at 45° break both its edges, which is no countersink. The small holes
/// run out of the front wall (5.08 mm thick) into the top of the plate: they go through, their
/// walls end aslant.
#[test]
fn idler_riser_has_a_bore_and_two_screw_holes() {
    let Some(mesh) = part("trimesh_idler_riser.STL", Inch) else {
        return;
    };
    let screw = |x: f64| Round {
        depth: None,
        either_end: false,
        ..through(4.9784, [x, 0.0, 6.35], FRONT, 0.0)
    };
    let expected = [
        through(44.45, [31.75, 41.275, 0.0], DOWN, 15.875),
        screw(9.525),
        screw(53.975),
    ];
    let features = found(&mesh);
    check_holes(&features, &expected, &[]);
    // the collar around the bore
    let bosses = of_kind(&features, FeatureKind::Boss);
    assert_eq!(bosses.len(), 1);
    assert!(
        (bosses[0].diameter.as_ref().unwrap().value - 50.8e-3).abs() < 1e-6,
        "{:?}",
        bosses[0].diameter
    );
}

/// The slanted plate shows six holes, four with light through them; the front face three, one with
/// light at its end (the picture from behind). Genus 5. The blind ones have tips of 118°, outside
/// their depth: walls of 6.0 and 19.05 mm. The one with light leaves through a face at 45° and has
/// no stated depth.
#[test]
fn ee2_has_five_through_and_four_blind_holes() {
    let Some(mesh) = part("crs_ee2.stl", Metre) else {
        return;
    };
    let slant = [0.0, 1.0, -1.0];
    // along the slant: 56.446 mm outside, 50.096 inside; across it −0.548 and 12.958 in y and z
    let on = |x: f64, across: f64, along: f64| {
        let half = along / 2f64.sqrt();
        [x, across + half, across - half]
    };
    let mut expected: Vec<Round> = [15.9, -15.9]
        .into_iter()
        .flat_map(|x| {
            [-0.548, 12.958].map(|across| through(6.6, on(x, across, 56.446), slant, 6.35))
        })
        .collect();
    expected.extend([-0.548, 12.958].map(|across| blind(6.0, on(0.0, across, 56.446), slant, 6.0)));
    expected.push(blind(6.0, [0.0, 9.525, 0.0], FRONT, 5.999));
    expected.push(blind(5.0, [0.0, 9.525, -15.875], FRONT, 19.05));
    expected.push(Round {
        depth: None,
        either_end: false,
        ..through(5.0, [0.0, 9.525, 15.875], FRONT, 0.0)
    });
    check_holes(&found(&mesh), &expected, &[]);
}

/// From behind four counterbored and two plain holes with light, and one without; from the front
/// those two are counterbored, and there is another without light. Genus 6. Blind ones: walls of
/// 6.0 mm before tips of 118°.
#[test]
fn ee3_has_six_counterbored_and_two_blind_holes() {
    let Some(mesh) = part("crs_ee3.stl", Metre) else {
        return;
    };
    let (mut expected, mut steps) = (Vec::new(), Vec::new());
    let mut stepped = |large: Round, small: Round| {
        steps.push([expected.len(), expected.len() + 1]);
        expected.extend([large, small]);
    };
    for (x, z) in [17.678, -17.678]
        .into_iter()
        .flat_map(|x| [(x, 17.678), (x, -17.678)])
    {
        stepped(
            step(11.0, [x, 9.525, z], BACK, 6.4),
            step(6.6, [x, 3.125, z], BACK, 3.125),
        );
    }
    for z in [15.875, -15.875] {
        stepped(
            step(11.0, [0.0, 0.0, z], FRONT, 6.4),
            step(6.6, [0.0, 6.4, z], FRONT, 3.125),
        );
    }
    expected.push(blind(6.0, [0.0, 9.525, 0.0], BACK, 6.0));
    expected.push(blind(6.0, [25.0, 0.0, 0.0], FRONT, 6.0));
    check_holes(&found(&mesh), &expected, &steps);
}

/// Seven bodies: the plate, four press-fit studs and two pins. The pictures show 15 holes with
/// light and six with a stud or pin in them; the plate alone has genus 21. A reader who asks for
/// the holes of the plate wants all 21, and each goes through, with or without a stud. Circles of
/// the plate alone, z 63.5 to 73.025.
#[test]
fn tool_mounting_plate_has_21_holes_with_and_without_studs() {
    let Some(mesh) = part("godel_Tool_Mounting_Plate.STL", Metre) else {
        return;
    };
    let of = |diameter: f64, places: &[[f64; 2]]| -> Vec<Round> {
        places
            .iter()
            .map(|&[x, y]| through(diameter, [x, y, 73.025], UP, 9.525))
            .collect()
    };
    let expected = [
        of(
            6.6,
            &[
                [34.75, 20.0],
                [34.75, -20.0],
                [-34.532, 20.0],
                [-34.532, -20.0],
                [0.109, 0.0],
            ],
        ),
        of(6.0, &[[-39.891, 0.0]]),
        of(
            5.5,
            &[
                [-92.891, 12.0],
                [-127.891, 12.0],
                [-92.891, -12.0],
                [-127.891, -12.0],
            ],
        ),
        of(
            4.5,
            &[
                [21.109, 70.0],
                [-20.891, 70.0],
                [63.109, 202.287],
                [21.109, 112.0],
                [-20.891, 112.0],
                [-7.891, 140.287],
            ],
        ),
        of(
            4.1,
            &[
                [58.109, 147.287],
                [-92.891, 0.0],
                [-2.891, 195.287],
                [-127.891, 0.0],
            ],
        ),
        of(3.0, &[[40.109, 0.0]]),
    ];
    check_holes(&found(&mesh), &expected.concat(), &[]);
}

/// Six bodies: the lid and five countersunk screws in it. From above: ten counterbored holes, five
/// countersunk ones with light, five with a screw, five pin holes. Genus of the lid 25. Cones: r
/// 4.2164 to 8.0645 over 3.229 mm, 100.0°, and r 3.3782 to 6.4389 over 3.521 mm, 82.0°. Five of the
/// counterbores have edges broken by 0.635 mm at 45°, no countersinks; the ring groove of Ø 241.3
/// to 254 on the lower side is no hole. Threads and cross recesses of the screws are none.
#[test]
fn counter_has_25_holes_with_and_without_screws() {
    let Some(mesh) = part("trimesh_counter.unitsmm.STL", Millimetre) else {
        return;
    };
    let (mut expected, mut steps) = (Vec::new(), Vec::new());
    let counterbored = [
        [-72.11, 240.097],
        [153.93, 240.097],
        [-72.11, 75.87],
        [153.93, 75.87],
        [180.61, 157.984],
        [84.08, 25.121],
        [-2.26, 25.121],
        [-98.79, 157.984],
        [84.08, 290.846],
        [-2.26, 290.846],
    ];
    for [x, y] in counterbored {
        steps.push([expected.len(), expected.len() + 1]);
        expected.push(step(15.875, [x, y, 281.698], UP, 9.525));
        expected.push(step(10.0838, [x, y, 272.173], UP, 3.175));
    }
    let large = [
        [123.024, 271.003],
        [-91.952, 114.814],
        [-41.203, 271.003],
        [173.773, 114.814],
        [40.911, 18.284],
    ];
    let small = [
        [-91.952, 201.153],
        [173.773, 201.153],
        [-41.203, 44.964],
        [123.024, 44.964],
        [40.91, 297.684],
    ];
    let pins = [
        [139.693, 59.201],
        [19.056, 295.964],
        [165.384, 221.406],
        [-97.07, 179.837],
        [-22.512, 33.51],
    ];
    expected.extend(large.map(|[x, y]| countersunk(8.4328, [x, y, 278.469], UP, 9.471, 100.0)));
    expected.extend(small.map(|[x, y]| countersunk(6.7564, [x, y, 278.177], UP, 9.179, 82.0)));
    expected.extend(pins.map(|[x, y]| through(2.2606, [x, y, 281.698], UP, 12.7)));
    check_holes(&found(&mesh), &expected, &steps);
}

/// Circles through corners: 21 of Ø 9.525 end in tips of 118° below walls of 35.001 mm; at the four
/// corners Ø 6.7564 goes through below counterbores of Ø 11.1125. Genus 4.
#[test]
fn mold_has_21_blind_and_four_counterbored_holes() {
    let Some(mesh) = part("crs_mold_transformed.stl", Metre) else {
        return;
    };
    let features = found(&mesh);
    let holes = of_kind(&features, FeatureKind::Hole);
    let count = |diameter: f64, is_through: bool, depth: f64| {
        let is_it = |hole: &&&touchup::features::Feature| {
            let size = |size: &Option<touchup::features::MeasuredValue<f64>>| {
                size.as_ref().unwrap().value * 1e3
            };
            (size(&hole.diameter) - diameter).abs() < 2e-3
                && hole.through == Some(is_through)
                && (size(&hole.depth) - depth).abs() < 3e-3
        };
        holes.iter().filter(is_it).count()
    };
    let counts = [
        count(9.525, false, 35.001),
        count(11.1125, true, 6.35),
        count(6.7564, true, 44.45),
        holes.len(),
    ];
    assert_eq!(counts, [21, 4, 4, 29]);
}

/// One bore, Ø 38.1 mm (a circle through its corners), among recesses of six sides with rounded
/// corners: none of them is round, and none of them is a slot, though some have two walls that face
/// each other.
#[test]
fn octagonal_pocket_has_one_hole_and_no_slot() {
    let Some(mesh) = part("trimesh_octagonal_pocket.stl", Metre) else {
        return;
    };
    let features = found(&mesh);
    check_holes(
        &features,
        &[through(38.1, [203.2, 25.4, 0.0], DOWN, 15.875)],
        &[],
    );
    assert_eq!(of_kind(&features, FeatureKind::Slot).len(), 0);
}
