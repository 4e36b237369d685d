//! The evidence for a motion, by features and by surface, and whether it rules out another motion.

use nalgebra::{Isometry3, Point3, Vector3};

use super::alternative::{Alternative, OrientedSample, SAME, Surfaces};
use super::matching::Matching;
use crate::align::icp::{IcpFit, IcpParams, icp};
use touchup_geometry::mesh::SerialWorkers;
use touchup_geometry::numeric::{median, without_repeats};

/// Maximum number of points that refine each motion; all points judge it, and refine the last ones.
const MOST_POINTS: usize = 5_000;
/// Reach of a fit, in tolerances: leaves out lids on holes and missing parts.
const REACH: f64 = 5.0;
/// Distance within which a point agrees, in scatters of the best fit.
const SCATTERS: f64 = 4.0;
/// Least such distance, as a share of a tolerance: nothing is distinguishable below it.
const LEAST_NEAR: f64 = 0.05;
/// Cosine between similar normals: 45°, as noise turns the small faces of a scan.
const FACING: f64 = 0.7;
/// Distance within which a point belongs to the target at all, in tolerances: includes a noisy scan
/// with an outward offset.
const COARSE: f64 = 1.5;
/// Ratio by which evidence for one motion alone must exceed evidence for the other alone.
const CLEARLY: f64 = 3.0;
/// Smallest number of deciding points.
const POINTS: f64 = 8.0;
/// Smallest number of deciding points, as a share of the points left over by the better motion: if
/// it fits all but the noise, noise decides nothing.
const LEFT_OVER: f64 = 0.05;
/// Share of the points that a turn of a part of revolution may lose: at the rims of its ends, where
/// facets of one turn lie above facets of another.
const AT_RIMS: f64 = 0.003;
/// Smallest deciding weight of features: one opening, or as much of others.
const FEATURES: f64 = 1.0;
/// Additional misfit from which a feature in its place by one motion is missing by another, over
/// the median misfit of the features in their places.
const ABSENT: f64 = 3.0;
/// Bounds of the additional misfit of a missing feature, in misfits.
const ABSENT_BETWEEN: [f64; 2] = [0.3, 2.0];

/// A motion with its evidence.
#[derive(Clone, Debug)]
pub(super) struct JudgedMotion {
    motion: Isometry3<f64>,
    fit: Option<IcpFit>,
    /// best partner of each feature of the source, and its misfit: offset over the allowed one
    partners: Vec<Option<(usize, f64)>>,
    /// distance of each point from the target with a similar normal, m; infinite beyond the coarse
    /// bound; empty without surfaces
    distances: Vec<f64>,
}

impl JudgedMotion {
    /// Matched features: of the source, of the target.
    pub(crate) fn explained(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let is_there = |(own, partner): (usize, &Option<(usize, f64)>)| {
            partner
                .filter(|(_, misfit)| *misfit <= 1.0)
                .map(|(theirs, _)| [own, theirs])
        };
        self.partners.iter().enumerate().filter_map(is_there)
    }

    /// Share of the agreeing points.
    pub(crate) fn agreeing(&self) -> Option<f64> {
        let count = self
            .distances
            .iter()
            .filter(|distance| distance.is_finite())
            .count();
        (!self.distances.is_empty()).then(|| count as f64 / self.distances.len() as f64)
    }

    /// Weight of the explained features.
    pub(crate) fn weight(&self, matching: &Matching) -> f64 {
        self.explained()
            .map(|[own, _]| matching.source[own].weight())
            .sum()
    }

    /// Additional misfit of a missing feature, from the misfits of the explained ones.
    fn absent(&self) -> f64 {
        let mut misfits: Vec<f64> = self.explained().map(|[own, _]| self.misfit(own)).collect();
        (ABSENT * median(&mut misfits).unwrap_or(1.0)).clamp(ABSENT_BETWEEN[0], ABSENT_BETWEEN[1])
    }

