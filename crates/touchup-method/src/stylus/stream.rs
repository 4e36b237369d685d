//! One stream of messages, sorted and bounded.

use std::collections::VecDeque;

use super::{StampedPose, StampedWrench, SyncCounts, SyncParams};

/// Consecutive messages that together confirm a leap in time: four wrong ones in a row occur in
/// practice.
const AGREEING: usize = 5;
/// Messages that confirm the start of a stream: before it nothing can become late.
const AGREEING_AT_FIRST: usize = 2;
/// Longest time between two agreeing messages, ns: 10 s are a pause, not a fault.
const LONGEST_PAUSE_NS: i64 = 10_000_000_000;

/// One stream in order of time, within its buffer.
#[derive(Debug)]
pub(super) struct Stream<T> {
    pub held: VecDeque<T>,
    newest: Option<i64>,
    /// latest stamp that counts as late
    pub watermark: i64,
    /// leap ahead and agree with each other; wait for confirmation by the next ones
    leapt: Vec<T>,
    /// maximum lag of a message behind the newest, plus one, ns; 0: no lag
    wait_ns: i64,
    /// whether the full buffer dropped messages
    pub overflown: bool,
    pub counts: SyncCounts,
}

impl<T: StampedMessage + Copy> Stream<T> {
    pub(crate) fn new(capacity: usize, wait_ns: i64) -> Self {
        Self {
            held: VecDeque::with_capacity(capacity),
            newest: None,
            watermark: i64::MIN,
            leapt: Vec::with_capacity(AGREEING),
            wait_ns,
            overflown: false,
            counts: SyncCounts::default(),
        }
    }

    /// Takes a message, or counts the reason for refusing it; returns whether it keeps it for now.
    ///
    /// A message that leaps ahead waits for others that agree: one wrong stamp would make all
    /// correct ones late until its time.
    pub(crate) fn push(&mut self, message: T, params: &SyncParams) -> bool {
        let stamp = message.stamp_ns();
        let leap_ns = params.largest_jump_ns.max(params.reorder_ns);
        if self
            .newest
            .is_some_and(|newest| stamp <= newest.saturating_add(leap_ns))
        {
            let is_kept = self.insert(message, params);
            if is_kept {
                self.refuse_leapt();
            }
            return is_kept;
        }
        let agrees = |before: &T| {
            let earliest = before.stamp_ns().saturating_sub(params.reorder_ns);
            (earliest..=before.stamp_ns().saturating_add(LONGEST_PAUSE_NS)).contains(&stamp)
        };
        if !self.leapt.last().is_some_and(agrees) {
            self.refuse_leapt();
        }
        self.leapt.push(message);
        if self.leapt.len()
            == if self.newest.is_some() {
                AGREEING
            } else {
                AGREEING_AT_FIRST
            }
        {
            self.insert_leapt(params);
        }
        true
    }

    /// Ends the stream; keeps messages that no other contradicts.
    pub(crate) fn finish(&mut self, params: &SyncParams) {
        let reached = self
            .newest
            .map(|newest| newest.saturating_add(LONGEST_PAUSE_NS));
        match &self.leapt[..] {
            [only] if reached.is_some_and(|reached| only.stamp_ns() > reached) => {
                self.refuse_leapt()
            }
            _ => self.insert_leapt(params),
        }
    }

    /// Stamp of the newest accepted message, ns.
    pub(crate) fn newest_ns(&self) -> Option<i64> {
        self.newest
    }

    fn refuse_leapt(&mut self) {
        self.counts.jump += self.leapt.len() as u64;
        self.leapt.clear();
    }

    fn insert_leapt(&mut self, params: &SyncParams) {
        for at in 0..self.leapt.len() {
            self.insert(self.leapt[at], params);
        }
        self.leapt.clear();
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
        if self
            .held
            .get(at)
            .is_some_and(|held| held.stamp_ns() == stamp)
        {
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

    /// Drops the messages before the last one at or before `stamp_ns`.
    pub(crate) fn forget_before(&mut self, stamp_ns: i64) {
        while self
            .held
            .get(1)
            .is_some_and(|second| second.stamp_ns() <= stamp_ns)
        {
            self.pop();
        }
    }

    pub(crate) fn pop(&mut self) {
        if let Some(gone) = self.held.pop_front() {
            self.watermark = self.watermark.max(gone.stamp_ns());
        }
    }
}

pub(super) trait StampedMessage {
    /// Whether dropping one is a loss in itself; a dropped pose counts only through a wrench that
    /// needs it.
    const IS_LOST_ALONE: bool;

    fn stamp_ns(&self) -> i64;
}

impl StampedMessage for StampedPose {
    const IS_LOST_ALONE: bool = false;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}

impl StampedMessage for StampedWrench {
    const IS_LOST_ALONE: bool = true;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}
