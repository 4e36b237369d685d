//! Content of the pages: the newest message of each topic, and the mesh. The node writes, and each
//! page reads at its own pace.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use serde::Serialize;
use tokio::sync::watch;

use super::mesh_copy::{MeshCopy, MeshState, PageId, TouchedVertex};
use crate::ros::locked;
use crate::ros::messages::{
    DiagnosticArray, Feature, FeatureArray, HapticMismatch, MarkerArray, MeshPatch, Path,
    ProbeResult, ProbeTouch,
};
use crate::ros::port::Publication;

/// Maximum number of stored arm results, and of touches, for late pages; the oldest go first.
const MOST_KEPT: usize = 1000;

/// The newest message of a topic, and its number among all messages.
#[derive(Debug)]
struct NewestMessage<M>(u64, Option<M>);

impl<M> Default for NewestMessage<M> {
    fn default() -> Self {
        Self(0, None)
    }
}

impl<M: Serialize> NewestMessage<M> {
    fn write(&mut self, number: u64, message: M) {
        *self = Self(number, Some(message));
    }

    fn read(&self, topic: &str, seen: u64, into: &mut Vec<String>) {
        if let Self(number, Some(message)) = self
            && *number > seen
        {
            into.extend(text_of(topic, message));
        }
    }
}

/// `{"topic": …, "message": …}`; non-finite numbers become `null`.
pub(super) fn text_of(topic: &str, message: &impl Serialize) -> Option<String> {
    #[derive(Serialize)]
    struct TopicMessage<'a, M> {
        topic: &'a str,
        message: &'a M,
    }
    serde_json::to_string(&TopicMessage { topic, message }).ok()
}

/// Newest messages of each topic, for pages that come later.
#[derive(Debug, Default)]
struct BoardMessages {
    /// number of messages
    written: u64,
    features: NewestMessage<FeatureArray>,
    tip: NewestMessage<MarkerArray>,
    path: NewestMessage<Path>,
    mismatch: NewestMessage<HapticMismatch>,
    diagnostics: NewestMessage<DiagnosticArray>,
    results: VecDeque<(u64, ProbeResult)>,
    touches: VecDeque<(u64, ProbeTouch)>,
}

fn keep<M>(kept: &mut VecDeque<(u64, M)>, number: u64, message: M) {
    if kept.len() == MOST_KEPT {
        kept.pop_front();
    }
    kept.push_back((number, message));
}

/// Vertex uncertainties and outlier marks at one state, as frames for the pages.
#[derive(Debug)]
pub(super) struct UncertaintyFrames {
    pub state: MeshState,
    pub frames: Vec<Vec<u8>>,
}

/// The content that all pages read.
#[derive(Debug)]
pub(super) struct Board {
    mesh: Mutex<MeshCopy>,
    topics: Mutex<BoardMessages>,
    known: Mutex<Option<Arc<UncertaintyFrames>>>,
    changes: watch::Sender<()>,
}

impl Board {
    /// - `whole`: the mesh of the node at its start.
    pub fn new(whole: impl Iterator<Item = MeshPatch>) -> Self {
        let mut mesh = MeshCopy::default();
        whole.for_each(|part| mesh.take(part));
        Self {
            mesh: Mutex::new(mesh),
            topics: Mutex::default(),
            known: Mutex::default(),
            changes: watch::Sender::new(()),
        }
    }

    /// Stores a publication of the node.
    pub fn write(&self, publication: Publication) {
        if let Publication::MeshPatch(patch) = publication {
            locked(&self.mesh).take(patch);
        } else {
            let topics = &mut *locked(&self.topics);
            topics.written += 1;
            let number = topics.written;
            match publication {
                Publication::Features(features) => topics.features.write(number, features),
                Publication::Tip(tip) => topics.tip.write(number, tip),
                Publication::Path(path) => topics.path.write(number, path),
                Publication::Mismatch(mismatch) => topics.mismatch.write(number, mismatch),
                Publication::Diagnostics(diagnostics) => {
                    topics.diagnostics.write(number, diagnostics)
                }
                Publication::ProbeResult(result) => keep(&mut topics.results, number, result),
                Publication::ProbeTouch(touch) => keep(&mut topics.touches, number, touch),
                Publication::Tile(_)
                | Publication::FeatureMarkers(_)
                | Publication::MeshPatch(_) => return,
            }
        }
        self.changes.send_replace(());
    }

    /// Notifies of every change.
    pub fn changes(&self) -> watch::Receiver<()> {
        self.changes.subscribe()
    }

    /// Wakes all pages.
    pub fn wake(&self) {
        self.changes.send_replace(());
    }

    /// Messages that a page has not seen, as text.
    ///
    /// - `seen`: number of messages at its last read; updated.
    pub fn read(&self, seen: &mut u64) -> Vec<String> {
        let topics = locked(&self.topics);
        let mut texts = Vec::new();
        topics.features.read("features", *seen, &mut texts);
        topics.tip.read("tip", *seen, &mut texts);
        topics.path.read("path", *seen, &mut texts);
        topics.mismatch.read("mismatch", *seen, &mut texts);
        topics.diagnostics.read("diagnostics", *seen, &mut texts);
        let touches = topics.touches.iter().filter(|(number, _)| number > seen);
        texts.extend(touches.filter_map(|(_, touch)| text_of("probe_touches", touch)));
        let results = topics.results.iter().filter(|(number, _)| number > seen);
        texts.extend(results.filter_map(|(_, result)| text_of("probe_results", result)));
        *seen = topics.written;
        texts
    }

    /// The feature as last published.
    pub fn feature(&self, id: u32) -> Option<Feature> {
        let topics = locked(&self.topics);
        topics
            .features
            .1
            .as_ref()?
            .features
            .iter()
            .find(|feature| feature.id == id)
            .cloned()
    }

    /// Adds a page.
    pub fn join(&self, page: PageId) {
        locked(&self.mesh).join(page);
    }

    /// Removes a page.
    pub fn leave(&self, page: PageId) {
        locked(&self.mesh).leave(page);
    }

    /// The next part of the mesh for a page; as [`MeshCopy::next_for`].
    pub fn mesh_for(&self, page: PageId) -> Option<MeshPatch> {
        locked(&self.mesh).next_for(page)
    }

    /// Session of the mesh, and the version of its shape.
    pub fn shape_state(&self) -> MeshState {
        locked(&self.mesh).shape_state()
    }

    /// The vertices with support other than the scan.
    pub fn touched(&self) -> Vec<TouchedVertex> {
        locked(&self.mesh).touched()
    }

    /// Sets the vertex uncertainties of a state.
    pub fn set_known(&self, known: UncertaintyFrames) {
        *locked(&self.known) = Some(Arc::new(known));
        self.wake();
    }

    /// The vertex uncertainties, if they are of the present state of the mesh.
    pub fn known(&self) -> Option<Arc<UncertaintyFrames>> {
        let known = locked(&self.known).clone()?;
        (known.state == self.shape_state()).then_some(known)
    }

    /// Name of the session.
    pub fn session(&self) -> String {
        locked(&self.mesh).session().to_owned()
    }
}
