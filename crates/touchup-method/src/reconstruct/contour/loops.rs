//! Course of the surface through squares and cells, from the signs at their corners.
//!
//! Corners of a cell are numbered x + 2y + 4z; its edges 4 · axis + a + 2b, with steps a and b
//! along the two axes that follow; its squares 2 · axis + (1 when above). A segment on a square
//! leads from edge to edge with the material on its left, seen against the square's axis.

use crate::reconstruct::lattice::{Edge, LatticeNode, Square, across, stepped};

/// No edge, no loop.
pub(in crate::reconstruct) const NONE: u8 = u8::MAX;

/// Up to two directed segments, as numbers of edges in [`Square::edges`].
pub(in crate::reconstruct) type Segments = [Option<[u8; 2]>; 2];

/// The segments on a square from the signs at its corners (true: material). `is_joined`, for a
/// square with four crossed edges: whether the material in the two opposite corners is connected.
#[inline]
pub(in crate::reconstruct) fn segments(
    is_material: [bool; 4],
    is_joined: impl FnOnce() -> bool,
) -> Segments {
    let leaves = |i: usize| is_material[i] && !is_material[(i + 1) % 4];
    let enters = |i: usize| !is_material[i] && is_material[(i + 1) % 4];
    let Some(first) = (0..4).find(|&i| leaves(i)) else {
        return [None; 2];
    };
    if !leaves((first + 2) % 4) {
        let last = (0..4).find(|&i| enters(i)).unwrap_or(first);
        return [Some([first as u8, last as u8]), None];
    }
    let turn = if is_joined() { 1 } else { 3 };
    [first, (first + 2) % 4].map(|i| Some([i as u8, ((i + turn) % 4) as u8]))
}

/// The two corners of edge number `edge` of a cell, the lower first.
#[inline]
pub(in crate::reconstruct) fn edge_corners(edge: u8) -> [u8; 2] {
    let axis = edge as usize / 4;
    let (u, v) = across(axis);
    let lower = (edge & 1) << u | (edge >> 1 & 1) << v;
    [lower, lower | 1 << axis]
}

/// Edge number `edge` of a cell.
#[inline]
pub(in crate::reconstruct) fn edge_of(cell: LatticeNode, edge: u8) -> Edge {
    let axis = edge as usize / 4;
    let (u, v) = across(axis);
    let node = stepped(
        stepped(cell, u, i32::from(edge & 1)),
        v,
        i32::from(edge >> 1 & 1),
    );
    Edge {
        node,
        axis: axis as u8,
    }
}

/// Number of an edge along `axis` in the `i`-th of the cells around it ([`Edge::cells`]).
#[inline]
pub(in crate::reconstruct) fn number_in(axis: u8, i: usize) -> u8 {
    4 * axis + [0, 1, 3, 2][i]
}

/// Square number `side` of a cell.
#[inline]
pub(in crate::reconstruct) fn square_of(cell: LatticeNode, side: u8) -> Square {
    Square {
        node: stepped(cell, side as usize / 2, i32::from(side % 2)),
        axis: side / 2,
    }
}

/// The edges of square number `side`, numbered in the cell, in the order of [`Square::edges`].
#[inline]
pub(in crate::reconstruct) fn ring_edges(side: u8) -> [u8; 4] {
    let (axis, above) = (side as usize / 2, side % 2);
    let (u, v) = across(axis);
    let (u, v) = (4 * u as u8, 4 * v as u8);
    [u + 2 * above, v + above + 2, u + 1 + 2 * above, v + above]
}

/// The corners of square number `side`, numbered in the cell, in the order of [`Square::corners`].
#[inline]
pub(in crate::reconstruct) fn ring_corners(side: u8) -> [u8; 4] {
    let (axis, above) = (side as usize / 2, side % 2);
    let (u, v) = across(axis);
    let lowest = above << axis;
    [
        lowest,
        lowest | 1 << u,
        lowest | 1 << u | 1 << v,
        lowest | 1 << v,
    ]
}

/// The closed loops of a cell.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct Loops {
    /// the edge that follows each edge, and the square between them; [`NONE`] for an edge without a
    /// crossing
    next: [[u8; 2]; 12],
}

