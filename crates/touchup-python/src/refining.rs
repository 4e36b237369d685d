//! A scan and a scene in, samples through, the refined mesh out.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value, json};
use touchup::cli::{CliError, refuse_unsound};
use touchup_core::diagnose::InputMonitor;
use touchup_core::haptic::{RefineCounts, RefineError};
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::reconstruct::Support;
use touchup_core::stylus::{ContactEstimator, Message, ProbedPoint, Sample, WrenchFrame};
use touchup_io::mesh_file::{MeshFile, MeshUnit, repaired};
use touchup_session::live::{Engine, LiveError, Renewal};
use touchup_session::replay::{Recording, Replayed, each_sample, each_sample_of, marker_filter};
use touchup_session::scan::read_scan;
use touchup_session::scene::{CutScan, RegionCut, Scene};
use touchup_session::session::{OutcomeError, PatchSummary, UncertaintySummary, moved_faces, origins, sewn};
use touchup_session::threads::Threads;

use crate::arrays::{
    Compact, MeshArrays, MeshVecs, PoseArrays, WrenchArrays, mesh_vecs, messages, touches_array, wrench_frame,
};
use crate::failure::{at_work, exception, usage, warn};
use crate::files::{set_columns, stamps_of, topics, unit_of};
use crate::scenes::{SceneSource, shown, source};

const NOTHING_MOVES: &str = "the scene says `refine: off`, so nothing would move the mesh: take that out of it";

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
    pub fn of(arrays: Option<MeshArrays<'_>>, file: Option<(PathBuf, String)>) -> Result<Self, CliError> {
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
                let MeshFile { mesh, .. } = repaired(&shown(None, "scan"), MeshUnit::Metre, vertices, faces)?;
                Ok(mesh)
            }
        }
    }
}

/// A scan under refinement.
pub struct Refinement {
    pub engine: Engine,
    pub scene: Scene,
    /// unrefined, without what cannot be touched
    scan: TriMesh,
    cut: RegionCut,
}

/// What came of it.
pub struct RefinedScan {
    pub mesh: TriMesh,
    support: Vec<Support>,
    sigma: Vec<f64>,
    touches: Vec<ProbedPoint>,
    pub summary: Map<String, Value>,
}

/// Scene and scan, before it is known in which axes wrenches come.
struct ReadScan {
    scene: Scene,
    scan: TriMesh,
    cut: RegionCut,
}

impl ReadScan {
    fn new(scan: ScanSource, scene: &SceneSource) -> Result<Self, CliError> {
        let scene = scene.read()?;
        let CutScan { mesh, cut } = scene.cut(scan.read()?)?;
        Ok(Self { scene, scan: mesh, cut })
    }

    fn refinement(self, frame: WrenchFrame) -> Result<Refinement, CliError> {
        let Self { scene, scan, cut } = self;
        let params = scene.refine_params(frame).ok_or_else(|| usage(NOTHING_MOVES.to_owned()))?;
        let patch = scene.patcher_params().map(|params| cut.patcher_params(params));
        let engine = Engine::new(scan.clone(), cut.refine_params(params), patch, Renewal::AtEnd)?;
        Ok(Refinement { engine, scene, scan, cut })
    }
}

impl Refinement {
    /// Reads scene and scan.
    ///
    /// # Errors
    /// As `touchup refine`.
    pub fn new(scan: ScanSource, scene: &SceneSource, frame: WrenchFrame) -> Result<Self, CliError> {
        ReadScan::new(scan, scene)?.refinement(frame)
    }

