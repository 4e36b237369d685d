//! Few faces where the surface is plain: a patch simplified as far as it stays within a tolerance of itself.
//!
//! Edges collapse in order of their quadric error \[Garland Heckbert 1997\], block by block of the lattice. What lies on the rim of a block
//! stays, so what becomes of a block depends on its own faces alone, and no crack arises between blocks.

use std::collections::HashSet;

use meshopt::SimplifyOptions;
use nalgebra::{Point3, center};

use crate::mesh::triangle;
use crate::reconstruct::contour::patched::{Patch, Support};
use crate::reconstruct::field::lattice::{CellBox, LatticeNode, Owner, PatchFace};
use crate::reconstruct::table::CellTable;

/// Side of a block, in cells.
const BLOCK: i32 = 8;
/// Faces of a block below which there is nothing to merge.
const FEW: usize = 4;
/// Errors that are asked of the simplification, as shares of the tolerance: its own measure of error is a mean over planes.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

fn block_of(node: LatticeNode) -> LatticeNode {
    node.map(|x| x.div_euclid(BLOCK))
}

/// The blocks of the lattice in which faces were merged.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct CoarseBlocks(CellTable<LatticeNode, ()>);

impl CoarseBlocks {
    /// Whether the faces of an owner may have been merged with others.
    pub fn holds(&self, owner: &Owner) -> bool {
        owner.node().is_some_and(|node| self.0.contains(&block_of(node)))
    }

    /// `core`, and the whole of the blocks whose faces depend on it.
    pub fn around(&self, core: &CellBox) -> CellBox {
        let mut all = *core;
        self.each_near(core, |block| {
            let lo = block.map(|x| x * BLOCK);
            // a face over a square belongs to the cell on one side of it
            all.take(&lo.map(|x| x - 1));
            all.take(&lo.map(|x| x + BLOCK - 1));
        });
        all
    }

    /// The blocks whose faces depend on `core` have the faces of the lattice again.
    pub fn refine(&mut self, core: &CellBox) {
        let mut near = Vec::new();
        self.each_near(core, |block| near.push(block));
        for block in near {
            self.0.remove(&block);
        }
    }

    /// The blocks with an owner around the cells of `core`.
    fn each_near(&self, core: &CellBox, mut each: impl FnMut(LatticeNode)) {
        let near = core.widened(0, 1);
        CellBox { lo: block_of(near.lo), hi: block_of(near.hi) }.each_in(&self.0, |block, ()| each(block));
    }
}

/// Merges faces of a patch that belong to the lattice, where no point of the surface moves by more than `tolerance` (m) and vertices of
/// one support go into vertices of the same. Vertices stay where they are, or go. O(faces).
///
/// - `support`: of each vertex of the patch.
pub(in crate::reconstruct) fn coarsen(patch: &mut Patch, support: &[Support], tolerance: f64) -> CoarseBlocks {
    let mut fine: CellTable<LatticeNode, Vec<PatchFace>> = CellTable::default();
    let mut others = Vec::new();
    for face in std::mem::take(&mut patch.faces) {
        match face.owner.node() {
            Some(node) => fine.get_or_default(block_of(node)).push(face),
            None => others.push(face),
        }
    }
    let position = |vertex: u32| patch.vertices.entry(vertex).1;
    let coarse = |(_, faces): (LatticeNode, &Vec<PatchFace>)| coarsened(faces, support, position, tolerance);
    let mut coarse: Vec<Option<Vec<PatchFace>>> = fine.iter().map(coarse).collect();
    loop {
        let of =
            |(at, (_, faces)): (usize, (LatticeNode, &Vec<PatchFace>))| coarse[at].as_ref().unwrap_or(faces).clone();
        let by_block: Vec<Vec<PatchFace>> = fine.iter().enumerate().map(of).collect();
        // two blocks may join the same two corners of the rim between them
        let double = double_edges(by_block.iter().flatten().chain(&others));
        let is_double = |face: &PatchFace| sides(face).iter().any(|side| double.contains(side));
        let mut has_changed = false;
        for (coarse, faces) in coarse.iter_mut().zip(&by_block).filter(|_| !double.is_empty()) {
            has_changed |= coarse.is_some() && faces.iter().any(is_double) && coarse.take().is_some();
        }
        if !has_changed {
            patch.faces = others;
            patch.faces.extend(by_block.into_iter().flatten());
            break;
        }
    }
    CoarseBlocks(fine.iter().zip(coarse).filter(|(_, coarse)| coarse.is_some()).map(|((block, _), _)| block).collect())
}

