//! The steps before a node: what was chosen so far, by whomever operates, and what the node began with or why it did not.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;

use super::facts::read_facts;
use super::recording_check::{CheckInputs, check_recording};
use super::scene_draft::{SceneDraft, StatedTip};
use super::setup_shown::{CheckChoice, ScanChoice, SetupFailure, SetupShown, SetupStep, Stage, UploadShown};
use crate::io::atomic::is_same_file;
use crate::io::mesh_file::MeshUnit;
use crate::io::recording::Topics;
use crate::io::scan_folder::{FolderFileKind, ScanFolder};
use crate::io::session_folder::write_text_file;
use crate::ros::locked;
use crate::ros::web::access::Role;
use crate::ros::web::error::WebError;
use crate::scene::Scene;

/// Bytes of an upload at most.
pub(super) const LARGEST_UPLOAD: u64 = 2 << 30;
/// Name of the scene in the folder of scans, without its extension.
const SCENE: &str = "scene";

/// What a setup begins with.
#[derive(Clone, Debug)]
pub struct SetupParams {
    /// where scans lie, and where the scene and what is uploaded goes
    pub folder: PathBuf,
    /// the scene to begin with; `None`: `scene.yaml` of the folder where there is one, else the usual one
    pub scene: Option<PathBuf>,
    /// of the ball, as somebody stated it, mm
    pub radius_mm: Option<f64>,
    /// of poses and wrenches in recordings
    pub topics: Topics,
}

struct SetupState {
    stage: Stage,
    scan: ScanChoice,
    unit: Option<MeshUnit>,
    tip: Option<StatedTip>,
    check: CheckChoice,
    /// whether somebody has seen what it found, or does without it
    is_check_over: bool,
    failure: Option<SetupFailure>,
    upload: Option<UploadShown>,
}

/// Why something cannot be done now.
#[derive(Debug, thiserror::Error)]
pub(super) enum NodeSetupError {
    /// it comes too early or too late
    #[error("{0}")]
    NotNow(&'static str),
    /// it cannot be so
    #[error("{0}")]
    Refused(String),
}

/// The setup of a node, which pages work on together.
pub struct NodeSetup {
    pub(super) folder: ScanFolder,
    draft: SceneDraft,
    /// where the scene will be
    target: PathBuf,
    known_radius_mm: Option<f64>,
    topics: Topics,
    state: Mutex<SetupState>,
    changed: Condvar,
}

const STARTING: NodeSetupError = NodeSetupError::NotNow("the node is being started: wait");
const NO_SCAN: NodeSetupError = NodeSetupError::NotNow("there is no scan yet: choose one, or wait until it is read");
const READING: NodeSetupError = NodeSetupError::NotNow("a scan is being read: wait until it is");
const CHECKING: NodeSetupError = NodeSetupError::NotNow("a recording is being looked at: wait until it is");

impl NodeSetup {
    /// # Errors
    /// [`WebError::Setup`]: the folder or the scene cannot be used.
    pub fn new(params: SetupParams) -> Result<Self, WebError> {
        let SetupParams { folder: path, scene, radius_mm, topics } = params;
        let bad = |error| WebError::Setup(format!("{}: {error}; name a folder by --web-scans", path.display()));
        let folder = ScanFolder::open(&path).map_err(bad)?;
        let kept = folder.plain_file(&format!("{SCENE}.yaml"));
        let is_kept = |scene: &PathBuf| kept.as_ref().is_some_and(|kept| is_same_file(kept, scene));
        let source = scene.or_else(|| kept.clone());
        let draft = SceneDraft::read(source.as_deref()).map_err(|error| WebError::Setup(error.to_string()))?;
        let target = match &source {
            Some(source) if is_kept(source) => kept.unwrap_or_else(|| folder.free_place(SCENE, "yaml")),
            _ => folder.free_place(SCENE, "yaml"),
        };
        if let Some(source) = source.filter(|source| draft.names_files() && !is_beside(source, &target)) {
            return Err(WebError::Setup(format!(
                "{} names files beside it, and the scene of the page will be {}: name the folder of the scene by --web-scans",
                source.display(),
                target.display()
            )));
        }
        let known_radius_mm = radius_mm.or_else(|| draft.radius_mm());
        let state = SetupState {
            stage: Stage::Choosing,
            scan: ScanChoice::None,
            unit: None,
            tip: None,
            check: CheckChoice::None,
            is_check_over: false,
            failure: None,
            upload: None,
        };
        let (state, changed) = (Mutex::new(state), Condvar::new());
        Ok(Self { folder, draft, target, known_radius_mm, topics, state, changed })
    }

