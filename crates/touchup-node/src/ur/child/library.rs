//! Calls of ur-rtde; the only file that uses Python.
//!
//! A call returns `true` or it failed; the library has no other words. Vectors become arrays here,
//! as the library does not check lengths.

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;

use super::error::ChildError;
use super::program;
use crate::ur::protocol::{Begin, PERIOD, ProgramState, UrState, WHEEL};
use touchup_session::clock::Clock;

/// Rate of the states and of the control, Hz.
const RATE_HZ: f64 = 1.0 / PERIOD;
/// Flags: no upload and no wait for a program, force from the arm's own sensor; hence no upper
/// registers, no cap, no external sensor.
const FLAGS: u32 = 0x10 | 0x40;
const CAP_PORT: u16 = 50002;
/// The requested states: the default is 58 variables in 1180 bytes.
const VARIABLES: [&str; 11] = [
    "timestamp",
    "actual_q",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "ft_raw_wrench",
    "safety_status_bits",
    "target_speed_fraction",
    "runtime_state",
    "robot_status_bits",
    COUNT,
];
/// The register of [`program::REGISTER`].
const COUNT: &str = "output_int_register_19";
/// Values of `runtime_state` in the RTDE guide: running; pausing, paused, resuming.
const PLAYING: u32 = 2;
const PAUSED: std::ops::RangeInclusive<u32> = 3..=5;
/// Maximum readings of one state, as a new state may arrive during a reading.
const TORN_READS: usize = 3;

fn failed(call: &'static str) -> impl Fn(PyErr) -> ChildError {
    move |error| ChildError::Python {
        call,
        reason: error.to_string(),
    }
}

/// Makes an object of a class of the library.
fn made<'py>(
    py: Python<'py>,
    module: &str,
    class: &'static str,
    arguments: impl PyCallArgs<'py>,
) -> Result<Bound<'py, PyAny>, ChildError> {
    py.import(module)
        .and_then(|module| module.call_method1(class, arguments))
        .map_err(failed(class))
}

/// Finds the library in a folder of packages, and checks its version.
pub fn load(site_packages: &Path) -> Result<(), ChildError> {
    Python::attach(|py| {
        let os = py.import("os").map_err(failed("import os"))?;
        // prints of the library go to stderr: stdout is for reports alone
        os.call_method1("dup2", (2, 1)).map_err(failed("os.dup2"))?;
        let folder = site_packages.to_string_lossy();
        let site = py.import("site").map_err(failed("import site"))?;
        site.call_method1("addsitedir", (folder.as_ref(),))
            .map_err(failed("site.addsitedir"))?;
        let metadata = py
            .import("importlib.metadata")
            .map_err(failed("import importlib.metadata"))?;
        let found = metadata
            .call_method1("version", ("ur_rtde",))
            .map_err(failed("the version of ur-rtde"))?;
        let found: String = found.extract().map_err(failed("the version of ur-rtde"))?;
        if found != WHEEL {
            let reason = format!("{found} is there, {WHEEL} is wanted");
            return Err(ChildError::Python {
                call: "the version of ur-rtde",
                reason,
            });
        }
        for module in ["rtde_receive", "rtde_control", "script_client"] {
            py.import(module).map_err(failed("import"))?;
        }
        Ok(())
    })
}

/// Ends the process at once: the destructors of the library take a second, and after a lost link
/// they crash.
pub fn leave(code: i32) -> ! {
    // abort if Python cannot even do that
    let _ = Python::attach(|py| {
        py.import("os")
            .and_then(|os| os.call_method1("_exit", (code,)).map(drop))
    });
    std::process::abort()
}

/// `rtde_receive`.
pub struct Receive(Py<PyAny>);

impl Receive {
    /// Waits for the first state, without letting any other thread use Python.
    pub fn connect(host: &str) -> Result<Self, ChildError> {
        Python::attach(|py| {
            let arguments = (host, RATE_HZ, VARIABLES.to_vec(), false, false, 0);
            let made = made(py, "rtde_receive", "RTDEReceiveInterface", arguments)?;
            Ok(Self(made.unbind()))
        })
    }

    /// Whether the library has a connection.
    pub fn is_connected(&self) -> bool {
        Python::attach(|py| self.0.call_method0(py, "isConnected")?.extract(py)).unwrap_or(false)
    }

