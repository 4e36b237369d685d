//! A scene: an accepted one makes settings that the rooms take or refuse by name.

use crate::closed_box;
use touchup_method::haptic::Refiner;
use touchup_method::reconstruct::Patcher;
use touchup_method::stylus::{Synchroniser, WrenchFrame};
use touchup_session::scene::Scene;

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let Ok(yaml) = std::str::from_utf8(data) else {
        return;
    };
    let Ok(scene) = Scene::from_yaml(yaml) else {
        return;
    };
    let _ = Synchroniser::new(scene.sync_params());
    let _ = scene.marker_filter();
    let _ = scene.probing();
    let _ = scene.placement().map(|placement| placement.check());
    let _ = scene.input_monitor_params(WrenchFrame::Sensor);
    let _ = scene.patcher_params().map(Patcher::new);
    if let Some(params) = scene.refine_params(WrenchFrame::Sensor) {
        let _ = Refiner::new(closed_box([0.01; 3], 1), params);
    }
}
