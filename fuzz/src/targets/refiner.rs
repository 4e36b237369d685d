//! Any samples pushed into a mesh with any vertices: every vertex keeps finite coordinates.

use crate::{BALL, assert_is_somewhere, closed_box, sample, vector};
use arbitrary::{Result, Unstructured};
use nalgebra::Point3;
use touchup_geometry::mesh::TriMesh;
use touchup_method::haptic::{DynamicsParams, GuardParams, RefineParams, Refiner, StepRule};
use touchup_method::stylus::{TipParams, TipShape};

/// A box, or triangles in a fan: needles, points that coincide, faces without area.
fn part(bytes: &mut Unstructured) -> Result<Option<TriMesh>> {
    if bytes.arbitrary()? {
        return Ok(Some(closed_box([4e-3, 3e-3, 2e-3], 4)));
    }
    let mut positions = vec![
        Point3::origin(),
        Point3::new(1e-2, 0.0, 0.0),
        Point3::new(0.0, 1e-2, 0.0),
    ];
    let mut faces = vec![[0, 1, 2]];
    for next in 3..3 + bytes.int_in_range(0..=9)? {
        let near = positions[bytes.choose_index(positions.len())?];
        positions.push(near + vector(bytes, 5e-3)?);
        faces.extend([[next - 2, next - 1, next], [next - 3, next, next - 1]]);
    }
    Ok(TriMesh::new(positions, faces).ok())
}

fn settings(bytes: &mut Unstructured) -> Result<RefineParams> {
    let robust = RefineParams::robust(BALL);
    let bounded = DynamicsParams {
        rule: StepRule::Bounded,
        ..robust.dynamics
    };
    let all = [
        robust,
        RefineParams::robust(TipParams {
            stiffness: None,
            ..BALL
        }),
        RefineParams {
            guard: None,
            ..robust
        },
        RefineParams {
            guard: Some(GuardParams::default()),
            ..robust
        },
        RefineParams {
            gate: None,
            turning: None,
            ..robust
        },
        RefineParams {
            dynamics: bounded,
            ..robust
        },
        RefineParams {
            shape: TipShape::Flat {
                edge_radius: 0.1e-3,
                length: 20e-3,
            },
            ..robust
        },
        RefineParams::paper(BALL),
    ];
    Ok(*bytes.choose(&all)?)
}

fn push_all(bytes: &mut Unstructured) -> Result<()> {
    let params = settings(bytes)?;
    let Some(mesh) = part(bytes)? else {
        return Ok(());
    };
    let Ok(mut refiner) = Refiner::new(mesh, params) else {
        return Ok(());
    };
    let mut stamp_ns = 0;
    while !bytes.is_empty() {
        let vertices = refiner.mesh().positions();
        let near = vertices[bytes.choose_index(vertices.len())?];
        let sample = sample(bytes, &mut stamp_ns, near, 3e-3)?;
        if refiner.push(&sample).is_ok() {
            assert_is_somewhere(refiner.mesh());
        }
    }
    Ok(())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = push_all(&mut Unstructured::new(data));
}
