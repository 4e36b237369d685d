//! Material that floats: what the ball went all around and nobody touched holds on to nothing.
//!
//! A scan that closes a hole over leaves its lid, or a plug, in the middle of it, where the ball never was. It is one piece
//! of material within the space that was swept, and no part of the work-piece.

use std::collections::VecDeque;

use crate::reconstruct::evidence::point_evidence::{Evidence, Source};
use crate::reconstruct::evidence::scan_value::ScanValue;
use crate::reconstruct::field::grid::ReconstructionGrid;
use crate::reconstruct::field::lattice::{Lattice, LatticeNode, neighbours};
use crate::reconstruct::table::CellTable;

/// Nodes of a lump at most: a plug eight radii wide and as high.
const MOST: usize = 4000;

/// The nodes of all lumps among the nodes `at` and around them, whose signs are settled.
pub(in crate::reconstruct) fn lumps(
    restored: &mut ReconstructionGrid,
    evidence: &Evidence<'_>,
    lattice: &Lattice,
    at: &[u32],
) -> Vec<LatticeNode> {
    let mut lumps = Vec::new();
    let mut seen: CellTable<LatticeNode, ()> = CellTable::default();
    for &start in at {
        let (node, state) = restored.nodes.entry(start);
        let node = *node;
        // what is untouched scan throughout is none of our business
        let is_cut = matches!(state.source, Source::Nothing | Source::Far) && state.value < 0.0;
        if is_cut && !seen.contains(&node) {
            lumps.extend(floating(restored, evidence, lattice, node, &mut seen));
        }
    }
    lumps
}

/// The piece of material around `start`, if nothing holds it.
fn floating(
    restored: &mut ReconstructionGrid,
    evidence: &Evidence<'_>,
    lattice: &Lattice,
    start: LatticeNode,
    seen: &mut CellTable<LatticeNode, ()>,
) -> Vec<LatticeNode> {
    let mut piece: CellTable<LatticeNode, ()> = std::iter::once((start, ())).collect();
    let mut next = VecDeque::from([start]);
    while let Some(node) = next.pop_front() {
        // what another way has led to is held, or would have been found to float with this piece
        let is_known = !seen.insert_with(node, || ()).1;
        if is_known || piece.len() > MOST || is_held(restored, node) {
            piece.iter().for_each(|(node, ())| {
                seen.insert_with(node, || ());
            });
            return Vec::new();
        }
        for other in neighbours(node) {
            if is_material(restored, evidence, lattice, other) && piece.insert_with(other, || ()).1 {
                next.push_back(other);
            }
        }
    }
    piece.iter().map(|(node, ())| node).collect()
}

/// Whether a node of the material cannot be of a lump.
fn is_held(restored: &ReconstructionGrid, node: LatticeNode) -> bool {
    restored.nodes.get(&node).is_some_and(|state| matches!(state.source, Source::Touch | Source::Beyond))
}

/// Whether there is material at a node; beyond what was looked at the scan says.
fn is_material(
    restored: &mut ReconstructionGrid,
    evidence: &Evidence<'_>,
    lattice: &Lattice,
    node: LatticeNode,
) -> bool {
    if let Some(state) = restored.nodes.get(&node) {
        return state.value < 0.0;
    }
    let scan = || ScanValue::at(evidence.scan, evidence.tree, &lattice.position(node));
    let is_inside = || scan().is_some_and(|scan| scan.value < 0.0);
    let (at, _) = restored.beyond.insert_with(node, is_inside);
    restored.beyond.entry(at).1
}
