//! Point clouds: PLY without faces, PCD, text and E57 in.

mod e57;
mod lzf;
mod pcd;
mod text;

use nalgebra::{Point3, Vector3};

use super::defect::Syntax;
use super::unit::MeshUnit;
use touchup_geometry::mesh::{PointCloud, ScanStation};

/// Kinds of files of points alone.
#[derive(Clone, Copy)]
pub(super) enum CloudFormat {
    Pcd,
    Text,
    E57,
}

impl CloudFormat {
    /// From an extension in lower case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "pcd" => Some(Self::Pcd),
            "xyz" | "txt" | "asc" => Some(Self::Text),
            "e57" => Some(Self::E57),
            _ => None,
        }
    }

    /// Format by unambiguous content.
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        match bytes {
            _ if e57::is_e57(bytes) => Some(Self::E57),
            _ if pcd::is_pcd(bytes) => Some(Self::Pcd),
            _ => None,
        }
    }

    /// Coordinates come out multiplied by the unit.
    pub fn read(self, bytes: &[u8], unit: MeshUnit) -> Result<PointCloud, Syntax> {
        match self {
            Self::Pcd => pcd::read(bytes, unit.metres()),
            Self::Text => text::read(bytes, unit.metres()),
            Self::E57 => e57::read(bytes, unit.metres()),
        }
    }
}

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
