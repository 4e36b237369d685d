//! The measured value of a characteristic of a feature.

use nalgebra::{Point3, Vector3};

use super::assess::MeasuredNumber;
use super::place::{coordinate_std, position};
use super::quantity::InspectedQuantity;
use crate::features::{Feature, Measured};

/// The measured value of a quantity of a feature, m; `None` if it has none. Only sizes and places
/// are such quantities.
///
/// - `nominal`: its centre in the drawing, m in O.
pub fn measured_number(
    feature: &Feature,
    quantity: InspectedQuantity,
    nominal: Option<&Point3<f64>>,
) -> Option<MeasuredNumber> {
    let size = |size: &Option<Measured<f64>>| {
        let size = size.as_ref()?;
        Some(MeasuredNumber {
            value: size.value,
            std: size.std,
            is_at_least: size.is_at_least,
        })
    };
    let axis = feature.axis.as_ref().map(|axis| axis.value);
    let (centre, std) = (&feature.centre.value, feature.centre.std);
    match quantity {
        InspectedQuantity::Diameter => size(&feature.diameter),
        InspectedQuantity::Width => size(&feature.width),
        InspectedQuantity::Length => size(&feature.length),
        InspectedQuantity::Depth => size(&feature.depth),
        InspectedQuantity::X | InspectedQuantity::Y | InspectedQuantity::Z => {
            let at = quantity as usize - InspectedQuantity::X as usize;
            let std =
                std.and_then(|std| coordinate_std(feature.kind, axis, std, &Vector3::ith(at, 1.0)));
            Some(MeasuredNumber {
                value: centre[at],
                std,
                is_at_least: false,
            })
        }
        InspectedQuantity::Position => position(feature.kind, centre, axis, std, nominal?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::Kind;

    #[test]
    fn sizes_and_coordinates_are_those_of_the_feature() {
        let number = |value, std| Measured {
            value,
            std: Some(std),
            ..Measured::default()
        };
        let hole = Feature {
            kind: Kind::Hole,
            centre: Measured {
                value: Point3::new(3.0, 4.0, 9.0),
                std: Some(0.2),
                ..Measured::default()
            },
            axis: Some(Measured {
                value: Vector3::z(),
                std: Some(1e-3),
                ..Measured::default()
            }),
            diameter: Some(number(8.0, 0.1)),
            ..Feature::default()
        };
        let of = |quantity| measured_number(&hole, quantity, Some(&Point3::origin()));
        let with = |value, std| {
            Some(MeasuredNumber {
                value,
                std,
                is_at_least: false,
            })
        };
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
