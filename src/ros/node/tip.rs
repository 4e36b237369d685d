//! What an operator wants to know at the tip.

use nalgebra::Point3;

use super::convert::{header, point};
use super::feature_messages::label;
use crate::ros::messages::{ColorRGBA, FeatureArray, Marker, MarkerArray, Pose, Vector3};

/// Where the tip was last.
#[derive(Clone, Copy, Debug)]
pub struct TipPlace {
    /// of the sample, ns
    pub stamp_ns: i64,
    /// centre of the ball, m, in O
    pub centre: Point3<f64>,
    /// radius of the ball, m
    pub radius: f64,
    /// the closest point of the mesh, and how far the ball's surface is from it, m; `None` beyond the reach
    pub closest: Option<(Point3<f64>, f64)>,
}

/// Farther from a feature than this nobody asks for it, m.
const NEAR: f64 = 0.05;

/// Text, ball and arrow.
pub fn markers(tip: &TipPlace, features: &FeatureArray, frame: &str) -> MarkerArray {
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
    place.z += 10e-3;
    let text = Marker {
        id: 1,
        r#type: Marker::TEXT_VIEW_FACING,
        pose: Pose { position: place, ..Pose::default() },
        scale: Vector3 { z: 4e-3, ..Vector3::default() },
        color: ColorRGBA { r: 1.0, g: 1.0, b: 1.0, a: 1.0 },
        text: text(tip, features),
        ..base.clone()
    };
    let arrow = Marker { id: 2, r#type: Marker::ARROW, ..base };
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
    MarkerArray { markers: vec![ball, text, arrow] }
}

/// "0.12 mm; hole Ø8.02 ± 0.04".
fn text(tip: &TipPlace, features: &FeatureArray) -> String {
    let distance = match tip.closest {
        Some((_, distance)) => format!("{:.2} mm", distance * 1e3),
        None => "far from the mesh".to_owned(),
    };
    let far = |feature: &&crate::ros::messages::Feature| {
        let p = &feature.center;
        (Point3::new(p.x, p.y, p.z) - tip.centre).norm()
    };
    let sized = features.features.iter().filter(|feature| !feature.diameter.is_nan() || !feature.width.is_nan());
    let nearest = sized.min_by(|a, b| far(a).total_cmp(&far(b))).filter(|feature| far(feature) < NEAR);
    nearest.map_or(distance.clone(), |feature| format!("{distance}\n{}", label(feature)))
}
