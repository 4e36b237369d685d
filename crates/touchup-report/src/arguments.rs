//! The command line of `touchup-report`: measures error against run time, stability and cost on
//! this machine, and writes page, plots and tables.

use std::io::{Write, stderr, stdout};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Instant, SystemTime};

use chrono::{DateTime, Utc};
use clap::{Parser, ValueEnum};
use itertools::Itertools;

use touchup_io::atomic::{create_folder, write_atomically};
use touchup_io::machine::{COMMIT, VERSION, describe_machine};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{StampSource, Topics};
use touchup_report::coverage::CoverageParams;
use touchup_report::document::Report;
use touchup_report::error::MeasureError;
use touchup_report::files::ReportError;
use touchup_report::mistakes::MistakesParams;
use touchup_report::whole_scan::GivenPart;
use touchup_report::work_precision::WorkPrecision;
use touchup_report::{
    Chapter, Effort, TableCell, convergence, cost, coverage, extremes, mistakes, stability,
    verdict, whole_scan,
};
use touchup_session::replay::{Recording, ReplayError, each_sample};
use touchup_session::scan::{ScanError, read_scan};
use touchup_session::scene::{Scene, SceneError};

use crate::environment::{PeersError, peers};

/// Reason for a missing report.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    #[error("{0}; see --help")]
    Usage(String),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    ReadMesh(#[from] ScanError),
    #[error(transparent)]
    Replay(#[from] ReplayError),
    #[error("cannot write {}: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(transparent)]
    Peers(#[from] PeersError),
    #[error(transparent)]
    WholeScan(MeasureError),
    #[error(transparent)]
    Cost(MeasureError),
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl CommandError {
    /// Exit codes as in `touchup`.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Write { .. } | Self::Report(_) | Self::Peers(_) | Self::Cost(_) => 1,
            Self::Usage(_) => 2,
            _ => 3,
        }
    }
}

const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 result not written, 2 wrong usage, 3 bad input file";

/// Measures error against run time, stability and cost on this machine, and writes page, plots and
/// tables
#[derive(Debug, Parser)]
#[command(name = "touchup-report", version = VERSION, after_help = EXIT_CODES)]
pub struct ReportArguments {
    /// Folder for report.html, report.json, and the SVG and CSV of each figure and table
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Measures less: under a minute
    #[arg(long)]
    quick: bool,
    /// Prints report.json instead of the verdict
    #[arg(long)]
    json: bool,
    /// Also measures Open3D, libigl, SciPy, trimesh and scikit-learn, installed from PyPI; takes
    /// some minutes
    #[arg(long)]
    peers: bool,
    /// Virtual environment for the peers, created if missing [default: peers-env in the folder of
    /// --out]
    #[arg(long, value_name = "DIR", requires = "peers")]
    peers_env: Option<PathBuf>,
    /// Scan to measure on beside the simulated ones: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD,
    /// XYZ, E57)
    #[arg(long, value_name = "MESH", requires_all = ["truth", "bag"])]
    scan: Option<PathBuf>,
    /// True part of the scan, in the frame of the scan
    #[arg(long, value_name = "MESH", requires = "scan")]
    truth: Option<PathBuf>,
    /// Recording of the touches on the scan: ROS 2, with the default topics
    #[arg(long, value_name = "RECORDING", requires = "scan")]
    bag: Option<PathBuf>,
    /// Unit of the coordinates of scan and truth
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Tip, sensor and frames of the recording
    #[arg(long, value_name = "YAML", requires = "scan")]
    scene: Option<PathBuf>,
    /// Seeds of the worlds of the coverage and mistakes chapters, first and last [default: 1-20 and
    /// 1-5, with --quick 1-1]
    #[arg(long, value_name = "A-B")]
    seeds: Option<Seeds>,
    /// Only these chapters
    #[arg(long, value_name = "CHAPTER", num_args = 1..)]
    only: Vec<ReportChapter>,
}

/// First and last seed.
#[derive(Clone, Debug)]
struct Seeds(RangeInclusive<u64>);

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        match (first.parse(), last.parse()) {
            (Ok(first), Ok(last)) if first <= last => Ok(Self(first..=last)),
            _ => Err(format!("{text} is no range of seeds: give 1-20, or 7")),
        }
    }
}

