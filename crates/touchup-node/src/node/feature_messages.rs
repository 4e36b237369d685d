//! Features as messages, labels and markers.

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

use crate::ros::convert::{point, point_of, pose, vector, vector_of};
use crate::ros::messages::{
    ColorRGBA, Feature as FeatureMsg, FeatureArray, FormDeviation, Marker, MarkerArray, Point,
    Pose, Relation as RelationMsg, Vector3 as Vector3Msg,
};
use crate::ros::parameters::KIND_NAMES;
use crate::ros::refusal::{NO_VECTOR, unknown_feature};
use touchup_features::features::{
    Feature, FeatureKind, FittedTo, Form, InspectedQuantity, Relation, RelationKind,
};
use touchup_probing::execute::Flag;

/// Half of the interval that holds 95 % of a normal distribution, in standard deviations.
const AT_95_PERCENT: f64 = 1.96;
/// Height of the labels, m.
const LETTERS: f64 = 3e-3;
/// Width of lines, m.
const LINE: f64 = 0.6e-3;
/// Distance off the surface that prevents spots of it from showing through, m.
const CLEAR: f64 = 0.1e-3;

/// Message number of a kind; `None` is a region of unknown kind.
pub fn number_of(kind: Option<FeatureKind>) -> u8 {
    kind.map_or(FeatureMsg::KIND_UNKNOWN, |kind| {
        FeatureMsg::KIND_HOLE + kind as u8
    })
}

/// Kind by message number.
///
/// # Errors
/// In words, if no kind has this number.
pub fn kind_of(number: u8) -> Result<Option<FeatureKind>, String> {
    let mut kinds = std::iter::once(None).chain(FeatureKind::ALL.into_iter().map(Some));
    let most = KIND_NAMES.len() - 1;
    kinds
        .find(|kind| number_of(*kind) == number)
        .ok_or_else(|| format!("there is no kind {number}: 0 to {most} are"))
}

/// A detected feature.
///
/// - `id`: its number in messages.
/// - `search_radius`: radius of the search around the user's flag, m.
pub fn found(feature: &Feature, id: u32, search_radius: Option<f64>) -> FeatureMsg {
    let yes_no = |known: Option<bool>| match known {
        None => FeatureMsg::UNKNOWN,
        Some(false) => FeatureMsg::NO,
        Some(true) => FeatureMsg::YES,
    };
    let sized = feature.main_size().map(|size| size.touches.len());
    let axis = feature.axis.as_ref();
    let mut message = FeatureMsg {
        id,
        kind: number_of(Some(feature.kind)),
        status: FeatureMsg::STATUS_FOUND,
        fitted_to: match feature.fitted_to {
            FittedTo::Touches => FeatureMsg::FITTED_TO_TOUCHES,
            FittedTo::Mesh => FeatureMsg::FITTED_TO_MESH,
        },
        touched: feature.touched,
        touch_count: sized.unwrap_or(feature.centre.touches.len()) as u32,
        search_radius: search_radius.unwrap_or(f64::NAN),
        center: point(&feature.centre.value),
        center_std: feature.centre.std.unwrap_or(f64::NAN),
        axis: axis.map_or(NO_VECTOR, |axis| vector(&axis.value)),
        axis_std: axis.and_then(|axis| axis.std).unwrap_or(f64::NAN),
        direction: feature.direction.as_ref().map_or(NO_VECTOR, vector),
        depth_is_at_least: feature
            .depth
            .as_ref()
            .is_some_and(|depth| depth.is_at_least),
        through: yes_no(feature.through),
        convex: yes_no(feature.is_convex),
        group: feature
            .group
            .and_then(|group| i32::try_from(group).ok())
            .unwrap_or(FeatureMsg::NO_GROUP),
        points: feature.points.iter().map(point).collect(),
        form: feature.form.as_ref().map_or_else(Vec::new, form_deviations),
        ..unknown_feature(id)
    };
    for (quantity, size) in feature.sizes() {
        let (value, std) = match quantity {
            InspectedQuantity::Diameter => (&mut message.diameter, &mut message.diameter_std),
            InspectedQuantity::Length => (&mut message.length, &mut message.length_std),
            InspectedQuantity::Width => (&mut message.width, &mut message.width_std),
            InspectedQuantity::Depth => (&mut message.depth, &mut message.depth_std),
            _ => (&mut message.cone_angle, &mut message.cone_angle_std),
        };
        (*value, *std) = (size.value, size.std.unwrap_or(f64::NAN));
    }
    message
}

