//! The surface inside the region, by dual contouring that cannot intersect itself.
//!
//! Around each cell the surface runs in closed loops over its squares; each loop has one vertex
//! inside the cell, and the surface in the cell is the cone from there to the loop. If a shortcut
//! is safe, the four cones around an edge become two triangles. On the rim of the region the loops
//! follow the traces of the scan.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::contour::crossing::Crossing;
use crate::reconstruct::contour::dual::{bend, diagonal, passes, unfolded};
use crate::reconstruct::contour::loops::{
    Loops, NONE, edge_corners, edge_of, number_in, ring_corners, ring_edges, segments, square_of,
};
use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::contour::qef::Planes;
use crate::reconstruct::contour::scan_clipping::{Cut, TraceSegment};
use crate::reconstruct::contour::trace::Polyline;
use crate::reconstruct::lattice::{
    CellBox, Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, Owner, PatchFace, Square,
    VertexKey, node_at,
};
use crate::reconstruct::table::CellTable;

/// Share of their sum below which eigenvalues of a cell's planes are noise: two planes make an edge
/// at more than 2 · atan √(share / (1 − share)) to each other, 37°.
const FLAT_SHARE: f64 = 0.1;
/// Minimum distance of a vertex from the sides of its cell, as a share of the pitch: keeps
/// triangles from losing their area.
const MARGIN: f64 = 1e-3;
/// Maximum distance of a fan's middle from the surface to keep the fan from folding over, as a
/// share of the pitch.
const DRIFT: f64 = 0.05;

/// Meshes the zero set of a field inside `region` and joins it to the scan along the traces of
/// `cut`.
///
/// - `values`: f at all corners of the cells of the region; a cell without is left out.
/// - `cut`: the scan clipped at this region.
/// - `crossing`: the crossing of an edge with ends of opposite sign; called once for each, in a
///   fixed order.
pub fn contour(
    lattice: &Lattice,
    region: &LatticeRegion,
    values: &NodeValues,
    cut: &Cut,
    crossing: impl FnMut(&Edge) -> Crossing,
) -> Patch {
    contour_in(lattice, region, &CellBox::ALL, values, cut, crossing)
}

/// As [`contour`], but only the new faces that touch a cell in `core`; the rest of the patch is
/// incomplete.
///
/// - `values`: f at all corners of the cells of the region in `core` and around it.
/// - `cut`: the scan clipped at least in the cells up to two away from `core`.
pub(in crate::reconstruct) fn contour_in(
    lattice: &Lattice,
    region: &LatticeRegion,
    core: &CellBox,
    values: &NodeValues,
    cut: &Cut,
    crossing: impl FnMut(&Edge) -> Crossing,
) -> Patch {
    let mut skin = SurfaceBuilder {
        lattice,
        region,
        core,
        values,
        cut,
        crossing,
        cells: CellTable::default(),
        crossings: CellTable::default(),
        shared: CellTable::default(),
        fans: Vec::new(),
        rim: Vec::new(),
        planes: Planes::default(),
        moved: Vec::new(),
        patch: cut.patch.clone(),
    };
    core.widened(1, 1)
        .each_in(region, |cell, ()| skin.take_cell(cell));
    for at in 0..skin.cells.len() as u32 {
        skin.close_edges(at);
    }
    let SurfaceBuilder {
        mut patch,
        fans,
        moved,
        ..
    } = skin;
    patch.faces.extend(fans);
    moved
        .into_iter()
        .for_each(|(vertex, point)| *patch.vertices.value_mut(vertex) = point);
    patch
}

/// A cell on the surface.
#[derive(Clone, Copy, Debug)]
struct SurfaceCell {
    /// bit i: corner i is in the material
    material: u8,
    /// number of the loop at each edge
    loop_at: [u8; 12],
    loops: u8,
    /// vertex of loop 0; the others follow
    vertex: u32,
}

impl SurfaceCell {
    #[inline]
    fn is_material(&self, corner: u8) -> bool {
        self.material >> corner & 1 == 1
    }

    #[inline]
    fn vertex_at(&self, edge: u8) -> u32 {
        self.vertex + u32::from(self.loop_at[edge as usize])
    }
}

