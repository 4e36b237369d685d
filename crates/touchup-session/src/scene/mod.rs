//! The YAML of a scene: its parts and their parameters, converted to the settings of the modules.
//!
//! A scene gives differences only: the parts of a right result are active unless the scene says
//! `off`, as in `patch: off`; parts for some sensors only are active if named. A part without keys
//! has its defaults. [`touchup_method::parameters!`] declares each parameter once, in its own module;
//! `config/default.yaml` is [`Scene::template`] and docs/scene.md is [`Scene::table`].

mod arm_check;
mod built;
mod correction;
mod edit;
mod error;
mod params;
mod region;
mod sections;
mod template;

use std::path::{Path, PathBuf};

pub use arm_check::{CheckDoubt, CheckRecord, CheckRecordError, CheckStanding};
pub use built::{LeftOut, Memory, SceneCost, SceneParts};
pub use edit::Setting;
pub(crate) use error::yaml_error;
pub use error::{SceneError, nearest};
pub use params::simulated_arm;
pub use region::{CutScan, RegionCut};
pub use sections::{
    ArmModel, ClockSection, CompensationSection, GravityAxes, MarkersSection, Mode, ModelName,
    PayloadSection, RefineSection, RobotSection, Ros2ControlSection, ScanSection,
    ScanToSpaceSection, ShapeName, TipSection,
};

use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::TableColumns;
use touchup_io::text_file::read_text;
use touchup_method::haptic::{CarveParams, GuardParams};
use touchup_method::parameters;
use touchup_method::reconstruct::{PatchParams, UncertaintyParams};
use touchup_method::stylus::{
    BiasParams, ContactGateParams, KnownChange, SlidingParams, SyncParams, TipBody, TipParams,
    TipShape,
};

