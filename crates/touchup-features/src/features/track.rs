//! Tracking of features during touching: a feature keeps its id, and its numbers include new
//! touches at once.
//!
//! [`Tracker::renew`] detects in the whole mesh; between two detections [`Tracker::update`] adds
//! new touches to the features under them, and leaves all others unchanged.

use nalgebra::Vector3;

use super::detect::{Detection, detect};
use super::feature::{Feature, FeatureKind, FittedTo, MeasuredValue, Walls};
use super::fit::{Cylinder, Fit, FitParams, Freedom, Stadium, SurfaceModel, TouchNoise, fit};
use super::from_fits::{Touches, axis_of, number};
use super::observe::{fit_params, groups, observation, systematic};
use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::distinct;
use touchup_method::stylus::ProbedPoint;

/// Tracks the features of one part.
#[derive(Clone, Debug, Default)]
pub struct Tracker {
    features: Vec<Feature>,
    /// share of the area outside all primitives at the last detection
    unexplained: Option<f64>,
    /// errors of the touches at the last detection
    noise: TouchNoise,
    next_id: u32,
    /// number of examined touches
    seen: usize,
    /// stamp of the last examined touch, ns
    until_ns: Option<i64>,
}

/// Maximum distance between places of the same feature, and of sizes, as a share of the size.
const SAME_PLACE: f64 = 0.5;
/// Minimum cosine between axes of the same feature: 30°.
const SAME_AXIS: f64 = 0.866;
/// Maximum distance of a touch from the surface of its feature, in radii of the ball.
const NEAR_RADII: f64 = 0.15;
/// Minimum cosine between the normals of a touch and of its feature: 40°.
const ALIKE: f64 = 0.77;
/// Maximum number of touches in a fit between two detections, spread over all of a feature.
const MOST_FITTED: usize = 240;
/// Radius assumed for a tip that is no ball, m.
const RADIUS: f64 = 1e-3;

impl Tracker {
    /// Known features, in order of id.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// Detects features in the whole mesh again; known features keep their ids.
    pub fn renew(&mut self, mesh: &TriMesh, touches: &[ProbedPoint]) -> &[Feature] {
        let Detection {
            mut features,
            unexplained,
            noise,
        } = detect(mesh, touches);
        self.unexplained = Some(unexplained);
        self.noise = noise;
        let mut known = std::mem::take(&mut self.features);
        for feature in &mut features {
            let off = |before: &Feature| (before.centre.value - feature.centre.value).norm();
            let alike = known
                .iter()
                .enumerate()
                .filter(|(_, before)| is_same(before, feature));
            let same = alike
                .min_by(|(_, a), (_, b)| off(a).total_cmp(&off(b)))
                .map(|(at, _)| at);
            feature.id = same.map_or_else(|| self.fresh_id(), |at| known.swap_remove(at).id);
        }
        features.sort_by_key(|feature| feature.id);
        self.features = features;
        self.note(touches);
        &self.features
    }

    fn note(&mut self, touches: &[ProbedPoint]) {
        self.seen = touches.len();
        self.until_ns = touches.last().map(|last| last.stamp_ns);
    }

    /// Share of the mesh's area outside all primitives at the last detection; `None` before the
    /// first.
    pub fn unexplained(&self) -> Option<f64> {
        self.unexplained
    }

    /// A new id, which no feature has, had or will get: for features known before detection.
    pub fn fresh_id(&mut self) -> u32 {
        self.next_id += 1;
        self.next_id - 1
    }

    /// Adds new touches to the holes, bosses, slots and pockets under them; returns the ids of the
    /// changed features.
    ///
    /// - `touches`: all touches, as for [`Self::renew`]. If earlier touches are gone, as after an
    ///   undone stroke, nothing changes until the next detection in the whole mesh: features refer
    ///   to touches by number.
    pub fn update(&mut self, touches: &[ProbedPoint]) -> Vec<u32> {
        let last = self
            .seen
            .checked_sub(1)
            .map(|last| touches.get(last).map(|touch| touch.stamp_ns));
        if last.unwrap_or_default() != self.until_ns {
            return Vec::new();
        }
        let added = self.seen..touches.len();
        self.note(touches);
        let mut changed = Vec::new();
        for feature in &mut self.features {
            let is_on = |&number: &usize| is_on(feature, &touches[number]);
            let new: Vec<u32> = added
                .clone()
                .filter(is_on)
                .map(|number| number as u32)
                .collect();
            if !new.is_empty() && feature.take(&new, touches, self.noise) {
                changed.push(feature.id);
            }
        }
        changed
    }
}

/// Size of a feature, the scale for differences of place, m.
fn size(feature: &Feature) -> f64 {
    let mut sizes = [&feature.diameter, &feature.width, &feature.length]
        .into_iter()
        .flatten();
    sizes.next().map_or(2.0 * RADIUS, |size| size.value)
}

fn is_same(one: &Feature, other: &Feature) -> bool {
    let axes = one.axis.as_ref().zip(other.axis.as_ref());
    let is_alike = axes.is_none_or(|(a, b)| a.value.dot(&b.value).abs() > SAME_AXIS);
    let off = one.centre.value - other.centre.value;
    // the same hole may have become deeper
    let off = match (one.kind, &one.axis) {
        (FeatureKind::Hole | FeatureKind::Boss | FeatureKind::Cylinder, Some(axis)) => {
            off - axis.value * off.dot(&axis.value)
        }
        _ => off,
    };
    let (a, b) = (size(one), size(other));
    let is_as_large = one.kind == FeatureKind::Plane || (a - b).abs() < SAME_PLACE * a.max(b);
    one.kind == other.kind && is_alike && is_as_large && off.norm() < SAME_PLACE * a.max(b)
}

