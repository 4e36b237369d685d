//! The engine of a session of the node: the haptic update, with the patch beside it where the scene has one.

use std::sync::Arc;

use super::error::NodeError;
use super::setup::Setup;
use crate::live::{Engine, Gate, Pace, Renewal};
use crate::stylus::WrenchFrame;

/// Room for new faces that is made ahead.
const ROOM: usize = 1 << 18;

/// What moves the mesh; nothing touched yet.
///
/// - `axes`: those of the wrenches.
///
/// # Errors
/// [`NodeError::NothingMoves`], [`NodeError::Live`].
pub fn engine_of(setup: &Setup, axes: WrenchFrame) -> Result<Engine, NodeError> {
    let Setup { scan, scene, cut, clock, .. } = setup;
    let refine = cut.refine_params(scene.refine_params(axes).ok_or(NodeError::NothingMoves)?);
    let patch = scene.patcher_params().map(|params| cut.patcher_params(params));
    let renewal =
        Renewal::Beside { scan: Arc::clone(scan), pace: Pace::default(), room: ROOM, gate: Gate::open(clock) };
    let mut engine = Engine::new(scan.0.clone(), refine, patch, renewal)?;
    engine.watch();
    engine.keep_strokes();
    // bounds of the scan, which the first renewal looks up, take some ms on a large one: no sample is to wait for that
    engine.catch_up()?;
    Ok(engine)
}
