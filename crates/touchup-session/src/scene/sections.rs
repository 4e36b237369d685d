//! Sections of the YAML that correspond to no single struct of the method.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};

use super::{CheckRecord, CheckRecordError, CheckStanding};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::urdf::{ArmLinks, UrdfError, read_urdf};
use touchup_method::haptic::{MotionDirection, ScanParams, SigmoidParams, StepRule};
use touchup_method::parameters;
use touchup_method::stylus::{
    MarkerBody, MarkerParams, Payload, SensorBias, SensorMount, SettingError, TipParams, TipShape,
    TipSizes,
};
use touchup_method::words;
use touchup_probing::arm::{Limits, SerialChain, TouchParams, UrGeometry};
use touchup_probing::execute::Tool;
use touchup_probing::plan::{ArmUncertainty, PatternParams};

parameters! {
    /// `clock`; it has no keys.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ClockSection in "clock" {}
}

parameters! {
    /// `markers`: by default the stylus of the simulation.
    #[derive(Clone, Debug, PartialEq)]
    pub struct MarkersSection in "markers" {
        /// Position of each marker from the centre of the ball, in the axes of the tip (z: along
        /// the shaft, tip to handle), in the order of labels from 0 on; 3 to 16 markers, not on one
        /// line.
        ///
        /// m, in T.
        positions: Vec<Vector3<f64>> = MarkerBody::STYLUS_MM.into(), "positions_mm" [MM, -10000, 10000];
    }
    with {
        /// Settings of the filter that follows the body.
        params: MarkerParams,
    }
    check MarkersSection::is_body;
}

impl MarkersSection {
    /// The rigid body of the markers.
    ///
    /// # Errors
    /// [`SettingError`] for markers on one line.
    pub(super) fn body(&self) -> Result<MarkerBody, SettingError> {
        MarkerBody::new(self.positions.iter().map(|&p_t| p_t.into()).collect())
    }

    fn is_body(&self) -> Result<(), SettingError> {
        self.params.check_for(&self.body()?)
    }
}

parameters! {
    /// `scan_to_space`: p_space = R p_scan + t. By default the recorded poses are in the frame of
    /// the scan.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ScanToSpaceSection in "scan_to_space" {
        /// Origin of the scan in the frame of the poses.
        ///
        /// t, m.
        position: Vector3<f64> = [0.0; 3], "position_mm" [MM, -1e6, 1e6];
        /// Orientation of the scan in the frame of the poses, as a quaternion x, y, z, w.
        ///
        /// R.
        orientation_xyzw: [f64; 4] = NO_TURN, "orientation_xyzw" [QUATERNION, 0.999, 1.001];
    }
}

impl ScanToSpaceSection {
    /// Pose of the scan in space.
    pub(super) fn pose_wo(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.position.into(), unit_quaternion(self.orientation_xyzw))
    }
}

parameters! {
    /// `compensation`
    #[derive(Clone, Debug, PartialEq)]
    pub struct CompensationSection in "compensation" {
        /// Payload of the sensor: everything beyond its measuring plane.
        payload: Option<PayloadSection> = None, "payload";
        /// Bias of the sensor: its reading without contact and payload.
        bias: Option<SensorBias> = None, "bias";
    }
    with {
        /// Mount of the sensor.
        mount: SensorMount,
    }
}

words! {
    /// Axes of the gravity vector.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum GravityAxes {
        /// Axes of the scan: name gravity again after each new placement of the part.
        #[default]
        Object = "object",
        /// Axes of the recorded poses: `scan_to_space` turns it.
        Space = "space",
    }
}

parameters! {
    /// `compensation.payload`
    #[derive(Clone, Debug, PartialEq)]
    pub struct PayloadSection in "compensation.payload" {
        /// Axes of the vector of gravity: those of the scan (object), or those of the recorded
        /// poses, turned by scan_to_space (space).
        gravity_axes: GravityAxes = GravityAxes::Object, "gravity_axes";
    }
    with {
        /// The payload, its gravity in those axes.
        payload: Payload,
    }
}

