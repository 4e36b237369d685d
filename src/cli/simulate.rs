//! What a known surface looks like to a bad scanner and feels like to a stylus, as the files that `refine` reads.

use std::path::Path;

use super::CliError;
use super::progress::Progress;
use crate::io::atomic::create_folder;
use crate::io::mesh_file::{MeshUnit, write_mesh};
use crate::io::recording::{Recorded, Topics, write_recording};
use crate::mesh::TriMesh;
use crate::sim::{ScannerParams, Stroke, StylusParams, Surface, Touch, scan, touch};
use crate::touch::Message;

/// Frame of the poses in the recordings.
const OBJECT_FRAME: &str = "object";
/// Frame of the wrenches: the stylus' own.
const STYLUS_FRAME: &str = "stylus";

/// A simulated scan and touch.
pub(super) struct Simulated {
    pub scan: TriMesh,
    pub touch: Touch,
}

/// Scans and touches `surface`, and writes truth.ply, scan.ply (both in mm) and touch.mcap into `folder`.
pub(super) fn write_simulation(
    surface: &dyn Surface,
    truth: &TriMesh,
    path: &[Stroke],
    scanner: &ScannerParams,
    stylus: &StylusParams,
    seed: u64,
    folder: &Path,
) -> Result<Simulated, CliError> {
    create_folder(folder).map_err(|source| CliError::Write { path: folder.to_owned(), source })?;
    let stage = Progress::stage("scan");
    let scan = scan(surface, scanner)?;
    drop(stage);
    let _stage = Progress::stage("touch");
    let touch = touch(surface, path, stylus, seed)?;
    let messages = touch.messages.iter().map(|message| match *message {
        Message::Pose(pose) => Recorded::Pose(pose),
        Message::Wrench(wrench) => Recorded::Wrench(wrench),
    });
    for (name, mesh) in [("truth.ply", truth), ("scan.ply", &scan)] {
        write_mesh(&folder.join(name), mesh, MeshUnit::Millimetre).map_err(CliError::WriteMesh)?;
    }
    write_recording(&folder.join("touch.mcap"), &Topics::default(), OBJECT_FRAME, STYLUS_FRAME, messages)
        .map_err(CliError::WriteRecording)?;
    Ok(Simulated { scan, touch })
}
