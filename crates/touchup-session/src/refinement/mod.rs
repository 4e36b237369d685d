//! Refines a scan by a recording, from first message to result: for `touchup refine`, `probe` and
//! `demo`, the Python package and sweeps.
//!
//! [`refine`] does all of it. [`Refinement`] takes samples one by one and shows the mesh in
//! between.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use nalgebra::Point3;

use crate::live::{
    Engine, EngineResult, EvidenceReplay, Gate, Latencies, LiveError, Pace, Renewal,
};
use crate::replay::{RecordedAs, Recording, ReplayError, ReplaySummary, each_sample};
use crate::scan::{Scan, ScanError, read_scan};
use crate::scene::{CutScan, RegionCut, Scene, SceneError};
use crate::session::{OutcomeError, RefinedMesh, StrokeChanges, StrokeReplay};
use crate::threads::Threads;
use touchup_features::diagnose::InputFinding;
use touchup_geometry::mesh::{FaceHit, FaceTree, RepairReport, TriMesh};
use touchup_io::mesh_file::MeshUnit;
use touchup_method::haptic::{
    Footprint, RefineCounts, RefineError, RefineParams, ScanRegion, Update,
};
use touchup_method::reconstruct::{CloudSummary, KnownSurface};
use touchup_method::stylus::{
    ContactSample, FrictionCoefficient, MarkerFilter, Message, Sample, SettingError, WrenchFrame,
};

mod accepted;
mod offsets;
mod pace;
mod summary;
mod watch;

pub use accepted::{AcceptedFinding, AcceptedScene};
pub use offsets::{ScanOffset, WrenchOffset};
pub use pace::LiveSummary;
pub use summary::RefinementSummary;

use offsets::ContactPoints;
use pace::RealTime;
use watch::InputWatch;

/// Room reserved for new faces beside the samples.
const ROOM: usize = 1 << 18;

/// Error of a refinement.
#[derive(Debug, thiserror::Error)]
pub enum RefinementError {
    /// The scene, or its region on this scan.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scene has no update.
    #[error("the scene says `refine: off`, so nothing would move the mesh: take that out of it")]
    NothingMoves,
    /// The scan.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// Inconsistent topics, frames and stamps.
    #[error("{0}")]
    RecordedAs(String),
    /// The recording.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The engine.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// A sure finding against the recording.
    #[error("{} on {}: {finding}", recording.display(), scan.display())]
    Unsound {
        /// name of the scan
        scan: PathBuf,
        /// name of the recording
        recording: PathBuf,
        /// the surest finding
        finding: Box<InputFinding>,
    },
    /// The refinement refused every sample.
    #[error("{}: no sample of it could be used", recording.display())]
    NoSample {
        /// name of the recording
        recording: PathBuf,
    },
    /// Making the result fails, or it equals the scan.
    #[error(transparent)]
    Outcome(Box<OutcomeError>),
}

impl From<OutcomeError> for RefinementError {
    fn from(error: OutcomeError) -> Self {
        Self::Outcome(error.into())
    }
}

/// Scene and scan.
#[derive(Clone, Debug)]
pub struct RefinementInput {
    /// read and checked
    pub scene: Scene,
    /// unrefined, without its untouchable part, with the tree over its faces; m, in O
    pub scan: Arc<(TriMesh, FaceTree)>,
    /// the cut-off part
    pub cut: RegionCut,
}

impl RefinementInput {
    /// Cuts the scan to the region of the scene.
    ///
    /// # Errors
    /// [`SceneError::EmptyRegion`]
    pub fn new(scene: Scene, scan: TriMesh) -> Result<Self, SceneError> {
        let CutScan { mesh, cut } = scene.cut(scan)?;
        let tree = FaceTree::new_by(&mesh, &Threads);
        Ok(Self {
            scene,
            scan: Arc::new((mesh, tree)),
            cut,
        })
    }

    /// Engine of this input, without touches.
    ///
    /// - `wrench_frame`: axes of the wrenches.
    /// - `beside`: schedule of the patch beside the samples; `None`: once, at the end.
    ///
    /// # Errors
    /// [`RefinementError::NothingMoves`], [`RefinementError::Live`].
    pub fn engine(
        &self,
        wrench_frame: WrenchFrame,
        beside: Option<(Pace, Gate)>,
    ) -> Result<Engine, RefinementError> {
        let patch = self.scene.patcher_params();
        let patch = patch.map(|params| self.cut.patcher_params(params));
        let renewal = match beside {
            Some((pace, gate)) => Renewal::Beside {
                scan: Arc::clone(&self.scan),
                pace,
                room: ROOM,
                gate,
            },
            None => Renewal::AtEnd,
        };
        let (mesh, params) = (self.scan.0.clone(), self.update_params(wrench_frame)?);
        Ok(Engine::new(mesh, params, patch, renewal)?)
    }