words! {
    /// Shape of the tip.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum ShapeName {
        /// A ball.
        #[default]
        Ball = "ball",
        /// The end of a cylinder.
        Flat = "flat",
        /// A cone with a round nose.
        Cone = "cone",
    }
}

parameters! {
    /// `tip`
    #[derive(Clone, Debug, PartialEq)]
    pub struct TipSection in "tip" {
        /// Shape of the tip.
        shape: ShapeName = ShapeName::Ball, "shape";
        /// Centre of the ball from the origin of the recorded pose, in the axes of that pose
        /// (`touchup calibrate tip`); left out: 0. Positions of markers are from the origin of the
        /// recorded pose too.
        ///
        /// m.
        offset: Option<Vector3<f64>> = None, "offset_mm" [MM, -10000, 10000] like "[0, 0, 0]";
    }
    with {
        /// Its radius and stiffness.
        ball: TipParams,
        /// Sizes of a tip that is no ball.
        sizes: TipSizes,
    }
}

/// Default length of a tip, in diameters; at least the second number, m, for a sharp cone.
const USUAL_LENGTH: (f64, f64) = (2.0, 5e-3);

impl TipSection {
    /// The shape of the tip; a cone without an angle is invalid.
    pub(super) fn tip_shape(&self) -> TipShape {
        let TipSizes {
            edge_radius,
            half_angle,
            length,
        } = self.sizes;
        let (diameters, least) = USUAL_LENGTH;
        let length = length.unwrap_or((diameters * 2.0 * self.ball.radius).max(least));
        match self.shape {
            ShapeName::Ball => TipShape::Ball,
            ShapeName::Flat => TipShape::Flat {
                edge_radius: edge_radius.unwrap_or(0.0),
                length,
            },
            ShapeName::Cone => TipShape::Cone {
                half_angle: half_angle.unwrap_or_default(),
                length,
            },
        }
    }
}

parameters! {
    /// `scan`
    #[derive(Clone, Debug, PartialEq)]
    pub struct ScanSection in "scan" {
        /// File of the scan, unless a flag or an argument names one: PLY, STL or OBJ, or a point
        /// cloud (PLY, PCD, XYZ or E57), relative to the folder of this scene.
        file: Option<PathBuf> = None, "file" like "scan.ply";
        /// Unit of the coordinates in the file of the scan.
        unit: MeshUnit = MeshUnit::Millimetre, "unit";
        /// Lowest corner of the box of the ball's centre in all touches, in the frame of the scan.
        /// Only the scan near the box gets adjacency and a tree; the result holds the rest of the
        /// scan unchanged. Touches outside the box are refused; an arm needs the whole scan, and
        /// the node shows only the part near the box. Name both corners; left out: no box.
        ///
        /// m, in O.
        region_low: Option<Point3<f64>> = None, "region_low_mm" [MM, -1e6, 1e6] like "[-20, -20, -10]";
        /// Highest corner of the box of the ball's centre in all touches, in the frame of the scan.
        ///
        /// m, in O.
        region_high: Option<Point3<f64>> = None, "region_high_mm" [MM, -1e6, 1e6] like "[20, 20, 10]";
    }
    with {
        /// Quality of the scan.
        quality: ScanParams,
    }
    check ScanSection::is_box;
}

impl ScanSection {
    fn is_box(&self) -> Result<(), SettingError> {
        let mut corners = self
            .region_low
            .iter()
            .flat_map(|p| p.iter())
            .zip(self.region_high.iter().flat_map(|p| p.iter()));
        let allowed = "more than scan.region_low_mm along each axis";
        corners.try_for_each(|(low, high)| {
            SettingError::check("scan.region_high_mm", high * 1e3, low < high, allowed)
        })
    }
}

words! {
    /// Rule of the haptic update.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
    pub enum Mode {
        /// The rule for real scans.
        #[default]
        Robust = "robust",
        /// The published rule, taken literally: no gate, friction, carving or guard, even if the
        /// scene names them.
        Paper = "paper",
    }
}

