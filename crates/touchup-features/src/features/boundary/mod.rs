//! The boundary of a part: faces trimmed by the curves in which their surfaces meet.
//!
//! [`labels()`] gives each face of the mesh to one surface, over the blurred strips
//! beside edges too; a [`RegionGraph`] has the borders of the regions as chains between junctions.
//! The curve of both surfaces beside a chain replaces it, the place on all surfaces around a
//! junction is a corner, and a border on unexplained mesh stays an edge of its region alone, on its
//! surface. A face whose loops cross gives up the mesh around the crossing; one that is not sound
//! is left out and counted.

mod corners;
mod crossings;
mod curves;
mod faces;
mod graph;
mod labels;
mod polyline;
mod scale;
mod settle;
mod soundness;
mod surfaces;
mod trimming;

use super::measure::Measure;
use super::segmentation::facets::NONE;
use corners::CornerPlaces;
use curves::meeting;
use faces::face_of;
use graph::{BorderChain, LabelledRegion, RegionGraph};
use labels::{clean, labels};
use scale::BoundaryScale;
use soundness::{FaceFault, sound};
use surfaces::PartSurfaces;
use touchup_geometry::brep::Brep;
use touchup_geometry::mesh::FaceId;
use trimming::Trimming;

pub(super) use surfaces::PartFeatures;

/// Trimmed faces of a part.
#[derive(Clone, Debug, PartialEq)]
pub struct PartBoundary {
    /// `None` without a sound face
    pub brep: Option<Brep>,
    /// number of regions of one surface without a sound face
    pub left_out: usize,
}

/// Maximum number of rounds in which faces at fault give up mesh, and of those in which they give up
/// no more than the mesh around the fault.
const MOST_ROUNDS: u8 = 64;
const MOST_CUTS: u8 = 6;

/// The boundary of a measured mesh.
pub(super) fn boundary(measure: &Measure, of_part: &PartFeatures) -> PartBoundary {
    let parted = measure.observed.parted;
    let scale = BoundaryScale::of(measure);
    let surfaces = PartSurfaces::of(measure, of_part, scale.reach);
    let mut labels = labels(parted, &surfaces, &scale);
    let all = RegionGraph::of(&parted.facets, &labels).regions;
    let mut brep = None;
    for round in 0..MOST_ROUNDS {
        let graph = RegionGraph::of(&parted.facets, &labels);
        let faults = match trimmed(measure, &surfaces, &graph, &scale) {
            Ok(found) => {
                brep = Some(found);
                break;
            }
            Err(faults) => faults,
        };
        let reach = scale.width * f64::from(1 + round) / 2.0;
        for FaceFault { region, place } in &faults {
            let place = place.filter(|_| round < MOST_CUTS);
            let is_at_fault = |face: &&u32| {
                let off = place.map(|p| (parted.facets.mesh.barycentre(FaceId(**face)) - p).norm());
                off.is_none_or(|off| off <= reach)
            };
            let faces = &graph.regions[*region].faces;
            let mut at_fault = faces.iter().filter(is_at_fault).peekable();
            let rest = if at_fault.peek().is_none() {
                &faces[..]
            } else {
                &[]
            };
            at_fault
                .chain(rest)
                .for_each(|&face| labels[face as usize] = NONE);
        }
        if faults.is_empty() {
            break;
        }
        clean(&parted.facets, &mut labels, scale.least_area);
    }
    let is_left_out = |region: &&LabelledRegion| {
        let mut faces = region.faces.iter();
        faces.all(|&face| labels[face as usize] == NONE)
    };
    PartBoundary {
        left_out: all.iter().filter(is_left_out).count(),
        brep,
    }
}

/// All faces, or those that are not sound.
fn trimmed(
    measure: &Measure,
    surfaces: &PartSurfaces,
    graph: &RegionGraph,
    scale: &BoundaryScale,
) -> Result<Brep, Vec<FaceFault>> {
    let mesh = measure.observed.parted.facets.mesh;
    let curve = |chain: &BorderChain| {
        let surface = |region: usize| &surfaces.all[graph.regions[region].surface];
        let pair = [chain.sides[0]?, chain.sides[1]?].map(surface);
        meeting(pair, &chain.points(mesh), scale)
    };
    let curves: Vec<_> = graph.chains.iter().map(curve).collect();
    let corners = CornerPlaces::of(mesh, surfaces, graph, &curves, scale);
    let mut trimming = Trimming::of(mesh, surfaces, graph, &curves, &corners, scale);
    let (mut faces, mut faults) = (Vec::new(), Vec::new());
    for (region, loops) in graph.loops.iter().enumerate() {
        let edges = loops
            .iter()
            .map(|uses| trimming.loop_edges(region, uses))
            .collect::<Option<Vec<_>>>();
        let Some(mut edges) = edges else {
            faults.push(FaceFault {
                region,
                place: None,
            });
            continue;
        };
        edges.retain(|edges| !edges.is_empty());
        let surface = &surfaces.all[graph.regions[region].surface];
        faces.push(face_of(&mut trimming.parts, surface, region, edges));
    }
    if !faults.is_empty() || faces.is_empty() {
        return Err(faults);
    }
    let mut parts = trimming.parts;
    parts.faces = faces;
    sound(parts)
}
