//! A face of the scan, cut by planes of the lattice into convex pieces that each lie in one cell.
//!
//! The support of a new point determines its name and its position, so the pieces of two
//! neighbouring faces have the same points on their common edge. The cell of a piece follows from
//! the cuts, not from its coordinates.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::lattice::{Edge, Lattice, LatticeNode, Square, VertexKey, across, stepped};
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// Origin of a side of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reconstruct) enum SideOrigin {
    /// the face's own side, from its corner of this number
    Face(u8),
    /// the plane that bounds the piece's cell at right angles to an axis, from below or from above
    Plane { axis: u8, above: bool },
}

/// Support of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reconstruct) enum PointSupport {
    /// a corner of the face
    Corner(u8),
    /// a side of the face and a plane of the lattice
    Trace { side: u8, axis: u8, plane: i32 },
    /// the inside of the face and a line of the lattice along `axis`, at `planes` of the two next
    /// axes
    Pierce { axis: u8, planes: [i32; 2] },
}

/// A convex piece: `count` corners from `first`.
#[derive(Clone, Copy, Debug)]
struct Span {
    cell: LatticeNode,
    first: u32,
    count: u32,
}

/// A corner of a piece and the side from there to the next corner.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct Corner {
    pub point: u32,
    pub side: SideOrigin,
}

/// The pieces of one face.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Pieces {
    pub face: FaceId,
    /// of the face, unit
    pub normal: Vector3<f64>,
    vertices: [VertexId; 3],
    triangle: [Point3<f64>; 3],
    points: Vec<(PointSupport, Point3<f64>)>,
    pierces: CellTable<[i32; 3], u32>,
    corners: Vec<Corner>,
    spans: Vec<Span>,
    /// the two halves of the piece being cut
    halves: [Vec<Corner>; 2],
}

impl Pieces {
    /// Cuts a face by the planes of the lattice between the cells from `lo` to `hi`; the outermost
    /// cells take the parts beyond.
    pub(crate) fn cut(
        &mut self,
        mesh: &TriMesh,
        face: FaceId,
        lattice: &Lattice,
        lo: LatticeNode,
        hi: LatticeNode,
    ) {
        (self.face, self.normal, self.vertices) = (face, mesh.normal(face), mesh.corners(face));
        self.triangle = mesh.triangle(face);
        self.points.clear();
        self.points
            .extend((0..3).map(|i| (PointSupport::Corner(i), self.triangle[i as usize])));
        self.pierces.clear();
        self.corners.clear();
        self.corners.extend((0..3).map(|i| Corner {
            point: u32::from(i),
            side: SideOrigin::Face(i),
        }));
        self.spans.clear();
        self.spans.push(Span {
            cell: lo,
            first: 0,
            count: 3,
        });
        for (axis, last) in hi.into_iter().enumerate() {
            for span in std::mem::take(&mut self.spans) {
                self.cut_along(span, axis, last, lattice);
            }
        }
    }

