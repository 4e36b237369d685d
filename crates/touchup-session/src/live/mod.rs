//! The engine of a session: the haptic update answers every sample at once, the reconstruction (the
//! patch) follows at its own rate.
//!
//! [`Engine`] serves the node, the command line and the report alike; [`Renewal`] sets the time of
//! the patch: once at the end, or repeatedly on a thread of its own. Then the stamps alone decide
//! when the patch renews and at which sample the mesh takes up its change, as long as the thread
//! keeps up. If the thread is late the samples go on, and the next renewal takes in all samples
//! since: the mesh shows a touch later, and the result at the end is the same, as it uses all
//! touches at once. With [`Pace::is_patient`] [`Engine::push`] waits instead, and the mesh at each
//! sample is the same on every machine.

mod detail;
mod error;
mod evidence_replay;
mod gate;
mod kept_samples;
mod latency;
mod probed;
mod renewals;
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
use touchup_geometry::mesh::{Changes, FaceId, FaceTree, TriMesh, VertexId};
use touchup_method::haptic::{Footprint, RefineCounts, RefineError, RefineParams, Refiner, Update};
use touchup_method::reconstruct::{KnownSurface, Patcher, PatcherParams, Support};
use touchup_method::stylus::{BiasParams, ContactSample, Sample};
use worker::PatchedScans;

/// Schedule of the patch of an [`Engine`].
#[derive(Clone, Debug)]
pub enum Renewal {
    /// once, of all touches, by [`Engine::finish`]
    AtEnd,
    /// repeatedly, on a thread of its own
    Beside {
        /// the scan, with the tree over its faces
        scan: Arc<(TriMesh, FaceTree)>,
        /// schedule in time of the samples
        pace: Pace,
        /// memory reserved at the start, in new faces; beyond that it grows, with a pause
        room: usize,
        /// gate before each renewal
        gate: Gate,
    },
}

/// Refines a scan by touch, sample by sample, with or without a patch.
#[derive(Debug)]
pub struct Engine {
    refiner: Refiner,
    patch: Reconstruction,
    /// last sample, answered by [`Self::answer`] and pending for [`Self::follow`]
    answered: Option<ContactSample>,
    /// `None`: the haptic update works on the scan itself
    detail: Option<Detail>,
    /// settings of the patch beside the samples
    patch_params: Option<PatcherParams>,
    /// samples since [`Self::begin_replay`]
    since_replay: Option<KeptSamples>,
    /// touch-down of the last undone or redone stroke, ns
    changed_stroke_ns: Option<i64>,
}

/// Final state of an [`Engine`].
#[derive(Debug)]
pub struct FinishedEngine {
    /// the haptic update after the last sample
    pub refiner: Refiner,
    /// all touches; `None` without a patch
    pub patcher: Option<Patcher>,
    detail: Option<Detail>,
}

/// Result of an [`Engine`].
#[derive(Debug)]
pub enum EngineResult {
    /// contacts for the patch
    Touched(Box<Patcher>),
    /// the scan moved by the haptic update: without a patch, or without a contact
    Moved(Box<TriMesh>),
}

impl FinishedEngine {
    /// The scan moved by the haptic update alone.
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
    /// Starts without touches. If a patch needs the slow drift of the sensor and `refine` has no
    /// settings for it, patch and haptic update use the default ones.
    ///
    /// - `mesh`: the scan.
    /// - `patch`: `None` for the haptic update alone, which ignores `renewal`.
    ///
    /// # Errors
    /// [`LiveError::Setting`], [`LiveError::Refine`] for settings and short memory,
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
        let patch_params = patch.clone().filter(|_| shared.is_some());
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

    /// Takes the next sample and moves the mesh, then applies the due change of the patch:
    /// [`Self::answer`], then [`Self::follow`].
    ///
    /// # Errors
    /// Those of [`Refiner::push`], which change nothing, and [`LiveError::Stopped`].
    pub fn push(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        let update = self.answer(sample)?;
        self.follow()?;
        Ok(update)
    }

