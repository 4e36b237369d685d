//! `touchup refine`: a scan and a recording in, the refined mesh out.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};

#[cfg(any(feature = "ros", feature = "r2r"))]
use super::common::path_parameter::path;
use super::common::recorded::RecordingFlags;
use super::common::refinement::{RefinementFiles, RefinementResult, accepted_scene_beside};
use super::common::told::{ToldFlags, ToldScene};
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::common::web::WebFlags;
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::page::{on_page, parameters_of};
use super::{CliError, Losses, check_kept_by, check_place, print_report, require};
use touchup_io::atomic::is_same_file;
use touchup_io::mesh_file::{MeshFileError, MeshUnit, check_target};
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::node::NodeEnd;
use touchup_session::live::Pace;
use touchup_session::refinement::RefinementOptions;
use touchup_session::replay::RecordedAs;
use touchup_session::scene::{Mode, Scene, Setting};
use touchup_session::session::{ResultFiles, SessionRecord, StrokeChanges};

#[derive(Clone, Debug, Default, Args)]
pub(super) struct RefineArguments {
    /// Scan: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57); default: the scene's file
    #[arg(long, value_name = "MESH", required_unless_present_any = ["resume", "scene"], default_value = "", value_parser = path_or_none())]
    scan: PathBuf,
    /// Recording of the touches: MCAP or SQLite of ROS 2 (file or folder), bag of ROS 1, or table
    /// (CSV, log of a UR's RTDE)
    #[arg(long, value_name = "RECORDING", required_unless_present = "resume", default_value = "", value_parser = path_or_none())]
    bag: PathBuf,
    /// Output: the refined mesh as PLY, STL or OBJ, in the unit of the scan
    #[arg(long, value_name = "MESH", required_unless_present = "resume", default_value = "", value_parser = path_or_none())]
    out: PathBuf,
    /// Unit of the coordinates in the scan's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Scene with the parts and their parameters; the flags below override it
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    recorded: RecordingFlags,
    #[command(flatten)]
    told: ToldFlags,
    /// Rule of the haptic update
    #[arg(long)]
    mode: Option<Mode>,
    /// Also estimates the rigid offset of the scan from the touched part; does not move the scan
    #[arg(long)]
    registration: bool,
    /// Replays in real time, with the patch beside the samples as in a live session, and reports
    /// its delay; the result is the same
    #[arg(long)]
    live: bool,
    /// With --live: shows the replay on the operator page, and leaves out strokes undone there
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[command(flatten)]
    web: WebFlags,
    /// Output: features of the refined mesh, measured by the touches: JSON, or a table, .csv or
    /// .parquet
    #[arg(long, value_name = "FEATURES")]
    features_out: Option<PathBuf>,
    /// Output: touches, which the features refer to: .csv or .parquet
    #[arg(long, value_name = "TOUCHES")]
    touches_out: Option<PathBuf>,
    /// Output: the faces of the refined mesh as a STEP file (AP242) for CAD programs: planes,
    /// cylinders and cones, measured by the touches, trimmed where they meet
    #[arg(long, value_name = "STEP")]
    step: Option<PathBuf>,
    /// Session folder of the node, even after a crash: source of scan, scene and touches, and
    /// target of refined.ply, features.json and touches.csv unless flags give their paths
    #[arg(long, value_name = "SESSION", conflicts_with_all = ["scan", "bag", "scene", "mesh_unit", "wrench_topic", "pose_topic", "pose_frame", "markers_topic"])]
    resume: Option<PathBuf>,
    /// Takes off what the touches surely show (`touchup doctor`): a part that moved, a tip that
    /// bent, place and stiffness of the tip, delay of the wrench; writes accepted_scene.yaml beside
    /// the mesh
    #[arg(long, conflicts_with_all = ["live", "force"])]
    accept: bool,
    /// Refines despite sure findings in the recording (`touchup doctor`)
    #[arg(long)]
    force: bool,
    /// Undone, redone, removed and restored strokes of the session.
    #[arg(skip)]
    strokes: StrokeChanges,
    /// Also prints timings, rejected samples and the stages built from the scene
    #[arg(long, short)]
    verbose: bool,
    /// Prints the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Parser of an optional path; empty: missing.
fn path_or_none() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

const NO_SCAN: &str =
    "there is no scan to refine: name it by --scan, or as `scan: { file: … }` in the scene";

const NO_PATCH: &str = "--live lets the patch follow, and the scene has none: take `patch: off` or `mode: paper` out of it";

/// Runs `touchup refine`: refines, and prints the result.
pub(super) fn refine(arguments: &RefineArguments) -> Result<Losses, CliError> {
    let arguments = arguments.clone().completed()?;
    #[cfg(any(feature = "ros", feature = "r2r"))]
    let arguments = arguments.after_the_page()?;
    let RefinementResult {
        repair,
        summary,
        losses,
    } = arguments.refined()?;
    print_report(arguments.json, &summary, || {
        let details = if arguments.verbose {
            format!("\nscan file: {repair}\n{}", summary.details())
        } else {
            String::new()
        };
        format!("{summary}{details}\nwrote {}", arguments.out.display())
    })?;
    Ok(losses)
}

impl RefineArguments {
    /// Fills in values of the resumed session, or of the scene, for missing flags.
    fn completed(mut self) -> Result<Self, CliError> {
        if let Some(session) = self.resume.take() {
            let SessionRecord {
                scan,
                mesh_unit,
                scene,
                recording,
                topics,
                strokes,
            } = SessionRecord::open(&session)?;
            (self.scan, self.mesh_unit, self.scene) = (scan, mesh_unit, Some(scene));
            (self.bag, self.recorded.location) = (recording, topics.into());
            self.strokes = strokes;
            let there = ResultFiles::in_folder(&session);
            if self.out.as_os_str().is_empty() {
                self.out = there.mesh;
            }
            self.features_out = self.features_out.or(there.features);
            self.touches_out = self.touches_out.or(there.touches);
        } else if let Some(path) = self
            .scene
            .as_ref()
            .filter(|_| self.scan.as_os_str().is_empty())
        {
            let scan = Scene::read(path)?.scan_file(path);
            (self.scan, self.mesh_unit) = scan.ok_or_else(|| CliError::usage(NO_SCAN))?;
        }
        Ok(self)
    }

