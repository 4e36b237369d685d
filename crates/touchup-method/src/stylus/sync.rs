//! Pose and wrench at one instant: interpolates the pose at the stamp of each wrench.
//!
//! The two streams have their own rates and clocks, and their messages arrive late, twice, out of
//! order or not at all. The samples depend on the messages alone: any order of arrival that moves
//! no message by more than the reorder window gives the same samples, bit for bit.

use nalgebra::Isometry3;

use super::stream::Stream;
use super::sync_params::{SyncCounts, SyncParams};
use super::{Message, Sample, SampleError, SettingError, StampedPose, StampedWrench};

/// Maximum time between two successive wrenches that confirm each other, ns.
const DRIFTS_FROM_NS: u64 = 10_000_000_000;

/// Turns two streams of messages into one stream of samples, in order of time.
///
/// Memory is bounded and allocated once, in [`Synchroniser::new`].
///
/// # Example
/// ```
/// # use touchup_method::stylus::*;
/// # use nalgebra::Isometry3;
/// let mut sync = Synchroniser::new(SyncParams::default())?;
/// for (stamp_ns, x) in [(0, 0.0), (2_000_000, 0.1)] {
///     sync.push(Message::Pose(StampedPose { stamp_ns, pose_ot: Isometry3::translation(x, 0.0, 0.0) }));
/// }
/// sync.push(Message::Wrench(StampedWrench { stamp_ns: 500_000, wrench: Wrench::default() }));
/// sync.finish();
/// let sample = sync.next_sample().expect("the wrench lies between two poses");
/// assert!((sample.pose_ot.translation.x - 0.025).abs() < 1e-15);
/// # Ok::<(), SettingError>(())
/// ```
#[derive(Debug)]
pub struct Synchroniser {
    params: SyncParams,
    poses: Stream<StampedPose>,
    wrenches: Stream<StampedWrench>,
    /// stamp of the wrench from which its clock drifts, the first that the next one confirms; and
    /// stamp of the previous wrench
    drifts_from_ns: Option<i64>,
    last_wrench_ns: Option<i64>,
    finished: bool,
}

impl Synchroniser {
    /// Checks the settings and allocates the buffers.
    ///
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(params: SyncParams) -> Result<Self, SettingError> {
        Self::waiting(params, params.reorder_ns.saturating_add(1))
    }

