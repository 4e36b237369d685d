//! The regions of a labelled mesh with the chains of edges between them, and the junctions in which
//! chains end.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::labels::pieces;
use crate::features::segmentation::facets::{Facets, NONE};
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// A connected piece of the mesh on one surface.
#[derive(Clone, Debug)]
pub(super) struct LabelledRegion {
    /// number of its surface
    pub surface: usize,
    /// ids of its faces
    pub faces: Vec<u32>,
}

/// Edges of the mesh between two regions, or beside one, from junction to junction.
#[derive(Clone, Debug)]
pub(super) struct BorderChain {
    /// from the first to the last; of a closed one the first is not repeated
    pub vertices: Vec<u32>,
    /// numbers of the regions on its left and right, seen from outside
    pub sides: [Option<usize>; 2],
    pub is_closed: bool,
}

impl BorderChain {
    /// Positions of its vertices, m; of a closed one the first is also the last.
    pub(super) fn points(&self, mesh: &TriMesh) -> Vec<Point3<f64>> {
        let closing = self.is_closed.then(|| self.vertices[0]);
        let vertices = self.vertices.iter().copied().chain(closing);
        vertices.map(|v| mesh.position(VertexId(v))).collect()
    }

    /// Both ends; `None` of a closed one.
    pub(super) fn ends(&self) -> Option<[u32; 2]> {
        let ends = [*self.vertices.first()?, *self.vertices.last()?];
        (!self.is_closed).then_some(ends)
    }
}

/// A chain in a loop around a region, which is on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChainUse {
    /// number of the chain
    pub chain: usize,
    /// whether the region is on the left of the chain itself
    pub is_forward: bool,
}

/// Regions, chains and loops.
pub(super) struct RegionGraph {
    pub regions: Vec<LabelledRegion>,
    pub chains: Vec<BorderChain>,
    /// of each region, each with its chains in order
    pub loops: Vec<Vec<Vec<ChainUse>>>,
}

/// An edge of a face with another region, or none, across.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    face: u32,
    edge: usize,
}

struct Borders<'a> {
    facets: &'a Facets<'a>,
    region_of: Vec<u32>,
    /// number of border edges at each vertex of a border
    degrees: BTreeMap<u32, usize>,
}

impl<'a> Borders<'a> {
    fn of(facets: &'a Facets<'a>, region_of: Vec<u32>) -> Self {
        let mut borders = Self {
            facets,
            region_of,
            degrees: BTreeMap::new(),
        };
        let mut edges: Vec<[u32; 2]> = borders.all().map(|half| borders.ends(half)).collect();
        edges.iter_mut().for_each(|ends| ends.sort_unstable());
        edges.sort_unstable();
        edges.dedup();
        for vertex in edges.into_iter().flatten() {
            *borders.degrees.entry(vertex).or_default() += 1;
        }
        borders
    }

    fn all(&self) -> impl Iterator<Item = HalfEdge> + '_ {
        let faces = 0..self.region_of.len() as u32;
        let halves = faces.flat_map(|face| (0..3).map(move |edge| HalfEdge { face, edge }));
        halves.filter(|&half| self.is_border(half))
    }

    fn region(&self, face: u32) -> Option<usize> {
        let region = *self.region_of.get(face as usize)?;
        (region != NONE).then_some(region as usize)
    }

    fn across(&self, half: HalfEdge) -> Option<usize> {
        self.region(self.facets.beside[half.face as usize][half.edge])
    }

    fn is_border(&self, half: HalfEdge) -> bool {
        self.region(half.face)
            .is_some_and(|region| self.across(half) != Some(region))
    }

    /// From where to where it runs.
    fn ends(&self, half: HalfEdge) -> [u32; 2] {
        let corners = self.facets.mesh.corners(FaceId(half.face));
        [corners[half.edge].0, corners[(half.edge + 1) % 3].0]
    }

    fn is_junction(&self, vertex: u32) -> bool {
        self.degrees.get(&vertex).is_some_and(|&count| count != 2)
    }

    /// The border edge of the same region that begins at the end of this one.
    fn next(&self, half: HalfEdge) -> HalfEdge {
        let [_, at] = self.ends(half);
        let after = |half: HalfEdge| HalfEdge {
            edge: (half.edge + 1) % 3,
            ..half
        };
        let mut next = after(half);
        let most = self.facets.mesh.star(VertexId(at)).len();
        for _ in 0..most {
            if self.is_border(next) {
                break;
            }
            let face = self.facets.beside[next.face as usize][next.edge];
            let ends_here = |edge: &usize| self.ends(HalfEdge { face, edge: *edge })[1] == at;
            let edge = (0..3).find(ends_here).unwrap_or(0);
            next = after(HalfEdge { face, edge });
        }
        next
    }

    /// All loops, each with its region.
    fn loops(&self) -> Vec<(usize, Vec<HalfEdge>)> {
        let halves: Vec<HalfEdge> = self.all().collect();
        let mut is_done = vec![false; halves.len()];
        let mut loops = Vec::new();
        for at in 0..halves.len() {
            let Some(region) = self.region(halves[at].face).filter(|_| !is_done[at]) else {
                continue;
            };
            let (mut whole, mut half) = (Vec::new(), halves[at]);
            while let Ok(place) = halves.binary_search(&half) {
                if std::mem::replace(&mut is_done[place], true) {
                    break;
                }
                whole.push(half);
                half = self.next(half);
            }
            // from a junction on, if it has one
            let first = whole
                .iter()
                .position(|&half| self.is_junction(self.ends(half)[0]));
            whole.rotate_left(first.unwrap_or(0));
            loops.push((region, whole));
        }
        loops
    }
}

