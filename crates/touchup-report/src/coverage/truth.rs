//! Place and feature of the true plate behind a stated number.

use nalgebra::{Point3, Vector2, Vector3};

use super::kind::CoverageKind;
use super::stated::StatedNumber;
use touchup_features::features::{
    Feature, FeatureKind, FittedTo, InspectedQuantity, MeasuredValue,
};
use touchup_method::reconstruct::Support;
use touchup_sim::{Plate, Surface, SurfacePoint, TruthFeature, TruthShape};

/// Largest distance of a surface place at an edge or a rim, m.
const NEAR_EDGE: f64 = 1e-3;
/// Cosine of the angle of two normals beyond which the edge between them is sharp.
const SHARP: f64 = 0.866;
/// Largest distance between a found feature and its true counterpart, m.
const SAME: f64 = 2e-3;
/// Cosine of the largest angle between two equal directions.
const PARALLEL: f64 = 0.9;

/// The kind of a vertex; `None` for vertices of the scan, or beyond the ball's reach.
pub(super) fn vertex_kind(
    p: &Point3<f64>,
    support: Support,
    plate: &Plate,
) -> Option<CoverageKind> {
    match support {
        Support::Scan | Support::Unreachable => None,
        Support::Guessed => Some(CoverageKind::InterpolatedVertex),
        Support::Touched => {
            let on_part = plate.closest(p).point;
            let mut near = Vec::new();
            plate.near(&on_part, NEAR_EDGE, &mut near);
            let is_sharp = near
                .iter()
                .any(|a| near.iter().any(|b| a.normal.dot(&b.normal) < SHARP));
            Some(
                match (
                    is_sharp,
                    plate
                        .features()
                        .iter()
                        .any(|feature| is_at_opening(feature, &on_part)),
                ) {
                    (false, _) => CoverageKind::PlaneVertex,
                    (true, false) => CoverageKind::EdgeVertex,
                    (true, true) => CoverageKind::RimVertex,
                },
            )
        }
    }
}

/// Whether a place is within [`NEAR_EDGE`] of the opening of a hole or slot.
fn is_at_opening(feature: &TruthFeature, p: &Point3<f64>) -> bool {
    let off = p - feature.centre;
    let (radius, spine) = match feature.shape {
        TruthShape::Hole { diameter, .. } => (diameter / 2.0, Vector3::zeros()),
        TruthShape::Slot {
            width,
            length,
            direction,
            ..
        } => {
            let reach = (length - width) / 2.0;
            (
                width / 2.0,
                direction * off.dot(&direction).clamp(-reach, reach),
            )
        }
        TruthShape::Boss { .. } | TruthShape::Step { .. } => return false,
    };
    ((off - spine).xy().norm() - radius).hypot(off.z) <= NEAR_EDGE
}

/// The numbers of a found feature beside the true ones; none if it is no feature of the plate.
pub(super) fn feature_numbers(
    feature: &Feature,
    plate: &Plate,
) -> Vec<(CoverageKind, StatedNumber)> {
    let mut numbers = match feature.kind {
        FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Boss => plate
            .features()
            .iter()
            .find_map(|truth| of_walls(feature, truth)),
        FeatureKind::Plane => of_plane(feature, plate),
        FeatureKind::Edge => of_edge(feature, plate),
        FeatureKind::Pocket
        | FeatureKind::Corner
        | FeatureKind::Cylinder
        | FeatureKind::Notch
        | FeatureKind::Sphere => None,
    }
    .unwrap_or_default();
    if feature.fitted_to == FittedTo::Mesh {
        numbers
            .iter_mut()
            .for_each(|(kind, _)| *kind = CoverageKind::OfMesh);
    }
    numbers
}

fn stated(
    kind: CoverageKind,
    found: &MeasuredValue<f64>,
    truth: f64,
) -> (CoverageKind, StatedNumber) {
    let (error, std) = (found.value - truth, found.std.unwrap_or(0.0));
    (
        kind,
        StatedNumber {
            error,
            std,
            is_at_least: found.is_at_least,
        },
    )
}

