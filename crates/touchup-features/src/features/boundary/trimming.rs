//! The faces of all regions, trimmed by the curves of their chains.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::corners::CornerPlaces;
use super::curves::{MeetingCurve, advance, tolerance_of, traced};
use super::graph::{ChainUse, RegionGraph};
use super::polyline::{is_beside, length_of, smoothed};
use super::scale::BoundaryScale;
use super::settle::{farthest, on_all};
use super::surfaces::{PartSurface, PartSurfaces};
use touchup_geometry::brep::{AnalyticSurface, BrepParts, OrientedEdge, SpaceCurve};
use touchup_geometry::mesh::{TriMesh, VertexId};

/// Maximum distance of an edge from its chain, in reaches.
const FAR_EDGE: f64 = 2.0;
/// Maximum difference between the lengths of an edge and its chain, as a share: a chain zigzags.
const LONGER: f64 = 0.5;
/// Distance between two vertices of a corner that are one, m.
const SAME: f64 = 1e-6;
/// Maximum distance of a corner from a curve of two of its surfaces, in its distance from these.
const OF_CORNER: f64 = 3.0;
/// Cosine of the turn of a border at a corner: of a drawing 20°, of a scan 60°.
const CORNER: f64 = 0.94;
const SCANNED_CORNER: f64 = 0.5;

/// Edges of one chain in its direction.
#[derive(Clone, Debug)]
struct CommonEdges {
    edges: Vec<OrientedEdge>,
    /// vertices at both ends
    ends: [usize; 2],
}

/// Makes the edges of loops.
pub(super) struct Trimming<'a> {
    pub mesh: &'a TriMesh,
    pub surfaces: &'a PartSurfaces,
    pub graph: &'a RegionGraph,
    pub curves: &'a [Option<MeetingCurve>],
    pub corners: &'a CornerPlaces,
    pub scale: &'a BoundaryScale,
    pub parts: BrepParts,
    /// of chains between two surfaces that meet
    common: Vec<Option<CommonEdges>>,
    /// vertex of each corner with one place
    shared: Vec<Option<usize>>,
    /// vertices of others, by corner
    own: BTreeMap<usize, Vec<usize>>,
}

/// One chain of a loop, in the direction of the loop.
struct LoopChain {
    chain_use: ChainUse,
    /// vertices at its ends, and its edges; `None`: a border of the region alone
    common: Option<CommonEdges>,
}

impl<'a> Trimming<'a> {
    pub(super) fn of(
        mesh: &'a TriMesh,
        surfaces: &'a PartSurfaces,
        graph: &'a RegionGraph,
        curves: &'a [Option<MeetingCurve>],
        corners: &'a CornerPlaces,
        scale: &'a BoundaryScale,
    ) -> Self {
        let mut parts = BrepParts::default();
        let places = corners.places.iter();
        let shared = places
            .map(|place| place.map(|(place, _)| parts.vertex(place)))
            .collect();
        let mut trimming = Self {
            mesh,
            surfaces,
            graph,
            curves,
            corners,
            scale,
            parts,
            common: Vec::new(),
            shared,
            own: BTreeMap::new(),
        };
        for chain in 0..graph.chains.len() {
            let common = trimming.common_edges(chain);
            trimming.common.push(common);
        }
        trimming
    }

