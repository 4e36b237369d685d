//! Results of an inspection: JSON, and its characteristics as a table. Lengths in mm, angles in
//! degrees.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::file_error::{FileError, write_file};
use super::result_table::cell_text;

/// A whole inspection.
#[derive(Clone, Debug, Default, Serialize)]
pub struct InspectionRecord {
    /// name or number of the part, if known
    pub part: Option<String>,
    /// serial number of this part
    pub serial: Option<String>,
    /// inspector
    pub operator: Option<String>,
    /// day and time, UTC, RFC 3339
    pub date: String,
    /// version of the program
    pub program: String,
    /// `iso14253` or `simple`
    pub rule: String,
    /// probability that the rule asks for
    pub confidence: f64,
    /// k of the expanded uncertainties
    pub coverage_factor: f64,
    /// of the whole: `fail` if one characteristic fails, else `undecided` if one is, else `pass`
    pub verdict: String,
    /// by decision
    pub counts: BTreeMap<String, usize>,
    /// input files
    pub files: Vec<InspectedFile>,
    /// alignment of drawing and part; absent if both use the frame of the mesh
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<AlignmentRecord>,
    /// in the order of the drawing
    pub characteristics: Vec<CharacteristicRecord>,
    /// measured holes, slots, pockets, bosses, cylinders, notches and spheres without a characteristic, by
    /// `id`
    pub without_characteristic: Vec<u32>,
    /// further remarks, a sentence each
    pub notes: Vec<String>,
}

/// The motion from the frame of the mesh to that of the drawing: x ↦ rotation · x + translation.
#[derive(Clone, Debug, Default, Serialize)]
pub struct AlignmentRecord {
    /// `best-fit` or `datums`
    pub method: String,
    /// features of the alignment, datums in their order
    pub features: Vec<AlignedFeatureRecord>,
    /// rows of its matrix
    pub rotation: [[f64; 3]; 3],
    /// the same as a vector: along the axis, as long as the angle
    pub rotation_vector_deg: [f64; 3],
    /// of the origin
    pub translation_mm: [f64; 3],
    /// middle of the features, in the frame of the drawing
    pub center_mm: [f64; 3],
    /// standard uncertainties of the shift there, in the frame of the drawing
    pub translation_std_mm: [f64; 3],
    /// standard uncertainties of the rotation
    pub rotation_std_deg: [f64; 3],
    /// root mean square of `residual_mm`
    pub residual_rms_mm: f64,
    /// the largest
    pub residual_max_mm: f64,
}

/// A feature of an alignment.
#[derive(Clone, Debug, Default, Serialize)]
pub struct AlignedFeatureRecord {
    /// of a characteristic of it in the drawing
    pub name: String,
    /// kind of the feature
    pub kind: String,
    /// `id` of the measured feature
    pub feature: u32,
    /// distance from its nominal place after the alignment: across its axis, for a plane along its
    /// normal
    pub residual_mm: f64,
}

impl InspectionRecord {
    /// Frame of positions and coordinates: `mesh`, or the frame of the drawing.
    pub fn frame(&self) -> String {
        let Some(AlignmentRecord {
            method, features, ..
        }) = &self.alignment
        else {
            return "mesh".to_owned();
        };
        let datums = features
            .iter()
            .map(|feature| format!(" {}", feature.feature))
            .collect::<String>();
        format!(
            "drawing by {method}{}",
            if method == "datums" {
                datums
            } else {
                String::new()
            }
        )
    }
}

/// An input file of an inspection.
#[derive(Clone, Debug, Serialize)]
pub struct InspectedFile {
    /// role of the file
    pub role: String,
    /// path as given
    pub path: String,
    /// its length
    pub bytes: u64,
    /// its checksum, eight hexadecimal digits
    pub crc32: String,
}

/// One characteristic.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CharacteristicRecord {
    /// number of the balloon in the picture, and of the characteristic there: `2.1`
    pub number: String,
    /// of the drawing
    pub name: String,
    /// kind of the feature
    pub kind: String,
    /// `id` of the feature; absent if none was found
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feature: Option<u32>,
    /// `id` of the datum
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datum: Option<u32>,
    /// inspected quantity, with its unit
    pub quantity: String,
    /// numbers by name and unit, as in [`NUMBERS`]; unknown ones are absent
    #[serde(flatten)]
    pub numbers: BTreeMap<String, f64>,
    /// whether the actual value is a lower bound
    pub is_at_least: bool,
    /// source of the tolerance, such as `drawing` or `iso2768-m`
    pub tolerance_from: String,
    /// `pass`, `undecided` or `fail`
    pub decision: String,
    /// reason for no decision, and the remedy
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// probability of conformance
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformance_probability: Option<f64>,
    /// probability of a wrong decision; absent for undecided ones
    #[serde(skip_serializing_if = "Option::is_none")]
    pub risk: Option<f64>,
    /// number of touches in the fit
    pub touches: usize,
    /// `touches` or `mesh`
    pub fitted_to: String,
}

