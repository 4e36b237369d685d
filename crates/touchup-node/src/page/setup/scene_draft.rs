//! Draft of the scene: its text with the chosen scan, unit and tip; everything else stays the same.

use std::path::Path;
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use touchup_io::mesh_file::MeshUnit;
use touchup_session::calibration::{
    CalibrationKind, CalibrationResult, calibrated_on, calibrated_scene,
};
use touchup_session::scene::{Scene, SceneError, Setting};

/// Coverage factor of uncertainties on the page: expanded, k = 2.
const COVERAGE_FACTOR: f64 = 2.0;
/// Comment on the first changed key.
const REMARK: &str = "set on the operator's page";

/// The tip as an operator states it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StatedTip {
    /// radius of the ball
    pub radius_mm: f64,
    /// its expanded uncertainty, k = 2; `None`: as in the scene
    #[serde(default)]
    pub uncertainty_mm: Option<f64>,
}

/// Calibrations in a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct NamedCalibrations {
    /// pose of the scan in the frame of the poses
    scan: NamedCalibration,
    /// the centre of the ball in the tracked stylus
    tip: NamedCalibration,
    /// weight and bias on the force sensor
    payload: NamedCalibration,
}

/// A calibration in a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct NamedCalibration {
    is_there: bool,
    /// the day of its entry, UTC, as 2026-11-27; `None`: the scene has no date
    date: Option<String>,
}

/// A scene with its text.
#[derive(Clone, Debug)]
pub(super) struct SceneDraft {
    text: String,
    /// the parsed text
    pub scene: Scene,
}

impl SceneDraft {
    /// - `path`: of the initial scene; `None`: the default one, with every key explained.
    ///
    /// # Errors
    /// [`SceneError`]
    pub fn read(path: Option<&Path>) -> Result<Self, SceneError> {
        let text = match path {
            Some(path) => Scene::read_with_text(path)?.1,
            None => Scene::template_without_radius(),
        };
        Self::of(text)
    }

    /// Parses a scene, without reading the files that it names.
    ///
    /// # Errors
    /// [`SceneError`]
    pub fn of(text: String) -> Result<Self, SceneError> {
        Ok(Self {
            scene: Scene::from_yaml(&text)?,
            text,
        })
    }

    /// Whether the scene names files by relative paths, besides the scan.
    pub fn names_files(&self) -> bool {
        let robot = self.scene.robot.as_ref();
        let files = robot.map(|robot| [&robot.urdf, &robot.check]);
        files
            .into_iter()
            .flatten()
            .flatten()
            .any(|file| file.is_relative())
    }

    /// Calibrations in the scene (`touchup calibrate`).
    pub fn calibrations(&self) -> NamedCalibrations {
        let Scene {
            scan_to_space,
            tip,
            compensation,
            ..
        } = &self.scene;
        let named = |kind, is_there: bool| {
            let date = calibrated_on(&self.text, kind)
                .filter(|_| is_there)
                .map(|date| date.to_string());
            NamedCalibration { is_there, date }
        };
        let has_tip = tip.as_ref().is_some_and(|tip| tip.offset.is_some());
        let has_payload = compensation
            .as_ref()
            .is_some_and(|one| one.payload.is_some() || one.bias.is_some());
        NamedCalibrations {
            scan: named(CalibrationKind::Scan, scan_to_space.is_some()),
            tip: named(CalibrationKind::Tip, has_tip),
            payload: named(CalibrationKind::Payload, has_payload),
        }
    }

    /// A copy with a calibration.
    ///
    /// # Errors
    /// [`SceneError`]
    pub fn calibrated(
        &self,
        found: &impl CalibrationResult,
        now: SystemTime,
    ) -> Result<Self, SceneError> {
        Self::of(calibrated_scene(&self.text, found, now)?)
    }

    /// Text of the scene.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The radius in the scene, mm.
    pub fn radius_mm(&self) -> Option<f64> {
        let is_said = Scene::names(&self.text, "tip", "radius_mm");
        self.scene
            .tip
            .as_ref()
            .filter(|_| is_said)
            .map(|tip| tip.ball.radius * 1e3)
    }

