//! The result as files: mesh, features, touches.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nalgebra::Point3;
use serde::Serialize;
use tracing::{debug, warn};

use super::outliers::UncertaintySummary;
use super::step_result::{StepFileOutcome, write_boundary};
use crate::live::EngineResult;
use crate::reported;
use crate::scan::carried_over;
use touchup_features::features::{Detection, PartBoundary, detect, detect_boundary};
use touchup_geometry::mesh::{FaceId, FaceTree, MeshError, MeshRemainder, TriMesh, VertexId};
use touchup_geometry::numeric::counted;
use touchup_io::features_file::FeatureFile;
use touchup_io::mesh_file::{MeshFile, MeshFileError, MeshUnit, VertexColumn};
use touchup_io::mesh_file::{read_mesh, write_mesh_with};
use touchup_io::result_table::{ResultTableError, write_features_as_named, write_touches_as_named};
use touchup_io::touches_file::as_written;
use touchup_method::reconstruct::{PatchedMesh, Patcher, Support};
use touchup_method::stylus::ProbedPoint;

/// Error of writing a result.
#[derive(Debug, thiserror::Error)]
pub enum OutcomeError {
    /// The mesh.
    #[error("{0}")]
    WriteMesh(MeshFileError),
    /// The mesh just written.
    #[error("{0}")]
    ReadMesh(MeshFileError),
    /// The touches or the features.
    #[error(transparent)]
    Table(#[from] ResultTableError),
    /// The patch is too large.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The result would be the scan, possibly with something beside it.
    #[error("no face of the scan is moved or replaced: the touches are not on it")]
    Unchanged,
    /// Many contacts contradict each other.
    #[error("{0}")]
    Contradictory(String),
}

/// Paths of the files of a result.
#[derive(Clone, Debug)]
pub struct ResultFiles {
    /// the refined mesh
    pub mesh: PathBuf,
    /// features of the refined mesh, measured by the touches: a table for a name in `.csv` or
    /// `.parquet`, else JSON; `None`: not written
    pub features: Option<PathBuf>,
    /// the touches of the features: Parquet for a name in `.parquet`, else CSV; `None`: not written
    pub touches: Option<PathBuf>,
    /// STEP file of the trimmed faces; `None`: not written
    pub step: Option<PathBuf>,
}

/// Result on the touched part.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// faces off their position in the scan
    pub moved_faces: u64,
    /// the remeshed part; `null` if the scene has no `patch`, or without touches
    pub patch: Option<PatchSummary>,
    /// uncertainty of that part; absent if the scene has no `uncertainty`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<UncertaintySummary>,
    /// vertices and faces of the written mesh
    #[serde(skip)]
    pub counts: [usize; 2],
}

reported! {
    /// The patch in the report.
    pub struct PatchSummary, pub fn of(patched: &PatchedMesh, seconds: f64) {
        /// maximum distance of the new faces from the surface of the touches
        tolerance_mm: f64 = patched.tolerance * 1e3,
        /// whether the tolerance exceeds the usual one, as the lattice of a large area with a small
        /// tip would not fit
        is_coarser: bool = patched.is_coarser,
        /// removed faces of the scan
        removed_faces: usize = patched.removed_faces,
        /// added faces
        added_faces: usize = patched.added_faces,
        /// vertices of the scan moved to the touches, with the detail between them
        moved_vertices: usize = patched.moved_vertices,
        /// share of the new vertices that rest on nearby contacts, not their own
        guessed_share: f64 = guessed_share(&patched.support),
        /// time of the reconstruction, s
        pub build_s: f64 = seconds,
    }
}

fn guessed_share(support: &[Support]) -> f64 {
    let count =
        |wanted: Support| support.iter().filter(|&&support| support == wanted).count() as f64;
    let (touched, guessed) = (
        count(Support::Touched),
        count(Support::Guessed) + count(Support::Unreachable),
    );
    guessed / (touched + guessed).max(1.0)
}

