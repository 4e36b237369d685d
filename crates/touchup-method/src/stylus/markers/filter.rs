//! Frames of markers in, poses at a steady rate out.

use serde::Serialize;

use super::body::MarkerBody;
use super::motion::BodyMotion;
use super::{MarkerFrame, MarkerParams};
use crate::stylus::stream::Stream;
use crate::stylus::sync::interpolated;
use crate::stylus::{SettingError, StampedPose, SyncCounts, SyncParams};

/// Frames and markers by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MarkerCounts {
    /// frames whose markers determined the pose
    pub held: u64,
    /// frames during which the body flew on
    pub coasting: u64,
    /// frames without a pose
    pub lost: u64,
    /// markers with a wrong label
    pub relabelled: u64,
    /// markers that match none of the body
    pub rejected: u64,
}

/// Maximum number of frames waiting for earlier ones: a tenth of a second at 640 Hz.
const HELD_FRAMES: usize = 64;

/// Follows a rigid body by its markers. Memory is bounded and allocated once, in
/// [`MarkerFilter::new`].
///
/// # Example
/// ```
/// # use touchup_method::stylus::*;
/// # use nalgebra::{Isometry3, Point3, Vector3};
/// let markers_t = [(30.0, 0.0, 150.0), (-30.0, 0.0, 150.0), (0.0, 40.0, 170.0), (0.0, -20.0, 200.0)];
/// let body = MarkerBody::new(markers_t.map(|(x, y, z)| Point3::new(x, y, z) * 1e-3).to_vec())?;
/// let mut filter = MarkerFilter::new(body.clone(), MarkerParams::default())?;
/// let pose_ot = Isometry3::new(Vector3::new(0.1, 0.0, 0.3), Vector3::new(0.0, 0.4, 0.0));
/// let mut poses = Vec::new();
/// for i in 0..20 {
///     let mut frame = MarkerFrame::new(i * 5_000_000);
///     for (label, marker) in body.markers_t().iter().enumerate() {
///         frame.see(MarkerObservation { label: label as u32, position: pose_ot * marker });
///     }
///     filter.push(&frame, |pose| poses.push(pose));
/// }
/// filter.finish(|pose| poses.push(pose));
/// assert_eq!(poses.len(), 96);
/// assert!((poses[95].pose_ot.translation.vector - pose_ot.translation.vector).norm() < 1e-12);
/// # Ok::<(), SettingError>(())
/// ```
#[derive(Debug)]
pub struct MarkerFilter {
    body: MarkerBody,
    params: MarkerParams,
    order: SyncParams,
    frames: Stream<MarkerFrame>,
    tracked: Option<TrackedBody>,
    counts: MarkerCounts,
}

/// The body as of the last frame.
#[derive(Clone, Copy, Debug)]
struct TrackedBody {
    stamp_ns: i64,
    /// last time at which its markers determined the pose
    held_ns: i64,
    motion: BodyMotion,
}

impl MarkerFilter {
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(body: MarkerBody, params: MarkerParams) -> Result<Self, SettingError> {
        params.check_for(&body)?;
        let order = SyncParams {
            reorder_ns: params.reorder_ns,
            capacity: HELD_FRAMES,
            ..SyncParams::default()
        };
        let frames = Stream::new(HELD_FRAMES, params.reorder_ns.saturating_add(1));
        Ok(Self {
            body,
            params,
            order,
            frames,
            tracked: None,
            counts: MarkerCounts::default(),
        })
    }

    /// Takes the next frame and gives `each` the poses that no later frame can change, in order of
    /// time.
    pub fn push(&mut self, frame: &MarkerFrame, mut each: impl FnMut(StampedPose)) {
        self.frames.push(*frame, &self.order);
        while self
            .frames
            .held
            .front()
            .is_some_and(|frame| frame.stamp_ns <= self.frames.watermark)
        {
            self.step(&mut each);
        }
    }

    /// Ends the frames: gives the remaining poses.
    pub fn finish(&mut self, mut each: impl FnMut(StampedPose)) {
        self.frames.finish(&self.order);
        while !self.frames.held.is_empty() {
            self.step(&mut each);
        }
    }

