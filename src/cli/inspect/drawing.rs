//! What the part should be: characteristics with their limits, from a file, or from the features of a CAD mesh.

use std::path::Path;

use super::source::inspected_file;
use crate::cli::{CliError, Losses, counted, print_result};
use crate::conformity::{GeneralTolerance, InspectedQuantity, ToleranceLimits};
use crate::io::features_file::{FeatureFile, FeatureRecord};
use crate::io::inspection_file::InspectedFile;
use crate::io::mesh_file::MeshUnit;
use crate::io::nominal_file::{
    NominalFileError, NominalRecord, NominalTolerance, is_nominal_file, read_nominal, write_nominal,
};
use crate::scan::read_scan;
use crate::session::found;

/// What flags say of a drawing.
pub(super) struct DrawingFlags {
    /// of a CAD mesh
    pub unit: MeshUnit,
    pub general: Option<GeneralTolerance>,
    pub tolerance_mm: Option<f64>,
    pub position_mm: Option<f64>,
}

/// One characteristic and its limits.
pub(super) struct Drawn {
    pub nominal: NominalRecord,
    pub quantity: InspectedQuantity,
    pub limits: ToleranceLimits,
    /// where the limits are from
    pub from: String,
}

/// All characteristics of a part.
pub(super) struct PartDrawing {
    pub characteristics: Vec<Drawn>,
    pub file: InspectedFile,
    /// what was left out of it, in words
    pub notes: Vec<String>,
}

impl PartDrawing {
    /// Reads nominal values, or makes them of the features of a CAD mesh.
    pub fn read(path: &Path, flags: &DrawingFlags) -> Result<Self, CliError> {
        if is_nominal_file(path) {
            let records = read_nominal(path)?;
            let drawn = |record: NominalRecord| {
                drawn(record, flags)
                    .map_err(|why| CliError::new(("nominal", 3), format!("{}: {why}", path.display()), None))
            };
            let characteristics = records.into_iter().map(drawn).collect::<Result<_, _>>()?;
            return Ok(Self { characteristics, file: inspected_file("drawing", path)?, notes: Vec::new() });
        }
        let has_tolerance = flags.general.is_some() || flags.tolerance_mm.is_some();
        let why = "a CAD mesh has no tolerances: name a general one by --general iso2768-m or --tolerance-mm";
        crate::cli::require(has_tolerance, why)?;
        let records = of_features(&features_of_mesh(path, flags)?.features, flags);
        let (mut characteristics, mut left) = (Vec::new(), Vec::new());
        for record in records {
            let name = record.name.clone();
            drawn(record, flags).map_or_else(|_| left.push(name), |one| characteristics.push(one));
        }
        if characteristics.is_empty() {
            let why = format!("{}: no hole, slot, pocket, boss, notch or cylinder was found on it", path.display());
            return Err(CliError::new(("nominal", 3), why, None));
        }
        let mut notes = Vec::new();
        if !left.is_empty() {
            notes.push(format!("The general tolerance has no value for {}: not inspected.", left.join(", ")));
        }
        Ok(Self { characteristics, file: inspected_file("drawing (CAD mesh)", path)?, notes })
    }
}

/// A characteristic with its own limits, or those of the general tolerance.
fn drawn(nominal: NominalRecord, flags: &DrawingFlags) -> Result<Drawn, String> {
    let quantity = nominal.quantity().ok_or_else(|| format!("{}: no such quantity", nominal.name))?;
    let (limits, from) = match nominal.tolerance() {
        NominalTolerance::Limits(limits) => (limits, "drawing".to_owned()),
        NominalTolerance::General => general_limits(&nominal, quantity, flags)?,
    };
    Ok(Drawn { nominal, quantity, limits, from })
}

fn general_limits(
    record: &NominalRecord,
    quantity: InspectedQuantity,
    flags: &DrawingFlags,
) -> Result<(ToleranceLimits, String), String> {
    let (name, unit, nominal) = (&record.name, quantity.unit(), record.nominal());
    let own = format!("fill in tolerance_{unit} or limit deviations");
    if flags.general.is_none() && flags.tolerance_mm.is_none() {
        return Err(format!(
            "{name} has no tolerance: {own}, or name a general one by --general iso2768-m or --tolerance-mm"
        ));
    }
    if !quantity.is_linear_size() {
        return Err(format!("{name} has no tolerance, and the general one is for sizes, not for {quantity}: {own}"));
    }
    let (half, from) = match (flags.tolerance_mm, flags.general) {
        (Some(tolerance), _) => (Some(tolerance), "--tolerance-mm".to_owned()),
        (None, Some(class)) => (class.linear_mm(nominal), class.name().to_owned()),
        (None, None) => (None, String::new()),
    };
    let half = half.ok_or_else(|| format!("{name} has no tolerance, and {from} has none for {nominal} mm: {own}"))?;
    Ok((ToleranceLimits { lower: Some(nominal - half), upper: Some(nominal + half) }, from))
}