/// Features of a mesh and its touches, also as a file.
pub fn found(mesh: &TriMesh, touches: &[ProbedPoint]) -> (Detection, FeatureFile) {
    let detection = detect(mesh, touches);
    let file = FeatureFile::of(&detection.features, detection.unexplained);
    (detection, file)
}

/// As [`found`], with the boundary of the part.
pub fn found_with_boundary(
    mesh: &TriMesh,
    touches: &[ProbedPoint],
) -> (Detection, FeatureFile, PartBoundary) {
    let (detection, boundary) = detect_boundary(mesh, touches);
    let file = FeatureFile::of(&detection.features, detection.unexplained);
    (detection, file, boundary)
}

/// Faces that are new, or with a moved corner.
pub fn moved_faces(before: &TriMesh, after: &TriMesh) -> u64 {
    let is_moved = |v: VertexId| before.position(v) != after.position(v);
    let is_as_scanned = |face: FaceId, corners: [VertexId; 3]| {
        before.has_face(face)
            && before.corners(face) == corners
            && !corners.into_iter().any(is_moved)
    };
    after
        .faces()
        .filter(|&(face, corners)| !is_as_scanned(face, corners))
        .count() as u64
}

/// For each vertex of a refined mesh its position in the scan, m in O; `None` for a new vertex.
pub type Origins = Vec<Option<Point3<f64>>>;

/// Position in the scan of each vertex of a refined mesh.
pub fn origins(scan: &TriMesh, refined: &TriMesh) -> Origins {
    (0..refined.vertex_slots())
        .map(|vertex| scan.positions().get(vertex).copied())
        .collect()
}

/// A remeshed part sewn to the rest of its scan, and the scan positions of its vertices.
///
/// - `of_scan`: standard deviation of an untouched vertex, m.
///
/// # Errors
/// [`MeshError::TornRim`], [`MeshError::TooMany`].
pub fn sewn(
    part: PatchedMesh,
    origins: &[Option<Point3<f64>>],
    outside: &MeshRemainder,
    of_scan: f64,
) -> Result<(PatchedMesh, Origins), MeshError> {
    let sewn = outside.sew_to(&part.mesh)?;
    let support = sewn.column(&part.support, Support::Scan);
    let sigma = if part.sigma.is_empty() {
        Vec::new()
    } else {
        sewn.column(&part.sigma, of_scan)
    };
    let origins = sewn.column(origins, None);
    Ok((
        PatchedMesh {
            mesh: sewn.mesh,
            support,
            sigma,
            ..part
        },
        origins,
    ))
}

/// Vertices and faces in a file of the mesh, which omits vertices without a face.
fn written_counts(mesh: &TriMesh) -> [usize; 2] {
    let is_used = |vertex: &u32| {
        mesh.has_vertex(VertexId(*vertex)) && !mesh.star(VertexId(*vertex)).is_empty()
    };
    [
        (0..mesh.vertex_slots() as u32).filter(is_used).count(),
        mesh.face_count(),
    ]
}

/// A whole refined mesh before writing, with the rest of a partly refined scan.
#[derive(Debug)]
pub struct RefinedMesh {
    /// m, in O
    pub mesh: TriMesh,
    /// scan position of each vertex
    pub origins: Origins,
    /// the support of each vertex; none without a patch
    pub support: Vec<Support>,
    /// standard deviation of each vertex along the normal, m; none without a patch or `uncertainty`
    pub sigma: Vec<f64>,
    /// vertex columns of its file, in file units
    pub columns: Vec<VertexColumn>,
    /// touches for the measurement of features
    pub touches: Vec<ProbedPoint>,
}

fn check_changed(must_change: bool, changed: usize) -> Result<(), OutcomeError> {
    if must_change && changed == 0 {
        Err(OutcomeError::Unchanged)
    } else {
        Ok(())
    }
}

