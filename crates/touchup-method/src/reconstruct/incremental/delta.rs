//! Changes of the patch since its last publication, for a mesh that follows it.

use nalgebra::Point3;

use crate::reconstruct::LatticeRegion;
use crate::reconstruct::contour::coarsening::CoarseBlocks;
use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::incremental::remesh::{Remesh, RenewedFaces};
use crate::reconstruct::lattice::{CellBox, LatticeNode, Owner, VertexKey};
use crate::reconstruct::support::Support;
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{FaceId, TriMesh};

/// Changes of the patch.
#[derive(Clone, Debug, Default)]
pub struct PatchDelta {
    /// includes all touches up to this stamp, ns
    pub until_ns: i64,
    /// vertices that are new, have moved, or are corners of `faces`
    pub vertices: Vec<PatchVertex>,
    /// owners with new faces, and the number of their faces in `faces`, in this order. A face of
    /// the scan that the patch touches is removed when its remainder is first listed.
    pub owners: Vec<(Owner, u32)>,
    /// corners as indices into `vertices`, counter-clockwise seen from outside
    pub faces: Vec<[u32; 3]>,
    /// vertices without a face
    pub gone: Vec<VertexKey>,
}

/// A vertex of the patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchVertex {
    /// its name
    pub key: VertexKey,
    /// m, in O
    pub position: Point3<f64>,
    /// the evidence for it
    pub support: Support,
}

impl PatchDelta {
    /// Whether there are no changes.
    pub(crate) fn is_empty(&self) -> bool {
        self.vertices.is_empty() && self.owners.is_empty()
    }
}

/// Side of the blocks for look-ups of owners, in cells.
const BLOCK: i32 = 4;

fn block_of(node: LatticeNode) -> LatticeNode {
    node.map(|x| x.div_euclid(BLOCK))
}

/// A face by the names of its corners.
type NamedFace = [VertexKey; 3];

/// The patch as last published.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct PublishedPatch {
    faces: CellTable<Owner, Vec<NamedFace>>,
    /// the owners on the lattice, by blocks of cells
    blocks: CellTable<LatticeNode, Vec<Owner>>,
    vertices: CellTable<VertexKey, PublishedVertex>,
    /// blocks with merged faces
    coarse: CoarseBlocks,
}

#[derive(Clone, Copy, Debug, Default)]
struct PublishedVertex {
    position: Point3<f64>,
    support: Support,
    /// number of face corners here
    uses: u32,
}

/// A delta under construction.
#[derive(Default)]
struct Draft {
    delta: PatchDelta,
    /// index of each vertex in the delta
    at: CellTable<VertexKey, ()>,
    /// corners of removed faces
    left: Vec<VertexKey>,
}

impl PublishedPatch {
    /// Blocks with merged faces.
    pub(crate) fn coarse(&self) -> &CoarseBlocks {
        &self.coarse
    }

