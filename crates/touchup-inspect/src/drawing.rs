//! Nominal part: characteristics with their limits, from a file, or from the features of a CAD
//! mesh.

use std::path::Path;

use clap::Args;
use nalgebra::{Point3, Vector3};

use super::InspectionError;
use super::alignment::AlignmentMethod;
use super::drawn_feature::{DrawnFeature, measured, shape_of};
use super::source::inspected_file;
use super::words::first_few;
use touchup_features::conformity::{GeneralTolerance, ToleranceLimits};
use touchup_features::features::{Feature, InspectedQuantity, MeasuredValue};
use touchup_io::features_file::{FeatureFile, FeatureRecord};
use touchup_io::inspection_file::InspectedFile;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::nominal_file::{NominalRecord, NominalTolerance, is_nominal_file, read_nominal};
use touchup_session::scan::read_scan;
use touchup_session::session::found;

/// Settings of a drawing: additions to its nominal values, and its place on the part.
#[derive(Clone, Debug, Args)]
pub struct DrawingParams {
    /// Unit of the coordinates in the CAD mesh of --nominal
    #[arg(long = "nominal-unit", value_name = "U", default_value = "mm")]
    pub unit: MeshUnit,
    /// General tolerance for sizes without their own
    #[arg(long, value_name = "CLASS", conflicts_with = "tolerance_mm")]
    pub general: Option<GeneralTolerance>,
    /// Tolerance ± for all sizes without their own, mm; instead of --general
    #[arg(long, value_name = "T")]
    pub tolerance_mm: Option<f64>,
    /// With a CAD mesh: also the position of each hole, slot, pocket and boss, within a zone of
    /// this diameter, mm
    #[arg(long, value_name = "D")]
    pub position_mm: Option<f64>,
    /// Largest distance across the axis between the centres of a feature and its nominal one, mm
    // less than the distance between neighbours on most parts
    #[arg(long, value_name = "R", default_value_t = 1.5)]
    pub match_mm: f64,
    /// Aligns drawing and part: best-fit, over all common features; or datums=NAME,NAME,NAME, names
    /// of characteristics, primary to tertiary. Positions are then in the drawing's frame
    #[arg(long, value_name = "HOW")]
    pub align: Option<AlignmentMethod>,
}

/// One characteristic and its limits.
pub struct DrawnCharacteristic {
    pub nominal: NominalRecord,
    pub quantity: InspectedQuantity,
    pub limits: ToleranceLimits,
    /// source of the limits
    pub from: String,
    /// for a CAD mesh, loss of size by its facets, relative to the circle through their corners,
    /// which is the nominal value, mm
    pub facets_mm: f64,
}

/// All characteristics of a part.
pub struct PartDrawing {
    /// characteristics with their tolerances
    pub characteristics: Vec<DrawnCharacteristic>,
    /// features whose places align drawing and part
    pub features: Vec<DrawnFeature>,
    /// file of the drawing
    pub file: InspectedFile,
    /// omissions, in words
    pub notes: Vec<String>,
}

impl PartDrawing {
    /// Reads nominal values, or derives them from the features of a CAD mesh.
    pub fn read(path: &Path, params: &DrawingParams) -> Result<Self, InspectionError> {
        if is_nominal_file(path) {
            let records = read_nominal(path)?;
            let drawn = |record: NominalRecord| {
                drawn(record, 0.0, params).map_err(|why| InspectionError::Drawing {
                    path: path.to_owned(),
                    why,
                })
            };
            let characteristics: Vec<_> =
                records.into_iter().map(drawn).collect::<Result<_, _>>()?;
            let features = features_of_records(&characteristics);
            return Ok(Self {
                characteristics,
                features,
                file: inspected_file("drawing", path)?,
                notes: Vec::new(),
            });
        }
        let has_tolerance = params.general.is_some() || params.tolerance_mm.is_some();
        if !has_tolerance {
            return Err(InspectionError::NoTolerance);
        }
        let found = features_of_mesh(path, params)?.features;
        let records = of_features(&found, params);
        let (mut characteristics, mut left) = (Vec::new(), Vec::new());
        for (record, facets_mm) in records {
            let name = record.name.clone();
            drawn(record, facets_mm, params)
                .map_or_else(|_| left.push(name), |one| characteristics.push(one));
        }
        if characteristics.is_empty() {
            let why =
                "no hole, slot, pocket, boss, notch, cylinder or sphere was found on it".to_owned();
            return Err(InspectionError::Drawing {
                path: path.to_owned(),
                why,
            });
        }
        let mut notes = Vec::new();
        if !left.is_empty() {
            notes.push(format!(
                "The general tolerance has no value for {}: not inspected.",
                left.join(", ")
            ));
        }
        notes.extend(facets_note(&characteristics));
        let features = features_of_shapes(&found);
        Ok(Self {
            characteristics,
            features,
            file: inspected_file("drawing (CAD mesh)", path)?,
            notes,
        })
    }
}

