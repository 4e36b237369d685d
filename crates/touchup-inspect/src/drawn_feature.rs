//! Features as shapes: nominal ones, which identify the measured ones, and features of files.

use nalgebra::{Point3, Vector3};

use touchup_features::features::{Feature, FeatureKind, FittedTo, MeasuredValue};
use touchup_io::features_file::FeatureRecord;

/// A feature of the drawing.
#[derive(Clone, Debug)]
pub struct DrawnFeature {
    /// names of its characteristics; for a CAD mesh its kind and a number
    pub names: Vec<String>,
    /// number of the measured feature, if the drawing states it
    pub id: Option<u32>,
    /// kind, centre, axis and sizes in the frame of the drawing
    pub shape: Feature,
    /// whether the drawing states its place
    pub has_place: bool,
}

impl DrawnFeature {
    /// First name.
    pub fn name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// Diameter or width, m.
    pub fn size(&self) -> Option<f64> {
        Some(self.shape.main_size()?.value)
    }
}

/// Shape of a file's feature: kind, place, axis and sizes with their uncertainties; `None` without
/// a place.
pub(super) fn shape_of(record: &FeatureRecord) -> Option<Feature> {
    let std = |name: &str, unit: f64| record.std.get(name).map(|std| std * unit);
    let size = |value: Option<f64>, name: &str| Some(measured(value? * 1e-3, std(name, 1e-3)));
    Some(Feature {
        id: record.id,
        kind: FeatureKind::of_name(&record.kind)?,
        centre: measured(
            Point3::from(record.center_mm?) * 1e-3,
            std("center_mm", 1e-3),
        ),
        axis: record
            .axis
            .map(|axis| measured(Vector3::from(axis), std("axis_deg", 1f64.to_radians()))),
        direction: record.direction.map(Vector3::from),
        diameter: size(record.diameter_mm, "diameter_mm"),
        length: size(record.length_mm, "length_mm"),
        width: size(record.width_mm, "width_mm"),
        depth: size(record.depth_mm, "depth_mm"),
        through: record.through,
        is_convex: record.convex,
        fitted_to: FittedTo::of_name(&record.fitted_to).unwrap_or(FittedTo::Touches),
        ..Feature::default()
    })
}

/// A number or place with its standard uncertainty.
pub(super) fn measured<T: Default>(value: T, std: Option<f64>) -> MeasuredValue<T> {
    MeasuredValue::new(value, std, Vec::new())
}
