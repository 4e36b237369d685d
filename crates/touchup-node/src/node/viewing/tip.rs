//! Information for the operator at the tip.

use nalgebra::Point3;

use crate::node::channels::{LastTip, NextTouches};
use crate::node::feature_messages::{ball, label, letters};
use crate::ros::convert::{header, point, point_of};
use crate::ros::messages::{ColorRGBA, Feature, FeatureArray, Marker, MarkerArray, Vector3};
use touchup_probing::plan::NextTouch;

/// Maximum distance to a feature of interest, m.
const NEAR: f64 = 0.05;

/// Height of the text above the labels of features, m.
const TEXT_HEIGHT: f64 = 12e-3;

/// Length of the arrow to the next touch, m.
const NEXT_LENGTH: f64 = 10e-3;

const BALL_COLOR: ColorRGBA = color([0.9, 0.3, 0.2, 0.9]);
const TEXT_COLOR: ColorRGBA = color([1.0, 0.95, 0.4, 1.0]);
const CLOSEST_COLOR: ColorRGBA = color([0.9, 0.9, 0.2, 0.9]);
const NEXT_COLOR: ColorRGBA = color([0.2, 0.9, 0.4, 1.0]);

const fn color([r, g, b, a]: [f32; 4]) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}

/// Markers of the tip: ball, text, the arrow to the mesh, and the arrow to the next touch.
pub fn markers(
    tip: &LastTip,
    features: &FeatureArray,
    next: &NextTouches,
    frame: &str,
) -> MarkerArray {
    let nearest = nearest(tip, features);
    let next = nearest.and_then(|feature| next.get(&feature.id));
    let base = |id| tip_marker(tip.stamp_ns, frame, id);
    let ball = ball(
        point(&tip.centre),
        2.0 * tip.radius.max(0.5e-3),
        Marker {
            color: BALL_COLOR,
            ..base(0)
        },
    );
    let mut place = tip.centre;
    place.z += TEXT_HEIGHT;
    let words = text(tip, nearest, next.is_some());
    let text = letters(&place, words, TEXT_COLOR, base(1));
    // at the surface it would hide its target
    let closest = tip
        .closest
        .filter(|(_, distance)| *distance > tip.radius)
        .map(|(closest, _)| [tip.centre, closest]);
    // towards the position from outside; without a known outside, from the tip
    let next = next.map(|NextTouch { place, normal }| {
        let from = if *normal == nalgebra::Vector3::zeros() {
            tip.centre
        } else {
            place + normal * NEXT_LENGTH
        };
        [from, *place]
    });
    let closest = arrow([0.5e-3, 1.2e-3], CLOSEST_COLOR, closest, base(2));
    let next = arrow([1.2e-3, 3e-3], NEXT_COLOR, next, base(3));
    MarkerArray {
        markers: vec![ball, text, closest, next],
    }
}

/// Arrow between two points; deletes it without them.
///
/// - `[x, y]`: diameters of shaft and head, m.
fn arrow(
    [x, y]: [f64; 2],
    color: ColorRGBA,
    ends: Option<[Point3<f64>; 2]>,
    base: Marker,
) -> Marker {
    let arrow = Marker {
        r#type: Marker::ARROW,
        ..base
    };
    match ends {
        Some(ends) => Marker {
            scale: Vector3 { x, y, z: 0.0 },
            color,
            points: ends.iter().map(point).collect(),
            ..arrow
        },
        None => Marker {
            action: Marker::DELETE,
            ..arrow
        },
    }
}

fn tip_marker(stamp_ns: i64, frame: &str, id: i32) -> Marker {
    Marker {
        header: header(stamp_ns, frame),
        ns: "tip".to_owned(),
        id,
        ..Marker::default()
    }
}

/// Deletes all of [`markers`].
pub fn no_markers(frame: &str) -> MarkerArray {
    let gone = |id| Marker {
        action: Marker::DELETE,
        ..tip_marker(0, frame, id)
    };
    MarkerArray {
        markers: (0..4).map(gone).collect(),
    }
}

/// The feature of interest to the operator.
fn nearest<'a>(tip: &LastTip, features: &'a FeatureArray) -> Option<&'a Feature> {
    let far = |feature: &&Feature| (point_of(&feature.center) - tip.centre).norm();
    let is_asked = |feature: &&Feature| {
        !feature.diameter.is_nan()
            || !feature.width.is_nan()
            || feature.status == Feature::STATUS_FLAGGED
    };
    let asked = features.features.iter().filter(is_asked);
    asked
        .min_by(|a, b| far(a).total_cmp(&far(b)))
        .filter(|feature| far(feature) < NEAR)
}

/// "0.12 mm; hole Ø8.02 ± 0.04; next: green arrow" in one line: RViz puts lines 10 mm apart,
/// however small the letters.
fn text(tip: &LastTip, nearest: Option<&Feature>, has_next: bool) -> String {
    let distance = match tip.closest {
        Some((_, distance)) => format!("{:.2} mm", distance * 1e3),
        None => "far from the mesh".to_owned(),
    };
    let next = if has_next { "; next: green arrow" } else { "" };
    nearest.map_or(distance.clone(), |feature| {
        format!("{distance}; {}{next}", label(feature))
    })
}