/// Deviations of a feature from its ideal form.
fn form_deviations(form: &Form) -> Vec<FormDeviation> {
    let round = form.round();
    form.deviations()
        .map(|(quantity, deviation)| FormDeviation {
            characteristic: match quantity {
                InspectedQuantity::Roundness => FormDeviation::ROUNDNESS,
                InspectedQuantity::Cylindricity => FormDeviation::CYLINDRICITY,
                InspectedQuantity::Straightness => FormDeviation::STRAIGHTNESS,
                _ => FormDeviation::FLATNESS,
            },
            zone: deviation.minimum_zone.value,
            zone_std: deviation.minimum_zone.std,
            least_squares: deviation.least_squares.value,
            coverage: form.coverage(),
            undulations: round.map_or(0, |round| round.undulations),
            lobes: round.map_or_else(Vec::new, |round| round.lobes.clone()),
        })
        .collect()
}

/// Relation of a feature to another.
///
/// - `name_of`: a feature's number in messages, by the detector's number.
pub fn related(relation: &Relation, name_of: impl Fn(u32) -> u32) -> RelationMsg {
    let [zone, angle, distance, concentricity] = [
        relation.zone,
        relation.angle,
        relation.distance,
        relation.concentricity,
    ]
    .map(|estimate| estimate.map_or([f64::NAN; 2], |known| [known.value, known.std]));
    RelationMsg {
        kind: match relation.kind {
            RelationKind::Perpendicularity => RelationMsg::PERPENDICULARITY,
            RelationKind::Parallelism => RelationMsg::PARALLELISM,
            RelationKind::Coaxiality => RelationMsg::COAXIALITY,
            RelationKind::Distance => RelationMsg::DISTANCE,
        },
        of_feature: name_of(relation.of),
        to_feature: name_of(relation.to),
        zone: zone[0],
        zone_std: zone[1],
        angle: angle[0],
        angle_std: angle[1],
        distance: distance[0],
        distance_std: distance[1],
        concentricity: concentricity[0],
        concentricity_std: concentricity[1],
    }
}

/// A flagged place without a detected feature yet.
pub fn flagged(flag: &Flag) -> FeatureMsg {
    FeatureMsg {
        kind: number_of(flag.kind),
        search_radius: flag.radius,
        center: point(&flag.place),
        ..unknown_feature(flag.id)
    }
}

/// Kind and size at 95 %, mm: "hole Ø8.02 ± 0.04".
pub fn label(feature: &FeatureMsg) -> String {
    let kind = KIND_NAMES
        .get(usize::from(feature.kind))
        .unwrap_or(&"unknown");
    if feature.status == FeatureMsg::STATUS_FLAGGED {
        return format!("{kind}?");
    }
    let size = |value: f64, std: f64| match std.is_nan() {
        true => format!("{:.2}", value * 1e3),
        false => format!("{:.2} ± {:.2}", value * 1e3, AT_95_PERCENT * std * 1e3),
    };
    if !feature.diameter.is_nan() {
        return format!("{kind} Ø{}", size(feature.diameter, feature.diameter_std));
    }
    let sizes = [
        (feature.width, feature.width_std),
        (feature.length, feature.length_std),
    ];
    let sizes: Vec<_> = sizes
        .iter()
        .filter(|(value, _)| !value.is_nan())
        .map(|&(v, std)| size(v, std))
        .collect();
    if sizes.is_empty() {
        (*kind).to_owned()
    } else {
        format!("{kind} {}", sizes.join(" × "))
    }
}

/// Markers of all features; they replace earlier ones.
pub fn markers(features: &FeatureArray) -> MarkerArray {
    let frame = &features.header;
    let mut markers = vec![Marker {
        header: frame.clone(),
        action: Marker::DELETEALL,
        ..Marker::default()
    }];
    for feature in &features.features {
        let base = Marker {
            header: frame.clone(),
            ns: "features".to_owned(),
            id: feature.id as i32,
            color: colour(feature),
            ..Marker::default()
        };
        markers.extend(body(feature, &base));
        if has_label(feature) {
            let up = axis_of(feature);
            // the center of a boss is at its foot, and the label would be inside
            let is_boss = feature.kind == FeatureMsg::KIND_BOSS && !feature.depth.is_nan();
            let place = point_of(&feature.center)
                + up * (LETTERS + if is_boss { feature.depth } else { 0.0 });
            let white = ColorRGBA {
                r: 1.0,
                g: 1.0,
                b: 1.0,
                a: 1.0,
            };
            markers.push(letters(
                &place,
                label(feature),
                white,
                Marker {
                    ns: "labels".to_owned(),
                    ..base
                },
            ));
        }
    }
    MarkerArray { markers }
}

