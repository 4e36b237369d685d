//! Two rates: the haptic update answers every sample at once, the patch follows beside it on a thread of its own.
//!
//! When the patch is renewed, and at which sample its change is taken up, follows from the stamps alone, as long as its thread
//! keeps up. Where that is late the samples go on, and the next renewal takes in all that came meanwhile: the mesh shows a
//! touch later, and what comes out at the end is the same, as it is made of all touches at once. With [`Pace::is_patient`]
//! [`LiveRefiner::push`] waits instead, and the mesh at each sample is the same on every machine.

mod gate;
mod latency;
mod probed;
mod worker;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

pub use gate::{Gate, GateKeeper};
pub use latency::{Latencies, Quantiles};
pub use probed::TouchDelta;
use touchup_core::mesh::{Changes, FaceTree, TriMesh};
use touchup_core::patch::{PatchDelta, Patcher};
use touchup_core::refine::{RefineError, Refiner, Update};
use touchup_core::touch::{Sample, SettingError};
use worker::{Question, Worker, WorkerAnswer};

/// Why a sample was not taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LiveError {
    /// The haptic update refused it.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The system gives no thread.
    #[error("no thread for the patch: {0}; end other programs, or leave `patch` out of the scene")]
    NoThread(String),
    /// The thread of the patch ended.
    #[error("the thread of the patch ended by a fault of touchup: please report it with the recording")]
    Stopped,
}

/// When the patch is renewed, in time of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// time from one renewal to the next, ns
    pub every_ns: i64,
    /// … and from a renewal until its change is taken up, ns: what the thread of the patch has for it
    pub after_ns: i64,
    /// whether samples wait for a change that is late
    pub is_patient: bool,
}

impl Default for Pace {
    /// 8 ms and 10 ms: with a smoothing window of 32 ms to either side, a touch is in the mesh after 50 ms. No sample waits.
    fn default() -> Self {
        Self { every_ns: 8_000_000, after_ns: 10_000_000, is_patient: false }
    }
}

impl Pace {
    fn check(&self) -> Result<(), SettingError> {
        let (every, after) = (self.every_ns as f64, self.after_ns as f64);
        SettingError::check("time between renewals of the patch (ns)", every, every > 0.0, "more than 0")?;
        SettingError::check("time for a renewal of the patch (ns)", after, after >= 0.0, "0 or more")
    }
}

/// Parts of a change of the patch that are taken up at one sample: some 50 µs on a mesh of a million faces.
const AT_ONCE: usize = 40;

/// Renewals that are asked for and not taken up at most, where samples do not wait: one that the thread works at, and one for
/// it to go on with.
const MOST_OPEN: usize = 2;

/// How far the patch was behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiveCounts {
    /// renewals taken up
    pub renewals: u64,
    /// those that were not done when they were due
    pub late: u64,
}

/// Refines a scan by touch, sample by sample, with the patch beside it.
#[derive(Debug)]
pub struct LiveRefiner {
    refiner: Refiner,
    worker: Worker,
    pace: Pace,
    /// samples since the last renewal
    batch: Vec<Sample>,
    /// number of the time between two renewals in which the last sample lies
    slot: Option<i64>,
    /// when the changes that were asked for are to be taken up, ns
    due_ns: VecDeque<i64>,
    /// the change that was taken up last …
    delta: PatchDelta,
    /// … and whether all of it is in the mesh
    is_done: bool,
    /// whether the change that is due is known to be late
    is_late: bool,
    /// touches that nobody asked for yet
    probed: TouchDelta,
    counts: LiveCounts,
}

impl LiveRefiner {
    /// Puts the two side by side; starts the thread.
    ///
    /// - `scan`: as it came, with the tree over its faces; `refiner` was made of the same.
    /// - `room`: for so many new faces memory is taken now; more are taken in all the same, with a pause.
    ///
    /// # Errors
    /// [`LiveError::Setting`], [`LiveError::Refine`] where memory is short, [`LiveError::NoThread`].
    pub fn new(
        scan: Arc<(TriMesh, FaceTree)>,
        refiner: Refiner,
        patcher: Patcher,
        pace: Pace,
        room: usize,
    ) -> Result<Self, LiveError> {
        Self::behind(Gate::default(), scan, refiner, patcher, pace, room)
    }

    /// As [`Self::new`], where each renewal passes a gate.
    ///
    /// # Errors
    /// As there.
    pub fn behind(
        gate: Gate,
        scan: Arc<(TriMesh, FaceTree)>,
        mut refiner: Refiner,
        patcher: Patcher,
        pace: Pace,
        room: usize,
    ) -> Result<Self, LiveError> {
        pace.check()?;
        refiner.expect_patch(room)?;
        Ok(Self {
            refiner,
            worker: Worker::new(scan, patcher, gate)?,
            pace,
            batch: Vec::new(),
            slot: None,
            due_ns: VecDeque::new(),
            delta: PatchDelta::default(),
            is_done: true,
            is_late: false,
            probed: TouchDelta::default(),
            counts: LiveCounts::default(),
        })
    }

    /// Takes the next sample and moves the mesh by what it tells, then by what the patch has found that is due by now.
    ///
    /// # Errors
    /// Those of [`Refiner::push`], by which nothing is changed, and [`LiveError::Stopped`].
    pub fn push(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        let update = self.refiner.push(sample)?;
        let slot = sample.stamp_ns.div_euclid(self.pace.every_ns);
        let has_begun = self.slot.replace(slot).is_some_and(|before| slot > before);
        if has_begun && (self.pace.is_patient || self.due_ns.len() < MOST_OPEN) {
            self.ask(slot.saturating_mul(self.pace.every_ns).saturating_add(self.pace.after_ns))?;
        }
        self.batch.push(*sample);
        if self.is_done && self.due_ns.front().is_some_and(|&due_ns| due_ns <= sample.stamp_ns) {
            self.take_up_due()?;
        }
        self.go_on(AT_ONCE)?;
        Ok(update)
    }