/// The faces of a block, merged; `None` where that leaves as many.
fn coarsened(
    faces: &[PatchFace],
    support: &[Support],
    position: impl Fn(u32) -> Point3<f64>,
    tolerance: f64,
) -> Option<Vec<PatchFace>> {
    if faces.len() < FEW {
        return None;
    }
    // counted from the first corner: single precision holds a block to a nanometre
    let mut local: CellTable<u32, ()> = CellTable::default();
    let indices: Vec<u32> =
        faces.iter().flat_map(|face| face.corners).map(|vertex| local.insert_with(vertex, || ()).0).collect();
    let corner = |at: u32| local.entry(at).0;
    let places: Vec<Point3<f64>> = (0..local.len() as u32).map(|at| position(corner(at))).collect();
    let decoded: Vec<[f32; 3]> = places.iter().map(|p| (p - places[0]).map(|x| x as f32).into()).collect();
    let mut is_kept = vec![false; places.len()];
    for face in indices.chunks_exact(3) {
        let is_mixed = face.iter().any(|&at| support[corner(at) as usize] != support[corner(face[0]) as usize]);
        face.iter().filter(|_| is_mixed).for_each(|&at| is_kept[at as usize] = true);
    }
    let options = SimplifyOptions::LockBorder | SimplifyOptions::ErrorAbsolute;
    let merged = SHARES.iter().find_map(|share| {
        let error = (share * tolerance) as f32;
        let merged = meshopt::simplify_with_locks_decoder(&indices, &decoded, &is_kept, 0, error, options, None);
        is_same_surface(&indices, &merged, &places, tolerance).then_some(merged)
    })?;
    if merged.len() == indices.len() {
        return None;
    }
    let owner_at = |at: u32| {
        let old = indices.iter().position(|&other| other == at)?;
        Some(faces[old / 3].owner)
    };
    let named = |face: &[u32]| {
        let corners = [corner(face[0]), corner(face[1]), corner(face[2])];
        Some(PatchFace { corners, owner: owner_at(face[0])? })
    };
    merged.chunks_exact(3).map(named).collect()
}

/// Whether `merged` are faces for the same rim as `faces`, and the two surfaces are nowhere farther than `tolerance` (m) from each other, by
/// the corners of the one and by corners, sides and middles of the other.
fn is_same_surface(faces: &[u32], merged: &[u32], places: &[Point3<f64>], tolerance: f64) -> bool {
    if rim(faces) != rim(merged) {
        return false;
    }
    let triangles = |faces: &[u32]| -> Vec<[Point3<f64>; 3]> {
        let of = |face: &[u32]| [places[face[0] as usize], places[face[1] as usize], places[face[2] as usize]];
        faces.chunks_exact(3).map(of).collect()
    };
    let (before, after) = (triangles(faces), triangles(merged));
    let is_near = |p: &Point3<f64>, triangles: &[[Point3<f64>; 3]]| {
        let is_at =
            |t: &[Point3<f64>; 3]| (triangle::closest_point(p, t).0 - p).norm_squared() <= tolerance * tolerance;
        triangles.iter().any(is_at)
    };
    let mut is_left = vec![false; places.len()];
    merged.iter().for_each(|&at| is_left[at as usize] = true);
    let gone = places.iter().zip(&is_left).filter(|(_, is_left)| !**is_left);
    let known: HashSet<&[u32]> = faces.chunks_exact(3).collect();
    let new = merged.chunks_exact(3).zip(&after).filter(|(face, _)| !known.contains(face));
    let between = |[a, b, c]: &[Point3<f64>; 3]| {
        [center(a, b), center(b, c), center(c, a), Point3::from((a.coords + b.coords + c.coords) / 3.0)]
    };
    gone.map(|(p, _)| p).all(|p| is_near(p, &after))
        && new.flat_map(|(_, triangle)| between(triangle)).all(|p| is_near(&p, &before))
}

fn sides(face: &PatchFace) -> [[u32; 2]; 3] {
    let [a, b, c] = face.corners;
    [[a, b], [b, c], [c, a]]
}

/// Sides that faces have in the same direction.
fn double_edges<'a>(faces: impl Iterator<Item = &'a PatchFace>) -> HashSet<[u32; 2]> {
    let mut all: Vec<[u32; 2]> = faces.flat_map(sides).collect();
    all.sort_unstable();
    all.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect()
}

