//! The thread of the patch.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::error::LiveError;
use super::gate::Gate;
use super::probed::{PublishedList, TouchDelta};
use crate::clock::WorkGuard;
use crate::threads::give_way;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::reconstruct::{KnownSurface, PatchDelta, Patcher};
use touchup_method::stylus::ContactSample;

/// Requests to the thread.
pub(super) enum Question {
    /// take in these samples, and answer the changes
    Renew(Vec<ContactSample>),
    /// take a surface for known, and answer the changes
    Know(KnownSurface),
    /// take in the samples of the smoothing window, and answer the changes
    Flush,
    /// answer the changes of a reconstruction of all touches at once, with the samples of the
    /// smoothing window; for another shown scan, answer its patch instead
    Settle,
    /// copy the evidence, with these further samples
    Copy(Vec<ContactSample>, SyncSender<Patcher>),
    /// undo or redo the last stroke, and answer the changes
    ChangeStrokes(fn(&mut Patcher) -> Option<i64>),
    /// continue with another patcher, and answer the changes; stamp of the last sample before, ns
    Replace(Box<Patcher>, i64),
}

/// Answers of the thread.
pub(super) struct WorkerAnswer {
    pub delta: PatchDelta,
    /// the patch of all touches on the shown scan, if that is another
    pub at_rest: Option<PatchDelta>,
    pub probed: TouchDelta,
    /// touch-down of the undone or redone stroke, if there was one, ns
    pub changed_stroke_ns: Option<i64>,
    /// whether the answer includes a new patcher
    pub has_replaced: bool,
    /// duration of a renewal on the thread
    pub took: Duration,
    /// buffer for reuse
    batch: Vec<ContactSample>,
}

/// The scans of a patch, each with the tree over its faces.
#[derive(Debug)]
pub(super) struct PatchedScans {
    /// initial state of the working mesh
    pub working: Arc<(TriMesh, FaceTree)>,
    /// the shown scan, if that is another
    pub shown: Option<Arc<(TriMesh, FaceTree)>>,
}

/// A patcher on a thread of its own. Each request but a copy has one answer, in order.
#[derive(Debug)]
pub(super) struct Worker {
    gate: Gate,
    questions: Sender<(Question, WorkGuard)>,
    answers: Receiver<WorkerAnswer>,
    thread: JoinHandle<Patcher>,
    batches: Vec<Vec<ContactSample>>,
}

/// The patcher and its requests, on the thread.
struct PatchLoop {
    gate: Gate,
    patcher: Patcher,
    scans: PatchedScans,
    published: PublishedList,
    /// time of the far renewal after an answer, which counts for the next
    far: Duration,
}

impl PatchLoop {
    fn run(
        mut self,
        inbox: Receiver<(Question, WorkGuard)>,
        to_engine: &Sender<WorkerAnswer>,
    ) -> Patcher {
        give_way();
        for (question, _working) in inbox {
            let is_renewal = matches!(question, Question::Renew(_));
            let Some(answer) = self.answer(question) else {
                continue;
            };
            if to_engine.send(answer).is_err() {
                break;
            }
            if is_renewal {
                self.gate.note_done();
                // while the next samples come
                let answered = self.gate.now();
                let (scan, tree) = &*self.scans.working;
                self.patcher.renew_far(scan, tree);
                self.far = self.gate.now().saturating_duration_since(answered);
            }
        }
        self.patcher
    }

    /// Serves a request; a copy has no answer.
    fn answer(&mut self, question: Question) -> Option<WorkerAnswer> {
        let patcher = &mut self.patcher;
        let (mut batch, mut changed_stroke_ns, mut has_replaced) = (Vec::new(), None, false);
        let mut begun = self.gate.now();
        let settles = matches!(question, Question::Settle);
        match question {
            Question::Renew(samples) => {
                self.gate.pass();
                begun = self.gate.now();
                samples.iter().for_each(|sample| patcher.push(sample));
                batch = samples;
                batch.clear();
            }
            Question::Copy(samples, to) => {
                let mut copy = patcher.copy();
                samples.iter().for_each(|sample| copy.push(sample));
                // the receiver may be gone
                let _ = to.send(copy);
                return None;
            }
            // valid, as the engine has taken it
            Question::Know(known) => _ = patcher.know(known),
            Question::Flush => patcher.flush(),
            Question::Settle => {}
            Question::ChangeStrokes(change) => changed_stroke_ns = change(patcher),
            Question::Replace(next, last_ns) => {
                let before = std::mem::replace(patcher, *next);
                patcher.take_over(before, last_ns);
                has_replaced = true;
            }
        }
        let (scan, tree) = &*self.scans.working;
        let (delta, at_rest) = match &self.scans.shown {
            _ if !settles => (patcher.renewed(scan, tree), None),
            None => (patcher.settled(scan, tree), None),
            Some(shown) => {
                let patch = patcher.patch_of_all(&shown.0, &shown.1);
                let nothing = PatchDelta {
                    until_ns: patch.until_ns,
                    ..PatchDelta::default()
                };
                (nothing, Some(patch))
            }
        };
        let touches = patcher.probed();
        let probed = if has_replaced {
            self.published.all(touches)
        } else {
            self.published.changes(touches)
        };
        Some(WorkerAnswer {
            delta,
            at_rest,
            probed,
            changed_stroke_ns,
            has_replaced,
            took: self.far + self.gate.now().saturating_duration_since(begun),
            batch,
        })
    }
}

impl Worker {
    pub fn new(scans: PatchedScans, patcher: Patcher, gate: Gate) -> Result<Self, LiveError> {
        let (questions, inbox) = channel();
        let (to_engine, answers) = channel();
        let patch_loop = PatchLoop {
            gate: gate.clone(),
            patcher,
            scans,
            published: PublishedList::default(),
            far: Duration::ZERO,
        };
        let thread = Builder::new()
            .name("patch".to_owned())
            .spawn(move || patch_loop.run(inbox, &to_engine));
        let thread = thread.map_err(|error| LiveError::NoThread(error.to_string()))?;
        Ok(Self {
            gate,
            questions,
            answers,
            thread,
            batches: Vec::new(),
        })
    }

    pub fn empty_batch(&mut self) -> Vec<ContactSample> {
        self.batches.pop().unwrap_or_default()
    }

    /// Sends a request; one more answer follows.
    pub fn ask(&self, question: Question) -> Result<(), LiveError> {
        self.questions
            .send((question, self.gate.begin_work()))
            .map_err(|_| LiveError::Stopped)
    }

    /// Waits for the next answer.
    pub fn answer(&mut self) -> Result<WorkerAnswer, LiveError> {
        let answer = self.answers.recv().map_err(|_| LiveError::Stopped)?;
        Ok(self.emptied(answer))
    }

    /// The next answer, if available.
    pub fn answer_if_there(&mut self) -> Result<Option<WorkerAnswer>, LiveError> {
        match self.answers.try_recv() {
            Ok(answer) => Ok(Some(self.emptied(answer))),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(LiveError::Stopped),
        }
    }

    fn emptied(&mut self, mut answer: WorkerAnswer) -> WorkerAnswer {
        self.batches.push(std::mem::take(&mut answer.batch));
        answer
    }

    pub fn finish(self) -> Result<Patcher, LiveError> {
        drop(self.questions);
        self.thread.join().map_err(|_| LiveError::Stopped)
    }
}
