//! The lattice and the names of everything on it.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::table::{CellTable, Key};
use touchup_geometry::mesh::{FaceId, VertexId};

/// A node of the lattice, or the cell with this lowest corner.
pub type LatticeNode = [i32; 3];

/// The lattice cells with a replaced surface, each named by its lowest node.
pub type LatticeRegion = CellTable<LatticeNode, ()>;

/// The field at lattice nodes, m: negative in the material.
pub type NodeValues = CellTable<LatticeNode, f64>;

/// Bits of a packed node for each axis: cells up to ±10⁶ from the origin differ in them.
const NODE_BITS: u32 = 21;

impl Key for LatticeNode {
    #[inline]
    fn bits(&self) -> u64 {
        let part =
            |i: usize| u64::from(self[i] as u32 & ((1 << NODE_BITS) - 1)) << (NODE_BITS * i as u32);
        part(0) | part(1) | part(2)
    }
}

/// `node`, `count` steps along `axis`.
#[inline]
pub(in crate::reconstruct) fn stepped(
    mut node: LatticeNode,
    axis: usize,
    count: i32,
) -> LatticeNode {
    node[axis] = node[axis].saturating_add(count);
    node
}

/// Corner `corner` of a cell: bit i says whether it is the upper one along axis i.
#[inline]
pub(in crate::reconstruct) fn node_at(cell: LatticeNode, corner: u8) -> LatticeNode {
    std::array::from_fn(|i| cell[i].saturating_add(i32::from(corner >> i & 1)))
}

/// The cell that has `node` as its corner `corner`.
#[inline]
pub(in crate::reconstruct) fn cell_at(node: LatticeNode, corner: u8) -> LatticeNode {
    std::array::from_fn(|i| node[i].saturating_sub(i32::from(corner >> i & 1)))
}

/// The six nodes one step away.
#[inline]
pub(in crate::reconstruct) fn neighbours(node: LatticeNode) -> [LatticeNode; 6] {
    std::array::from_fn(|i| stepped(node, i / 2, if i % 2 == 0 { 1 } else { -1 }))
}

/// The two axes that follow `axis`, so that (axis, u, v) is right-handed.
#[inline]
pub(in crate::reconstruct) fn across(axis: usize) -> (usize, usize) {
    ((axis + 1) % 3, (axis + 2) % 3)
}

/// The four nodes around a square across `axis`, counter-clockwise seen against it, from `node` by
/// steps of `step`.
#[inline]
fn ring(node: LatticeNode, axis: u8, step: i32) -> [LatticeNode; 4] {
    let (u, v) = across(axis as usize);
    let beside = stepped(node, u, step);
    [
        node,
        beside,
        stepped(beside, v, step),
        stepped(node, v, step),
    ]
}

/// Sides between consecutive nodes of a [`ring`], by node and axis: edges for `step` 1, squares for
/// `step` −1.
#[inline]
fn ring_sides(node: LatticeNode, axis: u8, step: i32) -> [(LatticeNode, u8); 4] {
    let (u, v) = across(axis as usize);
    [
        (node, u as u8),
        (stepped(node, u, step), v as u8),
        (stepped(node, v, step), u as u8),
        (node, v as u8),
    ]
}

/// A cubic lattice in the object frame O.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lattice {
    /// position of node (0, 0, 0), m, in O; best such that no coordinate of the scan falls on a
    /// plane of the lattice
    pub origin: Point3<f64>,
    /// edge length of a cell, m, > 0
    pub pitch: f64,
}

impl Lattice {
    /// Coordinate of plane number `index` across `axis`, m.
    #[inline]
    pub(crate) fn coordinate(&self, axis: usize, index: i32) -> f64 {
        self.origin[axis] + self.pitch * f64::from(index)
    }

    /// Position of a node, m, in O.
    #[inline]
    pub fn position(&self, node: LatticeNode) -> Point3<f64> {
        Point3::new(
            self.coordinate(0, node[0]),
            self.coordinate(1, node[1]),
            self.coordinate(2, node[2]),
        )
    }