/// A chapter, selectable by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ReportChapter {
    /// Error against time and evaluations of each integrator, for one face
    WorkPrecision,
    /// Error against time of each method to refine whole scans, with two baselines
    WholeScan,
    /// Error after each sweep, and of one face over time
    Convergence,
    /// Stability limits of each integrator, and its behaviour at extremes
    Stability,
    /// Time, allocations and memory of each stage and part
    Cost,
    /// Errors of vertices and features over their stated uncertainties, in simulated worlds
    Coverage,
    /// Findings on wrong and on sound input, in simulated worlds
    Mistakes,
}

/// Measures the selected chapters, writes the report, and prints the verdict.
pub fn report(arguments: &ReportArguments) -> Result<(), CommandError> {
    let ReportArguments { out, json, .. } = arguments;
    let write_error = |path: &Path| {
        let path = path.to_owned();
        move |source| CommandError::Write { path, source }
    };
    if out.exists() && !out.is_dir() {
        return Err(CommandError::Usage(format!(
            "--out {} is a file: name a folder",
            out.display()
        )));
    }
    // before minutes of measuring
    create_folder(out).map_err(write_error(out))?;
    let mut report = Report {
        machine: describe_machine(),
        commit: COMMIT.to_owned(),
        command: command(),
        date: DateTime::<Utc>::from(SystemTime::now())
            .format("%Y-%m-%d %H:%M UTC")
            .to_string(),
        ..Report::default()
    };
    arguments.measure(&mut report, &mut lines_on_stderr())?;
    for file in report.files()? {
        let path = out.join(&file.name);
        write_atomically(&path, |to| to.write_all(&file.bytes)).map_err(write_error(&path))?;
    }
    let text = if *json {
        serde_json::to_string(&report).map_err(ReportError::from)?
    } else {
        let advice = report
            .advice
            .iter()
            .flat_map(|table| table.rows.iter().map(|row| advice_line(row)));
        let lines: Vec<String> = advice.chain(report.verdict.iter().cloned()).collect();
        format!(
            "{}\n\nwrote {}",
            lines.join("\n\n"),
            out.join("report.html").display()
        )
    };
    // a closed pipe is no error here
    let _ = writeln!(stdout(), "{text}");
    Ok(())
}

/// "question: use this. Because …; cost …".
fn advice_line(row: &[TableCell]) -> String {
    let mut texts = row.iter().filter_map(|cell| match cell {
        TableCell::Text(text) if !text.is_empty() => Some(text),
        _ => None,
    });
    texts.join("\n  ")
}