    /// Settings of the haptic update.
    fn update_params(&self, wrench_frame: WrenchFrame) -> Result<RefineParams, RefinementError> {
        let params = self.scene.refine_params(wrench_frame);
        let params = params.ok_or(RefinementError::NothingMoves)?;
        Ok(self.cut.refine_params(params))
    }

    /// Memory of the scan, bytes.
    pub fn bytes(&self) -> usize {
        self.scan.0.bytes() + self.scan.1.bytes() + self.cut.bytes()
    }
}

/// Open scan and recording of a refinement.
pub struct OpenedInput {
    /// scene and scan
    pub input: RefinementInput,
    /// repairs of the scan's file
    pub repair: RepairReport,
    /// reconstruction of the scan from a point cloud; `None` for a mesh
    pub cloud: Option<CloudSummary>,
    /// the touches
    pub recording: Recording,
    /// computes the poses of a recording of markers
    pub markers: Option<MarkerFilter>,
}

impl OpenedInput {
    /// Opens the files.
    ///
    /// - `mesh_unit`: unit of the coordinates in the scan's file.
    ///
    /// # Errors
    /// [`RefinementError::Scan`], [`RefinementError::Scene`], [`RefinementError::Replay`],
    /// [`RefinementError::RecordedAs`].
    pub fn open(
        scene: Scene,
        (scan, mesh_unit): (&Path, MeshUnit),
        (recording, recorded): (&Path, &RecordedAs),
    ) -> Result<Self, RefinementError> {
        let stamps = recorded
            .checked_stamps()
            .map_err(RefinementError::RecordedAs)?;
        let Scan {
            mesh,
            repair,
            cloud,
        } = read_scan(scan, mesh_unit)?;
        let input = RefinementInput::new(scene, mesh)?;
        let (recording, markers) = recorded.open(recording, &input.scene, stamps)?;
        Ok(Self {
            input,
            repair,
            cloud,
            recording,
            markers,
        })
    }
}

/// Names of scan and recording in messages.
#[derive(Clone, Copy, Debug)]
pub struct InputNames<'a> {
    /// file or description of the scan
    pub scan: &'a Path,
    /// file or description of the recording
    pub recording: &'a Path,
}

/// Options of a refinement.
#[derive(Clone, Debug, Default)]
pub struct RefinementOptions {
    /// pace of the patch beside samples in real time; `None`: as fast as possible, with the patch at
    /// the end
    pub live: Option<Pace>,
    /// undone, redone, excluded and restored strokes of a session
    pub strokes: StrokeChanges,
    /// whether to estimate the rigid offset of the scan from the touched part, without applying it
    pub registration: bool,
    /// whether to refine an unsound recording, and accept a result equal to the scan
    pub force: bool,
    /// whether touches lie at possible flaws of the scan, as at a hole that it closed: findings
    /// read off the scan are then not sure
    pub touches_flaws: bool,
}

/// A scan under refinement.
#[derive(Debug)]
pub struct Refinement {
    input: RefinementInput,
    options: RefinementOptions,
    stage: SampleConsumer,
    /// the touchable part of the scan
    region: Option<ScanRegion>,
    watch: InputWatch,
    strokes: StrokeReplay,
    real_time: Option<RealTime>,
    contact_points: Option<ContactPoints>,
    pushes: Latencies,
    accepted: u64,
    refused: BTreeMap<String, u64>,
    replayed: ReplaySummary,
    /// error before the last sample
    stopped: Option<LiveError>,
}

/// Consumer of the samples.
#[derive(Debug)]
enum SampleConsumer {
    /// each sample moves the mesh
    Moving(Box<Engine>),
    /// keeps contacts for the patch at the end, which replaces any haptic update
    Keeping {
        evidence: Box<EvidenceReplay>,
        counts: RefineCounts,
    },
}

/// A refined scan and the judgement of its recording.
#[derive(Debug)]
pub struct RefinedScan {
    /// mesh and touches
    pub mesh: RefinedMesh,
    /// counts, findings and numbers of the result
    pub summary: RefinementSummary,
    /// losses that a better recording would avoid
    pub losses: Vec<String>,
}

