//! Connected regions of disagreement, and their classes.

use nalgebra::{Point3, Vector3};

use super::places::{Class, Places, RefinedShape};
use super::scanner::Scanner;
use crate::mesh::{TriMesh, VertexId};
use crate::numeric::{PointGrid, flood};
use crate::stylus::ProbedPoint;

/// The evidence for the class of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionEvidence {
    /// how far its mean is from what the scanner is off everywhere, in standard deviations of such
    /// a mean
    pub sigmas: f64,
    /// area that the scanner should have seen well, m²
    pub open_area: f64,
    /// its extent over the correlation length of the scanner's error
    pub lengths: f64,
    /// times that it was passed by the tip
    pub passes: usize,
    /// share of its rim that lies at edges of the refined surface
    pub edges: f64,
}

/// A region in which touch and scan disagree.
#[derive(Clone, Debug, PartialEq)]
pub struct DisagreementRegion {
    /// what it is
    pub class: Class,
    /// mean place, m
    pub centre: Point3<f64>,
    /// m²
    pub area: f64,
    /// mean of touch − scan, m: over the places that the scanner should have seen well, or over all
    /// where there are none
    pub mean: f64,
    /// why
    pub evidence: RegionEvidence,
}

/// What regions are found in.
pub(super) struct RegionInput<'a> {
    pub refined: &'a RefinedShape<'a>,
    pub places: &'a Places,
    pub scanner: &'a Scanner,
    pub touches: &'a [ProbedPoint],
}

/// A region is of places whose surroundings are off by so many standard deviations.
const OFF: f64 = 1.5;
/// A mean that is off by more than this is no error of the scanner: with 50 independent places by
/// chance once in 35 000.
const CHANGED: f64 = 5.0;
/// From here on it may be either.
const UNSURE: f64 = 3.5;
/// A change that only one pass measured is not sure.
const PASSES: usize = 2;
/// Touches later than this are of another pass, ns.
const PASS_NS: i64 = 1_000_000_000;
/// Regions smaller than this are not reported, over the square of the scan's edges.
const LEAST_AREA: f64 = 1.0;
/// A region grows to places that are off by this share of its mean.
const GOES_ON: f64 = 0.5;
/// Neighbours in a mean have normals alike within 37°.
const ALIKE: f64 = 0.8;

/// Finds the regions, and gives their classes to the places in them.
pub(super) fn find(seen: &RegionInput<'_>, classes: &mut [Class]) -> Vec<DisagreementRegion> {
    let (mesh, places, scanner) = (seen.refined.shape.mesh, seen.places, seen.scanner);
    let smooth = smoothed(mesh, places, scanner);
    let sign = |at: usize| match (smooth[at] - scanner.offset) / scanner.noise {
        z if z > OFF && is_evidence(places, at, 0) => 1i8,
        z if z < -OFF && is_evidence(places, at, 1) => -1,
        _ => 0,
    };
    let signs: Vec<i8> = (0..smooth.len()).map(sign).collect();
    let mut is_taken = vec![false; smooth.len()];
    let mut regions = Vec::new();
    for start in (0..smooth.len()).filter(|&at| signs[at] != 0) {
        if is_taken[start] {
            continue;
        }
        is_taken[start] = true;
        let is_own =
            |at: usize| signs[at] == signs[start] && !std::mem::replace(&mut is_taken[at], true);
        let own = flood(vec![start], |at| neighbours(mesh, at), is_own);
        regions.extend(judged(seen, &own, classes));
    }
    regions.sort_by(|a, b| b.area.total_cmp(&a.area));
    regions
}

/// Whether a disagreement is evidence of a change, and not of what the scanner cannot see: the scan
/// too low, `side` 0, or too high, 1.
fn is_evidence(places: &Places, at: usize, side: usize) -> bool {
    places.is_open[at] || (places.is_wide[at] && !places.may_be[at][side])
}

/// Means over the surroundings, m, by slot: of open places over open ones, of others over all that
/// are wide.
fn smoothed(mesh: &TriMesh, places: &Places, scanner: &Scanner) -> Vec<f64> {
    let reach = scanner.correlation / 2.0;
    let cells = |is_own: &[bool]| {
        PointGrid::of(
            &places.positions,
            (0..places.off.len()).filter(|&at| is_own[at]),
            reach,
        )
    };
    let [open, wide] = [&places.is_open, &places.is_wide].map(|is_own| cells(is_own));
    let mean = |at: usize| {
        let near =
            if places.is_open[at] { &open } else { &wide }.near(&mesh.positions()[at], reach);
        let alike = near.filter(|&other| places.normals[at].dot(&places.normals[other]) > ALIKE);
        let (sum, area) = alike.fold((0.0, f64::MIN_POSITIVE), |(sum, area), other| {
            (
                sum + places.off[other] * places.areas[other],
                area + places.areas[other],
            )
        });
        sum / area
    };
    (0..places.off.len())
        .map(|at| {
            if places.is_wide[at] {
                mean(at)
            } else {
                places.off[at]
            }
        })
        .collect()
}

