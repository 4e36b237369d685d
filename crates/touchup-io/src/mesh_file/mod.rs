//! Triangle mesh files: PLY, STL and OBJ in, repaired on reading; the same three out. Point clouds
//! in.

mod appearance;
mod column;
mod defect;
mod obj;
mod ply;
mod point_cloud;
mod soup;
mod stl;
mod text;
mod unit;

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::atomic::AtomicFile;
pub use super::file_error::FilePlace;
use super::file_error::{FileError, read_file, write_file};
use super::file_kind::FileKind;
use appearance::SoupTexture;
pub use column::{ColumnValues, VertexColumn};
pub use defect::Defect;
use defect::Syntax;
use point_cloud::{e57, pcd};
use soup::Soup;
use touchup_geometry::mesh::{
    Appearance, FARTHEST, MeshError, PointCloud, RepairReport, Texture, TriMesh, is_place, repair,
};
pub use unit::{ImplausibleSize, LARGEST_M, MeshUnit, SMALLEST_M};

/// Why a mesh file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// An input or output error.
    #[error(transparent)]
    File(#[from] FileError),
    /// Unknown name and content.
    #[error("{}: not a kind of mesh or point cloud known here: convert it to .ply, .stl, .obj, .pcd, .xyz or .e57", path.display())]
    UnknownFormat {
        /// the file
        path: PathBuf,
    },
    /// The content breaks the rules of its format.
    #[error("{}, {place}: {defect}", path.display())]
    Syntax {
        /// the file
        path: PathBuf,
        /// place of the defect
        place: FilePlace,
        /// defect
        defect: Defect,
    },
    /// Points without a surface.
    #[error("{}: no face in it, only {vertices} vertices: make a triangle mesh of it first", path.display())]
    NoFaces {
        /// the file
        path: PathBuf,
        /// number of points
        vertices: usize,
    },
    /// A unit other than the metre of E57.
    #[error("{}: an E57 file is in metres by its standard, not in {unit}: --mesh-unit m", path.display())]
    UnitOfE57 {
        /// the file
        path: PathBuf,
        /// the unit named by the user
        unit: MeshUnit,
    },
    /// The triangles make no mesh.
    #[error("{}: {source}", path.display())]
    Mesh {
        /// the file
        path: PathBuf,
        /// why
        source: MeshError,
    },
    /// A vertex without a finite position, which prevents writing.
    #[error("{}: not written: vertex {vertex} has a coordinate that is not a number within {FARTHEST:e} m", path.display())]
    NoPlace {
        /// the file
        path: PathBuf,
        /// index of the vertex, from 0
        vertex: u32,
    },
    /// An implausible unit.
    #[error("{}: {size}", path.display())]
    Implausible {
        /// the file
        path: PathBuf,
        /// the size, and a plausible unit
        size: ImplausibleSize,
    },
}

/// A mesh as read, and its repairs.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// vertices in m, in the file's own frame, which becomes O
    pub mesh: TriMesh,
    /// defects of the file
    pub repair: RepairReport,
}

/// Kind of a file by unambiguous content, else by its name.
fn kind_of(bytes: &[u8], path: &Path) -> Option<FileKind> {
    match bytes {
        [b'p', b'l', b'y', b'\r' | b'\n', ..] => Some(FileKind::Ply),
        _ if stl::is_binary(bytes) || stl::looks_ascii(bytes) => Some(FileKind::Stl),
        _ if e57::is_e57(bytes) => Some(FileKind::E57),
        _ if pcd::is_pcd(bytes) => Some(FileKind::Pcd),
        _ => FileKind::of(path),
    }
}

/// Kind of a mesh to write.
fn mesh_kind(path: &Path) -> Result<FileKind, MeshFileError> {
    let unknown = || MeshFileError::UnknownFormat { path: path.into() };
    FileKind::of(path)
        .filter(|kind| FileKind::MESHES.contains(kind))
        .ok_or_else(unknown)
}

/// Content of a scan file.
#[derive(Clone, Debug)]
pub enum MeshOrPoints {
    /// triangles, repaired
    Mesh(Box<MeshFile>),
    /// points alone, as in the file, including non-finite ones
    Points(PointCloud),
}

/// Reads a PLY, STL or OBJ file and repairs it ([`repair`]).
///
/// Unmistakable content decides the format, else the extension.
///
/// - `unit`: the unit of the coordinates in the file; the mesh comes out in m.
///
/// # Errors
/// [`MeshFileError`]: one line that names the file, the place in it, and the remedy; also for a
/// point cloud.
pub fn read_mesh(path: &Path, unit: MeshUnit) -> Result<MeshFile, MeshFileError> {
    match read_mesh_or_points(path, unit)? {
        MeshOrPoints::Mesh(file) => Ok(*file),
        MeshOrPoints::Points(cloud) => Err(MeshFileError::NoFaces {
            path: path.into(),
            vertices: cloud.positions.len(),
        }),
    }
}