    fn misfit(&self, own: usize) -> f64 {
        self.partners[own].map_or(f64::INFINITY, |(_, misfit)| misfit)
    }
}

/// Judge of motions.
pub(super) struct Judge<'a> {
    pub matching: Matching,
    surfaces: Option<&'a Surfaces<'a>>,
    /// mirrored for a search in the mirror
    points: Vec<OrientedSample>,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(
        matching: Matching,
        surfaces: Option<&'a Surfaces<'a>>,
        in_mirror: bool,
    ) -> Self {
        let points = surfaces.map_or(&[][..], |surfaces| surfaces.points);
        let flip = |v: Vector3<f64>| {
            if in_mirror {
                Vector3::new(-v.x, v.y, v.z)
            } else {
                v
            }
        };
        let point = |p: &OrientedSample| OrientedSample {
            point: flip(p.point.coords).into(),
            normal: flip(p.normal),
        };
        let points = points.iter().map(point).collect();
        Self {
            matching,
            surfaces,
            points,
        }
    }

    /// Refines each motion and judges it; the best first, no two alike.
    pub(crate) fn all(&self, motions: &[Isometry3<f64>]) -> Vec<JudgedMotion> {
        let step = self.points.len().div_ceil(MOST_POINTS).max(1);
        let points: Vec<Point3<f64>> = self.points.iter().step_by(step).map(|p| p.point).collect();
        let refined = motions.iter().map(|coarse| {
            let fit = self.refine(&points, coarse);
            (
                fit.as_ref().map_or(*coarse, |fit| fit.source_to_target),
                fit,
            )
        });
        let near = SAME * self.matching.tolerance;
        let refined = without_repeats(refined, |(before, _), (motion, _)| {
            self.matching.apart(motion, before) <= near
        });
        let mut judged: Vec<_> = refined
            .into_iter()
            .map(|(motion, fit)| self.judged(motion, fit))
            .collect();
        let all = self
            .matching
            .source
            .iter()
            .map(|own| own.weight())
            .sum::<f64>();
        let merit = |judged: &JudgedMotion| {
            judged.weight(&self.matching) / all + judged.agreeing().unwrap_or(0.0)
        };
        judged.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        judged
    }

    fn refine(&self, points: &[Point3<f64>], coarse: &Isometry3<f64>) -> Option<IcpFit> {
        let Surfaces { target, tree, .. } = self.surfaces?;
        let params = IcpParams {
            reach: REACH * self.matching.tolerance,
            ..IcpParams::default()
        };
        icp(points, target, tree, coarse, &params, &SerialWorkers).ok()
    }

    fn judged(&self, motion: Isometry3<f64>, fit: Option<IcpFit>) -> JudgedMotion {
        let coarse = COARSE * self.matching.tolerance;
        let distance = |p: &OrientedSample| {
            let Surfaces { target, tree, .. } = self.surfaces?;
            let hit = tree.closest(target, &(motion * p.point), coarse)?;
            let faces = target.normal(hit.face).dot(&(motion * p.normal)) > FACING;
            faces.then(|| hit.distance_squared.sqrt())
        };
        let distances = self
            .points
            .iter()
            .map(|p| distance(p).unwrap_or(f64::INFINITY))
            .collect();
        JudgedMotion {
            motion,
            fit,
            partners: self.matching.partners(&motion),
            distances,
        }
    }

    /// Whether the evidence decides for `a` against `b`: the surface, or if it does not decide, the
    /// features found on it.
    fn rules_out(&self, a: &JudgedMotion, b: &JudgedMotion) -> bool {
        match (self.by_surface(a, b), self.by_surface(b, a)) {
            (true, false) => true,
            (false, true) => false,
            _ => self.by_features(a, b) && !self.by_features(b, a),
        }
    }

    /// The motions that no other rules out; all of them if each has one that rules it out.
    pub(crate) fn left_over(&self, judged: Vec<JudgedMotion>) -> Vec<JudgedMotion> {
        let is_ruled_out = |b: &JudgedMotion| judged.iter().any(|a| self.rules_out(a, b));
        let left: Vec<JudgedMotion> = judged
            .iter()
            .filter(|b| !is_ruled_out(b))
            .cloned()
            .collect();
        if left.is_empty() { judged } else { left }
    }

    /// Whether all evidence decides for `a` against `b`.
    pub(crate) fn is_better_throughout(&self, a: &JudgedMotion, b: &JudgedMotion) -> bool {
        self.by_features(a, b) && (self.surfaces.is_none() || self.by_surface(a, b))
    }

    /// Decides among all points that belong to the target at all, or among the points on it within
    /// the scatter of the best fit.
    fn by_surface(&self, a: &JudgedMotion, b: &JudgedMotion) -> bool {
        let alone = |a: &JudgedMotion, b: &JudgedMotion, near: f64| {
            a.distances
                .iter()
                .zip(&b.distances)
                .filter(|(a, b)| **a <= near && **b > near)
                .count() as f64
        };
        [self.near(a), COARSE * self.matching.tolerance]
            .into_iter()
            .any(|near| {
                let (own, other) = (alone(a, b, near), alone(b, a, near));
                let left_over = a
                    .distances
                    .iter()
                    .filter(|distance| **distance > near)
                    .count() as f64;
                own - other >= POINTS.max(LEFT_OVER * left_over) && own > CLEARLY * other
            })
    }

    /// Largest distance of a point on the target within the scatter of the fit, m.
    fn near(&self, judged: &JudgedMotion) -> f64 {
        let (tolerance, scatter) = (
            self.matching.tolerance,
            judged.fit.as_ref().map_or(0.0, |fit| fit.scatter),
        );
        (SCATTERS * scatter).clamp(LEAST_NEAR * tolerance, COARSE * tolerance)
    }

    fn by_features(&self, a: &JudgedMotion, b: &JudgedMotion) -> bool {
        let alone = |a: &JudgedMotion, b: &JudgedMotion| -> f64 {
            let absent = a.absent();
            let own = self.matching.source.iter().enumerate();
            own.filter(|(i, _)| a.misfit(*i) <= 1.0 && b.misfit(*i) > a.misfit(*i) + absent)
                .map(|(_, own)| own.weight())
                .sum()
        };
        let (own, other) = (alone(a, b), alone(b, a));
        own >= FEATURES && own > CLEARLY * other
    }

    /// Whether `turn` keeps the surface on the target; facets of a round part count as round.
    pub(crate) fn stays(&self, best: &JudgedMotion, turn: &Isometry3<f64>) -> bool {
        let turned = self.judged(turn * best.motion, None);
        let is_lost = |(own, turned): &(&f64, &f64)| own.is_finite() && !turned.is_finite();
        let lost = best
            .distances
            .iter()
            .zip(&turned.distances)
            .filter(is_lost)
            .count() as f64;
        lost <= POINTS.max(AT_RIMS * self.points.len() as f64)
    }

    /// The motions of the result, refined with all points.
    pub(crate) fn settled(&self, judged: Vec<JudgedMotion>) -> Vec<Alternative> {
        let points: Vec<Point3<f64>> = self.points.iter().map(|p| p.point).collect();
        let mut alternatives: Vec<Alternative> = Vec::new();
        for judged in judged {
            let fit = self
                .refine(&points, &judged.motion)
                .or_else(|| judged.fit.clone());
            let motion = fit
                .as_ref()
                .map_or(judged.motion, |fit| fit.source_to_target);
            let first = alternatives
                .first()
                .map_or(motion, |first| first.source_to_target);
            let turn = (motion.rotation * first.rotation.inverse()).scaled_axis();
            let shift = motion * self.matching.middle - first * self.matching.middle;
            alternatives.push(Alternative {
                source_to_target: motion,
                explained: judged.explained().collect(),
                agreeing: judged.agreeing(),
                icp: fit,
                differs: [turn, shift],
            });
        }
        alternatives
    }
}
