//! The engine of a session: the haptic update answers every sample at once, the reconstruction (the
//! patch) follows at its own rate.
//!
//! [`Engine`] is all of it, for the node, the command line and the report alike; [`Renewal`] says
//! when the patch is made: once at the end, or again and again on a thread of its own. Then the
//! stamps alone decide when it is renewed and at which sample its change is taken up, as long as
//! the thread keeps up. Where the thread is late the samples go on, and the next renewal takes in
//! all samples since: the mesh shows a touch later, and the result at the end is the same, as it is
//! made of all touches at once. With [`Pace::is_patient`] [`Engine::push`] waits instead, and the
//! mesh at each sample is the same on every machine.

mod detail;
mod error;
mod evidence_replay;
mod gate;
mod kept_samples;
mod latency;
mod probed;
mod renewals;
mod shown;
mod worker;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

use detail::Detail;
pub use error::LiveError;
pub use evidence_replay::EvidenceReplay;
pub use gate::{Gate, GateKeeper};
use kept_samples::KeptSamples;
pub use latency::{Latencies, Quantiles};
pub use probed::TouchDelta;
use renewals::Renewals;
pub use renewals::{LiveCounts, Pace};
use touchup_core::haptic::{Footprint, RefineCounts, RefineError, RefineParams, Refiner, Update};
use touchup_core::mesh::{Changes, FaceId, FaceTree, TriMesh, VertexId};
use touchup_core::reconstruct::{Patcher, PatcherParams, Support};
use touchup_core::stylus::{BiasParams, ContactSample, Sample};
use worker::PatchedScans;

/// When the patch of an [`Engine`] is made.
#[derive(Clone, Debug)]
pub enum Renewal {
    /// once, of all touches, by [`Engine::finish`]
    AtEnd,
    /// again and again, on a thread of its own
    Beside {
        /// the scan, with the tree over its faces
        scan: Arc<(TriMesh, FaceTree)>,
        /// when, in time of the samples
        pace: Pace,
        /// memory reserved at the start, in new faces; beyond that it grows, with a pause
        room: usize,
        /// what each renewal passes
        gate: Gate,
    },
}

/// Refines a scan by touch, sample by sample, with or without a patch.
#[derive(Debug)]
pub struct Engine {
    refiner: Refiner,
    patch: Reconstruction,
    /// the sample that was answered and not followed
    answered: Option<ContactSample>,
    /// `None`: the haptic update works on the scan itself
    detail: Option<Detail>,
    /// of the patch beside the samples
    patch_params: Option<PatcherParams>,
    /// samples since [`Self::begin_replay`]
    since_replay: Option<KeptSamples>,
    /// touch-down of the stroke that was taken back or done again last, ns
    changed_stroke_ns: Option<i64>,
}

/// What an [`Engine`] leaves behind.
#[derive(Debug)]
pub struct Ended {
    /// the haptic update after the last sample
    pub refiner: Refiner,
    /// all that was touched; `None` without a patch
    pub patcher: Option<Patcher>,
    detail: Option<Detail>,
}

/// Result of an [`Engine`].
#[derive(Debug)]
pub enum EngineResult {
    /// contacts, of which the patch is made
    Touched(Box<Patcher>),
    /// the scan as the haptic update has moved it: without a patch, or without a contact
    Moved(Box<TriMesh>),
}

impl Ended {
    /// The scan as the haptic update alone has moved it.
    pub fn mesh(&self) -> Cow<'_, TriMesh> {
        let moved = self.refiner.mesh();
        self.detail.as_ref().map_or(Cow::Borrowed(moved), |detail| {
            Cow::Owned(detail.moved_as(moved))
        })
    }

    /// The result.
    pub fn into_result(mut self) -> EngineResult {
        let has_contacts = self.refiner.counts().contacts > 0;
        match self.patcher.take().filter(|_| has_contacts) {
            Some(patcher) => EngineResult::Touched(patcher.into()),
            None => EngineResult::Moved(self.mesh().into_owned().into()),
        }
    }
}