impl Loops {
    pub(crate) const EMPTY: Self = Self {
        next: [[NONE; 2]; 12],
    };

    /// Adds a segment on square number `side`, given as numbers of edges in [`Square::edges`].
    pub(crate) fn add(&mut self, side: u8, [from, to]: [u8; 2]) {
        let ring = ring_edges(side);
        let (from, to) = (ring[from as usize], ring[to as usize]);
        // the material is on the left of a loop seen from outside the cell: below, that is against
        // the axis
        let (from, to) = if side % 2 == 1 {
            (from, to)
        } else {
            (to, from)
        };
        self.link(from, to, side);
    }

    /// Adds a segment on square number `side` from edge to edge, numbered in the cell and directed
    /// as its loop.
    pub(crate) fn link(&mut self, from: u8, to: u8, side: u8) {
        self.next[from as usize] = [to, side];
    }

    /// The steps of the loop from edge `first`: edge by edge, with the square that follows each.
    pub(crate) fn walk(&self, first: u8) -> impl Iterator<Item = (u8, u8)> + '_ {
        let mut at = first;
        let mut left = 12;
        std::iter::from_fn(move || {
            let [next, side] = *self.next.get(at as usize)?;
            if left == 0 || next == NONE {
                return None;
            }
            let step = (at, side);
            left = if next == first { 0 } else { left - 1 };
            at = next;
            Some(step)
        })
    }

    /// The number of the loop at each edge, [`NONE`] without a loop, and the number of loops.
    pub(crate) fn numbers(&self) -> ([u8; 12], u8) {
        let (mut numbers, mut count) = ([NONE; 12], 0);
        for edge in 0..12 {
            if self.next[edge as usize][0] != NONE && numbers[edge as usize] == NONE {
                self.walk(edge)
                    .for_each(|(at, _)| numbers[at as usize] = count);
                count += 1;
            }
        }
        (numbers, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_edges_squares_and_corners_agree() {
        let cell = [3, -2, 7];
        for side in 0..6 {
            let square = square_of(cell, side);
            let edges = ring_edges(side).map(|edge| edge_of(cell, edge));
            assert_eq!(edges, square.edges());
            let corner = |number: u8| std::array::from_fn(|i| cell[i] + i32::from(number >> i & 1));
            assert_eq!(ring_corners(side).map(corner), square.corners());
            assert!(square.cells().contains(&cell));
        }
        for number in 0..12 {
            let edge = edge_of(cell, number);
            let i = edge
                .cells()
                .iter()
                .position(|&other| other == cell)
                .unwrap();
            assert_eq!(number_in(edge.axis, i), number);
            let ends = edge_corners(number)
                .map(|n| std::array::from_fn(|i| cell[i] + i32::from(n >> i & 1)));
            assert_eq!(ends, [edge.node, edge.end()]);
            for (i, square) in edge.squares().iter().enumerate() {
                assert!(square.edges().contains(&edge));
                let beside = [edge.cells()[i], edge.cells()[(i + 1) % 4]];
                assert!(square.cells().iter().all(|cell| beside.contains(cell)));
            }
        }
    }

    /// Every pattern of signs gives closed loops that pass each crossed edge once.
    #[test]
    fn loops_close_for_every_pattern_of_signs() {
        for mask in 0..256u32 {
            for joined in 0..64u32 {
                let is_material = |corner: u8| mask >> corner & 1 == 1;
                let mut loops = Loops::EMPTY;
                for side in 0..6 {
                    let found = segments(ring_corners(side).map(is_material), || {
                        joined >> side & 1 == 1
                    });
                    found
                        .into_iter()
                        .flatten()
                        .for_each(|segment| loops.add(side, segment));
                }
                let (numbers, count) = loops.numbers();
                for edge in 0..12 {
                    let [a, b] = edge_corners(edge).map(is_material);
                    assert_eq!(numbers[edge as usize] != NONE, a != b);
                    let walked: Vec<_> = loops.walk(edge).collect();
                    assert!(
                        walked
                            .iter()
                            .all(|(e, _)| numbers[*e as usize] == numbers[edge as usize])
                    );
                    assert!(a == b || walked.len() >= 3);
                }
                assert!(count <= 4);
            }
        }
    }
}
