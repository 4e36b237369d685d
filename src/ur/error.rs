//! Why a UR is not at hand.

use std::path::PathBuf;

/// Why no arm is connected. Nothing has moved.
#[derive(Debug, thiserror::Error)]
pub enum UrError {
    /// A parameter outside its range.
    #[error("{what} is {value} {unit}: it has to be from {lowest} to {highest}")]
    BadParameter {
        /// which
        what: &'static str,
        /// in the unit
        value: f64,
        /// in the unit
        lowest: f64,
        /// in the unit
        highest: f64,
        /// of all
        unit: &'static str,
    },
    /// No server listens or answers there.
    #[error(
        "{host}:{port} ({service}): {reason}; check that the controller is on, the cable and the address"
    )]
    Unreachable {
        /// of the controller
        host: String,
        /// TCP
        port: u16,
        /// what is there
        service: &'static str,
        /// what happened
        reason: String,
    },
    /// A controller that this was not made for.
    #[error(
        "the controller at {host} runs version {found}; an e-Series with PolyScope 5.9 or a later 5 is needed"
    )]
    Version {
        /// of the controller
        host: String,
        /// what it runs
        found: String,
    },
    /// Its states come too seldom.
    #[error(
        "the controller at {host} sends {hz:.0} states a second where {needed_hz:.0} are needed: an e-Series at its full rate"
    )]
    Rate {
        /// of the controller
        host: String,
        /// found
        hz: f64,
        /// needed
        needed_hz: f64,
    },
    /// They come too late: something else keeps this machine or the network busy.
    #[error(
        "before any motion the states of the controller at {host} came up to {worst_ms:.1} ms late, one in a hundred by more than \
         {usual_ms:.1} ms, where 20 and 4 ms are tolerable: end what else runs on this machine, allow real-time priority (docs/ur.md), \
         or use a cable"
    )]
    Busy {
        /// of the controller
        host: String,
        /// 99 of 100 were not later, ms
        usual_ms: f64,
        /// the latest, ms
        worst_ms: f64,
    },
    /// Somebody else has the say.
    #[error("the controller at {host} is in local control: set it to remote control at its panel")]
    Local {
        /// of the controller
        host: String,
    },
    /// It cannot move.
    #[error(
        "the arm at {host} is not running ({mode}): power it on and release its brakes at its panel"
    )]
    Off {
        /// of the controller
        host: String,
        /// as it says it
        mode: String,
    },
    /// A safety function stopped it.
    #[error("the arm is stopped: {0}")]
    Stopped(crate::probing::arm::Safety),
    /// No ur-rtde, or another one.
    #[error("{}: {reason}; make it with `touchup ur setup`", site_packages.display())]
    Wheel {
        /// where it was looked for
        site_packages: PathBuf,
        /// what is wrong
        reason: String,
    },
    /// The program that speaks to the arm does not start, or not in time.
    #[error("the program that speaks to the arm {0}")]
    Client(String),
    /// The controller reads back another TCP than was set.
    #[error("the TCP of the controller is not the one that was set: {0}")]
    Tool(String),
}
