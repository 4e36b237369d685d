//! Command line: one file for each verb.
//!
//! Results go to stdout, everything else to stderr. Exit codes, relied upon by other tools: 0 done,
//! 1 result not written, 2 wrong usage, 3 bad input file, 4 done with losses, which are named, 5
//! the arm stopped, 130 stopped by a signal. With `--json` an error is one object on stderr.

mod calibrate;
mod check;
mod common;
mod compare;
mod convert;
mod demo;
mod demo_robot;
mod disagree;
mod doctor;
mod features;
mod init;
mod inspect;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod node;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod page;
mod probe;
mod probing;
mod recover;
mod refine;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod replay;
mod report;
mod simulate;
mod simulated_world;
mod step;
mod sweep;
#[cfg(feature = "ur")]
mod ur;
mod whatif;

pub use common::error::CliError;
pub use compare::comparison_json;
pub use simulate::{ScannerKind, Side, Simulation, SimulationSettings};
pub use simulated_world::{OffFactor, world_named};
pub use sweep::plan_sweep;
pub use whatif::what_if_json;

use common::error::{
    Losses, asks_for_json, print_error, print_parse_error, require, require_positive,
};
use common::output::{
    by_reason, check_kept, check_kept_by, check_outputs, check_place, not_written, notify,
    print_report, print_result, write_json,
};

use std::ffi::OsString;
use std::io::{ErrorKind, stdin, stdout};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use touchup_geometry::numeric::counted;
use touchup_session::reported;
use tracing_subscriber::filter::{LevelFilter, Targets};

#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros::arguments::{log_level, split};

/// Repairs a 3D scan by touch.
#[derive(Debug, Parser)]
#[command(name = "touchup", version = touchup_io::machine::VERSION, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 result not written, 2 wrong usage, 3 bad input file, \
                          4 done with losses (named on stderr), 5 the arm stopped, 130 a signal stopped it";

const ARM_SIGNALS: &str = "\
Ctrl-C (or SIGTERM) stops the arm and retracts it; a second one stops it in place. The measurements made until then stay.

Exit codes: 0 all as asked, 1 no result, 2 wrong usage, 3 bad input file, 4 not found, or not within tolerance or gate (named on stderr), \
5 the arm stopped, 130 a signal stopped it.";

