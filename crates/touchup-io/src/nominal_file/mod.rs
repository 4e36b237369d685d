//! Nominal values and tolerances of a part, as on a drawing: CSV or JSON; lengths in mm, angles in
//! degrees, in the frame of the mesh.

mod error;
mod json;
mod record;
mod rows;

use std::collections::BTreeMap;
use std::path::Path;

use crate::file_kind::FileKind;

pub use error::NominalFileError;
pub use record::{DatumRecord, NominalRecord, NominalTolerance};

/// Whether a file holds nominal values; else it is a mesh.
pub fn is_nominal_file(path: &Path) -> bool {
    matches!(FileKind::of(path), Some(FileKind::Csv | FileKind::Json))
}

/// Reads nominal values: `.json`, else a table.
///
/// # Errors
/// [`NominalFileError`]: the first fault, with its line.
pub fn read_nominal(path: &Path) -> Result<Vec<NominalRecord>, NominalFileError> {
    let placed = if FileKind::of(path) == Some(FileKind::Json) {
        json::read(path)?
    } else {
        rows::read(path)?
    };
    let wrong = |place: &str, why| NominalFileError::Characteristic {
        path: path.to_owned(),
        place: place.to_owned(),
        why,
    };
    let mut names: BTreeMap<&str, &str> = BTreeMap::new();
    let mut characteristics: Vec<(&NominalRecord, &str)> = Vec::new();
    for (place, record) in &placed {
        record.check().map_err(|why| wrong(place, why))?;
        if let Some(first) = names.insert(&record.name, place) {
            return Err(wrong(
                place,
                format!(
                    "the name {:?} is that of {first}: give each its own",
                    record.name
                ),
            ));
        }
        if let Some((_, first)) = characteristics
            .iter()
            .find(|(other, _)| other.is_the_same_as(record))
        {
            let quantity = &record.quantity;
            return Err(wrong(
                place,
                format!(
                    "{quantity} of this feature has its tolerance in {first}: remove one of the two"
                ),
            ));
        }
        characteristics.push((record, place));
    }
    if placed.is_empty() {
        return Err(NominalFileError::Empty(path.to_owned()));
    }
    Ok(placed.into_iter().map(|(_, record)| record).collect())
}

/// Writes nominal values, as a whole or not at all: `.json`, else a table.
///
/// - `comment`: lines above a table; JSON has none.
///
/// # Errors
/// [`NominalFileError::File`].
pub fn write_nominal(
    path: &Path,
    records: &[NominalRecord],
    comment: &[&str],
) -> Result<(), NominalFileError> {
    let written = if FileKind::of(path) == Some(FileKind::Json) {
        json::write(path, records)
    } else {
        rows::write(path, records, comment)
    };
    Ok(written?)
}

#[cfg(test)]
mod tests;
