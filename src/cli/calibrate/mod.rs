//! `touchup calibrate`: parameters of scan, sensor and tip, identified and written into the scene.

mod payload;
mod payload_by_arm;
mod scan;
mod stiffness;
mod tip;
mod tip_by_arm;

use std::fmt::{self, Display};
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::progress::WorkProgress;
use super::{CliError, Losses, check_kept, not_written, print_report};
use crate::calibrate::VectorEstimate;
use crate::io::atomic::write_atomically;
use crate::io::recording::Topics;
use crate::replay::{Recording, Replayed, each_sample, marker_filter};
use crate::scene::{Scene, Setting};
use crate::stylus::{Placement, Sample};

#[derive(Debug, Subcommand)]
pub(super) enum CalibrateArguments {
    /// Where the scan lies in the frame of the recorded poses, from points picked on both
    Scan(scan::ScanArguments),
    /// Weight, centre of mass and bias of the sensor, from static segments in free air: of a recording, or of an arm
    Payload(payload::PayloadArguments),
    /// The centre of the ball: in the tracked stylus, from a swing about it; in the flange of an arm, from touches of one spot
    Tip(tip::TipArguments),
    /// Compliance of arm and probe, from presses of an arm on one spot
    Stiffness(stiffness::StiffnessArguments),
}

/// The verb.
pub(super) fn calibrate(arguments: &CalibrateArguments) -> Result<Losses, CliError> {
    match arguments {
        CalibrateArguments::Scan(arguments) => scan::scan(arguments),
        CalibrateArguments::Payload(arguments) => payload::payload(arguments),
        CalibrateArguments::Tip(arguments) => tip::tip(arguments),
        CalibrateArguments::Stiffness(arguments) => stiffness::stiffness(arguments),
    }
}

/// Error of a calibration with an arm but without a scene.
const NO_SCENE: &str = "--scene is needed: it has the pose of the arm's base and the volume that it must never leave";

/// Where the result goes, and how it is printed.
#[derive(Debug, Args)]
struct CalibrationTarget {
    /// The scene to put the result into: all else in it stays as written. Default: a new file
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    /// Where the scene goes; may be the one that --scene names
    #[arg(long, value_name = "YAML")]
    out: PathBuf,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// A scene with its text.
struct DraftScene {
    text: String,
    /// what the text says
    scene: Scene,
}

impl DraftScene {
    /// The settings by which a recording is read: those of the scene, or the default ones where there is none.
    fn reading(&self) -> Scene {
        if self.text.is_empty() { Scene::default() } else { self.scene.clone() }
    }
}

impl CalibrationTarget {
    /// Refuses to write over `input`, and reads the scene.
    fn open(&self, flag: &str, input: &Path) -> Result<DraftScene, CliError> {
        check_kept(flag, input, &self.out)?;
        self.open_scene()
    }

    /// Reads the scene.
    fn open_scene(&self) -> Result<DraftScene, CliError> {
        let Some(path) = &self.scene else {
            return Ok(DraftScene { text: String::new(), scene: Scene::from_yaml("{}")? });
        };
        let (scene, text) = Scene::read_with_text(path)?;
        Ok(DraftScene { text, scene })
    }

    /// Reads the scene, which a calibration with an arm needs, and returns its path too.
    fn open_for_arm(&self) -> Result<(&Path, DraftScene), CliError> {
        let scene = self.scene.as_deref().ok_or_else(|| CliError::Usage(NO_SCENE.to_owned()))?;
        Ok((scene, self.open_scene()?))
    }

    /// Puts `found` into the scene and prints what it was.
    fn write(&self, draft: &DraftScene, change: &Change, found: &(impl Serialize + Display)) -> Result<(), CliError> {
        let Change { settings, remark, expected } = change;
        let start = match draft.text.as_str() {
            "" => format!("{}\n", new_file(found)),
            text => text.to_owned(),
        };
        let text = Scene::edited(&start, settings, remark, expected)?;
        write_atomically(&self.out, |file| file.write_all(text.as_bytes())).map_err(not_written(&self.out))?;
        print_report(self.json, found, || format!("{found}\nwrote {}", self.out.display()));
        Ok(())
    }
}

/// The source of the result, as comments above it.
fn new_file(found: &impl Display) -> String {
    let lines = format!("Made by `touchup calibrate`; one section of a scene: put it into yours.\n\n{found}");
    lines.lines().map(|line| format!("# {line}").trim_end().to_owned()).collect::<Vec<_>>().join("\n")
}

/// The change of the scene by a calibration.
struct Change {
    settings: Vec<Setting>,
    /// its source, in one line
    remark: String,
    /// the scene with it
    expected: Scene,
}

/// A recording made for a calibration.
#[derive(Debug, Args)]
struct CalibrationRecording {
    /// geometry_msgs/WrenchStamped
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/wrench")]
    wrench_topic: String,
    /// geometry_msgs/PoseStamped
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/pose")]
    pose_topic: String,
    /// sensor_msgs/PointCloud2: the markers on the stylus, read in place of the pose; the scene says where they sit
    #[arg(long, value_name = "TOPIC", conflicts_with = "pose_topic")]
    markers_topic: Option<String>,
}

impl CalibrationRecording {
    fn open(&self, bag: &Path) -> Result<Recording, CliError> {
        let (pose, wrench) = (self.pose_topic.clone(), self.wrench_topic.clone());
        let topics = Topics { pose, wrench, markers: self.markers_topic.clone() };
        Recording::open(bag, &topics).map_err(CliError::ReadRecording)
    }

    /// Gives each sample to `each`, its pose in the frame of the recording: of the ball where the scene says where it
    /// is.
    fn replay(&self, recording: Recording, scene: &Scene, each: impl FnMut(&Sample)) -> Result<Replayed, CliError> {
        let markers = marker_filter(scene, self.markers_topic.as_deref())?;
        let placement = scene.placement().map(|placement| Placement { pose_wo: None, ..placement });
        let mut progress = WorkProgress::new("replay", recording.message_count());
        let mut at_each = || progress.step();
        Ok(each_sample(recording, placement, scene.sync_params(), markers, &mut at_each, each)?)
    }
}

/// A value of three components as JSON has it, and its standard uncertainty.
#[derive(Clone, Copy, Debug, Serialize)]
struct Vector {
    pub value: [f64; 3],
    std: [f64; 3],
}

impl Vector {
    /// - `unit`: how many of the unit are one of SI.
    fn of(known: &VectorEstimate, unit: f64) -> Self {
        Self { value: (known.value * unit).into(), std: (known.sigma * unit).into() }
    }
}

impl Display for Vector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(4);
        let pair = |(x, s): (&f64, &f64)| format!("{x:+.digits$} ± {s:.digits$}");
        f.write_str(&self.value.iter().zip(&self.std).map(pair).collect::<Vec<_>>().join(", "))
    }
}

/// As many digits as a scene needs: 1e-7 mm and 1e-10 of the other units are far below any noise.
fn rounded(x: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    // no negative zero in a file for people
    (x * scale).round() / scale + 0.0
}