/// [`read_mesh`], or the points of a point cloud: PLY without faces, PCD, text, E57.
///
/// - `unit`: the unit of the coordinates in the file; an E57 is in m.
///
/// # Errors
/// As [`read_mesh`].
pub fn read_mesh_or_points(path: &Path, unit: MeshUnit) -> Result<MeshOrPoints, MeshFileError> {
    let bytes = read_file(path)?;
    let syntax = |Syntax { place, defect }| MeshFileError::Syntax {
        path: path.into(),
        place,
        defect,
    };
    if bytes.is_empty() {
        return Err(syntax(Syntax::ends(FilePlace::Byte(0), "a mesh")));
    }
    let points = |read: Result<_, _>| read.map(MeshOrPoints::Points).map_err(syntax);
    let scale = unit.metres();
    let soup = match kind_of(&bytes, path) {
        Some(FileKind::Stl) => stl::read(&bytes, scale),
        Some(FileKind::Obj) => obj::read(&bytes, scale),
        Some(FileKind::Ply) => match ply::read(&bytes, scale) {
            Ok(soup) if soup.faces.is_empty() && !soup.positions.is_empty() => {
                let columns = ply::read_columns(&bytes, scale, ["nx", "ny", "nz"]);
                return points(columns.map(|(at, normals)| point_cloud::of_ply(at, normals)));
            }
            soup => soup,
        },
        Some(FileKind::Pcd) => return points(pcd::read(&bytes, scale)),
        Some(FileKind::Xyz | FileKind::Txt | FileKind::Asc) => {
            return points(point_cloud::text::read(&bytes, scale));
        }
        Some(FileKind::E57) if unit == MeshUnit::Metre => return points(e57::read(&bytes, scale)),
        Some(FileKind::E57) => {
            return Err(MeshFileError::UnitOfE57 {
                path: path.into(),
                unit,
            });
        }
        _ => return Err(MeshFileError::UnknownFormat { path: path.into() }),
    };
    let Soup {
        positions,
        faces,
        unused,
    } = soup.map_err(syntax)?;
    if faces.is_empty() {
        return Err(MeshFileError::NoFaces {
            path: path.into(),
            vertices: positions.len() + unused,
        });
    }
    let mut file = repaired(path, unit, positions, faces)?;
    file.repair.unused_vertices += unused;
    Ok(MeshOrPoints::Mesh(Box::new(file)))
}

