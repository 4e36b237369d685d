//! The same part in bad meshes: turned inside out, torn, twice, with others.

use nalgebra::{Point3, Vector3};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind};
use touchup::io::mesh_file::MeshUnit::{self, Inch, Metre, Millimetre};
use touchup::io::mesh_file::read_mesh;
use touchup::mesh::TriMesh;

use crate::common::within;
use crate::features::detection::{found, mesh_of, of_kind, part, triangles};
use crate::shared::shared;

const PARTS: [(&str, MeshUnit, usize); 4] = [
    ("trimesh_featuretype.STL", Inch, 17),
    ("trimesh_plate_holes.STL", Millimetre, 6),
    ("crs_ee2.stl", Metre, 9),
    ("crs_ee3.stl", Metre, 14),
];

/// Diameter, depth (m), through, and cone angle of each hole, with its centre: in an order of their
/// own.
fn holes(features: &[Feature]) -> Vec<(Point3<f64>, [f64; 3], Option<bool>)> {
    let value = |number: &Option<touchup::features::MeasuredValue<f64>>| {
        number.as_ref().map_or(0.0, |number| number.value)
    };
    let row = |f: &&Feature| {
        (
            f.centre.value,
            [value(&f.diameter), value(&f.depth), value(&f.cone_angle)],
            f.through,
        )
    };
    of_kind(features, FeatureKind::Hole)
        .iter()
        .map(row)
        .collect()
}

/// Whether both have the same holes, within `limit` (m, rad).
fn are_alike(one: &[Feature], other: &[Feature], limit: f64) -> bool {
    let (one, other) = (holes(one), holes(other));
    let is_same = |a: &(Point3<f64>, [f64; 3], Option<bool>),
                   b: &(Point3<f64>, [f64; 3], Option<bool>)| {
        let axis_may_turn =
            (a.0 - b.0).norm() < limit || a.2 == Some(true) && (a.0 - b.0).norm() < a.1[1] + limit;
        axis_may_turn && (0..3).all(|i| (a.1[i] - b.1[i]).abs() < limit) && a.2 == b.2
    };
    one.len() == other.len()
        && one
            .iter()
            .all(|a| other.iter().filter(|b| is_same(a, b)).count() == 1)
}

fn parts() -> impl Iterator<Item = (&'static str, TriMesh, usize)> {
    PARTS
        .into_iter()
        .filter_map(|(name, unit, count)| Some((name, part(name, unit)?, count)))
}

#[test]
fn inside_out_is_turned_back() {
    for (name, mesh, count) in parts() {
        let turned: Vec<_> = triangles(&mesh)
            .into_iter()
            .map(|[a, b, c]| [a, c, b])
            .collect();
        let (straight, turned) = (found(&mesh), found(&mesh_of(&turned)));
        assert!(are_alike(&straight, &turned, 1e-9), "{name}");
        assert_eq!(
            (holes(&turned).len(), straight.len()),
            (count, turned.len()),
            "{name}"
        );
    }
}

#[test]
fn repeated_faces_count_once() {
    for (name, mesh, _) in parts() {
        let mut twice = triangles(&mesh);
        let again: Vec<_> = twice.iter().step_by(3).copied().collect();
        twice.extend(again);
        assert_eq!(found(&mesh_of(&twice)), found(&mesh), "{name}");
    }
}

#[test]
fn two_bodies_have_the_holes_of_both() {
    for (name, mesh, count) in parts() {
        let mut two = triangles(&mesh);
        let shift = Vector3::new(0.4, 0.03, 0.01);
        let other: Vec<_> = two
            .iter()
            .map(|corners| corners.map(|p| p + shift))
            .collect();
        two.extend(other);
        assert_eq!(holes(&found(&mesh_of(&two))).len(), 2 * count, "{name}");
    }
}

/// Every tenth face missing: each hole is still there, with its size, and the gaps are none.
#[test]
fn a_tenth_of_the_faces_missing_takes_no_hole_and_gives_none() {
    for (name, mesh, count) in parts() {
        let whole = holes(&found(&mesh));
        for seed in 0..5 {
            let mut rng = Pcg64::new(seed, 1);
            let left: Vec<_> = triangles(&mesh)
                .into_iter()
                .filter(|_| within(&mut rng, 0.0, 1.0) > 0.1)
                .collect();
            let torn = holes(&found(&mesh_of(&left)));
            assert_eq!(torn.len(), count, "{name}, seed {seed}");
            for (centre, [diameter, depth, _], _) in &whole {
                // along the axis a hole may open at its other end
                let is_it = |other: &&(Point3<f64>, [f64; 3], Option<bool>)| {
                    (other.1[0] - diameter).abs() < 1e-6
                        && (other.0 - centre).norm() < depth + 0.1e-3
                };
                assert!(
                    torn.iter().any(|other| is_it(&other)),
                    "{name}, seed {seed}: none at {centre}"
                );
            }
        }
    }
}

/// The block with 30 % of its facets turned over: the reader repairs it.
#[test]
fn turned_facets_are_turned_back() {
    let (Some(path), Some(mesh)) = (
        shared("nasty/made_flipped_30pct.stl"),
        part("trimesh_featuretype.STL", Inch),
    ) else {
        return;
    };
    let flipped = read_mesh(&path, Inch).unwrap();
    assert!(flipped.repair.flipped_faces > 1000, "{}", flipped.repair);
    assert!(are_alike(&found(&flipped.mesh), &found(&mesh), 1e-7));
}

/// Each readable bad file gives features, or none.
#[test]
fn bad_files_give_something_or_nothing() {
    let Some(folder) = shared("nasty") else {
        return;
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let mut read = 0;
    for path in files {
        let units = [Millimetre, Inch, Metre];
        let Some(file) = units
            .into_iter()
            .find_map(|unit| read_mesh(&path, unit).ok())
        else {
            continue;
        };
        read += 1;
        let features = found(&file.mesh);
        let is_finite = |f: &Feature| f.centre.value.coords.iter().all(|x| x.is_finite());
        assert!(features.iter().all(is_finite), "{}", path.display());
    }
    assert!(read > 20, "{read} files");
}
