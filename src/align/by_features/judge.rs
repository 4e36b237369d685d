//! What speaks for a motion, by features and by surface, and whether it speaks against another.

use nalgebra::{Isometry3, Point3, Vector3};

use super::matching::Matching;
use super::{Alternative, OrientedPoint, SAME, Surfaces};
use crate::align::icp::{IcpFit, IcpParams, icp};

/// Points with which motions are compared, at most; all bring the last ones to rest.
const MOST_POINTS: usize = 6_000;
/// Points farther than so many tolerances have no part in a fit: lids on holes, what is not there.
const REACH: f64 = 10.0;
/// A point agrees within so many scatters of the best fit.
const SCATTERS: f64 = 4.0;
/// … or this share of a tolerance: below it nothing is told apart.
const LEAST_NEAR: f64 = 0.1;
/// Cosine between normals that face the same way: 45°, as noise turns the small faces of a scan.
const FACING: f64 = 0.7;
/// A point belongs to the target at all within so many tolerances: a scan that is noisy and too fat still does.
const COARSE: f64 = 3.0;
/// What a motion explains alone outweighs so many times what the other explains alone.
const CLEARLY: f64 = 3.0;
/// Share of the surface that decides.
const SURFACE: f64 = 0.005;
/// Weight of features that decides: one opening, or what else is as much.
const FEATURES: f64 = 1.0;
/// A feature is not there when it is off by so many times what it may be.
const ABSENT: f64 = 2.0;

/// A motion with what it explains.
#[derive(Clone, Debug)]
pub(super) struct Judged {
    motion: Isometry3<f64>,
    fit: Option<IcpFit>,
    /// of each feature of the source: its best partner, and how far that is off over what it may be
    partners: Vec<Option<(usize, f64)>>,
    /// of each point: whether it lies on the target as well as the best fit lets it; empty without surfaces
    agrees: Vec<bool>,
    /// share of the points that belong to the target at all
    agreeing: Option<f64>,
}

impl Judged {
    /// Features that are brought together: of the source, of the target.
    pub fn explained(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let is_there = |(own, partner): (usize, &Option<(usize, f64)>)| {
            partner.filter(|(_, misfit)| *misfit <= 1.0).map(|(theirs, _)| [own, theirs])
        };
        self.partners.iter().enumerate().filter_map(is_there)
    }

    /// Share of the points that agree.
    pub fn agreeing(&self) -> Option<f64> {
        self.agreeing
    }

    /// Of what is explained.
    pub fn weight(&self, matching: &Matching) -> f64 {
        self.explained().map(|[own, _]| matching.source[own].weight()).sum()
    }

    fn misfit(&self, own: usize) -> f64 {
        self.partners[own].map_or(f64::INFINITY, |(_, misfit)| misfit)
    }
}

/// Tries motions.
pub(super) struct Judge<'a> {
    pub matching: Matching,
    surfaces: Option<&'a Surfaces<'a>>,
    /// a part of the points, in the mirror where that is asked for
    points: Vec<OrientedPoint>,
}

impl<'a> Judge<'a> {
    pub fn new(matching: Matching, surfaces: Option<&'a Surfaces<'a>>, in_mirror: bool) -> Self {
        let points = surfaces.map_or(&[][..], |surfaces| surfaces.points);
        let step = points.len().div_ceil(MOST_POINTS).max(1);
        let flip = |v: Vector3<f64>| if in_mirror { Vector3::new(-v.x, v.y, v.z) } else { v };
        let some = points
            .iter()
            .step_by(step)
            .map(|p| OrientedPoint { point: Point3::from(flip(p.point.coords)), normal: flip(p.normal) });
        Self { matching, surfaces, points: some.collect() }
    }

