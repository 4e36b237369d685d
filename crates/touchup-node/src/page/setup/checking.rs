//! Check of a recording of touches before the node starts.

use std::sync::Arc;

use super::beside::{beside, to_its_end};
use super::node_setup::NodeSetup;
use super::recording_check::{CheckInputs, check_recording};
use super::setup_shown::{CheckChoice, ScanChoice};
use super::setup_state::{NO_SCAN, NodeSetupError};
use crate::ros::locked;
use touchup_io::scan_folder::FolderFileKind;
use touchup_session::scene::Scene;

impl NodeSetup {
    /// Checks a recording of the folder in the background, on the chosen scan with the chosen tip;
    /// `None`: an operator has seen the findings, or goes on without a check.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn check(self: &Arc<Self>, recording: Option<&str>) -> Result<(), NodeSetupError> {
        let Some(name) = recording else {
            self.choosing()?.is_check_over = true;
            return Ok(());
        };
        let recording = self
            .folder
            .file(name, FolderFileKind::Recording)
            .map_err(NodeSetupError::refused)?;
        let (scan, unit, scene) = {
            let mut state = self.idle()?;
            self.take_edits(&mut state)?;
            let (ScanChoice::Read(facts), Some(unit)) = (&state.scan, state.unit) else {
                return Err(NO_SCAN);
            };
            let scan = self
                .folder
                .file(&facts.file, FolderFileKind::Scan)
                .map_err(NodeSetupError::refused)?;
            let text = state
                .draft
                .with(state.tip, Some((&facts.file, unit)))
                .map_err(NodeSetupError::refused)?;
            let scene = Scene::from_yaml(&text).map_err(NodeSetupError::refused)?;
            (state.check, state.is_check_over) = (
                CheckChoice::Running {
                    file: name.to_owned(),
                },
                false,
            );
            (scan, unit, scene)
        };
        let (setup, file) = (Arc::clone(self), name.to_owned());
        let check = move || {
            let (recording, topics) = (&*recording, &setup.topics);
            let inputs = CheckInputs {
                scan: (&scan, unit),
                recording,
                scene: &scene,
                topics,
            };
            let found = to_its_end(|| check_recording(&file, &inputs));
            locked(&setup.state).check =
                found.map_or_else(|why| CheckChoice::Refused { file, why }, CheckChoice::Found);
        };
        beside("setup-check", "looking at a recording", check)
            .inspect_err(|_| locked(&self.state).check = CheckChoice::None)
    }
}