/// Loss of size by the facets of a CAD mesh; `None` without facets.
fn facets_note(characteristics: &[DrawnCharacteristic]) -> Option<String> {
    let faceted = characteristics.iter().filter(|one| one.facets_mm > 0.0);
    let faceted: Vec<String> = faceted
        .map(|one| format!("{} {:.3} mm", one.nominal.name, one.facets_mm))
        .collect();
    let note = || {
        format!(
            "Round walls of the CAD mesh are facets. Nominal values are those of the circles through their corners; between the \
             facets less by: {}.",
            first_few(&faceted, ", ")
        )
    };
    (!faceted.is_empty()).then(note)
}

/// Features of characteristics, and features that serve as datums alone.
fn features_of_records(characteristics: &[DrawnCharacteristic]) -> Vec<DrawnFeature> {
    let mut features: Vec<(NominalRecord, DrawnFeature)> = Vec::new();
    for DrawnCharacteristic {
        nominal, quantity, ..
    } in characteristics
    {
        let at = features
            .iter()
            .position(|(first, _)| first.is_of_the_same_feature(nominal));
        let at = at.unwrap_or_else(|| {
            features.push((nominal.clone(), drawn_feature(nominal)));
            features.len() - 1
        });
        let DrawnFeature { names, shape, .. } = &mut features[at].1;
        names.push(nominal.name.clone());
        let size = || Some(measured(nominal.nominal() * 1e-3, None));
        match quantity {
            InspectedQuantity::Diameter => shape.diameter = size(),
            InspectedQuantity::Width => shape.width = size(),
            _ => {}
        }
        if shape.axis.is_none() {
            shape.axis = axis_of(nominal);
        }
    }
    let datums = characteristics
        .iter()
        .filter_map(|drawn| Some((&drawn.nominal.name, drawn.nominal.datum.as_ref()?)));
    for (name, datum) in datums {
        let (kind, center_mm, feature) = (datum.kind.clone(), datum.center_mm, datum.feature);
        let record = NominalRecord {
            name: format!("datum of {name}"),
            kind,
            center_mm,
            feature,
            ..NominalRecord::default()
        };
        if !features
            .iter()
            .any(|(first, _)| first.is_of_the_same_feature(&record))
        {
            let names = vec![record.name.clone()];
            features.push((
                record.clone(),
                DrawnFeature {
                    names,
                    ..drawn_feature(&record)
                },
            ));
        }
    }
    features.into_iter().map(|(_, feature)| feature).collect()
}

fn drawn_feature(record: &NominalRecord) -> DrawnFeature {
    let centre = record
        .center_mm
        .map_or_else(Point3::origin, |mm| Point3::from(mm) * 1e-3);
    let shape = Feature {
        kind: record.kind().unwrap_or_default(),
        centre: measured(centre, None),
        axis: axis_of(record),
        ..Feature::default()
    };
    DrawnFeature {
        names: Vec::new(),
        id: record.feature,
        shape,
        has_place: record.center_mm.is_some(),
    }
}

/// Axis as a unit vector.
fn axis_of(record: &NominalRecord) -> Option<MeasuredValue<Vector3<f64>>> {
    Some(measured(
        Vector3::from(record.axis?).try_normalize(0.0)?,
        None,
    ))
}

/// Features of a CAD mesh, which are exact, named by kind and number.
fn features_of_shapes(found: &[FeatureRecord]) -> Vec<DrawnFeature> {
    let mut counts = std::collections::BTreeMap::new();
    let feature = |record: &FeatureRecord| {
        let count = counts.entry(record.kind.clone()).or_insert(0);
        *count += 1;
        let names = vec![format!("{} {count}", record.kind)];
        Some(DrawnFeature {
            names,
            id: None,
            shape: shape_of(record)?,
            has_place: true,
        })
    };
    found.iter().filter_map(feature).collect()
}

/// A characteristic with its own limits, or with the general tolerance.
fn drawn(
    nominal: NominalRecord,
    facets_mm: f64,
    params: &DrawingParams,
) -> Result<DrawnCharacteristic, String> {
    let quantity = nominal
        .quantity()
        .ok_or_else(|| format!("{}: no such quantity", nominal.name))?;
    let (limits, from) = match nominal.tolerance() {
        NominalTolerance::Limits(limits) => (limits, "drawing".to_owned()),
        NominalTolerance::General => general_limits(&nominal, quantity, params)?,
    };
    Ok(DrawnCharacteristic {
        nominal,
        quantity,
        limits,
        from,
        facets_mm,
    })
}

