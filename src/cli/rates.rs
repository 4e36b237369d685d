//! How samples come: as fast as they can be read, or in real time with the patch beside them.

use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::{counted, reported};
use crate::haptic::{RefineError, RefineParams};
use crate::live::{
    Ended, Engine, Gate, Latencies, LiveCounts, LiveError, Pace, Quantiles, Renewal,
};
use crate::mesh::{FaceTree, TriMesh};
use crate::reconstruct::PatcherParams;
use crate::session::StrokeReplay;
use crate::stylus::Sample;
use crate::threads::Threads;

/// Room reserved for new faces.
const ROOM: usize = 1 << 18;

reported! {
    /// What `--json` prints of `--live`.
    pub(super) struct LiveSummary, fn of(behind: &Latencies, counts: LiveCounts) {
        /// how old the touches are that the mesh shows, in time of the samples
        behind_ns: Quantiles = behind.quantiles(),
        renewals: u64 = counts.renewals,
        /// renewals that were not done when they were due
        pub(super) late: u64 = counts.late,
    }
}

/// The engine, and the rate at which it gets samples.
pub(super) struct Rates {
    pub engine: Engine,
    /// `None`: as fast as they can be read; the patch is made at the end
    real_time: Option<RealTime>,
    stopped: Option<LiveError>,
}

/// How samples are awaited.
struct RealTime {
    /// memory of the scan and its tree that the patch has for itself
    scan_bytes: usize,
    /// when the first sample came, and its stamp, ns
    begun: Option<(Instant, i64)>,
    behind: Latencies,
}

impl Rates {
    /// - `is_live`: in real time; else as fast as samples can be read.
    ///
    /// # Errors
    /// As [`Engine::new`].
    pub fn new(
        mesh: TriMesh,
        refine: RefineParams,
        patch: Option<PatcherParams>,
        is_live: bool,
    ) -> Result<Self, LiveError> {
        let (mut renewal, mut real_time) = (Renewal::AtEnd, None);
        if is_live {
            let scan = Arc::new((mesh.clone(), FaceTree::new_by(&mesh, &Threads)));
            let scan_bytes = scan.0.bytes() + scan.1.bytes();
            renewal = Renewal::Beside {
                scan,
                pace: Pace::default(),
                room: ROOM,
                gate: Gate::default(),
            };
            real_time = Some(RealTime {
                scan_bytes,
                begun: None,
                behind: Latencies::new(),
            });
        }
        Ok(Self {
            engine: Engine::new(mesh, refine, patch, renewal)?,
            real_time,
            stopped: None,
        })
    }

    /// Memory of the scan and its tree that the patch has for itself, bytes.
    pub fn scan_bytes(&self) -> usize {
        self.real_time
            .as_ref()
            .map_or(0, |real_time| real_time.scan_bytes)
    }

    /// Takes the next sample, in real time when it is due; returns whether it was refused, and how
    /// long that took.
    pub fn push(&mut self, sample: &Sample) -> (Result<(), RefineError>, Duration) {
        if let Some(real_time) = &mut self.real_time {
            real_time.wait_for(sample.stamp_ns);
        }
        let pushing = Instant::now();
        let pushed = self.engine.push(sample);
        let time = pushing.elapsed();
        if let (Some(real_time), Some(until_ns)) =
            (&mut self.real_time, self.engine.patched_until_ns())
            && let Ok(behind_ns) = u64::try_from(sample.stamp_ns.saturating_sub(until_ns))
        {
            real_time.behind.record(Duration::from_nanos(behind_ns));
        }
        match pushed {
            Ok(_) => {}
            Err(LiveError::Refine(error)) => return (Err(error), time),
            // reported at the end: the samples that are left change nothing
            Err(error) => self.stopped = Some(error),
        }
        (Ok(()), time)
    }

    /// Takes back and does again what was before the sample of this stamp, ns.
    pub fn change_strokes(&mut self, strokes: &mut StrokeReplay, before_ns: i64) {
        while let Some((_, is_undo)) = strokes.next_before(before_ns) {
            let changed = if is_undo {
                self.engine.undo()
            } else {
                self.engine.redo()
            };
            if let Err(error) = changed {
                self.stopped = Some(error);
            }
        }
    }

    /// Ends the thread of the patch, if there is one; gives back what there is after the last
    /// sample, and the lag of the patch.
    ///
    /// # Errors
    /// [`LiveError::Stopped`] when it ended before.
    pub fn finish(self) -> Result<(Ended, Option<LiveSummary>), LiveError> {
        let Self {
            engine,
            real_time,
            stopped,
        } = self;
        if let Some(stopped) = stopped {
            return Err(stopped);
        }
        let counts = engine.counts();
        let ended = engine.finish()?;
        let live = real_time.map(|real_time| LiveSummary::of(&real_time.behind, counts));
        Ok((ended, live))
    }
}

impl RealTime {
    fn wait_for(&mut self, stamp_ns: i64) {
        let (begun, first_ns) = *self.begun.get_or_insert((Instant::now(), stamp_ns));
        let due =
            Duration::from_nanos(u64::try_from(stamp_ns.saturating_sub(first_ns)).unwrap_or(0));
        sleep(due.saturating_sub(begun.elapsed()));
    }
}

impl std::fmt::Display for LiveSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Quantiles { median, p99, .. } = self.behind_ns;
        let [median, p99] = [median, p99].map(|ns| ns as f64 * 1e-6);
        let renewals = counted(self.renewals, "renewal", "renewals");
        write!(
            f,
            "live: patch {median:.0} ms behind, p99 {p99:.0} ms; {renewals}, {} of them late",
            self.late
        )
    }
}
