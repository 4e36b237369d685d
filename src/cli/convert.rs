//! `touchup convert`: poses and wrenches of any recording as a recording for all verbs without
//! flags; features and touches as tables.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::common::progress::WorkProgress;
use super::common::recorded::RecordingFlags;
use super::{CliError, Losses, check_kept, check_outputs, check_place, counted, print_report};
use touchup_io::features_file::read_features;
use touchup_io::file_kind::FileKind;
use touchup_io::recording::{CopiedRecording, RecordingReader, Topics, copy_recording};
use touchup_io::result_table::{ResultTable, is_table};
use touchup_session::scene::Scene;

#[derive(Debug, Args)]
pub(super) struct ConvertArguments {
    /// Recording: MCAP or SQLite of ROS 2 (file or folder), bag of ROS 1, or table (CSV, log of a
    /// UR's RTDE); or features.json or touches.csv of touchup
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    /// Output: .mcap of a recording, with /stylus/pose and /stylus/wrench; .csv or .parquet of
    /// features or touches
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Names the columns of a table
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    recorded: RecordingFlags,
    /// Prints the counts as one JSON object
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct ConversionReport {
    /// Poses, or frames of markers.
    poses: u64,
    wrenches: u64,
    pose_frame: String,
    wrench_frame: String,
    /// For poses from transforms: poses with an interpolated transform, and stamps without
    /// coverage.
    #[serde(skip_serializing_if = "Option::is_none")]
    transforms: Option<TransformCounts>,
    out: PathBuf,
}

#[derive(Debug, Serialize)]
struct TransformCounts {
    interpolated: u64,
    outside: u64,
}

impl fmt::Display for ConversionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let frame = |name: &str| {
            if name.is_empty() {
                "a frame without a name".to_owned()
            } else {
                format!("{name:?}")
            }
        };
        let (poses, wrenches) = (
            counted(self.poses, "pose", "poses"),
            counted(self.wrenches, "wrench", "wrenches"),
        );
        let [pose_frame, wrench_frame] =
            [&self.pose_frame, &self.wrench_frame].map(|name| frame(name));
        writeln!(f, "{poses} in {pose_frame}, {wrenches} in {wrench_frame}")?;
        if let Some(TransformCounts {
            interpolated,
            outside,
        }) = self.transforms
        {
            writeln!(
                f,
                "{interpolated} of the poses between transforms; {outside} stamps outside of them"
            )?;
        }
        write!(f, "wrote {}", self.out.display())
    }
}

/// Runs `touchup convert`: reads, writes and counts.
pub(super) fn convert(arguments: &ConvertArguments) -> Result<Losses, CliError> {
    let ConvertArguments {
        input,
        out,
        scene,
        recorded: RecordingFlags { location, stamp },
        json,
    } = arguments;
    check_kept("INPUT", input, out)?;
    if is_table(out) {
        check_place(out)?;
        return convert_results(input, out, *json);
    }
    check_outputs(
        &[("--out", ".mcap", &Some(out.clone()))],
        &[Some(input)],
        "read: choose another place",
    )?;
    let scene = scene
        .as_deref()
        .map_or_else(|| Ok(Scene::default()), Scene::read)?;
    let layout = location.layout(&scene);
    let topics = Topics {
        markers: layout.topics.markers.clone(),
        ..Topics::default()
    };
    let mut reader = RecordingReader::open(input, layout)?.stamped_by(*stamp);
    let mut progress = WorkProgress::new("convert", reader.message_count());
    let copied = copy_recording(&mut reader, out, &topics, &mut || progress.step())?;
    let CopiedRecording {
        poses,
        wrenches,
        pose_frame,
        wrench_frame,
        damage,
    } = copied;
    let transforms = reader
        .transform_counts()
        .map(|[interpolated, outside]| TransformCounts {
            interpolated,
            outside,
        });
    let converted = ConversionReport {
        poses,
        wrenches,
        pose_frame,
        wrench_frame,
        transforms,
        out: out.clone(),
    };
    print_report(*json, &converted, || converted.to_string())?;
    let mut losses: Losses = damage.iter().map(ToString::to_string).collect();
    losses.extend(reader.losses());
    Ok(losses)
}

/// Output of `--json` for a table.
#[derive(Debug, Serialize)]
struct ConvertedTable {
    rows: usize,
    out: PathBuf,
}

/// Converts features if the input is JSON, else touches.
fn convert_results(input: &Path, out: &Path, json: bool) -> Result<Losses, CliError> {
    let table = match FileKind::of(input) == Some(FileKind::Json) {
        true => ResultTable::of_features(&read_features(input)?.features),
        false => ResultTable::of_touches_file(input)?,
    };
    table.write(out)?;
    let converted = ConvertedTable {
        rows: table.rows(),
        out: out.to_owned(),
    };
    print_report(json, &converted, || {
        format!(
            "{}\nwrote {}",
            counted(converted.rows as u64, "row", "rows"),
            out.display()
        )
    })?;
    Ok(Losses::new())
}
