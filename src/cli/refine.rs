//! `touchup refine`: a scan and a recording in, the refined mesh out.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};
use serde::Serialize;
use tracing::{debug, warn};

use super::doctor::refuse_unsound;
use super::error::UNSOUND;
use super::offsets::{ContactPoints, ScanOffset, WrenchOffset};
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::page::{on_page, parameters_of};
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::path_parameter::path;
use super::progress::WorkProgress;
use super::rates::{LiveSummary, Rates};
use super::recorded::RecordedFlags;
use super::told::{ToldFlags, ToldNumbers};
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::web::WebFlags;
use super::{
    CliError, Losses, by_reason, check_kept_by, check_place, counted, print_report, reported,
    require,
};
use crate::diagnose::{InputFinding, InputMonitor};
use crate::haptic::Refiner;
use crate::io::atomic::is_same_file;
use crate::io::mesh_file::{MeshFileError, MeshUnit, check_target};
use crate::io::recording::{StampSource, Topics};
use crate::live::{Latencies, LiveError, Quantiles};
use crate::mesh::{FaceTree, RepairReport, TriMesh};
use crate::reconstruct::CloudSummary;
use crate::refinement::{
    JudgedReplay, NOTHING_MOVES, RefinementInput, SampleTaker, TouchSource, reason_of_refusal,
};
use crate::replay::{Recording, Replayed, marker_filter};
#[cfg(any(feature = "ros", feature = "r2r"))]
use crate::ros::node::NodeEnd;
use crate::scan::{Scan, read_scan};
use crate::scene::{LeftOut, Memory, Mode, Scene, SceneCost};
use crate::session::{
    Outcome, OutcomePlaces, PatchSummary, SessionRecord, StrokeChanges, StrokeReplay,
    UncertaintySummary,
};
use crate::stylus::{ContactSample, MarkerCounts, Sample};
use crate::threads::Threads;

