//! What each optional part costs: whole pushes with it and without it, in turns.

use serde::Serialize;

use super::CostError;
use super::sizes::{pushing, refiner_of, samples_on, side_of};
use super::turns::{PerSample, TimedCase, Timing, difference, in_turns};
use crate::Spread;
use touchup_core::haptic::Refiner;
use touchup_session::scene::Scene;
use touchup_sim::wavy::plate;

/// A part of the haptic update, switched on and off.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartCost {
    /// by its name in the scene
    pub part: String,
    /// faces of the scan
    pub faces: usize,
    /// whether the default scene has it
    pub is_default: bool,
    /// a push with it
    pub with: PerSample,
    /// … and without it
    pub without: PerSample,
    /// block by block, what it costs, ns; the rest of the scene is as by default
    pub cost_ns: Spread,
}

/// Zero mass and zero bias: it costs what any other payload and bias cost, and the touches stay the same.
const COMPENSATION: &str = "compensation: { payload: { mass_kg: 0, centre_mm: [0, 0, 40] }, \
                            bias: { force_n: [0, 0, 0], torque_nm: [0, 0, 0] } }";

/// The default scene, and for each part the scene that differs in it.
fn scenes() -> Result<Vec<(&'static str, bool, Scene)>, CostError> {
    let default = Scene::default;
    let extra = Scene::from_yaml(&format!("{COMPENSATION}\nbias_tracking:"))?;
    Ok(vec![
        ("contact", true, Scene { contact: None, patch: None, ..default() }),
        ("sliding", true, Scene { sliding: None, ..default() }),
        ("carve", true, Scene { carve: None, ..default() }),
        ("guard", true, Scene { guard: None, ..default() }),
        ("compensation", false, Scene { compensation: extra.compensation, ..default() }),
        ("bias_tracking", false, Scene { bias_tracking: extra.bias_tracking, ..default() }),
    ])
}

/// Measures every part on a scan of edges of 1 mm.
pub(super) fn part_costs(faces: usize, timing: Timing) -> Result<Vec<PartCost>, CostError> {
    let side = side_of(faces);
    let mesh = plate(faces, side)?;
    let faces = mesh.face_count();
    let samples = samples_on(side, timing.samples());
    let others = scenes()?;
    let build = |scene: &Scene| refiner_of(scene, mesh.clone());
    let mut refiners = vec![build(&Scene::default())?];
    for (.., scene) in &others {
        refiners.push(build(scene)?);
    }
    // what can be undone is kept by the refiner alone where there is no patch
    let mut keeping: Refiner = build(&Scene::default())?;
    keeping.keep_strokes();
    refiners.push(keeping);
    let mut named: Vec<_> = others.iter().map(|&(name, is_default, _)| (name, is_default)).collect();
    named.push(("undo of strokes", false));

    let names: Vec<_> = std::iter::once("default").chain(named.iter().map(|(name, _)| *name)).collect();
    let mut moved = vec![0; refiners.len()];
    let each = refiners.iter_mut().zip(&mut moved).zip(&names);
    let mut cases: Vec<TimedCase> =
        each.map(|((refiner, moved), name)| pushing(name, refiner, &samples, moved)).collect();
    let timed = in_turns(&mut cases, timing)?;
    let costs = named.iter().zip(&timed[1..]).map(|(&(name, is_default), other)| {
        let (with, without) = if is_default { (&timed[0], other) } else { (other, &timed[0]) };
        Ok(PartCost {
            part: name.to_owned(),
            faces,
            is_default,
            with: with.per_sample()?,
            without: without.per_sample()?,
            cost_ns: difference(with, without)?,
        })
    });
    costs.collect()
}
