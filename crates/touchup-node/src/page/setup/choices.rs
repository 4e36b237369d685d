//! Choices of an operator, up to the start of the node.

use std::sync::Arc;

use super::beside::{beside, to_its_end};
use super::facts::read_facts;
use super::node_setup::NodeSetup;
use super::scene_draft::StatedTip;
use super::setup_shown::{ScanChoice, SetupStage, SetupStep};
use super::setup_state::{NO_SCAN, NO_TIP, NodeSetupError};
use crate::ros::locked;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::scan_folder::FolderFileKind;

impl NodeSetup {
    /// Chooses a scan of the folder, and reads it in the background; the unit must be chosen anew.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn choose_scan(self: &Arc<Self>, name: &str) -> Result<(), NodeSetupError> {
        let path = self
            .folder
            .file(name, FolderFileKind::Scan)
            .map_err(NodeSetupError::refused)?;
        let stated = {
            let mut state = self.changing()?;
            (state.scan, state.unit, state.failure) = (
                ScanChoice::Reading {
                    file: name.to_owned(),
                },
                None,
                None,
            );
            state.draft.unit_of(name)
        };
        let (setup, file) = (Arc::clone(self), name.to_owned());
        let read = move || {
            let found = to_its_end(|| read_facts(&path, &file, stated));
            locked(&setup.state).scan =
                found.map_or_else(|why| ScanChoice::Refused { file, why }, ScanChoice::Read);
        };
        beside("setup-scan", "reading a scan", read)
            .inspect_err(|_| locked(&self.state).scan = ScanChoice::None)
    }

    /// Chooses the unit of the scan.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn choose_unit(&self, unit: MeshUnit) -> Result<(), NodeSetupError> {
        let mut state = self.changing()?;
        let ScanChoice::Read(facts) = &state.scan else {
            return Err(NO_SCAN);
        };
        if !facts
            .units
            .iter()
            .any(|choice| choice.unit == unit.name() && choice.is_plausible)
        {
            return Err(NodeSetupError::Refused(format!(
                "in {unit} the scan has a size that no work-piece has"
            )));
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
        if tip.uncertainty_mm.is_some() && state.draft.scene.uncertainty.is_none() {
            return Err(NodeSetupError::refused(
                "the scene says `uncertainty: off`, so nothing is made of ±: leave it empty",
            ));
        }
        state
            .draft
            .with(Some(tip), None)
            .map_err(NodeSetupError::refused)?;
        state.tip = Some(tip);
        state.clear_failure(&[SetupStep::Tip]);
        Ok(())
    }

    /// Writes the scene, and starts the node.
    ///
    /// # Errors
    /// [`NodeSetupError`]
    pub(super) fn start(&self) -> Result<(), NodeSetupError> {
        let mut state = self.choosing()?;
        self.take_edits(&mut state)?;
        let (ScanChoice::Read(facts), Some(unit)) = (&state.scan, state.unit) else {
            return Err(NO_SCAN);
        };
        if !state.has_tip() {
            return Err(NO_TIP);
        }
        let text = state
            .draft
            .with(state.tip, Some((&facts.file, unit)))
            .map_err(NodeSetupError::refused)?;
        self.write_scene(&mut state, text)?;
        (state.stage, state.failure) = (SetupStage::Starting, None);
        self.changed.notify_all();
        Ok(())
    }
}