    /// Brings each motion to rest and judges it; the best first, no two alike.
    pub fn all(&self, motions: &[Isometry3<f64>]) -> Vec<Judged> {
        let points: Vec<Point3<f64>> = self.points.iter().map(|p| p.point).collect();
        let mut rested: Vec<(Isometry3<f64>, Option<IcpFit>)> = Vec::new();
        for coarse in motions {
            let fit = self.rest(&points, coarse);
            let motion = fit.as_ref().map_or(*coarse, |fit| fit.source_to_target);
            let is_new = |(other, _): &(_, _)| self.matching.apart(&motion, other) > SAME * self.matching.tolerance;
            if rested.iter().all(is_new) {
                rested.push((motion, fit));
            }
        }
        let scatter = rested.iter().filter_map(|(_, fit)| Some(fit.as_ref()?.scatter)).fold(f64::INFINITY, f64::min);
        let tolerance = self.matching.tolerance;
        let near = (SCATTERS * scatter).clamp(LEAST_NEAR * tolerance, COARSE * tolerance);
        let mut judged: Vec<_> = rested.into_iter().map(|(motion, fit)| self.judged(motion, fit, near)).collect();
        let all = self.matching.source.iter().map(|own| own.weight()).sum::<f64>();
        let merit = |judged: &Judged| judged.weight(&self.matching) / all + judged.agreeing().unwrap_or(0.0);
        judged.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        judged
    }

    fn rest(&self, points: &[Point3<f64>], coarse: &Isometry3<f64>) -> Option<IcpFit> {
        let Surfaces { target, tree, .. } = self.surfaces?;
        let params = IcpParams { reach: REACH * self.matching.tolerance, ..IcpParams::default() };
        icp(points, target, tree, coarse, &params).ok()
    }

    fn judged(&self, motion: Isometry3<f64>, fit: Option<IcpFit>, near: f64) -> Judged {
        let coarse = COARSE * self.matching.tolerance;
        let distance = |p: &OrientedPoint| {
            let Surfaces { target, tree, .. } = self.surfaces?;
            let hit = tree.closest(target, &(motion * p.point), coarse)?;
            let faces = target.normal(hit.face).dot(&(motion * p.normal)) > FACING;
            faces.then(|| hit.distance_squared.sqrt())
        };
        let distances: Vec<Option<f64>> = self.points.iter().map(distance).collect();
        let agreeing = distances.iter().flatten().count() as f64 / distances.len() as f64;
        Judged {
            motion,
            fit,
            partners: self.matching.partners(&motion),
            agrees: distances.iter().map(|distance| distance.is_some_and(|d| d <= near)).collect(),
            agreeing: (!distances.is_empty()).then_some(agreeing),
        }
    }

    /// Whether the evidence decides for `a` against `b`, and nothing against that.
    pub fn rules_out(&self, a: &Judged, b: &Judged) -> bool {
        let speaks = |a, b| self.by_surface(a, b) || self.by_features(a, b);
        speaks(a, b) && !speaks(b, a)
    }

    /// Whether all evidence decides for `a` against `b`.
    pub fn is_better_throughout(&self, a: &Judged, b: &Judged) -> bool {
        self.by_features(a, b) && (self.surfaces.is_none() || self.by_surface(a, b))
    }

    fn by_surface(&self, a: &Judged, b: &Judged) -> bool {
        let alone = |a: &Judged, b: &Judged| a.agrees.iter().zip(&b.agrees).filter(|(a, b)| **a && !**b).count() as f64;
        let (own, other) = (alone(a, b), alone(b, a));
        own - other >= SURFACE * self.points.len() as f64 && own > CLEARLY * other
    }

    fn by_features(&self, a: &Judged, b: &Judged) -> bool {
        let alone = |a: &Judged, b: &Judged| -> f64 {
            let own = self.matching.source.iter().enumerate();
            own.filter(|(i, _)| a.misfit(*i) <= 1.0 && b.misfit(*i) > ABSENT).map(|(_, own)| own.weight()).sum()
        };
        let (own, other) = (alone(a, b), alone(b, a));
        own >= FEATURES && own > CLEARLY * other
    }

    /// The motions as they are told, brought to rest with all points.
    pub fn settled(&self, judged: Vec<Judged>) -> Vec<Alternative> {
        let points: Vec<Point3<f64>> =
            self.surfaces.map_or(&[][..], |surfaces| surfaces.points).iter().map(|p| p.point).collect();
        let mut alternatives: Vec<Alternative> = Vec::new();
        for judged in judged {
            let fit = self.rest(&points, &judged.motion).or_else(|| judged.fit.clone());
            let motion = fit.as_ref().map_or(judged.motion, |fit| fit.source_to_target);
            let first = alternatives.first().map_or(motion, |first| first.source_to_target);
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
