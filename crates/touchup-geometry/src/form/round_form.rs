//! Form of a round wall: roundness, cylindricity, straightness of its axis.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Point2, Point3, SVector, Vector3};

use super::profile::{DesignRow, Estimate, FormPoint, Profile};
use super::zone::{self, axis_straightness, linear_zone};
use crate::numeric::{order_statistic, tangent_basis};

/// A deviation of form, about both references.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// of the narrowest zone (ISO 1101), m
    pub minimum_zone: Estimate,
    /// about the reference of least squares, m
    pub least_squares: Estimate,
}

impl Deviation {
    pub(super) fn of([minimum_zone, least_squares]: [Estimate; 2]) -> Self {
        Self {
            minimum_zone,
            least_squares,
        }
    }
}

/// Form of the touched part of a round wall.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoundForm {
    /// of the mean section
    pub roundness: Deviation,
    /// `None` if all touches are at one height
    pub cylindricity: Option<Deviation>,
    /// of the axis; `None` unless touched at three heights all around
    pub straightness: Option<Deviation>,
    /// touched share of the turn: the form of the rest is unknown
    pub coverage: f64,
    /// maximum number of undulations per turn among the candidates
    pub undulations: u32,
    /// undulations per turn of the lobes found
    pub lobes: Vec<u32>,
}

impl RoundForm {
    /// Roundness of points as they are, seen along an axis; `None` for fewer than 4.
    ///
    /// - `centre`: of the section, m.
    pub fn of_section<'a>(
        points: impl Iterator<Item = &'a Point3<f64>>,
        centre: &Point3<f64>,
        axis: &Vector3<f64>,
    ) -> Option<Self> {
        let [e, g] = tangent_basis(axis);
        let on_plane = |p: &Point3<f64>| Point2::new((p - centre).dot(&e), (p - centre).dot(&g));
        let points: Vec<Point2<f64>> = points.map(on_plane).collect();
        let zone = zone::roundness(&points)?;
        let exact = |value| Estimate { value, std: 0.0 };
        Some(Self {
            roundness: Deviation::of([zone.minimum_zone, zone.least_squares].map(exact)),
            coverage: 1.0,
            ..Self::default()
        })
    }
}

/// Maximum number of undulations per turn: the filter of 15 UPR of ISO 12181-2.
const MOST_UNDULATIONS: u32 = 15;
/// Places of the deviation around a turn: 19 for each of 15 undulations.
const PLACES: usize = 288;
/// Share of the gaps between touches that sets the largest distance of a place from a touch.
const TYPICAL_GAP: f64 = 0.9;
/// Parts of a turn and of the height, each with one place for cylindricity.
const PARTS: [usize; 2] = [48, 5];
/// Least height between touches at several heights, as a share of the radius.
const SEVERAL_HEIGHTS: f64 = 0.1;
/// Least touched share of the turn at the height of a section of the axis.
const SECTION: f64 = 0.5;

/// Kind of a block of terms.
#[derive(Clone, Copy, PartialEq)]
enum Term {
    /// this number of undulations per turn, alike at all heights
    Lobes(u32),
    /// radius by a power of the height
    Radius(i32),
    /// axis by a power of the height
    Axis(i32),
    /// this number of undulations, turning over from one end to the other
    Twisted(u32),
}

impl Term {
    /// All blocks, the longest undulations first.
    fn all() -> Vec<Self> {
        let first = [
            Self::Lobes(2),
            Self::Lobes(3),
            Self::Radius(1),
            Self::Axis(2),
            Self::Radius(2),
        ];
        let then = [
            Self::Lobes(4),
            Self::Lobes(5),
            Self::Twisted(2),
            Self::Twisted(3),
            Self::Axis(3),
        ];
        first
            .into_iter()
            .chain(then)
            .chain((6..=MOST_UNDULATIONS).map(Self::Lobes))
            .collect()
    }

    fn width(self) -> usize {
        if matches!(self, Self::Radius(_)) {
            1
        } else {
            2
        }
    }

    /// Adds the terms of a place at an angle and a height, −1 to 1 over the touched part.
    fn push(self, angle: f64, height: f64, terms: &mut Vec<f64>) {
        let (along, order) = match self {
            Self::Lobes(lobes) => (1.0, lobes),
            Self::Radius(power) => return terms.push(height.powi(power)),
            Self::Axis(power) => (height.powi(power), 1),
            Self::Twisted(lobes) => (height, lobes),
        };
        let (sin, cos) = (f64::from(order) * angle).sin_cos();
        terms.extend([along * cos, along * sin]);
    }
}

