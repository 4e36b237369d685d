//! Arm of a verb: simulated, a UR, or behind ros2_control.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::{KeptMeasurements, ProbingSetup, SpotWorld, millimetres};
use crate::cli::CliError;
use crate::cli::common::arm_errors::ArmErrorsName;
use crate::cli::common::progress::WorkProgress;
use crate::cli::common::signals::StopSignals;
use touchup_features::calibrate::ReferenceSphere;
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::MeshUnit;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros::arguments::NodeConfig;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros2_control::{Ros2ControlArm, Ros2ControlParams};
#[cfg(feature = "ur")]
use touchup_node::ur::{UrArm, UrParams};
use touchup_probing::arm::Arm;
use touchup_probing::execute::{Prober, RobotCell};
use touchup_session::scan::read_scan;
#[cfg(feature = "ur")]
use touchup_session::scene::RobotSection;
use touchup_session::scene::Scene;
use touchup_sim::{ArmParams, MeshSurface, SimArm, WithSpheres};

/// Kind of arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum RobotName {
    /// Simulated arm, against the part of --truth
    Sim,
    /// UR arm at robot.host of the scene (docs/ur.md); needs touchup built with the feature `ur`
    Ur,
    /// Any arm behind ros2_control, on the topics of robot.ros2_control of the scene
    /// (docs/ros2_control.md)
    #[value(name = "ros2_control")]
    Ros2Control,
}

/// Environment variable for a simulated controller whose clock waits for its client: docs/ur.md.
#[cfg(feature = "ur")]
const LOCK_STEP: &str = "TOUCHUP_UR_LOCK_STEP";

#[cfg(feature = "ur")]
const NO_HOST: &str =
    "--robot ur needs robot.host and robot.site_packages in the scene (docs/ur.md)";

/// Connects to the UR of a scene.
///
/// # Errors
/// [`CliError::usage`] if the scene names no UR or touchup lacks the feature; [`CliError::arm`] if
/// the UR does not answer.
#[cfg(feature = "ur")]
pub(in crate::cli) fn connect_ur(scene: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    Ok(Box::new(
        UrArm::connect(&ur_params(scene)?).map_err(CliError::arm)?,
    ))
}

/// Connects to the UR of a scene and clears its stop as far as calls can.
///
/// # Errors
/// As [`connect_ur`]; [`CliError::stopped`] if the stop needs an operator at the panel.
#[cfg(feature = "ur")]
pub(in crate::cli) fn recovered_ur(scene: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    Ok(Box::new(
        UrArm::recovered(&ur_params(scene)?).map_err(CliError::stopped)?,
    ))
}

#[cfg(feature = "ur")]
fn ur_params(scene: &Scene) -> Result<UrParams, CliError> {
    let named = |robot: &&RobotSection| !robot.host.is_empty() && !robot.site_packages.is_empty();
    let robot = scene.robot.as_ref().filter(named).zip(scene.probing());
    let (robot, (cell, _)) = robot.ok_or_else(|| CliError::usage(NO_HOST))?;
    if robot.chain.is_some() {
        return Err(CliError::usage(
            "a UR is planned with as a UR: name it in robot.model of the scene, not a URDF",
        ));
    }
    Ok(UrParams {
        pose_ft: cell.pose_ft,
        mass: robot.payload_mass,
        centre: robot.payload_centre,
        is_lock_step: std::env::var_os(LOCK_STEP).is_some(),
        ..UrParams::new(&robot.host, &robot.site_packages)
    })
}

#[cfg(not(feature = "ur"))]
pub(in crate::cli) fn connect_ur(_: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    Err(CliError::usage(NO_UR))
}

#[cfg(not(feature = "ur"))]
pub(in crate::cli) fn recovered_ur(scene: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    connect_ur(scene)
}

#[cfg(not(feature = "ur"))]
const NO_UR: &str = "this touchup was built without a UR: `cargo install --locked --path . --features ur` in its folder makes one with \
                     it, which needs a Python with its shared library (docs/ur.md)";

/// Connects to the ros2_control arm of a scene, on the network of the environment.
///
/// # Errors
/// [`CliError::usage`] if the scene names no arm or touchup lacks ROS; [`CliError::arm`] if the arm
/// accepts no commands.
#[cfg(any(feature = "ros", feature = "r2r"))]
fn connect_ros2_control(scene: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    let config = NodeConfig::named("touchup_arm", &[], |name| std::env::var(name).ok())?;
    ros2_control_arm(scene, &config)
}

