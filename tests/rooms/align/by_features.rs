//! Registration by features: finds known motions of real parts from anywhere, and reports
//! undetermined ones.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;
use touchup::align::{
    Alternative, FeaturesError, FeaturesParams, FeaturesSide, OrientedSample, Surfaces,
    align_features,
};
use touchup::compare::{sample_surface, surface_area};
use touchup::features::{Feature, FeatureKind, detect};
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::mesh::{FaceTree, TriMesh, VertexId};

use crate::shared::shared;

fn part_path(name: &str) -> Option<PathBuf> {
    shared(&format!("parts/permissive/{name}"))
}

/// A shape with its features.
struct Part {
    mesh: TriMesh,
    tree: FaceTree,
    features: Vec<Feature>,
}

impl Part {
    fn new(mesh: TriMesh) -> Self {
        let tree = FaceTree::new(&mesh);
        let features = detect(&mesh, &[]).features;
        Self {
            mesh,
            tree,
            features,
        }
    }

    fn read(name: &str, unit: MeshUnit) -> Option<Self> {
        Some(Self::new(read_mesh(&part_path(name)?, unit).unwrap().mesh))
    }

    fn moved(&self, motion: &Isometry3<f64>) -> Self {
        Self::new(moved(&self.mesh, |p| motion * p))
    }

    fn points(&self) -> Vec<OrientedSample> {
        let samples = sample_surface(&self.mesh, 20_000.0 / surface_area(&self.mesh), 5);
        samples
            .iter()
            .map(|s| OrientedSample {
                point: s.point,
                normal: self.mesh.normal(s.face),
            })
            .collect()
    }

    /// Largest displacement between two motions of a corner of its bounding box, m.
    fn apart(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        let [lo, hi] = self.mesh.bounds();
        let pick = |i: usize| {
            Point3::from(Vector3::from_fn(
                |axis, _| if i >> axis & 1 == 0 { lo } else { hi }[axis],
            ))
        };
        (0..8)
            .map(pick)
            .map(|p| (a * p - b * p).norm())
            .fold(0.0, f64::max)
    }
}

fn moved(mesh: &TriMesh, place: impl Fn(Point3<f64>) -> Point3<f64>) -> TriMesh {
    let positions = (0..mesh.vertex_slots() as u32)
        .map(|v| place(mesh.position(VertexId(v))))
        .collect();
    TriMesh::new(
        positions,
        mesh.faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect(),
    )
    .unwrap()
}

fn align(source: &Part, features: &[Feature], target: &Part) -> Result<Alternative, FeaturesError> {
    let points = source.points();
    let surfaces = Surfaces {
        points: &points,
        target: &target.mesh,
        tree: &target.tree,
    };
    align_features(
        features,
        &target.features,
        Some(&surfaces),
        &FeaturesParams::default(),
    )
}

/// Any orientation alike, up to 1 m away.
fn anywhere(rng: &mut Pcg64) -> Isometry3<f64> {
    let [w, x, y, z]: [f64; 4] = std::array::from_fn(|_| StandardNormal.sample(rng));
    let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let shift: [f64; 3] = std::array::from_fn(|_| 2.0 * uniform(rng) - 1.0);
    Isometry3::from_parts(Translation3::from(Vector3::from(shift)), turn)
}

fn uniform(rng: &mut Pcg64) -> f64 {
    StandardUniform.sample(rng)
}

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// Features in other places, in the box of the part: none of them is there.
fn false_ones(part: &Part, count: usize, rng: &mut Pcg64) -> Vec<Feature> {
    let [lo, hi] = part.mesh.bounds();
    let fake = |i: usize| {
        let mut feature = part.features[i % part.features.len()].clone();
        let place = |axis: usize, rng: &mut Pcg64| lo[axis] + (hi[axis] - lo[axis]) * uniform(rng);
        feature.centre.value = Point3::new(place(0, rng), place(1, rng), place(2, rng));
        feature
            .axis
            .iter_mut()
            .for_each(|axis| axis.value = anywhere(rng).rotation * axis.value);
        feature
    };
    (0..count).map(fake).collect()
}

