//! A scan and a scene in, samples through, the refined mesh out.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value, json};
use touchup::cli::CliError;
use touchup_core::mesh::TriMesh;
use touchup_core::stylus::{Message, WrenchFrame};
use touchup_io::mesh_file::{MeshFile, MeshUnit, repaired};
use touchup_session::refinement::{
    FinishedRefinement, InputNames, JudgedRefinement, RefinedScan, RefinementInput, TouchSource,
    refine as refine_scan,
};
use touchup_session::replay::{Recording, marker_filter};
use touchup_session::scan::{read_scan, warn_of_left_out};
use touchup_session::scene::Scene;
use touchup_session::session::RefinedMesh;

use crate::arrays::{
    Compact, MeshArrays, MeshVecs, PoseArrays, WrenchArrays, mesh_vecs, messages, touches_array,
    wrench_frame,
};
use crate::failure::{at_work, exception, usage};
use crate::files::{recorded_as, set_columns, unit_of};
use crate::scenes::{SceneSource, shown, source};

/// A scan as it is given.
pub enum ScanSource {
    /// … and the unit of its coordinates
    File(PathBuf, MeshUnit),
    /// m
    Arrays(MeshVecs),
}

impl ScanSource {
    /// What is given of a scan.
    ///
    /// # Errors
    /// Where it is both or neither.
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

    /// The mesh, repaired as the command line does it.
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

/// Reads scene and scan.
///
/// # Errors
/// As `touchup refine`.
pub fn refinement(
    scan: ScanSource,
    scene: &SceneSource,
    frame: WrenchFrame,
) -> Result<JudgedRefinement, CliError> {
    Ok(JudgedRefinement::new(input_of(scan, scene)?, frame)?)
}

/// A refined scan and its report.
pub struct Reported {
    mesh: RefinedMesh,
    summary: Map<String, Value>,
}

impl From<RefinedScan> for Reported {
    fn from(refined: RefinedScan) -> Self {
        let RefinedScan {
            finished,
            replayed,
            accepted,
            refused,
            findings,
        } = refined;
        let FinishedRefinement {
            mesh,
            counts,
            friction,
        } = finished;
        let friction = friction.map(|found| json!({ "mu": found.mu, "sigma": found.sigma }));
        let mut summary = Map::new();
        let mut note = |name: &str, value: Value| summary.insert(name.to_owned(), value);
        note("samples", replayed.wrenches.into());
        note("accepted", accepted.into());
        note("refused", json!(refused));
        note("findings", value(&findings));
        note("contacts", counts.contacts.into());
        note("cut_back", counts.cut_back.into());
        note("friction", friction.unwrap_or(Value::Null));
        note("moved_faces", mesh.outcome.moved_faces.into());
        note("patch", value(&mesh.outcome.patch));
        if let Some(uncertainty) = &mesh.outcome.uncertainty {
            note("uncertainty", value(uncertainty));
        }
        Self { mesh, summary }
    }
}

/// What is reported holds finite numbers and names alone.
fn value(report: &impl serde::Serialize) -> Value {
    serde_json::to_value(report).unwrap_or(Value::Null)
}

impl Reported {
    /// As a dictionary of arrays.
    ///
    /// # Errors
    /// Those of NumPy.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let Self {
            mesh:
                RefinedMesh {
                    mesh,
                    support,
                    sigma,
                    touches,
                    ..
                },
            summary,
        } = self;
        let into = PyDict::new(py);
        let compact = Compact::of(&mesh);
        let support: Vec<u8> = support.iter().map(|support| *support as u8).collect();
        set_columns(&into, &compact, Some(&sigma), Some(&support))?;
        compact.into_dict(&into)?;
        into.set_item("touches", touches_array(py, &touches)?)?;
        into.set_item("summary", Value::Object(summary).to_string())?;
        Ok(into)
    }
}

/// Where samples come from.
enum Touching {
    File {
        recording: Box<Recording>,
        path: PathBuf,
        markers: Option<String>,
    },
    Messages {
        all: Vec<Message>,
        frame: WrenchFrame,
    },
}

/// Refines, and judges the recording as `touchup refine` does.
///
/// - `touching`: opens what was recorded, once scene and scan were read.
fn refined(
    scan: ScanSource,
    scene: &SceneSource,
    touching: impl FnOnce(&Scene) -> Result<Touching, CliError>,
    force: bool,
) -> Result<Reported, CliError> {
    let scan_name = if let ScanSource::File(path, _) = &scan {
        path.clone()
    } else {
        shown(None, "the scan")
    };
    let input = input_of(scan, scene)?;
    let (touches, recording_name) = match touching(&input.scene)? {
        Touching::File {
            recording,
            path,
            markers,
        } => {
            let markers = marker_filter(&input.scene, markers.as_deref())?.map(Box::new);
            (TouchSource::Recorded { recording, markers }, path)
        }
        Touching::Messages { all, frame } => (
            TouchSource::Messages {
                messages: all,
                wrench_frame: frame,
            },
            shown(None, "the recording"),
        ),
    };
    let names = InputNames {
        scan: &scan_name,
        recording: &recording_name,
    };
    Ok(warned(refine_scan(
        input,
        touches,
        names,
        force,
        &mut || {},
    )?))
}

/// Judges and reconstructs what was pushed.
///
/// # Errors
/// As [`refine`].
pub fn finish_refinement(refinement: JudgedRefinement, force: bool) -> Result<Reported, CliError> {
    let (scan, recording) = (shown(None, "the scan"), shown(None, "the samples"));
    Ok(warned(refinement.finish(
        InputNames {
            scan: &scan,
            recording: &recording,
        },
        force,
    )?))
}

/// Says what is doubtful, and what was lost.
fn warned(refined: RefinedScan) -> Reported {
    refined
        .findings
        .iter()
        .for_each(|finding| tracing::warn!("{finding}"));
    refined
        .replayed
        .losses
        .iter()
        .for_each(|loss| tracing::warn!("{loss}"));
    refined.into()
}

/// Refines a scan by a recording: of both either arrays or files.
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
        let touching = |scene: &Scene| match (all, recording_file) {
            (Some((all, frame)), None) => Ok(Touching::Messages { all, frame }),
            (None, Some((path, recorded))) => {
                let (recorded, stamps) = recorded_as(&recorded)?;
                let recording = Box::new(Recording::open(&path, recorded.layout(scene), stamps)?);
                Ok(Touching::File {
                    recording,
                    path,
                    markers: recorded.markers_topic,
                })
            }
            _ => Err(usage(
                "a recording is a Recording of arrays, or the path of a file".to_owned(),
            )),
        };
        refined(scan, &scene, touching, force)
    })?;
    reported.into_dict(py)
}
