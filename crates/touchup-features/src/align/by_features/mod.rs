//! Global registration: the rigid motion that maps the features of one shape onto those of another,
//! from any start.
//!
//! Pairs of features, slots, corners and features beside a plane are frames. A frame of one shape
//! and a frame of the other with the same invariants (kinds, sizes, distances, angles, handedness)
//! make a hypothesis. Its score counts all explained features, so some may be missing or false on
//! either side. Least squares and point to plane refine the best hypotheses, and the agreeing share
//! of the surface judges them. Two motions that the evidence does not distinguish are both
//! returned. Features about one axis alone leave the turn about it open: unless the surface fixes
//! it, an error says so. The search is exhaustive and deterministic, without random samples.

mod alternative;
mod bases;
mod error;
mod free_turn;
mod judge;
mod landmark;
mod matching;

pub use alternative::{Alternative, FeaturesParams, OrientedSample, Surfaces};
pub use error::{FeaturesError, FeaturesSide};
pub use free_turn::FreeTurn;
use nalgebra::{Isometry3, Point3};

use self::alternative::SAME;
use self::bases::{Base, SortedSets, axial_bases, bases};
use self::judge::{Judge, JudgedMotion};
use self::landmark::{Landmark, landmarks};
use self::matching::Matching;
use crate::features::Feature;
use touchup_geometry::numeric::mean;

/// Maximum number of tried frames of the source; spread evenly over all.
const MOST_BASES: usize = 3_000;
/// Maximum number of scored hypotheses.
const MOST_HYPOTHESES: usize = 30_000;
/// Maximum number of feature comparisons: with very many features, fewer hypotheses get a score.
const MOST_COMPARISONS: usize = 60_000_000;
/// Maximum number of motions that go on to the surfaces.
const MOST_CANDIDATES: usize = 64;
/// Their least score as a share of the best: without it a false feature could not hide the truth.
const CANDIDATE: f64 = 0.5;
/// Maximum number of examined mirror images.
const MOST_MIRRORED: usize = 8;
/// Least agreeing share of the surface.
const LEAST_AGREEING: f64 = 0.5;
/// Least explained weight without surfaces: two openings, the planes about them, and more.
const LEAST_EXPLAINED: f64 = 2.5;

/// The single motion that maps `source` onto `target`, or why there is none or more than one.
///
/// Bounds: 30 000 hypotheses, of 3 000 frames of the source (among its 150 largest openings), and
/// 64 trials on the surfaces.
///
/// - `source`, `target`: results of [`crate::features::detect`], each in its own frame.
/// - `surfaces`: if given, they decide, and make the motion as exact as they are.
///
/// # Errors
/// [`FeaturesError`]; [`FeaturesError::Ambiguous`] has all motions among which the evidence does
/// not decide, [`FeaturesError::FreeTurn`] those of a part of revolution, each with one arbitrary
/// turn.
#[expect(clippy::too_many_lines)]
pub fn align_features(
    source: &[Feature],
    target: &[Feature],
    surfaces: Option<&Surfaces<'_>>,
    params: &FeaturesParams,
) -> Result<Alternative, FeaturesError> {
    for (side, features) in [
        (FeaturesSide::Source, source),
        (FeaturesSide::Target, target),
    ] {
        if features.is_empty() {
            return Err(FeaturesError::NoFeatures { side });
        }
    }
    let size = surfaces.map_or_else(
        || size_of(target.iter().map(|feature| feature.centre.value)),
        |surfaces| size_of(surfaces.target.positions().iter().copied()),
    );
    let [own, theirs] = [source, target].map(|features| landmarks(features, params, size));
    let mirror = own.iter().map(Landmark::mirrored).collect();
    let judge = Judge::new(
        Matching::new(own, theirs.clone(), params, size),
        surfaces,
        false,
    );
    let frames = Frames::of(&judge.matching)?;
    let judged = judge.left_over(judge.all(&candidates(&judge.matching, &frames, MOST_CANDIDATES)));
    let mirror = Judge::new(Matching::new(mirror, theirs, params, size), surfaces, true);
    let mirrored_frames = Frames::of(&mirror.matching)?;
    let mirrored = mirror
        .all(&candidates(
            &mirror.matching,
            &mirrored_frames,
            MOST_MIRRORED,
        ))
        .into_iter()
        .next();
    let is_clear = |best: &JudgedMotion| match best.agreeing() {
        Some(share) => share >= LEAST_AGREEING,
        None if frames.is_axial => best.explained().count() == source.len(),
        None => best.weight(&judge.matching) >= LEAST_EXPLAINED,
    };
    if let Some(error) = refusal(
        &judge,
        judged.first(),
        mirrored.as_ref(),
        source.len(),
        is_clear,
    ) {
        return Err(error);
    }
    let free = judged.first().and_then(|best| judge.free_turn(best));
    if frames.is_axial && free.is_none() {
        // the surface breaks the symmetry, at an unknown turn
        return Err(FeaturesError::TooFew {
            side: frames.poor,
            found: frames.found,
        });
    }
    let mut alternatives = judge.settled(judged);
    if let Some(turn) = free {
        let alternatives = turn.distinct(alternatives, SAME * judge.matching.tolerance);
        return Err(FeaturesError::FreeTurn { turn, alternatives });
    }
    match alternatives.len() {
        1 => Ok(alternatives.remove(0)),
        _ => Err(FeaturesError::Ambiguous { alternatives }),
    }
}

