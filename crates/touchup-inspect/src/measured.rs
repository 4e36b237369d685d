//! The measured value of a characteristic, from a features file.

use nalgebra::{Point3, Vector3};

use super::drawn_feature::measured;
use touchup_features::conformity::{MeasuredNumber, place_number};
use touchup_features::features::{
    FeatureKind, FittedTo, InspectedQuantity, LEAST_TOUCHES, LEAST_TURN,
};
use touchup_io::features_file::{FeatureFile, FeatureRecord, RelationRecord};

/// Measurement of a characteristic in a file.
#[derive(Default)]
pub(super) struct CharacteristicMeasurement {
    pub number: Option<MeasuredNumber>,
    /// cause of a missing number
    pub why_none: Option<String>,
    /// touches behind the number: runs of numbers
    pub runs: Vec<[u32; 2]>,
}

impl CharacteristicMeasurement {
    pub fn none(why: String) -> Self {
        Self {
            why_none: Some(why),
            ..Self::default()
        }
    }
}

/// Whether no touches are behind a feature's numbers; these get no decision.
pub(super) fn is_of_mesh(feature: &FeatureRecord) -> bool {
    feature.fitted_to == FittedTo::Mesh.name()
}

/// Touches that a feature of the mesh lacks for a quantity: number and places.
pub(super) fn missing_touches(feature: &FeatureRecord, quantity: InspectedQuantity) -> String {
    let is_raised = matches!(&*feature.kind, "boss" | "cylinder");
    let is_slot = matches!(&*feature.kind, "slot" | "pocket");
    let of_turn = format!(", over at least {LEAST_TURN} of the turn");
    let (count, surface) = match (quantity, &*feature.kind) {
        (InspectedQuantity::Depth, _) if is_raised => (2, ", half on its foot and half on its top"),
        (InspectedQuantity::Depth, _) => (2, ", half around its opening and half on its floor"),
        (InspectedQuantity::Length, _) if is_slot => {
            (2, ", half on its walls and half on its ends")
        }
        (InspectedQuantity::ConeAngle, _) => (1, &*of_turn),
        (_, "hole" | "notch" | "boss" | "cylinder") => (1, &*of_turn),
        _ if is_slot => (1, ", half on each of its walls"),
        (_, "edge") => (2, ", half on either side of it"),
        (_, "corner") => (3, ", a third on each of its planes"),
        _ => (1, ", spread over it"),
    };
    // walls lie below an opening and above a foot, whose place is known
    let depth = feature.depth_mm.unwrap_or(0.0) * if is_raised { 0.5 } else { -0.5 };
    let place = feature.center_mm.map(|mm| {
        let axis = feature.axis.map_or_else(Vector3::zeros, Vector3::from);
        Point3::from(mm) + axis * depth
    });
    let near = place.map_or(String::new(), |p| {
        format!(" near ({:.1} {:.1} {:.1}) mm", p.x, p.y, p.z)
    });
    let has = if feature.touched > 0.0 {
        format!("with {:.0} % of it touched", feature.touched * 100.0)
    } else {
        "with no touches behind it".to_owned()
    };
    format!(
        "it was fitted to the mesh, {has}, and a mesh alone decides nothing: it takes {} touches{near}{surface}",
        count * LEAST_TOUCHES
    )
}

/// - `nominal_mm`: centre of the feature in the drawing.
/// - `datum`: reference feature of the quantity.
pub(super) fn measurement(
    file: &FeatureFile,
    feature: &FeatureRecord,
    kind: FeatureKind,
    quantity: InspectedQuantity,
    nominal_mm: Option<[f64; 3]>,
    datum: Option<&FeatureRecord>,
) -> CharacteristicMeasurement {
    if quantity.needs_datum() {
        return datum.map_or_else(
            || CharacteristicMeasurement::none("its datum was not found".to_owned()),
            |datum| related(file, feature, datum, quantity),
        );
    }
    let of_place = || {
        let centre = measured(
            Point3::from(feature.center_mm?),
            feature.std.get("center_mm").copied(),
        );
        let axis = feature.axis.map(Vector3::from);
        let nominal = nominal_mm.map(Point3::from);
        place_number(quantity, kind, &centre, axis, nominal.as_ref())
    };
    let behind = if InspectedQuantity::SIZES.contains(&quantity) {
        quantity.name()
    } else {
        surface(feature)
    };
    match feature.number(quantity).or_else(of_place) {
        None => {
            let touch_it = if is_of_mesh(feature) {
                missing_touches(feature, quantity)
            } else {
                "touch it".to_owned()
            };
            CharacteristicMeasurement::none(format!(
                "{quantity} of feature {} was not measured: {touch_it}",
                feature.id
            ))
        }
        number => CharacteristicMeasurement {
            number,
            why_none: None,
            runs: runs_of(feature, behind),
        },
    }
}

/// The number whose touches lie on the feature's surface.
pub(super) fn surface(feature: &FeatureRecord) -> &'static str {
    let walls = ["diameter_mm", "width_mm"];
    walls
        .into_iter()
        .find(|name| feature.touches.contains_key(*name))
        .unwrap_or("center_mm")
}

fn runs_of(feature: &FeatureRecord, name: &str) -> Vec<[u32; 2]> {
    feature.touches.get(name).cloned().unwrap_or_default()
}

fn related(
    file: &FeatureFile,
    feature: &FeatureRecord,
    datum: &FeatureRecord,
    quantity: InspectedQuantity,
) -> CharacteristicMeasurement {
    let find = |of: u32, to: u32| {
        let of_both = file
            .relations
            .iter()
            .filter(|relation| relation.of == of && relation.to == to);
        of_both
            .filter_map(|relation| Some((relation, relation.number(quantity)?)))
            .next()
    };
    // distance and angle between two axes are symmetric
    let is_same_from_either = |relation: &RelationRecord| match quantity {
        InspectedQuantity::Angle => true,
        InspectedQuantity::Distance => relation.kind == "distance",
        _ => false,
    };
    let (of, to) = (feature.id, datum.id);
    let turned = find(to, of);
    let number = match (find(of, to), &turned) {
        (Some((_, number)), _) => number,
        (None, Some((relation, number))) if is_same_from_either(relation) => *number,
        (None, Some(_)) => {
            let why = format!(
                "the features have {quantity} of {to} to {of} alone: exchange feature and datum in the drawing"
            );
            return CharacteristicMeasurement::none(why);
        }
        (None, None) => {
            let why = format!(
                "the features have no {quantity} of {of} to {to}: touch both, and see which relations docs/features.md has"
            );
            return CharacteristicMeasurement::none(why);
        }
    };
    let mut runs = runs_of(feature, surface(feature));
    runs.extend(runs_of(datum, surface(datum)));
    CharacteristicMeasurement {
        number: Some(number),
        why_none: None,
        runs,
    }
}
