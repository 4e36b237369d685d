//! The scan, clipped at the region: removed faces, remainders of cut faces, and their rims.

use nalgebra::{Point2, Point3, Vector3};

use crate::reconstruct::contour::clip::{Pieces, PointSupport, SideOrigin, wall};
use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::lattice::{
    CellBox, Edge, Lattice, LatticeNode, LatticeRegion, Owner, PatchFace, Square, VertexKey,
};
use crate::reconstruct::table::{CellTable, Key};
use touchup_geometry::mesh::{BoxQuery, FaceId, FaceTree, TriMesh, fill};
use touchup_geometry::numeric::{direction, distinct};

/// Side of the blocks for joint look-ups of nearby faces, in cells.
const BLOCK: i32 = 8;
/// Maximum shift of new points within their support, as a share of the pitch: some tools take
/// collinear sides of coplanar faces for an intersection, and the cuts through one face leave
/// dozens of them.
const LOOSENING: f64 = 1e-7;
/// No vertex.
const NONE: u32 = u32::MAX;

/// A piece of a trace: the crossing of one face of the scan and one square that bounds the region.
/// Walking from `from` to `to` with the face's normal up, the region is on the left.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct TraceSegment {
    pub from: u32,
    pub to: u32,
    pub normal: Vector3<f64>,
}

/// Crossing of the scan and an edge of the lattice.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct ScanCrossing {
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
    /// the patch without new faces inside the region: the faces of the scan that the region holds
    /// or cuts, their remainders, and the vertices of remainders and traces
    pub patch: Patch,
    /// faces cut so close to a corner that rounding hides the remainder; removed without one
    pub lost: Vec<FaceId>,
    pitch: f64,
    /// the segments on each square on the rim of the region
    segments: CellTable<Square, Vec<TraceSegment>>,
    pierced: CellTable<Edge, ScanCrossing>,
}

/// Buffers reused from face to face.
#[derive(Default)]
struct Scratch {
    pieces: Pieces,
    /// index of each point among the vertices, [`NONE`] before use
    vertex_of: Vec<u32>,
    plane: Vec<Point2<f64>>,
}

impl Cut {
    /// Clips `scan` at the squares that bound `region`.
    pub fn new(lattice: &Lattice, region: &LatticeRegion, scan: &TriMesh, tree: &FaceTree) -> Self {
        let faces = faces_near(lattice, region.iter().map(|(cell, ())| cell), tree);
        let mut bounds = CellBox::EMPTY;
        region.iter().for_each(|(cell, ())| bounds.take(&cell));
        Self::of_faces(lattice, region, &bounds, scan, &faces)
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
        let mut cut = Self {
            pitch: lattice.pitch,
            ..Self::default()
        };
        let mut scratch = Scratch::default();
        for &face in faces {
            let cells = cells_around(lattice, scan, face);
            let (mut held, mut count) = (CellBox::EMPTY, 0u32);
            cells.meet(bounds).each_in(region, |cell, ()| {
                held.take(&cell);
                count += 1;
            });
            if count > 0 && f64::from(count) == cells.volume() {
                cut.patch.removed.push(face);
            } else if count > 0 {
                let CellBox { lo, hi } = cells.meet(&held.widened(1, 1));
                scratch.pieces.cut(scan, face, lattice, lo, hi);
                cut.take(region, &mut scratch, &scan.double_area_normal(face));
            }
        }
        cut
    }

