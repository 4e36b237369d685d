//! One session of the node: its folder, its recording, and the mesh that is refined in it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use chrono::{DateTime, Utc};
use serde::Serialize;

use super::error::NodeError;
use super::keeping::{Keeping, ReplayedSession};
use super::setup::Setup;
use super::streams::Epoch;
use crate::diagnose::InputMonitor;
use crate::io::session_folder::SessionFolder;
use crate::live::{Engine, EngineResult, Gate, Latencies, Pace, Quantiles, Renewal, TouchDelta};
use crate::ros::port::Port;
use crate::session::{
    Outcome, OutcomeError, OutcomePlaces, RefinedMesh, SessionRecord, SessionRecorder,
    StrokeChanges, Unrecorded,
};
use crate::stylus::{Synchroniser, WrenchFrame};

/// What was refused and lost, and how long things took.
#[derive(Debug, Default)]
pub struct Counters {
    /// samples that the refiner took
    pub accepted: u64,
    /// messages and samples that were not taken, by reason
    pub refused: BTreeMap<&'static str, u64>,
    /// messages that came while the node was paused
    pub paused: u64,
}

impl Counters {
    /// One more of `count`.
    pub fn refuse(&mut self, reason: &'static str) {
        *self.refused.entry(reason).or_default() += 1;
    }
}

/// What belongs to a session and goes with it.
pub struct NodeSession {
    /// by which followers of the mesh know it
    pub name: String,
    /// where all of it is kept
    pub folder: SessionFolder,
    /// whether it is recorded, or was
    pub keeping: Keeping,
    /// moves the mesh
    pub engine: Engine,
    /// axes of the wrenches that the engine expects
    pub axes: WrenchFrame,
    /// state of the mesh that went to the view completely
    pub sent_version: u64,
    /// … and edits at that time
    pub sent_edits: u64,
    /// pairs poses and wrenches
    pub sync: Synchroniser,
    /// what came of poses and wrenches, to be doubted
    pub input: InputMonitor,
    /// follows clocks that are set back
    pub epoch: Epoch,
    /// what was refused
    pub counters: Counters,
    /// work for one sample: answer, and what follows it
    pub pushes: Latencies,
    /// from the arrival of what completed a sample to the mesh
    pub latencies: Latencies,
    /// age of the touches that the mesh shows, at each sample …
    pub behind: Latencies,
    /// … and since the last diagnostics
    pub behind_lately: Latencies,
    /// state of the mesh, as in `MeshPatch`
    pub version: u64,
    /// … and edits at that time
    pub edits: u64,
    /// strokes that were taken back, done again, taken out and put back
    pub strokes: StrokeChanges,
    /// stamp of the newest sample, ns
    pub last_ns: Option<i64>,
    /// touches that the thread of the features had no room for
    pub probed: TouchDelta,
}

/// What a session says of itself when it is over.
#[derive(Debug, Serialize)]
pub struct SessionReport {
    /// name of the session
    pub session: String,
    /// samples that the refiner took
    pub accepted: u64,
    /// messages and samples that were not taken, by reason; `pose_…` are poses
    pub refused: BTreeMap<String, u64>,
    /// samples that were sent and did not come: wrenches, poses
    pub lost: [u64; 2],
    /// arrivals that the node had no time for: wrenches and poses, others
    pub dropped: [u64; 2],
    /// publications that nobody took fast enough: tiles, others
    pub unsent: [u64; 2],
    /// messages that came while it was paused
    pub paused: u64,
    /// messages that are not in the recording
    pub unrecorded: u64,
    /// frames of the view that were dropped
    pub dropped_view_frames: u64,
    /// times that a stream was stale: poses, wrenches
    pub gaps: [u64; 2],
    /// times that a clock jumped
    pub clock_jumps: u64,
    /// times that the tip came into contact
    pub contacts: u64,
    /// updates made smaller because a face would have folded
    pub cut_back: u64,
    /// work for one sample: its answer, and following the patch before the next one, ns
    pub push_ns: Quantiles,
    /// from the arrival of what completed a sample to the mesh, ns
    pub latency_ns: Quantiles,
    /// age of the touches that the patch in the mesh shows, at each sample, ns
    pub patch_behind_ns: Quantiles,
    /// renewals of the patch
    pub renewals: u64,
    /// … that were not done when they were due: the mesh showed a touch later
    pub late_renewals: u64,
    /// what was written
    pub result: Option<Outcome>,
}

/// What is left of a node.
#[derive(Debug)]
pub struct NodeEnd {
    /// folder of the last session, with the refined mesh in it
    pub folder: PathBuf,
    /// what became of it
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

