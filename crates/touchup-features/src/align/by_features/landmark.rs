//! Features as landmarks for registration: position, direction and size, as far as known.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::alternative::FeaturesParams;
use crate::features::{Feature, FeatureKind};

/// A feature, or its other end.
#[derive(Clone, Debug)]
pub(super) struct Landmark {
    pub kind: FeatureKind,
    pub place: Point3<f64>,
    /// out of the opening, along an edge, outward normal
    pub axis: Option<Vector3<f64>>,
    /// along a slot
    pub direction: Option<Vector3<f64>>,
    /// diameter or width with its standard uncertainty, m
    size: Option<[f64; 2]>,
    /// standard uncertainty of the place, m
    sigma: f64,
    /// extent from its place along the axis, backwards and forwards, m
    span: [f64; 2],
    /// whether it goes through: which end is the opening then depends on the view
    is_through: bool,
    /// whether it stands on the shoulder of a shaft
    is_step: bool,
    is_convex: Option<bool>,
    /// normals of the planes of a corner, turning to the left seen from outside
    pub normals: Option<[Vector3<f64>; 3]>,
}

/// Cosine of the largest angle between equal axes: 6°.
pub(super) const ALIKE: f64 = 0.9945;
/// Allowed deviation in standard uncertainties.
const SIGMAS: f64 = 3.0;
/// Least volume spanned by the normals at a corner.
const SPATIAL: f64 = 0.17;

/// All features as landmarks, in their order.
pub(super) fn landmarks(
    features: &[Feature],
    params: &FeaturesParams,
    diagonal: f64,
) -> Vec<Landmark> {
    let planes: Vec<(Point3<f64>, Vector3<f64>)> = features
        .iter()
        .filter(|feature| feature.kind == FeatureKind::Plane)
        .filter_map(|feature| Some((feature.centre.value, feature.axis.as_ref()?.value)))
        .collect();
    let near = params.tolerance * diagonal;
    features
        .iter()
        .map(|feature| Landmark::of(feature, &planes, near))
        .collect()
}

impl Landmark {
    fn of(feature: &Feature, planes: &[(Point3<f64>, Vector3<f64>)], near: f64) -> Self {
        let place = feature.centre.value;
        let reach = match feature.kind {
            FeatureKind::Edge => feature
                .length
                .as_ref()
                .map_or([0.0; 2], |length| [length.value / 2.0; 2]),
            _ => [feature.depth.as_ref().map_or(0.0, |depth| depth.value), 0.0],
        };
        Self {
            kind: feature.kind,
            place,
            axis: feature.axis.as_ref().map(|axis| axis.value),
            direction: feature.direction,
            size: feature
                .main_size()
                .map(|size| [size.value, size.std.unwrap_or(0.0)]),
            sigma: feature.centre.std.unwrap_or(0.0),
            span: reach,
            is_through: feature.through == Some(true),
            is_step: feature.kind == FeatureKind::Cylinder && feature.depth.is_some(),
            is_convex: feature.is_convex,
            normals: (feature.kind == FeatureKind::Corner)
                .then(|| normals_at(&place, planes, near))
                .flatten(),
        }
    }

    /// Whether it has a position and an outward direction: two such landmarks determine a motion.
    pub(crate) fn is_located(&self) -> bool {
        let has_place = match self.kind {
            FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Pocket | FeatureKind::Boss => true,
            // the place of a step is on its shoulder, that of another is somewhere on its axis
            FeatureKind::Cylinder => self.is_step,
            _ => false,
        };
        has_place && self.axis.is_some()
    }

    /// Its kind; pockets count as slots, as their border is a matter of taste.
    pub(crate) fn class(&self) -> FeatureKind {
        if self.kind == FeatureKind::Pocket {
            FeatureKind::Slot
        } else {
            self.kind
        }
    }

