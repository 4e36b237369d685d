//! Setup of a node: the choices of all operators, and the scene or the failure of its start.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use super::scene_draft::SceneDraft;
use super::setup_shown::{CalibrationChoice, SetupFailure, SetupShown, SetupStage, SetupStep};
use super::setup_state::{NodeSetupError, SetupState};
use crate::page::admission::access::Role;
use crate::page::error::WebError;
use crate::ros::locked;
use touchup_io::atomic::is_same_file;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::Topics;
use touchup_io::scan_folder::{FolderFileKind, ScanFolder};
use touchup_io::session_folder::{read_text, write_text_file};

/// Maximum size of an upload, bytes.
pub(super) const LARGEST_UPLOAD: u64 = 2 << 30;
/// Name of the scene in the folder of scans, without its extension.
const SCENE: &str = "scene";

/// Parameters of a setup.
#[derive(Clone, Debug)]
pub struct SetupParams {
    /// folder of the scans, the scene and uploads
    pub folder: PathBuf,
    /// the initial scene; `None`: `scene.yaml` of the folder if present, else the default one
    pub scene: Option<PathBuf>,
    /// stated radius of the ball, mm
    pub radius_mm: Option<f64>,
    /// topics of poses and wrenches in recordings
    pub topics: Topics,
}

/// The setup of a node, which pages work on together.
pub struct NodeSetup {
    pub(super) folder: ScanFolder,
    /// file of the new scene
    pub(super) target: PathBuf,
    known_radius_mm: Option<f64>,
    pub(super) topics: Topics,
    pub(super) state: Mutex<SetupState>,
    pub(super) changed: Condvar,
}

impl NodeSetup {
    /// # Errors
    /// [`WebError::Setup`]: an unusable folder or scene.
    pub fn new(params: SetupParams) -> Result<Self, WebError> {
        let SetupParams {
            folder: path,
            scene,
            radius_mm,
            topics,
        } = params;
        let bad = |error| {
            WebError::Setup(format!(
                "{}: {error}; name a folder by --web-scans",
                path.display()
            ))
        };
        let folder = ScanFolder::open(&path).map_err(bad)?;
        let kept = folder.plain_file(&format!("{SCENE}.yaml"));
        let is_kept = |scene: &PathBuf| kept.as_ref().is_some_and(|kept| is_same_file(kept, scene));
        let source = scene.or_else(|| kept.clone());
        let draft = SceneDraft::read(source.as_deref())
            .map_err(|error| WebError::Setup(error.to_string()))?;
        let is_target = source.as_ref().is_some_and(is_kept);
        let target = match is_target {
            true => kept.unwrap_or_else(|| folder.free_place(SCENE, "yaml")),
            false => folder.free_place(SCENE, "yaml"),
        };
        if let Some(source) =
            source.filter(|source| draft.names_files() && !is_beside(source, &target))
        {
            return Err(WebError::Setup(format!(
                "{} names files beside it, and the scene of the page will be {}: name the folder of the scene by --web-scans",
                source.display(),
                target.display()
            )));
        }
        let known_radius_mm = radius_mm.or_else(|| draft.radius_mm());
        let on_disk = if is_target {
            draft.text().to_owned()
        } else {
            String::new()
        };
        let (state, changed) = (Mutex::new(SetupState::new(draft, on_disk)), Condvar::new());
        Ok(Self {
            folder,
            target,
            known_radius_mm,
            topics,
            state,
            changed,
        })
    }

    /// Waits for the start by an operator: returns the scene, which names the scan and its unit.
    pub fn wait(&self) -> PathBuf {
        let mut state = locked(&self.state);
        while state.stage != SetupStage::Starting {
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        self.target.clone()
    }

    /// The node did not start: operators may choose again.
    ///
    /// - `step`: the remedy; `why`: in words.
    pub fn refuse(&self, step: SetupStep, why: String) {
        let mut state = locked(&self.state);
        state.stage = SetupStage::Choosing;
        state.failure = Some(SetupFailure { step, why });
    }

    /// The setup for a page; reads the folder.
    ///
    /// # Errors
    /// In words: an unreadable folder.
    pub(super) fn shown(&self, role: Role) -> Result<SetupShown, String> {
        let list = |kind| {
            self.folder
                .list(kind)
                .map_err(|error| format!("the folder of scans cannot be read: {error}"))
        };
        let files = list(FolderFileKind::Scan)?;
        let (recordings, tables) = (
            list(FolderFileKind::Recording)?,
            list(FolderFileKind::PointTable)?,
        );
        let name = |path: &Path| {
            path.file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
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
            needs_radius: state.draft.scene.tip.is_some(),
            known_radius_mm: self.known_radius_mm,
            calibrations: state.draft.calibrations(),
            recordings,
            tables,
            calibration: state.calibration.clone(),
            check: state.check.clone(),
            is_check_over: state.is_check_over,
            failure: state.failure.clone(),
        })
    }

    /// Takes up edits of the scene file by others since its last reading or writing here, as by
    /// `touchup calibrate`.
    pub(super) fn take_edits(&self, state: &mut SetupState) -> Result<(), NodeSetupError> {
        let bad = |error: &dyn Display| {
            NodeSetupError::Refused(format!("{}: {error}", self.target.display()))
        };
        let text = read_text(&self.target).map_err(|error| bad(&error))?;
        if !text.is_empty() && text != state.on_disk {
            state.draft = SceneDraft::of(text.clone()).map_err(|error| bad(&error))?;
            state.on_disk = text;
            state.forget_check();
        }
        Ok(())
    }

    /// Writes the scene.
    pub(super) fn write_scene(
        &self,
        state: &mut SetupState,
        text: String,
    ) -> Result<(), NodeSetupError> {
        let not_written = |error| {
            NodeSetupError::Refused(format!("cannot write {}: {error}", self.target.display()))
        };
        write_text_file(&self.target, &text).map_err(not_written)?;
        state.on_disk = text;
        Ok(())
    }

    /// State for actions that are possible during background work.
    pub(super) fn choosing(&self) -> Result<MutexGuard<'_, SetupState>, NodeSetupError> {
        let state = locked(&self.state);
        state.require_choosing().map(|()| state)
    }

    /// State for background work, one at a time.
    pub(super) fn idle(&self) -> Result<MutexGuard<'_, SetupState>, NodeSetupError> {
        let state = locked(&self.state);
        state.require_idle().map(|()| state)
    }

    /// State for changes that invalidate a check and a calibration: discards both, except for
    /// calibrations in the scene.
    pub(super) fn changing(&self) -> Result<MutexGuard<'_, SetupState>, NodeSetupError> {
        let mut state = self.idle()?;
        state.forget_check();
        state.calibration = CalibrationChoice::None;
        Ok(state)
    }
}

/// Whether both lie in one folder.
fn is_beside(a: &Path, b: &Path) -> bool {
    let folder = |path: &Path| match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    is_same_file(&folder(a), &folder(b))
}