    /// Remaining refinement after the page closes: its session, without strokes undone there.
    #[cfg(any(feature = "ros", feature = "r2r"))]
    fn after_the_page(self) -> Result<Self, CliError> {
        if !self.web.is_wanted() {
            return Ok(self);
        }
        self.check_page()?;
        let scene = self.scene()?.scene;
        self.check_out()?;
        let (recording, markers) = self.recorded.open(&self.bag, &scene)?;
        let folder = self
            .out
            .parent()
            .unwrap_or(std::path::Path::new(""))
            .join("sessions");
        let mut parameters = parameters_of(&self.scan, self.mesh_unit, &folder)?;
        // file names in the scene are relative to its folder
        let beside = self
            .scene
            .as_deref()
            .and_then(std::path::Path::parent)
            .filter(|folder| !folder.as_os_str().is_empty());
        let mut files = tempfile::Builder::new();
        files.suffix(".yaml");
        let mut text =
            beside.map_or_else(|| files.tempfile(), |folder| files.tempfile_in(folder))?;
        std::io::Write::write_all(
            &mut text,
            self.told.scene_text(self.scene.as_deref())?.as_bytes(),
        )?;
        parameters
            .set("scene", &path(text.path())?)
            .map_err(CliError::usage)?;
        let NodeEnd { folder, .. } = on_page(&self.web, parameters, recording, markers)?;
        let Self {
            out,
            features_out,
            touches_out,
            step,
            registration,
            force,
            verbose,
            json,
            ..
        } = self;
        let session = Self {
            resume: Some(folder),
            out,
            registration,
            force,
            verbose,
            json,
            ..Self::default()
        };
        Self {
            features_out,
            touches_out,
            step,
            ..session
        }
        .completed()
    }