fn features_of_mesh(path: &Path, flags: &DrawingFlags) -> Result<FeatureFile, CliError> {
    let named = |error: crate::scan::ScanError| {
        CliError::new(("nominal", 3), error.to_string().replace("--mesh-unit", "--nominal-unit"), Some(&error))
    };
    let scan = read_scan(path, flags.unit).map_err(named)?;
    Ok(found(&scan.mesh, &[]).1)
}

/// Kinds that have sizes.
const WITH_SIZES: [&str; 6] = ["hole", "slot", "pocket", "boss", "notch", "cylinder"];

/// Sizes of features as nominal values without tolerances; those of a through hole without its depth.
fn of_features(features: &[FeatureRecord], flags: &DrawingFlags) -> Vec<NominalRecord> {
    let mut records = Vec::new();
    let mut counts = std::collections::BTreeMap::new();
    for feature in features.iter().filter(|feature| WITH_SIZES.contains(&&*feature.kind)) {
        let count = counts.entry(&feature.kind).or_insert(0);
        *count += 1;
        let (kind, count) = (&feature.kind, *count);
        let base = NominalRecord {
            kind: kind.clone(),
            center_mm: feature.center_mm.map(|center| center.map(rounded)),
            ..NominalRecord::default()
        };
        let depth = feature.depth_mm.filter(|_| feature.through != Some(true) && feature.depth_is_at_least.is_none());
        let sizes = [
            (InspectedQuantity::Diameter, feature.diameter_mm),
            (InspectedQuantity::Width, feature.width_mm),
            (InspectedQuantity::Length, feature.length_mm),
            (InspectedQuantity::Depth, depth),
        ];
        for (quantity, size) in sizes {
            let Some(size) = size else { continue };
            let name = format!("{kind} {count} {}", quantity.parts().0);
            let nominal_mm = Some(rounded(size));
            records.push(NominalRecord { name, quantity: quantity.name().to_owned(), nominal_mm, ..base.clone() });
        }
        if let (Some(tolerance), "hole" | "slot" | "pocket" | "boss") = (flags.position_mm, &**kind) {
            let (name, quantity) = (format!("{kind} {count} position"), InspectedQuantity::Position.name().to_owned());
            records.push(NominalRecord { name, quantity, tolerance_mm: Some(tolerance), ..base });
        }
    }
    records
}

/// To a micrometre: a drawing has no more.
fn rounded(mm: f64) -> f64 {
    (mm * 1e3).round() / 1e3
}

/// Writes nominal values to be edited.
pub(super) fn write_template(
    path: &Path,
    nominal: Option<&Path>,
    measured: &FeatureFile,
    flags: &DrawingFlags,
) -> Result<Losses, CliError> {
    let of_mesh = nominal.filter(|nominal| !is_nominal_file(nominal));
    crate::cli::require(
        nominal.is_none() || of_mesh.is_some(),
        "--write-nominal begins with a CAD mesh or with FEATURES",
    )?;
    let records = match of_mesh {
        Some(mesh) => of_features(&features_of_mesh(mesh, flags)?.features, flags),
        None => of_features(&measured.features, flags),
    };
    if records.is_empty() {
        return Err(CliError::from(NominalFileError::Empty(path.to_owned())));
    }
    let with_tolerance = |record: NominalRecord| {
        let is_drawn = matches!(record.tolerance(), NominalTolerance::Limits(_));
        let half = match (flags.tolerance_mm, flags.general) {
            _ if is_drawn => record.tolerance_mm,
            (Some(tolerance), _) => Some(tolerance),
            (None, class) => class.and_then(|class| class.linear_mm(record.nominal())),
        };
        NominalRecord { tolerance_mm: half, ..record }
    };
    let records: Vec<_> = records.into_iter().map(with_tolerance).collect();
    let origin = if of_mesh.is_some() {
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
    print_result(&format!("wrote {}: {count}; fill in the tolerances", path.display()))?;
    Ok(Losses::new())
}