/// The features without three tenths of them.
fn subset(features: &[Feature], rng: &mut Pcg64) -> Vec<Feature> {
    features
        .iter()
        .filter(|_| uniform(rng) >= 0.3)
        .cloned()
        .collect()
}

const PARTS: [(&str, MeshUnit); 5] = [
    ("crs_ee3.stl", MeshUnit::Metre),
    ("crs_ee2.stl", MeshUnit::Metre),
    ("trimesh_featuretype.STL", MeshUnit::Inch),
    ("trimesh_plate_holes.STL", MeshUnit::Millimetre),
    ("trimesh_idler_riser.STL", MeshUnit::Inch),
];

#[test]
#[ignore = "a slow proof"]
fn real_parts_are_found_from_anywhere() {
    for (name, unit) in PARTS {
        let Some(target) = Part::read(name, unit) else {
            return;
        };
        let mut rng = Pcg64::new(11, 3);
        for _ in 0..4 {
            let known = anywhere(&mut rng);
            let source = target.moved(&known.inverse());
            let found =
                align(&source, &source.features, &target).unwrap_or_else(|e| panic!("{name}: {e}"));
            let off = source.apart(&found.source_to_target, &known);
            assert!(off < 1e-6, "{name}: off by {off:.2e} m");
            assert!(
                found.agreeing.unwrap() > 0.999,
                "{name}: {:?}",
                found.agreeing
            );
        }
    }
}

#[test]
#[ignore = "a slow proof"]
fn features_may_be_missing_and_false_and_out_of_place() {
    for (name, unit) in PARTS {
        let Some(target) = Part::read(name, unit) else {
            return;
        };
        let [lo, hi] = target.mesh.bounds();
        // half of the allowed
        let noise = 0.002 * (hi - lo).norm();
        let mut rng = Pcg64::new(23, 3);
        for round in 0..4 {
            let known = anywhere(&mut rng);
            let source = target.moved(&known.inverse());
            let mut features = subset(&source.features, &mut rng);
            for feature in &mut features {
                feature.centre.value += Vector3::from_fn(|_, _| noise * normal(&mut rng));
            }
            features.extend(false_ones(&source, source.features.len() / 4, &mut rng));
            let found = match align(&source, &features, &target) {
                Ok(found) => found,
                Err(error) => panic!("{name}, {round}: {error}"),
            };
            let off = source.apart(&found.source_to_target, &known);
            assert!(off < 1e-6, "{name}, {round}: off by {off:.2e} m");
        }
    }
}

#[test]
fn features_alone_determine_the_motion_as_well_as_they_are_known() {
    let Some(target) = Part::read("crs_ee2.stl", MeshUnit::Metre) else {
        return;
    };
    let mut rng = Pcg64::new(5, 9);
    for _ in 0..6 {
        let known = anywhere(&mut rng);
        let mut source = target.moved(&known.inverse());
        for feature in &mut source.features {
            feature.centre.value += Vector3::from_fn(|_, _| 0.05e-3 * normal(&mut rng));
        }
        let found = align_features(
            &source.features,
            &target.features,
            None,
            &FeaturesParams::default(),
        )
        .unwrap();
        // 0.05 mm each, of dozens of features
        assert!(source.apart(&found.source_to_target, &known) < 0.1e-3);
    }
}

#[test]
fn moving_either_side_moves_the_answer() {
    let Some(part) = Part::read("crs_ee2.stl", MeshUnit::Metre) else {
        return;
    };
    let mut rng = Pcg64::new(8, 1);
    let [first, second] = [anywhere(&mut rng), anywhere(&mut rng)];
    let (source, target) = (part.moved(&first), part.moved(&second));
    let found = align(&source, &source.features, &target).unwrap();
    let expected = second * first.inverse();
    assert!(source.apart(&found.source_to_target, &expected) < 1e-6);
}

