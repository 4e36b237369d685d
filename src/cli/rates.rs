//! How samples come: as fast as they can be read, or in real time with the patch beside them.

use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::live::{Latencies, LiveCounts, LiveError, LiveRefiner, Pace, Quantiles};
use crate::mesh::{FaceTree, TriMesh};
use crate::patch::Patcher;
use crate::refine::{RefineError, Refiner};
use crate::touch::Sample;

/// Room for new faces that is made ahead.
const ROOM: usize = 1 << 18;

/// What `--json` prints of `--live`.
#[derive(Debug, Serialize)]
pub(super) struct LiveSummary {
    /// how old the touches are that the mesh shows, in time of the samples
    behind_ns: Quantiles,
    renewals: u64,
    /// renewals that were not done when they were due
    pub(super) late: u64,
}

/// The refiner and what keeps what it feels.
pub(super) enum Rates {
    /// as fast as they can be read; the patch is made at the end
    AtOnce { refiner: Box<Refiner>, patcher: Option<Box<Patcher>> },
    /// in real time
    Live(Box<Live>),
}

pub(super) struct Live {
    /// what the patch is made from
    scan: Arc<(TriMesh, FaceTree)>,
    refiner: LiveRefiner,
    /// when the first sample came, and its stamp, ns
    begun: Option<(Instant, i64)>,
    behind: Latencies,
    stopped: Option<LiveError>,
}

/// What is left when all samples were pushed.
pub(super) struct Ended {
    pub refiner: Refiner,
    pub patcher: Option<Patcher>,
    pub live: Option<LiveSummary>,
}

impl Rates {
    /// - `scan`: as the refiner has it.
    ///
    /// # Errors
    /// As [`LiveRefiner::new`].
    pub fn live(scan: &TriMesh, refiner: Refiner, patcher: Patcher) -> Result<Self, LiveError> {
        let scan = Arc::new((scan.clone(), FaceTree::new(scan)));
        let refiner = LiveRefiner::new(Arc::clone(&scan), refiner, patcher, Pace::default(), ROOM)?;
        Ok(Self::Live(Box::new(Live { scan, refiner, begun: None, behind: Latencies::new(), stopped: None })))
    }

    /// The haptic update.
    pub fn refiner(&self) -> &Refiner {
        match self {
            Self::AtOnce { refiner, .. } => refiner,
            Self::Live(live) => live.refiner.refiner(),
        }
    }

    /// Memory of the scan and its tree that the patch has for itself, bytes.
    pub fn scan_bytes(&self) -> usize {
        match self {
            Self::AtOnce { .. } => 0,
            Self::Live(live) => live.scan.0.bytes() + live.scan.1.bytes(),
        }
    }

    /// Takes the next sample, in real time when it is due; returns how long that took.
    ///
    /// # Errors
    /// [`RefineError`] for a sample that was refused.
    pub fn push(&mut self, sample: &Sample) -> Result<Duration, (RefineError, Duration)> {
        match self {
            Self::AtOnce { refiner, patcher } => {
                let begun = Instant::now();
                let pushed = refiner.push(sample);
                if let (Ok(_), Some(patcher)) = (&pushed, patcher) {
                    patcher.push(sample);
                }
                let time = begun.elapsed();
                pushed.map(|_| time).map_err(|error| (error, time))
            }
            Self::Live(live) => live.push(sample),
        }
    }

    /// Takes the last stroke back, or does it again.
    pub fn change_strokes(&mut self, is_undo: bool) {
        let of_patch = |patcher: &mut Patcher| if is_undo { patcher.undo() } else { patcher.redo() };
        match self {
            Self::AtOnce { patcher: Some(patcher), .. } => {
                of_patch(patcher);
            }
            Self::AtOnce { refiner, .. } => {
                if is_undo {
                    refiner.undo()
                } else {
                    refiner.redo()
                };
            }
            Self::Live(live) => live.change_strokes(is_undo),
        }
    }

    /// Ends the thread of the patch, if there is one.
    ///
    /// # Errors
    /// [`LiveError::Stopped`] when it ended before.
    pub fn finish(self) -> Result<Ended, LiveError> {
        match self {
            Self::AtOnce { refiner, patcher } => {
                Ok(Ended { refiner: *refiner, patcher: patcher.map(|patcher| *patcher), live: None })
            }
            Self::Live(live) => {
                let Live { refiner, behind, stopped, .. } = *live;
                if let Some(stopped) = stopped {
                    return Err(stopped);
                }
                let LiveCounts { renewals, late } = refiner.counts();
                let (refiner, patcher) = refiner.finish()?;
                let live = LiveSummary { behind_ns: behind.quantiles(), renewals, late };
                Ok(Ended { refiner, patcher: Some(patcher), live: Some(live) })
            }
        }
    }
}

impl Live {
    fn change_strokes(&mut self, is_undo: bool) {
        let changed = if is_undo { self.refiner.undo() } else { self.refiner.redo() };
        if let Err(error) = changed {
            self.stopped = Some(error);
        }
    }

    fn push(&mut self, sample: &Sample) -> Result<Duration, (RefineError, Duration)> {
        let (begun, first_ns) = *self.begun.get_or_insert((Instant::now(), sample.stamp_ns));
        let due = Duration::from_nanos(u64::try_from(sample.stamp_ns.saturating_sub(first_ns)).unwrap_or(0));
        sleep(due.saturating_sub(begun.elapsed()));
        let pushing = Instant::now();
        let pushed = self.refiner.push(sample);
        let time = pushing.elapsed();
        // the least there is before the patch has seen a touch
        let until_ns = Some(self.refiner.delta().until_ns).filter(|&until_ns| until_ns > i64::MIN);
        let behind_ns = until_ns.and_then(|until_ns| u64::try_from(sample.stamp_ns.saturating_sub(until_ns)).ok());
        if let (Some(behind_ns), true) = (behind_ns, self.refiner.counts().renewals > 0) {
            self.behind.record(Duration::from_nanos(behind_ns));
        }
        match pushed {
            Ok(_) => Ok(time),
            Err(LiveError::Refine(error)) => Err((error, time)),
            Err(error) => {
                // told at the end: the samples that are left change nothing
                self.stopped = Some(error);
                Ok(time)
            }
        }
    }
}

impl std::fmt::Display for LiveSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Quantiles { median, p99, .. } = self.behind_ns;
        let [median, p99] = [median, p99].map(|ns| ns as f64 * 1e-6);
        let Self { renewals, late, .. } = self;
        write!(f, "live: patch {median:.0} ms behind, p99 {p99:.0} ms; {renewals} renewals, {late} of them late")
    }
}
