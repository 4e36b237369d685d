//! Matching of detected features with the features of a drawing.

use nalgebra::{Point3, Vector3};

use crate::features::{Feature, FeatureKind};

/// A detected feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeaturePlace {
    /// its id
    pub id: u32,
    /// its kind
    pub kind: FeatureKind,
    /// m, in O
    pub centre: Point3<f64>,
    /// unit vector
    pub axis: Option<Vector3<f64>>,
    /// diameter or width, m
    pub size: Option<f64>,
}

impl FeaturePlace {
    /// Place and size of a feature.
    pub fn of(feature: &Feature) -> Self {
        Self {
            id: feature.id,
            kind: feature.kind,
            centre: feature.centre.value,
            axis: feature.axis.as_ref().map(|axis| axis.value),
            size: feature.main_size().map(|size| size.value),
        }
    }
}

/// A feature as a drawing has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoughtFeature {
    /// its kind
    pub kind: FeatureKind,
    /// id of the detected feature, if the drawing names it
    pub id: Option<u32>,
    /// nominal centre, m, in O
    pub place: Option<Point3<f64>>,
    /// nominal diameter or width, m
    pub size: Option<f64>,
}

/// Result of the search for one feature.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FeatureMatch {
    /// its id
    Found(u32),
    /// no feature of its kind fits
    Missing,
    /// ids of several features that fit
    Ambiguous(Vec<u32>),
    /// id of the only feature that fits, which also fits another one of the drawing
    Shared(u32),
}

/// Finds each feature of a drawing among the detected ones: by its id, else by kind and place, and
/// for several on one axis by their places along it and sizes. A feature that two of the drawing
/// would share goes to neither; nothing is guessed.
///
/// - `reach`: largest offset of a centre across its axis, for a plane along its normal, m. Features
///   less than that apart in place and size are not distinguished.
pub fn match_features(
    sought: &[SoughtFeature],
    found: &[FeaturePlace],
    reach: f64,
) -> Vec<FeatureMatch> {
    let mut matches: Vec<_> = sought
        .iter()
        .map(|one| match_one(one, found, reach))
        .collect();
    let is_shared = |at: usize| {
        matches!(&matches[at], FeatureMatch::Found(id)
        if sought[at].id.is_none() && (0..matches.len()).any(|other| other != at && matches[other] == FeatureMatch::Found(*id)))
    };
    let shared: Vec<_> = (0..matches.len()).filter(|&at| is_shared(at)).collect();
    for at in shared {
        if let FeatureMatch::Found(id) = matches[at] {
            matches[at] = FeatureMatch::Shared(id);
        }
    }
    matches
}

fn match_one(sought: &SoughtFeature, found: &[FeaturePlace], reach: f64) -> FeatureMatch {
    let of_kind = found.iter().filter(|place| place.kind == sought.kind);
    if let Some(id) = sought.id {
        return of_kind
            .map(|place| place.id)
            .find(|found| *found == id)
            .map_or(FeatureMatch::Missing, FeatureMatch::Found);
    }
    let mut candidates: Vec<(f64, u32)> = of_kind
        .filter(|place| {
            sought
                .place
                .is_none_or(|nominal| off(place, &nominal) <= reach)
        })
        .map(|place| (unlikeness(sought, place), place.id))
        .collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(best, id)) = candidates.first() else {
        return FeatureMatch::Missing;
    };
    let alike: Vec<_> = candidates
        .iter()
        .filter(|(other, _)| other - best < reach)
        .map(|&(_, id)| id)
        .collect();
    if alike.len() == 1 {
        FeatureMatch::Found(id)
    } else {
        FeatureMatch::Ambiguous(alike)
    }
}

/// Distance across the axis, for a plane along its normal, m.
fn off(place: &FeaturePlace, nominal: &Point3<f64>) -> f64 {
    let off = place.centre - nominal;
    match (place.kind, &place.axis) {
        (FeatureKind::Plane, Some(normal)) => off.dot(normal).abs(),
        (FeatureKind::Corner | FeatureKind::Sphere, _) | (_, None) => off.norm(),
        (_, Some(axis)) => off.cross(axis).norm(),
    }
}

