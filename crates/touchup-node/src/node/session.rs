//! One session of the node: its folder, its recording, and its refined mesh.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use chrono::{DateTime, Utc};
use serde::Serialize;

use super::error::NodeError;
use super::input::streams::Epoch;
use super::keeping::{Keeping, ReplayedSession};
use super::setup::Setup;
use crate::ros::port::Port;
use touchup_features::diagnose::InputMonitor;
use touchup_io::session_folder::SessionFolder;
use touchup_method::stylus::{Synchroniser, WrenchFrame};
use touchup_session::live::{Engine, EngineResult, Gate, Latencies, Pace, Quantiles, TouchDelta};
use touchup_session::session::{
    Outcome, OutcomeError, RecordingLoss, RefinedMesh, ResultFiles, SessionRecord, SessionRecorder,
    StepFileOutcome, StrokeChanges,
};

/// Numbers of accepted, refused and skipped input.
#[derive(Debug, Default)]
pub struct Counters {
    /// samples accepted by the refiner
    pub accepted: u64,
    /// refused messages and samples, by reason
    pub refused: BTreeMap<&'static str, u64>,
    /// messages received during a pause
    pub paused: u64,
}

impl Counters {
    /// Counts a refusal.
    pub fn refuse(&mut self, reason: &'static str) {
        *self.refused.entry(reason).or_default() += 1;
    }
}

/// State of one session.
pub struct NodeSession {
    /// name for followers of the mesh
    pub name: String,
    /// folder of all its files
    pub folder: SessionFolder,
    /// whether it is recorded or replayed
    pub keeping: Keeping,
    /// moves the mesh
    pub engine: Engine,
    /// expected axes of the wrenches
    pub axes: WrenchFrame,
    /// last version completely sent to the view
    pub sent_version: u64,
    /// edits at `sent_version`
    pub sent_edits: u64,
    /// pairs poses and wrenches
    pub sync: Synchroniser,
    /// statistics of poses and wrenches, for doubts about the input
    pub input: InputMonitor,
    /// follows clocks that go back
    pub epoch: Epoch,
    /// numbers of accepted and refused input
    pub counters: Counters,
    /// work for one sample: answer and follow-up
    pub pushes: Latencies,
    /// from the arrival of a sample's last message to the mesh
    pub latencies: Latencies,
    /// age of the touches in the mesh, at each sample
    pub behind: Latencies,
    /// age of the touches since the last diagnostics
    pub behind_lately: Latencies,
    /// version of the mesh, as in `MeshPatch`
    pub version: u64,
    /// edits at `version`
    pub edits: u64,
    /// strokes undone, redone, removed and restored
    pub strokes: StrokeChanges,
    /// stamp of the newest sample, ns
    pub last_ns: Option<i64>,
    /// touches for which the feature thread had no room
    pub probed: TouchDelta,
}

/// Report of a session at its end.
#[derive(Debug, Serialize)]
pub struct SessionReport {
    /// name of the session
    pub session: String,
    /// samples accepted by the refiner
    pub accepted: u64,
    /// refused messages and samples, by reason; `pose_…` are poses
    pub refused: BTreeMap<String, u64>,
    /// samples sent but not received: wrenches, poses
    pub lost: [u64; 2],
    /// arrivals dropped by a busy node: wrenches and poses, others
    pub dropped: [u64; 2],
    /// publications dropped for slow listeners: tiles, others
    pub unsent: [u64; 2],
    /// messages received during a pause
    pub paused: u64,
    /// messages missing in the recording
    pub unrecorded: u64,
    /// dropped frames of the view
    pub dropped_view_frames: u64,
    /// number of gaps of a stream: poses, wrenches
    pub gaps: [u64; 2],
    /// number of clock jumps
    pub clock_jumps: u64,
    /// number of contacts of the tip
    pub contacts: u64,
    /// updates reduced to keep a face from folding
    pub cut_back: u64,
    /// work for one sample: its answer, and following the patch before the next one, ns
    pub push_ns: Quantiles,
    /// from the arrival of a sample's last message to the mesh, ns
    pub latency_ns: Quantiles,
    /// age of the touches in the mesh's patch, at each sample, ns
    pub patch_behind_ns: Quantiles,
    /// renewals of the patch
    pub renewals: u64,
    /// renewals of the patch later than due: the mesh showed a touch later
    pub late_renewals: u64,
    /// written result
    pub result: Option<Outcome>,
}

