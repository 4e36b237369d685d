//! Simulated scan and touch of a known part per seed, as files like recorded ones.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use super::error::SweepError;
use crate::scan::read_scan;
use touchup_geometry::mesh::TriMesh;
use touchup_io::atomic::create_folder;
use touchup_io::file_error::FileError;
use touchup_io::mesh_file::{MeshUnit, write_mesh};
use touchup_io::recording::{Record, Topics, write_recording};
use touchup_sim::{
    Habit, MeshSurface, PathParams, Plate, ScannerParams, Stroke, StylusParams, Surface, plan_demo,
    plan_sides, scan, touch,
};

/// Written files of scan and recording.
pub(super) struct SimulatedFiles {
    pub scan: PathBuf,
    pub recording: PathBuf,
}

/// A part and the strokes on it.
pub(super) struct PartToTouch {
    part: TruePart,
    strokes: Vec<Stroke>,
    name: String,
}

enum TruePart {
    Plate(Plate),
    Mesh(TriMesh),
}

impl PartToTouch {
    /// - `part`: `plate`, the part of `touchup demo`, or a closed mesh, touched as in `touchup
    ///   simulate`.
    pub fn new(part: &Path, unit: MeshUnit) -> Result<Self, SweepError> {
        if part.as_os_str() == "plate" {
            let plate = Plate::default();
            let strokes = plan_demo(&plate, &PathParams::default())?;
            return Ok(Self {
                part: TruePart::Plate(plate),
                strokes,
                name: "plate".to_owned(),
            });
        }
        let refused = |why: String| SweepError::Grid {
            path: part.to_owned(),
            why,
        };
        let truth = read_scan(part, unit)
            .map_err(|error| refused(error.to_string()))?
            .mesh;
        let hand = PathParams {
            radius: StylusParams::default().radius,
            ..PathParams::default()
        };
        let strokes = plan_sides(
            &MeshSurface::new(&truth)?,
            &[Vector3::z_axis()],
            Habit::Slide,
            &hand,
        )?;
        let name = part.file_stem().map_or_else(
            || "part".to_owned(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        Ok(Self {
            part: TruePart::Mesh(truth),
            strokes,
            name,
        })
    }

    /// Scans and touches the part, and writes both files below `folder`, in mm.
    pub fn write(&self, seed: u64, folder: &Path) -> Result<SimulatedFiles, SweepError> {
        match &self.part {
            TruePart::Plate(plate) => self.write_surface(plate, seed, folder),
            TruePart::Mesh(truth) => self.write_surface(&MeshSurface::new(truth)?, seed, folder),
        }
    }

    fn write_surface(
        &self,
        surface: &dyn Surface,
        seed: u64,
        folder: &Path,
    ) -> Result<SimulatedFiles, SweepError> {
        let folder = folder
            .join("simulated")
            .join(format!("{}_{seed}", self.name));
        create_folder(&folder).map_err(|source| FileError::Write {
            path: folder.clone(),
            source,
        })?;
        let scanned = scan(
            surface,
            &ScannerParams {
                seed,
                ..ScannerParams::default()
            },
        )?;
        let touched = touch(surface, &self.strokes, &StylusParams::default(), seed)?;
        let files = SimulatedFiles {
            scan: folder.join("scan.ply"),
            recording: folder.join("touch.mcap"),
        };
        write_mesh(&files.scan, &scanned, MeshUnit::Millimetre)
            .map_err(crate::session::OutcomeError::WriteMesh)?;
        let records = touched
            .messages
            .iter()
            .map(|message| Record::Message(*message));
        let written = write_recording(
            &files.recording,
            &Topics::default(),
            "object",
            "stylus",
            records,
        );
        written.map_err(|error| SweepError::NoResult {
            path: files.recording.clone(),
            why: error.to_string(),
        })?;
        Ok(files)
    }
}
