//! What a push costs on scans of different size: the hand-written loop, the cheapest scene, the default scene.

use std::ops::Div;

use super::error::CostError;
use super::minimal::MinimalLoop;
use super::turns::{PerSample, TimedCase, Timing, by_block, in_turns};
use crate::{Spread, timed};
use touchup_core::haptic::Refiner;
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::stylus::{Sample, WrenchFrame};
use touchup_session::scene::Scene;
use touchup_sim::wavy::{SIDE, plate, slide_on};

/// The cheapest scene that moves a mesh: the touched face follows the ball, without further stages.
pub const BAREST: &str = "tip:\nrefine: { roi_mm: 0, beta_per_n2_s: 0 }\n";

/// Length of the short edges of a scan that grows with its faces, m.
const EDGE: f64 = 1e-3;

/// On a scan of so many faces.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeCost {
    /// faces
    pub faces: usize,
    /// the hand-written loop, on a plate of 0.3 m
    pub minimal: PerSample,
    /// the same loop, which keeps what it looked up
    pub keeping: PerSample,
    /// the cheapest scene that moves a mesh, on the same
    pub barest: PerSample,
    /// block by block, how many times as long the cheapest scene takes as the loop
    pub barest_to_minimal: Spread,
    /// … and as the loop that keeps
    pub barest_to_keeping: Spread,
    /// the default scene without its patch, on the same: the finer the scan, the more vertices move with a touch
    pub default_finer: PerSample,
    /// vertices that a touch moves there, mean
    pub moved_finer: f64,
    /// the default scene without its patch on a plate of edges of 1 mm, as large as the faces make it
    pub default_larger: PerSample,
    /// memory of the mesh of the cheapest scene, bytes per face
    pub mesh_bytes_per_face: f64,
    /// … and of its tree
    pub tree_bytes_per_face: f64,
    /// time of building that tree, ms
    pub tree_build_ms: f64,
}

impl SizeCost {
    /// Memory of mesh and tree, bytes.
    pub fn bytes(&self) -> f64 {
        (self.mesh_bytes_per_face + self.tree_bytes_per_face) * self.faces as f64
    }
}

/// Side of the plate whose edges are [`EDGE`] long, m.
pub(super) fn side_of(faces: usize) -> f64 {
    EDGE * (faces as f64 / 2.0).sqrt()
}

/// A plate of `side` (m), and the samples of a raster on it.
pub(super) fn touched_plate(faces: usize, side: f64, count: usize) -> Result<(TriMesh, Vec<Sample>), CostError> {
    Ok((plate(faces, side)?, (0..count).map(|i| slide_on(side, i, 0.8 * side)).collect()))
}

/// A refiner as a scene names it.
pub(super) fn refiner_of(scene: &Scene, mesh: TriMesh) -> Result<Refiner, CostError> {
    // the force of the slide is in the axes of the scan
    let params = scene.refine_params(WrenchFrame::Object).ok_or(CostError::NothingMoves)?;
    Ok(Refiner::new(mesh, params)?)
}

/// Pushes samples into a refiner; `after` looks at it after each.
pub(super) fn pushing<'a>(
    name: &'a str,
    refiner: &'a mut Refiner,
    samples: &'a [Sample],
    mut after: impl FnMut(&Refiner) + 'a,
) -> TimedCase<'a> {
    TimedCase::new(name, move |block| {
        for sample in &samples[block] {
            refiner.push(sample)?;
            after(refiner);
        }
        Ok(())
    })
}

/// Measures one size.
pub(super) fn size_cost(faces: usize, timing: Timing) -> Result<SizeCost, CostError> {
    let (mesh, samples) = touched_plate(faces, SIDE, timing.samples())?;
    let faces = mesh.face_count();
    let (tree_build_s, tree) = timed(|| FaceTree::new(&mesh));
    let last = samples.last().ok_or(CostError::NothingTimed)?.pose_ot.translation.vector;
    tree.closest(&mesh, &last.into(), 0.01).ok_or(CostError::NothingTimed)?;
    drop(tree);
    let mut barest = refiner_of(&Scene::from_yaml(BAREST)?, mesh.clone())?;
    let footprint = barest.footprint();
    let mut default = refiner_of(&Scene::default(), mesh.clone())?;
    let mut keeping = MinimalLoop::keeping(mesh.clone());
    let mut minimal = MinimalLoop::new(mesh);
    let mut moved_finer = 0;
    let mut cases = [
        TimedCase::each("hand-written loop", &samples, |sample| minimal.push(sample)),
        TimedCase::each("the loop, keeping", &samples, |sample| keeping.push(sample)),
        pushing("cheapest scene", &mut barest, &samples, |_| {}),
        pushing("default scene", &mut default, &samples, |refiner| moved_finer += refiner.moved_vertices().len()),
    ];
    let timed = in_turns(&mut cases, timing)?;
    drop(cases);
    let per_face = |bytes: usize| bytes as f64 / faces.max(1) as f64;
    Ok(SizeCost {
        faces,
        minimal: timed[0].per_sample()?,
        keeping: timed[1].per_sample()?,
        barest: timed[2].per_sample()?,
        barest_to_minimal: by_block(&timed[2], &timed[0], f64::div)?,
        barest_to_keeping: by_block(&timed[2], &timed[1], f64::div)?,
        default_finer: timed[3].per_sample()?,
        moved_finer: moved_finer as f64 / timing.samples() as f64,
        default_larger: default_larger(faces, timing)?,
        mesh_bytes_per_face: per_face(footprint.mesh),
        tree_bytes_per_face: per_face(footprint.tree),
        tree_build_ms: tree_build_s * 1e3,
    })
}

fn default_larger(faces: usize, timing: Timing) -> Result<PerSample, CostError> {
    let (mesh, samples) = touched_plate(faces, side_of(faces), timing.samples())?;
    let mut refiner = refiner_of(&Scene::default(), mesh)?;
    let timed = in_turns(&mut [pushing("default scene", &mut refiner, &samples, |_| {})], timing)?;
    timed[0].per_sample()
}
