//! Connected regions of disagreement, and their classes.

use nalgebra::{Point3, Vector3};

use super::places::{Class, RefinedShape, VertexProperties};
use super::scanner::Scanner;
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_geometry::numeric::{PointGrid, flood};
use touchup_method::stylus::ProbedPoint;

/// The evidence for the class of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionEvidence {
    /// distance of its mean from the scanner's offset, in standard deviations of such a mean
    pub sigmas: f64,
    /// area that the scanner should see well, m²
    pub open_area: f64,
    /// its extent over the correlation length of the scanner's error
    pub lengths: f64,
    /// number of passes of the tip
    pub passes: usize,
    /// share of its rim at edges of the refined surface
    pub edges: f64,
}

/// A region of disagreement between touch and scan.
#[derive(Clone, Debug, PartialEq)]
pub struct DisagreementRegion {
    /// its class
    pub class: Class,
    /// mean place, m
    pub centre: Point3<f64>,
    /// m²
    pub area: f64,
    /// mean of touch − scan, m: over the places that the scanner should see well, or over all if
    /// there are none
    pub mean: f64,
    /// evidence for the class
    pub evidence: RegionEvidence,
}

/// Inputs of the search for regions.
pub(super) struct RegionInput<'a> {
    pub refined: &'a RefinedShape<'a>,
    pub places: &'a VertexProperties,
    pub scanner: &'a Scanner,
    pub touches: &'a [ProbedPoint],
}

/// Minimum mean disagreement around a place of a region, in standard deviations.
const OFF: f64 = 1.5;
/// Minimum mean of a change, in standard deviations: with 50 independent places a chance of one in
/// 35 000.
const CHANGED: f64 = 5.0;
/// Minimum mean of an unsure region, in standard deviations.
const UNSURE: f64 = 3.5;
/// Minimum number of passes for a sure change.
const PASSES: usize = 2;
/// Minimum pause between two passes, ns.
const PASS_NS: i64 = 1_000_000_000;
/// Minimum area of a reported region, in squares of the scan's edges.
const LEAST_AREA: f64 = 1.0;
/// Minimum disagreement for growth of a region, as a share of its mean.
const GOES_ON: f64 = 0.5;
/// Minimum cosine between similar normals in a mesh: 37°.
const ALIKE: f64 = 0.8;

/// Finds the regions, and assigns their classes to their places.
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

/// Whether a disagreement is evidence of a change, not of limited visibility: the scan too low,
/// `side` 0, or too high, 1.
fn is_evidence(places: &VertexProperties, at: usize, side: usize) -> bool {
    places.is_open[at] || (places.is_wide[at] && !places.may_be[at][side])
}

/// Means over the surroundings, m, by slot: for open places over open ones, for others over all
/// wide ones.
fn smoothed(mesh: &TriMesh, places: &VertexProperties, scanner: &Scanner) -> Vec<f64> {
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
fn mean_of(places: &VertexProperties, own: impl Iterator<Item = usize>) -> (f64, f64) {
    let (area, sum) = own.fold((0.0, 0.0), |(area, sum), at| {
        (
            area + places.areas[at],
            sum + places.off[at] * places.areas[at],
        )
    });
    (area, sum / area)
}

/// A reportable region with its class; its places get the class too.
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
    // places at edges alone make nothing sure
    let is_sure = open_area >= LEAST_AREA * scanner.edge.powi(2)
        && sigmas_of(open_area, open_mean) >= CHANGED;
    // on to the edges at its border, which the scanner rounds
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
    // growth to rounded edges adds to its area, but tells nothing about the size of the change
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

/// Largest number of passes over any place of a region.
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

/// Share of the places at the rim of a region with an edge nearby.
fn rim_at_edges(mesh: &TriMesh, places: &VertexProperties, all: &[usize], is_own: &[bool]) -> f64 {
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