#[derive(Debug)]
enum Reconstruction {
    Without,
    AtEnd(Box<Patcher>),
    Beside(Box<Renewals>),
}

impl Engine {
    /// Nothing touched yet. Where a patch needs the slow drift of the sensor and `refine` names no
    /// settings for it, it is followed by the default ones, for patch and haptic update alike.
    ///
    /// - `mesh`: the scan.
    /// - `patch`: `None`: the haptic update alone; `renewal` is of no use then.
    ///
    /// # Errors
    /// [`LiveError::Setting`], [`LiveError::Refine`] for settings and where memory is short,
    /// [`LiveError::NoThread`].
    pub fn new(
        mesh: TriMesh,
        mut refine: RefineParams,
        patch: Option<PatcherParams>,
        renewal: Renewal,
    ) -> Result<Self, LiveError> {
        if patch.is_some() {
            refine.bias = refine.bias.or(refine.gate.map(|_| BiasParams::default()));
        }
        let shared = if let Renewal::Beside { scan, .. } = &renewal {
            Some(scan)
        } else {
            None
        };
        let (working, detail) = Detail::of(mesh, shared, &mut refine).map_err(RefineError::from)?;
        let mut refiner = Refiner::new(working, refine)?;
        let patch_params = patch.filter(|_| shared.is_some());
        let patch = match (patch.map(Patcher::new).transpose()?, renewal) {
            (None, _) => Reconstruction::Without,
            (Some(patcher), Renewal::AtEnd) => Reconstruction::AtEnd(Box::new(patcher)),
            (
                Some(patcher),
                Renewal::Beside {
                    scan,
                    pace,
                    room,
                    gate,
                },
            ) => {
                refiner.expect_patch(room)?;
                let scans = match &detail {
                    None => PatchedScans {
                        working: scan,
                        shown: None,
                    },
                    Some(detail) => PatchedScans {
                        working: detail.working_scan(),
                        shown: Some(scan),
                    },
                };
                Reconstruction::Beside(Box::new(Renewals::new(scans, patcher, pace, gate)?))
            }
        };
        Ok(Self {
            refiner,
            patch,
            answered: None,
            detail,
            patch_params,
            since_replay: None,
            changed_stroke_ns: None,
        })
    }

    /// Takes the next sample and moves the mesh by it, then by the change of the patch that is due:
    /// [`Self::answer`], then [`Self::follow`].
    ///
    /// # Errors
    /// Those of [`Refiner::push`], by which nothing is changed, and [`LiveError::Stopped`].
    pub fn push(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        let update = self.answer(sample)?;
        self.follow()?;
        Ok(update)
    }

