//! State shared by the threads of the node.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex};

use super::channels::{NextTouches, ViewInput};
use crate::ros::locked;
use crate::ros::mesh_feed::MeshFeed;
use crate::ros::messages::FeatureArray;
use crate::ros::parameters::Parameters;

/// State of the node, readable from all threads.
#[derive(Debug)]
pub struct SharedNodeState {
    /// frame of all publications
    pub frame: String,
    /// the mesh as sent up to now
    pub mesh: Arc<MeshFeed>,
    /// last published features, and their next touches by hand
    features: Mutex<Arc<(FeatureArray, NextTouches)>>,
    parameters: Mutex<Arc<Parameters>>,
    /// number of tiles waiting to be sent
    pub tiles_waiting: AtomicUsize,
    /// number of dropped frames of the view
    pub dropped_frames: AtomicU64,
    /// number of viewers of the tiles; one if the port does not know
    pub viewers: AtomicUsize,
    /// a new viewer without tiles has joined
    pub has_new_viewer: AtomicBool,
}

impl SharedNodeState {
    /// Before the first publication.
    pub fn new(parameters: Parameters, mesh: Arc<MeshFeed>) -> Self {
        Self {
            frame: parameters.string("object_frame").to_owned(),
            mesh,
            features: Mutex::default(),
            parameters: Mutex::new(Arc::new(parameters)),
            tiles_waiting: AtomicUsize::new(0),
            dropped_frames: AtomicU64::new(0),
            viewers: AtomicUsize::new(1),
            has_new_viewer: AtomicBool::new(false),
        }
    }

    /// The current parameters.
    pub fn parameters(&self) -> Arc<Parameters> {
        Arc::clone(&locked(&self.parameters))
    }

    /// Sets the parameters.
    pub fn set_parameters(&self, parameters: Parameters) {
        *locked(&self.parameters) = Arc::new(parameters);
    }

    /// The last published features, and their next touches by hand.
    pub fn features(&self) -> Arc<(FeatureArray, NextTouches)> {
        Arc::clone(&locked(&self.features))
    }

    /// Sets the published features.
    pub fn set_features(&self, features: FeatureArray, next: NextTouches) {
        *locked(&self.features) = Arc::new((features, next));
    }

    /// Sets the number of viewers of the tiles.
    pub fn note_viewers(&self, count: usize) {
        if self.viewers.swap(count, Ordering::Relaxed) < count {
            self.has_new_viewer.store(true, Ordering::Relaxed);
        }
    }

    /// Sends the view an optional input; drops and counts it if the view is busy.
    pub fn offer(&self, view: &SyncSender<ViewInput>, input: ViewInput) {
        if let Err(TrySendError::Full(_)) = view.try_send(input) {
            self.dropped_frames.fetch_add(1, Ordering::Relaxed);
        }
    }
}
