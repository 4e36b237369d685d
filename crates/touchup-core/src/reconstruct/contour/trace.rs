//! Whether the scan crosses a square on the rim of the region as the field prescribes.

use nalgebra::{Point2, Point3};

use crate::reconstruct::LatticeRegion;
use crate::reconstruct::NodeValues;
use crate::reconstruct::contour::scan_clipping::{Cut, TraceSegment};
use crate::reconstruct::field::lattice::{Edge, LatticeNode, Square, VertexKey, across};

/// A square on the rim of the region on which scan and field disagree: unless the cell beyond is added to the region, both
/// end there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenSquare {
    /// the square
    pub square: Square,
    /// the cell on its other side, not in the region
    pub beyond: LatticeNode,
    /// whether the scan crosses the square; where it does not, the field goes on past the end of the scan and widening the
    /// region would go on for ever
    pub is_scanned: bool,
}

/// How the scan crosses a square.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Trace {
    /// numbers of the square's edges at which each polyline starts and ends, and where its points are in `points`;
    /// walking along it with the normal of the scan up, the region is on the left
    pub lines: Vec<Polyline>,
    /// segments of all polylines, one after the other
    pub segments: Vec<TraceSegment>,
}

/// One polyline of a [`Trace`].
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct Polyline {
    pub from: u8,
    pub to: u8,
    pub first: u32,
    pub count: u32,
}

/// Longest trace on one square that is shared; beyond, the scan is far finer than the lattice.
const SEGMENTS: usize = 256;

impl Cut {
    /// The squares on the rim of `region` on which the scan and the field disagree, for the caller to widen the region.
    ///
    /// - `values`: at all corners of the cells of the region.
    pub fn open_squares(&self, region: &LatticeRegion, values: &NodeValues) -> Vec<OpenSquare> {
        let mut trace = Trace::default();
        let mut open = Vec::new();
        for (cell, ()) in region.iter() {
            for side in 0..6 {
                let square = crate::reconstruct::contour::loops::square_of(cell, side);
                let [below, above] = square.cells();
                let beyond = if side % 2 == 1 { above } else { below };
                if !region.contains(&beyond) && !self.trace_into(&square, values, &mut trace) {
                    open.push(self.open_square(square, beyond));
                }
            }
        }
        open
    }

    pub(in crate::reconstruct) fn open_square(&self, square: Square, beyond: LatticeNode) -> OpenSquare {
        OpenSquare { square, beyond, is_scanned: self.segments_on(&square).next().is_some() }
    }

    /// Whether scan and field agree on a square; if so, `trace` becomes what the scan leaves there.
    pub(in crate::reconstruct) fn trace_into(&self, square: &Square, values: &NodeValues, trace: &mut Trace) -> bool {
        trace.lines.clear();
        trace.segments.clear();
        let Some(is_material) = signs(square, values) else { return false };
        let edges = square.edges();
        for i in 0..4 {
            let changes = is_material[i] != is_material[(i + 1) % 4];
            if changes != self.pierced(&edges[i]).is_some()
                || (changes && self.shared_crossing(&edges[i], values).is_none())
            {
                return false;
            }
        }
        let all: Vec<TraceSegment> = self.segments_on(square).take(SEGMENTS + 1).copied().collect();
        if all.is_empty() {
            return is_material.iter().all(|&sign| sign == is_material[0]);
        }
        all.len() <= SEGMENTS && self.chain(&edges, &all, trace) && !self.is_crossed(square, trace)
    }

    /// The crossing of an edge by the scan, where it is the only one and has the direction of the field.
    pub(in crate::reconstruct) fn shared_crossing(
        &self,
        edge: &Edge,
        values: &NodeValues,
    ) -> Option<&crate::reconstruct::contour::scan_clipping::Pierced> {
        let pierced = self.pierced(edge).filter(|pierced| !pierced.is_repeated)?;
        let [start, end] = [edge.node, edge.end()].map(|node| values.get(&node).map(|f| *f < 0.0));
        let outward = pierced.normal[edge.axis as usize];
        match (start?, end?) {
            (true, false) if outward > 0.0 => Some(pierced),
            (false, true) if outward < 0.0 => Some(pierced),
            _ => None,
        }
    }

    /// Sorts segments into polylines from edge to edge; whether that uses all of them.
    fn chain(&self, edges: &[Edge; 4], all: &[TraceSegment], trace: &mut Trace) -> bool {
        let edge_at = |vertex: u32| match self.vertices.entry(vertex).0 {
            VertexKey::Pierce(edge, _) => edges.iter().position(|&other| other == edge),
            _ => None,
        };
        for start in all {
            let Some(from) = edge_at(start.from) else { continue };
            let first = trace.segments.len() as u32;
            let mut last = *start;
            trace.segments.push(last);
            let to = loop {
                if let Some(to) = edge_at(last.to) {
                    break to;
                }
                let mut following = all.iter().filter(|segment| segment.from == last.to);
                let (Some(next), None) = (following.next(), following.next()) else { return false };
                if trace.segments.len() >= all.len() {
                    return false;
                }
                last = *next;
                trace.segments.push(last);
            };
            let count = trace.segments.len() as u32 - first;
            trace.lines.push(Polyline { from: from as u8, to: to as u8, first, count });
        }
        trace.segments.len() == all.len() && self.is_paired(edges, trace)
    }

    /// Whether each edge that is crossed starts or ends just one polyline.
    fn is_paired(&self, edges: &[Edge; 4], trace: &Trace) -> bool {
        (0..4).all(|i| {
            let ends = trace.lines.iter().map(|line| usize::from(line.from == i) + usize::from(line.to == i));
            ends.sum::<usize>() == usize::from(self.pierced(&edges[i as usize]).is_some())
        })
    }

    /// Whether segments that are no neighbours cross: the scan meets itself there.
    fn is_crossed(&self, square: &Square, trace: &Trace) -> bool {
        let (u, v) = across(square.axis as usize);
        let flat = |vertex: u32| {
            let p: &Point3<f64> = &self.vertices.entry(vertex).1;
            Point2::new(p[u], p[v])
        };
        trace.segments.iter().enumerate().any(|(i, a)| {
            trace.segments[i + 1..].iter().any(|b| {
                a.to != b.from && a.from != b.to && crosses(&flat(a.from), &flat(a.to), &flat(b.from), &flat(b.to))
            })
        })
    }
}

/// Which corners of a square are in the material; `None` where the field has no value.
fn signs(square: &Square, values: &NodeValues) -> Option<[bool; 4]> {
    let mut signs = [false; 4];
    for (sign, corner) in signs.iter_mut().zip(square.corners()) {
        *sign = *values.get(&corner)? < 0.0;
    }
    Some(signs)
}

/// Whether segments pq and ab cross at a point inside both.
fn crosses(p: &Point2<f64>, q: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> bool {
    let side = |p: &Point2<f64>, q: &Point2<f64>, x: &Point2<f64>| (q - p).perp(&(x - p));
    side(p, q, a) * side(p, q, b) < 0.0 && side(a, b, p) * side(a, b, q) < 0.0
}