impl ReportArguments {
    /// Adds every selected chapter, in the order of the page.
    fn measure(
        &self,
        report: &mut Report,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), CommandError> {
        let effort = Effort {
            is_quick: self.quick,
        };
        let is_wanted = |part| self.only.is_empty() || self.only.contains(&part);
        let given = self.given()?;
        // first, as they need software that may be missing: a failure then loses no measurement
        let environment = self.peers_env.clone();
        let environment = environment.unwrap_or_else(|| self.out.join("peers-env"));
        let peers = self.peers.then(|| peers(effort, &environment, progress));
        let peers = peers.transpose()?;
        let seeds = |default| self.seeds.as_ref().map_or(default, |seeds| seeds.0.clone());
        let mut add = |chapter: Chapter, verdict: Vec<String>| {
            report.chapters.push(chapter);
            report.verdict.extend(verdict);
        };
        if is_wanted(ReportChapter::WorkPrecision) {
            let measured = WorkPrecision::measure(effort, progress);
            add(measured.chapter(), measured.verdict());
        }
        let scans = is_wanted(ReportChapter::WholeScan)
            .then(|| whole_scan::whole_scan(effort, given.as_ref(), progress));
        let scans = scans.transpose().map_err(CommandError::WholeScan)?;
        if let Some(measured) = &scans {
            add(measured.chapter(), verdict::of_whole_scans(measured));
        }
        if is_wanted(ReportChapter::Convergence) {
            let measured = convergence::convergence(effort, progress);
            add(measured.chapter(), verdict::of_convergence(&measured));
        }
        let stability =
            is_wanted(ReportChapter::Stability).then(|| stability::stability(effort, progress));
        if let Some(measured) = &stability {
            add(measured.chapter(), verdict::of_stability(measured));
            progress("extremes");
            let measured = extremes::extremes();
            add(measured.chapter(), verdict::of_extremes(&measured));
        }
        let cost = is_wanted(ReportChapter::Cost).then(|| cost::cost(effort, progress));
        let cost = cost.transpose().map_err(CommandError::Cost)?;
        if let Some(measured) = &cost {
            add(measured.chapter(), verdict::of_cost(measured));
        }
        if is_wanted(ReportChapter::Coverage) {
            let mut params = CoverageParams::of(effort);
            params.seeds = seeds(params.seeds);
            let measured = coverage::coverage(params, progress);
            add(measured.chapter(), verdict::of_coverage(&measured));
        }
        if is_wanted(ReportChapter::Mistakes) {
            let mut params = MistakesParams::of(effort);
            params.seeds = seeds(params.seeds);
            let measured = mistakes::mistakes(params, progress);
            add(measured.chapter(), verdict::of_mistakes(&measured));
        }
        if let Some(measured) = peers {
            add(measured.chapter(), verdict::of_peers(&measured));
        }
        report.advice =
            scans.and_then(|scans| verdict::advice(&scans, stability.as_ref(), cost.as_ref()));
        Ok(())
    }

    /// The case from the user's files.
    fn given(&self) -> Result<Option<GivenPart>, CommandError> {
        let (Some(scan), Some(truth), Some(bag)) = (&self.scan, &self.truth, &self.bag) else {
            return Ok(None);
        };
        let scene = self
            .scene
            .as_deref()
            .map_or_else(|| Ok(Scene::default()), Scene::read)?;
        let recording = Recording::open(bag, &Topics::default(), StampSource::Header)
            .map_err(ReplayError::from)?;
        let no_refine =
            || CommandError::Usage("the scene says `refine: off`: take that out of it".to_owned());
        let params = scene
            .refine_params(recording.wrench_frame)
            .ok_or_else(no_refine)?;
        let mut samples = Vec::new();
        each_sample(
            recording,
            scene.placement(),
            scene.sync_params(),
            None,
            &mut || {},
            &mut |_| (),
            |sample| samples.push(*sample),
        )?;
        Ok(Some(GivenPart {
            name: scan
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            scan: read_scan(scan, self.mesh_unit)?.mesh,
            truth: read_scan(truth, self.mesh_unit)?.mesh,
            samples,
            tip: params.tip,
            compensator: params.compensator,
            scan_noise: params.scan_noise,
        }))
    }
}

/// Prints a line with the elapsed time for each longer piece of work.
fn lines_on_stderr() -> impl FnMut(&str) {
    let started = Instant::now();
    move |what| {
        let _ = writeln!(
            stderr(),
            "{:>6.1} s  {what}",
            started.elapsed().as_secs_f64()
        );
    }
}

/// The command line for a repeated call.
fn command() -> String {
    let arguments = std::env::args_os().skip(1);
    let arguments = arguments.map(|word| word.to_string_lossy().into_owned());
    let arguments = arguments.filter(|word| word != "--json");
    std::iter::once("touchup-report".to_owned())
        .chain(arguments)
        .join(" ")
}