// The flange crs_ee3 looks the same after half a turn about its axis but for one dowel hole in its
// lower side, at x = 25 mm: four counterbored holes on a square, two on a line, and one in the
// middle. After a quarter of a turn the two on the line meet no hole.
#[test]
fn a_flange_is_ambiguous_without_the_one_hole_that_breaks_its_symmetry() {
    let Some(part) = Part::read("crs_ee3.stl", MeshUnit::Metre) else {
        return;
    };
    let is_dowel = |f: &Feature| {
        f.kind == FeatureKind::Hole
            && (f.centre.value.x - 0.025).abs() < 1e-3
            && f.centre.value.z.abs() < 1e-3
    };
    let with_it = part.features.len();
    let features: Vec<_> = part
        .features
        .iter()
        .filter(|f| !is_dowel(f))
        .cloned()
        .collect();
    assert_eq!(features.len(), with_it - 1);
    let answer = align_features(&features, &part.features, None, &FeaturesParams::default());
    let Err(FeaturesError::Ambiguous { alternatives }) = answer else {
        panic!("{answer:?}")
    };
    assert_eq!(alternatives.len(), 2);
    let [turn, shift] = alternatives[1].differs;
    assert!(
        (turn.norm() - std::f64::consts::PI).abs() < 1e-3 && turn.normalize().y.abs() > 0.999,
        "{turn}"
    );
    assert!(
        shift.norm() < 0.1e-3
            && alternatives
                .iter()
                .all(|a| a.explained.len() == features.len()),
        "{alternatives:?}"
    );
    // with it there is one motion, by features alone as well as with the surface
    assert!(
        align_features(
            &part.features,
            &part.features,
            None,
            &FeaturesParams::default()
        )
        .is_ok()
    );
}