impl Refinement {
    /// Starts without touches.
    ///
    /// - `wrench_frame`: axes of the wrenches.
    ///
    /// # Errors
    /// [`RefinementError::NothingMoves`], [`RefinementError::Setting`], [`RefinementError::Live`].
    pub fn new(
        input: RefinementInput,
        wrench_frame: WrenchFrame,
        options: RefinementOptions,
    ) -> Result<Self, RefinementError> {
        let params = input.update_params(wrench_frame)?;
        let monitor = input.scene.input_monitor_params(wrench_frame);
        let watch = InputWatch::new(monitor, &params)?;
        let contact_points = options
            .registration
            .then(|| ContactPoints::new(&params))
            .transpose()?;
        let region = params.region;
        let beside = options.live.map(|pace| (pace, Gate::default()));
        let mut engine = input.engine(wrench_frame, beside)?;
        if options.strokes.has_exchanges() {
            engine.keep_strokes();
        }
        Ok(Self {
            stage: SampleConsumer::Moving(engine.into()),
            region,
            watch,
            strokes: options.strokes.replay(),
            real_time: options.live.map(|_| RealTime::default()),
            contact_points,
            pushes: Latencies::new(),
            accepted: 0,
            refused: BTreeMap::new(),
            replayed: ReplaySummary::default(),
            stopped: None,
            input,
            options,
        })
    }

    /// Scene and scan.
    pub fn input(&self) -> &RefinementInput {
        &self.input
    }

    /// The current mesh; the scan, if the patch at the end is the only result.
    pub fn mesh(&self) -> &TriMesh {
        match &self.stage {
            SampleConsumer::Moving(engine) => engine.mesh(),
            SampleConsumer::Keeping { .. } => &self.input.scan.0,
        }
    }

