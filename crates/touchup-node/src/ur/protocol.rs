//! The protocol of the two processes: one JSON object on each line.
//!
//! Orders go down the client's stdin, reports come up its stdout. Poses and velocities follow
//! ur_rtde: position and rotation vector in the base B, m and rad.

use std::path::PathBuf;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use touchup_probing::arm::{Safety, SpeedReduction};

/// The only supported and tested version of ur-rtde.
pub const WHEEL: &str = "1.6.5";

/// Time between two states, and a cycle of the controller, s: 500 Hz of an e-Series.
pub const PERIOD: f64 = 2e-3;

/// The first line: connection and configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Begin {
    pub host: String,
    pub site_packages: PathBuf,
    /// tip in the flange
    pub tool: [f64; 6],
    pub mass_kg: f64,
    /// centre of mass in the flange
    pub centre_m: [f64; 3],
    /// major and minor version of the controller
    pub version: [u32; 2],
    pub damping: f64,
    pub gain: f64,
    /// the clock of the controller waits for its client
    pub is_lock_step: bool,
}

/// A line to the client.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// increases by one
    pub number: u64,
    pub what: OrderAction,
}

/// Action of an order. The newest motion replaces those before; a zero happens whatever comes after
/// it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum OrderAction {
    /// Moves with a velocity, until the next order or until orders stop.
    Move { twist: [f64; 6], acceleration: f64 },
    /// Presses along z of a frame of B and moves with a velocity.
    Press {
        frame: [f64; 6],
        force_n: f64,
        speed: f64,
        feed: [f64; 3],
        acceleration: f64,
    },
    /// Brakes to rest.
    Stop { deceleration: f64 },
    /// Zeroes the sensor, at rest.
    Zero,
}

/// A line from the client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ClientReport {
    /// The arm takes commands.
    Ready,
    /// A new state of the arm.
    State(Box<UrState>),
    /// Heartbeat of the client without a new state.
    Beat { served: u64 },
    /// `Zero` is done.
    Done { number: u64 },
    /// The library lost a connection. Always the last line: after it nobody can trust the library.
    Lost { which: RtdeConnection },
    /// No library, or another version.
    BadWheel { reason: String },
    /// The commanded tool is not in effect.
    BadTool { reason: String },
    /// A call of the library failed, though the state of the arm allows it.
    Failed { call: String, reason: String },
}

/// A connection of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RtdeConnection {
    States,
    Control,
}

/// State of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UrState {
    /// time of the controller
    pub stamp_s: f64,
    pub pose: [f64; 6],
    /// of the tip, m/s and rad/s
    pub velocity: [f64; 6],
    /// N and N m, less payload and zero offset; in B about the tip
    pub wrench: [f64; 6],
    /// reading of the sensor; in the flange
    pub raw_wrench: [f64; 6],
    /// rad
    pub joints: [f64; 6],
    /// bits of the controller
    pub safety_bits: u32,
    /// position of the speed slider, 0 to 1
    pub speed_fraction: f64,
    /// state of the uploaded program
    pub program: ProgramState,
    /// newest cycle count of its main loop; negative: a command longer than a cycle
    pub cycle: i32,
    /// number of the last order whose calls have returned
    pub served: u64,
}

/// State of the controller's program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ProgramState {
    /// It runs.
    Playing,
    /// It pauses, is paused or resumes: a resumption continues its previous action.
    Paused,
    /// No program.
    Ended,
}

/// Bits of `safety_status_bits` in the RTDE guide: violation, fault, and recovery, which takes a
/// panel.
const FAULT_BITS: u32 = 1 << 3 | 1 << 8 | 1 << 9;
/// Bits of safeguard and emergency stop buttons.
const OPERATOR_BITS: u32 = 1 << 4 | 1 << 5 | 1 << 6 | 1 << 7;
/// Bits of protective stop, and of any stop for safety.
const PROTECTIVE_BITS: u32 = 1 << 2 | 1 << 10;

/// Bit of `safety_status_bits`: reduced mode.
const REDUCED_BIT: u32 = 1 << 1;
/// Minimum reading of a slider at its upper end.
const FULL: f64 = 0.999;

impl UrState {
    /// Reasons why the arm is slower than ordered.
    pub fn slowed(&self) -> Option<SpeedReduction> {
        let is_reduced = self.safety_bits & REDUCED_BIT != 0;
        let is_slow = is_reduced || self.speed_fraction < FULL;
        is_slow.then_some(SpeedReduction {
            slider_percent: self.speed_fraction * 100.0,
            is_reduced,
        })
    }