/// Result of a node.
#[derive(Debug)]
pub struct NodeEnd {
    /// folder of the last session, with the refined mesh in it
    pub folder: PathBuf,
    /// report of that session
    pub report: SessionReport,
}

impl NodeSession {
    /// Begins a session in a new folder.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn begin(setup: &Setup) -> Result<Self, NodeError> {
        let parameters = setup.shared.parameters();
        let parent = PathBuf::from(parameters.string("session_folder"));
        let begun = SystemTime::now();
        let folder = SessionFolder::create(&parent, &name_of(begun)).map_err(|source| {
            NodeError::Folder {
                path: parent,
                source,
            }
        })?;
        SessionRecord::begin(
            &folder,
            &setup.scan_path,
            setup.mesh_unit,
            &setup.scene_yaml,
            &setup.topics,
            begun,
        )?;
        let recorder = SessionRecorder::start(&folder, &setup.topics, &setup.clock)?;
        Self::of(
            setup,
            folder.name().to_owned(),
            folder,
            Keeping::Recorded(recorder),
        )
    }

    /// Begins a replay of a recorded session.
    ///
    /// - `folder`: of the recording, not written to.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn replayed(
        setup: &Setup,
        folder: SessionFolder,
        replayed: ReplayedSession,
    ) -> Result<Self, NodeError> {
        // each run is another session for followers; no folder has such a name
        let name = format!("{}#{}", folder.name(), replayed.run());
        Self::of(setup, name, folder, Keeping::Replayed(Box::new(replayed)))
    }

    /// Begins the session after this one.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn next(&self, setup: &Setup) -> Result<Self, NodeError> {
        match &self.keeping {
            Keeping::Recorded(_) => Self::begin(setup),
            Keeping::Replayed(replayed) => {
                Self::replayed(setup, self.folder.clone(), replayed.again())
            }
        }
    }

    fn of(
        setup: &Setup,
        name: String,
        folder: SessionFolder,
        keeping: Keeping,
    ) -> Result<Self, NodeError> {
        let axes = WrenchFrame::default();
        let engine = engine_of(setup, axes, &keeping)?;
        Ok(Self {
            name,
            folder,
            keeping,
            engine,
            axes,
            sent_version: 1,
            sent_edits: 0,
            sync: Synchroniser::in_order(setup.input.scene.sync_params())?,
            input: InputMonitor::new(setup.input.scene.input_monitor_params(axes))?,
            epoch: Epoch::default(),
            counters: Counters::default(),
            pushes: Latencies::new(),
            latencies: Latencies::new(),
            behind: Latencies::new(),
            behind_lately: Latencies::new(),
            version: 1,
            edits: 0,
            strokes: StrokeChanges::default(),
            last_ns: None,
            probed: TouchDelta::default(),
        })
    }

    /// Whether all changes of the mesh were sent to the view.
    pub fn is_sent(&self) -> bool {
        self.sent_version == self.version && self.sent_edits == self.engine.edits()
    }

    /// Restarts for wrenches in other axes than assumed, before any touch.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn turn_axes(&mut self, setup: &Setup, axes: WrenchFrame) -> Result<(), NodeError> {
        self.engine = engine_of(setup, axes, &self.keeping)?;
        self.input = InputMonitor::new(setup.input.scene.input_monitor_params(axes))?;
        self.axes = axes;
        Ok(())
    }

    /// Ends the session: writes the result into its folder, as `touchup refine` does, and a report
    /// beside it. A replay writes nothing.
    ///
    /// # Errors
    /// [`NodeError`] if the result was not written; the recording ends all the same.
    pub fn end(self, setup: &Setup, mut report: SessionReport) -> Result<SessionReport, NodeError> {
        let Self {
            folder,
            keeping,
            engine,
            ..
        } = self;
        let Keeping::Recorded(recorder) = keeping else {
            return Ok(report);
        };
        let RecordingLoss {
            messages, reason, ..
        } = recorder.finish();
        report.unrecorded = messages;
        let result = engine.finish()?.into_result();
        let files = ResultFiles::in_folder(folder.path());
        let (outcome, _) = write_result(setup, result, &files).inspect_err(|_| {
            if let Some(reason) = &reason {
                tracing::error!("{messages} messages are not in the session's recording: {reason}");
            }
        })?;
        report.result = Some(outcome);
        let text =
            serde_json::to_string_pretty(&report).expect("numbers and names alone cannot fail");
        folder
            .write_text("report.json", &text)
            .map_err(|source| NodeError::Folder {
                path: folder.path().to_owned(),
                source,
            })?;
        reason.map_or(Ok(report), |reason| {
            Err(NodeError::Unrecorded {
                count: messages,
                reason,
            })
        })
    }

    /// All refused input, by reason; reasons of poses begin with `pose_`.
    pub fn refused(&self) -> BTreeMap<String, u64> {
        let mut refused: BTreeMap<_, _> = self
            .counters
            .refused
            .iter()
            .map(|(reason, count)| ((*reason).to_owned(), *count))
            .collect();
        for (counts, prefix) in [(self.sync.counts(), ""), (self.sync.pose_counts(), "pose_")] {
            for (reason, count) in counts.reasons().into_iter().filter(|(_, count)| *count > 0) {
                *refused.entry(format!("{prefix}{reason}")).or_default() += count;
            }
        }
        refused
    }

    /// Report up to now.
    ///
    /// - `gaps`: number of gaps of a stream: poses, wrenches.
    pub fn report(&self, setup: &Setup, port: &dyn Port, gaps: [u64; 2]) -> SessionReport {
        let Self {
            engine,
            sync,
            counters,
            ..
        } = self;
        let counts = engine.refiner().counts();
        SessionReport {
            session: self.name.clone(),
            accepted: counters.accepted,
            refused: self.refused(),
            lost: port.lost(),
            dropped: port.dropped(),
            unsent: port.unsent(),
            paused: counters.paused,
            unrecorded: self.keeping.unrecorded().messages,
            dropped_view_frames: setup.shared.dropped_frames.load(Ordering::Relaxed),
            gaps,
            clock_jumps: self.epoch.jumps + sync.counts().jump + sync.pose_counts().jump,
            contacts: counts.contacts,
            cut_back: counts.cut_back,
            push_ns: self.pushes.quantiles(),
            latency_ns: self.latencies.quantiles(),
            patch_behind_ns: self.behind.quantiles(),
            renewals: engine.counts().renewals,
            late_renewals: engine.counts().late,
            result: None,
        }
    }
}