    /// The last plane across `axis` at or below coordinate `x` (m), exactly as [`Self::coordinate`]
    /// places it.
    #[inline]
    pub(crate) fn index_of(&self, axis: usize, x: f64) -> i32 {
        // the conversion saturates
        let index = ((x - self.origin[axis]) / self.pitch).floor() as i32;
        if self.coordinate(axis, index) > x {
            index.saturating_sub(1)
        } else if self.coordinate(axis, index.saturating_add(1)) <= x {
            index.saturating_add(1)
        } else {
            index
        }
    }

    /// The cell that holds `p`; a point on a plane belongs to the cell above it.
    #[inline]
    pub fn cell_of(&self, p: &Point3<f64>) -> LatticeNode {
        [
            self.index_of(0, p.x),
            self.index_of(1, p.y),
            self.index_of(2, p.z),
        ]
    }

    /// Lowest and highest corner of a cell, drawn in by `margin` (share of the pitch).
    #[inline]
    pub(in crate::reconstruct) fn inner_box(
        &self,
        cell: LatticeNode,
        margin: f64,
    ) -> [Point3<f64>; 2] {
        let inset = Vector3::repeat(margin * self.pitch);
        [
            self.position(cell) + inset,
            self.position(cell.map(|x| x.saturating_add(1))) - inset,
        ]
    }

    /// `p` clamped to the box from node `lo` to node `hi`, `margin` (share of the pitch) inside
    /// along each axis with any extent.
    #[inline]
    pub(crate) fn clamped(
        &self,
        p: Point3<f64>,
        lo: LatticeNode,
        hi: LatticeNode,
        margin: f64,
    ) -> Point3<f64> {
        Point3::from(Vector3::from_fn(|i, _| {
            let [below, above] = [lo, hi].map(|node| self.coordinate(i, node[i]));
            if lo[i] == hi[i] {
                below
            } else {
                p[i].max(below + margin * self.pitch)
                    .min(above - margin * self.pitch)
            }
        }))
    }
}

/// The cells from `lo` to `hi`, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reconstruct) struct CellBox {
    pub lo: LatticeNode,
    pub hi: LatticeNode,
}

impl Default for CellBox {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl CellBox {
    /// No cell.
    pub(crate) const EMPTY: Self = Self {
        lo: [i32::MAX; 3],
        hi: [i32::MIN; 3],
    };
    /// Every cell.
    pub(crate) const ALL: Self = Self {
        lo: [i32::MIN; 3],
        hi: [i32::MAX; 3],
    };

    pub(crate) fn is_empty(&self) -> bool {
        (0..3).any(|i| self.lo[i] > self.hi[i])
    }

    #[inline]
    pub(crate) fn contains(&self, cell: &LatticeNode) -> bool {
        (0..3).all(|i| self.lo[i] <= cell[i] && cell[i] <= self.hi[i])
    }

    #[inline]
    pub(crate) fn take(&mut self, cell: &LatticeNode) {
        self.lo = std::array::from_fn(|i| self.lo[i].min(cell[i]));
        self.hi = std::array::from_fn(|i| self.hi[i].max(cell[i]));
    }

    /// Adds the cells from `below` cells below a cell to `above` cells above it, on each axis.
    pub(crate) fn take_around(&mut self, cell: &LatticeNode, below: i32, above: i32) {
        self.take(&cell.map(|x| x.saturating_sub(below)));
        self.take(&cell.map(|x| x.saturating_add(above)));
    }

    /// Intersection of two boxes.
    pub(crate) fn meet(&self, other: &Self) -> Self {
        let lo = std::array::from_fn(|i| self.lo[i].max(other.lo[i]));
        Self {
            lo,
            hi: std::array::from_fn(|i| self.hi[i].min(other.hi[i])),
        }
    }

    /// Wider by `below` cells below and `above` cells above, on each axis.
    pub(crate) fn widened(&self, below: i32, above: i32) -> Self {
        Self {
            lo: self.lo.map(|x| x.saturating_sub(below)),
            hi: self.hi.map(|x| x.saturating_add(above)),
        }
    }

