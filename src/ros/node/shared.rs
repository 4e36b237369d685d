//! What the threads of the node know of each other.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex};

use super::channels::ViewInput;
use super::replica::MeshReplica;
use crate::ros::locked;
use crate::ros::parameters::Parameters;

/// Read by all threads.
#[derive(Debug)]
pub struct Shared {
    /// frame of all that is published
    pub frame: String,
    /// standard deviation of the scan, m, when the scene says it
    pub scan_sigma: Option<f64>,
    /// the mesh as far as it was sent
    pub mesh: MeshReplica,
    parameters: Mutex<Arc<Parameters>>,
    /// tiles that are still to be sent
    pub tiles_waiting: AtomicUsize,
    /// frames of the view that were dropped
    pub dropped_frames: AtomicU64,
    /// how many look at the tiles; one if the port does not say
    pub viewers: AtomicUsize,
    /// somebody joined who has no tiles yet
    pub has_new_viewer: AtomicBool,
}

impl Shared {
    /// Nothing shown yet.
    pub fn new(parameters: Parameters, scan_sigma: Option<f64>, mesh: MeshReplica) -> Self {
        Self {
            frame: parameters.string("object_frame").to_owned(),
            scan_sigma,
            mesh,
            parameters: Mutex::new(Arc::new(parameters)),
            tiles_waiting: AtomicUsize::new(0),
            dropped_frames: AtomicU64::new(0),
            viewers: AtomicUsize::new(1),
            has_new_viewer: AtomicBool::new(false),
        }
    }

    /// As they are now.
    pub fn parameters(&self) -> Arc<Parameters> {
        Arc::clone(&locked(&self.parameters))
    }

    /// Sets them.
    pub fn set_parameters(&self, parameters: Parameters) {
        *locked(&self.parameters) = Arc::new(parameters);
    }

    /// So many look at the tiles now.
    pub fn note_viewers(&self, count: usize) {
        if self.viewers.swap(count, Ordering::Relaxed) < count {
            self.has_new_viewer.store(true, Ordering::Relaxed);
        }
    }

    /// Sends the view something that it can do without: where it has no time, that is dropped and
    /// counted.
    pub fn offer(&self, view: &SyncSender<ViewInput>, input: ViewInput) {
        if let Err(TrySendError::Full(_)) = view.try_send(input) {
            self.dropped_frames.fetch_add(1, Ordering::Relaxed);
        }
    }
}
