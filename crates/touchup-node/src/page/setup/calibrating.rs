//! Calibrations from recordings of the folder: computed in the background, shown, and written to
//! the scene on an operator's request.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use serde::Deserialize;

use super::beside::{beside, to_its_end};
use super::found_calibration::FoundCalibration;
use super::node_setup::NodeSetup;
use super::setup_shown::{CalibrationChoice, CalibrationFacts};
use super::setup_state::{NO_TIP, NodeSetupError};
use crate::ros::locked;
use touchup_io::recording::Topics;
use touchup_io::scan_folder::FolderFileKind;
use touchup_session::calibration::{
    Calibration, CalibrationError, CalibrationKind, CalibrationRecording, PayloadCalibrationParams,
    calibrate_payload, calibrate_scan, calibrate_tip,
};
use touchup_session::scene::Scene;

/// Number of messages between updates of the progress.
const MESSAGES_PER_LOOK: u64 = 2000;
const NO_RESULT: NodeSetupError = NodeSetupError::NotNow(
    "there is no such result that could be used: make the calibration, and look at what it found",
);

/// Request of a calibration.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CalibrateRequest {
    what: CalibrationKind,
    /// recording in the folder
    recording: Option<String>,
    /// a table of points picked on the scan; without a recording also with points in space
    points: Option<String>,
}

impl CalibrateRequest {
    /// The file that stands for the calibration, if the files fit its kind.
    fn file(&self) -> Result<&String, &'static str> {
        match (self.what, &self.recording, &self.points) {
            (CalibrationKind::Scan, _, None) => {
                Err("name a table of the points that were picked on the scan")
            }
            (CalibrationKind::Scan, recording, Some(points)) => {
                Ok(recording.as_ref().unwrap_or(points))
            }
            (_, Some(recording), None) => Ok(recording),
            _ => Err("name a recording that was made for this calibration, and nothing else"),
        }
    }
}

/// The files and the scene of a calibration.
struct CalibrationInputs {
    what: CalibrationKind,
    recording: Option<PathBuf>,
    points: Option<PathBuf>,
    scene: Scene,
}

impl NodeSetup {
    /// Computes a calibration in the background.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn calibrate(
        self: &Arc<Self>,
        request: &CalibrateRequest,
    ) -> Result<(), NodeSetupError> {
        let CalibrateRequest {
            what,
            recording,
            points,
        } = request;
        let what = *what;
        let file = request.file().map_err(NodeSetupError::refused)?.clone();
        let place = |name: &Option<String>, kind| {
            let place = name
                .as_ref()
                .map(|name| self.folder.file(name, kind))
                .transpose();
            place.map_err(NodeSetupError::refused)
        };
        let points = place(points, FolderFileKind::PointTable)?;
        let recording = place(recording, FolderFileKind::Recording)?;
        // the ball is needed to find dwells on points
        let needs_tip = what == CalibrationKind::Scan && recording.is_some();
        let scene = self.begin_calibration(what, &file, needs_tip)?;
        let (setup, inputs) = (
            Arc::clone(self),
            CalibrationInputs {
                what,
                recording,
                points,
                scene,
            },
        );
        let calibrate = move || {
            let found = to_its_end(|| {
                let found = calibrated(&inputs, &setup.topics, &|share| setup.note_share(share));
                found.map_err(|error| setup.in_words(&error))
            });
            let facts = |Calibration {
                             found,
                             doubts,
                             losses,
                         }| CalibrationFacts {
                what,
                file: file.clone(),
                found,
                doubts,
                losses,
                is_used: false,
            };
            locked(&setup.state).calibration = match found {
                Ok(found) => CalibrationChoice::Found(Box::new(facts(found))),
                Err(why) => CalibrationChoice::Refused { what, file, why },
            };
        };
        beside("setup-calibration", "calibrating", calibrate)
            .inspect_err(|_| locked(&self.state).calibration = CalibrationChoice::None)
    }

    /// Shows a calibration as running; returns its scene.
    fn begin_calibration(
        &self,
        what: CalibrationKind,
        file: &str,
        needs_tip: bool,
    ) -> Result<Scene, NodeSetupError> {
        let mut state = self.idle()?;
        self.take_edits(&mut state)?;
        if needs_tip && !state.has_tip() {
            return Err(NO_TIP);
        }
        let text = state
            .draft
            .with(state.tip, None)
            .map_err(NodeSetupError::refused)?;
        let scene = Scene::from_yaml(&text).map_err(NodeSetupError::refused)?;
        state.calibration = CalibrationChoice::Running {
            what,
            file: file.to_owned(),
            share: None,
        };
        Ok(scene)
    }

    /// Writes the result of a calibration to the scene.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn use_calibration(&self, what: CalibrationKind) -> Result<(), NodeSetupError> {
        let mut state = self.idle()?;
        self.take_edits(&mut state)?;
        let draft = match &state.calibration {
            CalibrationChoice::Found(facts) if facts.what == what && !facts.is_used => state
                .draft
                .calibrated(&facts.found, SystemTime::now())
                .map_err(NodeSetupError::refused)?,
            _ => return Err(NO_RESULT),
        };
        self.write_scene(&mut state, draft.text().to_owned())?;
        state.draft = draft;
        if let CalibrationChoice::Found(facts) = &mut state.calibration {
            facts.is_used = true;
        }
        // an older check of a recording used the older scene
        state.forget_check();
        Ok(())
    }

    fn note_share(&self, new: f64) {
        if let CalibrationChoice::Running { share, .. } = &mut locked(&self.state).calibration {
            *share = Some(new);
        }
    }

    /// An error with file names relative to the folder.
    fn in_words(&self, error: &CalibrationError) -> String {
        error
            .to_string()
            .replace(&format!("{}/", self.folder.path().display()), "")
    }
}

/// Computes a calibration.
///
/// - `at_share`: gets the share of the recording read, now and then.
fn calibrated(
    inputs: &CalibrationInputs,
    topics: &Topics,
    at_share: &dyn Fn(f64),
) -> Result<Calibration<FoundCalibration>, CalibrationError> {
    let CalibrationInputs {
        what,
        recording,
        points,
        scene,
    } = inputs;
    let opened = recording
        .as_deref()
        .map(|path| CalibrationRecording::open(path, topics))
        .transpose()?;
    let count = opened
        .as_ref()
        .and_then(CalibrationRecording::message_count)
        .filter(|count| *count > 0);
    let mut so_far = 0u64;
    let mut at_each = || {
        so_far += 1;
        if let Some(count) = count.filter(|_| so_far.is_multiple_of(MESSAGES_PER_LOOK)) {
            at_share((so_far as f64 / count as f64).min(1.0));
        }
    };
    match (what, opened) {
        (CalibrationKind::Tip, Some(recording)) => calibrate_tip(recording, scene, &mut at_each)
            .map(|found| found.map(FoundCalibration::Tip)),
        (CalibrationKind::Payload, Some(recording)) => {
            let found = calibrate_payload(
                recording,
                scene,
                PayloadCalibrationParams::default(),
                &mut at_each,
            );
            found.map(|found| found.map(FoundCalibration::Payload))
        }
        (_, recording) => {
            // the request names a table of points
            let points = points.as_deref().unwrap_or(Path::new(""));
            let found = calibrate_scan(points, recording, scene, None, &mut at_each);
            found.map(|found| found.map(FoundCalibration::Scan))
        }
    }
}
