//! Renews a patch beside the samples, and moves its changes into the mesh.

use std::collections::VecDeque;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use super::error::LiveError;
use super::gate::Gate;
use super::probed::TouchDelta;
use super::worker::{PatchedScans, Question, Worker, WorkerAnswer};
use touchup_method::haptic::Refiner;
use touchup_method::reconstruct::{KnownSurface, KnownSurfaces, PatchDelta, Patcher};
use touchup_method::stylus::{ContactSample, SettingError};

/// Parts of a change of the patch per sample: some 100 µs on a mesh of a million faces.
const AT_ONCE: usize = 80;

/// Maximum number of open renewals if samples do not wait: one at work in the thread, and one
/// queued.
const MOST_OPEN: usize = 2;

/// Interval between renewals if samples do not wait, in durations of a renewal: the patch uses a
/// quarter of a core, and leaves the rest of a small machine to the answers.
const TIMES_APART: u32 = 4;
/// Cap on the duration that delays the next renewal: at least 25 a second, as a patch far behind
/// leaves more of the mesh to move sample by sample.
const LONGEST_WORK: Duration = Duration::from_millis(10);

/// Schedule of renewals of the patch, in time of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// time from one renewal to the next, ns
    pub every_ns: i64,
    /// time from a renewal until its change is due, ns: the budget of the thread of the patch
    pub after_ns: i64,
    /// whether samples wait for a late change
    pub is_patient: bool,
}

impl Default for Pace {
    /// 8 ms and 10 ms: with a smoothing window of 32 ms to either side, the mesh shows a touch
    /// after 50 ms and the time to take up the change. No sample waits.
    fn default() -> Self {
        Self {
            every_ns: 8_000_000,
            after_ns: 10_000_000,
            is_patient: false,
        }
    }
}

impl Pace {
    fn check(&self) -> Result<(), SettingError> {
        let (every, after) = (self.every_ns as f64, self.after_ns as f64);
        SettingError::check(
            "time between renewals of the patch (ns)",
            every,
            every > 0.0,
            "more than 0",
        )?;
        SettingError::check(
            "time for a renewal of the patch (ns)",
            after,
            after >= 0.0,
            "0 or more",
        )
    }
}

/// Lag of the patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiveCounts {
    /// renewals taken up
    pub renewals: u64,
    /// renewals not done when due
    pub late: u64,
}

/// Pause of the thread of the patch between renewals, in time of the samples.
#[derive(Debug, Default)]
struct Rest {
    /// duration of the last renewal
    took: Duration,
    until_ns: Option<i64>,
}

impl Rest {
    fn is_over(&self, stamp_ns: i64) -> bool {
        self.until_ns.is_none_or(|until_ns| stamp_ns >= until_ns)
    }

    /// Begins with a renewal.
    fn begin(&mut self, stamp_ns: i64) {
        let rest_ns = (TIMES_APART * self.took.min(LONGEST_WORK)).as_nanos() as i64;
        self.until_ns = Some(stamp_ns.saturating_add(rest_ns));
    }
}

/// The thread of the patch, and the channels to it and from it.
#[derive(Debug)]
pub(super) struct Renewals {
    worker: Worker,
    /// those of the patcher
    known: KnownSurfaces,
    pace: Pace,
    /// samples since the last renewal
    batch: Vec<ContactSample>,
    /// index of the renewal interval of the last sample
    slot: Option<i64>,
    rest: Rest,
    /// due times of the requested changes, ns
    due_ns: VecDeque<i64>,
    /// the current change
    delta: PatchDelta,
    /// whether all of the current change is in the mesh
    pub is_done: bool,
    /// whether another patcher is pending, and the mesh does not show it yet
    pub is_replacing: bool,
    /// whether the current change leads to that patcher
    has_replaced: bool,
    /// stamp up to which the mesh shows the touches, ns
    patched_until_ns: i64,
    /// whether the due change is known to be late
    is_late: bool,
    /// whether the mesh, with the open renewals, equals the patch of all samples made at once
    is_settled: bool,
    /// the received patch of all touches on the shown scan, if that is another
    at_rest: Option<PatchDelta>,
    /// touches not yet requested
    probed: TouchDelta,
    pub counts: LiveCounts,
}