/// The surface under construction.
struct SurfaceBuilder<'a, F> {
    lattice: &'a Lattice,
    region: &'a LatticeRegion,
    core: &'a CellBox,
    values: &'a NodeValues,
    cut: &'a Cut,
    crossing: F,
    cells: CellTable<LatticeNode, SurfaceCell>,
    /// vertex and normal at the crossing of an edge
    crossings: CellTable<Edge, (u32, Vector3<f64>)>,
    /// squares on which patch and scan meet
    shared: CellTable<Square, ()>,
    /// from the cells on the rim to the segments of the traces
    fans: Vec<PatchFace>,
    /// the traces around the current cell: the number of the square, and a polyline against the
    /// loop with edges numbered in the cell
    rim: Vec<(u8, Polyline)>,
    planes: Planes,
    /// middles of fans, to move once all faces exist
    moved: Vec<(u32, Point3<f64>)>,
    patch: Patch,
}

impl<F: FnMut(&Edge) -> Crossing> SurfaceBuilder<'_, F> {
    /// Finds the loops of a cell and places their vertices.
    fn take_cell(&mut self, node: LatticeNode) {
        let Some(material) = self.material(node) else {
            return;
        };
        let is_crossed = material != 0 && material != u8::MAX;
        let mut loops = Loops::EMPTY;
        self.rim.clear();
        for side in 0..6 {
            let square = square_of(node, side);
            let beyond = square.cells()[side as usize % 2];
            if !self.region.contains(&beyond)
                && let Some(lines) = self.trace_on(&square, beyond)
            {
                let ring = ring_edges(side);
                for line in lines {
                    let (from, to) = (ring[line.from as usize], ring[line.to as usize]);
                    loops.link(to, from, side);
                    self.rim.push((side, Polyline { from, to, ..line }));
                }
            } else if is_crossed {
                let signs = ring_corners(side).map(|corner| material >> corner & 1 == 1);
                let found = segments(signs, || self.is_joined(&square));
                found
                    .into_iter()
                    .flatten()
                    .for_each(|segment| loops.add(side, segment));
            }
        }
        if is_crossed {
            self.place_vertices(node, material, &loops);
        }
    }

    /// Bit i of the result: corner i is in the material. `None` if the field has no value.
    fn material(&self, cell: LatticeNode) -> Option<u8> {
        (0..8).try_fold(0, |material, corner| {
            let value = self.values.get(&node_at(cell, corner))?;
            Some(material | u8::from(*value < 0.0) << corner)
        })
    }

    /// Whether the material in opposite corners of a square is connected: the sign in the middle,
    /// the same for both cells.
    fn is_joined(&self, square: &Square) -> bool {
        square
            .corners()
            .iter()
            .filter_map(|node| self.values.get(node))
            .sum::<f64>()
            < 0.0
    }

    /// The trace on a square on the rim of the region; `None` if patch and scan cannot meet there.
    fn trace_on(&mut self, square: &Square, beyond: LatticeNode) -> Option<Vec<Polyline>> {
        let lines = self.cut.trace_on(square, self.values);
        match &lines {
            Some(lines) if !lines.is_empty() => self.shared.insert(*square, ()),
            None if square.cells().iter().any(|cell| self.core.contains(cell)) => {
                self.patch.open.push(self.cut.open_square(*square, beyond));
            }
            _ => {}
        }
        lines
    }

    /// One vertex for each loop of a cell.
    fn place_vertices(&mut self, node: LatticeNode, material: u8, loops: &Loops) {
        let (loop_at, count) = loops.numbers();
        let mut points = [Point3::origin(); 4];
        for (number, point) in (0..count).zip(&mut points) {
            let first = (0..12)
                .find(|&edge| loop_at[edge as usize] == number)
                .unwrap_or(0);
            self.gather_planes(node, loops, first);
            let mean = self.planes.mean();
            let bounds = self.lattice.inner_box(node, MARGIN);
            let start = mean.sup(&bounds[0]).inf(&bounds[1]);
            *point = if count == 1 {
                self.planes.solve(&start, FLAT_SHARE, &bounds)
            } else {
                start
            };
        }
        // the crossings on the loops now have their vertices
        let vertex = self.patch.vertices.len() as u32;
        for (number, point) in (0..count).zip(points) {
            self.patch
                .vertices
                .insert(VertexKey::Cell(node, number), point);
        }
        let cell = SurfaceCell {
            material,
            loop_at,
            loops: count,
            vertex,
        };
        self.cells.insert(node, cell);
        for (side, line) in self.rim.iter().filter(|_| self.core.contains(&node)) {
            let (owner, vertex) = (
                Owner::Square(square_of(node, *side)),
                cell.vertex_at(line.from),
            );
            let corners = line
                .segments
                .iter()
                .map(|segment| [vertex, segment.from, segment.to]);
            self.fans
                .extend(corners.map(|corners| PatchFace { corners, owner }));
        }
    }

    /// The planes on the loop from edge `first`: one at each crossing, and along each trace the
    /// planes of the scan's faces, each with its share of the trace.
    fn gather_planes(&mut self, node: LatticeNode, loops: &Loops, first: u8) {
        self.planes.0.clear();
        for (edge, side) in loops.walk(first) {
            let (vertex, normal) = self.crossing(&edge_of(node, edge));
            self.planes
                .0
                .push((self.patch.vertices.entry(vertex).1, normal, 1.0));
            let rim = self
                .rim
                .iter()
                .find(|(of, line)| *of == side && line.to == edge);
            let Some((_, Polyline { segments, .. })) = rim else {
                continue;
            };
            let ends = |segment: &TraceSegment| {
                [segment.from, segment.to].map(|v| self.patch.vertices.entry(v).1)
            };
            let length = |segment: &TraceSegment| {
                let [a, b] = ends(segment);
                (b - a).norm()
            };
            let total: f64 = segments.iter().map(length).sum();
            for segment in segments.iter().filter(|_| total > 0.0) {
                let [a, b] = ends(segment);
                self.planes.0.push((
                    nalgebra::center(&a, &b),
                    segment.normal,
                    length(segment) / total,
                ));
            }
        }
    }

    /// Vertex and normal of the surface on an edge: the scan's if patch and scan agree on it, else
    /// the field's.
    fn crossing(&mut self, edge: &Edge) -> (u32, Vector3<f64>) {
        if let Some(known) = self.crossings.get(edge) {
            return *known;
        }
        let found = match self.cut.shared_crossing(edge, self.values) {
            Some(pierced) => (pierced.vertex, pierced.normal),
            None => {
                let Crossing { point, normal } = (self.crossing)(edge);
                let point = self.lattice.clamped(point, edge.node, edge.end(), MARGIN);
                let (vertex, _) = self
                    .patch
                    .vertices
                    .insert_with(VertexKey::Edge(*edge), || point);
                (vertex, normal)
            }
        };
        self.crossings.insert(*edge, found);
        found
    }

    /// Makes the faces around the edges of a cell that no earlier cell owns.
    fn close_edges(&mut self, at: u32) {
        let (node, cell) = *self.cells.entry(at);
        for number in (0..12).filter(|&number| cell.loop_at[number as usize] != NONE) {
            let edge = edge_of(node, number);
            let around = edge.cells().map(|node| self.cells.index_of(&node));
            let is_wanted = edge.cells().iter().any(|cell| self.core.contains(cell));
            if is_wanted && around.iter().flatten().min() == Some(&at) {
                self.close_edge(&edge, around, cell.is_material(edge_corners(number)[0]));
            }
        }
    }

    /// The faces around one edge.
    ///
    /// - `around`: the cells of the region there.
    /// - `is_upward`: whether the material is at the edge's lower end.
    fn close_edge(&mut self, edge: &Edge, around: [Option<u32>; 4], is_upward: bool) {
        let vertices: [Option<u32>; 4] = std::array::from_fn(|i| {
            around[i].map(|at| self.cells.entry(at).1.vertex_at(number_in(edge.axis, i)))
        });
        let squares = edge.squares();
        let middles: [Option<u32>; 4] = std::array::from_fn(|i| {
            let pair = [around[i]?, around[(i + 1) % 4]?];
            self.middle(
                edge,
                &squares[i],
                pair,
                [vertices[i]?, vertices[(i + 1) % 4]?],
            )
        });
        if let ([Some(a), Some(b), Some(c), Some(d)], [None, None, None, None]) =
            (vertices, middles)
        {
            let corners = [a, b, c, d];
            let points = corners.map(|v| self.patch.vertices.entry(v).1);
            let ends = [edge.node, edge.end()].map(|node| self.lattice.position(node));
            if let Some(i) = diagonal(&ends[0], &ends[1], &points, self.lattice.pitch) {
                self.add_face(
                    edge,
                    is_upward,
                    [corners[i], corners[i + 1], corners[i + 2]],
                );
                self.add_face(
                    edge,
                    is_upward,
                    [corners[i], corners[i + 2], corners[(i + 3) % 4]],
                );
                return;
            }
        }
        let (centre, normal) = self.crossing(edge);
        if let [Some(a), Some(b), Some(c), Some(d)] = vertices {
            self.unfold(edge, (centre, &normal), is_upward, [a, b, c, d], middles);
        }
        for i in 0..4 {
            let (Some(from), Some(to)) = (vertices[i], vertices[(i + 1) % 4]) else {
                continue;
            };
            if !self.is_fanned(i, &vertices, &squares) {
                continue;
            }
            let between = middles[i].unwrap_or(to);
            self.add_face(edge, is_upward, [centre, from, between]);
            if between != to {
                self.add_face(edge, is_upward, [centre, between, to]);
            }
        }
    }

    /// Moves the middle of a full fan around an edge so that it does not fold over; a vertex of the
    /// scan stays.
    fn unfold(
        &mut self,
        edge: &Edge,
        (centre, normal): (u32, &Vector3<f64>),
        is_upward: bool,
        vertices: [u32; 4],
        middles: [Option<u32>; 4],
    ) {
        if self.cut.shared_crossing(edge, self.values).is_some() {
            return;
        }
        let at = |vertex: u32| self.patch.vertices.entry(vertex).1;
        let mut ring = [[Point3::origin(); 2]; 8];
        for i in 0..4 {
            let (from, to) = (vertices[i], vertices[(i + 1) % 4]);
            let between = middles[i].unwrap_or(to);
            (ring[2 * i], ring[2 * i + 1]) = ([at(from), at(between)], [at(between), at(to)]);
        }
        if !is_upward {
            ring.iter_mut().for_each(|step| step.reverse());
        }
        let middle = at(centre);
        let margin = MARGIN * self.lattice.pitch;
        let ends = [edge.node, edge.end()].map(|node| self.lattice.position(node) - middle);
        let within = ends.map(|end| end * (1.0 - margin / end.norm().max(margin)));
        let steps = ring
            .iter()
            .filter(|[from, to]| from != to)
            .copied()
            .collect::<Vec<_>>();
        let point = unfolded(&middle, normal, within, &steps, DRIFT * self.lattice.pitch);
        if point != middle {
            self.moved.push((centre, point));
        }
    }

    fn add_face(&mut self, edge: &Edge, is_upward: bool, [a, b, c]: [u32; 3]) {
        let corners = if is_upward { [a, b, c] } else { [a, c, b] };
        self.patch.faces.push(PatchFace {
            corners,
            owner: Owner::Edge(*edge),
        });
    }

    /// Whether the fan around an edge covers the step from cell `i` to the next: always in a full
    /// fan, else only if the row of cells meets the scan at either end.
    fn is_fanned(&self, i: usize, vertices: &[Option<u32>; 4], squares: &[Square; 4]) -> bool {
        let Some(gap) = (0..4).find(|&k| vertices[(i + 4 - k) % 4].is_none()) else {
            return true;
        };
        let before = squares[(i + 4 - gap) % 4];
        let after = (1..4)
            .find(|&k| vertices[(i + k) % 4].is_none())
            .map(|k| squares[(i + k + 3) % 4]);
        self.shared.contains(&before) || after.is_some_and(|square| self.shared.contains(&square))
    }

    /// The vertex on a square between two cells, on the segment that ends at `edge`; `None` if the
    /// straight segment between the vertices of the cells passes through the square and serves no
    /// other segment.
    fn middle(
        &mut self,
        edge: &Edge,
        square: &Square,
        around: [u32; 2],
        vertices: [u32; 2],
    ) -> Option<u32> {
        let cells = around.map(|at| *self.cells.entry(at));
        let above = cells
            .iter()
            .find(|(node, _)| *node == square.node)
            .map_or(cells[0].1, |(_, cell)| *cell);
        let signs = ring_corners(2 * square.axis).map(|corner| above.is_material(corner));
        let found = segments(signs, || self.is_joined(square));
        let [a, b] = vertices.map(|v| self.patch.vertices.entry(v).1);
        let is_plain = found[1].is_none() && cells.iter().all(|(_, cell)| cell.loops == 1);
        if is_plain && passes(self.lattice, square, &a, &b) {
            return None;
        }
        let edges = square.edges();
        let (number, ends) = found.iter().enumerate().find_map(|(number, segment)| {
            let ends = (*segment)?.map(|end| edges[end as usize]);
            ends.contains(edge).then_some((number as u8, ends))
        })?;
        let ends = ends.map(|edge| {
            let (vertex, normal) = self.crossing(&edge);
            (self.patch.vertices.entry(vertex).1, normal)
        });
        // several loops in one cell stay disjoint as long as each keeps to the hull of its
        // crossings
        let point = if is_plain {
            bend(self.lattice, square, &ends)
        } else {
            nalgebra::center(&ends[0].0, &ends[1].0)
        };
        Some(
            self.patch
                .vertices
                .insert_with(VertexKey::Square(*square, number), || point)
                .0,
        )
    }
}
