//! The scan, clipped at the region: which faces go, what is left of those that the region cuts, and where they end.

use nalgebra::{Point2, Point3, Vector3};

use crate::mesh::{BoxQuery, FaceId, FaceTree, TriMesh};
use crate::reconstruct::LatticeRegion;
use crate::reconstruct::contour::boundary_loops::outline;
use crate::reconstruct::contour::clip::{Pieces, PointSupport, wall};
use crate::reconstruct::contour::triangulation::fill;
use crate::reconstruct::field::lattice::{CellBox, Edge, Lattice, LatticeNode, Owner, PatchFace, Square, VertexKey};
use crate::reconstruct::table::{CellTable, Key};

/// Side of the blocks of cells for which the faces nearby are looked up at once, in cells.
const BLOCK: i32 = 8;
/// How far new points are moved within what they lie on, as a share of the pitch: some tools take collinear sides of
/// coplanar faces for an intersection, and the cuts through one face leave them by the dozen.
const LOOSENING: f64 = 1e-7;
/// No segment.
const NONE: u32 = u32::MAX;

/// A piece of a trace: where one face of the scan crosses one square that bounds the region. Walking from `from` to `to`
/// with the face's normal up, the region is on the left.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct TraceSegment {
    pub from: u32,
    pub to: u32,
    pub normal: Vector3<f64>,
    next: u32,
}

/// Where the scan crosses an edge of the lattice.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct Pierced {
    pub vertex: u32,
    pub normal: Vector3<f64>,
    face: FaceId,
    /// whether another face crosses the same edge
    pub is_repeated: bool,
}

/// The scan, clipped at a region.
///
/// Depends on the scan and the region, not on the field.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// faces of the scan that the region holds or cuts, by id
    pub removed: Vec<FaceId>,
    /// what is left of the faces that it cuts
    pub faces: Vec<PatchFace>,
    /// faces that it cuts so close to a corner that rounding hides what is left of them; they go without a remainder
    pub lost: Vec<FaceId>,
    /// vertices that the remainders and the traces use, m, in O
    pub vertices: CellTable<VertexKey, Point3<f64>>,
    pitch: f64,
    segments: Vec<TraceSegment>,
    /// the last segment of each square that the scan crosses on the rim of the region
    squares: CellTable<Square, u32>,
    pierced: CellTable<Edge, Pierced>,
}

/// Buffers that serve one face after the other.
#[derive(Default)]
struct Scratch {
    pieces: Pieces,
    /// index of each point among the vertices, [`NONE`] before it is needed
    vertex_of: Vec<u32>,
    plane: Vec<Point2<f64>>,
}

impl Cut {
    /// Clips `scan` at the squares that bound `region`.
    pub fn new(lattice: &Lattice, region: &LatticeRegion, scan: &TriMesh, tree: &FaceTree) -> Self {
        let faces = faces_near(lattice, region.iter().map(|(cell, ())| cell), tree);
        Self::of_faces(lattice, region, &bounds_of(region), scan, &faces)
    }

    /// Clips `faces` of `scan`, each as a whole, at the squares that bound `region`.
    ///
    /// - `bounds`: a box that holds the region.
    pub(in crate::reconstruct) fn of_faces(
        lattice: &Lattice,
        region: &LatticeRegion,
        bounds: &CellBox,
        scan: &TriMesh,
        faces: &[FaceId],
    ) -> Self {
        let mut cut = Self { pitch: lattice.pitch, ..Self::default() };
        let mut scratch = Scratch::default();
        for &face in faces {
            cut.take(lattice, region, scan, face, bounds, &mut scratch);
        }
        cut
    }

