//! What is found on meshes of known parts, on parts without features, and on bad ones.

#[path = "features/bad_input.rs"]
mod bad_input;
#[path = "features/cad_parts.rs"]
mod cad_parts;
#[path = "features/command.rs"]
mod command;
mod common;
#[path = "features/controls.rs"]
mod controls;
#[path = "features/drawn_plate.rs"]
mod drawn_plate;
#[path = "features/expected.rs"]
mod expected;
#[path = "features/laws.rs"]
mod laws;
#[path = "common/shapes.rs"]
mod shapes;
#[path = "features/sheets.rs"]
mod sheets;

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use touchup::features::{Feature, Kind, detect};
use touchup::io::mesh_file::{MeshUnit, read_mesh};
use touchup::mesh::{FaceTree, TriMesh, repair};

/// A file below `../shared/data`; `None`, said aloud, when it is not there. In CI it must be there.
fn shared(below: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(below);
    if !path.exists() {
        assert!(std::env::var_os("CI").is_none(), "{} is missing", path.display());
        println!("SKIPPED: {} is missing", path.display());
        return None;
    }
    Some(path)
}

/// A part, in m.
fn part(name: &str, unit: MeshUnit) -> Option<TriMesh> {
    Some(read_mesh(&shared("parts/permissive")?.join(name), unit).unwrap().mesh)
}

fn found(mesh: &TriMesh) -> Vec<Feature> {
    detect(mesh, &FaceTree::new(mesh), &[]).features
}

fn of_kind(features: &[Feature], kind: Kind) -> Vec<&Feature> {
    features.iter().filter(|feature| feature.kind == kind).collect()
}

fn triangles(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    mesh.faces().map(|(face, _)| mesh.triangle(face)).collect()
}

/// A mesh of loose triangles, as a file has them.
fn mesh_of(triangles: &[[Point3<f64>; 3]]) -> TriMesh {
    let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    repair(triangles.concat(), faces).unwrap().0
}
