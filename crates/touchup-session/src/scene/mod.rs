//! The YAML of a scene: its parts and their parameters, converted to the settings of the modules.
//!
//! A scene gives differences only: the parts of a right result are active unless the scene says
//! `off`, as in `patch: off`; parts for some sensors only are active if named. A part without keys
//! has its defaults. [`touchup_method::parameters!`] declares each parameter once, in its own module;
//! `config/default.yaml` is [`Scene::template`] and docs/scene.md is [`Scene::table`].

mod arm_check;
mod built;
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
use touchup_method::haptic::{CarveParams, GuardParams, SlidingParams};
use touchup_method::parameters;
use touchup_method::reconstruct::{PatchParams, UncertaintyParams};
use touchup_method::stylus::{BiasParams, ContactGateParams, SyncParams, TipBody};

parameters! {
    /// The parts of a scene. `None`: not built. Those with a default are built unless the scene
    /// says `off`.
    ///
    /// By default all but compensation, which depends on the sensor, and the parts that only some
    /// sensors need.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Scene in "" {
        /// Pairs poses with wrenches: the pose is interpolated at the stamp of each wrench. Off:
        /// only messages of equal stamp pair.
        sync: Option<SyncParams> = Some(Default::default()), "sync";
        /// The columns of a recording that is a table (CSV, or the log of a UR's RTDE): by their
        /// names in its first line, each with its unit, as in x_mm or `x [mm]`. Not named: the
        /// usual names are looked for, and those of RTDE.
        columns: Option<TableColumns> = None, "columns";
        /// Estimates how late the clock of the wrench reads, from the moments at which contact
        /// begins; reported, and never applied unasked. It has no keys. Off: it is not estimated.
        clock: Option<ClockSection> = Some(Default::default()), "clock";
        /// The markers on the stylus, for recordings that hold them in place of its pose
        /// (--markers-topic): a rigid body is pulled to the markers that are seen by springs and
        /// dampers. The values are those of the simulated stylus.
        markers: Option<MarkersSection> = None, "markers";
        /// Where the scan lies in the frame of the recorded poses: p_space = R p_scan + t (`touchup
        /// calibrate scan`). Not named: the poses are in the frame of the scan.
        scan_to_space: Option<ScanToSpaceSection> = None, "scan_to_space";
        /// Takes weight and bias off the wrench (`touchup calibrate payload`). Not named: the
        /// sensor has the axes of the tip and its driver does it.
        compensation: Option<CompensationSection> = None, "compensation";
        /// Follows the slow drift of the sensor while nothing is touched. Not named: the bias stays
        /// as it is named.
        bias_tracking: Option<BiasParams> = None, "bias_tracking";
        /// Separates contact from free motion by the measured force. Off: every sample counts as
        /// contact.
        contact: Option<ContactGateParams> = Some(Default::default()), "contact";
        /// The tip that touches: a ball, the flat end of a cylinder, or a cone with a round nose.
        /// The origin of the pose is the centre of the ball or nose, or the middle of the flat end;
        /// its z runs along the shaft, from the tip to the handle. Off: a rigid point.
        tip: Option<TipSection> = Some(Default::default()), "tip";
        /// The scan, and how good it is. Off: it counts as free of noise.
        scan: Option<ScanSection> = Some(Default::default()), "scan";
        /// Takes friction out of the measured normal while the ball slides, in the haptic update
        /// and in the patch. Off: the force is the normal. All but the cone is for the haptic
        /// update, which knows the past alone; the patch looks ahead and finds its own.
        sliding: Option<SlidingParams> = Some(Default::default()), "sliding";
        /// Free space: what the tip passes through without a force is not there, in the haptic
        /// update and in the patch. Off: lids over holes stay. The keys are for the haptic update;
        /// in the patch free space counts as touches do.
        carve: Option<CarveParams> = Some(Default::default()), "carve";
        /// Keeps the mesh sound: an update that would break one of these limits is cut back. Off:
        /// anything goes, as in the paper, and a noisy scan may blow up.
        guard: Option<GuardParams> = Some(Default::default()), "guard";
        /// Reconstructs the surface where it was touched, finer than the scan: edges are sharp,
        /// closed holes open, and what was not touched stays as it was. Off: the triangles of the
        /// scan stay and are only moved.
        patch: Option<PatchParams> = Some(Default::default()), "patch";
        /// Reports how well each vertex is known (sigma_mm in the PLY), and rejects touches that
        /// contradict their place as outliers. A second pass that confirms the contradiction moves
        /// the place. Needs patch. Off: every touch counts, and nothing is reported.
        uncertainty: Option<UncertaintyParams> = Some(Default::default()), "uncertainty";
        /// The arm that holds a probe (`touchup probe`, docs/probing.md). Not named: nothing is
        /// probed. A request can ask for less than these limits, never for more. It needs a ball
        /// for a tip, and scan_to_space says where the scan lies in its base.
        robot: Option<RobotSection> = None, "robot";
        /// Moves the mesh until measured and expected force agree. Off: nothing moves it.
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
        let tip = self.tip.as_ref();
        let shape = tip.map(|tip| tip.shape);
        let radius = tip.map_or(0.0, |tip| tip.ball.radius);
        TipBody::new(self.tip_shape(), radius)?;
        for (is_missing, needs) in [
            (
                radius <= 0.0 && shape != Some(ShapeName::Cone),
                "tip.radius_mm above 0",
            ),
            (self.contact.is_none(), "contact"),
        ] {
            if self.has_patch() && is_missing {
                return Err(SceneError::Unmet {
                    part: "patch",
                    needs,
                });
            }
        }
        Ok(())
    }

    /// Checks the keys that need others.
    fn check_complete(&self) -> Result<(), SceneError> {
        let tip = self.tip.as_ref();
        let shape = tip.map(|tip| tip.shape);
        let radius = tip.map_or(0.0, |tip| tip.ball.radius);
        let corners = self
            .scan
            .as_ref()
            .map(|scan| (scan.region_low.is_some(), scan.region_high.is_some()));
        let asks_for_spring = self
            .refine
            .as_ref()
            .is_some_and(|it| it.contact_model == Some(ModelName::Spring));
        let half_angle = tip.and_then(|tip| tip.sizes.half_angle);
        for (is_missing, key, needs) in [
            (
                shape == Some(ShapeName::Cone) && half_angle.is_none(),
                "tip.shape: cone",
                "tip.half_angle_deg",
            ),
            (
                corners == Some((true, false)),
                "scan.region_low_mm",
                "scan.region_high_mm",
            ),
            (
                corners == Some((false, true)),
                "scan.region_high_mm",
                "scan.region_low_mm",
            ),
            (
                asks_for_spring && self.tip_params().stiffness.is_none(),
                "refine.contact_model: spring",
                "tip.stiffness_n_per_mm",
            ),
            (
                self.robot.is_some() && (radius <= 0.0 || shape != Some(ShapeName::Ball)),
                "robot",
                "tip.shape: ball and tip.radius_mm above 0",
            ),
            (
                self.robot
                    .as_ref()
                    .is_some_and(|robot| robot.model == ArmModel::Urdf && robot.urdf.is_none()),
                "robot.model: urdf",
                "robot.urdf",
            ),
        ] {
            if is_missing {
                return Err(SceneError::Incomplete { key, needs });
            }
        }
        Ok(())
    }
}