    /// Face of [`Self::mesh`] nearest to a place, within a reach (m).
    pub fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        match &self.stage {
            SampleConsumer::Moving(engine) => engine.refiner().closest_face(place, reach),
            SampleConsumer::Keeping { .. } => {
                let (scan, tree) = &*self.input.scan;
                tree.closest(scan, place, reach)
            }
        }
    }

    /// Sets whether [`Self::finish`] accepts an unsound recording, and a result equal to the scan.
    pub fn force(&mut self, force: bool) {
        self.options.force = force;
    }

    /// Counts of all samples.
    pub fn counts(&self) -> &RefineCounts {
        match &self.stage {
            SampleConsumer::Moving(engine) => engine.refiner().counts(),
            SampleConsumer::Keeping { counts, .. } => counts,
        }
    }

    /// Memory of the moving mesh.
    pub fn footprint(&self) -> Footprint {
        match &self.stage {
            SampleConsumer::Moving(engine) => engine.footprint(),
            SampleConsumer::Keeping { .. } => Footprint::default(),
        }
    }

    /// Takes the next sample; counts a refused one, which changes nothing.
    ///
    /// Returns its effect on the mesh; `None` after a replay of contacts, whose only result is the
    /// patch at the end.
    ///
    /// # Errors
    /// [`LiveError`] of a refused sample.
    #[inline]
    pub fn push(&mut self, sample: &Sample) -> Result<Option<Update>, LiveError> {
        self.replayed.wrenches += 1;
        let update = self.take(sample)?;
        self.watch.monitor.paired_message(sample.stamp_ns);
        Ok(update)
    }

    /// Takes all samples of a recording.
    ///
    /// - `markers`: computes the poses of a recording of markers.
    /// - `at_each`: called after each record, to show the progress.
    ///
    /// # Errors
    /// [`ReplayError`]
    pub fn replay(
        &mut self,
        recording: Recording,
        markers: Option<MarkerFilter>,
        at_each: &mut dyn FnMut(),
    ) -> Result<(), ReplayError> {
        let scene = &self.input.scene;
        let (placement, sync) = (scene.placement(), scene.sync_params());
        let radius = scene.tip_params().radius;
        let know = |known| self.stage.know(known);
        recording.known.of_tip(radius, know)?;
        let this = RefCell::new(self);
        let mut at_message = |message: &Message| this.borrow_mut().watch.monitor.message(message);
        let replayed = each_sample(
            recording,
            placement,
            sync,
            markers,
            at_each,
            &mut at_message,
            |sample| this.borrow_mut().replay_sample(sample),
        )?;
        this.into_inner().replayed = replayed;
        Ok(())
    }

    /// Takes a surface for known, as [`Engine::know`].
    ///
    /// # Errors
    /// Those of [`Engine::know`].
    pub fn know(&mut self, known: KnownSurface) -> Result<(), LiveError> {
        self.stage.know(known)
    }

    /// Takes a sample of a recording when due, unless the options exclude its stroke.
    fn replay_sample(&mut self, sample: &Sample) {
        self.exchange_strokes(sample.stamp_ns);
        if !self.strokes.takes(sample.stamp_ns) {
            return self.refuse("taken_out");
        }
        if let Some(real_time) = &mut self.real_time {
            real_time.wait_for(sample.stamp_ns);
        }
        let started = Instant::now();
        // `take` counts a refused sample
        let _ = self.take(sample);
        self.pushes.record(started.elapsed());
        match (&mut self.real_time, &self.stage) {
            (Some(real_time), SampleConsumer::Moving(engine)) => {
                real_time.note(sample.stamp_ns, engine.patched_until_ns());
            }
            _ => self.stage.keep_only_evidence(),
        }
    }

    fn take(&mut self, sample: &Sample) -> Result<Option<Update>, LiveError> {
        match self.stage.push(sample, self.region.as_ref()) {
            Ok(update) => {
                self.accepted += 1;
                let contact = self.watch.sample(sample, self.stage.contact());
                if let (Some(points), Some(contact)) = (&mut self.contact_points, contact) {
                    points.push(&contact);
                }
                Ok(update)
            }
            Err(error) => {
                if matches!(error, LiveError::Refine(_)) {
                    self.refuse(reason_of_refusal(&error));
                } else {
                    // no later sample changes the mesh
                    self.stopped.get_or_insert_with(|| error.clone());
                }
                Err(error)
            }
        }
    }

    #[cold]
    fn refuse(&mut self, reason: &str) {
        *self.refused.entry(reason.to_owned()).or_default() += 1;
    }

    /// Undoes and redoes strokes up to the sample of this stamp, ns.
    fn exchange_strokes(&mut self, before_ns: i64) {
        while let Some((_, is_undo)) = self.strokes.next_before(before_ns) {
            if let Err(error) = self.stage.exchange(is_undo) {
                self.stopped = Some(error);
            }
        }
    }

    /// Checks the recording, and reconstructs the touched surface.
    ///
    /// # Errors
    /// [`RefinementError`]
    pub fn finish(mut self, names: InputNames<'_>) -> Result<RefinedScan, RefinementError> {
        self.exchange_strokes(i64::MAX);
        let findings = self.checked_findings(names)?;
        if let Some(stopped) = self.stopped {
            return Err(stopped.into());
        }
        let RefinementInput { scene, scan, cut } = &self.input;
        let registration = self
            .contact_points
            .map(|points| ScanOffset::of(points.registrar.estimate(&scan.0, &scan.1)));
        let wrench_offset = self.watch.monitor.clock_offset();
        let wrench_offset = wrench_offset
            .filter(|_| scene.clock.is_some())
            .map(|found| WrenchOffset::of(&found, &scene.sync_params()));
        let EndOfSamples {
            result,
            counts,
            friction,
            live,
        } = self.stage.finish(self.real_time)?;
        let (outside, must_change) = (cut.outside.as_ref(), !self.options.force);
        if let EngineResult::Touched(patcher) = &result
            && must_change
        {
            patcher.check_extent()?;
        }
        let (mesh, outcome) = RefinedMesh::of(scan, result, outside, must_change)?;
        let mut replayed = self.replayed;
        replayed.losses.extend(outcome.loss());
        let mut refused = self.refused;
        refused.append(&mut replayed.refused);
        if counts.outside_region > 0 {
            refused.insert("outside_region".to_owned(), counts.outside_region);
        }
        tracing::debug!(?counts, "replayed");
        let summary = RefinementSummary {
            samples: replayed.wrenches,
            accepted: self.accepted - counts.outside_region,
            refused,
            contacts: counts.contacts,
            markers: replayed.markers,
            wrench_offset,
            registration,
            findings,
            cut_back: counts.cut_back,
            friction: friction.map(Into::into),
            push_ns: self.pushes.quantiles(),
            live,
            outcome,
        };
        Ok(RefinedScan {
            mesh,
            summary,
            losses: replayed.losses,
        })
    }

    /// The findings on the recording; refuses an unsound one.
    fn checked_findings(
        &self,
        names: InputNames<'_>,
    ) -> Result<Vec<InputFinding>, RefinementError> {
        let (scan, tree) = &*self.input.scan;
        let mut findings = self.watch.monitor.findings(scan, tree);
        if self.options.touches_flaws {
            findings
                .iter_mut()
                .filter(|finding| finding.cause.is_read_off_the_scan())
                .for_each(|finding| finding.is_sure = false);
            findings.sort_by_key(|finding| !finding.is_sure);
        }
        if !self.options.force {
            refuse_unsound(&findings, names)?;
            if self.accepted == 0 {
                let recording = names.recording.to_owned();
                return Err(RefinementError::NoSample { recording });
            }
        }
        Ok(findings)
    }
}

