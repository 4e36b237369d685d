//! A point cloud of any kind: the reader returns at most as many points as the bytes can hold. The
//! surface through them stays out: its grid takes longer than all else.

use crate::file;
use touchup_io::mesh_file::{MeshOrPoints, MeshUnit, read_mesh_or_points};

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let Some((&kind, bytes)) = data.split_first() else {
        return;
    };
    let path = file(
        ["scan.pcd", "scan.xyz", "scan.e57", "scan.ply"][usize::from(kind) % 4],
        bytes,
    );
    let Ok(MeshOrPoints::Points(cloud)) = read_mesh_or_points(&path, MeshUnit::Metre) else {
        return;
    };
    let points = cloud.positions;
    // of all formats the packed one holds the most: 88 points in a byte
    assert!(
        points.len() <= 88 * bytes.len(),
        "{} points of {} bytes",
        points.len(),
        bytes.len()
    );
}
