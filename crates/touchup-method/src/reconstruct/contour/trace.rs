//! Agreement of scan and field on the squares of the region's rim.

use nalgebra::{Point2, Point3};

use crate::reconstruct::contour::patched::OpenSquare;
use crate::reconstruct::contour::scan_clipping::{Cut, ScanCrossing, TraceSegment};
use crate::reconstruct::lattice::{Edge, LatticeNode, NodeValues, Square, VertexKey, across};

/// A polyline in which the scan crosses a square, from one of the square's edges to another, by
/// their numbers; walking along it with the normal of the scan up, the region is on the left.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct Polyline {
    pub from: u8,
    pub to: u8,
    pub segments: Vec<TraceSegment>,
}

/// Maximum number of segments of a shared trace on one square; beyond, the scan is far finer than
/// the lattice.
const SEGMENTS: usize = 256;

impl Cut {
    pub(in crate::reconstruct) fn open_square(
        &self,
        square: Square,
        beyond: LatticeNode,
    ) -> OpenSquare {
        OpenSquare {
            square,
            beyond,
            is_scanned: self.segments_on(&square).next().is_some(),
        }
    }

    /// The traces of the scan on a square; `None` if scan and field disagree.
    pub(in crate::reconstruct) fn trace_on(
        &self,
        square: &Square,
        values: &NodeValues,
    ) -> Option<Vec<Polyline>> {
        let is_material = signs(square, values)?;
        let edges = square.edges();
        let agrees = |i: usize| {
            let is_crossed = is_material[i] != is_material[(i + 1) % 4];
            if is_crossed {
                self.shared_crossing(&edges[i], values).is_some()
            } else {
                self.pierced(&edges[i]).is_none()
            }
        };
        if !(0..4).all(agrees) {
            return None;
        }
        let all: Vec<TraceSegment> = self
            .segments_on(square)
            .take(SEGMENTS + 1)
            .copied()
            .collect();
        if all.is_empty() {
            return is_material
                .iter()
                .all(|&sign| sign == is_material[0])
                .then(Vec::new);
        }
        let lines = if all.len() <= SEGMENTS {
            self.chain(&edges, &all)
        } else {
            None
        };
        lines.filter(|lines| !self.is_crossed(square, lines))
    }

    /// The crossing of an edge by the scan, if it is the only one and has the direction of the
    /// field.
    pub(in crate::reconstruct) fn shared_crossing(
        &self,
        edge: &Edge,
        values: &NodeValues,
    ) -> Option<&ScanCrossing> {
        let pierced = self.pierced(edge).filter(|pierced| !pierced.is_repeated)?;
        let [start, end] = [edge.node, edge.end()].map(|node| values.get(&node).map(|f| *f < 0.0));
        let outward = pierced.normal[edge.axis as usize];
        let is_alike = if start? {
            !end? && outward > 0.0
        } else {
            end? && outward < 0.0
        };
        is_alike.then_some(pierced)
    }

    /// Sorts segments into polylines from edge to edge; `None` if some remain unused.
    fn chain(&self, edges: &[Edge; 4], all: &[TraceSegment]) -> Option<Vec<Polyline>> {
        let edge_at = |vertex: u32| match self.patch.vertices.entry(vertex).0 {
            VertexKey::Pierce(edge, _) => edges
                .iter()
                .position(|&other| other == edge)
                .map(|at| at as u8),
            _ => None,
        };
        let (mut lines, mut used) = (Vec::new(), 0);
        for start in all {
            let Some(from) = edge_at(start.from) else {
                continue;
            };
            let mut segments = vec![*start];
            used += 1;
            let mut end = start.to;
            let to = loop {
                if let Some(to) = edge_at(end) {
                    break to;
                }
                let mut following = all.iter().filter(|segment| segment.from == end);
                let (Some(next), None) = (following.next(), following.next()) else {
                    return None;
                };
                if used >= all.len() {
                    return None;
                }
                segments.push(*next);
                used += 1;
                end = next.to;
            };
            lines.push(Polyline { from, to, segments });
        }
        (used == all.len() && self.is_paired(edges, &lines)).then_some(lines)
    }

    /// Whether each crossed edge starts or ends just one polyline.
    fn is_paired(&self, edges: &[Edge; 4], lines: &[Polyline]) -> bool {
        (0..).zip(edges).all(|(i, edge)| {
            let ends = lines
                .iter()
                .flat_map(|line| [line.from, line.to])
                .filter(|&end| end == i);
            ends.count() == usize::from(self.pierced(edge).is_some())
        })
    }

    /// Whether segments that are no neighbours cross: the scan meets itself there.
    fn is_crossed(&self, square: &Square, lines: &[Polyline]) -> bool {
        let (u, v) = across(square.axis as usize);
        let flat = |vertex: u32| {
            let p: &Point3<f64> = &self.patch.vertices.entry(vertex).1;
            Point2::new(p[u], p[v])
        };
        let segments: Vec<&TraceSegment> = lines.iter().flat_map(|line| &line.segments).collect();
        segments.iter().enumerate().any(|(i, a)| {
            segments[i + 1..].iter().any(|b| {
                a.to != b.from
                    && a.from != b.to
                    && crosses(&flat(a.from), &flat(a.to), &flat(b.from), &flat(b.to))
            })
        })
    }
}

/// Material at the corners of a square; `None` if the field has no value.
fn signs(square: &Square, values: &NodeValues) -> Option<[bool; 4]> {
    let [a, b, c, d] = square
        .corners()
        .map(|corner| values.get(&corner).map(|f| *f < 0.0));
    Some([a?, b?, c?, d?])
}

/// Whether segments pq and ab cross at a point inside both.
fn crosses(p: &Point2<f64>, q: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> bool {
    let side = |p: &Point2<f64>, q: &Point2<f64>, x: &Point2<f64>| (q - p).perp(&(x - p));
    side(p, q, a) * side(p, q, b) < 0.0 && side(a, b, p) * side(a, b, q) < 0.0
}
