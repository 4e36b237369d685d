//! Cost of a push of the haptic update: by scan size for the hand-written loop and the cheapest
//! scene, and with and without each optional part of the default scene.

use std::ops::{Div, Sub};

use super::minimal::MinimalLoop;
use super::turns::{PerSample, TimedCase, Timing, by_block, in_turns};
use crate::error::{MeasureError, MeasureResult};
use crate::{Spread, timed};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::haptic::Refiner;
use touchup_method::stylus::{Sample, WrenchFrame};
use touchup_session::scene::Scene;
use touchup_sim::wavy::{SIDE, plate, slide_on};

/// The cheapest scene that moves a mesh: the touched face follows the ball, without further stages.
pub const BAREST: &str = "{ refine: { roi_mm: 0, beta_per_n2_s: 0 }, sync: off, clock: off, contact: off, scan: off, sliding: off, carve: off, \
                          guard: off, patch: off, uncertainty: off }\n";

/// Length of the short edges of a scan that grows with its faces, m.
pub(super) const EDGE: f64 = 1e-3;

/// Costs at one scan size.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeCost {
    /// faces
    pub faces: usize,
    /// the hand-written loop, on a plate of 0.3 m
    pub minimal: PerSample,
    /// the same loop with kept look-ups
    pub keeping: PerSample,
    /// the cheapest scene that moves a mesh, on the same plate
    pub barest: PerSample,
    /// block by block, time of the cheapest scene over time of the loop
    pub barest_to_minimal: Spread,
    /// block by block, time of the cheapest scene over time of the loop with kept look-ups
    pub barest_to_keeping: Spread,
    /// memory of the mesh of the cheapest scene, bytes per face
    pub mesh_bytes_per_face: f64,
    /// memory of the cheapest scene's tree, bytes per face
    pub tree_bytes_per_face: f64,
    /// time to build that tree, ms
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
pub(super) fn touched_plate(
    faces: usize,
    side: f64,
    count: usize,
) -> MeasureResult<(TriMesh, Vec<Sample>)> {
    Ok((
        plate(faces, side)?,
        (0..count).map(|i| slide_on(side, i, 0.8 * side)).collect(),
    ))
}

/// Refiner of a scene.
pub(super) fn refiner_of(scene: &Scene, mesh: TriMesh) -> MeasureResult<Refiner> {
    // the force of the slide is in the axes of the scan
    let params = scene
        .refine_params(WrenchFrame::Object)
        .ok_or(MeasureError::NothingMoves)?;
    Ok(Refiner::new(mesh, params)?)
}

/// Measures one size.
pub(super) fn size_cost(faces: usize, timing: Timing) -> MeasureResult<SizeCost> {
    let (mesh, samples) = touched_plate(faces, SIDE, timing.samples())?;
    let faces = mesh.face_count();
    let (tree_build_s, tree) = timed(|| FaceTree::new(&mesh));
    let last = samples
        .last()
        .ok_or(MeasureError::NothingTimed)?
        .pose_ot
        .translation
        .vector;
    tree.closest(&mesh, &last.into(), 0.01)
        .ok_or(MeasureError::NothingTimed)?;
    drop(tree);
    let mut barest = refiner_of(&Scene::from_yaml(BAREST)?, mesh.clone())?;
    let footprint = barest.footprint();
    let mut keeping = MinimalLoop::keeping(mesh.clone());
    let mut minimal = MinimalLoop::new(mesh);
    let mut cases = [
        TimedCase::each("hand-written loop", &samples, |sample| {
            Ok(minimal.push(sample))
        }),
        TimedCase::each("the loop, keeping", &samples, |sample| {
            Ok(keeping.push(sample))
        }),
        TimedCase::each("cheapest scene", &samples, |sample| {
            Ok(barest.push(sample).map(drop)?)
        }),
    ];
    let timed = in_turns(&mut cases, timing)?;
    let per_face = |bytes: usize| bytes as f64 / faces.max(1) as f64;
    Ok(SizeCost {
        faces,
        minimal: timed[0].per_sample()?,
        keeping: timed[1].per_sample()?,
        barest: timed[2].per_sample()?,
        barest_to_minimal: by_block(&timed[2], &timed[0], f64::div)?,
        barest_to_keeping: by_block(&timed[2], &timed[1], f64::div)?,
        mesh_bytes_per_face: per_face(footprint.mesh),
        tree_bytes_per_face: per_face(footprint.tree),
        tree_build_ms: tree_build_s * 1e3,
    })
}

