//! A scan refined by a recording from its first message to the result: the same steps for `touchup
//! refine`, the Python package and sweeps. [`refine`] does them all; who changes something in
//! between, as strokes or the rate of the samples, takes them one by one.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::live::{Engine, LiveError, Renewal};
use crate::replay::{Recording, ReplayError, Replayed, each_sample, each_sample_of};
use crate::scene::{CutScan, RegionCut, Scene, SceneError};
use crate::session::{OutcomeError, RefinedMesh};
use crate::threads::Threads;
use touchup_core::diagnose::{InputFinding, InputMonitor};
use touchup_core::haptic::{RefineCounts, RefineError, RefineParams, Refiner, Update};
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::reconstruct::PatcherParams;
use touchup_core::stylus::{
    ContactSample, FrictionCoefficient, MarkerFilter, Message, Sample, SettingError, WrenchFrame,
};

mod watch;

use watch::InputWatch;

/// What is said of a scene in which nothing moves the mesh.
pub const NOTHING_MOVES: &str =
    "the scene says `refine: off`, so nothing would move the mesh: take that out of it";

/// Why nothing came of a refinement.
#[derive(Debug, thiserror::Error)]
pub enum RefinementError {
    /// The scene, or its region on this scan.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scene has no update.
    #[error("{NOTHING_MOVES}")]
    NothingMoves,
    /// The recording.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The engine.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// Something of the recording is surely wrong.
    #[error("{} on {}: {finding}", recording.display(), scan.display())]
    Unsound {
        /// by its name
        scan: PathBuf,
        /// by its name
        recording: PathBuf,
        /// the surest
        finding: Box<InputFinding>,
    },
    /// Every sample was refused.
    #[error("{}: no sample of it could be used", recording.display())]
    NoSample {
        /// by its name
        recording: PathBuf,
    },
    /// The result cannot be made, or is the scan.
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
    /// unrefined, without what cannot be touched; m, in O
    pub scan: TriMesh,
    /// what was cut off
    pub cut: RegionCut,
}

/// What was touched.
pub enum TouchSource {
    /// a recording …
    Recorded {
        /// which
        recording: Box<Recording>,
        /// makes the poses of one that holds markers
        markers: Option<Box<MarkerFilter>>,
    },
    /// … or messages that are there already
    Messages {
        /// of each kind in order of time
        messages: Vec<Message>,
        /// in which axes the wrenches are
        wrench_frame: WrenchFrame,
    },
}

impl TouchSource {
    /// In which axes the wrenches are.
    pub fn wrench_frame(&self) -> WrenchFrame {
        match self {
            Self::Recorded { recording, .. } => recording.wrench_frame,
            Self::Messages { wrench_frame, .. } => *wrench_frame,
        }
    }
}

/// What samples are given to.
pub trait SampleTaker {
    /// Takes the next sample; `false`: it is left out, and counts for nothing.
    fn take(&mut self, sample: &Sample) -> bool;
    /// What decides about contact after it.
    fn refiner(&self) -> &Refiner;
    /// Sees each sample that was taken, with what is decided about its contact.
    fn observe(&mut self, _contact: &ContactSample) {}
}

/// A replay, and what judges it.
#[derive(Debug)]
pub struct JudgedReplay {
    /// counts and losses
    pub replayed: Replayed,
    /// has seen all messages, samples and contacts
    pub monitor: InputMonitor,
}

impl RefinementInput {
    /// Cuts the scan as the scene says.
    ///
    /// # Errors
    /// [`SceneError::EmptyRegion`]
    pub fn new(scene: Scene, scan: TriMesh) -> Result<Self, SceneError> {
        let CutScan { mesh, cut } = scene.cut(scan)?;
        Ok(Self {
            scene,
            scan: mesh,
            cut,
        })
    }

    /// Settings of the haptic update and of the patch; `None` where nothing moves the mesh.
    pub fn settings(
        &self,
        wrench_frame: WrenchFrame,
    ) -> Option<(RefineParams, Option<PatcherParams>)> {
        let params = self
            .cut
            .refine_params(self.scene.refine_params(wrench_frame)?);
        Some((
            params,
            self.scene
                .patcher_params()
                .map(|params| self.cut.patcher_params(params)),
        ))
    }