    /// Takes the next sample and moves the mesh. Leaves other work to [`Self::follow`], and first
    /// calls it for a pending earlier sample.
    ///
    /// # Errors
    /// Those of [`Self::push`].
    pub fn answer(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        self.follow()?;
        let update = self.refiner.push(sample)?;
        self.answered = self.refiner.contacts().latest().copied();
        self.since_replay
            .iter_mut()
            .for_each(|since| since.push(sample));
        Ok(update)
    }

    /// Does the work left by [`Self::answer`] before the next sample: passes the sample to the
    /// patch, applies the due change of the patch, and prepares for the likely next sample.
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

    /// For regular calls while no sample comes: applies more of the changes of the patch, and
    /// passes new samples to it. Never waits.
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

    /// Makes the mesh, after a longer pause of the stream, bit by bit equal to [`Patcher::patched`]
    /// of all samples, as in a result file; returns whether it is. The next sample may come at any
    /// time, with the same effect as without settling. Never waits; without a patch beside the
    /// samples it does nothing. If the haptic update works on a simplified scan, the mesh follows
    /// by [`Self::take_changes`].
    ///
    /// # Errors
    /// Those of [`Self::rest`].
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

    /// Whether the mesh equals a result file of all samples, or will by [`Self::take_changes`].
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

    /// Waits until the mesh shows a patch of all samples, as after a pause; does nothing for a
    /// patch at the end.
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

    /// Takes a surface for known, as [`Patcher::know`]; without a patch it does nothing.
    ///
    /// # Errors
    /// [`LiveError::Known`], [`LiveError::Stopped`].
    pub fn know(&mut self, known: KnownSurface) -> Result<(), LiveError> {
        match &mut self.patch {
            Reconstruction::Without => Ok(()),
            Reconstruction::AtEnd(patcher) => Ok(patcher.know(known)?),
            Reconstruction::Beside(renewals) => renewals.know(known),
        }
    }

    /// Enables undo of strokes from now on; with a patch it is always possible.
    pub fn keep_strokes(&mut self) {
        if matches!(self.patch, Reconstruction::Without) {
            self.refiner.keep_strokes();
        }
    }

    /// Undoes the last stroke, as [`Patcher::undo`], and waits until the mesh shows the earlier
    /// patch. Returns whether there was a stroke.
    ///
    /// # Errors
    /// Those of [`Self::catch_up`].
    pub fn undo(&mut self) -> Result<bool, LiveError> {
        self.change_strokes(Refiner::undo, evidence_replay::undo)
    }

    /// Redoes the last undone stroke, as [`Patcher::redo`]. Returns whether there was one.
    ///
    /// # Errors
    /// Those of [`Self::catch_up`].
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

    /// Touch-down of the stroke changed by the last [`Self::undo`] or [`Self::redo`], ns; `None` if
    /// it changed none, and without a patch.
    pub fn changed_stroke_ns(&self) -> Option<i64> {
        self.changed_stroke_ns
    }

    /// Evidence of a patch at the end, once there is a contact, with the current counts: the patch
    /// replaces any further haptic update. `None` before, and without such a patch.
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

    /// Begins to rebuild the evidence beside the samples: the returned replay takes all samples,
    /// except the ones to leave out, on any thread, and comes back by [`Self::end_replay`]. Until
    /// then the engine keeps new samples, up to a maximum. `None` without a patch beside the
    /// samples.
    ///
    /// # Errors
    /// [`LiveError::Stopped`], [`LiveError::Refine`], [`LiveError::Setting`].
    pub fn begin_replay(&mut self) -> Result<Option<EvidenceReplay>, LiveError> {
        let Some(patch) = self.patch_params.clone() else {
            return Ok(None);
        };
        self.follow()?;
        let replay = EvidenceReplay::new(self.refiner.fresh_contacts()?, patch)?;
        self.since_replay = Some(KeptSamples::default());
        Ok(Some(replay))
    }

