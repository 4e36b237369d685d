//! Point clouds: PLY without faces, PCD, text and E57 in.

pub(super) mod e57;
mod lzf;
pub(super) mod pcd;
pub(super) mod text;

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{PointCloud, ScanStation};

/// The points of a PLY file.
///
/// - `positions`: m; `normals`: the three coordinates of each, if the file has them.
pub(super) fn of_ply(positions: Vec<Point3<f64>>, normals: [Option<Vec<f32>>; 3]) -> PointCloud {
    let normals = match normals {
        [Some(x), Some(y), Some(z)] => {
            let rows = x.into_iter().zip(y).zip(z);
            rows.map(|((x, y), z)| Vector3::new(x, y, z).cast())
                .collect()
        }
        _ => Vec::new(),
    };
    PointCloud {
        stations: vec![ScanStation::unknown(positions.len())],
        positions,
        normals,
    }
}
