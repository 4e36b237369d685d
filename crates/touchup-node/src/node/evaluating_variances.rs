//! Variances of touched vertices, for `MeshPatch`: computed on a thread of its own once the mesh
//! rests, if there are followers.
//!
//! The mesh with variances is the next version, so followers handle it as any other change; it
//! moves no vertex.

use std::sync::Arc;
use std::sync::mpsc::{TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use tracing::warn;

use crate::node::channels::ViewInput;
use crate::node::refinement::RefinementWorker;
use crate::node::variances::{VarianceState, VertexVariance, evaluated};

/// Time without samples after which the variances are computed: longer than the node takes to
/// settle the mesh.
const KNOWN_AFTER: Duration = Duration::from_millis(1000);
/// Maximum duration of the copies of mesh and evidence.
const COPY_WAIT: Duration = Duration::from_secs(30);

impl RefinementWorker {
    /// Starts the computation of variances when due, and passes on its result; never waits.
    pub(super) fn go_on_with_variance(&mut self, now: Instant) {
        let is_done = self
            .variance
            .done
            .as_ref()
            .is_some_and(|of| self.is_state(of));
        if let Some((of, made)) = self.variance.made.take() {
            match made.try_recv() {
                // only one computation at a time, even if the mesh has changed
                Err(TryRecvError::Empty) => self.variance.made = Some((of, made)),
                Ok(variances) if self.is_state(&of) && self.is_at_rest(now) => {
                    self.send_variances(of, variances)
                }
                Ok(_) => {}
                // without thread, mesh or evidence: the next change of the mesh tries again
                Err(TryRecvError::Disconnected) => self.variance.done = Some(of),
            }
        } else if !is_done && self.is_followed() && self.is_at_rest(now) {
            self.begin_variances((self.session.folder.name().to_owned(), self.session.version));
        }
    }

    fn is_state(&self, (session, version): &VarianceState) -> bool {
        session == self.session.folder.name() && *version == self.session.version
    }

    /// Whether the mesh is complete, on its way to the view, and equal to a saved file.
    fn is_at_rest(&self, now: Instant) -> bool {
        let session = &self.session;
        let is_sent =
            session.version == session.sent_version && session.engine.edits() == session.sent_edits;
        let is_quiet = now.saturating_duration_since(self.sampled) >= KNOWN_AFTER;
        is_quiet
            && is_sent
            && session.engine.is_settled()
            && !self.is_taking_out()
            && self.fault.is_none()
    }

    /// Whether `mesh_patch` has a listener.
    fn is_followed(&self) -> bool {
        self.endpoints
            .get(self.port.mesh_patch_topic())
            .is_some_and(|endpoint| endpoint.count > 0)
    }

    fn begin_variances(&mut self, state: VarianceState) {
        let Ok(Some(copy)) = self.session.engine.copy_patcher() else {
            // no touches, or no patch
            self.variance.done = Some(state);
            return;
        };
        let (setup, snapshot) = (Arc::clone(&self.setup), self.setup.shared.mesh.complete());
        let (to, made) = sync_channel(1);
        let asked = state.clone();
        let work = move || {
            let snapshot = setup.clock.recv_timeout(&snapshot, COPY_WAIT).ok();
            let Some(mesh) =
                snapshot.filter(|mesh| (&mesh.session, mesh.version) == (&asked.0, asked.1))
            else {
                return;
            };
            let Ok(mut patcher) = setup.clock.recv_timeout(&copy, COPY_WAIT) else {
                return;
            };
            patcher.flush();
            let places: Vec<_> = mesh.touched().collect();
            let known = places
                .iter()
                .map(|&(vertex, ..)| mesh.variance(vertex).to_bits());
            let variances = evaluated(&mut patcher, &setup.input.scan, &places)
                .into_iter()
                .zip(known);
            let changed = variances.filter(|((_, variance), known)| variance.to_bits() != *known);
            let changed = changed.map(|(variance, _)| variance).collect();
            // the next version need not be a copy
            drop(mesh);
            // the node may have ended
            let _ = to.send(changed);
        };
        if let Err(error) = self.side_work.begin("variance", work) {
            warn!(%error, "no thread to evaluate variances on: mesh_patch has none until the mesh changes again");
        }
        self.variance.made = Some((state, made));
    }

    fn send_variances(&mut self, (session, version): VarianceState, of: Vec<VertexVariance>) {
        if of.is_empty() {
            self.variance.done = Some((session, version));
            return;
        }
        let version = version + 1;
        // a busy view gets them with the next computation
        if self
            .view
            .try_send(ViewInput::Variances(version, of))
            .is_ok()
        {
            (self.session.version, self.session.sent_version) = (version, version);
            self.setup.shared.mesh.announce(version);
            self.variance.done = Some((session, version));
        }
    }
}