    /// Replaces evidence and estimates by `replay` and the samples since its begin, as if there had
    /// never been others; `None` leaves them. The mesh follows by the next calls, see
    /// [`Self::is_replacing`]. Never waits for the patch.
    ///
    /// Returns 0, or the number of samples since the begin if they exceed the maximum: then
    /// evidence and estimates stay too.
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
            .contacts()
            .latest()
            .map_or(i64::MIN, |contact| contact.tip.stamp_ns);
        self.refiner.set_contacts(contacts);
        renewals.replace(patcher, last_ns).map(|()| 0)
    }

    /// Whether the mesh does not show the evidence of [`Self::end_replay`] yet.
    pub fn is_replacing(&self) -> bool {
        self.renewals()
            .is_some_and(|renewals| renewals.is_replacing)
    }

    /// A copy of the evidence of the patch from all samples, without results; the thread sends it
    /// when ready. [`Patcher::flush`] and [`Patcher::patched`] give the same result as at the end.
    /// `None` without a patch or a touch.
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

    /// Touches that the patch beside the samples added or removed since the last call.
    pub fn take_probed(&mut self) -> Option<TouchDelta> {
        if let Reconstruction::Beside(renewals) = &mut self.patch {
            renewals.take_probed()
        } else {
            None
        }
    }

    /// Starts to record changes of the mesh for [`Self::take_changes`].
    pub fn watch(&mut self) {
        self.refiner.watch();
        self.detail.iter_mut().for_each(Detail::watch);
    }

    /// Changes of [`Self::mesh`] since the last call, as [`TriMesh::take_changes`]. On a simplified
    /// scan this call makes the mesh follow the haptic update.
    ///
    /// # Errors
    /// [`LiveError::Refine`] if memory is short.
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> Result<bool, LiveError> {
        match &mut self.detail {
            None => Ok(self.refiner.take_changes(most, into)),
            Some(detail) => Ok(detail
                .take_changes(&mut self.refiner, most, into)
                .map_err(RefineError::from)?),
        }
    }

    /// The shown mesh: of the haptic update; on a simplified scan, after [`Self::watch`], the scan
    /// itself in its current state.
    pub fn mesh(&self) -> &TriMesh {
        self.detail
            .as_ref()
            .and_then(Detail::shown)
            .unwrap_or_else(|| self.refiner.mesh())
    }

    /// Lower bound on the number of changes of [`Self::mesh`] since [`Self::watch`]: it grows with
    /// each pending change.
    pub fn edits(&self) -> u64 {
        self.refiner.mesh().edits() + self.detail.as_ref().map_or(0, Detail::rests)
    }

    /// A face of [`Self::mesh`] that shows a face of the haptic update; `None` if there is none
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

    /// Whether the mesh is complete: large changes of the patch take several samples.
    pub fn is_whole(&self) -> bool {
        self.renewals().is_none_or(|renewals| renewals.is_done)
    }

    /// Support of a vertex. Without a patch, or before it knows, a vertex moved from its scan
    /// position counts as touched, or as guessed from touches.
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

    /// Stamp up to which the mesh shows all touches of the patch, ns; `None` before its first
    /// touch, and for a patch at the end.
    pub fn patched_until_ns(&self) -> Option<i64> {
        self.renewals()?.patched_until_ns()
    }

    /// Lag of the patch beside the samples.
    pub fn counts(&self) -> LiveCounts {
        self.renewals()
            .map(|renewals| renewals.counts)
            .unwrap_or_default()
    }

    /// Memory of the mesh under refinement, and of its full scan.
    pub fn footprint(&self) -> Footprint {
        let working = self.refiner.footprint();
        Footprint {
            mesh: working.mesh + self.detail.as_ref().map_or(0, Detail::bytes),
            ..working
        }
    }

    /// Ends the thread, if there is one; returns the state after the last sample.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn finish(mut self) -> Result<FinishedEngine, LiveError> {
        self.catch_up()?;
        let patcher = match self.patch {
            Reconstruction::Without => None,
            Reconstruction::AtEnd(patcher) => Some(*patcher),
            Reconstruction::Beside(renewals) => Some(renewals.finish()?),
        };
        Ok(FinishedEngine {
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