    /// Number of cells; ∞ beyond the range of a float.
    pub(crate) fn volume(&self) -> f64 {
        (0..3)
            .map(|i| (f64::from(self.hi[i]) - f64::from(self.lo[i]) + 1.0).max(0.0))
            .product()
    }

    /// The cells, x slowest.
    pub(crate) fn iter(&self) -> impl Iterator<Item = LatticeNode> + use<> {
        let Self { lo, hi } = *self;
        (lo[0]..=hi[0]).flat_map(move |x| {
            (lo[1]..=hi[1]).flat_map(move |y| (lo[2]..=hi[2]).map(move |z| [x, y, z]))
        })
    }

    /// Calls `each` with the cells, x slowest; faster than [`Self::iter`].
    #[inline]
    pub(crate) fn each(&self, mut each: impl FnMut(LatticeNode)) {
        for x in self.lo[0]..=self.hi[0] {
            for y in self.lo[1]..=self.hi[1] {
                for z in self.lo[2]..=self.hi[2] {
                    each([x, y, z]);
                }
            }
        }
    }

    /// Calls `each` with the keys of a table that lie in the box, by whichever loop is shorter; in
    /// no particular order.
    #[inline]
    pub(crate) fn each_in<V>(
        &self,
        table: &CellTable<LatticeNode, V>,
        mut each: impl FnMut(LatticeNode, &V),
    ) {
        if self.volume() < table.len() as f64 {
            self.each(|cell| {
                if let Some(value) = table.get(&cell) {
                    each(cell, value);
                }
            });
        } else {
            table
                .iter()
                .filter(|(cell, _)| self.contains(cell))
                .for_each(|(cell, value)| each(cell, value));
        }
    }
}

/// Numbers of the keys of a table, by place within a small box, else by the table. Valid until a
/// key is inserted or removed.
pub(in crate::reconstruct) struct Numbers {
    cells: CellBox,
    size: [usize; 3],
    /// [`Self::NONE`] without a key
    numbers: Vec<u32>,
}

impl Numbers {
    /// No key.
    const NONE: u32 = u32::MAX;

    /// Looks up the keys in `cells`.
    pub(crate) fn new<V>(table: &CellTable<LatticeNode, V>, cells: &CellBox) -> Self {
        let cells = if cells.volume() < table.len() as f64 {
            *cells
        } else {
            CellBox::EMPTY
        };
        let mut numbers = Vec::with_capacity(cells.volume() as usize);
        cells.each(|node| numbers.push(table.index_of(&node).unwrap_or(Self::NONE)));
        let size = std::array::from_fn(|i| {
            if cells.is_empty() {
                0
            } else {
                (cells.hi[i] - cells.lo[i]) as usize + 1
            }
        });
        Self {
            cells,
            size,
            numbers,
        }
    }

    /// The number of `node` in the source table.
    #[inline]
    pub(crate) fn of<V>(
        &self,
        table: &CellTable<LatticeNode, V>,
        node: &LatticeNode,
    ) -> Option<u32> {
        if !self.cells.contains(node) {
            return table.index_of(node);
        }
        let [x, y, z]: [usize; 3] = std::array::from_fn(|i| (node[i] - self.cells.lo[i]) as usize);
        let number = self.numbers[(x * self.size[1] + y) * self.size[2] + z];
        (number != Self::NONE).then_some(number)
    }
}

/// An edge of the lattice: from `node` one step up along `axis`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// its lower end
    pub node: LatticeNode,
    /// 0, 1, 2 for x, y, z
    pub axis: u8,
}

impl Edge {
    /// The four cells around it, counter-clockwise seen against `axis`.
    #[inline]
    pub(crate) fn cells(&self) -> [LatticeNode; 4] {
        ring(self.node, self.axis, -1)
    }

    /// The four squares that end at it: number i is between cells i and i + 1 of [`Self::cells`].
    #[inline]
    pub(crate) fn squares(&self) -> [Square; 4] {
        ring_sides(self.node, self.axis, -1).map(|(node, axis)| Square { node, axis })
    }

    /// Its upper end.
    #[inline]
    pub fn end(&self) -> LatticeNode {
        stepped(self.node, self.axis as usize, 1)
    }
}

