//! Nominal values as JSON.

use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::NominalFileError;
use super::record::NominalRecord;
use crate::file_error::{FileError, read_file, write_file};

/// Nominal values in their JSON form.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NominalDocument {
    characteristics: Vec<NominalRecord>,
}

pub(super) fn read(path: &Path) -> Result<Vec<(String, NominalRecord)>, NominalFileError> {
    let text = read_file(path)?;
    let file: NominalDocument =
        serde_json::from_slice(&text).map_err(|source| NominalFileError::Json {
            path: path.to_owned(),
            source,
        })?;
    let placed = (1..)
        .zip(file.characteristics)
        .map(|(number, record)| (format!("characteristic {number}"), record));
    Ok(placed.collect())
}

pub(super) fn write(path: &Path, records: &[NominalRecord]) -> Result<(), FileError> {
    let file = NominalDocument {
        characteristics: records.to_vec(),
    };
    let text =
        serde_json::to_string_pretty(&file).expect("finite numbers and names alone cannot fail");
    write_file(path, |out| writeln!(out, "{text}"))
}
