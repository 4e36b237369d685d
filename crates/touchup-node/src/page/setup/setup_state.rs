//! State of the setup, and the permitted actions.

use super::scene_draft::{SceneDraft, StatedTip};
use super::setup_shown::{
    CalibrationChoice, CheckChoice, ScanChoice, SetupFailure, SetupStage, SetupStep, UploadShown,
};
use touchup_io::mesh_file::MeshUnit;

/// Reason of a refused action.
#[derive(Debug, thiserror::Error)]
pub(super) enum NodeSetupError {
    /// too early or too late
    #[error("{0}")]
    NotNow(&'static str),
    /// an impossible choice
    #[error("{0}")]
    Refused(String),
}

impl NodeSetupError {
    pub fn refused(why: impl ToString) -> Self {
        Self::Refused(why.to_string())
    }
}

const STARTING: NodeSetupError = NodeSetupError::NotNow("the node is being started: wait");
pub(super) const NO_SCAN: NodeSetupError =
    NodeSetupError::NotNow("there is no scan yet: choose one, or wait until it is read");
pub(super) const NO_TIP: NodeSetupError = NodeSetupError::NotNow("the tip is not stated yet");
pub(super) const READING: NodeSetupError =
    NodeSetupError::NotNow("a scan is being read: wait until it is");
const CHECKING: NodeSetupError =
    NodeSetupError::NotNow("a recording is being looked at: wait until it is");
const CALIBRATING: NodeSetupError =
    NodeSetupError::NotNow("a calibration is being made: wait until it is");

pub(super) struct SetupState {
    pub stage: SetupStage,
    /// with the calibrations made until now
    pub draft: SceneDraft,
    /// last text of the scene's file; empty: none
    pub on_disk: String,
    pub scan: ScanChoice,
    pub unit: Option<MeshUnit>,
    pub tip: Option<StatedTip>,
    pub calibration: CalibrationChoice,
    pub check: CheckChoice,
    /// whether an operator has seen its findings, or goes on without a check
    pub is_check_over: bool,
    pub failure: Option<SetupFailure>,
    pub upload: Option<UploadShown>,
}

impl SetupState {
    pub fn new(draft: SceneDraft, on_disk: String) -> Self {
        Self {
            stage: SetupStage::Choosing,
            draft,
            on_disk,
            scan: ScanChoice::None,
            unit: None,
            tip: None,
            calibration: CalibrationChoice::None,
            check: CheckChoice::None,
            is_check_over: false,
            failure: None,
            upload: None,
        }
    }

    /// Whether operators may choose.
    pub fn require_choosing(&self) -> Result<(), NodeSetupError> {
        if self.stage == SetupStage::Choosing {
            Ok(())
        } else {
            Err(STARTING)
        }
    }

    /// Whether operators may choose, without background work.
    pub fn require_idle(&self) -> Result<(), NodeSetupError> {
        self.require_choosing()?;
        match (&self.scan, &self.check, &self.calibration) {
            (ScanChoice::Reading { .. }, ..) => Err(READING),
            (_, CheckChoice::Running { .. }, _) => Err(CHECKING),
            (.., CalibrationChoice::Running { .. }) => Err(CALIBRATING),
            _ => Ok(()),
        }
    }

    /// Discards the check of a recording after a change of its inputs.
    pub fn forget_check(&mut self) {
        (self.check, self.is_check_over) = (CheckChoice::None, false);
    }

    /// Clears a failed start after a change of its possible cause.
    ///
    /// - `mended`: the changed steps.
    pub fn clear_failure(&mut self, mended: &[SetupStep]) {
        self.failure
            .take_if(|failure| mended.contains(&failure.step) || failure.step == SetupStep::Start);
    }

    /// Whether no tip remains to be stated.
    pub fn has_tip(&self) -> bool {
        self.tip.is_some() || self.draft.scene.tip.is_none()
    }
}
