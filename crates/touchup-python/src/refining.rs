//! A scan and a scene in, samples through, the refined mesh out.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use touchup::cli::CliError;
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::{MeshFile, MeshUnit, repaired};
use touchup_method::stylus::{Message, WrenchFrame};
use touchup_session::refinement::{
    InputNames, RefinedScan, Refinement, RefinementInput, RefinementOptions, refine as refine_scan,
};
use touchup_session::replay::{RecordedAs, Recording};
use touchup_session::scan::{read_scan, warn_of_left_out};
use touchup_session::session::RefinedMesh;

use crate::arrays::{
    CompactMesh, MeshArrays, MeshVecs, PoseArrays, WrenchArrays, mesh_vecs, messages,
    touches_array, wrench_frame,
};
use crate::failure::{at_work, exception, usage};
use crate::files::{recorded_as, set_columns, unit_of};
use crate::scenes::{SceneSource, shown, source};

/// A scan from the caller.
pub enum ScanSource {
    /// path, and unit of the coordinates
    File(PathBuf, MeshUnit),
    /// m
    Arrays(MeshVecs),
}

impl ScanSource {
    /// The scan from the caller's arguments.
    ///
    /// # Errors
    /// For both or neither.
    pub fn of(
        arrays: Option<MeshArrays<'_>>,
        file: Option<(PathBuf, String)>,
    ) -> Result<Self, CliError> {
        match (arrays, file) {
            (Some(arrays), None) => Ok(Self::Arrays(mesh_vecs(&arrays, "the scan")?)),
            (None, Some((path, unit))) => Ok(Self::File(path, unit_of(&unit)?)),
            _ => Err(usage("a scan is a mesh, or the path of a file".to_owned())),
        }
    }

    /// The mesh, repaired as by the command line.
    fn read(self) -> Result<TriMesh, CliError> {
        match self {
            Self::File(path, unit) => Ok(read_scan(&path, unit)?.mesh),
            Self::Arrays((vertices, faces)) => {
                let name = shown(None, "the scan");
                let MeshFile { mesh, repair } = repaired(&name, MeshUnit::Metre, vertices, faces)?;
                warn_of_left_out(&name, &repair);
                Ok(mesh)
            }
        }
    }
}

/// Scene and scan.
fn input_of(scan: ScanSource, scene: &SceneSource) -> Result<RefinementInput, CliError> {
    let scene = scene.read()?;
    Ok(RefinementInput::new(scene, scan.read()?)?)
}

/// A refinement to push samples into.
///
/// # Errors
/// Those of `touchup refine`.
pub fn refinement(
    scan: ScanSource,
    scene: &SceneSource,
    frame: WrenchFrame,
) -> Result<Refinement, CliError> {
    let options = RefinementOptions::default();
    Ok(Refinement::new(input_of(scan, scene)?, frame, options)?)
}

/// A refined scan and its report.
pub struct RefinementOutput(RefinedScan);

impl RefinementOutput {
    /// The result as a dictionary of arrays.
    ///
    /// # Errors
    /// Those of NumPy.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let RefinedScan { mesh, summary, .. } = self.0;
        let RefinedMesh {
            mesh,
            support,
            sigma,
            touches,
            ..
        } = mesh;
        let into = PyDict::new(py);
        let compact = CompactMesh::of(&mesh);
        let support: Vec<u8> = support.iter().map(|support| *support as u8).collect();
        set_columns(&into, &compact, Some(&sigma), Some(&support))?;
        compact.into_dict(&into)?;
        into.set_item("touches", touches_array(py, &touches)?)?;
        let summary = crate::arrays::json(&summary).map_err(|error| exception(py, error))?;
        into.set_item("summary", summary)?;
        Ok(into)
    }
}

/// Source of the messages.
enum Touching {
    File(PathBuf, RecordedAs),
    Messages(Vec<Message>, WrenchFrame),
}

/// Refines, and checks the recording like `touchup refine`.
fn refined(
    scan: ScanSource,
    scene: &SceneSource,
    touching: Touching,
    force: bool,
) -> Result<RefinementOutput, CliError> {
    let scan_name = match &scan {
        ScanSource::File(path, _) => path.clone(),
        ScanSource::Arrays(_) => shown(None, "the scan"),
    };
    let input = input_of(scan, scene)?;
    let (recording, recording_name, markers) = match touching {
        Touching::File(path, recorded) => {
            let stamps = recorded.checked_stamps().map_err(usage)?;
            let (recording, markers) = recorded.open(&path, &input.scene, stamps)?;
            (recording, path, markers)
        }
        Touching::Messages(all, frame) => (
            Recording::of_messages(all, frame),
            shown(None, "the recording"),
            None,
        ),
    };
    let names = InputNames {
        scan: &scan_name,
        recording: &recording_name,
    };
    let options = RefinementOptions {
        force,
        ..RefinementOptions::default()
    };
    let refined = refine_scan(input, recording, markers, options, names, &mut || {})?;
    Ok(warned(refined))
}

/// Checks and reconstructs the pushed samples.
///
/// # Errors
/// Those of [`refine`].
pub fn finish_refinement(
    mut refinement: Refinement,
    force: bool,
) -> Result<RefinementOutput, CliError> {
    let (scan, recording) = (shown(None, "the scan"), shown(None, "the samples"));
    refinement.force(force);
    Ok(warned(refinement.finish(InputNames {
        scan: &scan,
        recording: &recording,
    })?))
}

/// Logs findings and losses.
fn warned(refined: RefinedScan) -> RefinementOutput {
    let RefinedScan {
        summary, losses, ..
    } = &refined;
    summary
        .findings
        .iter()
        .for_each(|finding| tracing::warn!("{finding}"));
    losses.iter().for_each(|loss| tracing::warn!("{loss}"));
    RefinementOutput(refined)
}

/// Refines a scan by a recording, each from arrays or a file.
///
/// Returns `vertices` (V, 3) m, `faces` (F, 3), `sigma` (V,) m, `support` (V,), `touches` and
/// `summary`.
#[pyfunction]
#[pyo3(signature = (scene_text, scene_path, scan, scan_file, poses, wrenches, frame, recording_file, force))]
#[expect(
    clippy::too_many_arguments,
    reason = "what the package passes on: each of both sources, or nothing"
)]
pub fn refine<'py>(
    py: Python<'py>,
    scene_text: Option<String>,
    scene_path: Option<PathBuf>,
    scan: Option<MeshArrays<'_>>,
    scan_file: Option<(PathBuf, String)>,
    poses: Option<PoseArrays<'_>>,
    wrenches: Option<WrenchArrays<'_>>,
    frame: &str,
    recording_file: Option<(PathBuf, String)>,
    force: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let read = || {
        let all = match (poses, wrenches) {
            (Some(poses), Some(wrenches)) => {
                Some((messages(&poses, &wrenches)?, wrench_frame(frame)?))
            }
            _ => None,
        };
        Ok((
            ScanSource::of(scan, scan_file)?,
            source(scene_text, scene_path)?,
            all,
        ))
    };
    let (scan, scene, all) = read().map_err(|error| exception(py, error))?;
    let reported = at_work(py, || {
        let touching = match (all, recording_file) {
            (Some((all, frame)), None) => Touching::Messages(all, frame),
            (None, Some((path, recorded))) => Touching::File(path, recorded_as(&recorded)?.0),
            _ => {
                return Err(usage(
                    "a recording is a Recording of arrays, or the path of a file".to_owned(),
                ));
            }
        };
        refined(scan, &scene, touching, force)
    })?;
    reported.into_dict(py)
}