impl RefinedMesh {
    /// Whole mesh and numbers of a result.
    ///
    /// - `scan`: unrefined, with the tree over its faces.
    /// - `outside`: the rest of the scan.
    /// - `must_change`: whether to refuse a result equal to the scan, or with contradictory
    ///   contacts.
    ///
    /// # Errors
    /// [`OutcomeError::Unchanged`], [`OutcomeError::Contradictory`], [`OutcomeError::Mesh`].
    pub fn of(
        scan: &(TriMesh, FaceTree),
        result: EngineResult,
        outside: Option<&MeshRemainder>,
        must_change: bool,
    ) -> Result<(Self, Outcome), OutcomeError> {
        match result {
            EngineResult::Touched(patcher) => Self::patched(scan, *patcher, outside, must_change),
            EngineResult::Moved(mesh) => Self::moved(&scan.0, *mesh, outside, must_change),
        }
    }

    /// A mesh without a patch.
    fn moved(
        scan: &TriMesh,
        refined: TriMesh,
        outside: Option<&MeshRemainder>,
        must_change: bool,
    ) -> Result<(Self, Outcome), OutcomeError> {
        let moved_faces = moved_faces(scan, &refined);
        check_changed(must_change, moved_faces as usize)?;
        let own = origins(scan, &refined);
        let (mesh, origins) = match outside {
            Some(outside) => {
                let sewn = outside.sew_to(&refined)?;
                let origins = sewn.column(&own, None);
                (sewn.mesh, origins)
            }
            None => (refined, own),
        };
        let outcome = Outcome {
            moved_faces,
            patch: None,
            uncertainty: None,
            counts: written_counts(&mesh),
        };
        let (support, sigma, columns, touches) = Default::default();
        let refined = Self {
            mesh,
            origins,
            support,
            sigma,
            columns,
            touches,
        };
        Ok((refined, outcome))
    }

    /// The scan with its touched part remeshed.
    fn patched(
        (scan, tree): &(TriMesh, FaceTree),
        mut patcher: Patcher,
        outside: Option<&MeshRemainder>,
        must_change: bool,
    ) -> Result<(Self, Outcome), OutcomeError> {
        let started = Instant::now();
        patcher.flush();
        let patched = patcher.patched(scan, tree)?;
        check_changed(must_change, patched.removed_faces + patched.moved_vertices)?;
        let build_s = started.elapsed().as_secs_f64();
        debug!(open_squares = patched.open_squares, "patched");
        let uncertainty = patcher
            .params()
            .uncertainty
            .map(|_| UncertaintySummary::of(&patched, patcher.outliers()));
        if let Some(known) = uncertainty
            .as_ref()
            .filter(|known| must_change && known.is_contradictory())
        {
            return Err(OutcomeError::Contradictory(known.contradiction()));
        }
        let moved_faces = moved_faces(scan, &patched.mesh);
        let of_scan = patcher.params().uncertainty.map_or(0.0, |known| known.scan);
        let own = origins(scan, &patched.mesh);
        let (patched, origins) = match outside {
            Some(outside) => sewn(patched, &own, outside, of_scan)?,
            None => (patched, own),
        };
        let columns = patched.columns().into_iter();
        let columns = columns
            .map(|(name, values)| VertexColumn {
                name,
                values: values.into(),
            })
            .collect();
        let outcome = Outcome {
            moved_faces,
            patch: Some(PatchSummary::of(&patched, build_s)),
            uncertainty,
            counts: written_counts(&patched.mesh),
        };
        let PatchedMesh {
            mesh,
            support,
            sigma,
            ..
        } = patched;
        let refined = Self {
            mesh,
            origins,
            support,
            sigma,
            columns,
            touches: patcher.probed().to_vec(),
        };
        Ok((refined, outcome))
    }
}

impl Outcome {
    /// Loss of contacts; `None` if small.
    pub fn loss(&self) -> Option<String> {
        self.uncertainty.as_ref()?.loss()
    }
}

impl ResultFiles {
    /// Name of the mesh in a folder of results.
    pub const MESH: &str = "refined.ply";
    /// Name of the features there.
    pub const FEATURES: &str = "features.json";
    /// Name of the touches there.
    pub const TOUCHES: &str = "touches.csv";