    /// Reconstructs what was touched.
    ///
    /// - `force`: also where the touches are not on the scan, or all over it.
    ///
    /// # Errors
    /// As `touchup refine`.
    pub fn finish(self, force: bool) -> Result<RefinedScan, CliError> {
        let Self { engine, scan, cut, .. } = self;
        let mut ended = engine.finish()?;
        let counts = *ended.refiner.counts();
        let friction = ended.refiner.friction().map(|found| json!({ "mu": found.mu, "sigma": found.sigma }));
        let mut summary = Map::new();
        let mut note = |name: &str, value: Value| summary.insert(name.to_owned(), value);
        note("contacts", counts.contacts.into());
        note("cut_back", counts.cut_back.into());
        note("friction", friction.unwrap_or(Value::Null));
        let unchanged = |changed: usize| if changed == 0 && !force { Err(OutcomeError::Unchanged) } else { Ok(()) };
        let Some(mut patcher) = ended.patcher.take().filter(|_| counts.contacts > 0) else {
            let moved = ended.mesh();
            let faces = moved_faces(&scan, &moved);
            unchanged(faces as usize)?;
            note("moved_faces", faces.into());
            note("patch", Value::Null);
            let mesh = match &cut.outside {
                Some(outside) => outside.sew_to(&moved)?.mesh,
                None => moved.into_owned(),
            };
            return Ok(RefinedScan { mesh, support: vec![], sigma: vec![], touches: vec![], summary });
        };
        if !force {
            patcher.check_extent()?;
        }
        let started = Instant::now();
        patcher.flush();
        let patched = patcher.patched(&scan, &FaceTree::new_by(&scan, &Threads))?;
        unchanged(patched.removed_faces + patched.moved_vertices)?;
        note("moved_faces", moved_faces(&scan, &patched.mesh).into());
        note("patch", value(&PatchSummary::of(&patched, started.elapsed().as_secs_f64())));
        if patcher.params().uncertainty.is_some() {
            note("uncertainty", value(&UncertaintySummary::of(&patched, patcher.outliers())));
        }
        let touches = patcher.probed().to_vec();
        let of_scan = patcher.params().uncertainty.map_or(0.0, |known| known.scan);
        let patched = match &cut.outside {
            Some(outside) => {
                let own = origins(&scan, &patched.mesh);
                sewn(patched, &own, outside, of_scan)?.0
            }
            None => patched,
        };
        Ok(RefinedScan { mesh: patched.mesh, support: patched.support, sigma: patched.sigma, touches, summary })
    }
}

/// What is reported holds finite numbers and names alone.
fn value(report: &impl serde::Serialize) -> Value {
    serde_json::to_value(report).unwrap_or(Value::Null)
}

impl RefinedScan {
    /// As a dictionary of arrays.
    ///
    /// # Errors
    /// Those of NumPy.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let into = PyDict::new(py);
        let compact = Compact::of(&self.mesh);
        let support: Vec<u8> = self.support.iter().map(|support| *support as u8).collect();
        set_columns(&into, &compact, Some(&self.sigma), Some(&support))?;
        compact.into_dict(&into)?;
        into.set_item("touches", touches_array(py, &self.touches)?)?;
        into.set_item("summary", Value::Object(self.summary).to_string())?;
        Ok(into)
    }
}

/// The reason of a refused sample, as the command line counts it.
pub fn reason_of(error: &LiveError) -> &'static str {
    match error {
        LiveError::Refine(RefineError::Sample(_)) => "sample",
        LiveError::Refine(RefineError::Setting(_) | RefineError::Dynamics(_)) => "dynamics",
        LiveError::Refine(_) => "mesh",
        _ => "stopped",
    }
}

/// Where samples come from.
enum Touching {
    File { recording: Recording, path: PathBuf, markers: Option<String> },
    Messages { all: Vec<Message>, frame: WrenchFrame },
}

impl Touching {
    fn frame(&self) -> WrenchFrame {
        match self {
            Self::File { recording, .. } => recording.wrench_frame,
            Self::Messages { frame, .. } => *frame,
        }
    }

    fn path(&self) -> Option<PathBuf> {
        if let Self::File { path, .. } = self { Some(path.clone()) } else { None }
    }
}

