//! Reads a scan: a mesh, or points that it makes a surface of.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use touchup_geometry::mesh::{RepairReport, Texture, TriMesh};
use touchup_io::mesh_file::{MeshFile, MeshFileError, MeshOrPoints, MeshUnit, VertexColumn};
use touchup_io::mesh_file::{read_appearance, read_mesh_or_points, repaired};
use touchup_method::reconstruct::{CloudError, CloudSummary, CloudSurface, surface_of_cloud};

use crate::threads::Threads;

/// Errors of reading a scan.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// The file is unreadable or holds no mesh.
    #[error(transparent)]
    File(#[from] MeshFileError),
    /// The points make no surface.
    #[error("{}: {source}", path.display())]
    Cloud {
        /// the file
        path: PathBuf,
        /// reason and remedy
        source: CloudError,
    },
}

/// A scan as a mesh.
#[derive(Clone, Debug)]
pub struct Scan {
    /// vertices in m, in the file's own frame, which becomes O
    pub mesh: TriMesh,
    /// defects of the file, or of the reconstructed surface
    pub repair: RepairReport,
    /// reconstruction of the mesh, if the file holds points
    pub cloud: Option<CloudSummary>,
}

/// Reads a mesh (PLY, STL, OBJ) and repairs it; makes a surface of a point cloud (PLY without
/// faces, PCD, text, E57), with a warning. The same file gives the same mesh, on any number of
/// threads.
///
/// - `unit`: of the coordinates in the file; the mesh is in m.
///
/// # Errors
/// [`ScanError`]: one line that names the file and a remedy.
pub fn read_scan(path: &Path, unit: MeshUnit) -> Result<Scan, ScanError> {
    let cloud = match read_mesh_or_points(path, unit)? {
        MeshOrPoints::Mesh(file) => {
            let MeshFile { mesh, repair } = *file;
            warn_of_left_out(path, &repair);
            return Ok(Scan {
                mesh,
                repair,
                cloud: None,
            });
        }
        MeshOrPoints::Points(cloud) => cloud,
    };
    let no_surface = |source| ScanError::Cloud {
        path: path.into(),
        source,
    };
    let CloudSurface {
        positions,
        faces,
        summary,
    } = surface_of_cloud(cloud, &Threads).map_err(no_surface)?;
    let MeshFile { mesh, repair } = repaired(path, unit, positions, faces)?;
    tracing::warn!("{}: {summary}", path.display());
    Ok(Scan {
        mesh,
        repair,
        cloud: Some(summary),
    })
}

/// Warns of faces left out because a corner has no finite coordinates.
pub fn warn_of_left_out(path: &Path, repair: &RepairReport) {
    if repair.dropped_not_finite > 0 {
        let faces = repair.dropped_not_finite;
        tracing::warn!(
            "{}: faces left out because the coordinates of a corner are no place: {faces}",
            path.display()
        );
    }
}

/// Colours and texture of a scan, transferred to its refined mesh; empty if the file has none.
///
/// - `path`, `unit`: of the scan.
/// - `places`: for each vertex of `mesh` its present or former position on the scan, m in O.
///
/// # Errors
/// [`MeshFileError`] if the file is no longer readable.
pub fn carried_over(
    path: &Path,
    unit: MeshUnit,
    mesh: &TriMesh,
    places: &[Point3<f64>],
) -> Result<(Vec<VertexColumn>, Option<Texture>), MeshFileError> {
    let Some(appearance) = read_appearance(path, unit)? else {
        return Ok(Default::default());
    };
    let colours = appearance
        .colours_at(places, &Threads)
        .map(VertexColumn::of_colours);
    Ok((
        colours.unwrap_or_default(),
        appearance.texture_on(mesh, places, &Threads),
    ))
}
