//! Few faces on plain surfaces: a patch simplified within a tolerance of itself.
//!
//! Edges collapse in order of their quadric error \[Garland Heckbert 1997\], block by block of the
//! lattice. The rim of a block stays, so the faces of a block depend on its own former faces alone,
//! and no crack arises between blocks.

use std::collections::HashSet;

use meshopt::SimplifyOptions;
use nalgebra::{Point3, center};

use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::lattice::{CellBox, Lattice, LatticeNode, Owner, PatchFace};
use crate::reconstruct::support::Support;
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{BoxQuery, FaceId, FaceTree, TriMesh, triangle};

/// Side of a block, in cells.
const BLOCK: i32 = 8;
/// Minimum number of faces in a block to merge.
const FEW: usize = 4;
/// Error limits tried in the simplification, as shares of the tolerance: its own measure of error
/// is a mean over planes.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Minimum of twice the area over the longest side squared for a merged face: a triangle stretched
/// thirtyfold.
const THIN: f64 = 0.03;

fn block_of(node: LatticeNode) -> LatticeNode {
    node.map(|x| x.div_euclid(BLOCK))
}

/// Blocks of the lattice with merged faces.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct CoarseBlocks(CellTable<LatticeNode, ()>);

impl CoarseBlocks {
    /// Whether an owner's faces may be merged with others.
    pub(crate) fn holds(&self, owner: &Owner) -> bool {
        owner
            .node()
            .is_some_and(|node| self.0.contains(&block_of(node)))
    }

    /// `core`, and all blocks whose faces depend on it.
    pub(crate) fn around(&self, core: &CellBox) -> CellBox {
        let mut all = *core;
        self.each_near(core, |block| {
            let lo = block.map(|x| x * BLOCK);
            // the cell on one side of a square owns the face over it
            all.take(&lo.map(|x| x - 1));
            all.take(&lo.map(|x| x + BLOCK - 1));
        });
        all
    }

    /// Restores the lattice's faces of the blocks that depend on `core`.
    pub(crate) fn refine(&mut self, core: &CellBox) {
        let mut near = Vec::new();
        self.each_near(core, |block| near.push(block));
        for block in near {
            self.0.remove(&block);
        }
    }

    /// The blocks with an owner around the cells of `core`.
    fn each_near(&self, core: &CellBox, mut each: impl FnMut(LatticeNode)) {
        let near = core.widened(0, 1);
        CellBox {
            lo: block_of(near.lo),
            hi: block_of(near.hi),
        }
        .each_in(&self.0, |block, ()| each(block));
    }
}

/// Merges faces of a patch that belong to the lattice, if the two surfaces stay within `tolerance`
/// (m) of each other and vertices of one support go into vertices of the same. Vertices stay in
/// place, or go; a block stays as it is if merged faces would meet others. O(faces).
///
/// - `support`: of each vertex of the patch.
/// - `scan`: the patch's scan, with the tree over its faces.
pub(in crate::reconstruct) fn coarsen(
    patch: &mut Patch,
    support: &[Support],
    lattice: &Lattice,
    (scan, tree): (&TriMesh, &FaceTree),
    tolerance: f64,
) -> CoarseBlocks {
    let mut blocks: CellTable<LatticeNode, Vec<PatchFace>> = CellTable::default();
    let mut others = Vec::new();
    for face in std::mem::take(&mut patch.faces) {
        match face.owner.node() {
            Some(node) => blocks.get_or_default(block_of(node)).push(face),
            None => others.push(face),
        }
    }
    let position = |vertex: u32| patch.vertices.entry(vertex).1;
    let replaced: HashSet<FaceId> = patch.removed.iter().copied().collect();
    let merged =
        |(_, faces): (LatticeNode, &Vec<PatchFace>)| merged(faces, support, position, tolerance);
    let mut coarse: Vec<Option<Vec<PatchFace>>> = blocks.iter().map(merged).collect();
    loop {
        let mut all = PlacedFaces {
            lattice,
            position,
            faces: Vec::new(),
            reach: CellTable::default(),
        };
        let merged = coarse
            .iter()
            .enumerate()
            .filter_map(|(at, merged)| Some((at, merged.as_ref()?)));
        merged.for_each(|(at, merged)| merged.iter().for_each(|face| all.take_merged(*face, at)));
        let fine = blocks
            .iter()
            .zip(&coarse)
            .filter(|(_, merged)| merged.is_none());
        let fine = fine.flat_map(|((_, faces), _)| faces);
        others.iter().chain(fine).for_each(|face| all.take(*face));
        let mut unsound = all.unsound();
        unsound.extend(all.piercing(scan, tree, &replaced));
        if unsound.is_empty() {
            patch.faces = all.faces.into_iter().map(|(face, _)| face).collect();
            break;
        }
        unsound.into_iter().for_each(|at| coarse[at] = None);
    }
    let is_coarse = blocks
        .iter()
        .zip(&coarse)
        .filter(|(_, coarse)| coarse.is_some());
    CoarseBlocks(is_coarse.map(|((block, _), _)| block).collect())
}