/// Refines, and judges the recording as `touchup refine` does; returns what came of it and what was lost.
///
/// - `touching`: opens what was recorded, once scene and scan were read.
fn replayed(
    scan: ScanSource,
    scene: &SceneSource,
    touching: impl FnOnce() -> Result<Touching, CliError>,
    force: bool,
) -> Result<(RefinedScan, Vec<String>), CliError> {
    let scan_name = if let ScanSource::File(path, _) = &scan { path.clone() } else { shown(None, "the scan") };
    let read = ReadScan::new(scan, scene)?;
    let touching = touching()?;
    let recording_name = touching.path().unwrap_or_else(|| shown(None, "the recording"));
    let frame = touching.frame();
    let mut refinement = read.refinement(frame)?;
    let scene = refinement.scene.clone();
    // an update that takes every sample for contact says nothing about contact
    let observer = scene.refine_params(frame).and_then(|params| params.contact().completed());
    let mut observer = observer.map(ContactEstimator::new).transpose()?;
    let monitor = RefCell::new(InputMonitor::new(scene.input_monitor_params(frame))?);
    let (mut accepted, mut refused) = (0, BTreeMap::<String, u64>::new());
    let (placement, sync) = (scene.placement(), scene.sync_params());
    let mut at_message = |message: &Message| monitor.borrow_mut().message(message);
    let each = |sample: &Sample| {
        match refinement.engine.push(sample) {
            Ok(_) => accepted += 1,
            Err(error) => *refused.entry(reason_of(&error).to_owned()).or_default() += 1,
        }
        let contact = match &mut observer {
            Some(observer) => observer.observe(sample).ok(),
            None => refinement.engine.refiner().contact(),
        };
        let mut monitor = monitor.borrow_mut();
        monitor.sample(sample);
        if let Some(contact) = contact {
            monitor.contact(contact);
        }
    };
    let replayed: Replayed = match touching {
        Touching::File { recording, markers, .. } => {
            let markers = marker_filter(&scene, markers.as_deref())?;
            each_sample(recording, placement, sync, markers, &mut || {}, &mut at_message, each)?
        }
        Touching::Messages { all, frame } => each_sample_of(all, frame, placement, sync, &mut at_message, each)?,
    };
    let monitor = monitor.into_inner();
    let findings = monitor.findings(&refinement.scan, &FaceTree::new_by(&refinement.scan, &Threads));
    if !force {
        refuse_unsound(&findings, &scan_name, &recording_name)?;
        if accepted == 0 {
            let message = format!("{}: no sample of it could be used", recording_name.display());
            return Err(CliError { kind: "input", message, hint: None, exit_code: 3 });
        }
    }
    findings.iter().for_each(|finding| tracing::warn!("{finding}"));
    let RefineCounts { outside_region, .. } = *refinement.engine.refiner().counts();
    refused.extend(replayed.refused);
    if outside_region > 0 {
        refused.insert("outside_region".to_owned(), outside_region);
    }
    let mut refined = refinement.finish(force)?;
    for (name, number) in [("samples", replayed.wrenches), ("accepted", accepted - outside_region)] {
        refined.summary.insert(name.to_owned(), number.into());
    }
    refined.summary.insert("refused".to_owned(), json!(refused));
    refined.summary.insert("findings".to_owned(), value(&findings));
    Ok((refined, replayed.losses))
}

/// Refines a scan by a recording: of both either arrays or files.
///
/// Returns `vertices` (V, 3) m, `faces` (F, 3), `sigma` (V,) m, `support` (V,), `touches` and `summary`.
#[pyfunction]
#[pyo3(signature = (scene_text, scene_path, scan, scan_file, poses, wrenches, frame, recording_file, force))]
#[expect(clippy::too_many_arguments, reason = "what the package passes on: each of both sources, or nothing")]
pub fn refine<'py>(
    py: Python<'py>,
    scene_text: Option<String>,
    scene_path: Option<PathBuf>,
    scan: Option<MeshArrays<'_>>,
    scan_file: Option<(PathBuf, String)>,
    poses: Option<PoseArrays<'_>>,
    wrenches: Option<WrenchArrays<'_>>,
    frame: &str,
    recording_file: Option<(PathBuf, String, String, Option<String>, String)>,
    force: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let read = || {
        let all = match (poses, wrenches) {
            (Some(poses), Some(wrenches)) => Some((messages(&poses, &wrenches)?, wrench_frame(frame)?)),
            _ => None,
        };
        Ok((ScanSource::of(scan, scan_file)?, source(scene_text, scene_path)?, all))
    };
    let (scan, scene, all) = read().map_err(|error| exception(py, error))?;
    let (refined, losses) = at_work(py, || {
        let touching = || match (all, recording_file) {
            (Some((all, frame)), None) => Ok(Touching::Messages { all, frame }),
            (None, Some((path, pose, wrench, markers, stamp))) => {
                let topics = topics(pose, wrench, markers.clone());
                Ok(Touching::File { recording: Recording::open(&path, &topics, stamps_of(&stamp)?)?, path, markers })
            }
            _ => Err(usage("a recording is a Recording of arrays, or the path of a file".to_owned())),
        };
        replayed(scan, &scene, touching, force)
    })?;
    warn(py, &losses)?;
    refined.into_dict(py)
}