impl Renewals {
    /// Starts the thread.
    pub fn new(
        scans: PatchedScans,
        patcher: Patcher,
        pace: Pace,
        gate: Gate,
    ) -> Result<Self, LiveError> {
        pace.check()?;
        Ok(Self {
            known: patcher.known().clone(),
            worker: Worker::new(scans, patcher, gate)?,
            pace,
            batch: Vec::new(),
            slot: None,
            rest: Rest::default(),
            due_ns: VecDeque::new(),
            delta: PatchDelta::default(),
            is_done: true,
            is_replacing: false,
            has_replaced: false,
            patched_until_ns: i64::MIN,
            is_late: false,
            is_settled: true,
            at_rest: None,
            probed: TouchDelta::default(),
            counts: LiveCounts::default(),
        })
    }

    /// Takes a sample after the haptic update; applies the due change of the patch.
    pub fn push(&mut self, refiner: &mut Refiner, contact: ContactSample) -> Result<(), LiveError> {
        self.is_settled = false;
        let stamp_ns = contact.tip.stamp_ns;
        let slot = stamp_ns.div_euclid(self.pace.every_ns);
        let has_begun = self.slot.replace(slot).is_some_and(|before| slot > before);
        let has_room = self.due_ns.len() < MOST_OPEN && self.rest.is_over(stamp_ns);
        if has_begun && (self.pace.is_patient || has_room) {
            self.rest.begin(stamp_ns);
            self.ask(
                slot.saturating_mul(self.pace.every_ns)
                    .saturating_add(self.pace.after_ns),
            )?;
        }
        self.batch.push(contact);
        if self.is_done
            && self
                .due_ns
                .front()
                .is_some_and(|&due_ns| due_ns <= stamp_ns)
        {
            self.take_up_due(refiner)?;
        }
        self.go_on(refiner, AT_ONCE)
    }

    /// Takes up the due change, if it is available or samples wait for it.
    fn take_up_due(&mut self, refiner: &mut Refiner) -> Result<(), LiveError> {
        let there = self.worker.answer_if_there()?;
        if there.is_none() && !std::mem::replace(&mut self.is_late, true) {
            self.counts.late += 1;
        }
        let answer = match there {
            None if self.pace.is_patient => self.worker.answer()?,
            None => return Ok(()),
            Some(answer) => answer,
        };
        self.take_up(refiner, answer);
        Ok(())
    }

    /// Takes up a further part of the current change.
    fn go_on(&mut self, refiner: &mut Refiner, most: usize) -> Result<(), LiveError> {
        if !self.is_done {
            self.is_done = refiner.go_on_following(&self.delta, most)?;
            if self.is_done {
                self.patched_until_ns = self.delta.until_ns;
                self.is_replacing &= !self.has_replaced;
            }
        }
        Ok(())
    }

    /// As [`super::Engine::rest`].
    pub fn rest(&mut self, refiner: &mut Refiner) -> Result<(), LiveError> {
        self.go_on(refiner, AT_ONCE)?;
        if !self.is_done {
            return Ok(());
        }
        if let Some(answer) = self.worker.answer_if_there()? {
            self.take_up(refiner, answer);
        } else if !self.batch.is_empty() && self.due_ns.len() < MOST_OPEN {
            self.ask(i64::MIN)?;
        }
        Ok(())
    }

    /// As [`super::Engine::settle`].
    pub fn settle(&mut self, refiner: &mut Refiner) -> Result<bool, LiveError> {
        self.rest(refiner)?;
        if !self.is_done || !self.due_ns.is_empty() || !self.batch.is_empty() {
            return Ok(false);
        }
        if !self.is_settled {
            self.is_settled = true;
            self.worker.ask(Question::Settle)?;
            self.due_ns.push_back(i64::MIN);
            return Ok(false);
        }
        Ok(true)
    }

    /// The patch of all touches on the shown scan, once, after its arrival and before further
    /// touches.
    pub fn take_at_rest(&mut self) -> Option<PatchDelta> {
        self.is_settled().then(|| self.at_rest.take())?
    }

    /// Whether the mesh equals the patch of all samples made at once.
    pub fn is_settled(&self) -> bool {
        self.is_settled && self.is_done && self.due_ns.is_empty()
    }

    /// As [`super::Engine::catch_up`].
    pub fn catch_up(&mut self, refiner: &mut Refiner) -> Result<(), LiveError> {
        self.ask(i64::MAX)?;
        // the second time for samples first taken in only nearby
        for _ in 0..2 {
            self.worker.ask(Question::Flush)?;
            self.due_ns.push_back(i64::MAX);
        }
        self.take_up_all(refiner).map(drop)
    }