    /// The unit of a scan in the scene's folder; `None`: the scene names another scan.
    pub fn unit_of(&self, file: &str) -> Option<MeshUnit> {
        let scan = self.scene.scan.as_ref()?;
        (scan.file.as_deref() == Some(Path::new(file))).then_some(scan.unit)
    }

    /// The text with a tip.
    ///
    /// - `scan`: name of a file in the folder of the scene, and its unit; `None`: unchanged.
    ///
    /// # Errors
    /// [`SceneError`]: a number out of its range, or an unsuitable text.
    pub fn with(
        &self,
        tip: Option<StatedTip>,
        scan: Option<(&str, MeshUnit)>,
    ) -> Result<String, SceneError> {
        let mut settings = Vec::new();
        if let Some(StatedTip {
            radius_mm,
            uncertainty_mm,
        }) = tip
        {
            settings.push(Setting::number("tip.radius_mm", radius_mm));
            settings.extend(uncertainty_mm.map(|u_mm| {
                Setting::number("uncertainty.radius_sigma_mm", u_mm / COVERAGE_FACTOR)
            }));
        }
        if let Some((file, unit)) = scan {
            settings.push(Setting::file("scan.file", Path::new(file))?);
            settings.push(Setting::word("scan.unit", unit));
        }
        let mut scene = self.scene.clone();
        scene.set(&settings)?;
        scene.validate()?;
        Scene::edited(&self.text, &settings, REMARK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stated_is_in_the_text_and_the_rest_stays_with_its_comments() {
        let text = "# bench 3\ntip: { radius_mm: 2 }\npatch: off  # no time\nuncertainty: off\n";
        let draft = SceneDraft::of(text.to_owned()).unwrap();
        assert_eq!(draft.radius_mm(), Some(2.0));
        let tip = StatedTip {
            radius_mm: 1.5,
            uncertainty_mm: None,
        };
        let made = draft
            .with(Some(tip), Some(("it's.ply", MeshUnit::Inch)))
            .unwrap();
        let scene = Scene::from_yaml(&made).unwrap();
        assert_eq!(scene.tip.unwrap().ball.radius, 1.5e-3);
        let part = scene.scan.unwrap();
        assert_eq!(
            (part.file.unwrap().to_str(), part.unit),
            (Some("it's.ply"), MeshUnit::Inch)
        );
        assert!(
            made.starts_with("# bench 3\n") && made.contains("patch: off  # no time"),
            "{made}"
        );
    }

    #[test]
    fn calibrations_that_are_there_are_shown_with_their_day() {
        let text = "tip:\n  offset_mm: [0, 0, 1]  # touchup calibrate tip: 9 poses; 2026-02-28\nscan_to_space: {}\n";
        let draft = SceneDraft::of(text.to_owned()).unwrap();
        let NamedCalibrations { scan, tip, payload } = draft.calibrations();
        assert_eq!(
            tip,
            NamedCalibration {
                is_there: true,
                date: Some("2026-02-28".to_owned())
            }
        );
        assert_eq!(
            scan,
            NamedCalibration {
                is_there: true,
                date: None
            }
        );
        assert_eq!(
            payload,
            NamedCalibration {
                is_there: false,
                date: None
            }
        );
    }

    #[test]
    fn the_usual_scene_says_no_radius_and_takes_one_with_its_uncertainty() {
        let draft = SceneDraft::read(None).unwrap();
        assert_eq!(draft.radius_mm(), None);
        assert!(!draft.names_files());
        let made = draft
            .with(
                Some(StatedTip {
                    radius_mm: 1.5,
                    uncertainty_mm: Some(0.004),
                }),
                None,
            )
            .unwrap();
        let scene = Scene::from_yaml(&made).unwrap();
        // the half of an expanded uncertainty with k = 2
        assert!((scene.uncertainty.unwrap().calibration.radius - 2e-6).abs() < 1e-15);
        assert!(Scene::names(&made, "tip", "radius_mm"));
        for radius_mm in [0.0, -1.0, 1e6, f64::NAN] {
            assert!(
                draft
                    .with(
                        Some(StatedTip {
                            radius_mm,
                            uncertainty_mm: None
                        }),
                        None
                    )
                    .is_err(),
                "{radius_mm}"
            );
        }
    }
}
