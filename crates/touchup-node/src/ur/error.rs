//! Errors of connecting a UR.

use std::path::PathBuf;

use touchup_probing::arm::{ArmError, Safety};

/// Reason why no arm is connected. Nothing has moved.
#[derive(Debug, thiserror::Error)]
pub enum UrError {
    /// A parameter outside its range.
    #[error(transparent)]
    Parameters(ArmError),
    /// No server listens or answers at the address.
    #[error(
        "{host}:{port} ({service}): {reason}; check that the controller is on, the cable and the address"
    )]
    Unreachable {
        /// address of the controller
        host: String,
        /// TCP port
        port: u16,
        /// name of the service
        service: &'static str,
        /// cause
        reason: String,
    },
    /// A controller of an unsupported version.
    #[error(
        "the controller at {host} runs version {found}; an e-Series with PolyScope 5.9 or a later 5 is needed"
    )]
    Version {
        /// address of the controller
        host: String,
        /// its version
        found: String,
    },
    /// The rate of the states is too low.
    #[error(
        "the controller at {host} sends {hz:.0} states a second where {needed_hz:.0} are needed: an e-Series at its full rate"
    )]
    Rate {
        /// address of the controller
        host: String,
        /// measured rate
        hz: f64,
        /// minimum rate
        needed_hz: f64,
    },
    /// States come too late: something else keeps this machine or the network busy.
    #[error(
        "before any motion the states of the controller at {host} came up to {worst_ms:.1} ms late, one in a hundred by more than \
         {usual_ms:.1} ms, where 20 and 4 ms are tolerable: end what else runs on this machine, allow real-time priority (docs/ur.md), \
         or use a cable"
    )]
    Busy {
        /// address of the controller
        host: String,
        /// 99th percentile of the lateness, ms
        usual_ms: f64,
        /// maximum lateness, ms
        worst_ms: f64,
    },
    /// The controller is in local control.
    #[error("the controller at {host} is in local control: set it to remote control at its panel")]
    Local {
        /// address of the controller
        host: String,
    },
    /// The arm has no power, or its brakes are closed.
    #[error(
        "the arm at {host} is not running ({mode}): power it on and release its brakes at its panel"
    )]
    Off {
        /// address of the controller
        host: String,
        /// answer of the controller
        mode: String,
    },
    /// A safety function stopped the arm.
    #[error("the arm is stopped: {0}")]
    Stopped(Safety),
    /// No ur-rtde, or another version.
    #[error("{}: {reason}; make it with `touchup ur setup`", site_packages.display())]
    Wheel {
        /// searched folder
        site_packages: PathBuf,
        /// cause
        reason: String,
    },
    /// The program that speaks to the arm does not start, or not in time.
    #[error("the program that speaks to the arm {0}")]
    Client(String),
    /// The controller reads back another TCP than the commanded one.
    #[error("the TCP of the controller is not the one that was set: {0}")]
    Tool(String),
}
