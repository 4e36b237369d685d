//! The trimmed faces of a result as a STEP file.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::reported;
use touchup_features::features::PartBoundary;
use touchup_geometry::brep::Brep;
use touchup_geometry::numeric::counted;
use touchup_io::file_error::FileError;
use touchup_io::step_file::{StepProduct, write_step};

/// Error of writing a STEP file.
#[derive(Debug, thiserror::Error)]
pub enum StepFileError {
    /// The file.
    #[error(transparent)]
    Write(#[from] FileError),
    /// No region of the mesh is a face of a CAD model.
    #[error(
        "{}: no part of the mesh is a plane, cylinder or cone with a sound boundary", path.display()
    )]
    NoFace {
        /// of the STEP file
        path: PathBuf,
    },
}

/// The faces of a written STEP file, or its fault.
pub type StepFileOutcome = Result<StepFileSummary, StepFileError>;

reported! {
    /// The faces of a STEP file in the report.
    pub struct StepFileSummary, fn of(brep: &Brep, left_out: usize) {
        /// trimmed faces
        faces: usize = brep.parts().faces.len(),
        /// trimmed faces fitted to touches
        touched_faces: usize = brep.parts().faces.iter().filter(|face| face.is_touched).count(),
        /// closed shells
        solids: usize = brep.shells().iter().filter(|shell| shell.is_closed).count(),
        /// shells with an open edge
        open_shells: usize = brep.shells().iter().filter(|shell| !shell.is_closed).count(),
        /// surfaces of which no face is sound
        left_out_faces: usize = left_out,
    }
}

/// Writes the faces of a boundary as a STEP file with the name of the file as that of the product.
///
/// # Errors
/// [`StepFileError::NoFace`], [`StepFileError::Write`]; no file is left half written.
pub fn write_boundary(path: &Path, boundary: &PartBoundary) -> StepFileOutcome {
    let no_face = || StepFileError::NoFace {
        path: path.to_owned(),
    };
    let brep = boundary.brep.as_ref().ok_or_else(no_face)?;
    let name = path.file_stem().unwrap_or_default();
    let product = StepProduct {
        name: name.to_string_lossy().into_owned(),
        time_stamp: None,
    };
    write_step(path, brep, &product)?;
    Ok(StepFileSummary::of(brep, boundary.left_out))
}

impl fmt::Display for StepFileSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            faces,
            touched_faces,
            solids,
            open_shells,
            left_out_faces,
        } = self;
        let shells = match (solids, open_shells) {
            (0, open) => counted(*open, "open shell", "open shells"),
            (solids, 0) => counted(*solids, "solid", "solids"),
            (solids, open) => format!(
                "{} and {}",
                counted(*solids, "solid", "solids"),
                counted(*open, "open shell", "open shells")
            ),
        };
        let faces = counted(*faces, "face", "faces");
        write!(f, "{faces}, {touched_faces} of them touched, in {shells}")?;
        match left_out_faces {
            0 => Ok(()),
            left_out => write!(f, "; {left_out} left out"),
        }
    }
}