/// Appearance of the mesh in a PLY or OBJ file; `None` without colours or texture, and for files of
/// other kinds.
///
/// - `unit`: of the coordinates in the file.
///
/// # Errors
/// [`MeshFileError::File`], [`MeshFileError::Syntax`], [`MeshFileError::Mesh`].
pub fn read_appearance(path: &Path, unit: MeshUnit) -> Result<Option<Appearance>, MeshFileError> {
    // a pipe allows one read only
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = read_file(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let soup = match kind_of(&bytes, path) {
        Some(FileKind::Ply) => ply::painted::read_painted(&bytes, unit.metres()),
        Some(FileKind::Obj) => obj::read_painted(&bytes, unit.metres(), folder),
        _ => return Ok(None),
    };
    let soup = soup.map_err(|Syntax { place, defect }| MeshFileError::Syntax {
        path: path.into(),
        place,
        defect,
    })?;
    if soup.faces.is_empty() || (soup.colours.is_none() && soup.texture.is_none()) {
        return Ok(None);
    }
    soup.appearance(folder)
        .map(Some)
        .map_err(|source| MeshFileError::Mesh {
            path: path.into(),
            source,
        })
}

/// The repaired mesh ([`repair`]) of the file `path`.
///
/// - `unit`: of the file, for the error about an implausible size; `positions`: m.
///
/// # Errors
/// [`MeshFileError::Mesh`], [`MeshFileError::Implausible`].
pub fn repaired(
    path: &Path,
    unit: MeshUnit,
    positions: Vec<Point3<f64>>,
    faces: Vec<[u32; 3]>,
) -> Result<MeshFile, MeshFileError> {
    let (mesh, repair) = repair(positions, faces).map_err(|source| MeshFileError::Mesh {
        path: path.into(),
        source,
    })?;
    let [low, high] = mesh.bounds();
    ImplausibleSize::check(high - low, unit).map_err(|size| MeshFileError::Implausible {
        path: path.into(),
        size,
    })?;
    Ok(MeshFile { mesh, repair })
}

/// The available scalar properties `names` of the vertices of a PLY file, for each vertex of the
/// `mesh` that [`read_mesh`] makes of it; none for other kinds of files.
///
/// - `mesh`: of that file, in `unit`.
/// - returns: for each name the numbers by vertex id, or `None`.
///
/// # Errors
/// [`MeshFileError::File`], [`MeshFileError::Syntax`].
pub fn read_vertex_columns<const N: usize>(
    path: &Path,
    unit: MeshUnit,
    mesh: &TriMesh,
    names: [&str; N],
) -> Result<[Option<Vec<f32>>; N], MeshFileError> {
    let bytes = read_file(path)?;
    if kind_of(&bytes, path) != Some(FileKind::Ply) {
        return Ok([const { None }; N]);
    }
    let syntax = |Syntax { place, defect }| MeshFileError::Syntax {
        path: path.into(),
        place,
        defect,
    };
    let (positions, columns) = ply::read_columns(&bytes, unit.metres(), names).map_err(syntax)?;
    let rows = rows_of(mesh, &positions);
    // a surface reconstructed from points has vertices missing from the file
    if rows.len() < mesh.positions().len() {
        return Ok([const { None }; N]);
    }
    Ok(columns.map(|column| column.map(|values| rows.iter().map(|&row| values[row]).collect())))
}

/// For each vertex its row in the file: repair keeps the order, and the first of equal positions.
fn rows_of(mesh: &TriMesh, positions: &[Point3<f64>]) -> Vec<usize> {
    let mut rows = positions.iter().enumerate();
    let mut row_of = |wanted: &Point3<f64>| {
        rows.find(|(_, p)| p.coords == wanted.coords)
            .map(|(row, _)| row)
    };
    mesh.positions().iter().map_while(&mut row_of).collect()
}

/// Whether [`write_mesh`] can write there: call it before long work.
///
/// # Errors
/// As [`write_mesh`].
pub fn check_target(path: &Path) -> Result<(), MeshFileError> {
    mesh_kind(path)?;
    Ok(AtomicFile::create(path)
        .map(drop)
        .map_err(|source| FileError::Write {
            path: path.into(),
            source,
        })?)
}

/// Writes a mesh as PLY (binary, double), STL (binary, which is single) or OBJ, by the extension of
/// `path`.
///
/// Removed faces and vertices without a face are left out; the rest keeps its order. Same mesh,
/// same bytes. The file appears whole or not at all ([`super::atomic`]).
///
/// - `unit`: the unit of the coordinates in the file; PLY and OBJ in m give back the mesh bit for
///   bit.
///
/// # Errors
/// [`MeshFileError::UnknownFormat`], [`MeshFileError::NoPlace`], [`MeshFileError::File`].
pub fn write_mesh(path: &Path, mesh: &TriMesh, unit: MeshUnit) -> Result<(), MeshFileError> {
    write_mesh_with(path, mesh, &[], None, unit)
}

/// [`write_mesh`] with `columns` and `texture`: PLY stores all of it, OBJ the texture and colours
/// (`red`, `green`, `blue`), STL nothing. Images stay in place; for an OBJ a file of the same name
/// with the ending `.mtl` names them.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_mesh_with(
    path: &Path,
    mesh: &TriMesh,
    columns: &[VertexColumn],
    texture: Option<&Texture>,
    unit: MeshUnit,
) -> Result<(), MeshFileError> {
    let kind = mesh_kind(path)?;
    if let Some(vertex) = mesh.positions().iter().position(|p| !is_place(p)) {
        return Err(MeshFileError::NoPlace {
            path: path.into(),
            vertex: vertex as u32,
        });
    }
    let ((soup, ids), unit) = (Soup::used_part(mesh, unit.metres()), unit.to_string());
    let texture = texture
        .map(|texture| SoupTexture::of(texture, mesh, path.parent().unwrap_or(Path::new(""))));
    let (texture, materials) = (texture.as_ref(), path.with_extension("mtl"));
    let images = texture.map_or(&[][..], |texture| &texture.images);
    if kind == FileKind::Obj && !images.is_empty() {
        write_file(&materials, |out| obj::write_materials(images, out))?;
    }
    let materials = materials.file_name().unwrap_or_default().to_string_lossy();
    Ok(write_file(path, |out| match kind {
        FileKind::Stl => stl::write(&soup, &unit, out),
        FileKind::Obj => obj::write(&soup, &ids, columns, texture, [&unit, &materials], out),
        FileKind::Ply => ply::write(&soup, &ids, columns, texture, &unit, out),
        _ => Err(io::ErrorKind::Unsupported.into()),
    })?)
}
