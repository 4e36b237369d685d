//! What each optional part costs: whole pushes with it and without it, in turns.

use std::ops::Sub;

use super::error::CostError;
use super::sizes::{pushing, refiner_of, side_of, touched_plate};
use super::turns::{PerSample, Timing, by_block, in_turns};
use crate::Spread;
use touchup_session::scene::Scene;

/// A part of the haptic update, switched on and off.
#[derive(Clone, Debug, PartialEq)]
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
        ("default", true, default()),
        ("contact", true, Scene { contact: None, patch: None, ..default() }),
        ("sliding", true, Scene { sliding: None, ..default() }),
        ("carve", true, Scene { carve: None, ..default() }),
        ("guard", true, Scene { guard: None, ..default() }),
        ("compensation", false, Scene { compensation: extra.compensation, ..default() }),
        ("bias_tracking", false, Scene { bias_tracking: extra.bias_tracking, ..default() }),
        ("undo of strokes", false, default()),
    ])
}

/// Measures every part on a scan of edges of 1 mm.
pub(super) fn part_costs(faces: usize, timing: Timing) -> Result<Vec<PartCost>, CostError> {
    let (mesh, samples) = touched_plate(faces, side_of(faces), timing.samples())?;
    let faces = mesh.face_count();
    let scenes = scenes()?;
    let refiners = scenes.iter().map(|(.., scene)| refiner_of(scene, mesh.clone()));
    let mut refiners = refiners.collect::<Result<Vec<_>, _>>()?;
    // what can be undone is kept by the refiner alone where there is no patch
    if let Some(last) = refiners.last_mut() {
        last.keep_strokes();
    }
    let each = scenes.iter().zip(&mut refiners);
    let mut cases: Vec<_> = each.map(|((name, ..), refiner)| pushing(name, refiner, &samples, |_| {})).collect();
    let timed = in_turns(&mut cases, timing)?;
    let costs = scenes.iter().zip(&timed).skip(1).map(|(&(name, is_default, _), other)| {
        let (with, without) = if is_default { (&timed[0], other) } else { (other, &timed[0]) };
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