    /// Checks the flags against those of the page.
    #[cfg(any(feature = "ros", feature = "r2r"))]
    fn check_page(&self) -> Result<(), CliError> {
        require(
            self.live,
            "--web shows what is replayed in real time: say --live as well",
        )?;
        require(
            self.mode.is_none_or(|mode| mode == Mode::Robust),
            "--web shows the robust method alone",
        )?;
        require(
            self.strokes.is_empty(),
            "--web begins a session: resume the other one without it",
        )
    }

    /// Reads, replays and writes.
    fn refined(&self) -> Result<RefinementResult, CliError> {
        let told = self.scene()?;
        let scene = &told.scene;
        self.check_out()?;
        // a scene without an update has an error of its own
        let has_patch = scene.refine.is_none() || scene.patcher_params().is_some();
        require(has_patch || !self.live, NO_PATCH)?;
        let files = RefinementFiles {
            scan: self.scan.clone(),
            mesh_unit: self.mesh_unit,
            recording: self.bag.clone(),
            recorded: RecordedAs {
                stamp: Some(self.recorded.stamp.to_string()),
                ..self.recorded.location.clone()
            },
            out: ResultFiles {
                mesh: self.out.clone(),
                features: self.features_out.clone(),
                touches: self.touches_out.clone(),
                step: self.step.clone(),
            },
        };
        let options = RefinementOptions {
            live: self.live.then(Pace::default),
            strokes: self.strokes.clone(),
            registration: self.registration,
            force: self.force,
            ..RefinementOptions::default()
        };
        if self.accept {
            files.refine_accepting(&told, options)
        } else {
            files.refine(told.scene, told.numbers, options)
        }
    }

    /// Checks the outputs before the work begins.
    fn check_out(&self) -> Result<(), CliError> {
        let out = self.out.display();
        check_target(&self.out).map_err(|error| match error {
            MeshFileError::UnknownFormat { .. } => {
                CliError::usage(format!("--out {out} must end in .ply, .stl or .obj"))
            }
            error => CliError::not_written(error),
        })?;
        let accepted = self.accept.then(|| accepted_scene_beside(&self.out));
        let outputs = [
            ("--accept", accepted.as_ref()),
            ("--out", Some(&self.out)),
            ("--features-out", self.features_out.as_ref()),
            ("--touches-out", self.touches_out.as_ref()),
            ("--step", self.step.as_ref()),
        ];
        let inputs = [
            ("--scan", Some(&self.scan)),
            ("--bag", Some(&self.bag)),
            ("--scene", self.scene.as_ref()),
        ];
        let (outputs, inputs) = (named(outputs), named(inputs));
        for (at, (flag, out)) in outputs.iter().enumerate() {
            if let Some((other, _)) = outputs[..at]
                .iter()
                .find(|(_, other)| other == out || is_same_file(other, out))
            {
                let why = format!(
                    "{flag} and {other} would both write {}: choose another place",
                    out.display()
                );
                return Err(CliError::usage(why));
            }
            for (read, input) in &inputs {
                check_kept_by(flag, read, input, out)?;
            }
            check_place(out)?;
        }
        Ok(())
    }

    /// Scene with the flags over it, and the sources of its numbers.
    fn scene(&self) -> Result<ToldScene, CliError> {
        let (mut scene, numbers) = self.told.scene(self.scene.as_deref())?;
        let mut settings = self.told.settings();
        if let Some(mode) = self.mode {
            scene.refine.get_or_insert_default().mode = mode;
            settings.push(Setting::word("refine.mode", mode));
        }
        Ok(ToldScene {
            scene,
            numbers,
            path: self.scene.clone(),
            settings,
        })
    }
}

/// Files that are named, each with its flag.
fn named<'a, const N: usize>(
    files: [(&'static str, Option<&'a PathBuf>); N],
) -> Vec<(&'static str, &'a PathBuf)> {
    let named = files
        .into_iter()
        .filter_map(|(flag, path)| Some((flag, path?)));
    named.collect()
}
