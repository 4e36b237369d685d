//! Boundary loops of the pieces of a face that stay: loops of points, the face on their left.

use crate::reconstruct::LatticeRegion;
use crate::reconstruct::contour::clip::{Pieces, PointSupport, SideOrigin, wall};
use crate::reconstruct::field::lattice::LatticeNode;

/// A side of a piece at which the part that stays ends.
struct PieceRim {
    from: u32,
    to: u32,
    side: SideOrigin,
    piece: u32,
    is_used: bool,
}

/// Loops around all pieces whose cells are not in the region.
pub(in crate::reconstruct) fn outline(pieces: &Pieces, region: &LatticeRegion) -> Vec<Vec<u32>> {
    let mut rims = rims(pieces, region);
    let mut loops = Vec::new();
    for first in 0..rims.len() {
        let mut corners = Vec::new();
        let mut at = Some(first).filter(|&first| !rims[first].is_used);
        while let Some(i) = at {
            rims[i].is_used = true;
            corners.push(i);
            at = next(&rims, i);
        }
        loops.extend((corners.len() > 2).then(|| kept_points(pieces, &rims, &corners)));
    }
    loops
}

fn rims(pieces: &Pieces, region: &LatticeRegion) -> Vec<PieceRim> {
    let ends_at =
        |cell: LatticeNode, side: SideOrigin| wall(cell, side).is_none_or(|(_, beyond)| region.contains(&beyond));
    let mut rims = Vec::new();
    for (piece, (cell, corners)) in pieces.iter().enumerate().filter(|(_, (cell, _))| !region.contains(cell)) {
        for (i, corner) in corners.iter().enumerate().filter(|(_, corner)| ends_at(cell, corner.side)) {
            let to = corners[(i + 1) % corners.len()].point;
            rims.push(PieceRim { from: corner.point, to, side: corner.side, piece: piece as u32, is_used: false });
        }
    }
    rims
}

/// What follows side `i`: a side of the same piece first, so that two parts that meet at a point stay separate.
fn next(rims: &[PieceRim], i: usize) -> Option<usize> {
    let follows = |j: &usize| !rims[*j].is_used && rims[*j].from == rims[i].to;
    let same = (0..rims.len()).find(|j| follows(j) && rims[*j].piece == rims[i].piece);
    same.or_else(|| (0..rims.len()).find(follows))
}

/// The points of a loop, without those on a side of the face where neither this face nor its neighbour ends.
fn kept_points(pieces: &Pieces, rims: &[PieceRim], corners: &[usize]) -> Vec<u32> {
    let is_kept = |at: usize| {
        let (before, here) = (&rims[corners[(at + corners.len() - 1) % corners.len()]], &rims[corners[at]]);
        let is_trace = matches!(pieces.place(here.from), PointSupport::Trace { .. });
        !(is_trace && before.side == here.side)
    };
    (0..corners.len()).filter(|&at| is_kept(at)).map(|at| rims[corners[at]].from).collect()
}