    /// Waits until somebody starts the node: the scene to start it with, which names the scan and its unit.
    pub fn wait(&self) -> PathBuf {
        let mut state = locked(&self.state);
        while state.stage != Stage::Starting {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        self.target.clone()
    }

    /// The node did not start: somebody may choose again.
    ///
    /// - `step`: that can mend it; `why`: in words.
    pub fn refuse(&self, step: SetupStep, why: String) {
        let mut state = locked(&self.state);
        state.stage = Stage::Choosing;
        state.failure = Some(SetupFailure { step, why });
    }

    /// What a page is shown; it looks into the folder.
    ///
    /// # Errors
    /// In words: the folder cannot be read.
    pub(super) fn shown(&self, role: Role) -> Result<SetupShown, String> {
        let list =
            |kind| self.folder.list(kind).map_err(|error| format!("the folder of scans cannot be read: {error}"));
        let (files, recordings) = (list(FolderFileKind::Scan)?, list(FolderFileKind::Recording)?);
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let state = locked(&self.state);
        Ok(SetupShown {
            stage: state.stage,
            role,
            program: concat!("touchup ", env!("CARGO_PKG_VERSION")),
            folder: name(self.folder.path()),
            scene: name(&self.target),
            files,
            largest_upload: LARGEST_UPLOAD,
            upload: state.upload.clone(),
            scan: state.scan.clone(),
            unit: state.unit.map(MeshUnit::name),
            tip: state.tip,
            needs_radius: self.draft.scene.tip.is_some(),
            known_radius_mm: self.known_radius_mm,
            calibrations: self.draft.calibrations(),
            recordings,
            check: state.check.clone(),
            is_check_over: state.is_check_over,
            failure: state.failure.clone(),
        })
    }

    /// Chooses a scan of the folder, which is then read beside; the unit has to be said anew.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn choose_scan(self: &Arc<Self>, name: &str) -> Result<(), NodeSetupError> {
        let path = self.folder.file(name, FolderFileKind::Scan);
        let path = path.map_err(|error| NodeSetupError::Refused(error.to_string()))?;
        {
            let mut state = self.changing()?;
            (state.scan, state.unit, state.failure) = (ScanChoice::Reading { file: name.to_owned() }, None, None);
        }
        let (setup, file) = (Arc::clone(self), name.to_owned());
        let read = move || {
            let found = to_its_end(|| read_facts(&path, &file, setup.draft.unit_of(&file)));
            locked(&setup.state).scan = found.map_or_else(|why| ScanChoice::Refused { file, why }, ScanChoice::Read);
        };
        if let Err(error) = Builder::new().name("setup-scan".to_owned()).spawn(read) {
            locked(&self.state).scan = ScanChoice::None;
            return Err(NodeSetupError::Refused(format!("the scan cannot be read now: {error}; end other programs")));
        }
        Ok(())
    }

    /// Says the unit of the scan.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn choose_unit(&self, unit: MeshUnit) -> Result<(), NodeSetupError> {
        let mut state = self.changing()?;
        let ScanChoice::Read(facts) = &state.scan else { return Err(NO_SCAN) };
        if !facts.units.iter().any(|choice| choice.unit == unit.name() && choice.is_plausible) {
            return Err(NodeSetupError::Refused(format!("in {unit} the scan has a size that no work-piece has")));
        }
        state.unit = Some(unit);
        state.clear_failure(&[SetupStep::Unit]);
        Ok(())
    }

