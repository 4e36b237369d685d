//! Facts about a scan, for the choice of its unit.

use std::path::Path;

use serde::Serialize;

use touchup_geometry::mesh::RepairReport;
use touchup_io::file_kind::FileKind;
use touchup_io::mesh_file::{LARGEST_M, MeshFileError, MeshUnit, SMALLEST_M};
use touchup_session::scan::{Scan, ScanError, read_scan};

/// Longest side of a usual work-piece, m: the first unit with such a size becomes the suggestion.
const USUAL: std::ops::RangeInclusive<f64> = 10e-3..=2.0;
/// Order of suggested units: scanners write mm, others m, and inches if neither makes sense.
const SUGGESTED: [MeshUnit; 3] = [MeshUnit::Millimetre, MeshUnit::Metre, MeshUnit::Inch];

/// A scan as in its file.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ScanFacts {
    pub file: String,
    pub faces: usize,
    /// whether the surface comes from points
    is_of_points: bool,
    repair: RepairReport,
    pub units: Vec<UnitChoice>,
}

/// Size of the scan if its coordinates are in a unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct UnitChoice {
    pub unit: &'static str,
    /// along x, y and z of the scan, m
    sides_m: [f64; 3],
    /// whether the size is possible for a work-piece
    pub is_plausible: bool,
    /// whether it is the most likely unit
    is_likely: bool,
}

/// Reads a scan in the first unit with a plausible size.
///
/// - `stated`: the unit in a scene or a parameter.
///
/// # Errors
/// In words: the reason of the failure, and a remedy.
pub(super) fn read_facts(
    path: &Path,
    file: &str,
    stated: Option<MeshUnit>,
) -> Result<ScanFacts, String> {
    let (
        unit,
        Scan {
            mesh,
            repair,
            cloud,
        },
    ) = read_in_any(path).map_err(|error| error.to_string())?;
    let [low, high] = mesh.bounds();
    let sides = (high - low) / unit.metres();
    Ok(ScanFacts {
        file: file.to_owned(),
        faces: mesh.face_count(),
        is_of_points: cloud.is_some(),
        repair,
        units: choices(
            sides.into(),
            stated,
            FileKind::of(path) == Some(FileKind::E57),
        ),
    })
}

fn read_in_any(path: &Path) -> Result<(MeshUnit, Scan), ScanError> {
    let in_unit = |unit| read_scan(path, unit).map(|scan| (unit, scan));
    let [first, others @ ..] = SUGGESTED;
    others
        .into_iter()
        .fold(in_unit(first), |read, unit| match read {
            Err(ScanError::File(
                MeshFileError::Implausible { .. } | MeshFileError::UnitOfE57 { .. },
            )) => in_unit(unit),
            read => read,
        })
}

/// - `sides`: in the unit of the file; `is_in_metres`: by the standard of its format.
fn choices(sides: [f64; 3], stated: Option<MeshUnit>, is_in_metres: bool) -> Vec<UnitChoice> {
    let diagonal = sides.iter().map(|side| side * side).sum::<f64>().sqrt();
    let longest = sides.into_iter().fold(0.0, f64::max);
    let is_plausible = |unit: MeshUnit| {
        (!is_in_metres || unit == MeshUnit::Metre)
            && (SMALLEST_M..=LARGEST_M).contains(&(diagonal * unit.metres()))
    };
    let plausible = || SUGGESTED.into_iter().filter(|unit| is_plausible(*unit));
    let usual = plausible().find(|unit| USUAL.contains(&(longest * unit.metres())));
    let likely = stated
        .filter(|unit| is_plausible(*unit))
        .or(usual)
        .or_else(|| plausible().next());
    let choice = |unit: MeshUnit| UnitChoice {
        unit: unit.name(),
        sides_m: sides.map(|side| side * unit.metres()),
        is_plausible: is_plausible(unit),
        is_likely: likely == Some(unit),
    };
    SUGGESTED.map(choice).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn likely(longest: f64, stated: Option<MeshUnit>) -> Vec<&'static str> {
        let all = choices([longest, longest / 2.0, longest / 4.0], stated, false);
        all.iter()
            .filter(|choice| choice.is_likely)
            .map(|choice| choice.unit)
            .collect()
    }

    #[test]
    fn the_unit_that_makes_a_usual_work_piece_of_it_is_suggested_and_a_stated_one_counts_more() {
        // a block of 5 inches, as CAD systems write it in mm, in m, in inches
        assert_eq!(likely(127.0, None), ["mm"]);
        assert_eq!(likely(0.127, None), ["m"]);
        assert_eq!(likely(5.0, None), ["inch"]);
        assert_eq!(likely(5.0, Some(MeshUnit::Millimetre)), ["mm"]);
        // in metres it would exceed the reach of any arm
        assert_eq!(likely(127.0, Some(MeshUnit::Metre)), ["mm"]);
        assert!(likely(1e9, None).is_empty());
    }

    #[test]
    fn sizes_are_those_of_the_file_in_each_unit_and_only_those_that_can_be_are_plausible() {
        let all = choices([127.0, 63.5, 34.9], None, false);
        let plausible: Vec<_> = all
            .iter()
            .map(|choice| (choice.unit, choice.is_plausible))
            .collect();
        assert_eq!(plausible, [("mm", true), ("m", false), ("inch", true)]);
        assert!((all[2].sides_m[0] - 127.0 * 0.0254).abs() < 1e-12);
        // an E57 is in metres
        let of_e57: Vec<_> = choices([2.0, 1.0, 1.0], None, true)
            .iter()
            .map(|choice| choice.is_plausible)
            .collect();
        assert_eq!(of_e57, [false, true, false]);
    }
}