/// A box in m, with 12 faces.
fn block(size: [f64; 3]) -> TriMesh {
    let corner = |i: usize| {
        Point3::new(
            [0.0, size[0]][i & 1],
            [0.0, size[1]][i >> 1 & 1],
            [0.0, size[2]][i >> 2],
        )
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = quads
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .collect();
    TriMesh::new((0..8).map(corner).collect(), faces).unwrap()
}

// The rotations of a body onto itself: 24 of a cube, 8 of a square prism, 4 of a box with three
// different sides.
#[test]
fn every_rotation_of_a_box_onto_itself_is_reported() {
    let motion = anywhere(&mut Pcg64::new(3, 3));
    for (size, rotations) in [
        ([30e-3, 30e-3, 30e-3], 24),
        ([30e-3, 30e-3, 50e-3], 8),
        ([20e-3, 30e-3, 50e-3], 4),
    ] {
        let target = Part::new(block(size));
        let source = target.moved(&motion);
        let answer = align(&source, &source.features, &target);
        let Err(FeaturesError::Ambiguous { alternatives }) = answer else {
            panic!("{size:?}: {answer:?}")
        };
        assert_eq!(alternatives.len(), rotations, "{size:?}");
        let is_there = alternatives
            .iter()
            .any(|a| source.apart(&a.source_to_target, &motion.inverse()) < 1e-6);
        assert!(is_there, "{size:?}");
    }
}

#[test]
fn a_mirror_image_is_refused() {
    let twin = Part::new(skewed_block(-1.0));
    let part = Part::new(skewed_block(1.0));
    let answer = align(&twin, &twin.features, &part);
    assert!(
        matches!(answer, Err(FeaturesError::Mirrored { .. })),
        "{answer:?}"
    );
    assert!(align(&part, &part.features, &part).is_ok());
}

/// A tetrahedron with three different legs along the axes; of the other hand with `hand` −1.
fn skewed_block(hand: f64) -> TriMesh {
    let corners = [
        [0.0, 0.0, 0.0],
        [20e-3 * hand, 0.0, 0.0],
        [0.0, 35e-3, 0.0],
        [0.0, 0.0, 55e-3],
    ];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let faces = faces
        .iter()
        .map(|&[a, b, c]| if hand > 0.0 { [a, b, c] } else { [a, c, b] })
        .collect();
    TriMesh::new(corners.iter().map(|&c| Point3::from(c)).collect(), faces).unwrap()
}

#[test]
fn failed_alignments_say_what_to_do() {
    let part = Part::new(skewed_block(1.0));
    let params = FeaturesParams::default();
    for (source, target, side) in [
        (&[][..], &part.features[..], FeaturesSide::Source),
        (&part.features, &[], FeaturesSide::Target),
    ] {
        let answer = align_features(source, target, None, &params).unwrap_err();
        assert_eq!(answer, FeaturesError::NoFeatures { side });
        assert!(
            answer.to_string().contains("pick pairs of points"),
            "{answer}"
        );
    }
    // planes alone determine no position
    let planes: Vec<_> = part
        .features
        .iter()
        .filter(|f| f.kind == FeatureKind::Plane)
        .cloned()
        .collect();
    let answer = align_features(&planes, &part.features, None, &params).unwrap_err();
    assert_eq!(
        answer,
        FeaturesError::TooFew {
            side: FeaturesSide::Source,
            found: 4
        }
    );
    // another part
    let other = Part::new(block([20e-3, 30e-3, 50e-3]));
    let answer = align(&other, &other.features, &part).unwrap_err();
    assert!(
        matches!(answer, FeaturesError::NoMatch { .. }),
        "{answer:?}"
    );
}

/// A body of revolution about z, of `sides` sides: corners of its outline as radius and height, m,
/// from the axis outside and up; with equal radii above 0 at both ends it has a bore.
fn turned_part(outline: &[[f64; 2]], sides: u32) -> TriMesh {
    let is_open = outline[0][0] == 0.0;
    let ring = |[radius, height]: [f64; 2]| {
        (0..sides).map(move |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(sides);
            Point3::new(radius * angle.cos(), radius * angle.sin(), height)
        })
    };
    let rings: Vec<[f64; 2]> = outline
        .iter()
        .copied()
        .filter(|[radius, _]| *radius > 0.0)
        .collect();
    let mut positions: Vec<Point3<f64>> = rings.iter().flat_map(|&corner| ring(corner)).collect();
    let count = rings.len() as u32;
    let strips = if is_open { count - 1 } else { count };
    let mut faces = Vec::new();
    for (low, i) in (0..strips).flat_map(|low| (0..sides).map(move |i| (low, i))) {
        let (high, j) = ((low + 1) % count, (i + 1) % sides);
        let [a, b, c, d] = [
            low * sides + i,
            low * sides + j,
            high * sides + j,
            high * sides + i,
        ];
        faces.extend([[a, b, c], [a, c, d]]);
    }
    if is_open {
        let [bottom, top] = [positions.len() as u32, positions.len() as u32 + 1];
        positions.extend(
            [outline[0], outline[outline.len() - 1]].map(|[_, z]| Point3::new(0.0, 0.0, z)),
        );
        let last = (count - 1) * sides;
        faces.extend((0..sides).flat_map(|i| {
            let j = (i + 1) % sides;
            [[bottom, j, i], [top, last + i, last + j]]
        }));
    }
    TriMesh::new(positions, faces).unwrap()
}

fn mm(outline: &[[f64; 2]]) -> Vec<[f64; 2]> {
    outline
        .iter()
        .map(|corner| corner.map(|x| x * 1e-3))
        .collect()
}