/// The faces of a patch, merged and not, and their blocks.
struct PlacedFaces<'a, P> {
    lattice: &'a Lattice,
    position: P,
    /// with the number of the block for a merged face
    faces: Vec<(PatchFace, Option<usize>)>,
    /// numbers of the faces that reach into a block, for blocks with merged faces
    reach: CellTable<LatticeNode, Vec<u32>>,
}

impl<P: Fn(u32) -> Point3<f64>> PlacedFaces<'_, P> {
    fn triangle(&self, face: &PatchFace) -> [Point3<f64>; 3] {
        face.corners.map(&self.position)
    }

    /// The blocks that a face reaches into.
    fn blocks(&self, face: &PatchFace) -> CellBox {
        let (low, high) = triangle::extent(&self.triangle(face));
        let [lo, hi] =
            [low, high].map(|corner| block_of(self.lattice.cell_of(&Point3::from(corner))));
        CellBox { lo, hi }
    }

    /// Takes a merged face of block number `of`; all of these before any other.
    fn take_merged(&mut self, face: PatchFace, of: usize) {
        let number = self.faces.len() as u32;
        self.blocks(&face)
            .each(|block| self.reach.get_or_default(block).push(number));
        self.faces.push((face, Some(of)));
    }

    /// Takes another face, possibly as large as a face of the scan.
    fn take(&mut self, face: PatchFace) {
        let (number, mut near) = (self.faces.len() as u32, Vec::new());
        self.blocks(&face)
            .each_in(&self.reach, |block, _| near.push(block));
        near.into_iter()
            .for_each(|block| self.reach.get_or_default(block).push(number));
        self.faces.push((face, None));
    }

    /// The merged faces, with their blocks.
    fn merged(&self) -> impl Iterator<Item = (u32, &PatchFace, usize)> {
        (0..)
            .zip(&self.faces)
            .filter_map(|(number, (face, block))| Some((number, face, (*block)?)))
    }

    /// Blocks with a merged face that shares a directed side with another face, or meets another
    /// face. Two blocks may join the same two corners of the rim between them.
    fn unsound(&self) -> HashSet<usize> {
        let mut sides: Vec<[u32; 2]> = self
            .faces
            .iter()
            .flat_map(|(face, _)| sides(&face.corners))
            .collect();
        sides.sort_unstable();
        let double: HashSet<[u32; 2]> = sides
            .windows(2)
            .filter(|pair| pair[0] == pair[1])
            .map(|pair| pair[0])
            .collect();
        let mut unsound = HashSet::new();
        for (number, face, block) in self.merged() {
            let triangle = self.triangle(face);
            let mut is_unsound = self::sides(&face.corners)
                .iter()
                .any(|side| double.contains(side));
            self.blocks(face).each_in(&self.reach, |_, near| {
                for &other in near.iter().filter(|&&other| other != number) {
                    let (other, of) = &self.faces[other as usize];
                    if meet_beside(
                        &triangle,
                        &self.triangle(other),
                        &face.corners,
                        &other.corners,
                    ) {
                        is_unsound = true;
                        unsound.extend(of);
                    }
                }
            });
            unsound.extend(is_unsound.then_some(block));
        }
        unsound
    }

    /// Blocks with a merged face that meets a face of the scan not in `replaced`.
    fn piercing(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
        replaced: &HashSet<FaceId>,
    ) -> HashSet<usize> {
        let mut query = BoxQuery::default();
        let mut piercing = HashSet::new();
        for (_, face, block) in self.merged() {
            let triangle = self.triangle(face);
            let (low, high) = triangle::extent(&triangle);
            tree.faces_in_box(&Point3::from(low), &Point3::from(high), &mut query);
            let meets = |other: &&FaceId| {
                !replaced.contains(other)
                    && triangle::meet(&triangle, &scan.triangle(**other), None, 0.0)
            };
            piercing.extend(query.faces.iter().find(meets).map(|_| block));
        }
        piercing
    }
}

/// Whether two faces meet, other than in a common corner; faces with a common side fold, they do
/// not pierce.
fn meet_beside(
    t: &[Point3<f64>; 3],
    u: &[Point3<f64>; 3],
    t_corners: &[u32; 3],
    u_corners: &[u32; 3],
) -> bool {
    let mut common = (0..3u8).filter_map(|i| {
        let at = u_corners
            .iter()
            .position(|other| *other == t_corners[usize::from(i)])?;
        Some([i, at as u8])
    });
    let first = common.next();
    common.next().is_none() && triangle::meet(t, u, first, 0.0)
}

