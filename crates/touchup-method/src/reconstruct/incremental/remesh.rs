//! The field, the region and its new faces, updated near new evidence.

use crate::reconstruct::LatticeRegion;
use crate::reconstruct::contour::coarsening::CoarseBlocks;
use crate::reconstruct::contour::crossing::Crossings;
use crate::reconstruct::contour::dual_contouring::contour_in;
use crate::reconstruct::contour::patched::Patch;
use crate::reconstruct::contour::scan_clipping::{Cut, cells_around, faces_near};
use crate::reconstruct::evidence::point_evidence::{Evidence, NodeState, Source};
use crate::reconstruct::evidence_changes::GridChanges;
use crate::reconstruct::field::grid::{LatticeChanges, ReconstructionGrid, cells_of};
use crate::reconstruct::lattice::{CellBox, Lattice, LatticeNode, VertexKey, node_at};
use crate::reconstruct::support::Support;
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::FaceId;

/// Maximum rounds of growth of the region over squares without a join of scan and patch.
const GROWTH: usize = 3;
/// Maximum rounds of further evaluation of the field, two cells each, along a filled surface.
const FURTHER: usize = 4;
/// Maximum rounds of growth and further evaluation on a closed scan: there every open square can be
/// joined, and is.
const UNTIL_CLOSED: usize = 64;

/// The remeshed region and its pending updates.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Remesh {
    pub grid: ReconstructionGrid,
    pub region: LatticeRegion,
    /// cells that a join of patch and scan needs, without a value of the field
    wanted: CellTable<LatticeNode, ()>,
    /// a box that holds the region
    bounds: CellBox,
    crossings: Crossings,
    /// cells around which new faces are due
    pending: CellBox,
    /// cells no longer in the region
    left: Vec<LatticeNode>,
}

/// The new faces in and around a part of the lattice.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct RenewedFaces {
    /// cells around which everything is new
    pub core: CellBox,
    /// the new faces around `core`, and incomplete ones beyond
    pub patch: Patch,
    /// the faces of the scan considered; the patch holds their remainders
    pub scanned: Vec<FaceId>,
}

impl Remesh {
    /// Without faces.
    pub(crate) fn new(lattice: Lattice) -> Self {
        Self {
            grid: ReconstructionGrid::new(lattice),
            ..Self::default()
        }
    }

    /// Updates everything by the changes of `evidence`: as [`ReconstructionGrid::renew`].
    ///
    /// - `coarse`: blocks with merged faces; each is remade as a whole.
    pub(crate) fn renew(
        &mut self,
        evidence: &Evidence<'_>,
        changes: &GridChanges,
        late: &GridChanges,
        coarse: &CoarseBlocks,
    ) -> RenewedFaces {
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

    /// Updates the field with changes of `evidence` up to the radius at which they count at all;
    /// the faces follow with [`Self::renew`].
    pub(crate) fn renew_far(&mut self, evidence: &Evidence<'_>, late: &GridChanges) {
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

    /// Support of a vertex: touched if most of the corners of its cell are near the touched
    /// surface; for a vertex on the scan, the scan.
    pub(crate) fn support(&self, key: &VertexKey) -> Support {
        let is_of_touch = |state: &NodeState| state.source == Source::Touch && !state.is_extended;
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

    /// Adds cells to the region, or removes them, after changes of the field.
    ///
    /// - `core`: widened to the dependent cells.
    /// - `left`: receives the cells that leave the region.
    fn take_up(
        &mut self,
        changed: &LatticeChanges,
        core: &mut CellBox,
        left: &mut Vec<LatticeNode>,
    ) {
        for node in &changed.at_surface {
            // the slope at a crossing includes the nodes beside it
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

    /// Makes the faces around `core`, and adds cells to the region if the faces cannot join the
    /// scan.
    ///
    /// - `left`: cells no longer in the region.
    fn grow(
        &mut self,
        evidence: &Evidence<'_>,
        mut core: CellBox,
        left: &[LatticeNode],
        coarse: &CoarseBlocks,
    ) -> RenewedFaces {
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
    ) -> RenewedFaces {
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
        RenewedFaces {
            core,
            patch,
            scanned,
        }
    }
}