const STEP_FIELDS: &str = "\
In, one object per line: p_m, force_n, b_m, n (arrays of three), dt_s, h_min_m, delta, f_max_n, alpha_m_per_n_s,
beta_per_n2_s, step: lie|corrected|bounded|dp5, along: normal0|force. k_n_per_m instead of h_min_m, delta and f_max_n takes the
linear spring. Out, in the same order: {\"b_m\",\"n\"} with 17 digits, or {\"error\"}.";

#[cfg(any(feature = "ros", feature = "r2r"))]
const ROS_ARGUMENTS: &str = "\
Behind --ros-args: -p NAME:=VALUE, --params-file FILE, -r FROM:=TO, -r __ns:=/NAMESPACE, --log-level LEVEL. ROS_DOMAIN_ID and
ROS_AUTOMATIC_DISCOVERY_RANGE apply. Topics, services and parameters: docs/ros.md.";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Identifies parameters of the scene: pose of the scan, payload of the sensor, centre of the
    /// ball
    #[command(subcommand, after_help = ARM_SIGNALS)]
    Calibrate(calibrate::CalibrateArguments),
    /// Makes a plate, scans it badly, touches it and refines the scan: needs no input
    Demo(demo::DemoArguments),
    /// Measures the deviation of a mesh from the true part, in numbers and as a picture
    Compare(compare::CompareArguments),
    /// Converts any readable recording to MCAP, with poses and wrenches; features and touches to
    /// tables
    Convert(convert::ConvertArguments),
    /// Locates discrepancies between scan and touches, and names the cause: scanner, part or touch
    Disagree(disagree::DisagreeArguments),
    /// Checks a recording against its scan: force sign, axes, units, tare, time stamps, clocks,
    /// frames
    Doctor(doctor::DoctorArguments),
    /// Writes a scene with every key explained
    Init(init::InitArguments),
    /// Refines a scan by a recording of touches
    Refine(refine::RefineArguments),
    /// Detects and measures holes, slots, pockets, bosses, spheres, edges, corners and planes on a mesh
    Features(features::FeaturesArguments),
    /// Inspects measured features against a drawing: pass, fail or undecided, with a printable
    /// report
    Inspect(inspect::InspectArguments),
    /// Probes flagged features with an arm
    #[command(after_help = ARM_SIGNALS)]
    Probe(probe::ProbeArguments),
    /// Checks the repeatability of an arm on one spot
    #[command(after_help = ARM_SIGNALS)]
    Check(check::CheckArguments),
    /// Acknowledges the stop of an arm after inspection, so that it can move again; moves nothing
    Recover(recover::RecoverArguments),
    /// Scans and touches a known part: makes the input of refine
    Simulate(simulate::SimulateArguments),
    /// Refines many recordings with many settings: plans jobs, runs them, and tabulates the results
    #[command(subcommand)]
    Sweep(sweep::SweepArguments),
    /// Lists the differences between two results of a sweep beyond their ±
    Whatif(whatif::WhatIfArguments),
    /// Measures error against run time, stability and cost on this machine: runs `touchup-report`,
    /// a separate program
    #[command(disable_help_flag = true)]
    Report(report::HandedOver),
    /// Refines a scan live, as a ROS 2 node
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[command(after_help = ROS_ARGUMENTS)]
    Node(node::NodeArguments),
    /// Plays a recording on the topics of a node, in real time
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[command(after_help = ROS_ARGUMENTS)]
    Replay(replay::ReplayArguments),
    /// Answers one held sample per JSON line on stdin, for comparison with other implementations
    #[command(after_help = STEP_FIELDS)]
    Step,
    /// Prints the completion script of a shell: touchup completions bash >
    /// ~/.local/share/bash-completion/completions/touchup
    Completions {
        /// Name of the shell
        shell: clap_complete::Shell,
    },
    /// Prints a man page: touchup man | man -l -
    Man,
    /// Prepares this machine for a UR arm
    #[cfg(feature = "ur")]
    #[command(subcommand)]
    Ur(ur::UrArguments),
}

/// Runs the verb in `arguments`, after the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    exit_code(arguments).into()
}

/// As [`run`], with the exit code as a number, for other programs, as the Python package.
pub fn exit_code(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let (arguments, ros) = split(arguments);
    let as_json = asks_for_json(&arguments);
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => return print_parse_error(as_json, &error),
    };
    let ended = ros_arguments(&arguments.verb, ros).and_then(|ros| arguments.verb.run(&ros));
    match ended {
        Ok(losses) if losses.is_empty() => 0,
        Ok(losses) => {
            let message = format!("done with losses: {}", losses.join("; "));
            print_error(
                as_json,
                &CliError {
                    kind: "losses",
                    message,
                    hint: None,
                    exit_code: 4,
                },
            )
        }
        Err(error) => print_error(as_json, &error),
    }
}