    /// Takes up the change that is due, if it is there or samples wait for it.
    fn take_up_due(&mut self) -> Result<(), LiveError> {
        let there = self.worker.answer_if_there()?;
        if there.is_none() && !std::mem::replace(&mut self.is_late, true) {
            self.counts.late += 1;
        }
        let answer = match there {
            None if self.pace.is_patient => self.worker.answer()?,
            None => return Ok(()),
            Some(answer) => answer,
        };
        self.take_up(answer);
        Ok(())
    }

    /// Takes up some more of the change at hand.
    fn go_on(&mut self, most: usize) -> Result<(), LiveError> {
        if !self.is_done {
            self.is_done = self.refiner.go_on_following(&self.delta, most)?;
        }
        Ok(())
    }

    /// To be called now and then while no sample comes: takes up some more of what the patch has made, and hands it the samples that
    /// it does not know yet. Never waits.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`].
    pub fn rest(&mut self) -> Result<(), LiveError> {
        self.go_on(AT_ONCE)?;
        if !self.is_done {
            return Ok(());
        }
        if let Some(answer) = self.worker.answer_if_there()? {
            self.take_up(answer);
        } else if !self.batch.is_empty() && self.due_ns.len() < MOST_OPEN {
            self.ask(i64::MIN)?;
        }
        Ok(())
    }

    /// Waits until the patch knows all samples so far, as after a pause.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`].
    pub fn catch_up(&mut self) -> Result<(), LiveError> {
        self.ask(i64::MAX)?;
        // the second time for what was taken in only nearby
        for _ in 0..2 {
            self.worker.ask(Question::Flush)?;
            self.due_ns.push_back(i64::MAX);
        }
        self.take_up_all()?;
        Ok(())
    }

    /// Takes the last stroke back, as [`Patcher::undo`], and waits until the mesh is that of the patch before it. Returns
    /// whether there was one.
    ///
    /// # Errors
    /// As [`Self::catch_up`].
    pub fn undo(&mut self) -> Result<bool, LiveError> {
        self.change_strokes(Question::Undo)
    }

    /// Does again what was undone last, as [`Patcher::redo`]. Returns whether there was anything.
    ///
    /// # Errors
    /// As [`Self::catch_up`].
    pub fn redo(&mut self) -> Result<bool, LiveError> {
        self.change_strokes(Question::Redo)
    }

    fn change_strokes(&mut self, question: Question) -> Result<bool, LiveError> {
        self.catch_up()?;
        self.worker.ask(question)?;
        self.due_ns.push_back(i64::MAX);
        self.take_up_all()
    }

    /// Hands the samples over, for a change that is to be taken up at `due_ns`.
    fn ask(&mut self, due_ns: i64) -> Result<(), LiveError> {
        let batch = std::mem::replace(&mut self.batch, self.worker.empty_batch());
        self.worker.ask(Question::Renew(batch))?;
        self.due_ns.push_back(due_ns);
        Ok(())
    }

    /// Takes up all changes that were asked for, as a whole; whether the last one was one of strokes.
    fn take_up_all(&mut self) -> Result<bool, LiveError> {
        self.go_on(usize::MAX)?;
        let mut has_changed_strokes = false;
        while !self.due_ns.is_empty() {
            let answer = self.worker.answer()?;
            has_changed_strokes = answer.has_changed_strokes;
            self.take_up(answer);
            self.go_on(usize::MAX)?;
        }
        Ok(has_changed_strokes)
    }

    fn take_up(&mut self, WorkerAnswer { delta, probed, .. }: WorkerAnswer) {
        self.due_ns.pop_front();
        self.delta = delta;
        self.probed.extend(probed);
        self.counts.renewals += 1;
        self.is_late = false;
        self.is_done = false;
        self.refiner.begin_to_follow(&self.delta);
    }

    /// A copy of what the patch knows of all samples so far, and of nothing that it has made of it: it comes when the thread
    /// has made it. [`Patcher::flush`] and [`Patcher::patched`] make of it what they would make at the end.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn copy_patcher(&self) -> Result<Receiver<Patcher>, LiveError> {
        let (to, copy) = sync_channel(1);
        self.worker.ask(Question::Copy(self.batch.clone(), to))?;
        Ok(copy)
    }

    /// Touches that the patch has found, or lost, since this was last asked.
    pub fn take_probed(&mut self) -> Option<TouchDelta> {
        (!self.probed.is_empty()).then(|| std::mem::take(&mut self.probed))
    }

    /// From here on notes what changes in the mesh, for [`Self::take_changes`].
    pub fn watch(&mut self) {
        self.refiner.watch();
    }

    /// What changed in the mesh since this was last asked, as [`TriMesh::take_changes`].
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> bool {
        self.refiner.take_changes(most, into)
    }

    /// The haptic update, with the mesh as it stands.
    pub fn refiner(&self) -> &Refiner {
        &self.refiner
    }

    /// Whether the mesh is one skin: large changes of the patch are taken up over several samples.
    pub fn is_whole(&self) -> bool {
        self.is_done
    }

    /// The change of the patch that was taken up last.
    pub fn delta(&self) -> &PatchDelta {
        &self.delta
    }

    /// How far the patch was behind.
    pub fn counts(&self) -> LiveCounts {
        self.counts
    }

    /// Ends the thread; gives both back.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn finish(mut self) -> Result<(Refiner, Patcher), LiveError> {
        self.catch_up()?;
        Ok((self.refiner, self.worker.finish()?))
    }
}