// A continuum of equally good motions: the axis is that of the body, z before the motion.
#[test]
fn a_part_of_revolution_is_reported_free_to_turn() {
    let bar = mm(&[
        [0.0, 0.0],
        [15.0, 0.0],
        [15.0, 20.0],
        [10.0, 20.0],
        [10.0, 45.0],
        [6.0, 45.0],
        [6.0, 60.0],
        [0.0, 60.0],
    ]);
    let flange = mm(&[
        [8.0, 0.0],
        [40.0, 0.0],
        [40.0, 10.0],
        [20.0, 10.0],
        [20.0, 25.0],
        [8.0, 25.0],
    ]);
    let disc = mm(&[[8.0, 0.0], [40.0, 0.0], [40.0, 10.0], [8.0, 10.0]]);
    let mut rng = Pcg64::new(17, 2);
    for (name, outline, count) in [("bar", &bar, 1), ("flange", &flange, 1), ("disc", &disc, 2)] {
        for sides in [64, 90] {
            let target = Part::new(turned_part(outline, sides));
            let known = anywhere(&mut rng);
            let source = target.moved(&known.inverse());
            let answer = align(&source, &source.features, &target);
            let Err(FeaturesError::FreeTurn { turn, alternatives }) = answer else {
                panic!("{name}, {sides} sides: {answer:?}")
            };
            assert!(
                turn.axis.z.abs() > 0.9999 && turn.through.coords.xy().norm() < 0.1e-3,
                "{name}: {turn:?}"
            );
            assert_eq!(
                alternatives.len(),
                count,
                "{name}, {sides}: laid onto the axis from one end, or from both"
            );
            // the answer is right but for the turn
            let turned = alternatives[0].source_to_target * known.inverse();
            let off = |p: Point3<f64>| {
                let [own, there] = [p, turned * p];
                (own.z - there.z)
                    .abs()
                    .max((own.coords.xy().norm() - there.coords.xy().norm()).abs())
            };
            let largest = [[0.01, 0.0, 0.0], [0.0, 0.04, 0.01]]
                .map(|p| off(Point3::from(p)))
                .into_iter()
                .fold(0.0, f64::max);
            assert!(name == "disc" || largest < 0.1e-3, "{name}: {largest}");
        }
    }
}

// Two holes beside the middle, at different distances, hold the turn.
#[test]
fn a_flange_with_more_than_its_middle_hole_is_not_free() {
    let Some(part) = Part::read("crs_ee3.stl", MeshUnit::Metre) else {
        return;
    };
    let answer = align(&part, &part.features, &part);
    assert!(answer.is_ok(), "{answer:?}");
    // its middle hole and the planes square to it alone determine no turn, and the surface says
    // that there is one
    let middle = |f: &Feature| match f.kind {
        FeatureKind::Hole => f.centre.value.coords.xz().norm() < 1e-3,
        FeatureKind::Plane => f
            .axis
            .as_ref()
            .is_some_and(|axis| axis.value.y.abs() > 0.99),
        _ => false,
    };
    let few: Vec<Feature> = part
        .features
        .iter()
        .filter(|f| middle(f))
        .cloned()
        .collect();
    assert!(few.iter().any(|f| f.kind == FeatureKind::Hole));
    let answer = align(&part, &few, &part).unwrap_err();
    assert_eq!(
        answer,
        FeaturesError::TooFew {
            side: FeaturesSide::Source,
            found: few.len()
        }
    );
}

// ---- at the boundary of the process