/// Whether a touch is on the surface of a feature.
fn is_on(feature: &Feature, touch: &ProbedPoint) -> bool {
    let reach = if touch.radius > 0.0 {
        touch.radius
    } else {
        RADIUS
    };
    let Some(axis) = feature.axis.as_ref().filter(|_| !touch.is_rejected) else {
        return false;
    };
    let height = feature.depth.as_ref().map_or(0.0, |depth| depth.value);
    let half_length = feature
        .length
        .as_ref()
        .map_or(0.0, |length| length.value / 2.0);
    let along = (touch.point - feature.centre.value).dot(&axis.value);
    // a hole lies below its opening, a boss rises from its foot
    let is_between = match feature.kind {
        FeatureKind::Boss => along > 0.0 && along < height + reach,
        FeatureKind::Cylinder if feature.depth.is_none() => along.abs() < half_length,
        FeatureKind::Cylinder => along > 0.0 && along < height,
        _ => along < 0.0 && along > -height - reach,
    };
    let far =
        size(feature) + feature.length.as_ref().map_or(0.0, |length| length.value) + height + reach;
    if !is_between || (touch.point - feature.centre.value).norm() > far {
        return false;
    }
    let (distance, normal) = match &feature.walls {
        Some(Walls::Round(cylinder)) => cylinder.distance_and_normal(&touch.centre),
        Some(Walls::Slot(stadium)) => stadium.distance_and_normal(&touch.centre),
        None => return false,
    };
    (distance - touch.radius).abs() < NEAR_RADII * reach && normal.dot(&touch.normal) > ALIKE
}

impl Feature {
    /// Fits the feature to its touches and the new ones; returns whether the fit held.
    fn take(&mut self, new: &[u32], touches: &[ProbedPoint], noise: TouchNoise) -> bool {
        let known = self
            .main_size()
            .into_iter()
            .flat_map(|sized| &sized.touches);
        let all = distinct(known.chain(new).copied());
        let step = all.len().div_ceil(MOST_FITTED).max(1);
        let fitted: Vec<u32> = all.iter().copied().rev().step_by(step).collect();
        let chosen: Vec<ProbedPoint> = fitted
            .iter()
            .rev()
            .map(|&number| touches[number as usize])
            .collect();
        let observations: Vec<_> = chosen
            .iter()
            .zip(groups(&chosen))
            .map(|(touch, group)| observation(touch, group))
            .collect();
        let params = FitParams {
            axis_sigma: Some(AXIS_KNOWN),
            ..fit_params(systematic(chosen.iter()), noise)
        };
        let is_held = match &self.walls {
            Some(Walls::Round(cylinder)) => fit(cylinder, &observations, &params)
                .map(|found| self.is_round(&found, &all))
                .is_ok(),
            Some(Walls::Slot(stadium)) => fit(stadium, &observations, &params)
                .map(|found| self.is_slot(&found, &all))
                .is_ok(),
            None => false,
        };
        if is_held {
            self.fitted_to = FittedTo::Touches;
        }
        is_held
    }

    fn is_round(&mut self, found: &Fit<Cylinder>, touches: &Touches) {
        let centre = found.surface.nearest_on_axis(&self.centre.value);
        self.centre = MeasuredValue::new(centre, found.lateral_std(&centre), touches.clone());
        self.axis = Some(self.turned(found, touches));
        self.diameter = Some(number(
            found,
            2.0 * found.surface.radius,
            &[(Freedom::Size, 2.0)],
            touches,
        ));
        self.walls = Some(Walls::Round(found.surface));
    }

    fn is_slot(&mut self, found: &Fit<Stadium>, touches: &Touches) {
        self.width = Some(number(
            found,
            found.surface.width,
            &[(Freedom::Size, 1.0)],
            touches,
        ));
        if found.std(Freedom::Second).is_some() {
            self.length = Some(number(
                found,
                found.surface.length,
                &[(Freedom::Second, 1.0)],
                touches,
            ));
        }
        let (axis, start, direction) = (
            found.surface.axis(),
            found.surface.center(),
            found.surface.direction(),
        );
        let off = self.centre.value - start;
        // along the slot only its ends determine its position
        let along = if found.std(Freedom::X).is_some() {
            0.0
        } else {
            off.dot(&direction)
        };
        let value = start + axis * off.dot(&axis) + direction * along;
        self.centre = MeasuredValue::new(value, found.middle_std(), touches.clone());
        self.axis = Some(self.turned(found, touches));
        self.walls = Some(Walls::Slot(found.surface));
    }

    /// Direction of a fit, with the sign of the axis.
    fn turned<S: SurfaceModel>(
        &self,
        found: &Fit<S>,
        touches: &Touches,
    ) -> MeasuredValue<Vector3<f64>> {
        axis_of(
            found,
            &self
                .axis
                .as_ref()
                .map_or_else(|| found.surface.axis(), |axis| axis.value),
            touches,
        )
    }
}

/// Standard uncertainty of the axis from the last detection, rad: 1°; with it touches at one height
/// are enough.
const AXIS_KNOWN: f64 = 0.0175;
