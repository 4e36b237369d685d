//! The measured value of a characteristic of a feature.

use nalgebra::Point3;

use super::assess::MeasuredNumber;
use super::place::place_number;
use crate::features::{Feature, InspectedQuantity};

/// The measured value of a quantity of a feature, m; `None` if it has none. Only sizes and places
/// are such quantities.
///
/// - `nominal`: its centre in the drawing, m in O.
pub fn measured_number(
    feature: &Feature,
    quantity: InspectedQuantity,
    nominal: Option<&Point3<f64>>,
) -> Option<MeasuredNumber> {
    if quantity.is_linear_size() {
        return feature.size(quantity).map(|size| MeasuredNumber {
            value: size.value,
            std: size.std,
            is_at_least: size.is_at_least,
        });
    }
    let axis = feature.axis.as_ref().map(|axis| axis.value);
    place_number(quantity, feature.kind, &feature.centre, axis, nominal)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::features::{FeatureKind, MeasuredValue};

    #[test]
    fn sizes_and_coordinates_are_those_of_the_feature() {
        let number = |value, std| MeasuredValue::new(value, Some(std), Vec::new());
        let hole = Feature {
            kind: FeatureKind::Hole,
            centre: MeasuredValue {
                value: Point3::new(3.0, 4.0, 9.0),
                std: Some(0.2),
                ..MeasuredValue::default()
            },
            axis: Some(MeasuredValue::new(Vector3::z(), Some(1e-3), Vec::new())),
            diameter: Some(number(8.0, 0.1)),
            ..Feature::default()
        };
        let of = |quantity| measured_number(&hole, quantity, Some(&Point3::origin()));
        let with = |value, std| Some(MeasuredNumber::new(value, std));
        assert_eq!(of(InspectedQuantity::Diameter), with(8.0, Some(0.1)));
        assert_eq!(of(InspectedQuantity::Y), with(4.0, Some(0.2 / 2f64.sqrt())));
        assert_eq!(of(InspectedQuantity::Z), with(9.0, None));
        assert_eq!(
            of(InspectedQuantity::Position),
            with(10.0, Some(0.4 / 2f64.sqrt()))
        );
        assert_eq!(
            (
                of(InspectedQuantity::Width),
                of(InspectedQuantity::Roundness)
            ),
            (None, None)
        );
    }
}