words! {
    /// Model of the expected contact force.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ModelName {
        /// `f_max_n`, `h_min_mm`, `delta` (Eq 3).
        Sigmoid = "sigmoid",
        /// The stiffness of the tip.
        Spring = "spring",
    }
}

parameters! {
    /// `refine`; a key that is left out has the value of the mode.
    #[derive(Clone, Debug, PartialEq)]
    pub struct RefineSection in "refine" {
        /// Rule of the haptic update: robust, for real scans, or paper, the published rule without
        /// contact, sliding, carve, guard and patch, even if the scene names them.
        mode: Mode = Mode::Robust, "mode";
        /// Model of the expected force over depth: the sigmoid of Eq 3, or the spring of the tip;
        /// left out: the spring in mode robust if its stiffness is known, else the sigmoid.
        contact_model: Option<ModelName> = None, "contact_model" like "spring";
        /// Speed of a face for each newton of mismatch (Eq 6); left out: the value of the mode.
        alpha: Option<f64> = None, "alpha_m_per_n_s" [M_PER_N_S, 0, 1e6] like "0.00125";
        /// Turning speed of a face for each square newton of mismatch (Eq 7); left out: the value
        /// of the mode.
        beta: Option<f64> = None, "beta_per_n2_s" [PER_N2_S, 0, 1e9] like "0.1";
        /// Turning rate of a face to the measured normal, independent of the force, in place of
        /// beta; left out: the value of the mode, or off if beta_per_n2_s is given.
        turning: Option<f64> = None, "turning_per_s" [PER_S, 0, 1e6] like "30";
        /// Integration of position and normal: one after the other (lie), with a correction
        /// (corrected), coupled to 1e-9 (bounded, as with mode paper), or by adaptive Runge–Kutta
        /// (dp5); left out: the value of the mode.
        step: Option<StepRule> = None, "step" like "lie";
        /// Direction of the motion of a face: the normal at the start of the sample (normal0, Eq
        /// 6), or the force (force); left out: the value of the mode.
        along: Option<MotionDirection> = None, "along" like "force";
        /// Radius of the region of interest: vertices within this distance of the touched face
        /// follow it; left out: the radius of the ball or the size of another tip, for a ball in mode
        /// paper one ring of faces.
        ///
        /// m.
        roi: Option<f64> = None, "roi_mm" [MM, 0, 1000] like "1.5";
    }
    with {
        /// The sigmoid.
        sigmoid: SigmoidParams,
    }
}

words! {
    /// Model of the arm.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ArmModel {
        /// UR3e
        Ur3e = "ur3e",
        /// UR5e
        Ur5e = "ur5e",
        /// UR10e
        Ur10e = "ur10e",
        /// UR16e
        Ur16e = "ur16e",
        /// The arm of `robot.urdf`.
        Urdf = "urdf",
    }
}

parameters! {
    /// `robot.ros2_control`
    #[derive(Clone, Debug, PartialEq)]
    pub struct Ros2ControlSection in "robot.ros2_control" {
        /// Topic of joint_state_broadcaster.
        joint_states_topic: String = "/joint_states".to_owned(), "joint_states_topic";
        /// Topic of force_torque_sensor_broadcaster.
        wrench_topic: String = "/force_torque_sensor_broadcaster/wrench".to_owned(), "wrench_topic";
        /// Topic of the orders to joint_trajectory_controller.
        trajectory_topic: String = "/joint_trajectory_controller/joint_trajectory".to_owned(), "trajectory_topic";
        /// Frame of the wrenches, as in their headers.
        wrench_frame: String = "tool0".to_owned(), "wrench_frame";
        /// Origin of wrench_frame in the flange.
        ///
        /// m.
        sensor_position: Vector3<f64> = [0.0; 3], "sensor_position_mm" [MM, -1000, 1000];
        /// Orientation of wrench_frame in the flange, as a quaternion x, y, z, w.
        sensor_orientation_xyzw: [f64; 4] = NO_TURN, "sensor_orientation_xyzw" [QUATERNION, 0.999, 1.001];
    }
}