    /// The segments on a square on the rim of the region.
    pub(in crate::reconstruct) fn segments_on(&self, square: &Square) -> impl Iterator<Item = &TraceSegment> + '_ {
        let mut at = self.squares.get(square).copied().unwrap_or(NONE);
        std::iter::from_fn(move || {
            let segment = self.segments.get(at as usize)?;
            at = segment.next;
            Some(segment)
        })
    }

    /// Where the scan crosses an edge on the rim of the region.
    pub(in crate::reconstruct) fn pierced(&self, edge: &Edge) -> Option<&Pierced> {
        self.pierced.get(edge)
    }

    /// Clips one face.
    fn take(
        &mut self,
        lattice: &Lattice,
        region: &LatticeRegion,
        scan: &TriMesh,
        face: FaceId,
        bounds: &CellBox,
        scratch: &mut Scratch,
    ) {
        let cells = cells_around(lattice, scan, face);
        let Some(held) = held_within(region, &cells, bounds) else { return };
        if held.is_all {
            self.removed.push(face);
            return;
        }
        let CellBox { lo, hi } = cells.meet(&held.cells.widened(1, 1));
        scratch.pieces.cut(scan, face, lattice, lo, hi);
        if scratch.pieces.iter().all(|(cell, _)| !region.contains(&cell)) {
            return;
        }
        self.removed.push(face);
        scratch.vertex_of.clear();
        scratch.vertex_of.resize(scratch.pieces.point_count(), NONE);
        self.take_segments(region, face, scan.normal(face), scratch);
        self.take_remainder(region, face, scan.double_area_normal(face), scratch);
    }

    /// Notes where the face crosses the rim of the region.
    fn take_segments(&mut self, region: &LatticeRegion, face: FaceId, normal: Vector3<f64>, scratch: &mut Scratch) {
        let Scratch { pieces, vertex_of, .. } = scratch;
        for (cell, corners) in pieces.iter().filter(|(cell, _)| region.contains(cell)) {
            for (i, corner) in corners.iter().enumerate() {
                let Some((square, beyond)) = wall(cell, corner.side) else { continue };
                if region.contains(&beyond) {
                    continue;
                }
                let next = corners[(i + 1) % corners.len()];
                let [from, to] = [corner.point, next.point]
                    .map(|point| self.rim_vertex(pieces, face, point, cell, normal, vertex_of));
                let last = self.segments.len() as u32;
                let (at, is_new) = self.squares.insert_with(square, || last);
                let before = if is_new { NONE } else { self.squares.entry(at).1 };
                self.squares.insert(square, last);
                self.segments.push(TraceSegment { from, to, normal, next: before });
            }
        }
    }

    /// The vertex of a point on the rim of the region; notes which edge of the lattice it is on.
    fn rim_vertex(
        &mut self,
        pieces: &Pieces,
        face: FaceId,
        point: u32,
        cell: LatticeNode,
        normal: Vector3<f64>,
        vertex_of: &mut [u32],
    ) -> u32 {
        let vertex = self.vertex(pieces, face, point, cell, vertex_of);
        if let VertexKey::Pierce(edge, _) = self.vertices.entry(vertex).0 {
            let new = Pierced { vertex, normal, face, is_repeated: false };
            let (_, is_new) = self.pierced.insert_with(edge, || new);
            if !is_new && let Some(known) = self.pierced.get_mut(&edge) {
                known.is_repeated |= known.face != face;
            }
        }
        vertex
    }

    fn vertex(&mut self, pieces: &Pieces, face: FaceId, point: u32, cell: LatticeNode, vertex_of: &mut [u32]) -> u32 {
        let known = &mut vertex_of[point as usize];
        if *known == NONE {
            let key = pieces.key(face, point, cell);
            (*known, _) = self.vertices.insert_with(key, || loosened(key, pieces.position(point), self.pitch));
        }
        *known
    }

    /// Fills what the region leaves of the face with triangles.
    fn take_remainder(&mut self, region: &LatticeRegion, face: FaceId, normal: Vector3<f64>, scratch: &mut Scratch) {
        let loops = outline(&scratch.pieces, region);
        let Scratch { pieces, vertex_of, plane } = scratch;
        // seen along the normal
        let across = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).try_normalize(0.0).unwrap_or_else(Vector3::x);
        let up = normal.cross(&across).try_normalize(0.0).unwrap_or_else(Vector3::y);
        let origin = pieces.position(0);
        plane.clear();
        plane.extend((0..pieces.point_count() as u32).map(|i| {
            let x = pieces.position(i) - origin;
            Point2::new(x.dot(&across), x.dot(&up))
        }));
        let Some(triangles) = fill(plane, &loops) else {
            self.lost.push(face);
            return;
        };
        for corners in triangles {
            // every pierced point of an outline is on the rim and has its vertex already
            let corners = corners.map(|point| {
                debug_assert!(
                    vertex_of[point as usize] != NONE || !matches!(pieces.place(point), PointSupport::Pierce { .. })
                );
                self.vertex(pieces, face, point, [0; 3], vertex_of)
            });
            self.faces.push(PatchFace { corners, owner: Owner::Scan(face) });
        }
    }
}

