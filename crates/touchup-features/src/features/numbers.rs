//! Numbers of a feature, of its form and of a relation, each by its quantity: m and rad.

use super::feature::{Feature, Form, MeasuredValue};
use super::quantity::InspectedQuantity;
use super::relations::{Relation, RelationKind};
use touchup_geometry::form::{Deviation, Estimate, RoundForm};

impl Feature {
    /// The known sizes, in the order of [`InspectedQuantity::SIZES`].
    pub fn sizes(&self) -> impl Iterator<Item = (InspectedQuantity, &MeasuredValue<f64>)> {
        let sizes = [
            &self.diameter,
            &self.length,
            &self.width,
            &self.depth,
            &self.cone_angle,
        ];
        InspectedQuantity::SIZES
            .into_iter()
            .zip(sizes)
            .filter_map(|(quantity, size)| Some((quantity, size.as_ref()?)))
    }

    /// A size, if known.
    pub fn size(&self, quantity: InspectedQuantity) -> Option<&MeasuredValue<f64>> {
        let (_, size) = self.sizes().find(|(own, _)| *own == quantity)?;
        Some(size)
    }

    /// Diameter or width.
    pub fn main_size(&self) -> Option<&MeasuredValue<f64>> {
        self.diameter.as_ref().or(self.width.as_ref())
    }
}

impl Form {
    /// The known deviations.
    pub fn deviations(&self) -> impl Iterator<Item = (InspectedQuantity, Deviation)> {
        let all = match self {
            Self::Round(round) => vec![
                (InspectedQuantity::Roundness, Some(round.roundness)),
                (InspectedQuantity::Cylindricity, round.cylindricity),
                (InspectedQuantity::Straightness, round.straightness),
            ],
            Self::Flat(flat) => vec![(InspectedQuantity::Flatness, Some(flat.flatness))],
        };
        all.into_iter()
            .filter_map(|(quantity, deviation)| Some((quantity, deviation?)))
    }

    /// Share of the turn, or of the rectangle around the touches, that they cover.
    pub fn coverage(&self) -> f64 {
        match self {
            Self::Round(round) => round.coverage,
            Self::Flat(flat) => flat.coverage,
        }
    }

    /// The form of round walls.
    pub fn round(&self) -> Option<&RoundForm> {
        match self {
            Self::Round(round) => Some(round),
            Self::Flat(_) => None,
        }
    }
}

impl Relation {
    /// The known numbers.
    pub fn numbers(&self) -> impl Iterator<Item = (InspectedQuantity, Estimate)> {
        let zone = match self.kind {
            RelationKind::Perpendicularity => InspectedQuantity::Perpendicularity,
            RelationKind::Parallelism => InspectedQuantity::Parallelism,
            RelationKind::Coaxiality | RelationKind::Distance => InspectedQuantity::Coaxiality,
        };
        let all = [
            (zone, self.zone),
            (InspectedQuantity::Concentricity, self.concentricity),
            (InspectedQuantity::Distance, self.distance),
            (InspectedQuantity::Angle, self.angle),
        ];
        all.into_iter()
            .filter_map(|(quantity, estimate)| Some((quantity, estimate?)))
    }
}