/// The faces of a block, merged; `None` unless that leaves fewer.
fn merged(
    faces: &[PatchFace],
    support: &[Support],
    position: impl Fn(u32) -> Point3<f64>,
    tolerance: f64,
) -> Option<Vec<PatchFace>> {
    if faces.len() < FEW {
        return None;
    }
    // relative to the first corner: single precision holds a block to a nanometre
    let mut local: CellTable<u32, ()> = CellTable::default();
    let indices: Vec<u32> = faces
        .iter()
        .flat_map(|face| face.corners)
        .map(|vertex| local.insert_with(vertex, || ()).0)
        .collect();
    let corner = |at: u32| local.entry(at).0;
    let places: Vec<Point3<f64>> = (0..local.len() as u32)
        .map(|at| position(corner(at)))
        .collect();
    let decoded: Vec<[f32; 3]> = places
        .iter()
        .map(|p| (p - places[0]).map(|x| x as f32).into())
        .collect();
    let mut is_kept = vec![false; places.len()];
    for face in indices.chunks_exact(3) {
        let is_mixed = face
            .iter()
            .any(|&at| support[corner(at) as usize] != support[corner(face[0]) as usize]);
        face.iter()
            .filter(|_| is_mixed)
            .for_each(|&at| is_kept[at as usize] = true);
    }
    let options = SimplifyOptions::LockBorder | SimplifyOptions::ErrorAbsolute;
    let merged = SHARES.iter().find_map(|share| {
        let error = (share * tolerance) as f32;
        let merged = meshopt::simplify_with_locks_decoder(
            &indices, &decoded, &is_kept, 0, error, options, None,
        );
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
        Some(PatchFace {
            corners,
            owner: owner_at(face[0])?,
        })
    };
    merged.chunks_exact(3).map(named).collect()
}

/// Whether `merged` has the same rim as `faces`, the two surfaces are within `tolerance` (m) of
/// each other, by the corners of the one and by corners, sides and middles of the other, and no new
/// face is thin.
fn is_same_surface(faces: &[u32], merged: &[u32], places: &[Point3<f64>], tolerance: f64) -> bool {
    if rim(faces) != rim(merged) {
        return false;
    }
    let triangles = |faces: &[u32]| -> Vec<[Point3<f64>; 3]> {
        let of = |face: &[u32]| {
            [
                places[face[0] as usize],
                places[face[1] as usize],
                places[face[2] as usize],
            ]
        };
        faces.chunks_exact(3).map(of).collect()
    };
    let (before, after) = (triangles(faces), triangles(merged));
    let is_near = |p: &Point3<f64>, triangles: &[[Point3<f64>; 3]]| {
        let is_at = |t: &[Point3<f64>; 3]| {
            (triangle::closest_point(p, t).0 - p).norm_squared() <= tolerance * tolerance
        };
        triangles.iter().any(is_at)
    };
    let mut is_left = vec![false; places.len()];
    merged.iter().for_each(|&at| is_left[at as usize] = true);
    let gone = places
        .iter()
        .zip(&is_left)
        .filter(|(_, is_left)| !**is_left);
    let known: HashSet<&[u32]> = faces.chunks_exact(3).collect();
    let new = merged
        .chunks_exact(3)
        .zip(&after)
        .filter(|(face, _)| !known.contains(face));
    let is_thin = |[a, b, c]: &[Point3<f64>; 3]| {
        triangle::shape_quality(&[*a, *b, *c], (b - a).cross(&(c - a)).norm()) < THIN
    };
    if new.clone().any(|(_, triangle)| is_thin(triangle)) {
        return false;
    }
    let between = |[a, b, c]: &[Point3<f64>; 3]| {
        [
            center(a, b),
            center(b, c),
            center(c, a),
            Point3::from((a.coords + b.coords + c.coords) / 3.0),
        ]
    };
    gone.map(|(p, _)| p).all(|p| is_near(p, &after))
        && new
            .flat_map(|(_, triangle)| between(triangle))
            .all(|p| is_near(&p, &before))
}

fn sides([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

/// Directed sides without a face on the other side, sorted.
fn rim(faces: &[u32]) -> Vec<[u32; 2]> {
    let all: HashSet<[u32; 2]> = faces
        .chunks_exact(3)
        .flat_map(|face| sides(&[face[0], face[1], face[2]]))
        .collect();
    let mut rim: Vec<_> = all
        .iter()
        .filter(|[a, b]| !all.contains(&[*b, *a]))
        .copied()
        .collect();
    rim.sort_unstable();
    rim
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::lattice::{Edge, VertexKey};

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
                let owner = Owner::Edge(Edge {
                    node: [x, y, 0],
                    axis: 2,
                });
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                patch
                    .faces
                    .extend([[a, b, c], [a, c, d]].map(|corners| PatchFace { corners, owner }));
            }
        }
        patch
    }

    /// Result of [`coarsen`] for a sheet with these vertex supports, far from its scan.
    fn coarsened(mut patch: Patch, support: &[Support], tolerance: f64) -> (Patch, CoarseBlocks) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Point3::new(x, y, -1.0));
        let scan = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let lattice = Lattice {
            origin: Point3::origin(),
            pitch: 1e-3,
        };
        let coarse = coarsen(
            &mut patch,
            support,
            &lattice,
            (&scan, &FaceTree::new(&scan)),
            tolerance,
        );
        (patch, coarse)
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
        let (patch, coarse) = coarsened(sheet(16, |_, _| 0.0), &[Support::Touched; 17 * 17], 1e-6);
        assert_eq!(coarse.0.len(), 4);
        // a disk of triangles with 32 rim vertices has 30 faces, and two more for each vertex
        // inside: some stay if the collapse of a further edge would turn a face over
        assert!(patch.faces.len() <= 4 * 36, "{} of 512", patch.faces.len());
        assert!((area(&patch) - 256e-6).abs() < 1e-12);
        let mut sides: Vec<_> = patch
            .faces
            .iter()
            .flat_map(|face| sides(&face.corners))
            .collect();
        let count = sides.len();
        sides.sort_unstable();
        sides.dedup();
        assert_eq!(
            sides.len(),
            count,
            "no two faces have a side in the same direction"
        );
    }

    #[test]
    fn what_is_farther_than_the_tolerance_stays() {
        let bump = |x: i32, y: i32| if (x, y) == (4, 4) { 0.1e-3 } else { 0.0 };
        let top = |patch: &Patch| {
            patch
                .faces
                .iter()
                .any(|face| face.corners.contains(&(4 * 9 + 4)))
        };
        let within =
            |tolerance: f64| coarsened(sheet(8, bump), &[Support::Touched; 81], tolerance).0;
        let kept = within(0.05e-3);
        assert!(top(&kept) && kept.faces.len() < 128);
        assert!(!top(&within(0.2e-3)));
    }

    #[test]
    fn supports_do_not_mix() {
        let guessed = |at: usize| {
            if at == 4 * 9 + 4 {
                Support::Guessed
            } else {
                Support::Touched
            }
        };
        let support: Vec<Support> = (0..81).map(guessed).collect();
        let (patch, _) = coarsened(sheet(8, |_, _| 0.0), &support, 1e-6);
        assert!(
            patch
                .faces
                .iter()
                .any(|face| face.corners.contains(&(4 * 9 + 4)))
        );
    }

    /// A bump of the scan pierces the merged faces of a block, and not the faces themselves.
    #[test]
    fn a_block_whose_merged_faces_would_meet_the_scan_stays() {
        let dent = |x: i32, y: i32| if (x, y) == (4, 4) { -0.1e-3 } else { 0.0 };
        let tip = Point3::new(4.05e-3, 4.05e-3, -0.05e-3);
        let away = [[-1e-4, 0.0], [1e-4, 0.0], [0.0, 1e-4]]
            .map(|[x, y]| tip + nalgebra::Vector3::new(x, y, 1e-3));
        let scan = TriMesh::new([&[tip], &away[..2]].concat(), vec![[0, 1, 2]]).unwrap();
        let lattice = Lattice {
            origin: Point3::origin(),
            pitch: 1e-3,
        };
        let mut patch = sheet(8, dent);
        let coarse = coarsen(
            &mut patch,
            &[Support::Touched; 81],
            &lattice,
            (&scan, &FaceTree::new(&scan)),
            0.2e-3,
        );
        assert!(coarse.0.is_empty() && patch.faces.len() == 128);
    }

    #[test]
    fn a_core_takes_whole_blocks_with_it() {
        let blocks = [[0, 0, 0], [1, 0, 0], [3, 0, 0]];
        let mut coarse = CoarseBlocks(blocks.into_iter().collect());
        let core = CellBox {
            lo: [7, 2, 2],
            hi: [7, 3, 3],
        };
        // cell 7 has edges at nodes 7 and 8
        assert_eq!(
            coarse.around(&core),
            CellBox {
                lo: [-1, -1, -1],
                hi: [15, 7, 7]
            }
        );
        coarse.refine(&core);
        let holds = |x: i32| {
            coarse.holds(&Owner::Edge(Edge {
                node: [x, 0, 0],
                axis: 0,
            }))
        };
        assert_eq!([0, 8, 24].map(holds), [false, false, true]);
        assert_eq!(coarse.around(&CellBox::EMPTY), CellBox::EMPTY);
    }
}
