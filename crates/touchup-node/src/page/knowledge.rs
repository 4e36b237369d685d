//! Uncertainty of the touched mesh, for the colours of the page: evaluated while the mesh rests,
//! and only for open pages.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use tokio::sync::oneshot;
use tokio::time::sleep;

use super::background::begin;
use super::board::{MeshState, UncertaintyFrames};
use super::connection::OF_A_MESSAGE;
use super::site::Site;
use super::vertex_numbers::{VertexNumber, frame};
use crate::ros::port::{Arrival, Reply};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::reconstruct::{Patcher, Support};

/// Polling period of the mesh.
const LOOK: Duration = Duration::from_millis(250);
/// The mesh rests after this time without a change: somewhat longer than the node's settling time.
const QUIET: Duration = Duration::from_millis(1000);
/// Time-out for the copy of the evidence.
const COPY_WAIT: Duration = Duration::from_secs(30);
/// Radius of marked vertices around a rejected contact, m.
const BESIDE_OUTLIER: f64 = 1e-3;

/// Evaluates each state in which the mesh rests, until dropped.
pub(super) async fn follow(site: Arc<Site>) {
    let (mut seen, mut still, mut done) =
        (MeshState::default(), Instant::now(), MeshState::default());
    loop {
        sleep(LOOK).await;
        let state = site.mesh.now().0.shape_state();
        if state != seen {
            (seen, still) = (state, Instant::now());
            continue;
        }
        if state == done || still.elapsed() < QUIET || site.pages.load(Ordering::Relaxed) == 0 {
            continue;
        }
        done.clone_from(&state);
        let (to, copy) = oneshot::channel();
        // the receiver still waits
        site.inbox.put(Arrival::Evidence(Reply::new(move |copy| {
            drop(to.send(copy))
        })));
        let Ok(Some(copy)) = copy.await else { continue };
        let scan = Arc::clone(&site.scan_mesh);
        let touched: Vec<_> = site.mesh.now().0.touched().collect();
        // it may be of a replay, beside a running session
        let Ok(evaluated) = begin("knowledge", move || frames_of(&copy, &scan, &touched)) else {
            continue;
        };
        if let Ok(frames) = evaluated.await {
            site.board.set_known(UncertaintyFrames { state, frames });
        }
    }
}

fn frames_of(
    copy: &Receiver<Patcher>,
    scan: &(TriMesh, FaceTree),
    touched: &[(u32, Point3<f64>, Support)],
) -> Vec<Vec<u8>> {
    let Ok(mut patcher) = copy.recv_timeout(COPY_WAIT) else {
        return Vec::new();
    };
    patcher.flush();
    let places: Vec<_> = touched
        .iter()
        .map(|(_, place, support)| (*place, *support))
        .collect();
    let sigmas = patcher.sigma_at(&scan.0, &scan.1, &places);
    let of_sigma: Vec<_> = touched
        .iter()
        .zip(sigmas)
        .map(|((vertex, ..), sigma)| (*vertex, sigma as f32))
        .collect();
    // no message is larger than one of the mesh
    let sigma_frames = of_sigma
        .chunks(OF_A_MESSAGE)
        .map(|part| frame(VertexNumber::Sigma, part.iter().copied()));
    let outliers: Vec<_> = patcher
        .outliers()
        .last()
        .map(|outlier| outlier.point)
        .collect();
    let is_beside = |place: &Point3<f64>| {
        outliers
            .iter()
            .any(|point| (point - place).norm() < BESIDE_OUTLIER)
    };
    let beside = touched
        .iter()
        .filter(|(_, place, _)| is_beside(place))
        .map(|(vertex, ..)| (*vertex, 1.0));
    sigma_frames
        .chain([frame(VertexNumber::Outlier, beside)])
        .collect()
}