impl RegionGraph {
    /// Of the label of each face.
    pub(super) fn of(facets: &Facets, labels: &[u32]) -> Self {
        let (region_of, pieces) = pieces(facets, labels, |label| label != NONE);
        let region = |faces: Vec<u32>| LabelledRegion {
            surface: labels[faces[0] as usize] as usize,
            faces,
        };
        let regions: Vec<_> = pieces.into_iter().map(region).collect();
        let mut graph = Self {
            chains: Vec::new(),
            loops: vec![Vec::new(); regions.len()],
            regions,
        };
        let borders = Borders::of(facets, region_of);
        // number of the chain by the least of its edges
        let mut known: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for (region, whole) in borders.loops() {
            let runs = whole.chunk_by(|_, half| !borders.is_junction(borders.ends(*half)[0]));
            let uses = runs.map(|run| graph.use_of(&borders, &mut known, region, run));
            let uses = uses.collect();
            graph.loops[region].push(uses);
        }
        graph
    }

    fn use_of(
        &mut self,
        borders: &Borders,
        known: &mut BTreeMap<[u32; 2], usize>,
        region: usize,
        run: &[HalfEdge],
    ) -> ChainUse {
        let ends = run.iter().map(|&half| borders.ends(half));
        let sorted = ends.clone().map(|[a, b]| [a.min(b), a.max(b)]);
        let least = sorted.min().unwrap_or_default();
        let across = borders.across(run[0]);
        if let Some(&chain) = across.and(known.get(&least))
            && self.chains[chain].sides == [across, Some(region)]
        {
            return ChainUse {
                chain,
                is_forward: false,
            };
        }
        let mut vertices: Vec<u32> = ends.clone().map(|[from, _]| from).collect();
        let last = ends.clone().next_back().map_or(0, |[_, to]| to);
        let is_closed = last == vertices[0] && !borders.is_junction(last);
        if !is_closed {
            vertices.push(last);
        }
        known.insert(least, self.chains.len());
        self.chains.push(BorderChain {
            vertices,
            sides: [Some(region), across],
            is_closed,
        });
        ChainUse {
            chain: self.chains.len() - 1,
            is_forward: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of 4 by 4, each of two faces, with the label of each square.
    fn graph(label: impl Fn(u32, u32) -> u32) -> RegionGraph {
        let squares = || (0..4).flat_map(|y| (0..4).map(move |x| (x, y)));
        let corner = |x: u32, y: u32| 5 * y + x;
        let places = (0..25).map(|at| Point3::new(f64::from(at % 5), f64::from(at / 5), 0.0));
        let faces = squares().flat_map(|(x, y)| {
            let [a, b] = [corner(x, y), corner(x + 1, y)];
            let [c, d] = [corner(x + 1, y + 1), corner(x, y + 1)];
            [[a, b, c], [a, c, d]]
        });
        let mesh = TriMesh::new(places.collect(), faces.collect()).unwrap();
        let labels: Vec<u32> = squares().flat_map(|(x, y)| [label(x, y); 2]).collect();
        RegionGraph::of(&Facets::of(&mesh), &labels)
    }

    fn lengths(graph: &RegionGraph) -> Vec<(usize, bool)> {
        let edges = |chain: &BorderChain| {
            let count = chain.vertices.len() - usize::from(!chain.is_closed);
            (count, chain.is_closed)
        };
        let mut lengths: Vec<_> = graph.chains.iter().map(edges).collect();
        lengths.sort_unstable();
        lengths
    }

    /// Between the halves 4 edges, which both use in opposite directions; around each the other 8.
    #[test]
    fn halves_share_the_chain_between_them() {
        let graph = graph(|x, _| x / 2);
        assert_eq!(lengths(&graph), [(4, false), (8, false), (8, false)]);
        let shared = graph
            .chains
            .iter()
            .position(|chain| chain.sides[1].is_some());
        let mut uses = graph.loops.iter().map(|loops| {
            assert_eq!((loops.len(), loops[0].len()), (1, 2));
            loops[0]
                .iter()
                .find(|one| Some(one.chain) == shared)
                .unwrap()
        });
        assert_ne!(
            uses.next().unwrap().is_forward,
            uses.next().unwrap().is_forward
        );
    }

    /// Around the island of 2 by 2 squares 8 edges without a junction, around all 16.
    #[test]
    fn an_island_has_one_closed_chain_and_its_surroundings_two_loops() {
        let graph = graph(|x, y| u32::from((1..3).contains(&x) && (1..3).contains(&y)));
        assert_eq!(lengths(&graph), [(8, true), (16, true)]);
        let loops: Vec<usize> = graph.loops.iter().map(Vec::len).collect();
        assert_eq!(loops, [2, 1]);
    }

    /// An unlabelled square at the rim: its 3 inner edges are open, and 13 of the rim stay.
    #[test]
    fn mesh_without_a_label_has_no_region() {
        let graph = graph(|x, y| if (x, y) == (1, 0) { NONE } else { 0 });
        assert_eq!(graph.regions.len(), 1);
        assert_eq!(lengths(&graph), [(18, true)]);
    }
}