impl Verb {
    fn run(&self, _ros: &[String]) -> Result<Losses, CliError> {
        match self {
            Self::Calibrate(arguments) => calibrate::calibrate(arguments),
            Self::Compare(arguments) => compare::compare(arguments),
            Self::Convert(arguments) => convert::convert(arguments),
            Self::Demo(arguments) => demo::demo(arguments),
            Self::Disagree(arguments) => disagree::disagree(arguments),
            Self::Doctor(arguments) => doctor::doctor(arguments),
            Self::Init(arguments) => init::init(arguments),
            Self::Refine(arguments) => refine::refine(arguments),
            Self::Features(arguments) => features::features(arguments),
            Self::Inspect(arguments) => inspect::inspect(arguments),
            Self::Probe(arguments) => probe::probe(arguments),
            Self::Check(arguments) => check::check(arguments),
            Self::Recover(arguments) => recover::recover(arguments),
            Self::Simulate(arguments) => simulate::simulate(arguments),
            Self::Sweep(arguments) => sweep::sweep(arguments),
            Self::Whatif(arguments) => whatif::what_if(arguments),
            Self::Report(arguments) => report::report(arguments),
            #[cfg(any(feature = "ros", feature = "r2r"))]
            Self::Node(arguments) => node::node(arguments, _ros),
            #[cfg(any(feature = "ros", feature = "r2r"))]
            Self::Replay(arguments) => replay::replay(arguments, _ros),
            Self::Step => answer_steps(),
            Self::Completions { shell } => {
                let mut script = Vec::new();
                clap_complete::generate(*shell, &mut Arguments::command(), "touchup", &mut script);
                print_result(String::from_utf8_lossy(&script).trim_end())?;
                Ok(Losses::new())
            }
            Self::Man => {
                let mut page = Vec::new();
                clap_mangen::Man::new(Arguments::command()).render(&mut page)?;
                print_result(String::from_utf8_lossy(&page).trim_end())?;
                Ok(Losses::new())
            }
            #[cfg(feature = "ur")]
            Self::Ur(arguments) => ur::ur(arguments),
        }
    }

    /// Whether the verb is a node.
    fn takes_ros_arguments(&self) -> bool {
        #[cfg(any(feature = "ros", feature = "r2r"))]
        return matches!(self, Self::Node(_) | Self::Replay(_));
        #[cfg(not(any(feature = "ros", feature = "r2r")))]
        false
    }
}

/// Arguments behind `--ros-args`, for verbs that accept them.
fn ros_arguments(verb: &Verb, given: Vec<OsString>) -> Result<Vec<String>, CliError> {
    let is_allowed = given.is_empty() || verb.takes_ros_arguments();
    require(is_allowed, "--ros-args is for the verbs node and replay")?;
    let not_text = |word: OsString| {
        format!(
            "--ros-args … {}: arguments of ROS are UTF-8",
            word.display()
        )
    };
    given
        .into_iter()
        .map(|word| {
            word.into_string()
                .map_err(|word| CliError::usage(not_text(word)))
        })
        .collect()
}

/// Default log filter: from `--log-level` behind `--ros-args`, else warnings.
pub fn log_filter(arguments: &[OsString]) -> Targets {
    let (_, ros) = split(arguments);
    // the last one counts
    let level = ros
        .iter()
        .rposition(|word| *word == "--log-level")
        .and_then(|at| ros.get(at + 1)?.to_str());
    let level = level
        .and_then(|level| log_level(level).ok()?.parse().ok())
        .unwrap_or(LevelFilter::WARN);
    // messages of libraries below do not concern the user; the last three complain at a node's end
    // about writers no longer in the graph, and about a group joined for each network but not left
    // for all at once; and about a topic that turns to the type of other publishers, which the node
    // reports
    let libraries = [
        ("ros2_client", LevelFilter::ERROR),
        // messages to /rosout are in the log already
        ("ros2_client::rosout", LevelFilter::OFF),
        // it takes every distribution but its own for a mismatch; the node checks
        ("ros2_client::distributions", LevelFilter::OFF),
        ("rustdds", LevelFilter::ERROR),
        ("rustdds::dds::pubsub", LevelFilter::OFF),
        ("rustdds::network::udp_listener", LevelFilter::OFF),
        ("rustdds::discovery::discovery_db", LevelFilter::OFF),
    ];
    Targets::new().with_default(level).with_targets(libraries)
}

/// Without ROS `--ros-args` is an unknown argument like any other.
#[cfg(not(any(feature = "ros", feature = "r2r")))]
fn split<T>(arguments: impl IntoIterator<Item = T>) -> (Vec<T>, Vec<T>) {
    (arguments.into_iter().collect(), Vec::new())
}

#[cfg(not(any(feature = "ros", feature = "r2r")))]
fn log_level(_: &str) -> Result<&'static str, ()> {
    Err(())
}

fn answer_steps() -> Result<Losses, CliError> {
    match step::run(stdin().lock(), stdout().lock()) {
        // a reader that has gone away wants no more answers
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(Losses::new()),
    }
}
