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

/// Markers of the tip: ball, text, the arrow to the mesh, and the arrow to the next touch.
#[expect(clippy::too_many_lines)]
pub fn markers(
    tip: &LastTip,
    features: &FeatureArray,
    next: &NextTouches,
    frame: &str,
) -> MarkerArray {
    let nearest = nearest(tip, features);
    let base = Marker {
        header: header(tip.stamp_ns, frame),
        ns: "tip".to_owned(),
        ..Marker::default()
    };
    let red = ColorRGBA {
        r: 0.9,
        g: 0.3,
        b: 0.2,
        a: 0.9,
    };
    let ball = ball(
        point(&tip.centre),
        2.0 * tip.radius.max(0.5e-3),
        Marker {
            color: red,
            ..base.clone()
        },
    );
    let mut place = tip.centre;
    place.z += TEXT_HEIGHT;
    let words = text(
        tip,
        nearest,
        nearest.is_some_and(|feature| next.contains_key(&feature.id)),
    );
    let yellow = ColorRGBA {
        r: 1.0,
        g: 0.95,
        b: 0.4,
        a: 1.0,
    };
    let text = letters(
        &place,
        words,
        yellow,
        Marker {
            id: 1,
            ..base.clone()
        },
    );
    let arrow = |id, drawn: Option<([f64; 2], ColorRGBA, [Point3<f64>; 2])>| {
        let arrow = Marker {
            id,
            r#type: Marker::ARROW,
            ..base.clone()
        };
        match drawn {
            Some(([x, y], color, ends)) => Marker {
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
    };
    // at the surface it would hide its target
    let closest = tip
        .closest
        .filter(|(_, distance)| *distance > tip.radius)
        .map(|(closest, _)| {
            (
                [0.5e-3, 1.2e-3],
                ColorRGBA {
                    r: 0.9,
                    g: 0.9,
                    b: 0.2,
                    a: 0.9,
                },
                [tip.centre, closest],
            )
        });
    // towards the position from outside; without a known outside, from the tip
    let there =
        nearest
            .and_then(|feature| next.get(&feature.id))
            .map(|NextTouch { place, normal }| {
                let from = if *normal == nalgebra::Vector3::zeros() {
                    tip.centre
                } else {
                    place + normal * NEXT_LENGTH
                };
                (
                    [1.2e-3, 3e-3],
                    ColorRGBA {
                        r: 0.2,
                        g: 0.9,
                        b: 0.4,
                        a: 1.0,
                    },
                    [from, *place],
                )
            });
    MarkerArray {
        markers: vec![ball, text, arrow(2, closest), arrow(3, there)],
    }
}

/// Deletes all of [`markers`].
pub fn no_markers(frame: &str) -> MarkerArray {
    let gone = |id| Marker {
        header: header(0, frame),
        ns: "tip".to_owned(),
        id,
        action: Marker::DELETE,
        ..Marker::default()
    };
    MarkerArray {
        markers: (0..4).map(gone).collect(),
    }
}

/// Length of the arrow to the next touch, m.
const NEXT_LENGTH: f64 = 10e-3;

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