#[cfg(not(any(feature = "ros", feature = "r2r")))]
fn connect_ros2_control(_: &Scene) -> Result<Box<dyn Arm + Send>, CliError> {
    Err(CliError::usage(
        "this touchup was built without ROS: build it with the feature `ros`, its default",
    ))
}

/// Connects to the ros2_control arm of a scene.
///
/// # Errors
/// [`CliError::usage`] if the scene names no arm; [`CliError::arm`] if it accepts no commands.
#[cfg(any(feature = "ros", feature = "r2r"))]
pub(in crate::cli) fn ros2_control_arm(
    scene: &Scene,
    config: &NodeConfig,
) -> Result<Box<dyn Arm + Send>, CliError> {
    const NONE: &str = "an arm behind ros2_control needs the sections robot and tip in the scene (docs/ros2_control.md)";
    let of_scene = scene.robot.as_ref().zip(scene.probing());
    let (robot, (cell, params)) = of_scene.ok_or_else(|| CliError::usage(NONE))?;
    let joint_names = match &robot.chain {
        Some(chain) => chain
            .joints()
            .iter()
            .map(|joint| joint.name.clone())
            .collect(),
        None => UR_JOINTS.map(Into::into).into(),
    };
    let params = Ros2ControlParams {
        geometry: cell.geometry,
        joint_names,
        pose_ft: cell.pose_ft,
        payload: robot.payload(),
        stiffness: params.touch.stiffness,
        latency: params.touch.latency,
        top_joint_speed: params.limits.joint_speed,
        section: robot.ros2_control.clone().unwrap_or_default(),
        ..Ros2ControlParams::default()
    };
    let section = &params.section;
    let states = [&section.joint_states_topic, &section.wrench_topic];
    let port = touchup_node::ros::arm_port(
        config,
        states.map(String::as_str),
        &section.trajectory_topic,
    )
    .map_err(CliError::arm)?;
    Ok(Box::new(
        Ros2ControlArm::connect(&params, port).map_err(CliError::arm)?,
    ))
}

/// Joint names of a UR from base to wrist, as in its description.
#[cfg(any(feature = "ros", feature = "r2r"))]
const UR_JOINTS: [&str; 6] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
];

#[derive(Debug, Args)]
pub(in crate::cli) struct ArmArguments {
    /// Kind of arm
    #[arg(long, value_name = "ARM")]
    pub robot: RobotName,
    #[command(flatten)]
    pub cell: CellArguments,
}

/// Scan and scene of an arm, also for verbs with other sources than an arm.
#[derive(Debug, Args)]
#[group(id = "cell")]
pub(in crate::cli) struct CellArguments {
    /// The scan: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57); default: the scene's
    /// file
    #[arg(long, value_name = "MESH")]
    scan: Option<PathBuf>,
    /// Unit of the coordinates in the files of scan and part
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// True part for a simulated arm: a closed mesh
    #[arg(long, value_name = "MESH")]
    truth: Option<PathBuf>,
    /// Seed for noise and errors of the simulated arm
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Error model of the simulated arm, relative to the scene
    #[arg(long, value_name = "ERRORS", default_value = "none")]
    arm_errors: ArmErrorsName,
}

/// Measurement with the probe on the unrefined scan.
pub(in crate::cli) struct Measurement<'a> {
    /// Name of the progress stage.
    pub stage: &'static str,
    /// Kind and output file of the measurements.
    pub kept: KeptMeasurements<'a>,
    /// Reference spheres beside the part.
    pub spheres: &'a [ReferenceSphere],
}

/// Output file of the touches.
#[derive(Debug, Args)]
pub(in crate::cli) struct TouchesOutput {
    /// Output: each touch at once as a line of JSON, so that an aborted measurement loses none
    #[arg(long, value_name = "JSONL", requires = "robot")]
    pub touches_out: Option<PathBuf>,
}