    /// Undoes or redoes a stroke, for [`super::Engine::undo`] and [`super::Engine::redo`].
    pub fn change_strokes(
        &mut self,
        refiner: &mut Refiner,
        change: fn(&mut Patcher) -> Option<i64>,
    ) -> Result<Option<i64>, LiveError> {
        self.catch_up(refiner)?;
        self.is_settled = false;
        self.worker.ask(Question::ChangeStrokes(change))?;
        self.due_ns.push_back(i64::MAX);
        self.take_up_all(refiner)
    }

    /// As [`super::Engine::know`].
    pub fn know(&mut self, known: KnownSurface) -> Result<(), LiveError> {
        self.known.add(known.clone())?;
        self.is_settled = false;
        self.worker.ask(Question::Know(known))?;
        self.due_ns.push_back(i64::MIN);
        Ok(())
    }

    /// Continues with another patcher, which has all samples; as [`super::Engine::end_replay`].
    ///
    /// - `last_ns`: stamp of the last sample, whether left out or not.
    pub fn replace(&mut self, patcher: Patcher, last_ns: i64) -> Result<(), LiveError> {
        self.batch.clear();
        self.worker
            .ask(Question::Replace(Box::new(patcher), last_ns))?;
        self.due_ns.push_back(i64::MIN);
        (self.is_replacing, self.is_settled) = (true, false);
        Ok(())
    }

    /// Passes the samples on, for a change due at `due_ns`.
    fn ask(&mut self, due_ns: i64) -> Result<(), LiveError> {
        let batch = std::mem::replace(&mut self.batch, self.worker.empty_batch());
        self.worker.ask(Question::Renew(batch))?;
        self.due_ns.push_back(due_ns);
        Ok(())
    }

    /// Takes up all requested changes; returns the touch-down of the stroke of the last one.
    fn take_up_all(&mut self, refiner: &mut Refiner) -> Result<Option<i64>, LiveError> {
        self.go_on(refiner, usize::MAX)?;
        let mut changed_stroke_ns = None;
        while !self.due_ns.is_empty() {
            let answer = self.worker.answer()?;
            changed_stroke_ns = answer.changed_stroke_ns;
            self.take_up(refiner, answer);
            self.go_on(refiner, usize::MAX)?;
        }
        Ok(changed_stroke_ns)
    }

    fn take_up(&mut self, refiner: &mut Refiner, answer: WorkerAnswer) {
        let WorkerAnswer {
            delta,
            at_rest,
            probed,
            has_replaced,
            took,
            ..
        } = answer;
        self.rest.took = took;
        self.has_replaced = has_replaced;
        self.due_ns.pop_front();
        self.at_rest = at_rest;
        self.delta = delta;
        self.probed.extend(probed);
        self.counts.renewals += 1;
        self.is_late = false;
        self.is_done = false;
        refiner.begin_to_follow(&self.delta);
    }

    /// Requests a copy of the evidence of the patch from all samples.
    pub fn copy_patcher(&self, to: SyncSender<Patcher>) -> Result<(), LiveError> {
        self.worker.ask(Question::Copy(self.batch.clone(), to))
    }

    pub fn take_probed(&mut self) -> Option<TouchDelta> {
        (!self.probed.is_empty()).then(|| std::mem::take(&mut self.probed))
    }

    pub fn patched_until_ns(&self) -> Option<i64> {
        // `i64::MIN` before the first touch in the patch
        Some(self.patched_until_ns).filter(|&until_ns| until_ns > i64::MIN)
    }

    pub fn finish(self) -> Result<Patcher, LiveError> {
        self.worker.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One second of samples, with a possible renewal every 8 ms.
    #[test]
    fn long_renewals_are_four_times_what_they_take_apart_or_40_ms() {
        let asked_ms = |took_ms: u64| {
            let mut rest = Rest {
                took: Duration::from_millis(took_ms),
                until_ns: None,
            };
            let mut asked = Vec::new();
            for stamp_ms in (0..1000).step_by(8) {
                let stamp_ns = stamp_ms * 1_000_000;
                if rest.is_over(stamp_ns) {
                    rest.begin(stamp_ns);
                    asked.push(stamp_ms);
                }
            }
            asked
        };
        assert_eq!(asked_ms(2).len(), 125, "each time");
        assert_eq!(asked_ms(10)[..3], [0, 40, 80]);
        assert_eq!(asked_ms(31)[..3], [0, 40, 80]);
    }
}