/// Both directions across an axis: their standard deviations make up the stated one, √(σ₁² + σ₂²).
fn across(
    kind: CoverageKind,
    off: Vector2<f64>,
    centre: &MeasuredValue<Point3<f64>>,
) -> [(CoverageKind, StatedNumber); 2] {
    let std = centre.std.unwrap_or(0.0) / 2f64.sqrt();
    [off.x, off.y].map(|error| {
        (
            kind,
            StatedNumber {
                error,
                std,
                is_at_least: centre.is_at_least,
            },
        )
    })
}

fn of_walls(feature: &Feature, truth: &TruthFeature) -> Option<Vec<(CoverageKind, StatedNumber)>> {
    use CoverageKind as K;
    let off = (feature.centre.value - truth.centre).xy();
    let axis = feature.axis.as_ref().map_or(truth.axis, |axis| axis.value);
    if off.norm() > SAME || axis.dot(&truth.axis) < PARALLEL {
        return None;
    }
    if feature.kind != truth.kind() {
        return None;
    }
    let place = match feature.kind {
        FeatureKind::Hole => K::HolePosition,
        FeatureKind::Slot => K::SlotPosition,
        _ => K::BossPosition,
    };
    let number = |(quantity, size): (InspectedQuantity, f64)| {
        let found = feature.size(quantity)?;
        let kind = match (feature.kind, quantity) {
            (FeatureKind::Hole, InspectedQuantity::Diameter) => K::HoleDiameter,
            (FeatureKind::Hole, _) => K::HoleDepth,
            (FeatureKind::Slot, InspectedQuantity::Width) => K::SlotWidth,
            (FeatureKind::Slot, InspectedQuantity::Length) => K::SlotLength,
            (FeatureKind::Slot, _) => K::SlotDepth,
            (_, InspectedQuantity::Diameter) => K::BossDiameter,
            _ => K::BossHeight,
        };
        Some(stated(kind, found, size))
    };
    let sizes = truth.sizes().into_iter().filter_map(number);
    Some(
        across(place, off, &feature.centre)
            .into_iter()
            .chain(sizes)
            .collect(),
    )
}

/// The true surface at the plane's middle, along its normal.
fn of_plane(feature: &Feature, plate: &Plate) -> Option<Vec<(CoverageKind, StatedNumber)>> {
    let (centre, normal) = (&feature.centre, feature.axis.as_ref()?.value);
    let mut near = Vec::new();
    plate.near(&centre.value, SAME, &mut near);
    let on_part = near
        .iter()
        .find(|place| place.normal.dot(&normal) > PARALLEL)?;
    let (error, std) = (
        (centre.value - on_part.point).dot(&on_part.normal),
        centre.std.unwrap_or(0.0),
    );
    Some(vec![(
        CoverageKind::PlanePosition,
        StatedNumber {
            error,
            std,
            is_at_least: false,
        },
    )])
}

/// The true edge at the edge's middle, between two sides.
fn of_edge(feature: &Feature, plate: &Plate) -> Option<Vec<(CoverageKind, StatedNumber)>> {
    let (centre, along) = (&feature.centre, feature.axis.as_ref()?.value);
    let mut near = Vec::new();
    plate.near(&centre.value, SAME, &mut near);
    let pairs = near.iter().flat_map(|a| near.iter().map(move |b| (a, b)));
    let is_edge = |(a, b): &(&SurfacePoint, &SurfacePoint)| {
        sides_along(a, b).is_some_and(|edge| edge.dot(&along).abs() > PARALLEL)
    };
    let (a, b) = pairs.into_iter().find(is_edge)?;
    // the two are perpendicular: each gives the edge's position in one direction
    let off = [a, b].map(|side| (centre.value - side.point).dot(&side.normal));
    Some(across(CoverageKind::EdgePosition, off.into(), centre).to_vec())
}

/// Direction of the edge between two sides; `None` without an edge, or if not perpendicular.
fn sides_along(a: &SurfacePoint, b: &SurfacePoint) -> Option<Vector3<f64>> {
    let edge = a.normal.cross(&b.normal);
    (edge.norm() > PARALLEL).then(|| edge.normalize())
}