impl ArmModel {
    /// Lengths of a UR; `None` for an arm of a URDF.
    pub(super) fn ur(self) -> Option<UrGeometry> {
        match self {
            Self::Ur3e => Some(UrGeometry::UR3E),
            Self::Ur5e => Some(UrGeometry::UR5E),
            Self::Ur10e => Some(UrGeometry::UR10E),
            Self::Ur16e => Some(UrGeometry::UR16E),
            Self::Urdf => None,
        }
    }
}

impl Ros2ControlSection {
    /// Pose of the sensor in the flange.
    pub fn pose_fs(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            self.sensor_position.into(),
            unit_quaternion(self.sensor_orientation_xyzw),
        )
    }
}

parameters! {
    /// `robot`: model, payload, tip and limits of the arm.
    #[derive(Clone, Debug, PartialEq)]
    pub struct RobotSection in "robot" {
        /// Model of the arm.
        model: ArmModel = ArmModel::Ur5e, "model";
        /// Description of the arm for model: urdf, with its macros expanded, relative to the folder
        /// of this scene.
        urdf: Option<PathBuf> = None, "urdf" like "arm.urdf";
        /// Link of the URDF whose frame is the base of the arm.
        base_link: String = "base_link".to_owned(), "base_link";
        /// Link of the URDF whose frame is the flange.
        flange_link: String = "tool0".to_owned(), "flange_link";
        /// Radius of links without a simple shape in the URDF, as capsules from joint to joint.
        ///
        /// m.
        link_radius: f64 = 60.0, "link_radius_mm" [MM, 1, 1000];
        /// Not in the scene: the arm that the URDF describes.
        chain: Option<Arc<SerialChain>> = None;
        /// Record that `touchup check --out` wrote, relative to the folder of this scene; its
        /// findings enter each ±.
        check: Option<PathBuf> = None, "check" like "check.json";
        /// Age up to which a check counts; each result notes an older one.
        ///
        /// days.
        check_days: f64 = 30.0, "check_days" [DAYS, 0.01, 3650];
        /// Temperature of the cell; each result notes a difference of more than 5 K from that of
        /// the check.
        ///
        /// °C.
        temperature_c: Option<f64> = None, "temperature_c" [CELSIUS, -50, 100] like "21.5";
        /// Not in the scene: the content of the record.
        check_record: Option<CheckRecord> = None;
        /// Permission for the arm to move; false: only planning and drawing.
        allow_motion: bool = false, "allow_motion";
        /// Name or address of the controller; a simulated arm has none.
        host: String = String::new(), "host";
        /// Folder that `touchup ur setup` prints (docs/ur.md); a simulated arm has none.
        site_packages: String = String::new(), "site_packages";
        /// Topics and sensor of an arm behind ros2_control (docs/ros2_control.md).
        ros2_control: Option<Ros2ControlSection> = None, "ros2_control";
        /// Mass of everything on the flange (`touchup calibrate payload --robot`).
        payload_mass: f64 = 0.25, "payload_kg" [KG, 0, 50];
        /// Centre of mass of everything on the flange, in the flange.
        ///
        /// m.
        payload_centre: Vector3<f64> = [0.0, 0.0, 50.0], "payload_centre_mm" [MM, -1000, 1000];
        /// Centre of the ball in the flange.
        ///
        /// m. 150 mm before the flange, the handle towards it.
        tip_position: Vector3<f64> = [0.0, 0.0, 150.0], "tip_position_mm" [MM, -2000, 2000];
        /// Orientation of the tip in the flange (z: along the shaft, tip to handle), as a
        /// quaternion x, y, z, w.
        tip_orientation_xyzw: [f64; 4] = [1.0, 0.0, 0.0, 0.0], "tip_orientation_xyzw" [QUATERNION, 0.999, 1.001];
        /// Required ± of the numbers of a feature, with the probability `confidence`.
        ///
        /// m.
        tolerance: f64 = 0.05, "tolerance_mm" [MM, 0.0001, 10];
        /// Probability that the numbers of a feature are within the required ±.
        confidence: f64 = 0.95, "confidence" [ONE, 0.5, 0.9999];
    }
    with {
        /// Bounds of its motions.
        limits: Limits,
        /// Settings of a touch; its stiffness is that of the tip.
        touch: TouchParams,
        /// Requested numbers of a feature.
        pattern: PatternParams,
        /// Tool that must keep clear of the mesh.
        tool: Tool,
    }
    check RobotSection::is_limited;
}

