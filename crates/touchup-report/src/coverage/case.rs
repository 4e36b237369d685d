//! One seed of one world: scan and recording in memory, refined as by `touchup refine`.

use super::kind::CoverageKind;
use super::stated::StatedNumber;
use super::truth::{feature_numbers, vertex_kind};
use crate::error::{MeasureError, MeasureResult};
use touchup_geometry::mesh::{FaceTree, VertexId};
use touchup_io::touches_file::as_written;
use touchup_method::reconstruct::{PatchedMesh, Patcher};
use touchup_method::stylus::{Message, Placement, Synchroniser, WrenchFrame};
use touchup_session::live::{Engine, Renewal};
use touchup_session::scene::Scene;
use touchup_session::session::found;
use touchup_sim::{DrawnWorld, Plate, SimWorld, Surface};

/// Shares of a turn that the hand follows along walls, by seed: a full turn, no hole at all, half a
/// turn, a third.
const TURNS: [Option<f64>; 4] = [Some(1.0), None, Some(0.5), Some(1.0 / 3.0)];

/// All stated numbers of a plate.
pub(super) fn run(
    world: SimWorld,
    seed: u64,
    longest: f64,
) -> MeasureResult<Vec<(CoverageKind, StatedNumber)>> {
    let (plate, drawn) = (Plate::default(), world.draw(seed)?);
    let scene = Scene::from_yaml(&drawn.told_scene(DrawnWorld::lever(&plate)))?;
    let turn = TURNS[(seed.wrapping_sub(1) % TURNS.len() as u64) as usize];
    let strokes = drawn.strokes_on_plate(&plate, longest, turn)?;
    let messages = drawn.touch(&plate, &strokes)?.messages;
    let (patched, patcher) = refined(&scene, &drawn, &plate, &messages)?;
    let mut numbers = vertex_numbers(&patched, &plate);
    let (detection, _) = found(&patched.mesh, &as_written(patcher.probed()));
    numbers.extend(
        detection
            .features
            .iter()
            .flat_map(|feature| feature_numbers(feature, &plate)),
    );
    Ok(numbers)
}

/// The scan, refined by the messages.
fn refined(
    scene: &Scene,
    drawn: &DrawnWorld,
    plate: &Plate,
    messages: &[Message],
) -> MeasureResult<(PatchedMesh, Patcher)> {
    let frame = WrenchFrame::Sensor;
    let scan = drawn.scan(plate)?;
    let params = scene
        .refine_params(frame)
        .ok_or(MeasureError::NothingMoves)?;
    let mut engine = Engine::new(scan.clone(), params, scene.patcher_params(), Renewal::AtEnd)?;
    let placement = scene.placement();
    placement.iter().try_for_each(Placement::check)?;
    let mut sync = Synchroniser::new(scene.sync_params())?;
    for message in messages {
        let placed = placement
            .as_ref()
            .map_or(*message, |placement| placement.place(*message, frame));
        sync.push(placed);
        std::iter::from_fn(|| sync.next_sample())
            .try_for_each(|sample| engine.push(&sample).map(drop))?;
    }
    sync.finish();
    std::iter::from_fn(|| sync.next_sample())
        .try_for_each(|sample| engine.push(&sample).map(drop))?;
    let mut patcher = engine.finish()?.patcher.ok_or(MeasureError::NothingMoves)?;
    patcher.flush();
    let patched = patcher.patched(&scan, &FaceTree::new(&scan))?;
    Ok((patched, patcher))
}

fn vertex_numbers(patched: &PatchedMesh, plate: &Plate) -> Vec<(CoverageKind, StatedNumber)> {
    let PatchedMesh {
        mesh,
        support,
        sigma,
        ..
    } = patched;
    let number = |v: u32| {
        let (id, v) = (VertexId(v), v as usize);
        let p = (mesh.has_vertex(id) && !mesh.star(id).is_empty()).then(|| mesh.position(id))?;
        let kind = vertex_kind(&p, *support.get(v)?, plate)?;
        Some((
            kind,
            StatedNumber {
                error: plate.signed_distance(&p),
                std: *sigma.get(v)?,
                is_at_least: false,
            },
        ))
    };
    (0..mesh.vertex_slots() as u32).filter_map(number).collect()
}