/// Reason to refuse the best motion.
fn refusal(
    judge: &Judge<'_>,
    best: Option<&JudgedMotion>,
    mirrored: Option<&JudgedMotion>,
    of: usize,
    is_clear: impl Fn(&JudgedMotion) -> bool,
) -> Option<FeaturesError> {
    let explained = best.map_or(0, |best| best.explained().count());
    if let Some(mirrored) = mirrored.filter(|mirrored| is_clear(mirrored))
        && best.is_none_or(|best| judge.is_better_throughout(mirrored, best))
    {
        return Some(FeaturesError::Mirrored {
            explained,
            mirrored: mirrored.explained().count(),
            of,
        });
    }
    let is_believed = best.is_some_and(is_clear);
    (!is_believed).then(|| FeaturesError::NoMatch {
        explained,
        of,
        agreeing: best.and_then(JudgedMotion::agreeing),
    })
}

/// Twice the largest distance from the mean, m: independent of the place of the shape.
fn size_of(points: impl Iterator<Item = Point3<f64>> + Clone) -> f64 {
    let middle = Point3::from(mean(points.clone().map(|p| p.coords)));
    2.0 * points
        .map(|p| (p - middle).norm())
        .fold(f64::MIN_POSITIVE, f64::max)
}

/// The motions that explain most, the best first, no two alike.
fn candidates(matching: &Matching, frames: &Frames, most: usize) -> Vec<Isometry3<f64>> {
    let mut found = hypotheses(matching, &frames.own, &frames.theirs);
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<(f64, Isometry3<f64>)> = Vec::new();
    let is_new = |kept: &[(f64, Isometry3<f64>)], motion: &Isometry3<f64>| {
        kept.iter()
            .all(|(_, other)| matching.apart(motion, other) > SAME * matching.tolerance)
    };
    for (score, coarse) in found {
        let is_worth = kept
            .first()
            .is_none_or(|(best, _)| score >= 0.8 * CANDIDATE * best);
        if kept.len() >= 2 * most || !is_worth {
            break;
        }
        if !is_new(&kept, &coarse) {
            continue;
        }
        let motion = matching.refined(&coarse);
        if is_new(&kept, &motion) {
            kept.push((matching.score(&motion), motion));
        }
    }
    kept.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = kept.first().map_or(0.0, |(best, _)| CANDIDATE * best);
    kept.into_iter()
        .take(most)
        .filter(|(score, _)| *score >= least)
        .map(|(_, motion)| motion)
        .collect()
}

/// The frames of the features of both sides.
struct Frames {
    own: Vec<Base>,
    theirs: SortedSets,
    /// whether they leave a turn open, as the features of one side fix none
    is_axial: bool,
    /// the side with few features, and their number
    poor: FeaturesSide,
    found: usize,
}

impl Frames {
    fn of(matching: &Matching) -> Result<Self, FeaturesError> {
        let sides = [
            (FeaturesSide::Source, &matching.source),
            (FeaturesSide::Target, &matching.target),
        ];
        let [own, theirs] = [
            bases(&matching.source, false),
            bases(&matching.target, true),
        ];
        let (poor, landmarks) = if own.is_empty() { sides[0] } else { sides[1] };
        let found = landmarks.len();
        if !own.is_empty() && !theirs.is_empty() {
            return Ok(Self {
                own,
                theirs: SortedSets::new(theirs),
                is_axial: false,
                poor,
                found,
            });
        }
        let [own, theirs] = [
            axial_bases(&matching.source, false),
            axial_bases(&matching.target, true),
        ];
        if own.is_empty() || theirs.is_empty() {
            return Err(FeaturesError::TooFew { side: poor, found });
        }
        Ok(Self {
            own,
            theirs: SortedSets::new(theirs),
            is_axial: true,
            poor,
            found,
        })
    }
}

/// Every motion of a frame onto a congruent one, with its score.
fn hypotheses(
    matching: &Matching,
    own: &[Base],
    theirs: &SortedSets,
) -> Vec<(f64, Isometry3<f64>)> {
    let play = 2.0 * matching.tolerance;
    let like = |base| -> Vec<&Base> {
        let base: &Base = base;
        let is_like = |other: &&Base| (0..2).all(|i| matching.is_like(base.of[i], other.of[i]));
        theirs.like(base, play).filter(is_like).collect()
    };
    let tried = own.iter().step_by(own.len().div_ceil(MOST_BASES));
    let mut matches: Vec<(&Base, Vec<&Base>)> = tried.map(|base| (base, like(base))).collect();
    // frames with few matches are the most specific
    matches.sort_by_key(|(_, others)| others.len());
    let most = (MOST_COMPARISONS / matching.cost().max(1)).min(MOST_HYPOTHESES);
    let pairs = matches
        .iter()
        .flat_map(|(base, others)| others.iter().map(|other| base.onto(other)));
    pairs
        .take(most)
        .map(|motion| (matching.score(&motion), motion))
        .collect()
}