fn neighbours(mesh: &TriMesh, at: usize) -> impl Iterator<Item = usize> + '_ {
    mesh.star(VertexId(at as u32))
        .iter()
        .flat_map(|&face| mesh.corners(face))
        .map(|v| v.0 as usize)
}

/// Area, m², and mean of touch − scan, m, of some places.
fn mean_of(places: &Places, own: impl Iterator<Item = usize>) -> (f64, f64) {
    let (area, sum) = own.fold((0.0, 0.0), |(area, sum), at| {
        (
            area + places.areas[at],
            sum + places.off[at] * places.areas[at],
        )
    });
    (area, sum / area)
}

/// What a region is, if it is worth telling; its places get its class.
fn judged(
    seen: &RegionInput<'_>,
    own: &[usize],
    classes: &mut [Class],
) -> Option<DisagreementRegion> {
    let (mesh, places, scanner) = (seen.refined.shape.mesh, seen.places, seen.scanner);
    let is_open = |at: &usize| places.is_open[*at];
    let (own_area, own_mean) = mean_of(places, own.iter().copied());
    let (open_area, open_mean) = mean_of(places, own.iter().copied().filter(is_open));
    if !own_mean.is_finite() || own_area < LEAST_AREA * scanner.edge.powi(2) {
        return None;
    }
    let sigmas_of =
        |area: f64, mean: f64| (mean - scanner.offset).abs() / scanner.sigma_of_mean(area);
    let sigmas = sigmas_of(own_area, own_mean);
    // what lies at edges alone makes nothing sure
    let is_sure = open_area >= LEAST_AREA * scanner.edge.powi(2)
        && sigmas_of(open_area, open_mean) >= CHANGED;
    // on to the edges that it ends at, which the scanner rounds
    let reach = places.edges.reach();
    let near = PointGrid::of(&places.positions, own.iter().copied(), reach);
    let is_off = |at: usize| {
        let [off, mean] = [places.off[at], own_mean].map(|off| off - scanner.offset);
        off * mean.signum() > (GOES_ON * mean.abs()).max(2.0 * scanner.noise)
    };
    let goes_on = |at: usize| {
        places.is_seen[at] && is_off(at) && near.near(&places.positions[at], reach).next().is_some()
    };
    let mut is_taken = vec![false; places.off.len()];
    own.iter().for_each(|&at| is_taken[at] = true);
    let is_new =
        |at: usize| !is_taken[at] && goes_on(at) && !std::mem::replace(&mut is_taken[at], true);
    let all = flood(own.to_vec(), |at| neighbours(mesh, at), is_new);
    // it has grown to edges that the scanner rounds: these add to its area, and say nothing of how
    // far the part was changed
    let (area, all_mean) = mean_of(places, all.iter().copied());
    let mean = if open_area > 0.0 { open_mean } else { all_mean };
    let moments = all
        .iter()
        .map(|&at| places.positions[at].coords * places.areas[at]);
    let centre = Point3::from(moments.sum::<Vector3<f64>>() / area);
    let extent = all
        .iter()
        .map(|&at| (places.positions[at] - centre).norm())
        .fold(0.0, f64::max);
    let evidence = RegionEvidence {
        sigmas,
        open_area,
        lengths: 2.0 * extent / scanner.correlation,
        passes: passes(seen.touches, &near, reach / 3.0),
        edges: rim_at_edges(mesh, places, &all, &is_taken),
    };
    let class = match sigmas {
        _ if sigmas < UNSURE => Class::ScannerError,
        _ if !is_sure || evidence.passes < PASSES || evidence.lengths < 1.0 => Class::Unsure,
        _ => Class::ChangedPart,
    };
    if class != Class::ScannerError {
        all.iter().for_each(|&at| classes[at] = class);
    }
    Some(DisagreementRegion {
        class,
        centre,
        area,
        mean,
        evidence,
    })
}

/// Largest number of times that any place of a region was passed.
fn passes(touches: &[ProbedPoint], region: &PointGrid, reach: f64) -> usize {
    let (mut count, mut last) = (0, None);
    for touch in touches.iter().filter(|touch| !touch.is_rejected) {
        if region.near(&touch.point, reach).next().is_some() {
            let is_new = last.is_none_or(|(stroke, at)| {
                stroke != touch.stroke || touch.stamp_ns.saturating_sub(at) > PASS_NS
            });
            count += usize::from(is_new);
            last = Some((touch.stroke, touch.stamp_ns));
        }
    }
    count
}

/// Share of the places at the rim of a region that have an edge near.
fn rim_at_edges(mesh: &TriMesh, places: &Places, all: &[usize], is_own: &[bool]) -> f64 {
    let rim: Vec<usize> = all
        .iter()
        .copied()
        .filter(|&at| neighbours(mesh, at).any(|other| !is_own[other]))
        .collect();
    let at_edge = rim
        .iter()
        .filter(|&&at| places.edges.is_near(&places.positions[at]))
        .count();
    at_edge as f64 / rim.len().max(1) as f64
}
