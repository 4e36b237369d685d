//! Output scene of a calibration.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use tracing::warn;

use crate::cli::{CliError, Losses, check_kept, not_written, print_report};
use touchup_io::atomic::write_atomically;
use touchup_session::calibration::{Calibration, CalibrationResult, calibrated_scene};
use touchup_session::scene::Scene;

/// Error message for a calibration with an arm but no scene.
const NO_SCENE: &str =
    "--scene is needed: it has the pose of the arm's base and the volume that it must never leave";

/// Output scene and print format of a calibration.
#[derive(Debug, Args)]
pub(super) struct CalibrationTarget {
    /// Scene for the result; its other text stays unchanged. Default, also if --out names the same
    /// new file: a full scene with every key explained
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    /// Output scene; may be the same file as --scene
    #[arg(long, value_name = "YAML")]
    pub out: PathBuf,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Scene and its YAML text.
pub(super) struct DraftScene {
    text: String,
    /// Parsed scene.
    pub scene: Scene,
}

impl DraftScene {
    /// Refuses a scene without tip radius.
    pub fn require_radius(&self) -> Result<(), CliError> {
        Ok(self.scene.require_radius(&self.text)?)
    }
}

impl CalibrationTarget {
    /// Refuses to overwrite `input`, and reads the scene.
    pub fn open(&self, flag: &str, input: &Path) -> Result<DraftScene, CliError> {
        check_kept(flag, input, &self.out)?;
        self.open_scene()
    }

    /// Reads the scene.
    fn open_scene(&self) -> Result<DraftScene, CliError> {
        let is_new = |path: &PathBuf| *path == self.out && path.symlink_metadata().is_err();
        let (scene, text) = match self.scene.as_ref().filter(|path| !is_new(path)) {
            Some(path) => Scene::read_with_text(path)?,
            None => (Scene::default(), Scene::template_without_radius()),
        };
        Ok(DraftScene { text, scene })
    }

    /// Reads the scene, mandatory for a calibration with an arm; also returns its path.
    pub fn open_for_arm(&self) -> Result<(&Path, DraftScene), CliError> {
        let scene = self
            .scene
            .as_deref()
            .ok_or_else(|| CliError::usage(NO_SCENE))?;
        Ok((scene, self.open_scene()?))
    }

    /// Writes the result into the scene and prints it; returns the losses of the recording.
    pub fn write(
        &self,
        draft: &DraftScene,
        calibration: Calibration<impl CalibrationResult>,
    ) -> Result<Losses, CliError> {
        let Calibration {
            found,
            doubts,
            losses,
        } = calibration;
        doubts.iter().for_each(|doubt| warn!("{doubt}"));
        let text = calibrated_scene(&draft.text, &found, SystemTime::now())?;
        write_atomically(&self.out, |file| file.write_all(text.as_bytes()))
            .map_err(not_written(&self.out))?;
        print_report(self.json, &found, || {
            format!("{found}\nwrote {}", self.out.display())
        })?;
        Ok(losses)
    }
}
