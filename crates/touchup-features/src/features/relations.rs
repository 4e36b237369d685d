//! Relations between touched features, as in a drawing.

use super::feature::{Feature, FeatureKind};
use touchup_geometry::form::{
    Element, Estimate, Shape, angle, coaxiality, concentricity, distance, orientation,
};
use touchup_method::names;

names! {
    /// Kind of a relation.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum RelationKind {
        /// width of the zone or diameter of the cylinder, over the extent of the first feature; the
        /// angle between both
        Perpendicularity = "perpendicularity",
        /// the same, and the distance of two planes, or of an axis and a plane
        Parallelism = "parallelism",
        /// diameter of the cylinder about the second feature's axis around the first one's
        Coaxiality = "coaxiality",
        /// distance of two axes across them
        Distance = "distance",
    }
}

/// Relation of a touched feature to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// kind of relation
    pub kind: RelationKind,
    /// number of the toleranced feature, whose extent counts
    pub of: u32,
    /// number of the datum
    pub to: u32,
    /// width or diameter of the zone, m; none of a distance
    pub zone: Option<Estimate>,
    /// between both axes, normals, or an axis and a plane, 0 to π/2, rad
    pub angle: Option<Estimate>,
    /// distance of the middle of the toleranced feature from the datum, m
    pub distance: Option<Estimate>,
    /// of coaxial features: diameter of the circle about the datum through the middle of the
    /// toleranced axis, m
    pub concentricity: Option<Estimate>,
}

/// Tolerance of features intended parallel or square, rad: 5°.
const MEANT: f64 = 0.087;
/// Maximum distance of axes intended as one, as a share of the smaller diameter.
const ONE_AXIS: f64 = 0.1;
/// Maximum number of related features: the first of each kind are the largest.
const MOST_RELATED: usize = 24;

/// Relations of features measured by touch, in the order of the features.
///
/// - Of two planes, each to the one with the larger extent: parallelism and distance, or
///   perpendicularity.
/// - Of an axis and its nearest square plane: perpendicularity; of an axis along a plane:
///   parallelism and distance.
/// - Of two parallel axes, each to the longer: coaxiality, or their distance.
pub fn relations(features: &[Feature]) -> Vec<Relation> {
    let of_shape = |shape: Shape| -> Vec<(&Feature, &Element)> {
        let known = features
            .iter()
            .filter_map(|f| Some((f, f.element.as_ref().filter(|e| e.shape == shape)?)));
        known.take(MOST_RELATED).collect()
    };
    let (axes, planes) = (of_shape(Shape::Axis), of_shape(Shape::Plane));
    let mut found = Vec::new();
    for (at, one) in planes.iter().enumerate() {
        found.extend(
            planes[..at]
                .iter()
                .filter_map(|other| Relation::of_alike(one, other)),
        );
    }
    for axis in &axes {
        let squares = planes
            .iter()
            .filter(|plane| cosine(axis.1, plane.1) > MEANT.cos());
        let off = |plane: &Element| {
            (axis.0.centre.value - plane.point)
                .dot(&plane.direction)
                .abs()
        };
        let land = squares.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        found.extend(land.and_then(|land| Relation::oriented(axis, land)));
        let beside = planes
            .iter()
            .filter(|plane| cosine(axis.1, plane.1) < MEANT.sin());
        found.extend(beside.filter_map(|plane| Relation::oriented(axis, plane)));
    }
    for (at, one) in axes.iter().enumerate() {
        found.extend(
            axes[..at]
                .iter()
                .filter_map(|other| Relation::of_alike(one, other)),
        );
    }
    found
}

/// Cosine of the angle between directions, 0 or more.
fn cosine(a: &Element, b: &Element) -> f64 {
    a.direction.dot(&b.direction).abs()
}

/// Extent of the touches, m.
fn reach(element: &Element) -> f64 {
    let from = |p| element.extent.iter().map(move |q| nalgebra::distance(p, q));
    element.extent.iter().flat_map(from).fold(0.0, f64::max)
}

type FeatureElement<'a> = (&'a Feature, &'a Element);

impl Relation {
    /// Of two planes or two axes; `None` if neither parallel nor square, and for axes that are not
    /// parallel.
    fn of_alike<'a>(one: &FeatureElement<'a>, other: &FeatureElement<'a>) -> Option<Self> {
        let (toleranced, datum) = if reach(one.1) > reach(other.1) {
            (other, one)
        } else {
            (one, other)
        };
        let cos = cosine(one.1, other.1);
        let is_parallel = cos > MEANT.cos();
        match one.1.shape {
            Shape::Plane if is_parallel || cos < MEANT.sin() => Self::oriented(toleranced, datum),
            Shape::Axis if is_parallel => Self::of_axes(toleranced, datum),
            _ => None,
        }
    }

    fn new(kind: RelationKind, of: &FeatureElement, to: &FeatureElement) -> Self {
        let (zone, angle, distance, concentricity) = (None, None, None, None);
        Self {
            kind,
            of: of.0.id,
            to: to.0.id,
            zone,
            angle,
            distance,
            concentricity,
        }
    }

    fn oriented(of: &FeatureElement, to: &FeatureElement) -> Option<Self> {
        let found = orientation(of.1, to.1)?;
        let is_along = cosine(of.1, to.1) > std::f64::consts::FRAC_1_SQRT_2;
        // an axis is square to a plane along its normal
        let is_off_zero = is_along == (of.1.shape == to.1.shape);
        let off = found.off;
        let value = if is_off_zero {
            off.value
        } else {
            std::f64::consts::FRAC_PI_2 - off.value
        };
        let kind = if found.is_parallel {
            RelationKind::Parallelism
        } else {
            RelationKind::Perpendicularity
        };
        Some(Self {
            zone: Some(found.zone),
            angle: Some(Estimate { value, ..off }),
            distance: found.is_parallel.then(|| distance(of.1, to.1)).flatten(),
            ..Self::new(kind, of, to)
        })
    }

    fn of_axes(of: &FeatureElement, to: &FeatureElement) -> Option<Self> {
        let apart = distance(of.1, to.1)?;
        let angle = angle(of.1, to.1);
        let diameter = |f: &Feature| f.diameter.as_ref().map_or(0.0, |diameter| diameter.value);
        let is_round = |f: &Feature| {
            matches!(
                f.kind,
                FeatureKind::Hole | FeatureKind::Boss | FeatureKind::Cylinder | FeatureKind::Notch
            )
        };
        if apart.value < ONE_AXIS * diameter(of.0).min(diameter(to.0))
            && is_round(of.0)
            && is_round(to.0)
        {
            let zone = coaxiality(of.1, to.1);
            let concentricity = concentricity(of.1, to.1);
            return Some(Self {
                zone,
                angle,
                concentricity,
                ..Self::new(RelationKind::Coaxiality, of, to)
            });
        }
        Some(Self {
            angle,
            distance: Some(apart),
            ..Self::new(RelationKind::Distance, of, to)
        })
    }
}
