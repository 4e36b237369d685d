//! A mesh file of either kind: the result has finite places alone, and writing and reading it again
//! gives the same mesh.

use crate::{assert_is_somewhere, file, place};
use touchup_io::mesh_file::{MeshUnit, read_mesh, read_vertex_columns, write_mesh};

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let Some((&kind, bytes)) = data.split_first() else {
        return;
    };
    let path = file(
        ["scan.obj", "scan.stl", "scan.ply"][usize::from(kind) % 3],
        bytes,
    );
    let unit = [MeshUnit::Millimetre, MeshUnit::Metre][usize::from(kind / 3) % 2];
    let Ok(read) = read_mesh(&path, unit) else {
        return;
    };
    assert_is_somewhere(&read.mesh);
    let columns = read_vertex_columns(&path, unit, &read.mesh, ["sigma_mm", "support"])
        .expect("it was read before");
    assert!(
        columns
            .iter()
            .flatten()
            .all(|column| column.len() == read.mesh.positions().len())
    );
    let written = place("written.ply");
    write_mesh(&written, &read.mesh, MeshUnit::Metre).expect("every vertex has a place");
    let again = read_mesh(&written, MeshUnit::Metre)
        .expect("it was written here")
        .mesh;
    assert_eq!(again.positions(), read.mesh.positions());
}