    /// Begins one again that was recorded.
    ///
    /// - `folder`: where it is; nothing is written there.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn replayed(
        setup: &Setup,
        folder: SessionFolder,
        replayed: ReplayedSession,
    ) -> Result<Self, NodeError> {
        // followers take each run for another session; no folder is called so
        let name = format!("{}#{}", folder.name(), replayed.run());
        Self::of(setup, name, folder, Keeping::Replayed(Box::new(replayed)))
    }

    /// The one that begins when this is given up.
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
        let engine = engine_of(setup, axes)?;
        Ok(Self {
            name,
            folder,
            keeping,
            engine,
            axes,
            sent_version: 1,
            sent_edits: 0,
            sync: Synchroniser::in_order(setup.scene.sync_params())?,
            input: InputMonitor::new(setup.scene.input_monitor_params(axes))?,
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

    /// Wrenches come in other axes than was thought; nothing was touched yet.
    ///
    /// # Errors
    /// [`NodeError`]
    pub fn turn_axes(&mut self, setup: &Setup, axes: WrenchFrame) -> Result<(), NodeError> {
        self.engine = engine_of(setup, axes)?;
        self.input = InputMonitor::new(setup.scene.input_monitor_params(axes))?;
        self.axes = axes;
        Ok(())
    }

    /// Ends the session: writes the result into its folder, as `touchup refine` does, and a report
    /// beside it. Of one that is replayed nothing is written.
    ///
    /// # Errors
    /// [`NodeError`] when the result could not be written; the recording is ended all the same.
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
        let Unrecorded {
            messages, reason, ..
        } = recorder.finish();
        report.unrecorded = messages;
        let result = engine.finish()?.into_result();
        let [mesh, features, touches] =
            ["refined.ply", "features.json", "touches.csv"].map(|name| folder.path().join(name));
        let files = ResultFiles {
            mesh,
            features: Some(features),
            touches: Some(touches),
        };
        let outcome = files.write(setup, result).inspect_err(|_| {
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

    /// Everything that was not taken, by reason; those of poses begin with `pose_`.
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

    /// What is known of it so far.
    ///
    /// - `gaps`: times that a stream was stale: poses, wrenches.
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

/// Room for new faces that is made ahead.
const ROOM: usize = 1 << 18;

/// What moves the mesh: the haptic update, with the patch beside it where the scene has one.
/// Nothing touched yet.
///
/// - `axes`: those of the wrenches.
fn engine_of(setup: &Setup, axes: WrenchFrame) -> Result<Engine, NodeError> {
    let Setup {
        scan,
        scene,
        cut,
        clock,
        ..
    } = setup;
    let refine = cut.refine_params(scene.refine_params(axes).ok_or(NodeError::NothingMoves)?);
    let patch = scene
        .patcher_params()
        .map(|params| cut.patcher_params(params));
    let renewal = Renewal::Beside {
        scan: Arc::clone(scan),
        pace: Pace::default(),
        room: ROOM,
        gate: Gate::open(clock),
    };
    let mut engine = Engine::new(scan.0.clone(), refine, patch, renewal)?;
    engine.watch();
    engine.keep_strokes();
    // bounds of the scan, which the first renewal looks up, take some ms on a large one: no sample
    // is to wait for that
    engine.catch_up()?;
    Ok(engine)
}

/// The files of a result.
pub struct ResultFiles {
    /// as [`OutcomePlaces`] has them
    pub mesh: PathBuf,
    /// …
    pub features: Option<PathBuf>,
    /// …
    pub touches: Option<PathBuf>,
}

impl ResultFiles {
    /// Writes them, as `touchup refine` does.
    ///
    /// # Errors
    /// [`OutcomeError`]
    pub fn write(&self, setup: &Setup, result: EngineResult) -> Result<Outcome, Box<OutcomeError>> {
        let outside = setup.cut.outside.as_ref();
        let (mesh, outcome) = RefinedMesh::of(&setup.scan, result, outside, false)?;
        let places = OutcomePlaces {
            mesh: &self.mesh,
            unit: setup.mesh_unit,
            scan: &setup.scan_path,
            features: self.features.as_deref(),
            touches: self.touches.as_deref(),
        };
        places.write(mesh)?;
        Ok(outcome)
    }
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

    /// As `date -u` has them.
    #[test]
    fn a_session_is_named_by_the_time_it_began() {
        let named = |seconds| name_of(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(named(0), "1970-01-01T00-00-00Z");
        assert_eq!(named(951_782_400), "2000-02-29T00-00-00Z");
        assert_eq!(named(1_795_212_850), "2026-11-20T22-14-10Z");
        assert_eq!(named(4_107_542_399), "2100-02-28T23-59-59Z");
    }
}
