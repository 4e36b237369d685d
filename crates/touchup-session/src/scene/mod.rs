//! The YAML that names the parts of a scene and their parameters, turned into the rooms' own settings.
//!
//! A part that is not named is not built: a scene that names only `refine` is the bare loop. A part that is named
//! without keys takes its defaults. `config/default.yaml` is [`Scene::default`] written out, with every key explained.

mod built;
mod edit;
mod error;
mod params;
mod region;
mod sections;

use std::path::{Path, PathBuf};

use serde::Deserialize;

pub use built::{Built, Memory, SceneCost};
pub use edit::Setting;
pub use error::SceneError;
use error::yaml_error;
pub use params::simulated_arm;
pub use region::{CutScan, RegionCut};
use sections::named;
pub use sections::{
    AlongName, BiasSection, BiasTrackingSection, CarveSection, ClockSection, CompensationSection, ContactSection,
    GravityAxes, GuardSection, MarkersSection, Mode, ModelName, PatchSection, PayloadSection, RefineSection,
    RobotSection, ScanSection, ScanToSpaceSection, ShapeName, SlidingSection, StepName, SyncSection, TipSection,
    UncertaintySection,
};

use touchup_io::mesh_file::MeshUnit;

/// The parts of a scene. `None`: not built.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Pairs poses with wrenches; without it only those of equal stamp pair.
    #[serde(default, deserialize_with = "named")]
    pub sync: Option<SyncSection>,
    /// Finds how late the clock of the wrench reads; without it nobody asks.
    #[serde(default, deserialize_with = "named")]
    pub clock: Option<ClockSection>,
    /// The markers on the stylus, when they and not its pose are recorded.
    #[serde(default, deserialize_with = "named")]
    pub markers: Option<MarkersSection>,
    /// Where the scan lies in the frame of the recorded poses; without it they are in the frame of the scan.
    #[serde(default, deserialize_with = "named")]
    pub scan_to_space: Option<ScanToSpaceSection>,
    /// Takes weight and bias off the wrench.
    #[serde(default, deserialize_with = "named")]
    pub compensation: Option<CompensationSection>,
    /// Follows the slow drift of the sensor in free air; without it the bias stays as it is named.
    #[serde(default, deserialize_with = "named")]
    pub bias_tracking: Option<BiasTrackingSection>,
    /// Tells contact from free motion; without it every sample counts as contact.
    #[serde(default, deserialize_with = "named")]
    pub contact: Option<ContactSection>,
    /// The ball that touches; without it a rigid point does.
    #[serde(default, deserialize_with = "named")]
    pub tip: Option<TipSection>,
    /// The scan, and how good it is; without it the scan counts as free of noise.
    #[serde(default, deserialize_with = "named")]
    pub scan: Option<ScanSection>,
    /// Takes friction out of the felt normal, in the haptic update and in the patch; without it the force is the normal.
    #[serde(default, deserialize_with = "named")]
    pub sliding: Option<SlidingSection>,
    /// Takes away what the tip passes through without a force, in the haptic update and in the patch; without it lids stay.
    #[serde(default, deserialize_with = "named")]
    pub carve: Option<CarveSection>,
    /// Keeps the mesh sound; without it an update may fold it.
    #[serde(default, deserialize_with = "named")]
    pub guard: Option<GuardSection>,
    /// Meshes the surface anew where it was touched; without it the triangles of the scan stay.
    #[serde(default, deserialize_with = "named")]
    pub patch: Option<PatchSection>,
    /// Says how well the surface that was meshed anew is known and rejects outliers; without it every touch counts.
    #[serde(default, deserialize_with = "named")]
    pub uncertainty: Option<UncertaintySection>,
    /// The arm that holds a probe; without it nothing is probed.
    #[serde(default, deserialize_with = "named")]
    pub robot: Option<RobotSection>,
    /// Moves the mesh; without it nothing does.
    #[serde(default, deserialize_with = "named")]
    pub refine: Option<RefineSection>,
}

impl Default for Scene {
    /// All but compensation, which depends on the sensor, and the parts that only some sensors need.
    fn default() -> Self {
        Self {
            sync: Some(SyncSection::default()),
            clock: Some(ClockSection::default()),
            markers: None,
            scan_to_space: None,
            compensation: None,
            bias_tracking: None,
            contact: Some(ContactSection::default()),
            tip: Some(TipSection::default()),
            scan: Some(ScanSection::default()),
            sliding: Some(SlidingSection::default()),
            carve: Some(CarveSection::default()),
            guard: Some(GuardSection::default()),
            patch: Some(PatchSection::default()),
            uncertainty: Some(UncertaintySection::default()),
            robot: None,
            refine: Some(RefineSection::default()),
        }
    }
}