    /// Stamp of the newest state, s of the controller.
    pub fn stamp(&self) -> Option<f64> {
        Python::attach(|py| self.0.call_method0(py, "getTimestamp")?.extract(py)).ok()
    }

    /// The newest state, all from one moment; `None`: unreadable.
    pub fn state(&self, served: u64) -> Option<UrState> {
        Python::attach(|py| -> PyResult<Option<UrState>> {
            let read = |name: &str| self.0.call_method0(py, name);
            for _ in 0..TORN_READS {
                let stamp_s = read("getTimestamp")?.extract::<f64>(py)?;
                let state = UrState {
                    stamp_s,
                    pose: read("getActualTCPPose")?.extract(py)?,
                    velocity: read("getActualTCPSpeed")?.extract(py)?,
                    wrench: read("getActualTCPForce")?.extract(py)?,
                    raw_wrench: read("getFtRawWrench")?.extract(py)?,
                    joints: read("getActualQ")?.extract(py)?,
                    safety_bits: read("getSafetyStatusBits")?.extract(py)?,
                    speed_fraction: read("getTargetSpeedFraction")?.extract(py)?,
                    program: match read("getRuntimeState")?.extract::<u32>(py)? {
                        PLAYING => ProgramState::Playing,
                        state if PAUSED.contains(&state) => ProgramState::Paused,
                        _ => ProgramState::Ended,
                    },
                    cycle: self
                        .0
                        .call_method1(py, "getOutputIntRegister", (program::REGISTER,))?
                        .extract(py)?,
                    served,
                };
                // the next state may have come between two of these calls
                if read("getTimestamp")?.extract::<f64>(py)? == stamp_s {
                    return Ok(Some(state));
                }
            }
            Ok(None)
        })
        .ok()
        .flatten()
    }
}

/// Calls of ur-rtde for the driver, from one thread alone. A call returns when the library does.
pub trait Control {
    /// Whether the library has a connection.
    fn is_connected(&self) -> bool;
    /// Whether the uploaded program runs; an old answer when the connection is lost.
    fn is_running(&self) -> bool;
    /// Moves with a velocity, m/s and rad/s in B, reached with an acceleration, m/s², until the
    /// next command.
    fn speed(&self, twist: [f64; 6], acceleration: f64) -> Result<(), ChildError>;
    /// Presses along z of a frame of B with a force, N; `limits`: speed along z, m/s, deviation
    /// across, m and rad.
    fn press(
        &self,
        frame: [f64; 6],
        force: f64,
        kind: i32,
        limits: [f64; 6],
    ) -> Result<(), ChildError>;
    /// Ends pressing. A velocity not stopped before goes on.
    fn end_press(&self) -> Result<(), ChildError>;
    /// Stops the motion of `speed` with a deceleration, m/s²; returns when the arm is at rest.
    fn hard_stop(&self, deceleration: f64) -> Result<(), ChildError>;
    /// Zeroes the sensor.
    fn zero(&self) -> Result<(), ChildError>;
    /// Sets mass, kg, and centre in the flange, m.
    fn set_payload(&self, mass: f64, centre: [f64; 3]) -> Result<(), ChildError>;
    /// Sets the tip in the flange.
    fn set_tool(&self, tool: [f64; 6]) -> Result<(), ChildError>;
    /// The controller's tip in the flange.
    fn tool(&self) -> Result<[f64; 6], ChildError>;
    /// Sets the compliance of force mode.
    fn set_force_mode(&self, damping: f64, gain: f64) -> Result<(), ChildError>;
    /// Has the controller stop at a lower rate of signs of life.
    fn set_watchdog(&self, least_hz: f64) -> Result<(), ChildError>;
    /// Feeds the watchdog.
    fn feed(&self) -> Result<(), ChildError>;
    /// Ends the program of the controller.
    fn end_program(&self) -> Result<(), ChildError>;
    /// Lets time pass; the library continues meanwhile.
    fn wait(&self, clock: &Clock, time: Duration) {
        clock.sleep(time);
    }
}

/// `rtde_control`.
pub struct RtdeControl(Py<PyAny>);

