//! What an operator wants to know at the tip.

use super::channels::{LastTip, NextTouches};
use super::convert::{header, point, point_of};
use super::feature_messages::{LETTERS, label};
use crate::probing::plan::NextTouch;
use crate::ros::messages::{ColorRGBA, Feature, FeatureArray, Marker, MarkerArray, Pose, Vector3};

/// Farther from a feature than this nobody asks for it, m.
const NEAR: f64 = 0.05;

/// Above the labels of features, m.
const TEXT_HEIGHT: f64 = 12e-3;

/// Ball, text, the arrow to the mesh, and the one onto where to touch next.
pub fn markers(tip: &LastTip, features: &FeatureArray, next: &NextTouches, frame: &str) -> MarkerArray {
    let nearest = nearest(tip, features);
    let base = Marker { header: header(tip.stamp_ns, frame), ns: "tip".to_owned(), ..Marker::default() };
    let diameter = 2.0 * tip.radius.max(0.5e-3);
    let ball = Marker {
        id: 0,
        r#type: Marker::SPHERE,
        pose: Pose { position: point(&tip.centre), ..Pose::default() },
        scale: Vector3 { x: diameter, y: diameter, z: diameter },
        color: ColorRGBA { r: 0.9, g: 0.3, b: 0.2, a: 0.9 },
        ..base.clone()
    };
    let mut place = point(&tip.centre);
    place.z += TEXT_HEIGHT;
    let text = Marker {
        id: 1,
        r#type: Marker::TEXT_VIEW_FACING,
        pose: Pose { position: place, ..Pose::default() },
        scale: Vector3 { z: LETTERS, ..Vector3::default() },
        color: ColorRGBA { r: 1.0, g: 0.95, b: 0.4, a: 1.0 },
        text: text(tip, nearest, nearest.is_some_and(|feature| next.contains_key(&feature.id))),
        ..base.clone()
    };
    let arrow = Marker { id: 2, r#type: Marker::ARROW, ..base.clone() };
    let arrow = match &tip.closest {
        Some((closest, distance)) if *distance > tip.radius => Marker {
            scale: Vector3 { x: 0.5e-3, y: 1.2e-3, z: 0.0 },
            color: ColorRGBA { r: 0.9, g: 0.9, b: 0.2, a: 0.9 },
            points: vec![point(&tip.centre), point(closest)],
            ..arrow
        },
        // at the surface it would hide what it points at
        _ => Marker { action: Marker::DELETE, ..arrow },
    };
    let there = Marker { id: 3, r#type: Marker::ARROW, ..base };
    let there = match nearest.and_then(|feature| next.get(&feature.id)) {
        // onto the place, from outside; where nobody knows what is outside, from the tip
        Some(NextTouch { place, normal }) => Marker {
            scale: Vector3 { x: 1.2e-3, y: 3e-3, z: 0.0 },
            color: ColorRGBA { r: 0.2, g: 0.9, b: 0.4, a: 1.0 },
            points: vec![
                point(&if *normal == nalgebra::Vector3::zeros() { tip.centre } else { place + normal * NEXT_LENGTH }),
                point(place),
            ],
            ..there
        },
        None => Marker { action: Marker::DELETE, ..there },
    };
    MarkerArray { markers: vec![ball, text, arrow, there] }
}

/// Length of the arrow onto the next place, m.
const NEXT_LENGTH: f64 = 10e-3;

/// The feature that who holds the tip is asking about.
fn nearest<'a>(tip: &LastTip, features: &'a FeatureArray) -> Option<&'a Feature> {
    let far = |feature: &&Feature| (point_of(&feature.center) - tip.centre).norm();
    let is_asked = |feature: &&Feature| {
        !feature.diameter.is_nan() || !feature.width.is_nan() || feature.status == Feature::STATUS_FLAGGED
    };
    let asked = features.features.iter().filter(is_asked);
    asked.min_by(|a, b| far(a).total_cmp(&far(b))).filter(|feature| far(feature) < NEAR)
}

/// "0.12 mm; hole Ø8.02 ± 0.04; next: green arrow": RViz puts lines 10 mm apart, however small the letters.
fn text(tip: &LastTip, nearest: Option<&Feature>, has_next: bool) -> String {
    let distance = match tip.closest {
        Some((_, distance)) => format!("{:.2} mm", distance * 1e3),
        None => "far from the mesh".to_owned(),
    };
    let next = if has_next { "; next: green arrow" } else { "" };
    nearest.map_or(distance.clone(), |feature| format!("{distance}; {}{next}", label(feature)))
}