impl Scene {
    /// Reads and checks a scene.
    ///
    /// # Errors
    /// [`SceneError`], with the path.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::read_with_text(path).map(|(scene, _)| scene)
    }

    /// Reads and checks a scene, and keeps its text for [`Self::edited`].
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_with_text(path: &Path) -> Result<(Self, String), SceneError> {
        let yaml =
            std::fs::read_to_string(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        let in_file = |error| SceneError::In { path: path.to_owned(), error: Box::new(error) };
        Ok((Self::from_yaml(&yaml).map_err(in_file)?, yaml))
    }

    /// The scan that the scene names, and the unit of its coordinates.
    ///
    /// - `path`: of the scene.
    pub fn scan_file(&self, path: &Path) -> Option<(PathBuf, MeshUnit)> {
        let scan = self.scan.as_ref()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Some((folder.join(scan.file.as_ref()?), scan.unit))
    }

    /// Parses and checks a scene.
    ///
    /// # Errors
    /// [`SceneError::Yaml`], [`SceneError::OutOfRange`].
    ///
    /// # Example
    /// ```
    /// let scene = touchup_session::scene::Scene::from_yaml("contact: { on_n: 0.5 }")?;
    /// assert_eq!(scene.contact_params().unwrap().on, 0.5);
    /// assert!(scene.sync.is_none());
    /// # Ok::<(), touchup_session::scene::SceneError>(())
    /// ```
    pub fn from_yaml(yaml: &str) -> Result<Self, SceneError> {
        // comments between a key and its value are held, and there are few places for them
        let options = serde_saphyr::options! { emit_comments: false };
        let scene: Self = serde_saphyr::from_str_with_options(yaml, options).map_err(|error| yaml_error(&error))?;
        scene.check()?;
        Ok(scene)
    }

    /// Checks every range; to be called again after a flag changed a value.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`], [`SceneError::Incomplete`].
    pub fn check(&self) -> Result<(), SceneError> {
        self.sync.iter().try_for_each(SyncSection::check)?;
        self.scan_to_space.iter().try_for_each(ScanToSpaceSection::check)?;
        self.compensation.iter().try_for_each(CompensationSection::check)?;
        self.markers.iter().try_for_each(MarkersSection::check)?;
        self.bias_tracking.iter().try_for_each(BiasTrackingSection::check)?;
        self.contact.iter().try_for_each(ContactSection::check)?;
        self.tip.iter().try_for_each(TipSection::check)?;
        self.scan.iter().try_for_each(ScanSection::check)?;
        self.sliding.iter().try_for_each(SlidingSection::check)?;
        self.carve.iter().try_for_each(CarveSection::check)?;
        self.guard.iter().try_for_each(GuardSection::check)?;
        self.patch.iter().try_for_each(PatchSection::check)?;
        self.uncertainty.iter().try_for_each(UncertaintySection::check)?;
        self.robot.iter().try_for_each(RobotSection::check)?;
        self.refine.iter().try_for_each(RefineSection::check)?;
        let asks_for_spring =
            self.refine.as_ref().is_some_and(|refine| refine.contact_model == Some(ModelName::Spring));
        if asks_for_spring && self.tip.as_ref().is_none_or(|tip| tip.stiffness_n_per_mm.is_none()) {
            return Err(SceneError::Incomplete {
                key: "refine.contact_model: spring",
                needs: "tip.stiffness_n_per_mm",
            });
        }
        if self.robot.is_some()
            && self.tip.as_ref().is_none_or(|tip| tip.radius_mm <= 0.0 || tip.shape != ShapeName::Ball)
        {
            return Err(SceneError::Incomplete { key: "robot", needs: "tip.shape: ball and tip.radius_mm above 0" });
        }
        if self.patch.is_some() {
            if self.tip.as_ref().is_none_or(|tip| tip.radius_mm <= 0.0 && tip.shape != ShapeName::Cone) {
                return Err(SceneError::Incomplete { key: "patch", needs: "tip.radius_mm above 0" });
            }
            if self.contact.is_none() {
                return Err(SceneError::Incomplete { key: "patch", needs: "contact" });
            }
        }
        Ok(())
    }
}