/// Distance in space and difference of size, m.
fn unlikeness(sought: &SoughtFeature, place: &FeaturePlace) -> f64 {
    let apart = sought
        .place
        .map_or(0.0, |nominal| (place.centre - nominal).norm());
    let size = sought
        .size
        .zip(place.size)
        .map_or(0.0, |(nominal, size)| (nominal - size).abs());
    apart + size
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: f64 = 1.5e-3;

    fn hole(id: u32, x_mm: f64, z_mm: f64, diameter_mm: f64) -> FeaturePlace {
        let centre = Point3::new(x_mm, 0.0, z_mm) * 1e-3;
        FeaturePlace {
            id,
            kind: FeatureKind::Hole,
            centre,
            axis: Some(Vector3::z()),
            size: Some(diameter_mm * 1e-3),
        }
    }

    fn sought(x_mm: f64, z_mm: f64, diameter_mm: f64) -> SoughtFeature {
        let place = Some(Point3::new(x_mm, 0.0, z_mm) * 1e-3);
        SoughtFeature {
            kind: FeatureKind::Hole,
            id: None,
            place,
            size: Some(diameter_mm * 1e-3),
        }
    }

    #[test]
    fn the_nearest_of_its_kind_is_found_also_from_the_other_side() {
        let found = [hole(4, 0.1, 12.0, 8.0), hole(7, 20.0, 12.0, 8.0)];
        let boss = SoughtFeature {
            kind: FeatureKind::Boss,
            ..sought(0.0, 12.0, 8.0)
        };
        let matches = match_features(
            &[sought(20.0, 0.0, 8.0), sought(0.0, 12.0, 8.0), boss],
            &found,
            REACH,
        );
        assert_eq!(
            matches,
            [
                FeatureMatch::Found(7),
                FeatureMatch::Found(4),
                FeatureMatch::Missing
            ]
        );
    }

    #[test]
    fn steps_on_one_axis_are_told_apart_by_place_and_size() {
        let found = [hole(0, 0.0, 10.0, 12.0), hole(1, 0.0, 6.0, 6.0)];
        let matches = match_features(
            &[sought(0.0, 6.0, 6.0), sought(0.0, 10.0, 12.0)],
            &found,
            REACH,
        );
        assert_eq!(matches, [FeatureMatch::Found(1), FeatureMatch::Found(0)]);
    }

    #[test]
    fn what_could_be_two_is_ambiguous() {
        let found = [hole(0, 0.0, 10.0, 6.0), hole(1, 1.0, 10.0, 6.0)];
        assert_eq!(
            match_features(&[sought(0.4, 10.0, 6.0)], &found, REACH),
            [FeatureMatch::Ambiguous(vec![0, 1])]
        );
        let anywhere = SoughtFeature {
            place: None,
            size: None,
            ..sought(0.0, 0.0, 0.0)
        };
        assert_eq!(
            match_features(&[anywhere], &found, REACH),
            [FeatureMatch::Ambiguous(vec![0, 1])]
        );
        assert_eq!(
            match_features(&[anywhere], &found[..1], REACH),
            [FeatureMatch::Found(0)]
        );
    }

    #[test]
    fn what_two_of_the_drawing_would_share_neither_gets() {
        let found = [hole(3, 0.0, 10.0, 6.0)];
        let matches = match_features(
            &[sought(-0.8, 10.0, 6.0), sought(0.8, 10.0, 6.0)],
            &found,
            REACH,
        );
        assert_eq!(matches, [FeatureMatch::Shared(3), FeatureMatch::Shared(3)]);
    }

    #[test]
    fn a_number_is_taken_as_it_is_named() {
        let found = [hole(3, 0.0, 10.0, 6.0), hole(5, 50.0, 10.0, 6.0)];
        let named = SoughtFeature {
            id: Some(5),
            ..sought(0.0, 10.0, 6.0)
        };
        let wrong = SoughtFeature {
            id: Some(9),
            ..named
        };
        assert_eq!(
            match_features(&[named, wrong], &found, REACH),
            [FeatureMatch::Found(5), FeatureMatch::Missing]
        );
    }

    /// A plane matches along its normal; of two in one plane the nearer one in space.
    #[test]
    fn a_plane_is_matched_along_its_normal() {
        let plane = |id, x_mm: f64, z_mm: f64| FeaturePlace {
            id,
            kind: FeatureKind::Plane,
            centre: Point3::new(x_mm, 0.0, z_mm) * 1e-3,
            axis: Some(Vector3::z()),
            size: None,
        };
        let found = [
            plane(0, 0.0, 12.0),
            plane(1, 40.0, 12.0),
            plane(2, 0.0, 0.0),
        ];
        let top = SoughtFeature {
            kind: FeatureKind::Plane,
            size: None,
            ..sought(5.0, 12.1, 0.0)
        };
        assert_eq!(
            match_features(&[top], &found, REACH),
            [FeatureMatch::Found(0)]
        );
    }
}