/// A part of the haptic update, switched on and off.
#[derive(Clone, Debug, PartialEq)]
pub struct PartCost {
    /// name in the scene
    pub part: String,
    /// faces of the scan
    pub faces: usize,
    /// whether the default scene has it
    pub is_default: bool,
    /// a push with it
    pub with: PerSample,
    /// a push without it
    pub without: PerSample,
    /// block by block, cost of the part, ns; the rest of the scene is as by default
    pub cost_ns: Spread,
}

/// Zero mass and zero bias: same cost as any other payload and bias, and unchanged touches.
const COMPENSATION: &str = "compensation: { payload: { mass_kg: 0, centre_mm: [0, 0, 40] }, \
                            bias: { force_n: [0, 0, 0], torque_nm: [0, 0, 0] } }";

/// The default scene, and for each part the scene that differs in it.
fn scenes() -> MeasureResult<Vec<(&'static str, bool, Scene)>> {
    let default = Scene::default;
    let extra = Scene::from_yaml(&format!("{COMPENSATION}\nbias_tracking:"))?;
    Ok(vec![
        ("default", true, default()),
        (
            "contact",
            true,
            Scene {
                contact: None,
                patch: None,
                ..default()
            },
        ),
        (
            "sliding",
            true,
            Scene {
                sliding: None,
                ..default()
            },
        ),
        (
            "carve",
            true,
            Scene {
                carve: None,
                ..default()
            },
        ),
        (
            "guard",
            true,
            Scene {
                guard: None,
                ..default()
            },
        ),
        (
            "compensation",
            false,
            Scene {
                compensation: extra.compensation,
                ..default()
            },
        ),
        (
            "bias_tracking",
            false,
            Scene {
                bias_tracking: extra.bias_tracking,
                ..default()
            },
        ),
        ("undo of strokes", false, default()),
    ])
}

/// Measures every part on a scan of edges of 1 mm.
pub(super) fn part_costs(faces: usize, timing: Timing) -> MeasureResult<Vec<PartCost>> {
    let (mesh, samples) = touched_plate(faces, side_of(faces), timing.samples())?;
    let faces = mesh.face_count();
    let scenes = scenes()?;
    let refiners = scenes
        .iter()
        .map(|(.., scene)| refiner_of(scene, mesh.clone()));
    let mut refiners = refiners.collect::<Result<Vec<_>, _>>()?;
    // without a patch, the refiner alone keeps the undo data
    if let Some(last) = refiners.last_mut() {
        last.keep_strokes();
    }
    let each = scenes.iter().zip(&mut refiners);
    let mut cases = Vec::new();
    for ((name, ..), refiner) in each {
        cases.push(TimedCase::each(name, &samples, |sample| {
            Ok(refiner.push(sample).map(drop)?)
        }));
    }
    let timed = in_turns(&mut cases, timing)?;
    let costs = scenes
        .iter()
        .zip(&timed)
        .skip(1)
        .map(|(&(name, is_default, _), other)| {
            let (with, without) = if is_default {
                (&timed[0], other)
            } else {
                (other, &timed[0])
            };
            Ok(PartCost {
                part: name.to_owned(),
                faces,
                is_default,
                with: with.per_sample()?,
                without: without.per_sample()?,
                cost_ns: by_block(with, without, f64::sub)?,
            })
        });
    costs.collect()
}