    /// Whether the program runs.
    pub fn is_playing(&self) -> bool {
        self.program == ProgramState::Playing
    }

    /// Whether the arm can obey an order.
    pub fn may_move(&self) -> bool {
        self.is_playing() && self.safety() == Safety::Normal
    }

    /// Norm of the velocity, m/s and rad/s together.
    pub fn speed(&self) -> f64 {
        self.velocity
            .iter()
            .map(|part| part * part)
            .sum::<f64>()
            .sqrt()
    }

    /// Meaning of the bits of the safety system; the gravest counts.
    pub fn safety(&self) -> Safety {
        match self.safety_bits {
            bits if bits & FAULT_BITS != 0 => Safety::Fault,
            bits if bits & OPERATOR_BITS != 0 => Safety::OperatorStop,
            bits if bits & PROTECTIVE_BITS != 0 => Safety::ProtectiveStop,
            _ => Safety::Normal,
        }
    }
}

/// Pose of ur_rtde: position and rotation vector.
pub fn vector_of(pose: &Isometry3<f64>) -> [f64; 6] {
    let (place, turn) = (pose.translation.vector, pose.rotation.scaled_axis());
    [place.x, place.y, place.z, turn.x, turn.y, turn.z]
}

/// Pose from position and rotation vector.
pub fn pose_of([x, y, z, rx, ry, rz]: [f64; 6]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    #[test]
    fn a_pose_comes_back_from_its_vector() {
        // half a turn about x, and a rotation unlike that by roll, pitch and yaw
        for vector in [
            [0.1, -0.2, 0.3, std::f64::consts::PI, 0.0, 0.0],
            [0.0, 0.0, 0.5, 0.7, -1.1, 0.4],
        ] {
            let back = vector_of(&pose_of(vector));
            assert!(
                vector.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-12),
                "{vector:?} {back:?}"
            );
        }
        // a quarter turn about z takes x to y
        let turned =
            pose_of([0.0, 0.0, 0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2]).rotation * Vector3::x();
        assert!((turned - Vector3::y()).norm() < 1e-15, "{turned}");
    }

    pub const STATE: UrState = UrState {
        stamp_s: 12.345_678_901_234_5,
        pose: [0.1; 6],
        velocity: [-1e-17; 6],
        wrench: [1.0 / 3.0; 6],
        raw_wrench: [2.0 / 3.0; 6],
        joints: [3.0; 6],
        safety_bits: 1,
        speed_fraction: 1.0,
        program: ProgramState::Playing,
        cycle: -1,
        served: 7,
    };

    #[test]
    fn the_gravest_of_the_bits_counts() {
        let safety = |safety_bits| {
            UrState {
                safety_bits,
                ..STATE
            }
            .safety()
        };
        assert_eq!(safety(1), Safety::Normal);
        // reduced mode
        assert_eq!(safety(0b10), Safety::Normal);
        assert_eq!(safety(1 << 2 | 1 << 10), Safety::ProtectiveStop);
        assert_eq!(safety(1 << 7 | 1 << 2), Safety::OperatorStop);
        assert_eq!(safety(1 << 9 | 1 << 7), Safety::Fault);
    }

    #[test]
    fn a_slider_below_its_end_and_reduced_mode_are_named() {
        let words = |speed_fraction, safety_bits| {
            UrState {
                speed_fraction,
                safety_bits,
                ..STATE
            }
            .slowed()
            .map(|by| by.to_string())
        };
        assert_eq!(words(1.0, 1), None);
        assert_eq!(words(0.05, 1).unwrap(), "its speed slider is at 5 %");
        assert_eq!(words(1.0, 0b10).unwrap(), "its safety is in reduced mode");
        assert_eq!(
            words(0.4, 0b10).unwrap(),
            "its speed slider is at 40 % and its safety in reduced mode"
        );
    }

    #[test]
    fn lines_come_back_as_they_went() {
        let state = STATE;
        let line = serde_json::to_string(&ClientReport::State(Box::new(state))).unwrap();
        assert_eq!(
            serde_json::from_str::<ClientReport>(&line).unwrap(),
            ClientReport::State(Box::new(state))
        );
        assert!(!line.contains('\n'));
        let order = Order {
            number: 1,
            what: OrderAction::Move {
                twist: [0.1; 6],
                acceleration: 0.5,
            },
        };
        let line = serde_json::to_string(&order).unwrap();
        assert_eq!(
            line,
            r#"{"number":1,"what":{"Move":{"twist":[0.1,0.1,0.1,0.1,0.1,0.1],"acceleration":0.5}}}"#
        );
    }
}