#[derive(Clone, Debug, Default, Args)]
pub(super) struct RefineArguments {
    /// The scan: PLY, STL or OBJ, or a point cloud: PLY, PCD, XYZ or E57; not needed when the scene
    /// names its file
    #[arg(long, value_name = "MESH", required_unless_present_any = ["resume", "scene"], default_value = "", value_parser = path_or_none())]
    scan: PathBuf,
    /// The touches: a ROS 2 recording, MCAP or SQLite, a file or a folder; a bag of ROS 1; or a
    /// table (CSV, log of a UR's RTDE)
    #[arg(long, value_name = "RECORDING", required_unless_present = "resume", default_value = "", value_parser = path_or_none())]
    bag: PathBuf,
    /// Output: the refined mesh as PLY, STL or OBJ, in the unit of the scan
    #[arg(long, value_name = "MESH", required_unless_present = "resume", default_value = "", value_parser = path_or_none())]
    out: PathBuf,
    /// Unit of the coordinates in the scan's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Names the parts and their parameters; the flags below override it
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    recorded: RecordedFlags,
    /// Which time of a message counts: that of its header, or when it was recorded, for headers
    /// without a usable one
    #[arg(long, value_name = "S", default_value = "header")]
    stamp: StampSource,
    #[command(flatten)]
    pub told: ToldFlags,
    /// The robust method, or the published one literally
    #[arg(long)]
    mode: Option<Mode>,
    /// Also estimates the rigid offset of the scan from the touched part; the scan is not moved
    #[arg(long)]
    registration: bool,
    /// Replays in real time with the patch beside it, as next to a stylus, and reports how far it
    /// is behind; the result is the same
    #[arg(long)]
    live: bool,
    /// With --live: the touching is shown on the operator's page while it is replayed, and what is
    /// undone there is left out
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[command(flatten)]
    web: WebFlags,
    /// Output: the features of the refined mesh, measured by the touches: JSON, or a table, .csv or
    /// .parquet
    #[arg(long, value_name = "FEATURES")]
    features_out: Option<PathBuf>,
    /// Output: the touches that features name: .csv or .parquet
    #[arg(long, value_name = "TOUCHES")]
    touches_out: Option<PathBuf>,
    /// Folder of a session of the node: takes scan, scene and touches from there, also after a
    /// crash, and writes refined.ply, features.json and touches.csv there unless they have places
    /// of their own
    #[arg(long, value_name = "SESSION", conflicts_with_all = ["scan", "bag", "scene", "mesh_unit", "wrench_topic", "pose_topic", "pose_frame", "markers_topic"])]
    resume: Option<PathBuf>,
    /// Refines also where something of the recording is surely wrong (`touchup doctor`)
    #[arg(long)]
    pub force: bool,
    /// The touches are on what the scan may lack, as a hole that it closed: how they lie on it is
    /// then a doubt and not sure
    #[arg(skip)]
    pub touches_flaws: bool,
    /// Strokes that were taken back, done again, taken out or put back in the session
    #[arg(skip)]
    strokes: StrokeChanges,
    /// Also prints timings, rejected samples and the stages built from the scene
    #[arg(long, short)]
    verbose: bool,
    /// Prints the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Takes a path that may be left out; empty: left out.
fn path_or_none() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

reported! {
    /// What `--json` prints; times in s, `push_ns` in ns.
    pub(super) struct RefineSummary, fn of(
        run: (SceneCost, [f64; 2], Option<LiveSummary>),
        replayed: &Replayed,
        pushes: Pushes,
        refiner: &Refiner,
        outcome: Outcome,
        input: (ToldNumbers, Vec<InputFinding>, Option<CloudSummary>),
        offsets: (Option<WrenchOffset>, Option<ScanOffset>)
    ) {
        /// stages built from the scene, those left out with the reason of each, and the memory at
        /// start
        scene: SceneCost = run.0,
        /// what was told of tip and scan, and by what
        told: ToldNumbers = input.0,
        /// how the scan came of a point cloud; not there where it is a mesh
        cloud?: CloudSummary = input.2,
        /// wrenches of the recording: each could be a sample
        samples: u64 = replayed.wrenches,
        /// those that the refiner took
        accepted: u64 = pushes.accepted - refiner.counts().outside_region,
        /// those that it refused, by reason; `pose_…` are lost poses and not samples
        refused: BTreeMap<String, u64> = pushes.refused,
        /// times that the stylus came into contact
        contacts: u64 = refiner.counts().contacts,
        /// of the markers, where they give the pose
        markers?: MarkerCounts = replayed.markers,
        /// how late the clock of the wrench reads beyond what the scene says, where the touches
        /// determine it and the scene has `clock`
        wrench_offset?: WrenchOffset = offsets.0,
        /// rigid offset of the scan from the part, with --registration
        registration?: ScanOffset = offsets.1,
        /// what is doubtful about the recording, the surest first (`touchup doctor`)
        findings: Vec<InputFinding> = input.1,
        /// faces that are not where the scan had them
        moved_faces: u64 = outcome.moved_faces,
        /// updates made smaller because a face would have folded
        cut_back: u64 = refiner.counts().cut_back,
        /// of the ball on the part; `null` when it never slid far enough
        friction: Option<FrictionFound> = refiner.friction().map(|found| FrictionFound { mu: found.mu, sigma: found.sigma }),
        /// of one sample through the whole chain
        push_ns: Quantiles = pushes.latencies.quantiles(),
        load_s: f64 = run.1[0],
        replay_s: f64 = run.1[1],
        /// of the patch beside the samples, with --live
        live?: LiveSummary = run.2,
        /// the reconstructed faces; `null` where `patch` is off, or nothing was touched
        patch: Option<PatchSummary> = outcome.patch,
        /// how well that is known; not there where `uncertainty` is off
        uncertainty?: UncertaintySummary = outcome.uncertainty,
    }
}

/// Coefficient of kinetic friction and its standard error.
#[derive(Debug, Serialize)]
struct FrictionFound {
    mu: f64,
    sigma: f64,
}

/// Result of refining a scan.
pub(super) struct Refined {
    /// repairs of the scan's file
    repair: RepairReport,
    pub summary: RefineSummary,
    pub losses: Losses,
}

const NO_SCAN: &str =
    "there is no scan to refine: name it by --scan, or as `scan: { file: … }` in the scene";

const NO_PATCH: &str = "--live lets the patch follow, and the scene has none: take `patch: off` or `mode: paper` out of it";

/// The command: refines, and prints the result.
pub(super) fn refine(arguments: &RefineArguments) -> Result<Losses, CliError> {
    let arguments = arguments.clone().completed()?;
    #[cfg(any(feature = "ros", feature = "r2r"))]
    let arguments = arguments.after_the_page()?;
    let Refined {
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

/// Counts and times of the samples.
#[derive(Default)]
struct Pushes {
    accepted: u64,
    refused: BTreeMap<String, u64>,
    latencies: Latencies,
}

impl Pushes {
    fn push(&mut self, rates: &mut Rates, sample: &Sample) {
        let (pushed, time) = rates.push(sample);
        self.latencies.record(time);
        match pushed {
            Ok(()) => self.accepted += 1,
            Err(error) => {
                *self
                    .refused
                    .entry(reason_of_refusal(&LiveError::Refine(error)).to_owned())
                    .or_default() += 1
            }
        }
    }
}

/// Gives samples to both rates, as the strokes of a session and the clock have them.
struct RateTaker {
    rates: Rates,
    pushes: Pushes,
    strokes: StrokeReplay,
    /// samples of strokes that were taken out
    taken_out: u64,
    /// for the registration
    contacts: Option<ContactPoints>,
}

impl SampleTaker for RateTaker {
    fn take(&mut self, sample: &Sample) -> bool {
        self.rates
            .change_strokes(&mut self.strokes, sample.stamp_ns);
        if !self.strokes.takes(sample.stamp_ns) {
            self.taken_out += 1;
            return false;
        }
        self.pushes.push(&mut self.rates, sample);
        true
    }

    fn refiner(&self) -> &Refiner {
        self.rates.engine.refiner()
    }

    fn observe(&mut self, contact: &ContactSample) {
        if let Some(contacts) = &mut self.contacts {
            contacts.push(contact);
        }
    }
}

impl RefineArguments {
    /// Writes refined.ply, features.json and touches.csv into a folder.
    pub(super) fn in_folder(
        scan: PathBuf,
        mesh_unit: MeshUnit,
        bag: PathBuf,
        folder: &Path,
        scene: Option<PathBuf>,
        topics: Topics,
    ) -> Self {
        let out = folder.join("refined.ply");
        let [features_out, touches_out] =
            ["features.json", "touches.csv"].map(|name| Some(folder.join(name)));
        let files = Self {
            scan,
            bag,
            out,
            mesh_unit,
            scene,
            features_out,
            touches_out,
            ..Self::default()
        };
        Self {
            recorded: topics.into(),
            ..files
        }
    }

    /// With what the session to be resumed, or the scene, names in place of flags.
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
            (self.bag, self.recorded) = (recording, topics.into());
            self.strokes = strokes;
            if self.out.as_os_str().is_empty() {
                self.out = session.join("refined.ply");
            }
            self.features_out
                .get_or_insert_with(|| session.join("features.json"));
            self.touches_out
                .get_or_insert_with(|| session.join("touches.csv"));
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

    /// What is left to be refined when the page was closed: the session that was made on it,
    /// without what was undone there.
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[expect(clippy::too_many_lines)]
    fn after_the_page(self) -> Result<Self, CliError> {
        if !self.web.is_wanted() {
            return Ok(self);
        }
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
        )?;
        let (scene, _) = self.scene()?;
        self.check_out()?;
        let markers = marker_filter(&scene, self.recorded.markers_topic.as_deref())?;
        let recording = Recording::open(&self.bag, self.recorded.layout(&scene), self.stamp)?;
        let folder = self.out.parent().unwrap_or(Path::new("")).join("sessions");
        let mut parameters = parameters_of(&self.scan, self.mesh_unit, &folder)?;
        // files that the scene names are relative to its folder
        let beside = self
            .scene
            .as_deref()
            .and_then(Path::parent)
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
            ..session
        }
        .completed()
    }

    /// Reads, replays and writes.
    #[expect(clippy::too_many_lines)]
    pub(super) fn refined(&self) -> Result<Refined, CliError> {
        let (scene, told) = self.scene()?;
        self.check_out()?;
        let started = Instant::now();
        let Scan {
            mesh,
            repair,
            cloud,
        } = read_scan(&self.scan, self.mesh_unit)?;
        let input = RefinementInput::new(scene, mesh)?;
        let markers = marker_filter(&input.scene, self.recorded.markers_topic.as_deref())?;
        let recording = Recording::open(&self.bag, self.recorded.layout(&input.scene), self.stamp)?;
        let settings = input.settings(recording.wrench_frame);
        let (params, patch) = settings.ok_or_else(|| CliError::usage(NOTHING_MOVES))?;
        require(patch.is_some() || !self.live, NO_PATCH)?;
        let mut rates = Rates::new(input.scan.clone(), params, patch, self.live)?;
        if self.strokes.has_exchanges() {
            rates.engine.keep_strokes();
        }
        let load_s = started.elapsed().as_secs_f64();
        let RefinementInput {
            scene,
            scan: as_scanned,
            cut,
        } = &input;
        let cost = self.cost(scene, &rates, as_scanned.bytes() + cut.bytes());

        let started = Instant::now();
        let mut progress = WorkProgress::new("replay", recording.message_count());
        let contacts = self
            .registration
            .then(|| ContactPoints::new(&params))
            .transpose()?;
        let mut taker = RateTaker {
            rates,
            pushes: Pushes::default(),
            strokes: self.strokes.replay(),
            taken_out: 0,
            contacts,
        };
        let touches = TouchSource::Recorded {
            recording: Box::new(recording),
            markers: markers.map(Box::new),
        };
        let judged = input.replay(touches, &params, &mut taker, &mut || progress.step())?;
        let JudgedReplay {
            mut replayed,
            monitor,
        } = judged;
        let RateTaker {
            mut rates,
            mut pushes,
            mut strokes,
            taken_out,
            contacts,
        } = taker;
        rates.change_strokes(&mut strokes, i64::MAX);
        let tree = FaceTree::new_by(as_scanned, &Threads);
        let findings = self.doubt(&monitor, as_scanned, &tree, pushes.accepted)?;
        let registration =
            contacts.map(|contacts| ScanOffset::of(contacts.registrar.estimate(as_scanned, &tree)));
        drop(tree);
        let (mut ended, live) = rates.finish()?;
        let replay_s = started.elapsed().as_secs_f64();
        let stage = WorkProgress::stage("reconstruct");
        let patcher = ended
            .patcher
            .take()
            .filter(|_| ended.refiner.counts().contacts > 0);
        if let Some(patcher) = patcher.as_ref().filter(|_| !self.force) {
            patcher.check_extent()?;
        }
        let places = OutcomePlaces {
            mesh: &self.out,
            unit: self.mesh_unit,
            scan: &self.scan,
            features: self.features_out.as_deref(),
            touches: self.touches_out.as_deref(),
            outside: cut.outside.as_ref(),
            must_change: !self.force,
        };
        let outcome = match patcher {
            Some(patcher) => places.write_patched(as_scanned, patcher)?,
            None => places.write_moved(as_scanned, &ended.mesh())?,
        };
        drop(stage);
        replayed.losses.extend(outcome.loss());
        let counts = ended.refiner.counts();
        debug!(?counts, "replayed");
        pushes.refused.extend(std::mem::take(&mut replayed.refused));
        if counts.outside_region > 0 {
            pushes
                .refused
                .insert("outside_region".to_owned(), counts.outside_region);
        }
        if taken_out > 0 {
            pushes.refused.insert("taken_out".to_owned(), taken_out);
        }
        let wrench_offset = monitor
            .clock_offset()
            .filter(|_| scene.clock.is_some())
            .map(|found| WrenchOffset::of(&found, &scene.sync_params()));
        let (run, input) = ((cost, [load_s, replay_s], live), (told, findings, cloud));
        let offsets = (wrench_offset, registration);
        let summary = RefineSummary::of(
            run,
            &replayed,
            pushes,
            &ended.refiner,
            outcome,
            input,
            offsets,
        );
        Ok(Refined {
            repair,
            summary,
            losses: replayed.losses,
        })
    }

    /// Warns of what is doubtful, and refuses what is surely wrong before anything is written.
    fn doubt(
        &self,
        monitor: &InputMonitor,
        scan: &TriMesh,
        tree: &FaceTree,
        accepted: u64,
    ) -> Result<Vec<InputFinding>, CliError> {
        let mut findings = monitor.findings(scan, tree);
        if self.touches_flaws {
            let off_the_scan = findings
                .iter_mut()
                .filter(|finding| finding.cause.is_read_off_the_scan());
            off_the_scan.for_each(|finding| finding.is_sure = false);
            findings.sort_by_key(|finding| !finding.is_sure);
        }
        if !self.force {
            refuse_unsound(&findings, &self.scan, &self.bag)?;
            if accepted == 0 {
                let why = format!("{}: no sample of it could be used", self.bag.display());
                return Err(CliError::new(UNSOUND, why, None));
            }
        }
        findings.iter().for_each(|finding| warn!("{finding}"));
        Ok(findings)
    }

    /// The stages built from the scene for these samples.
    fn cost(&self, scene: &Scene, rates: &Rates, scan_bytes: usize) -> SceneCost {
        let unused = [
            LeftOut {
                part: "robot",
                reason: "a replay moves no arm",
            },
            LeftOut {
                part: "markers",
                reason: "the recording is read for poses",
            },
        ];
        let unused = if self.recorded.markers_topic.is_some() {
            &unused[..1]
        } else {
            &unused
        };
        let memory = Memory::of(rates.engine.footprint(), scan_bytes + rates.scan_bytes());
        SceneCost {
            parts: scene.built(unused, &crate::FEATURES),
            memory,
        }
    }

    /// Checks that the result can be written before the work begins.
    fn check_out(&self) -> Result<(), CliError> {
        let out = self.out.display();
        check_target(&self.out).map_err(|error| match error {
            MeshFileError::UnknownFormat { .. } => {
                CliError::usage(format!("--out {out} must end in .ply, .stl or .obj"))
            }
            error => CliError::not_written(error),
        })?;
        let outputs = [
            ("--out", Some(&self.out)),
            ("--features-out", self.features_out.as_ref()),
            ("--touches-out", self.touches_out.as_ref()),
        ];
        let inputs = [
            ("--scan", Some(&self.scan)),
            ("--bag", Some(&self.bag)),
            ("--scene", self.scene.as_ref()),
        ];
        let [outputs, inputs] = [outputs, inputs].map(|files| {
            let named = files
                .into_iter()
                .filter_map(|(flag, path)| Some((flag, path?)));
            named.collect::<Vec<_>>()
        });
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

    /// The scene with the flags over it, and by what its numbers are told.
    fn scene(&self) -> Result<(Scene, ToldNumbers), CliError> {
        let (mut scene, told) = self.told.scene(self.scene.as_deref())?;
        if let Some(mode) = self.mode {
            scene.refine.get_or_insert_default().mode = mode;
        }
        Ok((scene, told))
    }
}

impl RefineSummary {
    /// The verdict in one sentence: the reconstructed or moved part and its uncertainty.
    fn verdict(&self) -> String {
        let faces = counted(self.moved_faces, "face", "faces");
        match (&self.patch, self.contacts) {
            (_, 0) if self.moved_faces > 0 => {
                format!("refined: contact was not told from free air, and {faces} moved")
            }
            (_, 0) => "unchanged: the stylus never came into contact with the scan".to_owned(),
            (Some(patch), _) => match &self.uncertainty {
                Some(uncertainty) => format!("refined: {patch}, {uncertainty}"),
                None => format!("refined: {patch}"),
            },
            (None, contacts) => {
                let times = counted(contacts, "time", "times");
                format!("refined: the stylus came into contact {times} and moved {faces}")
            }
        }
    }

    /// Counts of samples, timings, and the stages built from the scene.
    fn details(&self) -> String {
        let (read, accepted, refused) = (self.samples, self.accepted, by_reason(&self.refused));
        let Quantiles {
            median,
            p99,
            p999,
            max,
        } = self.push_ns;
        let mut lines = vec![
            format!("samples: {read} read, {accepted} accepted; refused: {refused}"),
            format!(
                "faces moved: {}; updates cut back: {}",
                self.moved_faces, self.cut_back
            ),
        ];
        lines.extend(
            self.patch
                .as_ref()
                .map(|patch| format!("reconstruction: {:.2} s", patch.build_s)),
        );
        lines.push(format!(
            "time of a sample: median {median} ns, p99 {p99} ns, p99.9 {p999} ns, max {max} ns"
        ));
        lines.push(format!(
            "loaded in {:.2} s, replayed in {:.2} s",
            self.load_s, self.replay_s
        ));
        lines.push(self.scene.to_string());
        lines.join("\n")
    }
}

/// The verdict, then further results.
impl fmt::Display for RefineSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.verdict(), self.told)?;
        let last_outlier = self
            .uncertainty
            .as_ref()
            .and_then(UncertaintySummary::last_outlier);
        last_outlier
            .iter()
            .try_for_each(|last| write!(f, "\n{last}"))?;
        let friction = &self.friction;
        friction
            .iter()
            .try_for_each(|FrictionFound { mu, sigma }| {
                write!(f, "\nfriction: {mu:.3} ± {sigma:.3}")
            })?;
        if let Some(MarkerCounts {
            held,
            coasting,
            lost,
            relabelled,
            rejected,
        }) = self.markers
        {
            write!(
                f,
                "\nmarker frames: {held} held the pose, {coasting} coasted, {lost} without a pose; markers: {relabelled} \
                 relabelled, {rejected} rejected"
            )?;
        }
        self.wrench_offset
            .iter()
            .try_for_each(|clock| write!(f, "\nclock: {clock}"))?;
        self.registration
            .iter()
            .try_for_each(|registration| write!(f, "\nscan: {registration}"))?;
        self.live.iter().try_for_each(|live| write!(f, "\n{live}"))
    }
}
