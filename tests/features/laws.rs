//! What detection must not depend on: where the part lies, how it is turned, and in which unit it was drawn.

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use proptest::prelude::*;
use touchup::features::{Feature, Kind};
use touchup::io::mesh_file::MeshUnit::{self, Inch, Metre, Millimetre};
use touchup::mesh::TriMesh;

use crate::{found, part};

const PARTS: [(&str, MeshUnit); 4] = [
    ("trimesh_featuretype.STL", Inch),
    ("trimesh_plate_holes.STL", Millimetre),
    ("crs_ee2.stl", Metre),
    ("crs_ee3.stl", Metre),
];

fn moved(mesh: &TriMesh, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> TriMesh {
    let faces = mesh.faces().map(|(_, corners)| corners.map(|v| v.0)).collect();
    TriMesh::new(mesh.positions().iter().map(place).collect(), faces).unwrap()
}

/// Whether `other` is `one` after the motion and the scale: kind, place, axis and sizes.
fn is_image(one: &Feature, other: &Feature, motion: &Isometry3<f64>, scale: f64, limit: f64) -> bool {
    let number = |f: &Feature| {
        [&f.diameter, &f.width, &f.length, &f.depth].map(|size| size.as_ref().map_or(0.0, |size| size.value))
    };
    let sizes = number(one).into_iter().zip(number(other)).all(|(a, b)| (a * scale - b).abs() < limit);
    // a plain through-hole may be told from its other end
    let way = one.axis.as_ref().map_or_else(Vector3::zeros, |axis| axis.value);
    let depth = one.depth.as_ref().map_or(0.0, |depth| depth.value);
    let places = [one.centre.value, one.centre.value - way * depth];
    let is_at = |p: &Point3<f64>| (motion * Point3::from(p.coords * scale) - other.centre.value).norm() < limit;
    one.kind == other.kind && one.through == other.through && sizes && places.iter().any(is_at)
}

fn holes_slots_pockets(features: &[Feature]) -> Vec<&Feature> {
    features.iter().filter(|f| matches!(f.kind, Kind::Hole | Kind::Slot | Kind::Pocket | Kind::Boss)).collect()
}

fn check(name: &str, mesh: &TriMesh, motion: &Isometry3<f64>, scale: f64) -> Result<(), TestCaseError> {
    let there = moved(mesh, |p| motion * Point3::from(p.coords * scale));
    let (here, there) = (found(mesh), found(&there));
    let (before, after) = (holes_slots_pockets(&here), holes_slots_pockets(&there));
    prop_assert_eq!(before.len(), after.len(), "{}", name);
    let [lo, hi] = mesh.bounds();
    // files are rounded to a millionth of the part: fits that end a step earlier or later differ by less
    let limit = 2e-6 * scale * (hi - lo).norm();
    for one in before {
        let images = after.iter().filter(|other| is_image(one, other, motion, scale, limit)).count();
        prop_assert_eq!(images, 1, "{}: {:?}", name, one);
    }
    Ok(())
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