/// Names of the numbers of a characteristic, each followed by `_mm` or `_deg`.
pub const NUMBERS: [&str; 11] = [
    "nominal",
    "lower_limit",
    "upper_limit",
    "actual",
    "deviation",
    "standard_uncertainty",
    "expanded_uncertainty",
    "acceptance_lower",
    "acceptance_upper",
    "rejection_lower",
    "rejection_upper",
];

impl CharacteristicRecord {
    /// `mm` or `deg`.
    pub fn unit(&self) -> &str {
        self.quantity.rsplit_once('_').map_or("", |(_, unit)| unit)
    }

    /// A number by its name without the unit.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers
            .get(&format!("{name}_{}", self.unit()))
            .copied()
    }

    /// Stores a number.
    pub fn set(&mut self, name: &str, number: Option<f64>) {
        debug_assert!(NUMBERS.contains(&name), "{name}");
        if let Some(number) = number {
            self.numbers
                .insert(format!("{name}_{}", self.unit()), number);
        }
    }
}

const BEFORE: [&str; 6] = ["number", "name", "kind", "feature", "datum", "quantity"];
const BEHIND: [&str; 9] = [
    "is_at_least",
    "tolerance_from",
    "decision",
    "conformance_probability",
    "risk",
    "touches",
    "fitted_to",
    "reason",
    "frame",
];

/// Writes the characteristics as a table, as a whole or not at all; columns in degrees only if
/// there is an angle.
///
/// - `frame`: frame of positions and coordinates, in each line.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_inspection_table(
    path: &Path,
    characteristics: &[CharacteristicRecord],
    frame: &str,
) -> Result<(), FileError> {
    let units: Vec<_> = ["mm", "deg"]
        .into_iter()
        .filter(|unit| *unit == "mm" || characteristics.iter().any(|one| one.unit() == *unit))
        .collect();
    let numbers = units
        .iter()
        .flat_map(|unit| NUMBERS.map(|name| format!("{name}_{unit}")));
    let columns: Vec<String> = BEFORE
        .map(str::to_owned)
        .into_iter()
        .chain(numbers)
        .chain(BEHIND.map(str::to_owned))
        .collect();
    write_file(path, |out| {
        let mut rows = csv::Writer::from_writer(out);
        rows.write_record(&columns)?;
        for one in characteristics {
            let mut row = serde_json::to_value(one)?;
            row["is_at_least"] = u8::from(one.is_at_least).into();
            row["frame"] = frame.into();
            rows.write_record(columns.iter().map(|column| cell_text(row.get(column))))?;
        }
        rows.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(name: &str, quantity: &str) -> CharacteristicRecord {
        let mut record = CharacteristicRecord {
            name: name.to_owned(),
            quantity: quantity.to_owned(),
            ..CharacteristicRecord::default()
        };
        record.set("nominal", Some(8.0));
        record.set("actual", None);
        record
    }

    #[test]
    fn units_stand_in_the_names_of_numbers() {
        let json = serde_json::to_value(record("a", "cone_angle_deg")).unwrap();
        assert_eq!(
            (json["nominal_deg"].as_f64(), json.get("nominal_mm")),
            (Some(8.0), None)
        );
        assert!(json.get("actual_deg").is_none() && json.get("risk").is_none());
    }

    #[test]
    fn a_table_has_degrees_only_with_an_angle_and_one_width_in_all_rows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let lines = |characteristics: &[CharacteristicRecord]| {
            write_inspection_table(&path, characteristics, "mesh").unwrap();
            std::fs::read_to_string(&path).unwrap()
        };
        let lengths = lines(&[record("a", "diameter_mm"), record("b", "depth_mm")]);
        assert!(!lengths.contains("_deg"), "{lengths}");
        let both = lines(&[record("a", "diameter_mm"), record("b", "angle_deg")]);
        let widths: Vec<_> = both.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(
            widths,
            [BEFORE.len() + 2 * NUMBERS.len() + BEHIND.len(); 3],
            "{both}"
        );
    }
}
