//! Uncertainty of touched vertices, for all followers of the mesh: computed on a thread of its own
//! once the mesh rests, if there are followers.
//!
//! The mesh with other variances is the next version, so followers handle it as any other change;
//! it moves no vertex.

use std::sync::Arc;
use std::sync::mpsc::{TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use tracing::warn;

use crate::node::channels::ViewInput;
use crate::node::refinement::{RefinementWorker, SETTLES_AFTER};
use crate::node::uncertainty::uncertainty_of;
use crate::ros::mesh_feed::VertexUncertainty;

/// Time from the last sample of a change until the mesh rests: longer than the node takes to settle
/// it.
const KNOWN_AFTER: Duration = Duration::from_millis(1000);
/// Maximum duration of the copies of mesh and evidence.
const COPY_WAIT: Duration = Duration::from_secs(30);

impl RefinementWorker {
    /// Starts the computation when due, and passes on its result; never waits.
    pub(super) fn go_on_with_uncertainty(&mut self, now: Instant) {
        let version = self.session.version;
        if let Some((of, made)) = self.uncertainty.made.take() {
            match made.try_recv() {
                // only one computation at a time, even if the mesh has changed
                Err(TryRecvError::Empty) => self.uncertainty.made = Some((of, made)),
                Ok(uncertainty) if of == version && self.is_at_rest(now) => {
                    self.send_uncertainty(uncertainty)
                }
                Ok(_) => {}
                // without thread, mesh or evidence: the next change of the mesh tries again
                Err(TryRecvError::Disconnected) => self.uncertainty.done = of,
            }
        } else if self.uncertainty.done != version && self.is_followed() && self.is_at_rest(now) {
            self.begin_uncertainty(version);
        }
    }

    /// Whether the mesh is complete, on its way to the view, and equal to a saved file. While
    /// samples in free air come, the mesh does not settle, and rests without that.
    fn is_at_rest(&self, now: Instant) -> bool {
        let session = &self.session;
        let is_quiet = now.saturating_duration_since(self.moved) >= KNOWN_AFTER;
        let is_streaming = now.saturating_duration_since(self.sampled) < SETTLES_AFTER;
        is_quiet
            && session.is_sent()
            && (is_streaming || session.engine.is_settled())
            && !self.is_taking_out()
            && self.fault.is_none()
    }

    /// Whether anybody follows the mesh: a listener of `mesh_patch`, or a page.
    fn is_followed(&self) -> bool {
        // the view follows for the topic
        let has_pages = self.setup.shared.mesh.follower_count() > 1;
        let has_listeners = |topic| {
            let endpoint = self.endpoints.get(topic);
            endpoint.is_some_and(|endpoint| endpoint.count > 0)
        };
        has_pages || has_listeners(self.port.mesh_patch_topic())
    }

    fn begin_uncertainty(&mut self, version: u64) {
        let Ok(Some(copy)) = self.session.engine.copy_patcher() else {
            // no touches, or no patch
            self.uncertainty.done = version;
            return;
        };
        let setup = Arc::clone(&self.setup);
        let (to, made) = sync_channel(1);
        let work = move || {
            let snapshot = setup.shared.mesh.complete();
            let snapshot = setup.clock.recv_timeout(&snapshot, COPY_WAIT).ok();
            let Some(mesh) = snapshot.filter(|mesh| mesh.version == version) else {
                return;
            };
            let Ok(mut patcher) = setup.clock.recv_timeout(&copy, COPY_WAIT) else {
                return;
            };
            patcher.flush();
            // the node may have ended
            let _ = to.send(uncertainty_of(&mesh, &setup.input.scan, &mut patcher));
        };
        if let Err(error) = self.uncertainty.threads.begin("uncertainty", work) {
            warn!(%error, "no thread for the uncertainty of vertices: the mesh has none until it changes again");
        }
        self.uncertainty.made = Some((version, made));
    }

    fn send_uncertainty(&mut self, uncertainty: VertexUncertainty) {
        let version = self.session.version + u64::from(!uncertainty.variances.is_empty());
        // a busy view gets it with the next computation
        if self
            .view
            .try_send(ViewInput::Uncertainty(version, uncertainty))
            .is_ok()
        {
            (self.session.version, self.session.sent_version) = (version, version);
            self.setup.shared.mesh.announce(version);
            self.uncertainty.done = version;
        }
    }
}
