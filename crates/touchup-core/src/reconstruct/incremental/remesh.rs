//! The field, the region and the new faces in it, updated where there is new evidence.

use crate::mesh::FaceId;
use crate::reconstruct::LatticeRegion;
use crate::reconstruct::contour::coarsening::CoarseBlocks;
use crate::reconstruct::contour::crossing::Crossings;
use crate::reconstruct::contour::dual_contouring::contour_in;
use crate::reconstruct::contour::patched::{Patch, Support};
use crate::reconstruct::contour::scan_clipping::{Cut, cells_around, faces_near};
use crate::reconstruct::evidence::point_evidence::{Evidence, NodeState, Source};
use crate::reconstruct::field::grid::{Changed, GridChanges, ReconstructionGrid, cells_of};
use crate::reconstruct::field::lattice::{CellBox, Lattice, LatticeNode, VertexKey, node_at};
use crate::reconstruct::table::CellTable;

/// Rounds in which the region grows over squares where scan and patch cannot be joined.
const GROWTH: usize = 3;
/// Rounds in which the field is looked at further, each two cells, where a surface that is filled
/// in goes on.
const FURTHER: usize = 4;
/// Rounds of both on a closed scan, where all that is open can be joined, and is.
const UNTIL_CLOSED: usize = 64;

/// What is remeshed, and why.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Remesh {
    pub grid: ReconstructionGrid,
    pub region: LatticeRegion,
    /// cells that patch and scan would need to be joined, without a value of the field
    wanted: CellTable<LatticeNode, ()>,
    /// a box that holds the region
    bounds: CellBox,
    crossings: Crossings,
    /// around these cells faces are to be made …
    pending: CellBox,
    /// … and these are in the region no more
    left: Vec<LatticeNode>,
}

/// The new faces in and around a part of the lattice.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct Renewed {
    /// what is around these cells is new …
    pub core: CellBox,
    /// … and is in here, beside more of which not all is there
    pub patch: Patch,
    /// the faces of the scan that were looked at: what is left of them is in the patch
    pub scanned: Vec<FaceId>,
}

impl Remesh {
    /// Nothing remeshed yet.
    pub fn new(lattice: Lattice) -> Self {
        Self {
            grid: ReconstructionGrid::new(lattice),
            ..Self::default()
        }
    }

    /// Updates everything by the changes of `evidence`: as [`ReconstructionGrid::renew`].
    ///
    /// - `coarse`: of which all faces are made where one is.
    pub fn renew(
        &mut self,
        evidence: &Evidence<'_>,
        changes: &GridChanges,
        late: &GridChanges,
        coarse: &CoarseBlocks,
    ) -> Renewed {
        let mut changed = self.grid.renew(evidence, changes, late);
        let (mut core, mut left) = self.take_pending();
        for _ in 0..if evidence.is_closed {
            UNTIL_CLOSED
        } else {
            FURTHER
        } {
            self.take_up(&changed, &mut core, &mut left);
            let renewed = self.grow(evidence, core, &left, coarse);
            let open = renewed.patch.open.iter().map(|open| open.beyond);
            let beyond: LatticeRegion = open.filter(|cell| self.grid.is_beyond(*cell)).collect();
            if beyond.is_empty() {
                return renewed;
            }
            changed = self.grid.look_further(evidence, &beyond);
        }
        self.take_up(&changed, &mut core, &mut left);
        self.grow(evidence, core, &left, coarse)
    }

    /// Brings the field up to date with changes of `evidence` up to where they count at all; the
    /// faces follow with [`Self::renew`].
    pub fn renew_far(&mut self, evidence: &Evidence<'_>, late: &GridChanges) {
        let changed = self.grid.renew(evidence, &GridChanges::default(), late);
        let (mut core, mut left) = self.take_pending();
        self.take_up(&changed, &mut core, &mut left);
        (self.pending, self.left) = (core, left);
    }

    fn take_pending(&mut self) -> (CellBox, Vec<LatticeNode>) {
        (
            std::mem::take(&mut self.pending),
            std::mem::take(&mut self.left),
        )
    }

