//! Measured quantities of features.

use serde::{Serialize, Serializer};

use super::feature::FeatureKind;
use touchup_method::names;

names! {
    /// A toleranced quantity of a drawing, by its name with its unit.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum InspectedQuantity {
        /// of a hole, notch, boss, cylinder or sphere
        Diameter = "diameter_mm",
        /// of a slot or pocket
        Width = "width_mm",
        /// of a slot, pocket or cylinder
        Length = "length_mm",
        /// of a hole, slot or pocket; height of a boss
        Depth = "depth_mm",
        /// full angle of a countersink
        ConeAngle = "cone_angle_deg",
        /// coordinate of the centre
        X = "x_mm",
        /// coordinate of the centre
        Y = "y_mm",
        /// coordinate of the centre
        Z = "z_mm",
        /// diameter of the cylinder about the nominal axis through the centre, twice its distance
        /// (ISO 1101)
        Position = "position_mm",
        /// width of a zone
        Roundness = "roundness_mm",
        /// width of a zone
        Cylindricity = "cylindricity_mm",
        /// diameter of the cylinder that encloses the axis
        Straightness = "straightness_mm",
        /// width of a zone
        Flatness = "flatness_mm",
        /// to a datum
        Perpendicularity = "perpendicularity_mm",
        /// to a datum
        Parallelism = "parallelism_mm",
        /// to a datum
        Coaxiality = "coaxiality_mm",
        /// to a datum
        Concentricity = "concentricity_mm",
        /// from a datum
        Distance = "distance_mm",
        /// to a datum
        Angle = "angle_deg",
    }
}

impl Serialize for InspectedQuantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl InspectedQuantity {
    /// Sizes of a feature, in the order of its file.
    pub const SIZES: [Self; 5] = [
        Self::Diameter,
        Self::Length,
        Self::Width,
        Self::Depth,
        Self::ConeAngle,
    ];

    /// Converts a value in m or rad to the unit of the name.
    pub fn from_si(self, value: f64) -> f64 {
        match self.unit() {
            "deg" => value.to_degrees(),
            _ => value * 1e3,
        }
    }

    /// Name and unit apart: `diameter`, `mm`.
    pub fn parts(self) -> (&'static str, &'static str) {
        self.name().rsplit_once('_').unwrap_or((self.name(), ""))
    }

    /// `mm` or `deg`.
    pub fn unit(self) -> &'static str {
        self.parts().1
    }

    /// Whether the quantity is a width of 0 at best: its tolerance is only an upper limit, and its
    /// nominal value is 0.
    pub fn is_zone(self) -> bool {
        matches!(
            self,
            Self::Position
                | Self::Roundness
                | Self::Cylindricity
                | Self::Straightness
                | Self::Flatness
                | Self::Perpendicularity
                | Self::Parallelism
                | Self::Coaxiality
                | Self::Concentricity
        )
    }

    /// Whether the quantity relates the feature to another feature.
    pub fn needs_datum(self) -> bool {
        matches!(
            self,
            Self::Perpendicularity
                | Self::Parallelism
                | Self::Coaxiality
                | Self::Concentricity
                | Self::Distance
                | Self::Angle
        )
    }

    /// Whether features of this kind have the quantity.
    pub fn is_of(self, kind: FeatureKind) -> bool {
        let is_round = matches!(
            kind,
            FeatureKind::Hole | FeatureKind::Boss | FeatureKind::Cylinder | FeatureKind::Notch
        );
        let is_slot = matches!(kind, FeatureKind::Slot | FeatureKind::Pocket);
        match self {
            Self::Diameter => is_round || kind == FeatureKind::Sphere,
            Self::Roundness | Self::Cylindricity | Self::Straightness => is_round,
            Self::Width => is_slot,
            Self::Length => is_slot || matches!(kind, FeatureKind::Edge | FeatureKind::Cylinder),
            Self::Depth => {
                is_slot
                    || matches!(
                        kind,
                        FeatureKind::Hole | FeatureKind::Boss | FeatureKind::Cylinder
                    )
            }
            Self::ConeAngle => kind == FeatureKind::Hole,
            Self::Flatness => kind == FeatureKind::Plane,
            Self::Position => !matches!(
                kind,
                FeatureKind::Plane | FeatureKind::Corner | FeatureKind::Sphere
            ),
            _ => true,
        }
    }

    /// Whether a general tolerance for linear dimensions applies.
    pub fn is_linear_size(self) -> bool {
        matches!(
            self,
            Self::Diameter | Self::Width | Self::Length | Self::Depth | Self::Distance
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_ends_in_its_unit_and_is_read_again() {
        for quantity in InspectedQuantity::ALL {
            assert!(matches!(quantity.unit(), "mm" | "deg"), "{quantity}");
            assert_eq!(InspectedQuantity::of_name(quantity.name()), Some(quantity));
        }
        assert_eq!(InspectedQuantity::of_name("diameter"), None);
    }

    #[test]
    fn every_quantity_is_of_some_kind_and_every_kind_has_a_place() {
        for quantity in InspectedQuantity::ALL {
            assert!(
                FeatureKind::ALL
                    .into_iter()
                    .any(|kind| quantity.is_of(kind)),
                "{quantity}"
            );
        }
        for kind in FeatureKind::ALL {
            assert!(
                [
                    InspectedQuantity::X,
                    InspectedQuantity::Y,
                    InspectedQuantity::Z
                ]
                .into_iter()
                .all(|quantity| quantity.is_of(kind)),
                "{kind}"
            );
        }
        assert!(
            !InspectedQuantity::Position.is_of(FeatureKind::Plane)
                && !InspectedQuantity::Width.is_of(FeatureKind::Hole)
        );
    }
}