impl RtdeControl {
    /// Clears the registers of commands, ends a running program, and uploads the library's program
    /// with the count of its cycles; no other thread can use Python in that time.
    pub fn connect(begin: &Begin) -> Result<Self, ChildError> {
        let (host, [major, minor]) = (begin.host.as_str(), begin.version);
        Python::attach(|py| {
            let scripts = made(py, "script_client", "ScriptClient", (host, major, minor))?;
            let script = scripts
                .call_method0("getScript")
                .and_then(|script| script.extract::<String>());
            let program = program::counting(&script.map_err(failed("getScript"))?)?;
            let arguments = (host, RATE_HZ, FLAGS, CAP_PORT, 0);
            let control = made(py, "rtde_control", "RTDEControlInterface", arguments)?;
            // the library reads a custom program only from a file
            let call = "setCustomScriptFile";
            let file = tempfile::NamedTempFile::new().and_then(|mut file| {
                file.write_all(program.as_bytes())?;
                Ok(file)
            });
            let file = file.map_err(|error| ChildError::Python {
                call,
                reason: error.to_string(),
            })?;
            control
                .call_method1(call, (file.path().to_string_lossy().as_ref(),))
                .map_err(failed(call))?;
            Ok(Self(control.unbind()))
        })
    }

    fn done(
        &self,
        call: &'static str,
        arguments: impl for<'py> PyCallArgs<'py>,
    ) -> Result<(), ChildError> {
        if self.call(call, arguments)? {
            return Ok(());
        }
        Err(ChildError::Python {
            call,
            reason: "it returned false".to_owned(),
        })
    }

    fn call(
        &self,
        name: &'static str,
        arguments: impl for<'py> PyCallArgs<'py>,
    ) -> Result<bool, ChildError> {
        Python::attach(|py| self.0.call_method1(py, name, arguments)?.extract(py))
            .map_err(failed(name))
    }
}

impl Control for RtdeControl {
    fn is_connected(&self) -> bool {
        self.call("isConnected", ()).unwrap_or(false)
    }

    fn is_running(&self) -> bool {
        self.call("isProgramRunning", ()).unwrap_or(false)
    }

    fn speed(&self, twist: [f64; 6], acceleration: f64) -> Result<(), ChildError> {
        // the time does not end the motion: it is the delay until the program on the controller
        // looks for the next velocity, and without one it first reaches this
        self.done("speedL", (twist.to_vec(), acceleration, PERIOD))
    }

    fn press(
        &self,
        frame: [f64; 6],
        force: f64,
        kind: i32,
        limits: [f64; 6],
    ) -> Result<(), ChildError> {
        let (along_z, wrench) = (vec![0, 0, 1, 0, 0, 0], vec![0.0, 0.0, force, 0.0, 0.0, 0.0]);
        self.done(
            "forceMode",
            (frame.to_vec(), along_z, wrench, kind, limits.to_vec()),
        )
    }

    fn end_press(&self) -> Result<(), ChildError> {
        self.done("forceModeStop", ())
    }

    fn hard_stop(&self, deceleration: f64) -> Result<(), ChildError> {
        self.done("speedStop", (deceleration,))
    }

    fn zero(&self) -> Result<(), ChildError> {
        self.done("zeroFtSensor", ())
    }

    fn set_payload(&self, mass: f64, centre: [f64; 3]) -> Result<(), ChildError> {
        self.done("setPayload", (mass, centre.to_vec()))
    }

    fn set_tool(&self, tool: [f64; 6]) -> Result<(), ChildError> {
        self.done("setTcp", (tool.to_vec(),))
    }

    fn tool(&self) -> Result<[f64; 6], ChildError> {
        let call = "getTCPOffset";
        Python::attach(|py| self.0.call_method0(py, call)?.extract(py)).map_err(failed(call))
    }

    fn set_force_mode(&self, damping: f64, gain: f64) -> Result<(), ChildError> {
        self.done("forceModeSetDamping", (damping,))?;
        self.done("forceModeSetGainScaling", (gain,))
    }

    fn set_watchdog(&self, least_hz: f64) -> Result<(), ChildError> {
        self.done("setWatchdog", (least_hz,))
    }

    fn feed(&self) -> Result<(), ChildError> {
        self.done("kickWatchdog", ())
    }

    fn end_program(&self) -> Result<(), ChildError> {
        self.call("stopScript", ()).map(drop)
    }
}
