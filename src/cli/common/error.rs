//! End of a verb: the losses of completed work, or an error as one line of text or, with `--json`,
//! one JSON object.

use std::error::Error;
use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write, stderr};
use std::iter::successors;
use std::path::Path;

use serde::Serialize;

use touchup_io::features_file::FeaturesFileError;
use touchup_io::file_error::FileError;
use touchup_io::mesh_file::MeshFileError;
use touchup_io::nominal_file::NominalFileError;
use touchup_io::recording::RecordingError;
use touchup_io::result_table::ResultTableError;
use touchup_io::touches_file::TouchesFileError;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::node::NodeError;
use touchup_probing::execute::{Ending, PayloadProbeError, SpotError};
use touchup_probing::plan::ExploreError;
use touchup_session::calibration::CalibrationError;
use touchup_session::refinement::RefinementError;
use touchup_session::replay::ReplayError;
use touchup_session::scan::ScanError;
use touchup_session::scene::SceneError;
use touchup_session::session::{OutcomeError, StepFileError};
use touchup_session::sweep::{SweepError, WhatIfError};
use touchup_sim::SimError;

/// Losses of completed work; empty: none.
pub(in crate::cli) type Losses = Vec<String>;

/// Error of a command with an exit code other than 0, as in `--json`.
#[derive(Debug, Serialize)]
pub struct CliError {
    /// Category, such as `usage`, `scene`, `mesh`, `recording`, `not_written` or `losses`.
    pub kind: &'static str,
    /// Message with values and units.
    pub message: String,
    /// Remedy, unless in the message.
    pub hint: Option<&'static str>,
    /// Exit code, as in `touchup --help`.
    pub exit_code: u8,
}

/// Kind and exit code of a missing result.
const NOT_WRITTEN: (&str, u8) = ("not_written", 1);
/// Kind and exit code of an unusable input.
pub(in crate::cli) const UNSOUND: (&str, u8) = ("input", 3);
/// Kind and exit code of a stopped arm.
const STOPPED: (&str, u8) = ("stopped", 5);
/// Kind and exit code of arm work ended by a signal.
pub(in crate::cli) const INTERRUPTED: (&str, u8) = ("interrupted", 130);

