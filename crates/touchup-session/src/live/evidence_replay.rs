//! Evidence of samples without a mesh; rebuilding it can leave out samples.

use touchup_method::reconstruct::{KnownSurface, KnownSurfaceError, Patcher, PatcherParams};
use touchup_method::stylus::{ContactEstimator, ContactSample, Sample, SampleError, SettingError};

/// Takes samples like an [`super::Engine`], without moving a mesh.
#[derive(Clone, Debug)]
pub struct EvidenceReplay {
    pub(super) contacts: ContactEstimator,
    pub(super) patcher: Patcher,
}

impl EvidenceReplay {
    /// Nothing touched yet.
    ///
    /// - `contacts`: without any sample.
    ///
    /// # Errors
    /// [`SettingError`] of the patch.
    pub(super) fn new(
        contacts: ContactEstimator,
        patch: PatcherParams,
    ) -> Result<Self, SettingError> {
        Ok(Self {
            contacts,
            patcher: Patcher::new(patch)?,
        })
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// [`SampleError`] of a refused sample, which changes nothing.
    pub fn push(&mut self, sample: &Sample) -> Result<&ContactSample, SampleError> {
        let contact = self.contacts.observe(sample)?;
        self.patcher.push(contact);
        Ok(contact)
    }

    /// Takes a surface for known, as [`Patcher::know`].
    ///
    /// # Errors
    /// [`KnownSurfaceError`]
    pub fn know(&mut self, known: KnownSurface) -> Result<(), KnownSurfaceError> {
        self.patcher.know(known)
    }

    /// Undoes the last stroke; returns its touch-down, ns, or `None` without a stroke.
    pub fn undo(&mut self) -> Option<i64> {
        undo(&mut self.patcher)
    }

    /// Redoes the last undone stroke; returns its touch-down, ns, or `None` without one.
    pub fn redo(&mut self) -> Option<i64> {
        redo(&mut self.patcher)
    }

    /// The collected evidence.
    pub fn patcher(&self) -> &Patcher {
        &self.patcher
    }

    /// The collected evidence alone.
    pub fn into_patcher(self) -> Patcher {
        self.patcher
    }

    /// The contact estimator.
    pub fn contacts(&self) -> &ContactEstimator {
        &self.contacts
    }
}

/// As [`EvidenceReplay::undo`].
pub(super) fn undo(patcher: &mut Patcher) -> Option<i64> {
    // the last stroke may still be in the smoothing window
    patcher.flush();
    let last = patcher.last_stroke();
    last.filter(|_| patcher.undo()).map(|stroke| stroke.from_ns)
}

/// As [`EvidenceReplay::redo`].
pub(super) fn redo(patcher: &mut Patcher) -> Option<i64> {
    patcher
        .redo()
        .then(|| patcher.last_stroke())
        .flatten()
        .map(|stroke| stroke.from_ns)
}