/// Sides without a face on the other side, in order.
fn rim(faces: &[u32]) -> Vec<[u32; 2]> {
    let sides = |face: &[u32]| [[face[0], face[1]], [face[1], face[2]], [face[2], face[0]]];
    let all: HashSet<[u32; 2]> = faces.chunks_exact(3).flat_map(sides).collect();
    let mut rim: Vec<_> = all.iter().filter(|[a, b]| !all.contains(&[*b, *a])).copied().collect();
    rim.sort_unstable();
    rim
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::field::lattice::{Edge, VertexKey};

    /// A square of `side` by `side` cells, two faces each, at heights `z` (m) over cells of 1 mm.
    fn sheet(side: i32, z: impl Fn(i32, i32) -> f64) -> Patch {
        let mut patch = Patch::default();
        for x in 0..=side {
            for y in 0..=side {
                let place = Point3::new(f64::from(x) * 1e-3, f64::from(y) * 1e-3, z(x, y));
                patch.vertices.insert(VertexKey::Cell([x, y, 0], 0), place);
            }
        }
        let at = |x: i32, y: i32| (x * (side + 1) + y) as u32;
        for x in 0..side {
            for y in 0..side {
                let owner = Owner::Edge(Edge { node: [x, y, 0], axis: 2 });
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                patch.faces.extend([[a, b, c], [a, c, d]].map(|corners| PatchFace { corners, owner }));
            }
        }
        patch
    }

    fn area(patch: &Patch) -> f64 {
        let doubled = patch.faces.iter().map(|face| {
            let [a, b, c] = face.corners.map(|corner| patch.vertices.entry(corner).1);
            (b - a).cross(&(c - a)).norm()
        });
        doubled.sum::<f64>() / 2.0
    }

    #[test]
    fn a_plane_keeps_the_rims_of_its_blocks() {
        let mut patch = sheet(16, |_, _| 0.0);
        let support = vec![Support::Touched; patch.vertices.len()];
        let coarse = coarsen(&mut patch, &support, 1e-6);
        assert_eq!(coarse.0.len(), 4);
        // a disk of triangles whose rim has 32 vertices has 30 faces, and two more for each vertex inside: some are left where the
        // collapse of a further edge would turn a face over
        assert!(patch.faces.len() <= 4 * 36, "{} of 512", patch.faces.len());
        assert!((area(&patch) - 256e-6).abs() < 1e-12);
        assert!(double_edges(patch.faces.iter()).is_empty());
    }

    #[test]
    fn what_is_farther_than_the_tolerance_stays() {
        let bump = |x: i32, y: i32| if (x, y) == (4, 4) { 0.1e-3 } else { 0.0 };
        let support = vec![Support::Touched; 81];
        let top = |patch: &Patch| patch.faces.iter().any(|face| face.corners.contains(&(4 * 9 + 4)));
        let [mut kept, mut merged] = [sheet(8, bump), sheet(8, bump)];
        coarsen(&mut kept, &support, 0.05e-3);
        assert!(top(&kept) && kept.faces.len() < 128);
        coarsen(&mut merged, &support, 0.2e-3);
        assert!(!top(&merged));
    }

    #[test]
    fn supports_do_not_mix() {
        let mut patch = sheet(8, |_, _| 0.0);
        let guessed = |at: usize| if at == 4 * 9 + 4 { Support::Guessed } else { Support::Touched };
        let support: Vec<Support> = (0..81).map(guessed).collect();
        coarsen(&mut patch, &support, 1e-6);
        assert!(patch.faces.iter().any(|face| face.corners.contains(&(4 * 9 + 4))));
    }

    #[test]
    fn a_core_takes_whole_blocks_with_it() {
        let blocks = [[0, 0, 0], [1, 0, 0], [3, 0, 0]];
        let mut coarse = CoarseBlocks(blocks.into_iter().collect());
        let core = CellBox { lo: [7, 2, 2], hi: [7, 3, 3] };
        // cell 7 has edges at nodes 7 and 8
        assert_eq!(coarse.around(&core), CellBox { lo: [-1, -1, -1], hi: [15, 7, 7] });
        coarse.refine(&core);
        let holds = |x: i32| coarse.holds(&Owner::Edge(Edge { node: [x, 0, 0], axis: 0 }));
        assert_eq!([0, 8, 24].map(holds), [false, false, true]);
        assert_eq!(coarse.around(&CellBox::EMPTY), CellBox::EMPTY);
    }
}