    /// The pieces and their cells.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (LatticeNode, &[Corner])> + '_ {
        self.spans
            .iter()
            .map(|span| (span.cell, self.corners_of(span)))
    }

    /// Position of a point, m, in O.
    pub(crate) fn position(&self, point: u32) -> Point3<f64> {
        self.points[point as usize].1
    }

    /// Support of a point.
    pub(crate) fn place(&self, point: u32) -> PointSupport {
        self.points[point as usize].0
    }

    /// Number of points.
    pub(crate) fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Name of a point of a piece in `cell`.
    pub(crate) fn key(&self, point: u32, cell: LatticeNode) -> VertexKey {
        match self.place(point) {
            PointSupport::Corner(i) => VertexKey::Scan(self.vertices[i as usize]),
            PointSupport::Trace { side, axis, plane } => {
                let (a, b) = (
                    self.vertices[side as usize],
                    self.vertices[(side as usize + 1) % 3],
                );
                VertexKey::Trace {
                    ends: [a.min(b), a.max(b)],
                    axis,
                    plane,
                }
            }
            PointSupport::Pierce { axis, planes } => {
                let (u, v) = across(axis as usize);
                let mut node = cell;
                (node[u], node[v]) = (planes[0], planes[1]);
                VertexKey::Pierce(Edge { node, axis }, self.face)
            }
        }
    }

    fn corners_of(&self, span: &Span) -> &[Corner] {
        &self.corners[span.first as usize..(span.first + span.count) as usize]
    }

    /// Cuts one piece by the planes across `axis` up to number `last`.
    fn cut_along(&mut self, mut span: Span, axis: usize, last: i32, lattice: &Lattice) {
        for plane in span.cell[axis].saturating_add(1)..=last {
            let height = lattice.coordinate(axis, plane);
            let above = self
                .corners_of(&span)
                .iter()
                .filter(|c| self.position(c.point)[axis] >= height)
                .count();
            if above == 0 {
                break;
            }
            if above < span.count as usize {
                let below = self.split(span, axis, plane, lattice);
                span = self.spans.pop().unwrap_or(span);
                self.spans.push(below);
            }
            span.cell[axis] = plane;
        }
        self.spans.push(span);
    }

    /// Splits a piece in two; returns the lower half and leaves the upper half as the last span.
    fn split(&mut self, span: Span, axis: usize, plane: i32, lattice: &Lattice) -> Span {
        let height = lattice.coordinate(axis, plane);
        let mut halves = std::mem::take(&mut self.halves);
        halves.iter_mut().for_each(Vec::clear);
        for i in 0..span.count {
            let corner = self.corners[(span.first + i) as usize];
            let next = self.corners[(span.first + (i + 1) % span.count) as usize];
            let is_above = self.position(corner.point)[axis] >= height;
            halves[usize::from(is_above)].push(corner);
            if is_above != (self.position(next.point)[axis] >= height) {
                let point = self.cut_side(&span, corner.side, axis, plane, lattice);
                let chord = SideOrigin::Plane {
                    axis: axis as u8,
                    above: !is_above,
                };
                halves[usize::from(is_above)].push(Corner { point, side: chord });
                halves[usize::from(!is_above)].push(Corner {
                    point,
                    side: corner.side,
                });
            }
        }
        let [below, above] = [&halves[0], &halves[1]].map(|half| {
            let first = self.corners.len() as u32;
            self.corners.extend_from_slice(half);
            Span {
                cell: span.cell,
                first,
                count: half.len() as u32,
            }
        });
        self.halves = halves;
        self.spans.push(above);
        below
    }

    /// The intersection of a plane with a side of a piece.
    fn cut_side(
        &mut self,
        span: &Span,
        side: SideOrigin,
        axis: usize,
        plane: i32,
        lattice: &Lattice,
    ) -> u32 {
        let next = self.points.len() as u32;
        match side {
            SideOrigin::Face(side) => {
                let place = PointSupport::Trace {
                    side,
                    axis: axis as u8,
                    plane,
                };
                self.points.push((
                    place,
                    self.trace(side as usize, axis, lattice.coordinate(axis, plane)),
                ));
                next
            }
            SideOrigin::Plane { axis: other, above } => {
                let other = other as usize;
                let other_plane = span.cell[other].saturating_add(i32::from(above));
                let line = 3 - axis - other;
                let planes = if across(line).0 == axis {
                    [plane, other_plane]
                } else {
                    [other_plane, plane]
                };
                let (at, is_new) = self
                    .pierces
                    .insert_with([planes[0], planes[1], line as i32], || next);
                if is_new {
                    let position = self.pierce(other, other_plane, axis, plane, lattice);
                    self.points.push((
                        PointSupport::Pierce {
                            axis: line as u8,
                            planes,
                        },
                        position,
                    ));
                    return next;
                }
                self.pierces.entry(at).1
            }
        }
    }

    /// Crossing of a side of the face and a plane; the same from either face at that edge.
    fn trace(&self, side: usize, axis: usize, height: f64) -> Point3<f64> {
        let ends = [side, (side + 1) % 3];
        let is_turned = self.vertices[ends[0]] > self.vertices[ends[1]];
        let [a, b] = if is_turned { [ends[1], ends[0]] } else { ends }.map(|i| self.triangle[i]);
        between(&a, &b, axis, height)
    }

    /// Intersection of the face and two planes: on the chord of the first plane.
    fn pierce(
        &self,
        first: usize,
        first_plane: i32,
        second: usize,
        plane: i32,
        lattice: &Lattice,
    ) -> Point3<f64> {
        let (at, height) = (
            lattice.coordinate(first, first_plane),
            lattice.coordinate(second, plane),
        );
        let is_above = self.triangle.map(|corner| corner[first] >= at);
        let mut chord = (0..3)
            .filter(|&i| is_above[i] != is_above[(i + 1) % 3])
            .map(|side| self.trace(side, first, at));
        match (chord.next(), chord.next()) {
            (Some(a), Some(b)) => between(&a, &b, second, height),
            // only if rounding lets a plane miss the face that it cuts
            _ => Point3::from(
                self.triangle[0]
                    .coords
                    .map_with_location(|i, _, x| match i {
                        i if i == first => at,
                        i if i == second => height,
                        _ => x,
                    }),
            ),
        }
    }
}

/// The point between `a` and `b` with coordinate `axis` equal to `height`: exact in that
/// coordinate, in the others never beyond the ends, and monotone in `height`.
fn between(a: &Point3<f64>, b: &Point3<f64>, axis: usize, height: f64) -> Point3<f64> {
    let rise = b[axis] - a[axis];
    let share = if rise == 0.0 {
        0.5
    } else {
        (height - a[axis]) / rise
    };
    let mut point = a + (b - a) * share;
    for i in 0..3 {
        point[i] = if i == axis {
            height
        } else {
            point[i].clamp(a[i].min(b[i]), a[i].max(b[i]))
        };
    }
    point
}