    /// Takes the next sample and moves the mesh by it. What is not due at once is left to
    /// [`Self::follow`], which is called first where the sample before still needs it.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn answer(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        self.follow()?;
        let update = self.refiner.push(sample)?;
        self.answered = self.refiner.contact().copied();
        self.since_replay
            .iter_mut()
            .for_each(|since| since.push(sample));
        Ok(update)
    }

    /// Does what [`Self::answer`] has left for the time until the next sample: passes the sample to
    /// the patch, moves the mesh by the change of the patch that is due, and makes ready what the
    /// next sample is likely to need.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`].
    pub fn follow(&mut self) -> Result<(), LiveError> {
        let Some(contact) = self.answered.take() else {
            return Ok(());
        };
        match &mut self.patch {
            Reconstruction::Without => {}
            Reconstruction::AtEnd(patcher) => patcher.push(&contact),
            Reconstruction::Beside(renewals) => {
                renewals.push(&mut self.refiner, contact)?;
                self.refiner.look_ahead();
            }
        }
        Ok(())
    }

    /// To be called now and then while no sample comes: applies more of the changes of the patch,
    /// and passes it the samples that it does not know yet. Never waits.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`].
    pub fn rest(&mut self) -> Result<(), LiveError> {
        self.follow()?;
        if let Reconstruction::Beside(renewals) = &mut self.patch {
            renewals.rest(&mut self.refiner)
        } else {
            Ok(())
        }
    }

    /// As [`Self::rest`], where the stream has rested for longer: the mesh becomes, bit by bit,
    /// what [`Patcher::patched`] makes of all samples so far, as a file of the result shows it.
    /// Returns whether it is that. The next sample may come at any time, and what it changes is as
    /// if nothing had been settled. Never waits; without a patch beside the samples there is
    /// nothing to do. Where the haptic update works on a simplified scan, the mesh becomes that by
    /// [`Self::take_changes`].
    ///
    /// # Errors
    /// As [`Self::rest`].
    pub fn settle(&mut self) -> Result<bool, LiveError> {
        self.follow()?;
        let Reconstruction::Beside(renewals) = &mut self.patch else {
            return Ok(true);
        };
        let is_settled = renewals.settle(&mut self.refiner)?;
        if let (Some(detail), Some(patch)) = (&mut self.detail, renewals.take_at_rest()) {
            detail.rest(patch, &self.refiner);
        }
        Ok(is_settled)
    }

    /// Whether the mesh is what a file of all samples so far shows, or becomes so by
    /// [`Self::take_changes`].
    pub fn is_settled(&self) -> bool {
        match (&self.patch, &self.detail) {
            (Reconstruction::Without, _) => true,
            (Reconstruction::AtEnd(_), _) => false,
            (Reconstruction::Beside(_), _) if self.answered.is_some() => false,
            (Reconstruction::Beside(renewals), None) => renewals.is_settled(),
            (Reconstruction::Beside(renewals), Some(detail)) => {
                let is_untouched = renewals.counts.renewals == 0;
                renewals.is_settled() && (is_untouched || detail.is_resting(&self.refiner))
            }
        }
    }

    /// Waits until the mesh shows a patch of all samples so far, as after a pause; does nothing
    /// where the patch is made at the end.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`].
    pub fn catch_up(&mut self) -> Result<(), LiveError> {
        self.follow()?;
        if let Reconstruction::Beside(renewals) = &mut self.patch {
            renewals.catch_up(&mut self.refiner)
        } else {
            Ok(())
        }
    }

    /// Keeps what it takes to undo strokes from here on; a patch keeps it in any case.
    pub fn keep_strokes(&mut self) {
        if matches!(self.patch, Reconstruction::Without) {
            self.refiner.keep_strokes();
        }
    }

    /// Takes the last stroke back, as [`Patcher::undo`], and waits until the mesh is that of the
    /// patch before it. Returns whether there was one.
    ///
    /// # Errors
    /// As [`Self::catch_up`].
    pub fn undo(&mut self) -> Result<bool, LiveError> {
        self.change_strokes(Refiner::undo, evidence_replay::undo)
    }

    /// Redoes the last undone stroke, as [`Patcher::redo`]. Returns whether there was anything.
    ///
    /// # Errors
    /// As [`Self::catch_up`].
    pub fn redo(&mut self) -> Result<bool, LiveError> {
        self.change_strokes(Refiner::redo, evidence_replay::redo)
    }

    fn change_strokes(
        &mut self,
        of_refiner: fn(&mut Refiner) -> bool,
        of_patcher: fn(&mut Patcher) -> Option<i64>,
    ) -> Result<bool, LiveError> {
        self.follow()?;
        self.changed_stroke_ns = match &mut self.patch {
            Reconstruction::Without => {
                self.changed_stroke_ns = None;
                return Ok(of_refiner(&mut self.refiner));
            }
            Reconstruction::AtEnd(patcher) => of_patcher(patcher),
            Reconstruction::Beside(renewals) => {
                renewals.change_strokes(&mut self.refiner, of_patcher)?
            }
        };
        Ok(self.changed_stroke_ns.is_some())
    }

    /// Touch-down of the stroke that the last call of [`Self::undo`] or [`Self::redo`] took back or
    /// did again, ns; `None` where it did nothing, and without a patch.
    pub fn changed_stroke_ns(&self) -> Option<i64> {
        self.changed_stroke_ns
    }

    /// Evidence of a patch that is made at the end, once there is a contact, with the
    /// counts so far: the patch replaces whatever the haptic update would do. `None` before, and
    /// without such a patch.
    pub fn touched_evidence(&self) -> Option<(EvidenceReplay, RefineCounts)> {
        let counts = *self.refiner.counts();
        let Reconstruction::AtEnd(patcher) = &self.patch else {
            return None;
        };
        (counts.contacts > 0).then(|| {
            let evidence = EvidenceReplay {
                contacts: self.refiner.contacts().clone(),
                patcher: patcher.copy(),
            };
            (evidence, counts)
        })
    }

    /// Begins to make the evidence again beside the samples: what is returned takes all samples so
    /// far but those to be left out, on any thread, and comes back with [`Self::end_replay`]. Until
    /// then the samples are kept, as far as there is room for them. `None` without a patch beside
    /// them.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`], [`LiveError::Setting`].
    pub fn begin_replay(&mut self) -> Result<Option<EvidenceReplay>, LiveError> {
        let Some(patch) = self.patch_params else {
            return Ok(None);
        };
        self.follow()?;
        let replay = EvidenceReplay::new(self.refiner.fresh_contacts()?, patch)?;
        self.since_replay = Some(KeptSamples::default());
        Ok(Some(replay))
    }

    /// Evidence and estimates become those of `replay` and of the samples since it was begun, as if
    /// there had never been others; `None` leaves them. The mesh follows with the next calls, see
    /// [`Self::is_replacing`]. Never waits for the patch.
    ///
    /// Returns how many samples came since it was begun where they were too many to be kept: they
    /// are left as well then. Else 0.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn end_replay(&mut self, replay: Option<EvidenceReplay>) -> Result<u64, LiveError> {
        self.follow()?;
        let since = self.since_replay.take().unwrap_or_default();
        let (Some(mut replay), Reconstruction::Beside(renewals)) = (replay, &mut self.patch) else {
            return Ok(0);
        };
        match since.all() {
            // a refused sample changes nothing
            Ok(samples) => samples.iter().for_each(|sample| _ = replay.push(sample)),
            Err(dropped) => return Ok(dropped),
        }
        let EvidenceReplay { contacts, patcher } = replay;
        let last_ns = self
            .refiner
            .contact()
            .map_or(i64::MIN, |contact| contact.tip.stamp_ns);
        self.refiner.set_contacts(contacts);
        renewals.replace(patcher, last_ns).map(|()| 0)
    }

    /// Whether the mesh does not show yet what [`Self::end_replay`] has put in place.
    pub fn is_replacing(&self) -> bool {
        self.renewals()
            .is_some_and(|renewals| renewals.is_replacing)
    }

    /// A copy of the evidence of the patch from all samples so far, without its results: it comes
    /// when the thread has made it. [`Patcher::flush`] and [`Patcher::patched`] make of it what
    /// they would make at the end. `None` without a patch, or where nothing was touched.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn copy_patcher(&mut self) -> Result<Option<Receiver<Patcher>>, LiveError> {
        self.follow()?;
        if self.refiner.counts().contacts == 0 {
            return Ok(None);
        }
        let (to, copy) = sync_channel(1);
        match &self.patch {
            Reconstruction::Without => return Ok(None),
            Reconstruction::AtEnd(patcher) => drop(to.send(patcher.copy())),
            Reconstruction::Beside(renewals) => renewals.copy_patcher(to)?,
        }
        Ok(Some(copy))
    }

    /// Touches that the patch beside the samples has added or removed since the last call.
    pub fn take_probed(&mut self) -> Option<TouchDelta> {
        if let Reconstruction::Beside(renewals) = &mut self.patch {
            renewals.take_probed()
        } else {
            None
        }
    }

    /// From here on notes what changes in the mesh, for [`Self::take_changes`].
    pub fn watch(&mut self) {
        self.refiner.watch();
        self.detail.iter_mut().for_each(Detail::watch);
    }

    /// Changes of [`Self::mesh`] since the last call, as [`TriMesh::take_changes`]. Where the
    /// haptic update works on a simplified scan, the mesh follows it by this.
    ///
    /// # Errors
    /// [`LiveError::Refine`] where memory is short.
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> Result<bool, LiveError> {
        match &mut self.detail {
            None => Ok(self.refiner.take_changes(most, into)),
            Some(detail) => Ok(detail
                .take_changes(&mut self.refiner, most, into)
                .map_err(RefineError::from)?),
        }
    }

    /// The mesh to look at: that of the haptic update, and where this works on a simplified scan
    /// and [`Self::watch`] was called, the scan itself as far as it has followed.
    pub fn mesh(&self) -> &TriMesh {
        self.detail
            .as_ref()
            .and_then(Detail::shown)
            .unwrap_or_else(|| self.refiner.mesh())
    }

    /// How often [`Self::mesh`] was changed since [`Self::watch`], at least: it grows with each
    /// change to be taken.
    pub fn edits(&self) -> u64 {
        self.refiner.mesh().edits() + self.detail.as_ref().map_or(0, Detail::rests)
    }

    /// A face of [`Self::mesh`] that shows a face of the haptic update; `None`: it is not shown
    /// yet.
    pub fn shown_face(&self, face: FaceId) -> Option<FaceId> {
        self.detail
            .as_ref()
            .map_or(Some(face), |detail| detail.face(face))
    }

    /// The haptic update, with the current mesh.
    pub fn refiner(&self) -> &Refiner {
        &self.refiner
    }

    /// Whether the mesh is one skin: large changes of the patch are taken up over several samples.
    pub fn is_whole(&self) -> bool {
        self.renewals().is_none_or(|renewals| renewals.is_done)
    }

    /// Support of a vertex. Where there is no patch, or it does not know yet, a vertex that is not
    /// where the scan has it counts as touched, or as guessed from touches.
    ///
    /// - `scan`: unrefined.
    pub fn support(&self, scan: &TriMesh, vertex: VertexId) -> Support {
        let is_moved = || {
            let was = scan.positions().get(vertex.0 as usize);
            was.is_none_or(|was| *was != self.mesh().position(vertex))
        };
        let support = match &self.detail {
            None => self.refiner.support(vertex),
            Some(_) if matches!(self.patch, Reconstruction::Without) => None,
            Some(detail) => Some(detail.support(&self.refiner, vertex).unwrap_or_default()),
        };
        match support {
            None if is_moved() => Support::Touched,
            Some(Support::Scan) if is_moved() => Support::Guessed,
            support => support.unwrap_or(Support::Scan),
        }
    }

    /// Stamp up to which the mesh shows all that the patch knows, ns; `None` before the patch has
    /// seen a touch, and where it is made at the end.
    pub fn patched_until_ns(&self) -> Option<i64> {
        self.renewals()?.patched_until_ns()
    }

    /// Lag of the patch beside the samples.
    pub fn counts(&self) -> LiveCounts {
        self.renewals()
            .map(|renewals| renewals.counts)
            .unwrap_or_default()
    }

    /// Memory of the mesh under refinement, and of the scan that it stands for.
    pub fn footprint(&self) -> Footprint {
        let working = self.refiner.footprint();
        Footprint {
            mesh: working.mesh + self.detail.as_ref().map_or(0, Detail::bytes),
            ..working
        }
    }

    /// Ends the thread, if there is one; gives back what there is after the last sample.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn finish(mut self) -> Result<Ended, LiveError> {
        self.catch_up()?;
        let patcher = match self.patch {
            Reconstruction::Without => None,
            Reconstruction::AtEnd(patcher) => Some(*patcher),
            Reconstruction::Beside(renewals) => Some(renewals.finish()?),
        };
        Ok(Ended {
            refiner: self.refiner,
            patcher,
            detail: self.detail,
        })
    }

    fn renewals(&self) -> Option<&Renewals> {
        if let Reconstruction::Beside(renewals) = &self.patch {
            Some(renewals)
        } else {
            None
        }
    }
}
