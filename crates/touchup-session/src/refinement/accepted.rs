//! A scene with findings about its recording taken off.

use serde::{Serialize, Serializer};

use crate::scene::{Scene, SceneError, Setting};
use touchup_features::diagnose::{InputCorrection, InputFinding};

/// Maximum number of findings that are taken off, one after the other.
const MOST_TAKEN_OFF: usize = 4;

/// A finding, and the settings that take it off.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AcceptedFinding {
    /// the finding, with its numbers and their standard uncertainties
    #[serde(flatten)]
    pub finding: InputFinding,
    /// settings of the scene; as YAML, one line each
    #[serde(serialize_with = "as_yaml")]
    pub settings: Vec<Setting>,
}

/// A scene, and what was taken off by it.
#[derive(Clone, Debug)]
pub struct AcceptedScene {
    /// with all settings
    pub scene: Scene,
    /// one after the other
    pub findings: Vec<AcceptedFinding>,
}

impl AcceptedFinding {
    /// - `scene`: without these settings.
    pub fn of(finding: InputFinding, scene: &Scene) -> Self {
        let settings = finding
            .correction
            .iter()
            .flat_map(|of| scene.corrected(of))
            .collect();
        Self { finding, settings }
    }

    /// Whether the settings take all of it off.
    pub fn is_whole(&self) -> bool {
        self.finding
            .correction
            .as_ref()
            .is_none_or(InputCorrection::is_whole)
    }
}

impl AcceptedScene {
    /// A scene with nothing taken off.
    pub fn new(scene: Scene) -> Self {
        Self {
            scene,
            findings: Vec::new(),
        }
    }

    /// Takes a finding off; `false` if no setting within its range does, and after the most findings.
    ///
    /// # Errors
    /// Those of [`Scene::set`].
    pub fn take_off(&mut self, finding: &InputFinding) -> Result<bool, SceneError> {
        let accepted = AcceptedFinding::of(finding.clone(), &self.scene);
        let mut scene = self.scene.clone();
        scene.set(&accepted.settings)?;
        let is_new = scene != self.scene && self.findings.len() < MOST_TAKEN_OFF;
        if !is_new || scene.validate().is_err() {
            return Ok(false);
        }
        self.scene = scene;
        self.findings.push(accepted);
        Ok(true)
    }

    /// Text of this scene.
    ///
    /// - `yaml`: text of the scene before; empty for the default one. `told`: settings over it.
    ///
    /// # Errors
    /// Those of [`Scene::edited`].
    pub fn text(&self, yaml: &str, told: &[Setting]) -> Result<String, SceneError> {
        let accepted = self.findings.iter().flat_map(|of| &of.settings);
        let settings: Vec<Setting> = told.iter().chain(accepted).cloned().collect();
        let text = Scene::edited(yaml, &settings, "")?;
        let taken_off = self.findings.iter();
        let taken_off: String = taken_off
            .map(|of| {
                format!(
                    "# taken off by touchup refine --accept: {}\n",
                    of.finding.measured
                )
            })
            .collect();
        Ok(taken_off + &text)
    }
}

fn as_yaml<S: Serializer>(settings: &[Setting], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(settings.iter().map(Setting::to_string))
}