    /// States the tip.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn state_tip(&self, tip: StatedTip) -> Result<(), NodeSetupError> {
        let mut state = self.changing()?;
        if tip.uncertainty_mm.is_some() && self.draft.scene.uncertainty.is_none() {
            let why = "the scene says `uncertainty: off`, so nothing is made of ±: leave it empty";
            return Err(NodeSetupError::Refused(why.to_owned()));
        }
        self.draft.with(Some(tip), None).map_err(|error| NodeSetupError::Refused(error.to_string()))?;
        state.tip = Some(tip);
        state.clear_failure(&[SetupStep::Tip]);
        Ok(())
    }

    /// Writes the scene, and has the node start.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn start(&self) -> Result<(), NodeSetupError> {
        let mut state = self.choosing()?;
        let (ScanChoice::Read(facts), Some(unit)) = (&state.scan, state.unit) else { return Err(NO_SCAN) };
        if state.tip.is_none() && self.draft.scene.tip.is_some() {
            return Err(NodeSetupError::NotNow("the tip is not stated yet"));
        }
        let text = self.draft.with(state.tip, Some((&facts.file, unit)));
        let text = text.map_err(|error| NodeSetupError::Refused(error.to_string()))?;
        let not_written = |error| NodeSetupError::Refused(format!("cannot write {}: {error}", self.target.display()));
        write_text_file(&self.target, &text).map_err(not_written)?;
        (state.stage, state.failure) = (Stage::Starting, None);
        self.changed.notify_all();
        Ok(())
    }

    /// Has a recording of the folder looked at beside, on the scan and with the tip that were chosen; `None`: somebody has seen what was
    /// found, or does without it.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn check(self: &Arc<Self>, recording: Option<&str>) -> Result<(), NodeSetupError> {
        let refused = |error: &dyn std::fmt::Display| NodeSetupError::Refused(error.to_string());
        let Some(name) = recording else {
            self.choosing()?.is_check_over = true;
            return Ok(());
        };
        let recording = self.folder.file(name, FolderFileKind::Recording).map_err(|error| refused(&error))?;
        let (scan, unit, scene) = {
            let mut state = self.changing()?;
            let (ScanChoice::Read(facts), Some(unit)) = (&state.scan, state.unit) else { return Err(NO_SCAN) };
            let scan = self.folder.file(&facts.file, FolderFileKind::Scan).map_err(|error| refused(&error))?;
            let text = self.draft.with(state.tip, Some((&facts.file, unit))).map_err(|error| refused(&error))?;
            let scene = Scene::from_yaml(&text).map_err(|error| refused(&error))?;
            (state.check, state.is_check_over) = (CheckChoice::Running { file: name.to_owned() }, false);
            (scan, unit, scene)
        };
        let (setup, file) = (Arc::clone(self), name.to_owned());
        let check = move || {
            let (recording, topics) = (&*recording, &setup.topics);
            let inputs = CheckInputs { scan: (&scan, unit), recording, scene: &scene, topics };
            let found = to_its_end(|| check_recording(&file, &inputs));
            locked(&setup.state).check =
                found.map_or_else(|why| CheckChoice::Refused { file, why }, CheckChoice::Found);
        };
        if let Err(error) = Builder::new().name("setup-check".to_owned()).spawn(check) {
            locked(&self.state).check = CheckChoice::None;
            return Err(NodeSetupError::Refused(format!("it cannot be looked at now: {error}; end other programs")));
        }
        Ok(())
    }

    /// For what a check depends on, of which nothing is left then.
    fn changing(&self) -> Result<MutexGuard<'_, SetupState>, NodeSetupError> {
        let mut state = self.choosing()?;
        match (&state.scan, &state.check) {
            (ScanChoice::Reading { .. }, _) => return Err(READING),
            (_, CheckChoice::Running { .. }) => return Err(CHECKING),
            _ => {}
        }
        (state.check, state.is_check_over) = (CheckChoice::None, false);
        Ok(state)
    }

    fn choosing(&self) -> Result<MutexGuard<'_, SetupState>, NodeSetupError> {
        let state = locked(&self.state);
        if state.stage == Stage::Choosing { Ok(state) } else { Err(STARTING) }
    }

    /// Takes the place of the one upload at a time; it is free again when what comes back is dropped.
    ///
    /// # Errors
    /// [`NodeSetupError::NotNow`]
    pub(super) fn begin_upload(self: &Arc<Self>, name: &str, of: Option<u64>) -> Result<UploadPlace, NodeSetupError> {
        let mut state = self.choosing()?;
        match &state.scan {
            _ if state.upload.is_some() => {
                return Err(NodeSetupError::NotNow("another scan is on its way: wait for it"));
            }
            ScanChoice::Reading { .. } => return Err(READING),
            _ => {}
        }
        state.upload = Some(UploadShown { name: name.chars().take(200).collect(), bytes: 0, of });
        Ok(UploadPlace(Arc::clone(self)))
    }
}

impl SetupState {
    fn clear_failure(&mut self, mended: &[SetupStep]) {
        self.failure.take_if(|failure| mended.contains(&failure.step) || failure.step == SetupStep::Start);
    }
}

/// The place of an upload.
pub(super) struct UploadPlace(Arc<NodeSetup>);

impl UploadPlace {
    /// So much has come.
    pub fn note(&self, so_far: u64) {
        if let Some(upload) = &mut locked(&self.0.state).upload {
            upload.bytes = so_far;
        }
    }
}

impl Drop for UploadPlace {
    fn drop(&mut self) {
        locked(&self.0.state).upload = None;
    }
}

/// What comes of work beside: nobody waits for what ended by a fault.
fn to_its_end<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let fault = || "a fault of touchup ended this: please report it with the file, and choose another one".to_owned();
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(fault()))
}

/// Whether both lie in one folder.
fn is_beside(a: &Path, b: &Path) -> bool {
    let folder = |path: &Path| match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    is_same_file(&folder(a), &folder(b))
}