    /// Mesh, features and touches in a folder of results.
    pub fn in_folder(folder: &Path) -> Self {
        Self {
            mesh: folder.join(Self::MESH),
            features: Some(folder.join(Self::FEATURES)),
            touches: Some(folder.join(Self::TOUCHES)),
            step: None,
        }
    }

    /// Writes mesh, touches and features, then the STEP file, whose faces or fault it returns.
    ///
    /// - `scan`: file of the scan, source of colours and texture coordinates.
    /// - `unit`: unit of the coordinates in its file and in the mesh's.
    ///
    /// # Errors
    /// [`OutcomeError`]; no file is left half written.
    pub fn write(
        &self,
        refined: RefinedMesh,
        scan: &Path,
        unit: MeshUnit,
    ) -> Result<Option<StepFileOutcome>, OutcomeError> {
        let RefinedMesh {
            mesh,
            origins,
            columns,
            touches,
            ..
        } = refined;
        self.write_mesh(&mesh, &origins, columns, scan, unit)?;
        self.write_features(&touches, unit)
    }

    /// Writes the mesh with the colours and texture coordinates of the scan.
    fn write_mesh(
        &self,
        mesh: &TriMesh,
        origins: &[Option<Point3<f64>>],
        mut columns: Vec<VertexColumn>,
        scan: &Path,
        unit: MeshUnit,
    ) -> Result<(), OutcomeError> {
        let places = origins
            .iter()
            .zip(mesh.positions())
            .map(|(origin, here)| origin.unwrap_or(*here));
        let carried = carried_over(scan, unit, mesh, &places.collect::<Vec<_>>());
        let (colours, texture) = carried.unwrap_or_else(|error| {
            warn!("colours and texture coordinates of the scan are not carried over: {error}");
            Default::default()
        });
        columns.extend(colours);
        write_mesh_with(&self.mesh, mesh, &columns, texture.as_ref(), unit)
            .map_err(OutcomeError::WriteMesh)
    }

    /// Writes the requested touches, features and faces of the result: from the written mesh and
    /// touches, so `touchup features` finds the same to the last bit.
    fn write_features(
        &self,
        touches: &[ProbedPoint],
        unit: MeshUnit,
    ) -> Result<Option<StepFileOutcome>, OutcomeError> {
        if let Some(out) = &self.touches {
            write_touches_as_named(out, touches)?;
        }
        if self.features.is_none() && self.step.is_none() {
            return Ok(None);
        }
        let MeshFile { mesh, .. } = read_mesh(&self.mesh, unit).map_err(OutcomeError::ReadMesh)?;
        let touches = as_written(touches);
        let (file, boundary) = match &self.step {
            Some(step) => {
                let (_, file, boundary) = found_with_boundary(&mesh, &touches);
                (file, Some((step, boundary)))
            }
            None => (found(&mesh, &touches).1, None),
        };
        if let Some(out) = &self.features {
            write_features_as_named(out, &file)?;
        }
        Ok(boundary.map(|(step, boundary)| write_boundary(step, &boundary)))
    }
}

impl fmt::Display for PatchSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            tolerance_mm,
            is_coarser,
            guessed_share,
            ..
        } = self;
        let coarser = match is_coarser {
            true => ", coarser than usual: more was touched by so small a tip than memory allows",
            false => "",
        };
        let [removed, added] =
            [self.removed_faces, self.added_faces].map(|count| counted(count, "face", "faces"));
        let guessed = guessed_share * 100.0;
        write!(
            f,
            "{removed} of the scan replaced by {added}, within {tolerance_mm:.3} mm{coarser} ({guessed:.0} % of their vertices guessed)"
        )?;
        match self.moved_vertices {
            0 => Ok(()),
            moved => write!(
                f,
                ", {} of the scan moved with its detail",
                counted(moved, "vertex", "vertices")
            ),
        }
    }
}
