//! An arm behind ros2_control, against a stand-in of its controller.

mod driver;
mod faults;
mod stand_in;

use std::sync::MutexGuard;
use std::time::Duration;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use touchup::probing::arm::{Arm, ArmError, ArmGeometry, ArmState, Command};
use touchup::ros2_control::{Ros2ControlArm, Ros2ControlParams};
use touchup::scene::Ros2ControlSection;
use touchup::sim::{ArmParams, Plate, SimArm, WEIGHTLESS};

use crate::chains::seven_joints;
use stand_in::{Fault, SharedWorld, World, mounted, start};

/// An arm above the plate, and the world behind it.
struct Bench {
    arm: Ros2ControlArm,
    world: SharedWorld,
}

/// The arm with seven joints, and a plate before it.
fn seven() -> ArmParams {
    let pose_bo = Isometry3::translation(0.45, -0.03, 0.15);
    ArmParams {
        geometry: ArmGeometry::from(seven_joints()),
        pose_bo,
        ..ArmParams::default()
    }
}

/// Its tip over a place of the plate.
fn over(params: &ArmParams, place: [f64; 3]) -> Isometry3<f64> {
    let place = params.pose_bo * Point3::from(place);
    Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity())
}

fn told(simulated: &ArmParams, clock: touchup::clock::Clock) -> Ros2ControlParams {
    let joint_count = simulated.geometry.joint_count();
    Ros2ControlParams {
        section: Ros2ControlSection {
            joint_states_topic: "/joint_states".to_owned(),
            wrench_topic: "/ft_sensor/wrench".to_owned(),
            trajectory_topic: "/arm_controller/joint_trajectory".to_owned(),
            wrench_frame: "ft_sensor".to_owned(),
            sensor_position: mounted().translation.vector,
            sensor_orientation_xyzw: mounted().rotation.coords.into(),
        },
        geometry: simulated.geometry.clone(),
        joint_names: (1..=joint_count)
            .map(|number| format!("joint{number}").into())
            .collect(),
        pose_ft: simulated.pose_ft,
        payload: WEIGHTLESS,
        stiffness: simulated.stiffness,
        latency: 20e-3,
        top_speed: 0.25,
        top_force: 50.0,
        top_joint_speed: 1.5,
        connect: Duration::from_secs(2),
        silent: Duration::from_millis(60),
        clock,
    }
}

/// - `change`: of the told parameters of the arm.
fn bench_with(
    simulated: ArmParams,
    change: impl FnOnce(&mut Ros2ControlParams),
) -> Result<Bench, ArmError> {
    let plate: &'static Plate = Box::leak(Box::new(Plate::default()));
    let start_bt = over(&simulated, [40e-3, 25e-3, 50e-3]);
    let arm = SimArm::new(plate, simulated.clone(), &start_bt).unwrap();
    let names = (1..=simulated.geometry.joint_count())
        .map(|number| format!("joint{number}"))
        .collect();
    let (world, port, clock) = start(arm, names, mounted());
    let mut params = told(&simulated, clock);
    change(&mut params);
    Ok(Bench {
        arm: Ros2ControlArm::connect(&params, Box::new(port))?,
        world,
    })
}

fn bench(simulated: ArmParams) -> Bench {
    bench_with(simulated, |_| {}).unwrap()
}

impl Bench {
    fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().unwrap()
    }

    /// Orders the same with each state for a time of the controller's clock.
    fn order_for(&mut self, ms: i64, command: &Command) -> Result<ArmState, ArmError> {
        let end_ns = self.world().now_ns + ms * 1_000_000;
        loop {
            let state = self.arm.next_state()?;
            if self.world().now_ns >= end_ns {
                return Ok(state);
            }
            self.arm.command(command)?;
        }
    }
}

/// Sideways, free of the plate.
fn sideways(speed: f64) -> Command {
    Command::Velocity {
        linear: Vector3::new(0.0, speed, 0.0),
        acceleration: 0.5,
    }
}

const STOP: Command = Command::Stop { deceleration: 0.5 };