    /// Gives each sample to `taker`, and watches what comes.
    ///
    /// - `params`: those of [`Self::settings`].
    /// - `at_each`: called after each record, to show the progress.
    ///
    /// # Errors
    /// [`ReplayError`]
    pub fn replay(
        &self,
        touches: TouchSource,
        params: &RefineParams,
        taker: &mut impl SampleTaker,
        at_each: &mut dyn FnMut(),
    ) -> Result<JudgedReplay, ReplayError> {
        let (placement, sync) = (self.scene.placement(), self.scene.sync_params());
        let watch = InputWatch::new(
            self.scene.input_monitor_params(touches.wrench_frame()),
            params,
        )?;
        let watch = RefCell::new(watch);
        let mut at_message = |message: &Message| watch.borrow_mut().monitor.message(message);
        let each = |sample: &Sample| {
            if !taker.take(sample) {
                return;
            }
            let contact = watch.borrow_mut().sample(sample, taker.refiner());
            if let Some(contact) = &contact {
                taker.observe(contact);
            }
        };
        let replayed = match touches {
            TouchSource::Recorded { recording, markers } => {
                let markers = markers.map(|markers| *markers);
                each_sample(
                    *recording,
                    placement,
                    sync,
                    markers,
                    at_each,
                    &mut at_message,
                    each,
                )?
            }
            TouchSource::Messages {
                messages,
                wrench_frame,
            } => each_sample_of(
                messages,
                wrench_frame,
                placement,
                sync,
                &mut at_message,
                each,
            )?,
        };
        Ok(JudgedReplay {
            replayed,
            monitor: watch.into_inner().monitor,
        })
    }
}

/// A scan under refinement, the patch to be made at the end.
#[derive(Debug)]
pub struct Refinement {
    /// takes the samples
    pub engine: Engine,
    /// scene and scan
    pub input: RefinementInput,
}

/// What came of a refinement.
#[derive(Debug)]
pub struct FinishedRefinement {
    /// the result
    pub mesh: RefinedMesh,
    /// of the haptic update
    pub counts: RefineCounts,
    /// of the ball on the part; `None` when it never slid far enough
    pub friction: Option<FrictionCoefficient>,
}

impl Refinement {
    /// Nothing touched yet.
    ///
    /// # Errors
    /// [`RefinementError::NothingMoves`], [`RefinementError::Live`].
    pub fn new(input: RefinementInput, wrench_frame: WrenchFrame) -> Result<Self, RefinementError> {
        let (params, patch) = input
            .settings(wrench_frame)
            .ok_or(RefinementError::NothingMoves)?;
        let engine = Engine::new(input.scan.clone(), params, patch, Renewal::AtEnd)?;
        Ok(Self { engine, input })
    }

    /// Reconstructs what was touched.
    ///
    /// - `force`: also where no face of the scan is moved or replaced.
    ///
    /// # Errors
    /// [`RefinementError`]
    pub fn finish(self, force: bool) -> Result<FinishedRefinement, RefinementError> {
        let RefinementInput { scan, cut, .. } = &self.input;
        let mut ended = self.engine.finish()?;
        let counts = *ended.refiner.counts();
        let patcher = ended.patcher.take().filter(|_| counts.contacts > 0);
        if let Some(patcher) = patcher.as_ref().filter(|_| !force) {
            patcher.check_extent()?;
        }
        let outside = cut.outside.as_ref();
        let mesh = match patcher {
            Some(patcher) => RefinedMesh::patched(scan, patcher, outside, !force)?,
            None => RefinedMesh::moved(scan, &ended.mesh(), outside, !force)?,
        };
        Ok(FinishedRefinement {
            mesh,
            counts,
            friction: ended.refiner.friction(),
        })
    }
}

/// Counts what becomes of the samples.
struct CountingTaker<'a> {
    engine: &'a mut Engine,
    accepted: u64,
    refused: BTreeMap<String, u64>,
}

impl SampleTaker for CountingTaker<'_> {
    fn take(&mut self, sample: &Sample) -> bool {
        match self.engine.push(sample) {
            Ok(_) => self.accepted += 1,
            Err(error) => count_refusal(&mut self.refused, &error),
        }
        true
    }

    fn refiner(&self) -> &Refiner {
        self.engine.refiner()
    }
}

/// Why a sample was not taken, in one word. The synchroniser lets only checked samples out, in
/// order of time, so that what is left of a recording is a step whose result is no number.
pub fn reason_of_refusal(error: &LiveError) -> &'static str {
    match error {
        LiveError::Refine(RefineError::Sample(_)) => "sample",
        LiveError::Refine(RefineError::Setting(_) | RefineError::Dynamics(_)) => "dynamics",
        LiveError::Refine(RefineError::Mesh(_) | RefineError::NoSuchFace { .. }) => "mesh",
        _ => "stopped",
    }
}

/// By what scan and recording are named in messages.
#[derive(Clone, Copy, Debug)]
pub struct InputNames<'a> {
    /// …
    pub scan: &'a Path,
    /// …
    pub recording: &'a Path,
}

/// A refined scan with all that its recording was worth.
#[derive(Debug)]
pub struct RefinedScan {
    /// mesh and touches
    pub finished: FinishedRefinement,
    /// counts of the replay, and losses, also of the contacts; what it refused is in `refused`
    pub replayed: Replayed,
    /// samples that the update took
    pub accepted: u64,
    /// those that it, or the replay, refused, by reason
    pub refused: BTreeMap<String, u64>,
    /// what is doubtful, the surest first
    pub findings: Vec<InputFinding>,
}

