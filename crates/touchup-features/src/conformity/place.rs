//! Place of a feature as in a drawing: coordinates of its centre and its position.

use nalgebra::{Point3, Vector3};

use super::assess::MeasuredNumber;
use crate::features::{FeatureKind, InspectedQuantity, MeasuredValue};

/// Cosine of 5°: a direction within that counts as along or square to an axis, as in relations of
/// features.
const ALONG: f64 = 0.996_194_698_091_745_5;
/// Sine of 5°.
const SQUARE: f64 = 0.087_155_742_747_658_17;

/// Coordinate or position of a centre; `None` for any other quantity, and for a position without an
/// axis or nominal centre. Centre, nominal centre and number are in one unit.
pub fn place_number(
    quantity: InspectedQuantity,
    kind: FeatureKind,
    centre: &MeasuredValue<Point3<f64>>,
    axis: Option<Vector3<f64>>,
    nominal: Option<&Point3<f64>>,
) -> Option<MeasuredNumber> {
    let at = match quantity {
        InspectedQuantity::X => 0,
        InspectedQuantity::Y => 1,
        InspectedQuantity::Z => 2,
        InspectedQuantity::Position => {
            return position(kind, &centre.value, axis, centre.std, nominal?);
        }
        _ => return None,
    };
    let along = |std| coordinate_std(kind, axis, std, &Vector3::ith(at, 1.0));
    let std = centre.std.and_then(along);
    Some(MeasuredNumber::new(centre.value[at], std))
}

/// Standard uncertainty of the coordinate of a centre along a direction.
///
/// The uncertainty of a centre is the root mean square distance across the axis, which two
/// coordinates share; for a plane it is along its normal, for a corner or sphere the distance in
/// space, which three share.
///
/// - `std`: of the centre.
/// - `direction`: unit vector.
/// - returns: `None` if the uncertainty of the centre does not cover that direction.
fn coordinate_std(
    kind: FeatureKind,
    axis: Option<Vector3<f64>>,
    std: f64,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let along = axis.map(|axis| axis.dot(direction).abs());
    match (kind, along) {
        (FeatureKind::Corner | FeatureKind::Sphere, _) => Some(std / 3f64.sqrt()),
        (FeatureKind::Plane, Some(along)) => (along >= ALONG).then_some(std),
        (_, Some(along)) => (along <= SQUARE).then_some(std / 2f64.sqrt()),
        (_, None) => None,
    }
}

/// Position of a centre: twice its distance from the nominal one across the axis [ISO 1101:2017,
/// cylindrical zone]; `None` for a plane, corner or sphere. Its standard uncertainty is twice that of one
/// coordinate.
///
/// - `centre`, `nominal`: in one unit, which the result has too; `std` of the centre as well.
/// - returns: `None` without an axis to measure across.
fn position(
    kind: FeatureKind,
    centre: &Point3<f64>,
    axis: Option<Vector3<f64>>,
    std: Option<f64>,
    nominal: &Point3<f64>,
) -> Option<MeasuredNumber> {
    let off = centre - nominal;
    if matches!(
        kind,
        FeatureKind::Plane | FeatureKind::Corner | FeatureKind::Sphere
    ) {
        return None;
    }
    let distance = off.cross(&axis?).norm();
    let std = std.map(|std| 2.0 * std / 2f64.sqrt());
    Some(MeasuredNumber::new(2.0 * distance, std))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_coordinates_share_what_is_known_of_an_axis() {
        let z = Some(Vector3::z());
        assert_eq!(
            coordinate_std(FeatureKind::Hole, z, 0.02, &Vector3::x()),
            Some(0.02 / 2f64.sqrt())
        );
        assert_eq!(
            coordinate_std(FeatureKind::Hole, z, 0.02, &Vector3::z()),
            None,
            "along the axis nothing is known"
        );
        assert_eq!(
            coordinate_std(FeatureKind::Plane, z, 0.02, &Vector3::z()),
            Some(0.02)
        );
        assert_eq!(
            coordinate_std(FeatureKind::Plane, z, 0.02, &Vector3::x()),
            None
        );
        assert_eq!(
            coordinate_std(FeatureKind::Corner, None, 0.03, &Vector3::x()),
            Some(0.03 / 3f64.sqrt())
        );
    }

    /// 3-4-5 across the axis; along the axis nothing counts.
    #[test]
    fn position_is_twice_the_distance_across_the_axis() {
        let (centre, nominal) = (Point3::new(13.0, 24.0, 7.0), Point3::new(10.0, 20.0, 0.0));
        let found = position(
            FeatureKind::Hole,
            &centre,
            Some(Vector3::z()),
            Some(0.1),
            &nominal,
        )
        .unwrap();
        assert_eq!(found.value, 10.0);
        assert!((found.std.unwrap() - 0.2 / 2f64.sqrt()).abs() < 1e-15);
        assert_eq!(
            position(FeatureKind::Hole, &centre, None, Some(0.1), &nominal),
            None
        );
    }
}
