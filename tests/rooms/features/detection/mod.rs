//! Features found on meshes of known parts, on parts without features, and on bad ones.

mod bad_input;
mod cad_parts;
mod command;
mod controls;
mod drawn_plate;
mod expected;
mod laws;
mod sheets;
mod spheres;

use nalgebra::Point3;
use touchup::features::{Feature, FeatureKind, detect};
use touchup::io::mesh_file::{MeshUnit, read_mesh};
use touchup::mesh::{TriMesh, repair};

use crate::shared::shared;

/// A part, in m.
fn part(name: &str, unit: MeshUnit) -> Option<TriMesh> {
    Some(
        read_mesh(&shared("parts/permissive")?.join(name), unit)
            .unwrap()
            .mesh,
    )
}

fn found(mesh: &TriMesh) -> Vec<Feature> {
    detect(mesh, &[]).features
}

fn of_kind(features: &[Feature], kind: FeatureKind) -> Vec<&Feature> {
    features
        .iter()
        .filter(|feature| feature.kind == kind)
        .collect()
}

fn triangles(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    mesh.faces().map(|(face, _)| mesh.triangle(face)).collect()
}

/// A mesh of loose triangles, as a file has them.
fn mesh_of(triangles: &[[Point3<f64>; 3]]) -> TriMesh {
    let faces = (0..triangles.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    repair(triangles.concat(), faces).unwrap().0
}