/// The engine that moves the mesh: the haptic update, with the patch beside it if the scene has
/// one. No touches yet.
///
/// - `axes`: of the wrenches.
fn engine_of(setup: &Setup, axes: WrenchFrame, keeping: &Keeping) -> Result<Engine, NodeError> {
    let beside = (Pace::default(), Gate::open(&setup.clock));
    let mut engine = setup.input.engine(axes, Some(beside)).map_err(Box::new)?;
    engine.watch();
    engine.keep_strokes();
    if let Keeping::Replayed(replayed) = keeping {
        let radius = setup.input.scene.tip_params().radius;
        let know = |known| engine.know(known);
        replayed.known().of_tip(radius, know)?;
    }
    // the first renewal needs the bounds of the scan, some ms on a large one: no sample should wait
    // for them
    engine.catch_up()?;
    Ok(engine)
}

/// Writes the files of a result, as `touchup refine` does; returns the faces of the STEP file or its
/// fault beside it.
///
/// # Errors
/// [`OutcomeError`]
pub fn write_result(
    setup: &Setup,
    result: EngineResult,
    files: &ResultFiles,
) -> Result<(Outcome, Option<StepFileOutcome>), Box<OutcomeError>> {
    let outside = setup.input.cut.outside.as_ref();
    let (mesh, outcome) = RefinedMesh::of(&setup.input.scan, result, outside, false)?;
    let step = files.write(mesh, &setup.scan_path, setup.mesh_unit)?;
    Ok((outcome, step))
}

/// "2026-11-20T22-14-10Z": sorts by time, and is a file name everywhere.
fn name_of(time: SystemTime) -> String {
    DateTime::<Utc>::from(time)
        .format("%Y-%m-%dT%H-%M-%SZ")
        .to_string()
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    /// Expected names from `date -u`.
    #[test]
    fn a_session_is_named_by_the_time_it_began() {
        let named = |seconds| name_of(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(named(0), "1970-01-01T00-00-00Z");
        assert_eq!(named(951_782_400), "2000-02-29T00-00-00Z");
        assert_eq!(named(1_795_212_850), "2026-11-20T22-14-10Z");
        assert_eq!(named(4_107_542_399), "2100-02-28T23-59-59Z");
    }
}