    /// The segments on a square on the rim of the region, in reverse order.
    pub(in crate::reconstruct) fn segments_on(
        &self,
        square: &Square,
    ) -> impl Iterator<Item = &TraceSegment> + '_ {
        self.segments
            .get(square)
            .into_iter()
            .flat_map(|segments| segments.iter().rev())
    }

    /// Crossing of the scan and an edge on the rim of the region.
    pub(in crate::reconstruct) fn pierced(&self, edge: &Edge) -> Option<&ScanCrossing> {
        self.pierced.get(edge)
    }

    /// Adds the pieces of a face, if the region holds any of them.
    fn take(
        &mut self,
        region: &LatticeRegion,
        scratch: &mut Scratch,
        double_area_normal: &Vector3<f64>,
    ) {
        let Scratch {
            pieces, vertex_of, ..
        } = scratch;
        if pieces.iter().all(|(cell, _)| !region.contains(&cell)) {
            return;
        }
        self.patch.removed.push(pieces.face);
        vertex_of.clear();
        vertex_of.resize(pieces.point_count(), NONE);
        for (cell, corners) in pieces.iter().filter(|(cell, _)| region.contains(cell)) {
            for (i, corner) in corners.iter().enumerate() {
                let Some((square, beyond)) = wall(cell, corner.side) else {
                    continue;
                };
                if region.contains(&beyond) {
                    continue;
                }
                let ends = [corner.point, corners[(i + 1) % corners.len()].point];
                let [from, to] = ends.map(|point| self.vertex(pieces, point, cell, vertex_of));
                self.segments.get_or_default(square).push(TraceSegment {
                    from,
                    to,
                    normal: pieces.normal,
                });
            }
        }
        self.take_remainder(region, double_area_normal, scratch);
    }

    /// The vertex of a point; records its lattice edge.
    fn vertex(
        &mut self,
        pieces: &Pieces,
        point: u32,
        cell: LatticeNode,
        vertex_of: &mut [u32],
    ) -> u32 {
        let known = vertex_of[point as usize];
        if known != NONE {
            return known;
        }
        let key = pieces.key(point, cell);
        let (vertex, _) = self
            .patch
            .vertices
            .insert_with(key, || loosened(key, pieces.position(point), self.pitch));
        vertex_of[point as usize] = vertex;
        if let VertexKey::Pierce(edge, face) = key {
            let new = || ScanCrossing {
                vertex,
                normal: pieces.normal,
                face,
                is_repeated: false,
            };
            let (at, _) = self.pierced.insert_with(edge, new);
            let known = self.pierced.value_mut(at);
            known.is_repeated |= known.face != face;
        }
        vertex
    }

    /// Triangulates the remainder of a face outside the region.
    fn take_remainder(
        &mut self,
        region: &LatticeRegion,
        normal: &Vector3<f64>,
        scratch: &mut Scratch,
    ) {
        let loops = outline(&scratch.pieces, region);
        let Scratch {
            pieces,
            vertex_of,
            plane,
        } = scratch;
        // seen along the normal
        let across =
            direction(&normal.cross(&Vector3::ith(normal.iamin(), 1.0))).unwrap_or_else(Vector3::x);
        let up = direction(&normal.cross(&across)).unwrap_or_else(Vector3::y);
        let origin = pieces.position(0);
        plane.clear();
        plane.extend((0..pieces.point_count() as u32).map(|i| {
            let x = pieces.position(i) - origin;
            Point2::new(x.dot(&across), x.dot(&up))
        }));
        let Some(triangles) = fill(plane, &loops) else {
            self.lost.push(pieces.face);
            return;
        };
        for corners in triangles {
            // every pierced point of an outline is on the rim and already has its vertex
            let corners = corners.map(|point| {
                debug_assert!(
                    vertex_of[point as usize] != NONE
                        || !matches!(pieces.place(point), PointSupport::Pierce { .. })
                );
                self.vertex(pieces, point, [0; 3], vertex_of)
            });
            self.patch.faces.push(PatchFace {
                corners,
                owner: Owner::Scan(pieces.face),
            });
        }
    }
}