/// The lattice square under a side of a piece in `cell`, and the cell beyond it.
pub(in crate::reconstruct) fn wall(
    cell: LatticeNode,
    side: SideOrigin,
) -> Option<(Square, LatticeNode)> {
    let SideOrigin::Plane { axis, above } = side else {
        return None;
    };
    let upper = stepped(cell, axis as usize, i32::from(above));
    let beyond = stepped(cell, axis as usize, if above { 1 } else { -1 });
    Some((Square { node: upper, axis }, beyond))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardUniform};

    /// Two triangles on a common side, anywhere within a few cells.
    fn pair(rng: &mut rand_pcg::Pcg64) -> TriMesh {
        let mut coordinate =
            || <StandardUniform as Distribution<f64>>::sample(&StandardUniform, rng) * 4.0;
        let positions = (0..4)
            .map(|_| Point3::new(coordinate(), coordinate(), coordinate()))
            .collect();
        TriMesh::new(positions, vec![[0, 1, 2], [2, 1, 3]]).unwrap()
    }

    /// Each side between two pieces of a face lies on a plane of the lattice, and is a wall of
    /// both: on one square, each beyond the other.
    #[test]
    fn a_wall_between_two_pieces_is_the_same_from_both() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let lattice = Lattice {
            origin: Point3::new(0.1, 0.2, 0.3),
            pitch: 0.7,
        };
        let mut pieces = Pieces::default();
        let mut walls = 0;
        for _ in 0..100 {
            pieces.cut(&pair(&mut rng), FaceId(0), &lattice, [-1; 3], [7; 3]);
            let mut sides = Vec::new();
            for (cell, corners) in pieces.iter() {
                for (at, corner) in corners.iter().enumerate() {
                    let ends = [corner.point, corners[(at + 1) % corners.len()].point];
                    let Some((square, beyond)) = wall(cell, corner.side) else {
                        continue;
                    };
                    let axis = square.axis as usize;
                    let height = lattice.coordinate(axis, square.node[axis]);
                    assert!(
                        ends.iter()
                            .all(|&end| (pieces.position(end)[axis] - height).abs() < 1e-12)
                    );
                    let across = (0..3)
                        .filter(|&i| i != axis)
                        .all(|i| square.node[i] == cell[i]);
                    assert!(
                        across
                            && cell
                                .into_iter()
                                .zip(beyond)
                                .map(|(a, b)| a.abs_diff(b))
                                .sum::<u32>()
                                == 1
                    );
                    sides.push((
                        [ends[0].min(ends[1]), ends[0].max(ends[1])],
                        square,
                        [cell, beyond],
                    ));
                }
            }
            for (ends, square, [cell, beyond]) in &sides {
                let is_other = |other: &&([u32; 2], Square, [LatticeNode; 2])| {
                    other.0 == *ends && other.2 == [*beyond, *cell]
                };
                let others: Vec<_> = sides.iter().filter(is_other).collect();
                assert_eq!(others.len(), 1, "{square:?} is a wall of {cell:?} alone");
                assert_eq!(others[0].1, *square);
            }
            walls += sides.len();
        }
        assert!(walls > 1000, "{walls}");
    }

    #[test]
    fn pieces_cover_a_face_each_in_its_cell_and_meet_the_neighbours() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let lattice = Lattice {
            origin: Point3::new(0.1, 0.2, 0.3),
            pitch: 0.7,
        };
        let mut pieces = Pieces::default();
        for _ in 0..300 {
            let mesh = pair(&mut rng);
            let mut on_common_side = [Vec::new(), Vec::new()];
            for (face, points) in [FaceId(0), FaceId(1)].into_iter().zip(&mut on_common_side) {
                pieces.cut(&mesh, face, &lattice, [-1; 3], [7; 3]);
                let mut area = 0.0;
                for (cell, corners) in pieces.iter() {
                    let at = |i: usize| pieces.position(corners[i].point);
                    let double = |i: usize| (at(i) - at(0)).cross(&(at(i + 1) - at(0)));
                    area += (1..corners.len() - 1)
                        .map(|i| double(i).dot(&mesh.normal(face)))
                        .sum::<f64>();
                    let [lo, hi] = lattice.inner_box(cell, -1e-12);
                    assert!(
                        (0..corners.len()).all(|i| at(i) >= lo && at(i) <= hi),
                        "a piece leaves cell {cell:?}"
                    );
                }
                assert!((area - mesh.double_area_normal(face).norm()).abs() < 1e-12);
                let key = |point| pieces.key(point, [0; 3]);
                let is_common = |key: &VertexKey| matches!(key, VertexKey::Trace { ends, .. } if *ends == [VertexId(1), VertexId(2)]);
                let all = (0..pieces.point_count() as u32).map(|i| (key(i), pieces.position(i)));
                points.extend(all.filter(|(key, _)| is_common(key)));
                points.sort_by_key(|(key, _)| *key);
            }
            assert_eq!(
                on_common_side[0], on_common_side[1],
                "the same names and the same places, bit for bit"
            );
        }
    }
}
