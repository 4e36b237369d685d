//! Messages for the pages: the newest of each topic. The node writes, and each page reads at its own
//! pace.

use std::collections::VecDeque;
use std::sync::Mutex;

use serde::Serialize;
use tokio::sync::watch;

use crate::ros::locked;
use crate::ros::messages::{
    DiagnosticArray, Feature, FeatureArray, HapticMismatch, MarkerArray, Path, ProbeResult,
    ProbeTouch,
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

impl<M: Clone + Serialize> NewestMessage<M> {
    fn write(&mut self, number: u64, message: &M) {
        *self = Self(number, Some(message.clone()));
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

fn keep<M: Clone>(kept: &mut VecDeque<(u64, M)>, number: u64, message: &M) {
    if kept.len() == MOST_KEPT {
        kept.pop_front();
    }
    kept.push_back((number, message.clone()));
}

/// The content that all pages read.
#[derive(Debug, Default)]
pub(super) struct Board {
    topics: Mutex<BoardMessages>,
    changes: watch::Sender<()>,
}

impl Board {
    /// Stores a publication of the node.
    pub fn write(&self, publication: &Publication) {
        let topics = &mut *locked(&self.topics);
        let number = topics.written + 1;
        match publication {
            Publication::Features(features) => topics.features.write(number, features),
            Publication::Tip(tip) => topics.tip.write(number, tip),
            Publication::Path(path) => topics.path.write(number, path),
            Publication::Mismatch(mismatch) => topics.mismatch.write(number, mismatch),
            Publication::Diagnostics(diagnostics) => topics.diagnostics.write(number, diagnostics),
            Publication::ProbeResult(result) => keep(&mut topics.results, number, result),
            Publication::ProbeTouch(touch) => keep(&mut topics.touches, number, touch),
            // pages take the mesh from its feed
            Publication::MeshPatch(_) => {}
            // both repeat the mesh and the features, for RViz
            Publication::Tile(_) | Publication::FeatureMarkers(_) => return,
        }
        topics.written = number;
        self.wake();
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
}