    fn part_surface(&self, region: usize) -> &'a PartSurface {
        &self.surfaces.all[self.graph.regions[region].surface]
    }

    fn surface(&self, region: usize) -> &'a AnalyticSurface {
        &self.part_surface(region).surface
    }

    /// Edges of the curve of a chain; `None` without a curve.
    fn common_edges(&mut self, number: usize) -> Option<CommonEdges> {
        let (chain, curve) = (&self.graph.chains[number], self.curves[number].as_ref()?);
        let points = chain.points(self.mesh);
        let is_along = advance(&curve.curve, &points) >= 0.0;
        let Some(ends) = chain.ends() else {
            let ring = self.parts.ring(&curve.curve);
            let vertex = self.parts.edges[ring.edge].start;
            let edges = vec![if is_along { ring } else { ring.reversed() }];
            return Some(CommonEdges {
                edges,
                ends: [vertex; 2],
            });
        };
        let surfaces = [chain.sides[0]?, chain.sides[1]?].map(|region| self.part_surface(region));
        let pair = surfaces.map(|one| &one.surface);
        let corners = ends.map(|vertex| self.corners.of_vertex[&vertex]);
        let is_point = corners[0] == corners[1] && length_of(&points) <= self.scale.reach;
        let place = |end: usize| {
            let vertex = self.mesh.position(VertexId(ends[end]));
            on_all(&pair, &vertex).0
        };
        let shared = corners.map(|corner| self.shared[corner]);
        let off = corners.map(|corner| self.corners.places[corner].map_or(0.0, |(_, off)| off));
        let places = [0, 1].map(|end| match shared[end] {
            Some(vertex) => self.parts.vertices[vertex],
            None => place(end),
        });
        let gap = tolerance_of(surfaces).max(OF_CORNER * off[0].max(off[1]));
        if !is_point && !self.is_sound(&curve.curve, places, &points, is_along, (pair, gap)) {
            return None;
        }
        let start = shared[0].unwrap_or_else(|| self.vertex_at(corners[0], places[0]));
        if is_point {
            return Some(CommonEdges {
                edges: Vec::new(),
                ends: [start; 2],
            });
        }
        let end = shared[1].unwrap_or_else(|| self.vertex_at(corners[1], places[1]));
        let edge = if is_along || matches!(curve.curve, SpaceCurve::Line { .. }) {
            self.parts.edge(&curve.curve, start, end)
        } else {
            self.parts.edge(&curve.curve, end, start).reversed()
        };
        Some(CommonEdges {
            edges: vec![edge],
            ends: [start, end],
        })
    }

    /// Whether the part of a curve between two places is on both surfaces and beside the chain.
    fn is_sound(
        &self,
        curve: &SpaceCurve,
        [from, to]: [Point3<f64>; 2],
        points: &[Point3<f64>],
        is_along: bool,
        (pair, gap): ([&AnalyticSurface; 2], f64),
    ) -> bool {
        if let SpaceCurve::Line { .. } = curve {
            let along = points[points.len() - 1] - points[0];
            if (to - from).dot(&along) <= 0.0 {
                return false;
            }
        }
        let (from, to) = if is_along { (from, to) } else { (to, from) };
        let trimmed = curve.trimmed(&from, &to);
        let is_on_curve = |p: &Point3<f64>| trimmed.distance(p) <= gap;
        let is_of_chain = |p: &Point3<f64>| {
            farthest(&pair, p) <= gap && is_beside(points, p, FAR_EDGE * self.scale.reach)
        };
        let edge = trimmed.points(&from, &to);
        let lengths = [length_of(&edge), length_of(points)];
        (lengths[0] - lengths[1]).abs() <= LONGER * lengths[1] + 2.0 * self.scale.reach
            && [from, to].iter().all(is_on_curve)
            && edge.iter().all(is_of_chain)
    }

    /// The edges of one loop; empty if all of it is one corner. `None`: a border that is no curve.
    pub(super) fn loop_edges(
        &mut self,
        region: usize,
        uses: &[ChainUse],
    ) -> Option<Vec<OrientedEdge>> {
        if let [one] = uses
            && self.common[one.chain].is_none()
            && self.graph.chains[one.chain].is_closed
        {
            return self.closed_border(region, *one);
        }
        let steps: Vec<LoopChain> = uses.iter().map(|one| self.step_of(*one)).collect();
        let mut edges = Vec::new();
        let count = steps.len();
        for at in 0..count {
            let (before, step, after) = (
                &steps[(at + count - 1) % count],
                &steps[at],
                &steps[(at + 1) % count],
            );
            match &step.common {
                Some(common) => {
                    edges.extend(&common.edges);
                    // the next one begins elsewhere
                    if let Some(next) = &after.common
                        && next.ends[0] != common.ends[1]
                    {
                        edges.extend(self.gap(region, [common.ends[1], next.ends[0]])?);
                    }
                }
                None => {
                    let [first, last] = self.open_ends(region, [before, after], step.chain_use)?;
                    edges.extend(self.border(region, step.chain_use, [first, last])?);
                }
            }
        }
        Some(edges)
    }

    fn step_of(&self, chain_use: ChainUse) -> LoopChain {
        let common = self.common[chain_use.chain].clone().map(|mut common| {
            if !chain_use.is_forward {
                common.ends.reverse();
                common.edges.reverse();
                common
                    .edges
                    .iter_mut()
                    .for_each(|edge| *edge = edge.reversed());
            }
            common
        });
        LoopChain { chain_use, common }
    }

    /// Vertices at the ends of the border of one region: those of its neighbours in the loop, or of
    /// the corner.
    fn open_ends(
        &mut self,
        region: usize,
        [before, after]: [&LoopChain; 2],
        chain_use: ChainUse,
    ) -> Option<[usize; 2]> {
        let mut ends = self.graph.chains[chain_use.chain].ends()?;
        if !chain_use.is_forward {
            ends.reverse();
        }
        let first = before.common.as_ref().map(|common| common.ends[1]);
        let last = after.common.as_ref().map(|common| common.ends[0]);
        let first = first.unwrap_or_else(|| self.own_vertex(region, ends[0]));
        let last = last.unwrap_or_else(|| self.own_vertex(region, ends[1]));
        Some([first, last])
    }

    fn own_vertex(&mut self, region: usize, vertex: u32) -> usize {
        let corner = self.corners.of_vertex[&vertex];
        if let Some(shared) = self.shared[corner] {
            return shared;
        }
        let position = self.mesh.position(VertexId(vertex));
        self.vertex_at(corner, on_all(&[self.surface(region)], &position).0)
    }

    /// The vertex of a corner at a place; one for all places that are the same.
    fn vertex_at(&mut self, corner: usize, place: Point3<f64>) -> usize {
        let own = self.own.entry(corner).or_default();
        let is_here = |vertex: &&usize| (self.parts.vertices[**vertex] - place).norm() <= SAME;
        if let Some(known) = own.iter().find(is_here) {
            return *known;
        }
        let vertex = self.parts.vertex(place);
        own.push(vertex);
        vertex
    }

    /// A short edge on one surface between two vertices.
    fn gap(&mut self, region: usize, ends: [usize; 2]) -> Option<Vec<OrientedEdge>> {
        let points = ends.map(|vertex| self.parts.vertices[vertex]);
        self.edges_along(region, &points, ends)
    }

    /// Edges on the surface of a region beside a chain.
    fn border(
        &mut self,
        region: usize,
        chain_use: ChainUse,
        ends: [usize; 2],
    ) -> Option<Vec<OrientedEdge>> {
        let mut points = self.border_points(chain_use);
        if ends[0] == ends[1] && length_of(&points) <= self.scale.reach {
            return Some(Vec::new());
        }
        let last = points.len() - 1;
        (points[0], points[last]) = (self.parts.vertices[ends[0]], self.parts.vertices[ends[1]]);
        self.edges_along(region, &points, ends)
    }

    fn edges_along(
        &mut self,
        region: usize,
        points: &[Point3<f64>],
        ends: [usize; 2],
    ) -> Option<Vec<OrientedEdge>> {
        let surface = self.surface(region);
        let is_corner = |at: &usize| self.is_corner(&points[at - 1..at + 2]);
        let corners = (1..points.len() - 1).filter(is_corner);
        let stops: Vec<usize> = [0]
            .into_iter()
            .chain(corners)
            .chain([points.len() - 1])
            .collect();
        let (mut edges, mut from) = (Vec::new(), ends[0]);
        for pair in stops.windows(2) {
            let to = if pair[1] == points.len() - 1 {
                ends[1]
            } else {
                let place = on_all(&[surface], &points[pair[1]]).0;
                self.parts.vertex(place)
            };
            let nodes = traced(&[surface], &points[pair[0]..=pair[1]])?;
            edges.push(self.parts.edge(&SpaceCurve::Spline(nodes), from, to));
            from = to;
        }
        Some(edges)
    }

    /// The border of a region that a chain without corners closes.
    fn closed_border(&mut self, region: usize, chain_use: ChainUse) -> Option<Vec<OrientedEdge>> {
        let points = self.border_points(chain_use);
        let surface = self.surface(region);
        let mut inner = 1..points.len() - 1;
        if let Some(corner) = inner.find(|&at| self.is_corner(&points[at - 1..at + 2])) {
            let mut turned = points[corner..points.len() - 1].to_vec();
            turned.extend_from_slice(&points[..=corner]);
            let place = on_all(&[surface], &points[corner]).0;
            let vertex = self.parts.vertex(place);
            return self.edges_along(region, &turned, [vertex; 2]);
        }
        let nodes = traced(&[surface], &points)?;
        Some(vec![self.parts.ring(&SpaceCurve::Spline(nodes))])
    }

    /// Whether a border has a corner at the middle one of three points.
    fn is_corner(&self, points: &[Point3<f64>]) -> bool {
        let (a, b) = (points[1] - points[0], points[2] - points[1]);
        let most = if self.scale.step == 0.0 {
            CORNER
        } else {
            SCANNED_CORNER
        };
        a.dot(&b) < most * a.norm() * b.norm()
    }

    /// Points of a chain in the direction of a loop, of a scan smoothed.
    fn border_points(&self, chain_use: ChainUse) -> Vec<Point3<f64>> {
        let mut points = self.graph.chains[chain_use.chain].points(self.mesh);
        if !chain_use.is_forward {
            points.reverse();
        }
        smoothed(points, self.scale.step)
    }
}