/// A point shifted by up to [`LOOSENING`] within its plane, or along its edge, of the lattice; the
/// same for the same name.
fn loosened(key: VertexKey, mut point: Point3<f64>, pitch: f64) -> Point3<f64> {
    let mut move_along = |axis: usize| {
        let bits = (key.bits() ^ axis as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        point[axis] += LOOSENING * pitch * ((bits >> 32) as f64 / f64::from(u32::MAX) - 0.5) * 2.0;
    };
    match key {
        VertexKey::Trace { axis, .. } => {
            (0..3).filter(|&i| i != axis as usize).for_each(move_along)
        }
        VertexKey::Pierce(edge, _) => move_along(edge.axis as usize),
        _ => {}
    }
    point
}

/// Box of the cells that a face may meet.
pub(in crate::reconstruct) fn cells_around(
    lattice: &Lattice,
    scan: &TriMesh,
    face: FaceId,
) -> CellBox {
    let [a, b, c] = scan.triangle(face);
    let (lo, hi) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    CellBox {
        lo: lattice.cell_of(&lo),
        hi: lattice.cell_of(&hi),
    }
}

/// Faces of the scan that may meet any of `cells`, by id.
pub(in crate::reconstruct) fn faces_near(
    lattice: &Lattice,
    cells: impl Iterator<Item = LatticeNode>,
    tree: &FaceTree,
) -> Vec<FaceId> {
    let blocks: CellTable<LatticeNode, ()> = cells
        .map(|cell| cell.map(|x| x.div_euclid(BLOCK)))
        .collect();
    let (mut faces, mut query) = (Vec::new(), BoxQuery::default());
    for (block, ()) in blocks.iter() {
        let lo = block.map(|x| x.saturating_mul(BLOCK));
        let hi = lo.map(|x| x.saturating_add(BLOCK));
        tree.faces_in_box(&lattice.position(lo), &lattice.position(hi), &mut query);
        faces.extend_from_slice(&query.faces);
    }
    distinct(faces)
}

/// A side of a piece on the rim of the remainder.
struct PieceRim {
    from: u32,
    to: u32,
    side: SideOrigin,
    piece: u32,
    is_used: bool,
}

/// Loops around all pieces with cells outside the region.
fn outline(pieces: &Pieces, region: &LatticeRegion) -> Vec<Vec<u32>> {
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
    let ends_at = |cell: LatticeNode, side: SideOrigin| {
        wall(cell, side).is_none_or(|(_, beyond)| region.contains(&beyond))
    };
    let mut rims = Vec::new();
    for (piece, (cell, corners)) in pieces
        .iter()
        .enumerate()
        .filter(|(_, (cell, _))| !region.contains(cell))
    {
        for (i, corner) in corners
            .iter()
            .enumerate()
            .filter(|(_, corner)| ends_at(cell, corner.side))
        {
            let to = corners[(i + 1) % corners.len()].point;
            rims.push(PieceRim {
                from: corner.point,
                to,
                side: corner.side,
                piece: piece as u32,
                is_used: false,
            });
        }
    }
    rims
}

/// The side after side `i`: of the same piece if possible, so that two parts that meet at a point
/// stay separate.
fn next(rims: &[PieceRim], i: usize) -> Option<usize> {
    let follows = |j: &usize| !rims[*j].is_used && rims[*j].from == rims[i].to;
    let same = (0..rims.len()).find(|j| follows(j) && rims[*j].piece == rims[i].piece);
    same.or_else(|| (0..rims.len()).find(follows))
}

/// The points of a loop, without points on a side of the face at which neither this face nor its
/// neighbour ends.
fn kept_points(pieces: &Pieces, rims: &[PieceRim], corners: &[usize]) -> Vec<u32> {
    let is_kept = |at: usize| {
        let (before, here) = (
            &rims[corners[(at + corners.len() - 1) % corners.len()]],
            &rims[corners[at]],
        );
        let is_trace = matches!(pieces.place(here.from), PointSupport::Trace { .. });
        !(is_trace && before.side == here.side)
    };
    (0..corners.len())
        .filter(|&at| is_kept(at))
        .map(|at| rims[corners[at]].from)
        .collect()
}