impl CliError {
    /// - `cause`: error of a room, possibly due to a missing file.
    pub fn new(
        (kind, exit_code): (&'static str, u8),
        message: impl Display,
        cause: Option<&(dyn Error + 'static)>,
    ) -> Self {
        let causes = successors(cause.and_then(Error::source), |&cause| cause.source());
        let mut of_system = causes.filter_map(|cause| cause.downcast_ref::<io::Error>());
        let hint = match kind {
            "not_written" => {
                Some("check that the folder exists, may be written to and has space left")
            }
            _ if of_system.any(|cause| cause.kind() == ErrorKind::NotFound) => Some(
                "check the path: no file is there; a relative path begins at the present folder",
            ),
            "input" => Some(
                "touchup doctor SCAN RECORDING says more; --force writes a result all the same",
            ),
            "stopped" => Some(
                "look at the arm and at what is around it; a protective stop is released at its panel",
            ),
            "scene" => Some(
                "the page \"The scene\" of the documentation (docs/scene.md) lists every parameter with its unit and range",
            ),
            _ => None,
        };
        Self {
            kind,
            message: one_line(&message.to_string()),
            hint,
            exit_code,
        }
    }

    /// Well-formed flag with an impossible value.
    pub fn usage(why: impl Display) -> Self {
        Self::new(("usage", 2), format!("{why}; see --help"), None)
    }

    /// Write failure of a mesh or recording.
    pub fn not_written(error: impl Error + 'static) -> Self {
        Self::new(NOT_WRITTEN, &error, Some(&error))
    }

    /// Read failure of the true part, with its own unit flag.
    pub fn truth(error: ScanError) -> Self {
        Self::new(
            ("mesh", 3),
            error.to_string().replace("--mesh-unit", "--truth-unit"),
            Some(&error),
        )
    }

    /// Fault in a file of a calibration.
    pub fn calibration(path: &Path, error: impl Display) -> Self {
        Self::new(
            ("calibration", 3),
            format!("{}: {error}", path.display()),
            None,
        )
    }

    /// Failure of an arm or its work.
    pub fn arm(error: impl Display) -> Self {
        Self::new(("arm", 1), error, None)
    }

    /// Arm that stays stopped.
    #[cfg(feature = "ur")]
    pub fn stopped(error: impl Display) -> Self {
        Self::new(STOPPED, error, None)
    }

    /// Premature end of an arm's work.
    pub fn ended(ending: &Ending) -> Self {
        match ending {
            Ending::Cancelled(request) => {
                Self::new(INTERRUPTED, format_args!("interrupted: {request}"), None)
            }
            Ending::Stopped(_) => Self::new(STOPPED, ending, None),
            ending => Self::arm(ending),
        }
    }

    /// The same error with further information.
    pub fn with(self, more: impl Display) -> Self {
        Self {
            message: one_line(&format!("{}; {more}", self.message)),
            ..self
        }
    }

    /// Unplannable feature.
    pub fn plan(flag: u32, error: ExploreError) -> Self {
        Self::new(("plan", 2), format!("feature {flag}: {error}"), None)
    }
}

/// Refuses a command line unless `is_allowed`.
pub(in crate::cli) fn require(is_allowed: bool, why: impl Display) -> Result<(), CliError> {
    if is_allowed {
        Ok(())
    } else {
        Err(CliError::usage(why))
    }
}

/// Refuses a flag's value unless above 0.
pub(in crate::cli) fn require_positive(flag: &str, value: f64) -> Result<(), CliError> {
    require(
        value > 0.0 && value.is_finite(),
        format_args!("{flag} {value} must be above 0"),
    )
}

/// All words of `text` on one line.
fn one_line(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

/// Whether a command line, even a malformed one, asks for errors as JSON.
pub(in crate::cli) fn asks_for_json(arguments: &[OsString]) -> bool {
    arguments.iter().any(|word| word == "--json")
}

/// Prints an error as one line on stderr.
pub(in crate::cli) fn print_error(as_json: bool, error: &CliError) -> u8 {
    let json = || serde_json::to_string(error).expect("a number and texts alone cannot fail");
    let line = if as_json {
        json()
    } else {
        format!("touchup: {}", error.message)
    };
    // a closed pipe has no reader left
    let _ = writeln!(stderr(), "{line}");
    error.exit_code
}

/// Prints the error of malformed arguments, or the requested help or version (exit code 0).
pub(in crate::cli) fn print_parse_error(as_json: bool, error: &clap::Error) -> u8 {
    let exit_code = error.exit_code() as u8;
    if exit_code == 0 || !as_json {
        return match error.print() {
            Err(failed) if exit_code == 0 && failed.kind() != ErrorKind::BrokenPipe => {
                print_error(as_json, &failed.into())
            }
            _ => exit_code,
        };
    }
    let text = error.to_string();
    let message = text.split("\n\n").next().unwrap_or(&text);
    let message = one_line(message.trim_start_matches("error: "));
    let hint = Some("`touchup COMMAND --help` lists the flags of a command");
    print_error(
        as_json,
        &CliError {
            kind: "usage",
            message,
            hint,
            exit_code,
        },
    )
}

/// Errors of the rooms: kind and exit code of each, and the beginning of its message.
macro_rules! errors_of_rooms {
    ($($Error:ty => $kind_and_exit_code:expr, $before:literal;)*) => {$(
        impl From<$Error> for CliError {
            fn from(error: $Error) -> Self {
                let of_kind: fn(&$Error) -> (&'static str, u8) = $kind_and_exit_code;
                Self::new(of_kind(&error), format!(concat!($before, "{}"), error), Some(&error))
            }
        }
    )*};
}

errors_of_rooms! {
    SceneError => |error| if matches!(error, SceneError::NoRadius) { ("usage", 2) } else { ("scene", 3) }, "";
    // settings come from a scene file: flags are checked before
    touchup_method::stylus::SettingError => |_| ("scene", 3), "";
    MeshFileError => |error| match error {
        MeshFileError::File(FileError::Write { .. }) => NOT_WRITTEN,
        _ => ("mesh", 3),
    }, "";
    ScanError => |_| ("mesh", 3), "";
    touchup_geometry::mesh::MeshError => |_| ("mesh", 3), "";
    RecordingError => |error| match error {
        RecordingError::Write(_) | RecordingError::NotWritten(_) => NOT_WRITTEN,
        _ => ("recording", 3),
    }, "";
    touchup_session::session::SessionError => |_| ("session", 3), "";
    TouchesFileError => |error| match error {
        TouchesFileError::File(FileError::Write { .. }) => NOT_WRITTEN,
        _ => ("touches", 3),
    }, "";
    FeaturesFileError => |error| match error {
        FeaturesFileError::File(FileError::Write { .. }) => NOT_WRITTEN,
        _ => ("features", 3),
    }, "";
    ResultTableError => |_| NOT_WRITTEN, "";
    NominalFileError => |error| match error {
        NominalFileError::File(FileError::Write { .. }) => NOT_WRITTEN,
        _ => ("nominal", 3),
    }, "";
    OutcomeError => |error| match error {
        OutcomeError::WriteMesh(_) => NOT_WRITTEN,
        OutcomeError::ReadMesh(_) | OutcomeError::Mesh(_) => ("mesh", 3),
        OutcomeError::Unchanged | OutcomeError::Contradictory(_) => ("input", 3),
        OutcomeError::Table(_) => NOT_WRITTEN,
    }, "";
    StepFileError => |error| match error {
        StepFileError::Write(_) => NOT_WRITTEN,
        StepFileError::NoFace { .. } => ("input", 3),
    }, "";
    SimError => |error| match error {
        SimError::BadParameter { .. } | SimError::TooFine { .. } | SimError::TooCoarse { .. } => ("simulation", 2),
        _ => ("simulation", 3),
    }, "";
    touchup_method::haptic::RefineError => |_| ("refinement", 3), "the scan cannot be refined: ";
    touchup_session::live::LiveError => |_| ("refinement", 3), "";
    touchup_io::tables::table::TableError => |_| ("calibration", 3), "";
    touchup_features::align::IcpError => |_| ("alignment", 3), "the mesh cannot be aligned with the truth: ";
    touchup_features::align::FeaturesError => |_| ("alignment", 3), "";
    touchup_features::compare::CompareError => |_| ("comparison", 3), "the two cannot be compared: ";
    io::Error => |_| NOT_WRITTEN, "cannot read stdin or write stdout: ";
}

#[cfg(any(feature = "ros", feature = "r2r"))]
errors_of_rooms! {
    touchup_node::ros::arguments::ArgumentError => |_| ("usage", 2), "";
    touchup_node::ros::RosError => |_| ("ros", 1), "";
    NodeError => |error| match error {
        NodeError::NoScan | NodeError::RegionWithRobot => ("node", 2),
        NodeError::Scene(error) if matches!(**error, SceneError::NoRadius) => ("usage", 2),
        NodeError::Scene(_) | NodeError::Scan(_) | NodeError::Refinement(_) => ("node", 3),
        NodeError::Setting(_) | NodeError::Refine(_) | NodeError::Live(_) => ("node", 3),
        _ => ("node", 1),
    }, "";
}

#[cfg(feature = "web")]
errors_of_rooms! {
    touchup_node::page::WebError => |error| match error {
        touchup_node::page::WebError::Certificate { .. } | touchup_node::page::WebError::Setup(_) => ("web", 3),
        _ => ("web", 1),
    }, "";
}

#[cfg(feature = "ur")]
errors_of_rooms! {
    touchup_node::ur::SetupError => |_| ("arm", 1), "";
    touchup_node::ur::child::ChildError => |_| ("arm", 1), "";
}

impl From<SpotError> for CliError {
    fn from(error: SpotError) -> Self {
        if let SpotError::Ended(ending) = &error {
            Self::ended(ending)
        } else {
            Self::arm(error)
        }
    }
}

impl From<PayloadProbeError> for CliError {
    fn from(error: PayloadProbeError) -> Self {
        match &error {
            // in free air the arm does not retract
            PayloadProbeError::Ended(Ending::Cancelled(_)) => Self::new(
                INTERRUPTED,
                "interrupted: the arm stopped in free air",
                None,
            ),
            PayloadProbeError::Ended(ending) => Self::ended(ending),
            PayloadProbeError::TooFew { .. } => Self::arm(error),
        }
    }
}

impl From<CalibrationError> for CliError {
    fn from(error: CalibrationError) -> Self {
        match error {
            CalibrationError::Replay(error) => error.into(),
            CalibrationError::Setting(error) => error.into(),
            CalibrationError::Table(error) => error.into(),
            CalibrationError::PayloadOfArm(_) => Self::arm(error),
            error => Self::new(("calibration", 3), error, None),
        }
    }
}

impl From<SweepError> for CliError {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Scene(error) => error.into(),
            SweepError::Outcome(error) => (*error).into(),
            SweepError::Features(error) => error.into(),
            SweepError::Simulated(error) => error.into(),
            SweepError::File(error @ FileError::Write { .. }) => Self::not_written(error),
            SweepError::TooMany { .. } | SweepError::NoJob { .. } => {
                Self::new(("usage", 2), &error, None)
            }
            error => Self::new(("sweep", 3), &error, Some(&error)),
        }
    }
}

impl From<WhatIfError> for CliError {
    fn from(error: WhatIfError) -> Self {
        match error {
            WhatIfError::Result(error) => error.into(),
            WhatIfError::Mesh(error) => error.into(),
            WhatIfError::Compare(error) => error.into(),
            WhatIfError::OtherScan { .. } => Self::new(("usage", 2), &error, None),
            WhatIfError::Failed { .. } => Self::new(("sweep", 3), &error, None),
        }
    }
}

impl From<RefinementError> for CliError {
    fn from(error: RefinementError) -> Self {
        match error {
            RefinementError::Scene(error) => error.into(),
            RefinementError::Setting(error) => error.into(),
            RefinementError::Scan(error) => error.into(),
            RefinementError::RecordedAs(what) => Self::usage(what),
            RefinementError::Replay(error) => error.into(),
            RefinementError::Live(error) => error.into(),
            RefinementError::Outcome(error) => (*error).into(),
            RefinementError::NothingMoves => Self::new(("usage", 2), error, None),
            RefinementError::Unsound { .. } | RefinementError::NoSample { .. } => {
                Self::new(UNSOUND, error, None)
            }
        }
    }
}

impl From<ReplayError> for CliError {
    fn from(error: ReplayError) -> Self {
        match error {
            ReplayError::Markers(what) => Self::usage(what),
            ReplayError::Read(error) => error.into(),
            ReplayError::Known(error) => Self::new(("recording", 3), &error, Some(&error)),
            ReplayError::Setting(error) => error.into(),
        }
    }
}