fn general_limits(
    record: &NominalRecord,
    quantity: InspectedQuantity,
    params: &DrawingParams,
) -> Result<(ToleranceLimits, String), String> {
    let (name, unit, nominal) = (&record.name, quantity.unit(), record.nominal());
    let own = format!("fill in tolerance_{unit} or limit deviations");
    if params.general.is_none() && params.tolerance_mm.is_none() {
        return Err(format!(
            "{name} has no tolerance: {own}, or name a general one by --general iso2768-m or --tolerance-mm"
        ));
    }
    if !quantity.is_linear_size() {
        return Err(format!(
            "{name} has no tolerance, and the general one is for sizes, not for {quantity}: {own}"
        ));
    }
    let (half, from) = match (params.tolerance_mm, params.general) {
        (Some(tolerance), _) => (Some(tolerance), "--tolerance-mm".to_owned()),
        (None, Some(class)) => (class.linear_mm(nominal), class.name().to_owned()),
        (None, None) => (None, String::new()),
    };
    let half = half.ok_or_else(|| {
        format!("{name} has no tolerance, and {from} has none for {nominal} mm: {own}")
    })?;
    Ok((
        ToleranceLimits::about(nominal, Some(-half), Some(half)),
        from,
    ))
}

fn features_of_mesh(path: &Path, params: &DrawingParams) -> Result<FeatureFile, InspectionError> {
    let scan = read_scan(path, params.unit).map_err(InspectionError::DrawingMesh)?;
    Ok(found(&scan.mesh, &[]).1)
}

/// Kinds with sizes.
const WITH_SIZES: [&str; 7] = [
    "hole", "slot", "pocket", "boss", "notch", "cylinder", "sphere",
];

/// Feature sizes as nominal values without tolerances, each with its loss by facets, mm; through
/// holes without depth.
fn of_features(features: &[FeatureRecord], params: &DrawingParams) -> Vec<(NominalRecord, f64)> {
    let mut records = Vec::new();
    let mut counts = std::collections::BTreeMap::new();
    for feature in features
        .iter()
        .filter(|feature| WITH_SIZES.contains(&&*feature.kind))
    {
        let count = counts.entry(&feature.kind).or_insert(0);
        *count += 1;
        let (kind, count) = (&feature.kind, *count);
        let base = NominalRecord {
            kind: kind.clone(),
            center_mm: feature.center_mm.map(|center| center.map(rounded)),
            axis: feature.axis,
            ..NominalRecord::default()
        };
        let has_depth = feature.through != Some(true) && feature.depth_is_at_least.is_none();
        let sizes = [
            InspectedQuantity::Diameter,
            InspectedQuantity::Width,
            InspectedQuantity::Length,
            InspectedQuantity::Depth,
        ];
        for quantity in sizes {
            let is_drawn = quantity != InspectedQuantity::Depth || has_depth;
            let Some(size) = feature.number(quantity).filter(|_| is_drawn) else {
                continue;
            };
            let name = format!("{kind} {count} {}", quantity.parts().0);
            let nominal_mm = Some(rounded(size.value));
            let is_round = matches!(
                quantity,
                InspectedQuantity::Diameter | InspectedQuantity::Length
            );
            let facets_mm = feature.facets_mm.filter(|_| is_round);
            let record = NominalRecord {
                name,
                quantity: quantity.name().to_owned(),
                nominal_mm,
                ..base.clone()
            };
            records.push((record, 2.0 * facets_mm.unwrap_or(0.0)));
        }
        if let (Some(tolerance), "hole" | "slot" | "pocket" | "boss") =
            (params.position_mm, &**kind)
        {
            let (name, quantity) = (
                format!("{kind} {count} position"),
                InspectedQuantity::Position.name().to_owned(),
            );
            let record = NominalRecord {
                name,
                quantity,
                tolerance_mm: Some(tolerance),
                ..base
            };
            records.push((record, 0.0));
        }
    }
    records
}

/// Rounds to a micrometre, the resolution of a drawing.
fn rounded(mm: f64) -> f64 {
    (mm * 1e3).round() / 1e3
}

/// Nominal values for editing: from the CAD mesh, or else from the measurement, with the general
/// tolerance if there is one.
///
/// - `mesh`: the CAD mesh.
///
/// # Errors
/// [`InspectionError`] of the mesh.
pub fn template(
    mesh: Option<&Path>,
    measured: &FeatureFile,
    params: &DrawingParams,
) -> Result<Vec<NominalRecord>, InspectionError> {
    let records = match mesh {
        Some(mesh) => of_features(&features_of_mesh(mesh, params)?.features, params),
        None => of_features(&measured.features, params),
    };
    let with_tolerance = |record: NominalRecord| {
        let is_drawn = matches!(record.tolerance(), NominalTolerance::Limits(_));
        let half = match (params.tolerance_mm, params.general) {
            _ if is_drawn => record.tolerance_mm,
            (Some(tolerance), _) => Some(tolerance),
            (None, class) => class.and_then(|class| class.linear_mm(record.nominal())),
        };
        NominalRecord {
            tolerance_mm: half,
            ..record
        }
    };
    let records = records.into_iter().map(|(record, _)| record);
    Ok(records.map(with_tolerance).collect())
}