fn touchup(arguments: &[&str]) -> std::process::Output {
    let program = env!("CARGO_BIN_EXE_touchup-tested");
    std::process::Command::new(program)
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

/// The refined mesh of a judged case, and its truth.
fn refined_case(name: &str, folder: &Path) -> Option<[PathBuf; 2]> {
    let case = shared(&format!("cases/{name}"))?;
    let out = folder.join("refined.ply");
    let [scan, bag] =
        ["scan.ply", "touch.mcap"].map(|file| case.join(file).to_str().unwrap().to_owned());
    let tip = ["--tip-radius-mm", "1.5", "--stiffness-n-per-mm", "20"];
    let output = touchup(
        &[
            &[
                "refine",
                "--scan",
                &scan,
                "--bag",
                &bag,
                "--out",
                out.to_str().unwrap(),
            ],
            &tip[..],
        ]
        .concat(),
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some([out, case.join("truth.ply")])
}

// A third to a half of these meshes is the bare scan, 0.6 mm noisy and 0.3 mm too large, and limits
// the fit. From above the flange has a half turn that the touches do not break: the dowel hole is
// on the other side.
#[test]
#[ignore = "a slow proof"]
fn refined_meshes_come_onto_their_truth_from_anywhere() {
    let mut rng = Pcg64::new(77, 7);
    let cases = [("plate", 1), ("flange", 2), ("featuretype", 1)];
    for &(name, motions) in &cases {
        let folder = tempfile::tempdir().unwrap();
        let Some([refined, truth]) = refined_case(name, folder.path()) else {
            return;
        };
        let [refined, truth] = [refined, truth]
            .map(|path| Part::new(read_mesh(&path, MeshUnit::Millimetre).unwrap().mesh));
        for _ in 0..2 {
            let known = anywhere(&mut rng);
            let source = refined.moved(&known.inverse());
            let found = match align(&source, &source.features, &truth) {
                Ok(found) => vec![found],
                Err(FeaturesError::Ambiguous { alternatives }) => alternatives,
                Err(error) => panic!("{name}: {error}"),
            };
            let off = found
                .iter()
                .map(|a| source.apart(&a.source_to_target, &known))
                .fold(f64::INFINITY, f64::min);
            assert!(
                found.len() == motions && off < 0.5e-3,
                "{name}: {} motions, off by {off:.2e} m",
                found.len()
            );
        }
    }
}

#[test]
#[expect(clippy::too_many_lines)]
fn the_command_line_lists_alternatives_and_takes_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [mesh, truth] = [path("mesh.ply"), path("truth.ply")];
    let box_of_three = Part::new(block([20e-3, 30e-3, 50e-3]));
    let known = anywhere(&mut Pcg64::new(4, 4));
    write_mesh(truth.as_ref(), &box_of_three.mesh, MeshUnit::Millimetre).unwrap();
    write_mesh(
        mesh.as_ref(),
        &box_of_three.moved(&known).mesh,
        MeshUnit::Millimetre,
    )
    .unwrap();
    let call = |more: &[&str]| {
        touchup(
            &[
                &[
                    "compare",
                    &mesh,
                    &truth,
                    "--align",
                    "features",
                    "--samples",
                    "1000",
                ],
                more,
            ]
            .concat(),
        )
    };
    let json = |output: &std::process::Output| {
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };

    let answer = call(&[]);
    assert_eq!(answer.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&answer.stdout).contains("--alternative K"));
    let answer = call(&["--json"]);
    let alternatives = json(&answer)["ambiguous"].as_array().unwrap().clone();
    assert_eq!((answer.status.code(), alternatives.len()), (Some(3), 4));
    // the other three are half turns
    assert!(
        alternatives[1..]
            .iter()
            .all(|a| (a["turn_deg"].as_f64().unwrap() - 180.0).abs() < 1e-3),
        "{alternatives:?}"
    );
    for number in ["1", "4"] {
        let answer = call(&["--json", "--alternative", number]);
        assert!(
            answer.status.success(),
            "{}",
            String::from_utf8_lossy(&answer.stderr)
        );
        assert!(
            json(&answer)["after"]["regions"][0]["mesh_to_truth"]["max_mm"]
                .as_f64()
                .is_none_or(|max| max < 1e-3)
        );
    }
    assert_eq!(call(&["--alternative", "5"]).status.code(), Some(2));

    // three corners by hand, one of them 0.3 mm off
    let pairs = path("pairs.csv");
    let mut text =
        "scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm,name\n".to_owned();
    for (name, to) in [
        ("a", [0.0, 0.0, 0.0]),
        ("b", [20.0, 0.0, 0.0]),
        ("c", [0.0, 30.0, 0.0]),
        ("d", [0.0, 0.0, 50.3]),
    ] {
        let from = known * (Point3::new(to[0], to[1], f64::min(to[2], 50.0)) / 1e3) * 1e3;
        text += &format!(
            "{},{},{},{},{},{},{name}\n",
            from.x, from.y, from.z, to[0], to[1], to[2]
        );
    }
    std::fs::write(&pairs, text).unwrap();
    let answer = touchup(&[
        "compare",
        &mesh,
        &truth,
        "--align",
        "pairs",
        &pairs,
        "--samples",
        "1000",
        "--json",
    ]);
    assert!(
        answer.status.success(),
        "{}",
        String::from_utf8_lossy(&answer.stderr)
    );
    let alignment = &json(&answer)["alignment"];
    assert_eq!(alignment["residuals"].as_array().unwrap().len(), 4);
    assert!(
        (0.05..0.3).contains(&alignment["rms_mm"].as_f64().unwrap()),
        "{alignment}"
    );
    assert_eq!(
        touchup(&["compare", &mesh, &truth, "--align", "pairs"])
            .status
            .code(),
        Some(2)
    );
    assert_eq!(
        touchup(&["compare", &mesh, &truth, &pairs]).status.code(),
        Some(2)
    );

    // no features: the error names the remedy
    std::fs::write(&mesh, "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                           element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n9 0 0\n0 9 0\n3 0 1 2\n").unwrap();
    let answer = call(&[]);
    assert_eq!(answer.status.code(), Some(3));
    assert!(
        String::from_utf8_lossy(&answer.stderr).contains("pick pairs of points"),
        "{}",
        String::from_utf8_lossy(&answer.stderr)
    );
}