/// What became of all samples.
struct JudgedSamples {
    monitor: InputMonitor,
    replayed: Replayed,
    accepted: u64,
    refused: BTreeMap<String, u64>,
}

impl JudgedSamples {
    fn finish(
        self,
        refinement: Refinement,
        names: InputNames<'_>,
        force: bool,
    ) -> Result<RefinedScan, RefinementError> {
        let Self {
            monitor,
            mut replayed,
            accepted,
            mut refused,
        } = self;
        let scan = &refinement.input.scan;
        let findings = monitor.findings(scan, &FaceTree::new_by(scan, &Threads));
        if !force {
            refuse_unsound(&findings, names)?;
            if accepted == 0 {
                return Err(RefinementError::NoSample {
                    recording: names.recording.to_owned(),
                });
            }
        }
        refused.append(&mut replayed.refused);
        let finished = refinement.finish(force)?;
        replayed.losses.extend(finished.mesh.outcome.loss());
        let outside_region = finished.counts.outside_region;
        if outside_region > 0 {
            refused.insert("outside_region".to_owned(), outside_region);
        }
        Ok(RefinedScan {
            finished,
            replayed,
            accepted: accepted - outside_region,
            refused,
            findings,
        })
    }
}

/// A refinement whose samples are pushed.
#[derive(Debug)]
pub struct JudgedRefinement {
    /// engine and input
    pub refinement: Refinement,
    watch: InputWatch,
    accepted: u64,
    refused: BTreeMap<String, u64>,
}

impl JudgedRefinement {
    /// Nothing touched yet.
    ///
    /// # Errors
    /// Those of [`Refinement::new`]; [`RefinementError::Setting`].
    pub fn new(input: RefinementInput, wrench_frame: WrenchFrame) -> Result<Self, RefinementError> {
        let (params, _) = input
            .settings(wrench_frame)
            .ok_or(RefinementError::NothingMoves)?;
        let monitor = input.scene.input_monitor_params(wrench_frame);
        let watch = InputWatch::new(monitor, &params)?;
        Ok(Self {
            refinement: Refinement::new(input, wrench_frame)?,
            watch,
            accepted: 0,
            refused: BTreeMap::new(),
        })
    }

    /// Takes the next sample; a refused one is counted and changes nothing.
    ///
    /// # Errors
    /// [`LiveError`] where it is refused.
    #[inline]
    pub fn push(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        let update = self
            .refinement
            .engine
            .push(sample)
            .inspect_err(|error| count_refusal(&mut self.refused, error))?;
        self.watch.monitor.paired_message(sample.stamp_ns);
        self.watch.sample(sample, self.refinement.engine.refiner());
        self.accepted += 1;
        Ok(update)
    }

    /// Judges what came, and reconstructs what was touched.
    ///
    /// - `names`: for messages. `force`: also where something is surely wrong, or no face is moved.
    ///
    /// # Errors
    /// [`RefinementError`]
    pub fn finish(
        self,
        names: InputNames<'_>,
        force: bool,
    ) -> Result<RefinedScan, RefinementError> {
        let Self {
            refinement,
            watch,
            accepted,
            refused,
        } = self;
        let wrenches = accepted + refused.values().sum::<u64>();
        let replayed = Replayed {
            wrenches,
            ..Replayed::default()
        };
        let samples = JudgedSamples {
            monitor: watch.monitor,
            replayed,
            accepted,
            refused,
        };
        samples.finish(refinement, names, force)
    }
}

/// Counts it by its reason.
#[cold]
fn count_refusal(refused: &mut BTreeMap<String, u64>, error: &LiveError) {
    *refused
        .entry(reason_of_refusal(error).to_owned())
        .or_default() += 1;
}

/// Refines a scan by a recording.
///
/// - `force`: also where something is surely wrong, or no face is moved.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`RefinementError`]: as `touchup refine` says it.
pub fn refine(
    input: RefinementInput,
    touches: TouchSource,
    names: InputNames<'_>,
    force: bool,
    at_each: &mut dyn FnMut(),
) -> Result<RefinedScan, RefinementError> {
    let wrench_frame = touches.wrench_frame();
    let (params, _) = input
        .settings(wrench_frame)
        .ok_or(RefinementError::NothingMoves)?;
    let Refinement { mut engine, input } = Refinement::new(input, wrench_frame)?;
    let mut taker = CountingTaker {
        engine: &mut engine,
        accepted: 0,
        refused: BTreeMap::new(),
    };
    let JudgedReplay { replayed, monitor } = input.replay(touches, &params, &mut taker, at_each)?;
    let CountingTaker {
        accepted, refused, ..
    } = taker;
    JudgedSamples {
        monitor,
        replayed,
        accepted,
        refused,
    }
    .finish(Refinement { engine, input }, names, force)
}

/// Refuses an input of which something is surely wrong.
///
/// # Errors
/// [`RefinementError::Unsound`] with the first finding that is.
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