parameters! {
    /// The parts of a scene. `None`: not built. Those with a default are built unless the scene
    /// says `off`.
    ///
    /// By default all but compensation, which depends on the sensor, and the parts that only some
    /// sensors need.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Scene in "" {
        /// Pairing of poses with wrenches: interpolates the pose at the stamp of each wrench. Off:
        /// only messages of equal stamp pair.
        sync: Option<SyncParams> = Some(Default::default()), "sync";
        /// Columns of a recording that is a table (CSV, or the log of a UR's RTDE), by their names
        /// in the first line, each with its unit, as in x_mm or `x [mm]`. Not named: the usual
        /// names and those of RTDE apply.
        columns: Option<TableColumns> = None, "columns";
        /// Estimate of the delay of the wrench clock, from the onsets of contacts. The program
        /// reports it, and applies it only on request. It has no keys. Off: no estimate.
        clock: Option<ClockSection> = Some(Default::default()), "clock";
        /// Markers on the stylus, for recordings that hold them in place of its pose
        /// (--markers-topic): springs and dampers pull a rigid body to the visible markers. The
        /// default values are those of the simulated stylus.
        markers: Option<MarkersSection> = None, "markers";
        /// Pose of the scan in the frame of the recorded poses: p_space = R p_scan + t (`touchup
        /// calibrate scan`). Not named: the poses are in the frame of the scan.
        scan_to_space: Option<ScanToSpaceSection> = None, "scan_to_space";
        /// What changed its place while the recording lasted (`touchup doctor`), one after the other:
        /// taken off the poses. A change lasts until the end of the recording. Not named: nothing
        /// moved but the stylus.
        changes: Vec<KnownChange> = Vec::new(), "changes";
        /// Subtraction of weight and bias from the wrench (`touchup calibrate payload`). Not named:
        /// the driver of the sensor subtracts them, and the sensor has the axes of the tip.
        compensation: Option<CompensationSection> = None, "compensation";
        /// Tracking of the slow drift of the sensor in free air. Not named: the bias stays
        /// constant.
        bias_tracking: Option<BiasParams> = None, "bias_tracking";
        /// Contact gate: separates contact from free motion by the measured force. Off: every
        /// sample counts as contact.
        contact: Option<ContactGateParams> = Some(Default::default()), "contact";
        /// Tip of the stylus: a ball, the flat end of a cylinder, or a cone with a round nose. The
        /// origin of the pose is the centre of the ball or nose, or the middle of the flat end; its
        /// z axis runs along the shaft, from the tip to the handle. Off: a rigid point.
        tip: Option<TipSection> = Some(Default::default()), "tip";
        /// Scan and its quality. Off: the scan is free of noise.
        scan: Option<ScanSection> = Some(Default::default()), "scan";
        /// Removal of friction from the measured normal while the ball slides, in the haptic update
        /// and in the patch. Off: the direction of the force is the normal. The keys are for the
        /// haptic update, which knows only the past; of them the patch uses only the cone, as it
        /// looks ahead.
        sliding: Option<SlidingParams> = Some(Default::default()), "sliding";
        /// Carving and free space: the haptic update and the patch remove surface that the tip passes
        /// through without a force. Off: lids over holes stay. The keys are for carving, by the
        /// haptic update; in the patch free space counts as touches do.
        carve: Option<CarveParams> = Some(Default::default()), "carve";
        /// Guard of the mesh: cuts back an update that would exceed one of these limits. Off: no
        /// limits, as in the paper, and the mesh of a noisy scan may diverge.
        guard: Option<GuardParams> = Some(Default::default()), "guard";
        /// Reconstruction of the touched surface, finer than the scan: edges are sharp, closed
        /// holes open, and the untouched scan stays unchanged. Off: the triangles of the scan stay
        /// and only move.
        patch: Option<PatchParams> = Some(Default::default()), "patch";
        /// Uncertainty of each vertex (sigma_mm in the PLY), and rejection of outliers: touches
        /// that contradict their place. A second pass that confirms an outlier relocates the place.
        /// Needs patch. Off: every touch counts, and the result has no uncertainty.
        uncertainty: Option<UncertaintyParams> = Some(Default::default()), "uncertainty";
        /// Arm with a probe (`touchup probe`, docs/probing.md). Not named: no probing. A request
        /// can ask for less than these limits, never for more. The tip must be a ball, and
        /// scan_to_space is the pose of the scan in the base of the arm.
        robot: Option<RobotSection> = None, "robot";
        /// Haptic update: moves the mesh until measured and expected force agree. Off: the mesh
        /// stays.
        refine: Option<RefineSection> = Some(Default::default()), "refine";
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

    /// The named columns of a table.
    pub fn table_columns(&self) -> TableColumns {
        self.columns.clone().unwrap_or_default()
    }

    /// Reads and checks a scene, and keeps its text for [`Self::edited`].
    ///
    /// # Errors
    /// Those of [`Self::read`].
    pub fn read_with_text(path: &Path) -> Result<(Self, String), SceneError> {
        let yaml = read_text(path)?;
        let in_file = |error| SceneError::In {
            path: path.to_owned(),
            error: Box::new(error),
        };
        let mut scene = Self::from_yaml(&yaml).map_err(in_file)?;
        if let Some(robot) = &mut scene.robot {
            let folder = path.parent().unwrap_or(Path::new(""));
            robot.read_urdf(folder)?;
            robot.read_check(folder)?;
        }
        Ok((scene, yaml))
    }

    /// Whether the text of a scene gives a value to the key of a section; `false` for an invalid
    /// text.
    pub fn names(yaml: &str, section: &str, key: &str) -> bool {
        let Ok(scene) = serde_saphyr::from_str::<serde_json::Value>(yaml) else {
            return false;
        };
        scene
            .get(section)
            .and_then(|section| section.get(key))
            .is_some_and(|value| !value.is_null())
    }

    /// Checks that the text of the scene gives the radius of the ball. The default does not count.
    ///
    /// - `yaml`: text of the scene; empty for none.
    ///
    /// # Errors
    /// [`SceneError::NoRadius`]
    pub fn require_radius(&self, yaml: &str) -> Result<(), SceneError> {
        // a rigid point has none
        if self.tip.is_none() || Self::names(yaml, "tip", "radius_mm") {
            Ok(())
        } else {
            Err(SceneError::NoRadius)
        }
    }

    /// The scan that the scene names, and the unit of its coordinates.
    ///
    /// - `path`: path of the scene.
    pub fn scan_file(&self, path: &Path) -> Option<(PathBuf, MeshUnit)> {
        let scan = self.scan.as_ref()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Some((folder.join(scan.file.as_ref()?), scan.unit))
    }

    /// The files that the scene names, as settings for a scene in another folder.
    ///
    /// - `folder`: of this scene.
    ///
    /// # Errors
    /// Those of [`Setting::file`].
    pub fn files_in(&self, folder: &Path) -> Result<Vec<Setting>, SceneError> {
        let robot = self.robot.as_ref();
        let files = [
            (
                "scan.file",
                self.scan.as_ref().and_then(|scan| scan.file.as_ref()),
            ),
            ("robot.urdf", robot.and_then(|robot| robot.urdf.as_ref())),
            ("robot.check", robot.and_then(|robot| robot.check.as_ref())),
        ];
        let named = files
            .into_iter()
            .filter_map(|(key, file)| Some((key, file?)));
        named
            .map(|(key, file)| Setting::file(key, &folder.join(file)))
            .collect()
    }

    /// Parses and checks a scene.
    ///
    /// # Errors
    /// [`SceneError`]
    ///
    /// # Example
    /// ```
    /// let scene = touchup_session::scene::Scene::from_yaml("contact: { on_n: 0.5 }")?;
    /// assert_eq!(scene.contact.unwrap().on, 0.5);
    /// assert!(scene.patch.is_some() && scene.robot.is_none());
    /// assert!(touchup_session::scene::Scene::from_yaml("patch: off")?.patch.is_none());
    /// # Ok::<(), touchup_session::scene::SceneError>(())
    /// ```
    pub fn from_yaml(yaml: &str) -> Result<Self, SceneError> {
        // the parser keeps comments between a key and its value, in few slots
        let scene: Self = serde_saphyr::from_str(yaml).map_err(|error| yaml_error(&error))?;
        scene.validate()?;
        Ok(scene)
    }

    /// Checks every range and the dependencies between parts; call it again after a flag changes a
    /// value.
    ///
    /// # Errors
    /// [`SceneError::Setting`], [`SceneError::Incomplete`].
    pub fn validate(&self) -> Result<(), SceneError> {
        self.check()?;
        self.check_complete()?;
        let (shape, radius) = (self.tip_shape(), self.tip_params().radius);
        TipBody::new(shape, radius)?;
        let has_extent = radius > 0.0 || matches!(shape, TipShape::Cone { .. });
        let needs = match &self.contact {
            _ if !self.has_patch() => return Ok(()),
            _ if !has_extent => "tip.radius_mm above 0",
            None => "contact",
            Some(_) => return Ok(()),
        };
        Err(SceneError::Unmet {
            part: "patch",
            needs,
        })
    }

    /// Checks the keys that need others.
    fn check_complete(&self) -> Result<(), SceneError> {
        let require = |is_met, key, needs| match is_met {
            true => Ok(()),
            false => Err(SceneError::Incomplete { key, needs }),
        };
        let are_timed = self.changes.iter().all(|change| change.from.is_some());
        require(are_timed, "changes", "changes.from_s in each of them")?;
        if let Some(tip) = &self.tip {
            let is_cone = tip.shape == ShapeName::Cone;
            let has_angle = tip.sizes.half_angle.is_some();
            require(
                !is_cone || has_angle,
                "tip.shape: cone",
                "tip.half_angle_deg",
            )?;
        }
        if let Some(scan) = &self.scan {
            let [low, high] = [&scan.region_low, &scan.region_high].map(Option::is_some);
            require(high || !low, "scan.region_low_mm", "scan.region_high_mm")?;
            require(low || !high, "scan.region_high_mm", "scan.region_low_mm")?;
        }
        let TipParams { radius, stiffness } = self.tip_params();
        if let Some(refine) = &self.refine {
            let is_met = refine.contact_model != Some(ModelName::Spring) || stiffness.is_some();
            require(
                is_met,
                "refine.contact_model: spring",
                "tip.stiffness_n_per_mm",
            )?;
        }
        if let Some(robot) = &self.robot {
            let is_ball = radius > 0.0 && self.tip_shape() == TipShape::Ball;
            require(
                is_ball,
                "robot",
                "tip.shape: ball and tip.radius_mm above 0",
            )?;
            let has_arm = robot.model != ArmModel::Urdf || robot.urdf.is_some();
            require(has_arm, "robot.model: urdf", "robot.urdf")?;
        }
        Ok(())
    }
}