/// A point moved by up to [`LOOSENING`] in the plane, or on the edge, of the lattice it lies on; the same for the same name.
fn loosened(key: VertexKey, mut point: Point3<f64>, pitch: f64) -> Point3<f64> {
    let mut move_along = |axis: usize| {
        let bits = (key.bits() ^ axis as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        point[axis] += LOOSENING * pitch * ((bits >> 32) as f64 / f64::from(u32::MAX) - 0.5) * 2.0;
    };
    match key {
        VertexKey::Trace { axis, .. } => (0..3).filter(|&i| i != axis as usize).for_each(move_along),
        VertexKey::Pierce(edge, _) => move_along(edge.axis as usize),
        _ => {}
    }
    point
}

/// The box of the cells that a face may meet.
pub(in crate::reconstruct) fn cells_around(lattice: &Lattice, scan: &TriMesh, face: FaceId) -> CellBox {
    let [a, b, c] = scan.triangle(face);
    let (lo, hi) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    CellBox { lo: lattice.cell_of(&lo), hi: lattice.cell_of(&hi) }
}

/// The cells of the region within a box.
struct CellsInBox {
    cells: CellBox,
    is_all: bool,
}

/// The cells of the region in `cells`; `None` when there are none.
fn held_within(region: &LatticeRegion, cells: &CellBox, bounds: &CellBox) -> Option<CellsInBox> {
    let mut held = CellsInBox { cells: CellBox::EMPTY, is_all: false };
    let mut count = 0u32;
    cells.meet(bounds).each_in(region, |cell, ()| {
        count += 1;
        held.cells.take(&cell);
    });
    held.is_all = f64::from(count) == cells.volume();
    (count > 0).then_some(held)
}

/// A box around the region.
fn bounds_of(region: &LatticeRegion) -> CellBox {
    let mut bounds = CellBox::EMPTY;
    region.iter().for_each(|(cell, ())| bounds.take(&cell));
    bounds
}

/// The faces of the scan that may meet any of `cells`, by id.
pub(in crate::reconstruct) fn faces_near(
    lattice: &Lattice,
    cells: impl Iterator<Item = LatticeNode>,
    tree: &FaceTree,
) -> Vec<FaceId> {
    let blocks: CellTable<LatticeNode, ()> = cells.map(|cell| cell.map(|x| x.div_euclid(BLOCK))).collect();
    let (mut faces, mut query) = (Vec::new(), BoxQuery::default());
    for (block, ()) in blocks.iter() {
        let lo = block.map(|x| x.saturating_mul(BLOCK));
        let hi = lo.map(|x| x.saturating_add(BLOCK));
        tree.faces_in_box(&lattice.position(lo), &lattice.position(hi), &mut query);
        faces.extend_from_slice(&query.faces);
    }
    faces.sort_unstable();
    faces.dedup();
    faces
}