/// True payload of a simulated arm, if it differs from the scene.
#[derive(Debug, Args)]
#[group(id = "true_payload")]
pub(in crate::cli) struct TruePayload {
    /// True payload of a simulated arm, kg; default: robot.payload_kg of the scene
    #[arg(long, value_name = "M")]
    truth_payload_kg: Option<f64>,
    /// Centre of mass of the true payload in the flange, mm; default: robot.payload_centre_mm of
    /// the scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    truth_payload_centre_mm: Option<String>,
}

impl TruePayload {
    /// Simulated arm with this true payload and the payload of the scene as configured.
    pub fn held_by(&self, arm: ArmParams, scene: &Scene) -> Result<ArmParams, CliError> {
        let configured_payload = scene.robot.clone().unwrap_or_default().payload();
        let mut payload = configured_payload;
        if let Some(mass) = self.truth_payload_kg {
            payload.mass = mass;
        }
        if let Some(text) = &self.truth_payload_centre_mm {
            payload.p_sc = millimetres("--truth-payload-centre-mm", text)?;
        }
        Ok(ArmParams {
            payload,
            configured_payload,
            ..arm
        })
    }
}

impl CellArguments {
    /// Path and unit of the scan.
    pub fn scan(&self, scene: &Path) -> Result<(PathBuf, MeshUnit), CliError> {
        match &self.scan {
            Some(scan) => Ok((scan.clone(), self.mesh_unit)),
            None => Scene::read(scene)?.scan_file(scene).ok_or_else(|| {
                CliError::usage("there is no scan: name it by --scan, or in the scene")
            }),
        }
    }

    /// Connects the arm and calls `work` with it.
    ///
    /// - `truth`: turns the simulated arm of the scene into the true one.
    pub fn with<T>(
        &self,
        robot: RobotName,
        ready: &ProbingSetup,
        truth: impl FnOnce(ArmParams) -> Result<ArmParams, CliError>,
        work: impl FnOnce(&mut dyn Arm) -> Result<T, CliError>,
    ) -> Result<T, CliError> {
        match robot {
            RobotName::Ur => work(&mut *connect_ur(&ready.scene)?),
            RobotName::Ros2Control => work(&mut *connect_ros2_control(&ready.scene)?),
            RobotName::Sim => {
                let part = self.part()?;
                let surface = MeshSurface::new(&part)?;
                let all = WithSpheres {
                    part: &surface,
                    spheres: &ready.spheres,
                };
                let params = truth(ready.simulated_arm(self.seed, self.arm_errors))?;
                let start = ready.cell.above(&ready.with_spheres(&part)?);
                let mut arm = SimArm::new(&all, params, &start)?;
                self.arm_errors.befall(&mut arm);
                work(&mut arm)
            }
        }
    }

    /// Measures with the probe on the unrefined scan, until a signal stops it; also returns the
    /// cell.
    ///
    /// - `truth`: as in [`Self::with`].
    pub fn measure<T, E: Into<CliError>>(
        &self,
        robot: RobotName,
        scene: &Path,
        Measurement {
            stage,
            kept,
            spheres,
        }: Measurement<'_>,
        truth: impl FnOnce(ArmParams, &Scene) -> Result<ArmParams, CliError>,
        work: impl FnOnce(&mut Prober<'_>) -> Result<T, E>,
    ) -> Result<(T, RobotCell), CliError> {
        let (scan, unit) = self.scan(scene)?;
        let ready = ProbingSetup::read(scene, &scan, unit)?.beside(spheres);
        ready.may_move()?;
        let _measuring = WorkProgress::stage(stage);
        let truth = |arm| truth(arm, &ready.scene);
        let signals = StopSignals::listen()?;
        let measured = self.with(robot, &ready, truth, |arm| {
            let mut world = SpotWorld::new(&ready, kept, &signals)?;
            let measured = work(&mut Prober::new(
                arm,
                &ready.cell,
                &ready.params,
                &mut world,
            ));
            signals.arm_is_at_rest();
            world.finish(measured.map_err(Into::into))
        })?;
        Ok((measured, ready.cell))
    }

    fn part(&self) -> Result<TriMesh, CliError> {
        let missing =
            || CliError::usage("--robot sim needs the part that it touches: --truth MESH");
        let truth = self.truth.as_ref().ok_or_else(missing)?;
        Ok(read_scan(truth, self.mesh_unit)
            .map_err(CliError::truth)?
            .mesh)
    }
}