    /// The support of a vertex: touched when most of the corners of its cell are near the surface
    /// that was; those on the scan are its own.
    pub fn support(&self, key: &VertexKey) -> Support {
        let is_of_touch = |state: &NodeState| state.source == Source::Touch && !state.is_corner;
        let is_touched = |node: &LatticeNode| self.grid.nodes.get(node).is_some_and(is_of_touch);
        let touched = match *key {
            VertexKey::Scan(_) | VertexKey::Trace { .. } | VertexKey::Pierce(..) => {
                return Support::Scan;
            }
            VertexKey::Cell(cell, _) => {
                (0..8)
                    .filter(|&corner| is_touched(&node_at(cell, corner)))
                    .count()
                    >= 4
            }
            VertexKey::Square(square, _) => {
                square
                    .corners()
                    .iter()
                    .filter(|node| is_touched(node))
                    .count()
                    >= 2
            }
            VertexKey::Edge(edge) => is_touched(&edge.node) || is_touched(&edge.end()),
        };
        if touched {
            Support::Touched
        } else {
            Support::Guessed
        }
    }

    /// Takes cells into the region, or out of it, as the field has changed.
    ///
    /// - `core`: widened to the cells that depend on it.
    /// - `left`: takes those that are in the region no more.
    fn take_up(&mut self, changed: &Changed, core: &mut CellBox, left: &mut Vec<LatticeNode>) {
        for node in &changed.at_surface {
            // the slope at a crossing is taken over the nodes beside it
            core.take_around(node, 2, 1);
        }
        for (cell, ()) in cells_of(changed).iter() {
            let was_in = self.region.contains(&cell);
            let is_in = self.grid.is_in_region(cell);
            if is_in && !was_in {
                self.region.insert(cell, ());
                self.bounds.take(&cell);
            } else if was_in && !is_in {
                self.region.remove(&cell);
                left.push(cell);
            }
            if is_in != was_in || self.wanted.contains(&cell) {
                core.take_around(&cell, 1, 1);
            }
        }
        changed
            .open
            .iter()
            .for_each(|cell| core.take_around(cell, 1, 1));
    }

    /// Makes the faces around `core`, and takes cells into the region where they cannot be joined
    /// to the scan.
    ///
    /// - `left`: cells that are in the region no more.
    fn grow(
        &mut self,
        evidence: &Evidence<'_>,
        mut core: CellBox,
        left: &[LatticeNode],
        coarse: &CoarseBlocks,
    ) -> Renewed {
        let mut renewed = self.contoured(evidence, core, left, coarse);
        for _ in 0..if evidence.is_closed {
            UNTIL_CLOSED
        } else {
            GROWTH
        } {
            let mut has_grown = false;
            for open in renewed
                .patch
                .open
                .iter()
                .filter(|open| open.is_scanned && self.grid.can_take(open.beyond))
            {
                has_grown |= self.region.insert_with(open.beyond, || ()).1;
                self.wanted.remove(&open.beyond);
                self.bounds.take(&open.beyond);
                core.take_around(&open.beyond, 1, 1);
            }
            if !has_grown {
                break;
            }
            renewed = self.contoured(evidence, core, left, coarse);
        }
        for open in renewed.patch.open.iter().filter(|open| open.is_scanned) {
            self.wanted.insert(open.beyond, ());
        }
        renewed
    }

    fn contoured(
        &mut self,
        evidence: &Evidence<'_>,
        core: CellBox,
        left: &[LatticeNode],
        coarse: &CoarseBlocks,
    ) -> Renewed {
        let whole = coarse.around(&core);
        let Self {
            grid,
            region,
            bounds,
            crossings,
            ..
        } = self;
        let lattice = &grid.lattice;
        let (mut cells, around) = (left.to_vec(), whole.widened(2, 2));
        around.each_in(region, |cell, ()| cells.push(cell));
        let mut scanned = faces_near(lattice, cells.into_iter(), evidence.tree);
        scanned.retain(|&face| {
            !cells_around(lattice, evidence.scan, face)
                .meet(&around)
                .is_empty()
        });
        let cut = Cut::of_faces(lattice, region, bounds, evidence.scan, &scanned);
        let values = grid.values_in(&whole.widened(1, 1));
        let patch = contour_in(lattice, region, &whole, &values, &cut, |edge| {
            crossings.at(grid, evidence, edge)
        });
        Renewed {
            core,
            patch,
            scanned,
        }
    }
}