/// A ball marker.
pub fn ball(centre: Point, diameter: f64, base: Marker) -> Marker {
    Marker {
        r#type: Marker::SPHERE,
        pose: Pose {
            position: centre,
            ..Pose::default()
        },
        scale: Vector3Msg {
            x: diameter,
            y: diameter,
            z: diameter,
        },
        ..base
    }
}

/// A text marker.
pub fn letters(place: &Point3<f64>, text: String, color: ColorRGBA, base: Marker) -> Marker {
    Marker {
        r#type: Marker::TEXT_VIEW_FACING,
        pose: Pose {
            position: point(place),
            ..Pose::default()
        },
        scale: Vector3Msg {
            z: LETTERS,
            ..Vector3Msg::default()
        },
        color,
        text,
        ..base
    }
}

/// Edges, corners and planes have no label: a part has dozens of them.
fn has_label(feature: &FeatureMsg) -> bool {
    !matches!(
        feature.kind,
        FeatureMsg::KIND_EDGE | FeatureMsg::KIND_CORNER | FeatureMsg::KIND_PLANE
    ) || feature.status == FeatureMsg::STATUS_FLAGGED
}

/// Red, green, blue of flagged features, fits to touches, and features of the mesh. None is a
/// colour of the mesh behind them.
pub(super) const COLOURS: [[f32; 3]; 3] = [[0.64, 0.01, 0.52], [0.1, 0.3, 1.0], [0.2, 0.95, 1.0]];

fn colour(feature: &FeatureMsg) -> ColorRGBA {
    let [flagged, fitted, found] = COLOURS;
    let [r, g, b] = match (feature.status, feature.fitted_to) {
        (FeatureMsg::STATUS_FLAGGED, _) => flagged,
        (_, FeatureMsg::FITTED_TO_TOUCHES) => fitted,
        _ => found,
    };
    ColorRGBA { r, g, b, a: 0.6 }
}

fn body(feature: &FeatureMsg, base: &Marker) -> Option<Marker> {
    let sphere = |diameter| ball(feature.center, diameter, base.clone());
    if feature.status == FeatureMsg::STATUS_FLAGGED {
        return Some(sphere(2.0 * feature.search_radius));
    }
    match feature.kind {
        FeatureMsg::KIND_HOLE | FeatureMsg::KIND_BOSS => Some(cylinder(feature, base)),
        FeatureMsg::KIND_CORNER => Some(sphere(3.0 * LINE)),
        FeatureMsg::KIND_SPHERE => Some(sphere(feature.diameter)),
        FeatureMsg::KIND_EDGE | FeatureMsg::KIND_SLOT | FeatureMsg::KIND_POCKET => {
            Some(outline(feature, base)).filter(|line| line.points.len() > 1)
        }
        _ => None,
    }
}

fn outline(feature: &FeatureMsg, base: &Marker) -> Marker {
    // an edge has surface on two sides, an opening below
    let up = if feature.kind == FeatureMsg::KIND_EDGE {
        Vector3::zeros()
    } else {
        axis_of(feature) * (0.5 * LINE)
    };
    let raised = |p: &Point| Point {
        x: p.x + up.x,
        y: p.y + up.y,
        z: p.z + up.z,
    };
    Marker {
        r#type: Marker::LINE_STRIP,
        scale: Vector3Msg {
            x: LINE,
            ..Vector3Msg::default()
        },
        points: feature.points.iter().map(raised).collect(),
        ..base.clone()
    }
}

/// Axis of a feature; up if it has none.
fn axis_of(feature: &FeatureMsg) -> Vector3<f64> {
    let axis = vector_of(&feature.axis);
    if axis.iter().all(|x| x.is_finite()) {
        axis
    } else {
        Vector3::z()
    }
}

