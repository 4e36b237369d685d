//! The known surfaces beside a recording.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use tracing::warn;

use touchup_io::json_lines::JsonLineError;
use touchup_io::recording::{
    KnownSurfaceLine, bad_surface_line, known_surfaces_beside, read_known_surfaces,
};
use touchup_method::reconstruct::KnownSurface;

/// Largest difference of tips that are the same, as a share of the radius: what a file in mm
/// rounds.
const SAME_TIP: f64 = 1e-9;

/// Surfaces of the file beside a recording.
#[derive(Clone, Debug, Default)]
pub struct RecordedSurfaces {
    path: PathBuf,
    lines: Vec<KnownSurfaceLine>,
}

impl RecordedSurfaces {
    /// Reads the file; none without a file.
    ///
    /// # Errors
    /// [`JsonLineError`]
    pub fn beside(recording: &Path) -> Result<Self, JsonLineError> {
        let path = known_surfaces_beside(recording);
        let lines = read_known_surfaces(&path)?;
        Ok(Self { path, lines })
    }

    /// Passes on the surfaces found with a tip; with another one, the same touches lie elsewhere,
    /// and a warning names the number of those that do not count.
    ///
    /// - `radius`: of the tip, m.
    ///
    /// # Errors
    /// [`JsonLineError`] with the first line that is refused.
    pub fn of_tip<E: Display>(
        &self,
        radius: f64,
        mut know: impl FnMut(KnownSurface) -> Result<(), E>,
    ) -> Result<(), JsonLineError> {
        let is_same =
            |line: &KnownSurfaceLine| (line.tip_radius() - radius).abs() <= SAME_TIP * radius;
        for (at, line) in self
            .lines
            .iter()
            .enumerate()
            .filter(|(_, line)| is_same(line))
        {
            know(line.surface()).map_err(|why| bad_surface_line(&self.path, at, &why))?;
        }
        let mut others = self.lines.iter().filter(|line| !is_same(line));
        if let Some(first) = others.next() {
            warn!(
                "{}: {} of {} surfaces do not count: they were touched with a tip of {} mm radius, and the scene says {} mm",
                self.path.display(),
                1 + others.count(),
                self.lines.len(),
                1e3 * first.tip_radius(),
                1e3 * radius
            );
        }
        Ok(())
    }
}
