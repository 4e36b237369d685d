//! A recording of a sliding ball, on scans of any edge length and size: each push of the default
//! scene, and the whole from the scan in memory to the mesh with its patch, as the program refines
//! a recording; beside it a peer's index over the same samples.

use std::time::Instant;

use super::parry::ParryLoop;
use super::pushes::EDGE;
use crate::Effort;
use crate::error::{MeasureError, MeasureResult};
use touchup_geometry::mesh::FaceTree;
use touchup_method::stylus::WrenchFrame;
use touchup_session::live::{Engine, Latencies, Quantiles, Renewal};
use touchup_session::scene::Scene;
use touchup_sim::wavy::{RADIUS, noisy_slide_on, plate};

/// Edge lengths of the scans of one size, in radii of the tip.
const EDGES: [f64; 6] = [1.0 / 30.0, 0.1, 0.25, 0.5, 1.0, 2.0];
/// Edge lengths of the scans that differ in size, m.
const EDGES_BY_FACES: [f64; 2] = [0.1 * RADIUS, EDGE];

/// One recording, refined.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingCost {
    /// faces of the scan
    pub faces: usize,
    /// length of its short edges, m
    pub edge: f64,
    /// samples of the recording
    pub samples: usize,
    /// one push; the patch follows at the end
    pub push: Quantiles,
    /// time before the first push, ms
    pub begin_ms: f64,
    /// after the last push: the patch, and the mesh with it, ms
    pub patch_ms: f64,
    /// from the scan in memory to the mesh with its patch, for each sample, µs
    pub whole_us: f64,
    /// time of the peer's index: update, and query for the closest face
    pub peer: Quantiles,
    /// vertices that a touch moves in the peer, mean
    pub peer_moves: f64,
}

/// Measures scans of one size and different edges.
pub(super) fn by_edge(
    effort: Effort,
    progress: &mut dyn FnMut(&str),
) -> MeasureResult<Vec<RecordingCost>> {
    let edges = effort
        .choose(&EDGES[1..], &EDGES)
        .iter()
        .map(|radii| radii * RADIUS);
    let faces = effort.choose(20_000, 1_000_000);
    edges
        .map(|edge| recording_cost(faces, edge, effort, progress))
        .collect()
}

/// Measures scans of equal edges and different size.
pub(super) fn by_faces(
    effort: Effort,
    progress: &mut dyn FnMut(&str),
) -> MeasureResult<Vec<RecordingCost>> {
    let sizes: &[usize] = effort.choose(
        &[10_000, 100_000],
        &[10_000, 100_000, 1_000_000, 5_000_000, 10_000_000],
    );
    let cases = EDGES_BY_FACES
        .iter()
        .flat_map(|edge| sizes.iter().map(move |faces| (*faces, *edge)));
    cases
        .map(|(faces, edge)| recording_cost(faces, edge, effort, progress))
        .collect()
}

fn recording_cost(
    faces: usize,
    edge: f64,
    effort: Effort,
    progress: &mut dyn FnMut(&str),
) -> MeasureResult<RecordingCost> {
    progress(&format!(
        "cost: a recording on {faces} faces, edges of {:.2} mm",
        edge * 1e3
    ));
    let side = edge * (faces as f64 / 2.0).sqrt();
    let (warm, count) = effort.choose((500, 3_000), (1_000, 20_000));
    let samples: Vec<_> = (0..count)
        .map(|i| noisy_slide_on(side, i, 0.8 * side))
        .collect();
    let scan = plate(faces, side)?;
    let faces = scan.face_count();
    let scene = Scene::default();
    let refine = scene
        .refine_params(WrenchFrame::Object)
        .ok_or(MeasureError::NothingMoves)?;
    let copy = scan.clone();

    let started = Instant::now();
    let mut engine = Engine::new(copy, refine, scene.patcher_params(), Renewal::AtEnd)?;
    let begun = started.elapsed();
    let mut pushes = Latencies::new();
    for (i, sample) in samples.iter().enumerate() {
        let start = Instant::now();
        engine.push(sample)?;
        if i >= warm {
            pushes.record(start.elapsed());
        }
    }
    let pushed = started.elapsed();
    let mut patcher = engine.finish()?.patcher.ok_or(MeasureError::NothingMoves)?;
    patcher.flush();
    let patched = patcher.patched(&scan, &FaceTree::new(&scan))?;
    let whole = started.elapsed();
    drop((patched, patcher));

    let (mut peer, mut updates, mut moved) = (ParryLoop::new(scan), Latencies::new(), 0);
    for (i, sample) in samples.iter().enumerate() {
        let took = peer.push(sample).ok_or(MeasureError::NothingTimed)?;
        if i >= warm {
            updates.record(took);
            moved += peer.moved_vertices().len();
        }
    }
    Ok(RecordingCost {
        faces,
        edge,
        samples: count,
        push: pushes.quantiles(),
        begin_ms: begun.as_secs_f64() * 1e3,
        patch_ms: (whole - pushed).as_secs_f64() * 1e3,
        whole_us: whole.as_secs_f64() * 1e6 / count as f64,
        peer: updates.quantiles(),
        peer_moves: moved as f64 / (count - warm) as f64,
    })
}