/// The terms of the reference: radius, place and direction of the axis.
const REFERENCE: usize = 5;

fn terms(all: &[Term], angle: f64, height: f64) -> Vec<f64> {
    let (sin, cos) = angle.sin_cos();
    let mut terms = vec![1.0, cos, sin, height * cos, height * sin];
    all.iter()
        .for_each(|term| term.push(angle, height, &mut terms));
    terms
}

/// The ranges of the terms behind the reference.
fn blocks(all: &[Term]) -> Vec<Range<usize>> {
    let mut end = REFERENCE;
    let mut block = |term: &Term| {
        end += term.width();
        end - term.width()..end
    };
    all.iter().map(&mut block).collect()
}

/// Points around the axis as rows, and the angle and height of each.
fn rows_of(
    points: &[FormPoint],
    all: &[Term],
    on_axis: &Point3<f64>,
    axis: &Vector3<f64>,
    radius: f64,
) -> (Vec<DesignRow>, Vec<[f64; 2]>, bool) {
    let [u, v] = tangent_basis(axis);
    let along = |p: &FormPoint| axis.dot(&(p.point - on_axis));
    let (low, high) = points
        .iter()
        .map(along)
        .fold((f64::MAX, f64::MIN), |(low, high), z| {
            (low.min(z), high.max(z))
        });
    let is_high = high - low > SEVERAL_HEIGHTS * radius;
    let row = |p: &FormPoint| {
        let (x, y) = (u.dot(&(p.point - on_axis)), v.dot(&(p.point - on_axis)));
        let height = if is_high {
            (2.0 * along(p) - low - high) / (high - low)
        } else {
            0.0
        };
        let angle = y.atan2(x);
        let value = x.hypot(y) - radius;
        (
            DesignRow {
                terms: terms(all, angle, height),
                value,
                sigma: p.sigma,
                group: p.group,
            },
            [angle, height],
        )
    };
    let (rows, places) = points.iter().map(row).unzip();
    (rows, places, is_high)
}

/// Angles all around that are no farther from a touch than touches are from one another, and within
/// a quarter of the shortest undulation.
fn touched_angles(places: &[[f64; 2]], undulations: u32) -> Option<Vec<f64>> {
    let mut angles: Vec<f64> = places
        .iter()
        .map(|[angle, _]| angle.rem_euclid(TAU))
        .collect();
    angles.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = angles.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let between = order_statistic(&mut gaps, TYPICAL_GAP)?;
    let near = between
        .max(TAU / (2 * PLACES) as f64)
        .min(TAU / (4.0 * f64::from(undulations)));
    let is_touched = |angle: &f64| {
        let at = angles.partition_point(|other| other < angle);
        let around = [
            at.checked_sub(1).unwrap_or(angles.len() - 1),
            at % angles.len(),
        ];
        around.iter().any(|&i| {
            let off = (angles[i] - angle).abs();
            off.min(TAU - off) <= near
        })
    };
    Some(
        (0..PLACES)
            .map(|i| TAU * i as f64 / PLACES as f64)
            .filter(is_touched)
            .collect(),
    )
}

/// Form of a round wall; `None` if the points do not determine it.
///
/// - `on_axis`, `axis`: of the fitted cylinder, m and a unit vector, in O; `radius`: its, m.
pub fn round_form(
    points: &[FormPoint],
    on_axis: &Point3<f64>,
    axis: &Vector3<f64>,
    radius: f64,
) -> Option<RoundForm> {
    let all = Term::all();
    let (rows, places, is_high) = rows_of(points, &all, on_axis, axis, radius);
    let profile = Profile::of(&rows, REFERENCE, blocks(&all))?;
    let lobes = |&number: &usize| {
        if let Term::Lobes(lobes) = all[number] {
            Some(lobes)
        } else {
            None
        }
    };
    let undulations = profile.sought.iter().filter_map(lobes).max()?;
    let around = touched_angles(&places, undulations)?;
    Some(RoundForm {
        roundness: roundness(&profile, &all, &around)?,
        cylindricity: if is_high {
            cylindricity(&profile, &all, &places)
        } else {
            None
        },
        straightness: if is_high {
            straightness(&profile, &all, &places)
        } else {
            None
        },
        coverage: around.len() as f64 / PLACES as f64,
        undulations,
        lobes: profile.found.iter().filter_map(lobes).collect(),
    })
}