/// State after the last sample.
struct EndOfSamples {
    result: EngineResult,
    counts: RefineCounts,
    friction: Option<FrictionCoefficient>,
    live: Option<LiveSummary>,
}

impl SampleConsumer {
    fn push(
        &mut self,
        sample: &Sample,
        region: Option<&ScanRegion>,
    ) -> Result<Option<Update>, LiveError> {
        match self {
            Self::Moving(engine) => engine.push(sample).map(Some),
            Self::Keeping { evidence, counts } => {
                let contact = evidence.push(sample).map_err(RefineError::from)?;
                let is_outside = region.is_some_and(|of| !of.region.contains(&contact.ball.centre));
                counts.outside_region += u64::from(is_outside && contact.ball_contact.is_some());
                counts.contacts = evidence.contacts().contacts();
                Ok(None)
            }
        }
    }

    fn know(&mut self, known: KnownSurface) -> Result<(), LiveError> {
        match self {
            Self::Moving(engine) => engine.know(known),
            Self::Keeping { evidence, .. } => Ok(evidence.know(known)?),
        }
    }

    fn contact(&self) -> Option<&ContactSample> {
        match self {
            Self::Moving(engine) => engine.refiner().contacts().latest(),
            Self::Keeping { evidence, .. } => evidence.contacts().latest(),
        }
    }

    /// Stops the haptic update at the first contact if the patch at the end is the only result; its
    /// mesh is the result only of a recording without contact.
    fn keep_only_evidence(&mut self) {
        if let Self::Moving(engine) = self
            && let Some((evidence, counts)) = engine.touched_evidence()
        {
            let evidence = Box::new(evidence);
            *self = Self::Keeping { evidence, counts };
        }
    }

    fn exchange(&mut self, is_undo: bool) -> Result<(), LiveError> {
        match (self, is_undo) {
            (Self::Moving(engine), true) => _ = engine.undo()?,
            (Self::Moving(engine), false) => _ = engine.redo()?,
            (Self::Keeping { evidence, .. }, true) => _ = evidence.undo(),
            (Self::Keeping { evidence, .. }, false) => _ = evidence.redo(),
        }
        Ok(())
    }

    fn finish(self, real_time: Option<RealTime>) -> Result<EndOfSamples, LiveError> {
        let engine = match self {
            Self::Moving(engine) => engine,
            Self::Keeping { evidence, counts } => {
                let friction = evidence.contacts().friction();
                return Ok(EndOfSamples {
                    result: EngineResult::Touched(evidence.into_patcher().into()),
                    counts,
                    friction,
                    live: None,
                });
            }
        };
        let live_counts = engine.counts();
        let ended = engine.finish()?;
        Ok(EndOfSamples {
            counts: *ended.refiner.counts(),
            friction: ended.refiner.contacts().friction(),
            result: ended.into_result(),
            live: real_time.map(|real_time| LiveSummary::of(&real_time.behind, live_counts)),
        })
    }
}

/// Reason of a refused sample, one word. The synchroniser passes only checked samples, in order of
/// time, so a sample of a recording fails only for a step without a finite result.
pub fn reason_of_refusal(error: &LiveError) -> &'static str {
    match error {
        LiveError::Refine(RefineError::Sample(_)) => "sample",
        LiveError::Refine(RefineError::Setting(_) | RefineError::Dynamics(_)) => "dynamics",
        LiveError::Refine(RefineError::Mesh(_) | RefineError::NoSuchFace { .. }) => "mesh",
        _ => "stopped",
    }
}

/// Refines a scan by a recording.
///
/// - `markers`: computes the poses of a recording of markers.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`RefinementError`]
pub fn refine(
    input: RefinementInput,
    recording: Recording,
    markers: Option<MarkerFilter>,
    options: RefinementOptions,
    names: InputNames<'_>,
    at_each: &mut dyn FnMut(),
) -> Result<RefinedScan, RefinementError> {
    let mut refinement = Refinement::new(input, recording.wrench_frame, options)?;
    refinement.replay(recording, markers, at_each)?;
    refinement.finish(names)
}

/// Refuses an unsound input.
///
/// # Errors
/// [`RefinementError::Unsound`] with the first sure finding.
pub fn refuse_unsound(
    findings: &[InputFinding],
    names: InputNames<'_>,
) -> Result<(), RefinementError> {
    let Some(finding) = findings.iter().find(|finding| finding.is_sure) else {
        return Ok(());
    };
    let InputNames { scan, recording } = names;
    Err(RefinementError::Unsound {
        scan: scan.to_owned(),
        recording: recording.to_owned(),
        finding: Box::new(finding.clone()),
    })
}
