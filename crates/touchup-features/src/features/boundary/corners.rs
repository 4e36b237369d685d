//! The places in which chains end.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::curves::MeetingCurve;
use super::graph::RegionGraph;
use super::polyline::length_of;
use super::scale::BoundaryScale;
use super::settle::{PlaceCondition, farthest, settled};
use super::surfaces::PartSurfaces;
use touchup_geometry::brep::{AnalyticSurface, SpaceCurve};
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_geometry::numeric::{DisjointSets, distinct, mean};

/// Maximum distance from a corner of the mesh to that of the surfaces, in reaches of curves: a
/// blurred corner is off by more than its edges.
const FAR_CORNER: f64 = 2.0;

/// Junctions of chains; a short chain may join two of them.
pub(super) struct CornerPlaces {
    /// number of the corner at each end of chains, by vertex of the mesh
    pub of_vertex: BTreeMap<u32, usize>,
    /// place on all surfaces of the corner, m, and its largest distance from one; `None` without
    /// one
    pub places: Vec<Option<(Point3<f64>, f64)>>,
}

struct CornerSearch<'a> {
    mesh: &'a TriMesh,
    surfaces: &'a PartSurfaces,
    graph: &'a RegionGraph,
    curves: &'a [Option<MeetingCurve>],
    reach: f64,
}

impl CornerPlaces {
    /// - `curves`: of each chain.
    pub(super) fn of(
        mesh: &TriMesh,
        surfaces: &PartSurfaces,
        graph: &RegionGraph,
        curves: &[Option<MeetingCurve>],
        scale: &BoundaryScale,
    ) -> Self {
        let search = CornerSearch {
            mesh,
            surfaces,
            graph,
            curves,
            reach: scale.reach,
        };
        let ends = graph.chains.iter().filter_map(|chain| chain.ends());
        let vertices = distinct(ends.flatten());
        let number_of = |vertex: u32| vertices.binary_search(&vertex).unwrap_or_default();
        let mut sets = DisjointSets::of(vertices.len());
        let members = |sets: &mut DisjointSets, roots: &[u32]| -> Vec<u32> {
            let all = 0..vertices.len();
            let of_roots = all.filter(|&at| roots.contains(&sets.root(at as u32)));
            of_roots.map(|at| vertices[at]).collect()
        };
        for [a, b] in search.short_chains(scale.short) {
            let roots = [a, b].map(|vertex| sets.root(number_of(vertex) as u32));
            if roots[0] != roots[1] && search.place(&members(&mut sets, &roots)).is_some() {
                sets.join(roots[0], roots[1]);
            }
        }
        let roots: Vec<u32> = (0..vertices.len()).map(|at| sets.root(at as u32)).collect();
        let corners = distinct(roots.iter().copied());
        let place = |&root: &u32| search.place(&members(&mut sets, &[root]));
        let places = corners.iter().map(place).collect();
        let number = |root: &u32| corners.binary_search(root).unwrap_or_default();
        let of_vertex = vertices.iter().copied().zip(roots.iter().map(number));
        Self {
            of_vertex: of_vertex.collect(),
            places,
        }
    }
}

impl CornerSearch<'_> {
    /// Ends of chains no longer than this, the shortest first.
    fn short_chains(&self, short: f64) -> Vec<[u32; 2]> {
        let chains = self.graph.chains.iter();
        let ended =
            chains.filter_map(|chain| Some((length_of(&chain.points(self.mesh)), chain.ends()?)));
        let mut known: Vec<(f64, [u32; 2])> =
            ended.filter(|(length, _)| *length <= short).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        known.into_iter().map(|(_, ends)| ends).collect()
    }

    /// The place of all surfaces around some vertices of the mesh, and its largest distance from
    /// one; `None` without one nearby.
    fn place(&self, vertices: &[u32]) -> Option<(Point3<f64>, f64)> {
        let is_here = |ends: [u32; 2]| ends.iter().any(|end| vertices.contains(end));
        let chains = self.graph.chains.iter().zip(self.curves);
        let here: Vec<_> = chains
            .filter(|(chain, _)| chain.ends().is_some_and(is_here))
            .collect();
        let surface_of = |region: usize| self.graph.regions[region].surface;
        let sides =
            |chain: &super::graph::BorderChain| chain.sides.map(|side| side.map(surface_of));
        let all = distinct(here.iter().flat_map(|(chain, _)| sides(chain)).flatten());
        let (mut conditions, mut touching) = (Vec::new(), Vec::new());
        for (chain, curve) in &here {
            if let Some(MeetingCurve {
                curve: SpaceCurve::Line { origin, direction },
                is_tangent: true,
            }) = curve
            {
                conditions.push(PlaceCondition::Along(*origin, *direction));
                touching.extend(sides(chain).into_iter().flatten());
            }
        }
        let surface = |number: &usize| &self.surfaces.all[*number].surface;
        let others = all.iter().filter(|number| !touching.contains(number));
        conditions.extend(others.map(|number| PlaceCondition::On(surface(number))));
        let positions = vertices.iter().map(|&v| self.mesh.position(VertexId(v)));
        let start = Point3::from(mean(positions.map(|p| p.coords)));
        let place = settled(&conditions, &start);
        let tolerances = all
            .iter()
            .map(|number| self.surfaces.all[*number].tolerance);
        let gap = tolerances.fold(0.0, f64::max);
        let all: Vec<&AnalyticSurface> = all.iter().map(surface).collect();
        let is_near = (place - start).norm() <= FAR_CORNER * self.reach;
        let off = farthest(&all, &place);
        (is_near && off <= gap).then_some((place, off))
    }
}
