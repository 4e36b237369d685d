//! One stream of messages, sorted and bounded.

use std::collections::VecDeque;

use super::{StampedPose, StampedWrench, SyncCounts, SyncParams};

/// One stream in order of time, as far as it is held.
#[derive(Debug)]
pub(super) struct Stream<T> {
    pub held: VecDeque<T>,
    newest: Option<i64>,
    /// a stamp up to here is late
    pub watermark: i64,
    /// leaps ahead; waits for the next message to agree
    suspect: Option<T>,
    /// how far a message may lag behind the newest, and one more, ns; 0: none may
    wait_ns: i64,
    /// messages were pushed out of the full buffer
    pub overflown: bool,
    pub counts: SyncCounts,
}

impl<T: Stamped + Copy> Stream<T> {
    pub fn new(capacity: usize, wait_ns: i64) -> Self {
        Self {
            held: VecDeque::with_capacity(capacity),
            newest: None,
            watermark: i64::MIN,
            suspect: None,
            wait_ns,
            overflown: false,
            counts: SyncCounts::default(),
        }
    }

    /// Takes a message, or counts why not; whether it is kept, for now at least.
    pub fn push(&mut self, message: T, params: &SyncParams) -> bool {
        let stamp = message.stamp_ns();
        if self.newest.is_some_and(|newest| stamp <= newest.saturating_add(params.largest_jump_ns)) {
            return self.insert(message, params);
        }
        match self.suspect.take() {
            Some(first) if stamp.abs_diff(first.stamp_ns()) <= params.largest_jump_ns as u64 => {
                self.insert(first, params);
                self.insert(message, params)
            }
            refused => {
                self.counts.jump += refused.is_some() as u64;
                self.suspect = Some(message);
                true
            }
        }
    }

    /// A message that no other contradicted is kept.
    pub fn finish(&mut self, params: &SyncParams) {
        match self.suspect.take() {
            Some(only) if self.newest.is_none() => drop(self.insert(only, params)),
            refused => self.counts.jump += refused.is_some() as u64,
        }
    }

    fn insert(&mut self, message: T, params: &SyncParams) -> bool {
        let stamp = message.stamp_ns();
        if stamp <= self.watermark {
            match self.wait_ns {
                0 if self.newest == Some(stamp) => self.counts.duplicate += 1,
                _ => self.counts.late += 1,
            }
            return false;
        }
        let at = self.held.partition_point(|held| held.stamp_ns() < stamp);
        if self.held.get(at).is_some_and(|held| held.stamp_ns() == stamp) {
            self.counts.duplicate += 1;
            return false;
        }
        self.held.insert(at, message);
        let newest = self.newest.map_or(stamp, |newest| newest.max(stamp));
        self.newest = Some(newest);
        self.watermark = self.watermark.max(newest.saturating_sub(self.wait_ns));
        if self.held.len() == params.capacity {
            self.pop();
            self.overflown = true;
            self.counts.overflow += T::IS_LOST_ALONE as u64;
        }
        true
    }

    /// Drops what lies before the last message at or before `stamp_ns`.
    pub fn forget_before(&mut self, stamp_ns: i64) {
        while self.held.get(1).is_some_and(|second| second.stamp_ns() <= stamp_ns) {
            self.pop();
        }
    }

    pub fn pop(&mut self) {
        if let Some(gone) = self.held.pop_front() {
            self.watermark = self.watermark.max(gone.stamp_ns());
        }
    }
}

pub(super) trait Stamped {
    /// Whether dropping one is a loss in itself; a pose is missed only by a wrench that would have needed it.
    const IS_LOST_ALONE: bool;

    fn stamp_ns(&self) -> i64;
}

impl Stamped for StampedPose {
    const IS_LOST_ALONE: bool = false;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}

impl Stamped for StampedWrench {
    const IS_LOST_ALONE: bool = true;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}