    /// As [`Self::new`], for streams that each come in order of stamps, in any interleaving: a
    /// sample goes out with the later of its wrench and the pose after it, and a message out of
    /// order is late. Without such messages, the samples equal the samples of any reorder window.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn in_order(params: SyncParams) -> Result<Self, SettingError> {
        Self::waiting(params, 0)
    }

    fn waiting(params: SyncParams, wait_ns: i64) -> Result<Self, SettingError> {
        params.check()?;
        let (poses, wrenches) = (
            Stream::new(params.capacity, wait_ns),
            Stream::new(params.capacity, wait_ns),
        );
        Ok(Self {
            params,
            poses,
            wrenches,
            drifts_from_ns: None,
            last_wrench_ns: None,
            finished: false,
        })
    }

    /// Takes one message; draw samples with [`Self::next_sample`] before the next one. A message
    /// after [`Self::finish`] is late. Returns whether it took the message: a refused one raises a
    /// count and changes nothing else.
    pub fn push(&mut self, message: Message) -> bool {
        let (checked, counts) = match &message {
            Message::Pose(pose) => (pose.check(), &mut self.poses.counts),
            Message::Wrench(wrench) => (wrench.check(), &mut self.wrenches.counts),
        };
        match checked {
            _ if self.finished => counts.late += 1,
            Ok(()) => return self.take(message),
            Err(SampleError::NotFinite { .. }) => counts.not_finite += 1,
            Err(SampleError::Absurd { .. } | SampleError::NotARotation { .. }) => {
                counts.absurd += 1
            }
            Err(SampleError::NotAfter { .. }) => counts.late += 1,
        }
        false
    }

    fn take(&mut self, message: Message) -> bool {
        match message {
            Message::Pose(pose) => self.poses.push(pose, &self.params),
            Message::Wrench(wrench) => {
                let stamp_ns = self.on_clock_of_pose(wrench.stamp_ns);
                self.wrenches
                    .push(StampedWrench { stamp_ns, ..wrench }, &self.params)
            }
        }
    }

    /// Stamp of a wrench without the offset and drift of its clock.
    fn on_clock_of_pose(&mut self, stamp_ns: i64) -> i64 {
        let is_near = |last: &i64| stamp_ns.abs_diff(*last) < DRIFTS_FROM_NS;
        // a wild first stamp would shift all others
        let last = self.last_wrench_ns.replace(stamp_ns).filter(is_near);
        self.drifts_from_ns = self.drifts_from_ns.or(last);
        let since_ns = self
            .drifts_from_ns
            .map_or(0, |from_ns| stamp_ns.saturating_sub(from_ns));
        let gained_ns = (since_ns as f64 * self.params.wrench_drift).round() as i64;
        stamp_ns.saturating_sub(self.params.wrench_offset_ns.saturating_add(gained_ns))
    }

    /// Ends the streams: the held messages may go out.
    pub fn finish(&mut self) {
        self.finished = true;
        self.poses.finish(&self.params);
        self.wrenches.finish(&self.params);
    }

    /// Next sample that no admissible message could change; `None` until more messages come.
    pub fn next_sample(&mut self) -> Option<Sample> {
        loop {
            let wrench = *self.wrenches.held.front()?;
            if wrench.stamp_ns > self.watermark(&self.wrenches) {
                return None;
            }
            let watermark = self.watermark(&self.poses);
            self.poses.forget_before(wrench.stamp_ns.min(watermark));
            let pose = self.pose_at(wrench.stamp_ns, watermark)?;
            self.wrenches.pop();
            match pose {
                Ok(pose_ot) => {
                    return Some(Sample {
                        stamp_ns: wrench.stamp_ns,
                        pose_ot,
                        wrench: wrench.wrench,
                    });
                }
                Err(count) => *count(&mut self.wrenches.counts) += 1,
            }
        }
    }

    /// Wrenches without a sample, by reason.
    pub fn counts(&self) -> &SyncCounts {
        &self.wrenches.counts
    }

    /// Dropped poses, by reason; a wrench that misses one counts in [`Self::counts`].
    pub fn pose_counts(&self) -> &SyncCounts {
        &self.poses.counts
    }

    /// Newest accepted stamp of either stream, ns, without the offset of the wrench; `None` before
    /// the first.
    pub fn newest_ns(&self) -> Option<i64> {
        self.poses.newest_ns().max(self.wrenches.newest_ns())
    }

    /// Stamp up to which nothing of `stream` can arrive any more.
    fn watermark<T>(&self, stream: &Stream<T>) -> i64 {
        if self.finished {
            i64::MAX
        } else {
            stream.watermark
        }
    }

    /// Pose at `stamp_ns`, or the counter to raise for a missing one; `None` while still open.
    fn pose_at(&self, stamp_ns: i64, watermark: i64) -> Option<Result<Isometry3<f64>, Counter>> {
        let mut held = self.poses.held.iter();
        let missing: Counter = if self.poses.overflown {
            |counts| &mut counts.overflow
        } else {
            |counts| &mut counts.no_pose_before
        };
        let Some(before) = held.next() else {
            return self.finished.then_some(Err(missing));
        };
        if before.stamp_ns == stamp_ns {
            return Some(Ok(before.pose_ot));
        }
        if before.stamp_ns > stamp_ns {
            return (stamp_ns <= watermark).then_some(Err(missing));
        }
        let Some(after) = held.next() else {
            return self
                .finished
                .then_some(Err(|counts| &mut counts.no_pose_after));
        };
        if after.stamp_ns > watermark {
            return None;
        }
        let gap = after.stamp_ns.abs_diff(before.stamp_ns);
        if gap > self.params.largest_gap_ns as u64 {
            return Some(Err(|counts| &mut counts.gap));
        }
        let t = stamp_ns.abs_diff(before.stamp_ns) as f64 / gap as f64;
        Some(Ok(interpolated(&before.pose_ot, &after.pose_ot, t)))
    }
}

/// Counter of [`SyncCounts`] to raise.
type Counter = fn(&mut SyncCounts) -> &mut u64;

/// Interpolates between two poses: linear in position, constant angular velocity along the shorter
/// arc in orientation.
pub(super) fn interpolated(
    before: &Isometry3<f64>,
    after: &Isometry3<f64>,
    t: f64,
) -> Isometry3<f64> {
    let position = before.translation.vector.lerp(&after.translation.vector, t);
    // the power of the relative rotation keeps its digits at angles at which a slerp by sines loses
    // them
    let mut rotation = before.rotation * (before.rotation.inverse() * after.rotation).powf(t);
    rotation.renormalize();
    Isometry3::from_parts(position.into(), rotation)
}
