//! A part before and after work on it, for `touchup disagree`: the plate of the demo, and the same
//! with its boss 1 mm lower.
//!
//! `cargo run --release --example milled_boss -- FOLDER` writes `before.ply` and `now.ply` into a
//! folder, in mm.

use std::path::PathBuf;

use anyhow::Context;
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::mesh::VertexId;
use touchup::sim::Plate;

/// Milled depth, m.
const LOST: f64 = 1e-3;
/// Nothing but the top of the boss lies higher, m.
const ABOVE: f64 = 15e-3;

fn main() -> anyhow::Result<()> {
    let folder = PathBuf::from(std::env::args_os().nth(1).context("name a folder")?);
    std::fs::create_dir_all(&folder)?;
    let mut plate = Plate::default().mesh(20e-6)?;
    write_mesh(&folder.join("before.ply"), &plate, MeshUnit::Millimetre)?;
    for vertex in (0..plate.vertex_slots() as u32).map(VertexId) {
        let mut place = plate.position(vertex);
        if place.z > ABOVE {
            place.z -= LOST;
            plate.set_position(vertex, place);
        }
    }
    write_mesh(&folder.join("now.ply"), &plate, MeshUnit::Millimetre)?;
    Ok(())
}