/// Roundness from the terms alike at all heights, at the touched angles.
fn roundness(profile: &Profile, all: &[Term], around: &[f64]) -> Option<Deviation> {
    let section: Vec<Vec<f64>> = around.iter().map(|&angle| terms(all, angle, 0.0)).collect();
    let circle: Vec<SVector<f64, 4>> = section
        .iter()
        .map(|place| SVector::from([place[0], place[1], place[2], 0.0]))
        .collect();
    let sizes = profile.sizes(
        |number| matches!(all[number], Term::Lobes(_)),
        &section,
        |values| linear_zone(&circle, values).map(|zone| [zone.minimum_zone, zone.least_squares]),
    );
    sizes.map(Deviation::of)
}

/// Part of the turn and of the height of a place.
fn part_of([angle, height]: &[f64; 2]) -> [usize; 2] {
    let turn = angle.rem_euclid(TAU) / TAU;
    let part = |share: f64, parts: usize| ((share * parts as f64) as usize).min(parts - 1);
    [part(turn, PARTS[0]), part((height + 1.0) / 2.0, PARTS[1])]
}

/// Cylindricity from all terms, in the middle of the turn of each part of the wall, at its touched
/// height farthest from half the height.
fn cylindricity(profile: &Profile, all: &[Term], places: &[[f64; 2]]) -> Option<Deviation> {
    let mut of_part: Vec<Option<[f64; 2]>> = vec![None; PARTS[0] * PARTS[1]];
    for place in places {
        let [turn, height] = part_of(place);
        let known = &mut of_part[turn * PARTS[1] + height];
        if known.is_none_or(|known| place[1].abs() > known[1].abs()) {
            *known = Some([TAU * (turn as f64 + 0.5) / PARTS[0] as f64, place[1]]);
        }
    }
    let wall: Vec<Vec<f64>> = of_part
        .iter()
        .flatten()
        .map(|[angle, height]| terms(all, *angle, *height))
        .collect();
    let cylinder: Vec<SVector<f64, 6>> = wall
        .iter()
        .map(|place| SVector::from([place[0], place[1], place[2], place[3], place[4], 0.0]))
        .collect();
    let sizes = profile.sizes(
        |_| true,
        &wall,
        |values| linear_zone(&cylinder, values).map(|zone| [zone.minimum_zone, zone.least_squares]),
    );
    sizes.map(Deviation::of)
}

/// Straightness from the terms that shift sections, at heights touched around enough of the turn.
fn straightness(profile: &Profile, all: &[Term], places: &[[f64; 2]]) -> Option<Deviation> {
    let is_axis = |number: usize| matches!(all[number], Term::Axis(_));
    if !profile.has_sought(is_axis) {
        return None;
    }
    let heights: Vec<f64> = (0..PARTS[1])
        .filter_map(|part| {
            let here: Vec<&[f64; 2]> = places
                .iter()
                .filter(|place| part_of(place)[1] == part)
                .collect();
            let mut turn = [false; PARTS[0]];
            here.iter().for_each(|place| turn[part_of(place)[0]] = true);
            let is_section =
                turn.iter().filter(|is| **is).count() as f64 > SECTION * PARTS[0] as f64;
            let outermost = here
                .iter()
                .map(|place| place[1])
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            outermost.filter(|_| is_section)
        })
        .collect();
    if heights.len() < 3 {
        return None;
    }
    // a shifted section is farther out by its x towards angle 0, by its y a quarter of a turn on
    let both = heights
        .iter()
        .flat_map(|&height| [(0.0, height), (TAU / 4.0, height)]);
    let middles: Vec<Vec<f64>> = both
        .map(|(angle, height)| terms(all, angle, height))
        .collect();
    let sizes = profile.sizes(is_axis, &middles, |values| {
        // the height in its own units: only its proportions matter
        let middle = |(xy, height): (&[f64], &f64)| Point3::new(xy[0], xy[1], *height);
        let middles: Vec<Point3<f64>> = values.chunks(2).zip(&heights).map(middle).collect();
        axis_straightness(&middles).map(|zone| [zone.minimum_zone, zone.least_squares])
    });
    sizes.map(Deviation::of)
}