    /// Frames and markers by outcome.
    pub fn counts(&self) -> &MarkerCounts {
        &self.counts
    }

    /// Unused frames by reason.
    pub fn frame_counts(&self) -> &SyncCounts {
        &self.frames.counts
    }

    /// Uses the earliest waiting frame.
    fn step(&mut self, each: &mut impl FnMut(StampedPose)) {
        let Some(frame) = self.frames.held.front().copied() else {
            return;
        };
        self.frames.pop();
        let before = self.tracked.take();
        self.tracked = before
            .and_then(|before| self.follow(&before, &frame))
            .or_else(|| self.acquire(&frame));
        match (&before, &self.tracked) {
            (Some(before), Some(now)) if now.motion.frames > 1 => self.give(before, now, each),
            (_, Some(now)) => each(StampedPose {
                stamp_ns: now.stamp_ns,
                pose_ot: now.motion.pose_ot(&self.body),
            }),
            _ => {}
        }
        let count = match &self.tracked {
            None => &mut self.counts.lost,
            Some(tracked) if tracked.held_ns == tracked.stamp_ns => &mut self.counts.held,
            Some(_) => &mut self.counts.coasting,
        };
        *count += 1;
    }

    fn acquire(&mut self, frame: &MarkerFrame) -> Option<TrackedBody> {
        let (pose_ot, matches) = self.body.acquire(frame.seen(), self.params.gate)?;
        self.counts.relabelled += matches.relabelled;
        self.counts.rejected += matches.rejected;
        let motion = BodyMotion::at_rest(&self.body, &pose_ot);
        Some(TrackedBody {
            stamp_ns: frame.stamp_ns,
            held_ns: frame.stamp_ns,
            motion,
        })
    }

    /// Flies the body on to the frame and pulls it by its markers; `None` after too little hold for
    /// too long.
    fn follow(&mut self, before: &TrackedBody, frame: &MarkerFrame) -> Option<TrackedBody> {
        if frame.stamp_ns.saturating_sub(before.held_ns) > self.params.coast_ns {
            return None;
        }
        let dt = frame.stamp_ns.saturating_sub(before.stamp_ns) as f64 * 1e-9;
        let mut motion = before.motion.fly(dt);
        let matches =
            self.body
                .matched(&motion.pose_ot(&self.body), frame.seen(), self.params.gate);
        self.counts.relabelled += matches.relabelled;
        self.counts.rejected += matches.rejected;
        let is_held = self.body.is_held_by(matches.pairs());
        // drift since the last correction of the speed must not count as speed of the last moment
        let since_ns = if is_held {
            before.held_ns
        } else {
            before.stamp_ns
        };
        let since = frame.stamp_ns.saturating_sub(since_ns) as f64 * 1e-9;
        motion.pull(
            &self.body,
            matches.pairs(),
            &self.params.spring,
            self.params.noise,
            since,
        );
        let held_ns = if is_held {
            frame.stamp_ns
        } else {
            before.held_ns
        };
        Some(TrackedBody {
            stamp_ns: frame.stamp_ns,
            held_ns,
            motion,
        })
    }

    /// Poses at the multiples of the period after one frame, up to the next.
    fn give(&self, before: &TrackedBody, now: &TrackedBody, each: &mut impl FnMut(StampedPose)) {
        let period = self.params.period_ns;
        let [from, to] = [before, now].map(|tracked| tracked.motion.pose_ot(&self.body));
        let span = now.stamp_ns.saturating_sub(before.stamp_ns) as f64;
        let mut stamp_ns = (before.stamp_ns.div_euclid(period) + 1).saturating_mul(period);
        while stamp_ns <= now.stamp_ns {
            let pose_ot = interpolated(
                &from,
                &to,
                stamp_ns.saturating_sub(before.stamp_ns) as f64 / span,
            );
            each(StampedPose { stamp_ns, pose_ot });
            let Some(next) = stamp_ns.checked_add(period) else {
                break;
            };
            stamp_ns = next;
        }
    }
}
