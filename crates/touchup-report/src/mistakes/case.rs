//! One seed of one world: scan and recording in memory, sound and with mistakes, through the checks
//! of `touchup doctor`.

use super::checked::CheckedRecording;
use crate::error::MeasureResult;
use touchup_features::diagnose::{InputFinding, InputMonitor};
use touchup_geometry::mesh::FaceTree;
use touchup_method::stylus::{ContactEstimator, ContactEstimatorParams, Synchroniser, WrenchFrame};
use touchup_session::scene::Scene;
use touchup_sim::{DrawnWorld, InputMistake, Plate, SimWorld, ToldRecording};

/// Findings for the sound recording, and for each mistaken variant.
pub(super) fn run(
    world: SimWorld,
    seed: u64,
    longest: f64,
    mistakes: &'static [InputMistake],
) -> MeasureResult<Vec<CheckedRecording>> {
    let (plate, drawn) = (Plate::default(), world.draw(seed)?);
    let scene = Scene::from_yaml(&drawn.told_scene(DrawnWorld::lever(&plate)))?;
    let strokes = drawn.strokes_on_plate(&plate, longest, None)?;
    let sound = ToldRecording {
        scan: drawn.scan(&plate)?,
        messages: drawn.touch(&plate, &strokes)?.messages,
        tip: scene.tip_params(),
    };
    let made = mistakes
        .iter()
        .map(|mistake| (Some(mistake), mistake.made_of(&sound)));
    std::iter::once((None, sound.clone()))
        .chain(made)
        .map(|(mistake, told)| {
            Ok(CheckedRecording {
                world,
                seed,
                mistake,
                findings: findings(scene.clone(), &told)?,
            })
        })
        .collect()
}

fn findings(mut scene: Scene, told: &ToldRecording) -> MeasureResult<Vec<InputFinding>> {
    scene.tip.get_or_insert_default().ball = told.tip;
    let frame = WrenchFrame::Sensor;
    let params = scene.input_monitor_params(frame);
    let contact = ContactEstimatorParams {
        compensator: params.compensator,
        gate: Some(scene.contact.unwrap_or_default()),
        ..ContactEstimatorParams::new(params.tip)
    };
    let (mut monitor, mut contacts) = (InputMonitor::new(params)?, ContactEstimator::new(contact)?);
    let (placement, mut sync) = (scene.placement(), Synchroniser::new(scene.sync_params())?);
    let mut take = |sync: &mut Synchroniser, monitor: &mut InputMonitor| {
        while let Some(sample) = sync.next_sample() {
            monitor.sample(&sample);
            if let Ok(contact) = contacts.observe(&sample) {
                monitor.contact(contact);
            }
        }
    };
    for message in &told.messages {
        let message = placement
            .as_ref()
            .map_or(*message, |placement| placement.place(*message, frame));
        monitor.message(&message);
        sync.push(message);
        take(&mut sync, &mut monitor);
    }
    sync.finish();
    take(&mut sync, &mut monitor);
    Ok(monitor.findings(&told.scan, &FaceTree::new(&told.scan)))
}