impl RobotSection {
    fn is_limited(&self) -> Result<(), SettingError> {
        self.touch.check_within(&self.limits)
    }

    /// Reads the URDF of an arm other than a UR.
    ///
    /// - `folder`: folder of the scene.
    pub(super) fn read_urdf(&mut self, folder: &Path) -> Result<(), UrdfError> {
        let Some(file) = self.urdf.as_ref().filter(|_| self.model == ArmModel::Urdf) else {
            return Ok(());
        };
        let links = ArmLinks {
            base: &self.base_link,
            flange: &self.flange_link,
            radius: self.link_radius,
        };
        self.chain = Some(Arc::new(read_urdf(&folder.join(file), &links)?));
        Ok(())
    }

    /// Reads the record of the arm's check, if the scene names one.
    ///
    /// - `folder`: folder of the scene.
    pub(super) fn read_check(&mut self, folder: &Path) -> Result<(), CheckRecordError> {
        let Some(file) = &self.check else {
            return Ok(());
        };
        self.check_record = CheckRecord::read(&folder.join(file))?;
        Ok(())
    }

    /// Name of the model; for a URDF with its file.
    pub fn model_name(&self) -> String {
        match &self.urdf {
            Some(file) if self.model == ArmModel::Urdf => {
                format!("{}: {}", self.model.name(), file.display())
            }
            _ => self.model.name().to_owned(),
        }
    }

    /// Check record of the arm and its doubts, for each result.
    ///
    /// - `now`: present date and time.
    pub fn check_standing(&self, now: SystemTime) -> CheckStanding {
        let named = (self.check.as_deref(), self.check_record.as_ref());
        CheckStanding::of(
            named,
            &self.model_name(),
            now,
            self.check_days,
            self.temperature_c,
        )
    }

    /// The record of the check, if it belongs to this arm.
    fn own_check(&self) -> Option<&CheckRecord> {
        self.check_record
            .as_ref()
            .filter(|record| record.is_of(&self.model_name()))
    }

    /// Pattern parameters with the findings of the arm's check: the larger of measured and stated
    /// repeatability and growth, as a check of few touches may be lucky, and a maker's statement
    /// too.
    pub(super) fn checked_pattern(&self) -> PatternParams {
        let Some(record) = self.own_check() else {
            return self.pattern;
        };
        let growth = record.growth_mm_per_m.map_or(0.0, |growth| growth / 1e3);
        let shared = ArmUncertainty {
            growth: self.pattern.shared.growth.max(growth),
            ..self.pattern.shared
        };
        let touch_sigma = self.pattern.touch_sigma.max(record.repeatability_mm / 1e3);
        PatternParams {
            touch_sigma,
            shared,
            ..self.pattern
        }
    }

    /// Everything on the flange, its centre in the flange, gravity in the base.
    pub fn payload(&self) -> Payload {
        Payload {
            mass: self.payload_mass,
            p_sc: self.payload_centre,
            ..Payload::default()
        }
    }

    /// Pose of the tip in the flange.
    pub(super) fn pose_ft(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            self.tip_position.into(),
            unit_quaternion(self.tip_orientation_xyzw),
        )
    }
}

/// Identity quaternion x, y, z, w.
pub(super) const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

pub(super) fn unit_quaternion([x, y, z, w]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}