    /// Itself, and the other end of a through feature.
    pub(crate) fn ends(&self) -> impl Iterator<Item = Self> + '_ {
        let other = self
            .axis
            .filter(|_| self.is_through && self.is_located())
            .map(|axis| Self {
                place: self.place - axis * self.span[0],
                axis: Some(-axis),
                ..self.clone()
            });
        std::iter::once(self.clone()).chain(other)
    }

    /// Its weight: an opening is one thing, an edge part of many.
    pub(crate) fn weight(&self) -> f64 {
        match self.kind {
            FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Pocket | FeatureKind::Boss => 1.0,
            FeatureKind::Corner | FeatureKind::Sphere => 0.5,
            FeatureKind::Edge => 0.25,
            FeatureKind::Cylinder if self.is_step => 1.0,
            FeatureKind::Plane | FeatureKind::Cylinder | FeatureKind::Notch => 0.2,
        }
    }

    /// Whether both may be the same thing, by properties independent of their places.
    pub(crate) fn is_like(&self, other: &Self, params: &FeaturesParams) -> bool {
        let sizes = self.size.zip(other.size).is_none_or(|([a, s], [b, t])| {
            (a - b).abs() <= params.size_tolerance * a.max(b) + SIGMAS * s.hypot(t)
        });
        let sides = self
            .is_convex
            .zip(other.is_convex)
            .is_none_or(|(a, b)| a == b);
        self.class() == other.class() && sizes && sides
    }

    /// Largest distance between the places of one and the other, m.
    pub(crate) fn play(&self, other: &Self, tolerance: f64) -> f64 {
        tolerance + (SIGMAS * self.sigma.hypot(other.sigma)).min(3.0 * tolerance)
    }

    /// Distance from `other` after `motion`, over the allowed one; infinite if the directions
    /// differ. An edge or a through feature may be anywhere along the other.
    ///
    /// - `tolerance`: m
    pub(crate) fn misfit(&self, motion: &Isometry3<f64>, other: &Self, tolerance: f64) -> f64 {
        let play = self.play(other, tolerance);
        let offset = motion * self.place - other.place;
        let Some((own, theirs)) = self.axis.zip(other.axis) else {
            return offset.norm() / play;
        };
        let cosine = (motion * own).dot(&theirs);
        let is_free = self.is_line() || other.is_line();
        if (if is_free { cosine.abs() } else { cosine }) < ALIKE {
            return f64::INFINITY;
        }
        let along = offset.dot(&theirs);
        let across = (offset - theirs * along).norm();
        let left = match self.kind {
            FeatureKind::Plane => along.abs(),
            _ if !is_free => offset.norm(),
            _ => across.hypot((-along - other.span[0]).max(along - other.span[1]).max(0.0)),
        };
        left / play
    }

    fn is_line(&self) -> bool {
        self.is_through || self.kind == FeatureKind::Edge
    }

    /// Projection onto the constrained offsets from `other`.
    pub(crate) fn held(&self, other: &Self) -> Matrix3<f64> {
        match other.axis {
            Some(axis) if self.kind == FeatureKind::Plane => axis * axis.transpose(),
            Some(axis) if self.is_line() || other.is_line() => {
                Matrix3::identity() - axis * axis.transpose()
            }
            _ => Matrix3::identity(),
        }
    }

    /// 1/variance of the place beside that of another, 1/m².
    pub(crate) fn trust(&self, other: &Self, tolerance: f64) -> f64 {
        1.0 / (self.sigma.powi(2) + other.sigma.powi(2) + (0.1 * tolerance).powi(2))
    }

    /// Its mirror image at x = 0.
    pub(crate) fn mirrored(&self) -> Self {
        let flip = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
        Self {
            place: flip(self.place.coords).into(),
            axis: self.axis.map(flip),
            direction: self.direction.map(flip),
            normals: self.normals.map(|[a, b, c]| [flip(a), flip(c), flip(b)]),
            ..self.clone()
        }
    }
}

/// Normals of three planes that meet in `place`; `None` unless there are just three such
/// directions.
fn normals_at(
    place: &Point3<f64>,
    planes: &[(Point3<f64>, Vector3<f64>)],
    near: f64,
) -> Option<[Vector3<f64>; 3]> {
    let mut found: Vec<(f64, Vector3<f64>)> = Vec::new();
    let mut by_distance: Vec<_> = planes
        .iter()
        .map(|(p, n)| ((place - p).dot(n).abs(), *n))
        .collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (distance, normal) in by_distance
        .into_iter()
        .filter(|(distance, _)| *distance <= near)
    {
        if found.len() < 3
            && found
                .iter()
                .all(|(_, other)| other.dot(&normal).abs() < ALIKE)
        {
            found.push((distance, normal));
        }
    }
    let &[(_, a), (_, b), (_, c)] = found.as_slice() else {
        return None;
    };
    let volume = a.cross(&b).dot(&c);
    (volume.abs() > SPATIAL).then_some(if volume > 0.0 { [a, b, c] } else { [a, c, b] })
}