#[test]
#[expect(clippy::too_many_lines)]
fn the_command_line_reports_the_axis_of_a_free_turn() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [mesh, truth] = [path("mesh.ply"), path("truth.ply")];
    let flange = mm(&[
        [8.0, 0.0],
        [40.0, 0.0],
        [40.0, 10.0],
        [20.0, 10.0],
        [20.0, 25.0],
        [8.0, 25.0],
    ]);
    let part = turned_part(&flange, 64);
    write_mesh(truth.as_ref(), &part, MeshUnit::Millimetre).unwrap();
    let known = anywhere(&mut Pcg64::new(8, 4));
    write_mesh(
        mesh.as_ref(),
        &moved(&part, |p| known * p),
        MeshUnit::Millimetre,
    )
    .unwrap();
    let call = |more: &[&str]| {
        touchup(
            &[
                &[
                    "compare",
                    &mesh,
                    &truth,
                    "--align",
                    "features",
                    "--samples",
                    "1000",
                ],
                more,
            ]
            .concat(),
        )
    };
    let answer = call(&[]);
    let text = String::from_utf8_lossy(&answer.stdout).into_owned();
    assert_eq!(answer.status.code(), Some(3), "{text}");
    assert!(
        text.contains("free to turn about") && text.contains("--alternative K"),
        "{text}"
    );
    let answer = call(&["--json"]);
    let answer: serde_json::Value = serde_json::from_slice(&answer.stdout).unwrap();
    let axis = answer["free_turn"]["axis"]
        .as_array()
        .unwrap_or_else(|| panic!("{answer}"));
    assert!(axis[2].as_f64().unwrap().abs() > 0.9999, "{answer}");
    // a body of 64 sides fits at any turn, within the deviation of its sides from the circle
    let taken = call(&["--json", "--alternative", "1"]);
    assert!(
        taken.status.success(),
        "{}",
        String::from_utf8_lossy(&taken.stderr)
    );
    let taken: serde_json::Value = serde_json::from_slice(&taken.stdout).unwrap();
    let most = taken["after"]["regions"][0]["mesh_to_truth"]["max_mm"]
        .as_f64()
        .unwrap();
    assert!(
        most < 40.0 * (1.0 - (std::f64::consts::PI / 64.0).cos()),
        "{most}"
    );
}
