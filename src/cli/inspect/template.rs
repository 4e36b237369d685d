//! `--write-nominal`: nominal values for editing.

use std::path::Path;

use crate::cli::{CliError, Losses, counted, print_result, require};
use touchup_inspect::{DrawingParams, template};
use touchup_io::features_file::FeatureFile;
use touchup_io::nominal_file::{NominalFileError, is_nominal_file, write_nominal};

/// Writes nominal values of a CAD mesh, or else of the measured features.
pub(super) fn write(
    path: &Path,
    nominal: Option<&Path>,
    measured: &FeatureFile,
    params: &DrawingParams,
) -> Result<Losses, CliError> {
    let mesh = nominal.filter(|nominal| !is_nominal_file(nominal));
    require(
        nominal.is_none() || mesh.is_some(),
        "--write-nominal begins with a CAD mesh or with FEATURES",
    )?;
    let records = template(mesh, measured, params)?;
    if records.is_empty() {
        return Err(CliError::from(NominalFileError::Empty(path.to_owned())));
    }
    let origin = if mesh.is_some() {
        "features of the CAD mesh"
    } else {
        "MEASURED features: replace them by those of the drawing"
    };
    let comment = [
        &*format!("nominal values are those of the {origin}"),
        "lengths in mm, angles in degrees, in the frame of the mesh; docs/inspect.md has all columns",
    ];
    write_nominal(path, &records, &comment)?;
    let count = counted(records.len(), "characteristic", "characteristics");
    print_result(&format!(
        "wrote {}: {count}; fill in the tolerances",
        path.display()
    ))?;
    Ok(Losses::new())
}