fn cylinder(feature: &FeatureMsg, base: &Marker) -> Marker {
    let axis = axis_of(feature);
    let height = if feature.depth.is_nan() {
        LINE
    } else {
        feature.depth
    };
    // a hole goes down from its opening and is visible inside, a boss up from its foot and is
    // visible outside
    let (side, up) = if feature.kind == FeatureMsg::KIND_BOSS {
        (1.0, 0.5)
    } else {
        (-1.0, -0.5)
    };
    let middle = point_of(&feature.center) + axis * (up * height + 0.5 * CLEAR);
    let diameter = feature.diameter + 2.0 * side * CLEAR;
    let turn = Rotation3::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Marker {
        r#type: Marker::CYLINDER,
        pose: pose(&middle, &UnitQuaternion::from_rotation_matrix(&turn)),
        scale: Vector3Msg {
            x: diameter,
            y: diameter,
            z: height + CLEAR,
        },
        ..base.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_geometry::form::{Deviation, Estimate, RoundForm};

    #[test]
    fn form_is_a_list_of_the_deviations_that_are_known() {
        let deviation = |zone, std, squares| Deviation {
            minimum_zone: Estimate { value: zone, std },
            least_squares: Estimate {
                value: squares,
                std,
            },
        };
        let round = RoundForm {
            roundness: deviation(50e-6, 4e-6, 52e-6),
            cylindricity: None,
            straightness: Some(deviation(0.0, 3e-6, 0.0)),
            coverage: 0.75,
            undulations: 15,
            lobes: vec![2, 3],
        };
        let messages = form_deviations(&Form::Round(round));
        let of = |at: usize| {
            (
                messages[at].characteristic,
                messages[at].zone,
                messages[at].zone_std,
            )
        };
        assert_eq!(messages.len(), 2);
        assert_eq!(of(0), (FormDeviation::ROUNDNESS, 50e-6, 4e-6));
        assert_eq!(of(1), (FormDeviation::STRAIGHTNESS, 0.0, 3e-6));
        assert!(
            messages
                .iter()
                .all(|one| one.coverage == 0.75 && one.lobes == [2, 3])
        );
        assert_eq!(messages[0].least_squares, 52e-6);
    }

    #[test]
    fn a_relation_goes_by_the_names_of_the_features() {
        let angle = Some(Estimate {
            value: 0.01,
            std: 0.002,
        });
        let (zone, distance, concentricity) = (None, None, None);
        let relation = Relation {
            kind: RelationKind::Distance,
            of: 4,
            to: 7,
            zone,
            angle,
            distance,
            concentricity,
        };
        let message = related(&relation, |id| if id == 4 { 40 } else { id });
        assert_eq!(
            (message.kind, message.of_feature, message.to_feature),
            (RelationMsg::DISTANCE, 40, 7)
        );
        assert_eq!((message.angle, message.angle_std), (0.01, 0.002));
        assert!(
            message.zone.is_nan()
                && message.distance_std.is_nan()
                && message.concentricity.is_nan()
        );
    }

    #[test]
    fn kinds_have_the_numbers_of_the_message() {
        let numbers = [
            (FeatureKind::Hole, FeatureMsg::KIND_HOLE),
            (FeatureKind::Slot, FeatureMsg::KIND_SLOT),
            (FeatureKind::Pocket, FeatureMsg::KIND_POCKET),
            (FeatureKind::Boss, FeatureMsg::KIND_BOSS),
            (FeatureKind::Edge, FeatureMsg::KIND_EDGE),
            (FeatureKind::Corner, FeatureMsg::KIND_CORNER),
            (FeatureKind::Plane, FeatureMsg::KIND_PLANE),
            (FeatureKind::Cylinder, FeatureMsg::KIND_CYLINDER),
            (FeatureKind::Notch, FeatureMsg::KIND_NOTCH),
            (FeatureKind::Sphere, FeatureMsg::KIND_SPHERE),
        ];
        assert_eq!(numbers.map(|(kind, _)| kind), FeatureKind::ALL);
        for (kind, number) in numbers {
            assert_eq!(number_of(Some(kind)), number);
            assert_eq!(kind_of(number), Ok(Some(kind)));
            assert_eq!(KIND_NAMES[usize::from(number)], kind.name());
        }
        assert_eq!(kind_of(FeatureMsg::KIND_UNKNOWN), Ok(None));
        assert_eq!(
            kind_of(11),
            Err("there is no kind 11: 0 to 10 are".to_owned())
        );
    }

    #[test]
    fn labels_read_as_on_a_drawing() {
        let place = |id, kind| {
            flagged(&Flag {
                id,
                kind: Some(kind),
                place: Point3::origin(),
                radius: 5e-3,
            })
        };
        let mut hole = place(3, FeatureKind::Hole);
        assert_eq!(label(&hole), "hole?");
        hole.status = FeatureMsg::STATUS_FOUND;
        (hole.diameter, hole.diameter_std) = (8.02e-3, 0.02e-3);
        assert_eq!(label(&hole), "hole Ø8.02 ± 0.04");
        hole.diameter_std = f64::NAN;
        assert_eq!(label(&hole), "hole Ø8.02");
        let mut slot = place(4, FeatureKind::Slot);
        slot.status = FeatureMsg::STATUS_FOUND;
        (slot.width, slot.length, slot.length_std) = (6e-3, 20e-3, 0.1e-3);
        assert_eq!(label(&slot), "slot 6.00 × 20.00 ± 0.20");
    }
}
