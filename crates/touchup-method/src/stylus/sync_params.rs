//! Settings of the synchronisation of streams, and counts of messages without a sample.

use serde::Serialize;

use crate::parameters;

parameters! {
    /// Settings of a [`super::Synchroniser`]; times in ns.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SyncParams in "sync" {
        /// Largest lag of a message behind the newest stamp of its stream; each sample waits for
        /// this time.
        ///
        /// Real transports swap and delay by up to 16 ms.
        reorder_ns: i64 = 20.0, "reorder_ms" [MS, 0, 60000];
        /// Largest time between the two poses around a wrench; a wrench in a longer gap makes no
        /// sample.
        ///
        /// A hand at 50 mm/s goes 1.5 mm, the radius of a usual ball, in 30 ms.
        largest_gap_ns: i64 = 30.0, "largest_gap_ms" [MS, 0, 60000];
        /// Largest step of a stamp ahead of its stream; a message beyond it counts only if the next
        /// four agree with it.
        ///
        /// A stream slower than 10 Hz comes five messages at a time, late and whole.
        largest_jump_ns: i64 = 0.1, "largest_jump_s" [S, 0, 1e6];
        /// Offset of the wrench clock, positive if it is ahead of the pose clock; pairing subtracts
        /// it from the stamps of the wrenches.
        wrench_offset_ns: i64 = 0.0, "wrench_offset_ms" [MS, -60000, 60000];
        /// Drift of the wrench clock from the first wrench on, positive if it gains on the pose
        /// clock; pairing subtracts it beside the offset.
        ///
        /// Two computers without a common clock differ by 100 ppm: after five minutes 30 ms.
        wrench_drift: f64 = 0.0, "wrench_drift_ppm" [PPM, -1000, 1000];
        /// Maximum number of messages held for each stream.
        ///
        /// 4096 are four seconds at 1 kHz, half a megabyte.
        capacity: usize = 4096, "capacity" [MESSAGES, 2, 1e6];
    }
}

/// Messages of one stream without a sample, by reason. Every wrench is in a sample, held, or
/// counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SyncCounts {
    /// Wrenches whose poses before and after are too far apart.
    pub gap: u64,
    /// Wrenches older than the first pose.
    pub no_pose_before: u64,
    /// Wrenches newer than the last pose.
    pub no_pose_after: u64,
    /// Messages later than the reorder window allows.
    pub late: u64,
    /// Messages with the stamp of one already held.
    pub duplicate: u64,
    /// Messages with a NaN or infinite component.
    pub not_finite: u64,
    /// Messages that no stylus can cause, or whose orientation is no rotation.
    pub absurd: u64,
    /// Messages whose stamp leaps ahead without confirmation by the next ones.
    pub jump: u64,
    /// Wrenches dropped from a full buffer, or with dropped poses.
    pub overflow: u64,
}

impl SyncCounts {
    /// Each reason by name, in the order of the fields.
    pub fn reasons(&self) -> [(&'static str, u64); 9] {
        let Self {
            gap,
            no_pose_before,
            no_pose_after,
            late,
            duplicate,
            not_finite,
            absurd,
            jump,
            overflow,
        } = *self;
        [
            ("gap", gap),
            ("no_pose_before", no_pose_before),
            ("no_pose_after", no_pose_after),
            ("late", late),
            ("duplicate", duplicate),
            ("not_finite", not_finite),
            ("absurd", absurd),
            ("jump", jump),
            ("overflow", overflow),
        ]
    }

    /// Sum of all counts.
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }
}