impl Key for Edge {
    #[inline]
    fn bits(&self) -> u64 {
        self.node.bits() ^ (u64::from(self.axis) + 1) << 62
    }
}

/// A square of the lattice: from `node` one step along each of the two axes other than `axis`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Square {
    /// its lowest corner
    pub node: LatticeNode,
    /// the axis at right angles to it: 0, 1, 2 for x, y, z
    pub axis: u8,
}

impl Square {
    /// Its corners, counter-clockwise seen against `axis`.
    #[inline]
    pub(crate) fn corners(&self) -> [LatticeNode; 4] {
        ring(self.node, self.axis, 1)
    }

    /// Its edges: number i joins corners i and i + 1 of [`Self::corners`].
    #[inline]
    pub(crate) fn edges(&self) -> [Edge; 4] {
        ring_sides(self.node, self.axis, 1).map(|(node, axis)| Edge { node, axis })
    }

    /// The cell below it and the one above, along `axis`.
    #[inline]
    pub(crate) fn cells(&self) -> [LatticeNode; 2] {
        [stepped(self.node, self.axis as usize, -1), self.node]
    }
}

impl Key for Square {
    #[inline]
    fn bits(&self) -> u64 {
        self.node.bits() ^ (u64::from(self.axis) + 1) << 62
    }
}

/// The name of a vertex: faces that use the same name meet there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum VertexKey {
    /// a vertex of the scan
    Scan(VertexId),
    /// of a loop of the surface around a cell; loops are numbered from 0
    Cell(LatticeNode, u8),
    /// on a square between two cells of the region; for each segment of the surface there, numbered
    /// from 0
    Square(Square, u8),
    /// the sign change of f on an edge
    Edge(Edge),
    /// the crossing of an edge of the scan and a plane of the lattice
    Trace {
        /// the ends of the scan's edge, the smaller id first
        ends: [VertexId; 2],
        /// the axis at right angles to the plane
        axis: u8,
        /// number of the plane
        plane: i32,
    },
    /// the crossing of a face of the scan and an edge of the lattice
    Pierce(Edge, FaceId),
}

impl Key for VertexKey {
    #[inline]
    fn bits(&self) -> u64 {
        let mixed = |a: u64, b: u64| a.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29) ^ b;
        match *self {
            Self::Scan(vertex) => u64::from(vertex.0) << 32,
            Self::Cell(node, number) => mixed(u64::from(number) + 1, node.bits()),
            Self::Square(square, number) => mixed(u64::from(number) + 11, square.bits()),
            Self::Edge(edge) => mixed(21, edge.bits()),
            Self::Trace { ends, axis, plane } => {
                let edge = u64::from(ends[0].0) << 32 | u64::from(ends[1].0);
                mixed(edge, u64::from(plane as u32) << 2 | u64::from(axis))
            }
            Self::Pierce(edge, face) => mixed(u64::from(face.0), edge.bits()),
        }
    }
}

/// The part of the lattice or of the scan that owns a face of the patch; its faces depend on its
/// surroundings alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Owner {
    /// the surface around an edge with a sign change of f
    Edge(Edge),
    /// the fan from the region to the trace of the scan on a square that bounds it
    Square(Square),
    /// the remainder of a face of the scan outside the region
    Scan(FaceId),
}

impl Owner {
    /// Its node on the lattice; `None` for a face of the scan.
    pub(in crate::reconstruct) fn node(&self) -> Option<LatticeNode> {
        match self {
            Self::Edge(edge) => Some(edge.node),
            Self::Square(square) => Some(square.node),
            Self::Scan(_) => None,
        }
    }
}

impl Key for Owner {
    #[inline]
    fn bits(&self) -> u64 {
        match self {
            Self::Edge(edge) => edge.bits(),
            Self::Square(square) => square.bits().rotate_left(32),
            Self::Scan(face) => u64::from(face.0) << 32 | 5,
        }
    }
}

/// A new face, counter-clockwise seen from outside; corners are indices into the vertices of its
/// patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchFace {
    /// indices into the patch's vertices
    pub corners: [u32; 3],
    /// its owner
    pub owner: Owner,
}