    /// Touched faces of the scan.
    fn scan_faces(&self) -> impl Iterator<Item = FaceId> + '_ {
        self.faces.iter().filter_map(|(owner, _)| match owner {
            Owner::Scan(face) => Some(face),
            Owner::Edge(_) | Owner::Square(_) => None,
        })
    }

    /// As [`Self::take`], for a renewal of everything.
    ///
    /// - `coarse`: blocks of its merged faces.
    pub(crate) fn take_all(
        &mut self,
        mut renewed: RenewedFaces,
        coarse: CoarseBlocks,
        remesh: &Remesh,
        scan: &TriMesh,
    ) -> PatchDelta {
        renewed.core = CellBox::ALL;
        renewed.scanned.extend(self.scan_faces());
        let delta = self.take(&renewed, remesh, scan);
        self.coarse = coarse;
        delta
    }

    /// Adopts a renewal; returns the differences from before.
    ///
    /// - `remesh`: source of the renewal.
    pub(crate) fn take(
        &mut self,
        renewed: &RenewedFaces,
        remesh: &Remesh,
        scan: &TriMesh,
    ) -> PatchDelta {
        let mut draft = Draft::default();
        let core = self.coarse.around(&renewed.core);
        self.coarse.refine(&renewed.core);
        // faces outside blocks that stay merged
        let next = faces_by_owner(&renewed.patch, |owner| !self.coarse.holds(owner));
        let mut around = self.owners_around(&core, &remesh.region);
        around.retain(|owner| !next.contains(owner) && !self.coarse.holds(owner));
        for owner in around {
            self.replace(owner, Vec::new(), &mut draft);
            self.forget(owner);
        }
        for &face in &renewed.scanned {
            let owner = Owner::Scan(face);
            if !next.contains(&owner) && self.faces.contains(&owner) {
                self.replace(
                    owner,
                    vec![scan.corners(face).map(VertexKey::Scan)],
                    &mut draft,
                );
            }
        }
        for (owner, faces) in next.iter() {
            self.replace(owner, faces.clone(), &mut draft);
        }
        self.place(&renewed.patch, scan, remesh, &mut draft);
        for key in draft.left {
            if self
                .vertices
                .get(&key)
                .is_some_and(|placed| placed.uses == 0)
            {
                self.vertices.remove(&key);
                draft.delta.gone.push(key);
            }
        }
        draft.delta
    }

    /// Owners with faces around the cells of `core`, without faces of the scan.
    fn owners_around(&self, core: &CellBox, region: &LatticeRegion) -> Vec<Owner> {
        let is_around = |owner: &Owner| match owner {
            Owner::Edge(edge) => edge.cells().iter().any(|cell| core.contains(cell)),
            // at the rim of the core, the square belongs to the cell in the region
            Owner::Square(square) => {
                let cells = square.cells();
                cells.iter().all(|cell| core.contains(cell))
                    || cells
                        .iter()
                        .any(|cell| core.contains(cell) && region.contains(cell))
            }
            Owner::Scan(_) => false,
        };
        let near = core.widened(0, 1);
        let blocks = CellBox {
            lo: block_of(near.lo),
            hi: block_of(near.hi),
        };
        let mut owners = Vec::new();
        blocks.each_in(&self.blocks, |_, block| {
            owners.extend(block.iter().copied().filter(is_around))
        });
        owners
    }

    /// Forgets an owner without faces.
    fn forget(&mut self, owner: Owner) {
        self.faces.remove(&owner);
        if let Some(block) = owner
            .node()
            .and_then(|node| self.blocks.get_mut(&block_of(node)))
            && let Some(at) = block.iter().position(|&other| other == owner)
        {
            block.swap_remove(at);
        }
    }

    /// Replaces an owner's faces, unless they are the same.
    fn replace(&mut self, owner: Owner, faces: Vec<NamedFace>, draft: &mut Draft) {
        let (at, is_new) = self.faces.insert_with(owner, Vec::new);
        if !is_new && *self.faces.value_mut(at) == faces {
            return;
        }
        if let Some(node) = owner.node().filter(|_| is_new) {
            self.blocks.get_or_default(block_of(node)).push(owner);
        }
        draft.delta.owners.push((owner, faces.len() as u32));
        for key in faces.iter().flatten() {
            self.vertices.get_or_default(*key).uses += 1;
        }
        draft.delta.faces.extend(
            faces
                .iter()
                .map(|face| face.map(|key| draft.at.insert_with(key, || ()).0)),
        );
        let before = std::mem::replace(self.faces.value_mut(at), faces);
        for key in before.into_iter().flatten() {
            if let Some(placed) = self.vertices.get_mut(&key) {
                placed.uses -= 1;
                draft.left.push(key);
            }
        }
    }

    /// Updates the vertices of the draft's faces, and moved ones.
    fn place(&mut self, patch: &Patch, scan: &TriMesh, remesh: &Remesh, draft: &mut Draft) {
        let mut is_seen = vec![false; patch.vertices.len()];
        for &vertex in patch.faces.iter().flat_map(|face| &face.corners) {
            if std::mem::replace(&mut is_seen[vertex as usize], true) {
                continue;
            }
            let (key, position) = patch.vertices.entry(vertex);
            let Some(placed) = self.vertices.get_mut(key) else {
                continue;
            };
            let support = remesh.support(key);
            if placed.position != *position || placed.support != support {
                (placed.position, placed.support) = (*position, support);
                draft.at.insert_with(*key, || ());
            }
        }
        for (key, ()) in draft.at.iter() {
            let Some(placed) = self.vertices.get_mut(&key) else {
                continue;
            };
            if let VertexKey::Scan(vertex) = key {
                placed.position = scan.position(vertex);
            }
            let PublishedVertex {
                position, support, ..
            } = *placed;
            draft.delta.vertices.push(PatchVertex {
                key,
                position,
                support,
            });
        }
    }
}

/// Faces of a patch by their `wanted` owners; removed faces of the scan without a remainder have
/// none.
fn faces_by_owner(
    patch: &Patch,
    wanted: impl Fn(&Owner) -> bool,
) -> CellTable<Owner, Vec<NamedFace>> {
    let mut by_owner: CellTable<Owner, Vec<NamedFace>> = CellTable::default();
    for face in &patch.removed {
        by_owner.insert_with(Owner::Scan(*face), Vec::new);
    }
    for face in patch.faces.iter().filter(|face| wanted(&face.owner)) {
        by_owner
            .get_or_default(face.owner)
            .push(face.corners.map(|vertex| patch.vertices.entry(vertex).0));
    }
    by_owner
}
