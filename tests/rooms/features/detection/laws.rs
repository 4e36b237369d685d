//! Detection does not depend on the pose of the part, nor on the unit of its drawing.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use proptest::prelude::*;
use touchup::features::{Feature, FeatureKind};
use touchup::io::mesh_file::MeshUnit::{self, Inch, Metre, Millimetre};
use touchup::mesh::TriMesh;

use crate::features::detection::{found, part};

const PARTS: [(&str, MeshUnit); 4] = [
    ("trimesh_featuretype.STL", Inch),
    ("trimesh_plate_holes.STL", Millimetre),
    ("crs_ee2.stl", Metre),
    ("crs_ee3.stl", Metre),
];

/// Those whose circles have at least 30 sides.
const FINE: [(&str, MeshUnit); 2] = [PARTS[0], PARTS[1]];

fn moved(mesh: &TriMesh, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> TriMesh {
    let faces = mesh
        .faces()
        .map(|(_, corners)| corners.map(|v| v.0))
        .collect();
    TriMesh::new(mesh.positions().iter().map(place).collect(), faces).unwrap()
}

/// Whether `other` is `one` after the motion and the scale: kind, place, axis and sizes.
fn is_image(
    one: &Feature,
    other: &Feature,
    motion: &Isometry3<f64>,
    scale: f64,
    limit: f64,
) -> bool {
    let number = |f: &Feature| {
        [&f.diameter, &f.width, &f.length, &f.depth]
            .map(|size| size.as_ref().map_or(0.0, |size| size.value))
    };
    let sizes = number(one)
        .into_iter()
        .zip(number(other))
        .all(|(a, b)| (a * scale - b).abs() < limit);
    // its other end describes a plain through-hole as well
    let direction = one
        .axis
        .as_ref()
        .map_or_else(Vector3::zeros, |axis| axis.value);
    let depth = one.depth.as_ref().map_or(0.0, |depth| depth.value);
    let places = [one.centre.value, one.centre.value - direction * depth];
    let is_at = |p: &Point3<f64>| {
        (motion * Point3::from(p.coords * scale) - other.centre.value).norm() < limit
    };
    one.kind == other.kind && one.through == other.through && sizes && places.iter().any(is_at)
}

fn holes_slots_pockets(features: &[Feature]) -> Vec<&Feature> {
    features
        .iter()
        .filter(|f| {
            matches!(
                f.kind,
                FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Pocket | FeatureKind::Boss
            )
        })
        .collect()
}

fn check(
    name: &str,
    mesh: &TriMesh,
    motion: &Isometry3<f64>,
    scale: f64,
) -> Result<(), TestCaseError> {
    let there = moved(mesh, |p| motion * Point3::from(p.coords * scale));
    let (here, there) = (found(mesh), found(&there));
    let (before, after) = (holes_slots_pockets(&here), holes_slots_pockets(&there));
    prop_assert_eq!(before.len(), after.len(), "{}", name);
    let [lo, hi] = mesh.bounds();
    // the files round to a millionth of the part: fits that end a step earlier or later differ by
    // less
    let limit = 2e-6 * scale * (hi - lo).norm();
    for one in before {
        let images = after
            .iter()
            .filter(|other| is_image(one, other, motion, scale, limit))
            .count();
        prop_assert_eq!(images, 1, "{}: {:?}", name, one);
    }
    Ok(())
}

/// Each face in four, cut at the middles of its edges.
fn divided(mesh: &TriMesh) -> TriMesh {
    let mut positions = mesh.positions().to_vec();
    let mut middles = BTreeMap::new();
    let mut faces = Vec::new();
    for (_, corners) in mesh.faces() {
        let [a, b, c] = corners.map(|v| v.0);
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            *middles
                .entry([from.min(to), from.max(to)])
                .or_insert_with(|| {
                    positions.push(nalgebra::center(
                        &positions[from as usize],
                        &positions[to as usize],
                    ));
                    positions.len() as u32 - 1
                })
        });
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    TriMesh::new(positions, faces).unwrap()
}

/// Dividing the faces of a drawing keeps its part if circles have many sides: a hole of twelve flat
/// sides, each of several faces, does not become a round one.
#[test]
fn finer_faces_change_nothing() {
    for (name, unit) in FINE {
        let Some(mut mesh) = part(name, unit) else {
            return;
        };
        let [lo, hi] = mesh.bounds();
        let before = found(&mesh);
        while mesh.face_count() < 50_000 {
            mesh = divided(&mesh);
            let after = found(&mesh);
            let (one, other) = (holes_slots_pockets(&before), holes_slots_pockets(&after));
            assert_eq!(
                one.len(),
                other.len(),
                "{name}, {} faces",
                mesh.face_count()
            );
            for one in one {
                let is_same = |f: &&&Feature| {
                    is_image(one, f, &Isometry3::identity(), 1.0, 2e-6 * (hi - lo).norm())
                };
                assert_eq!(
                    other.iter().filter(is_same).count(),
                    1,
                    "{name}, {} faces: {one:?}",
                    mesh.face_count()
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_motion_of_the_part_moves_its_features(
        which in 0..4usize, axis in prop::array::uniform3(-1.0..1.0f64), angle in -3.1..3.1f64,
        shift in prop::array::uniform3(-0.3..0.3f64),
    ) {
        prop_assume!(Vector3::from(axis).norm() > 0.1);
        let (name, unit) = PARTS[which];
        let Some(mesh) = part(name, unit) else { return Ok(()) };
        let turn = Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis.into()), angle);
        check(name, &mesh, &Isometry3::from_parts(Vector3::from(shift).into(), turn.into()), 1.0)?;
    }

    #[test]
    fn a_change_of_unit_scales_the_features(which in 0..4usize, exponent in -3.0..3.0f64) {
        let (name, unit) = PARTS[which];
        let Some(mesh) = part(name, unit) else { return Ok(()) };
        check(name, &mesh, &Isometry3::identity(), 10f64.powf(exponent))?;
    }
}
