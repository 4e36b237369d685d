//! Floating components: untouched material that the ball went all around is attached to nothing.
//!
//! A scan that closes a hole over leaves its lid, or a plug, in the middle of it, out of the ball's
//! path. It is one piece of material within the swept volume, and no part of the work-piece.

use std::collections::VecDeque;

use crate::reconstruct::evidence::point_evidence::{Evidence, NodeState, Source};
use crate::reconstruct::field::grid::ReconstructionGrid;
use crate::reconstruct::lattice::{LatticeNode, neighbours};
use crate::reconstruct::table::CellTable;

/// Maximum number of nodes of a floating component: a plug eight radii wide and as high.
const MOST: usize = 4000;

/// Nodes of all floating components among and around the nodes `at`, which have final signs.
pub(in crate::reconstruct) fn floating_components(
    grid: &mut ReconstructionGrid,
    evidence: &Evidence<'_>,
    at: &[u32],
) -> Vec<LatticeNode> {
    let mut floating_components = Vec::new();
    let mut seen: CellTable<LatticeNode, ()> = CellTable::default();
    for &start in at {
        let (node, state) = grid.nodes.entry(start);
        let node = *node;
        // components of untouched scan stay
        let is_cut = matches!(state.source, Source::Nothing | Source::Far) && state.value < 0.0;
        if is_cut && !seen.contains(&node) {
            floating_components.extend(floating(grid, evidence, node, &mut seen));
        }
    }
    floating_components
}

/// The component around `start`, if it is attached to nothing.
fn floating(
    grid: &mut ReconstructionGrid,
    evidence: &Evidence<'_>,
    start: LatticeNode,
    seen: &mut CellTable<LatticeNode, ()>,
) -> Vec<LatticeNode> {
    let mut piece: CellTable<LatticeNode, ()> = std::iter::once((start, ())).collect();
    let mut next = VecDeque::from([start]);
    while let Some(node) = next.pop_front() {
        // a node reached before is attached, or would have been found to float with this component
        let is_known = !seen.insert_with(node, || ()).1;
        let is_attached =
            |state: &NodeState| matches!(state.source, Source::Touch | Source::Beyond);
        if is_known || piece.len() > MOST || grid.nodes.get(&node).is_some_and(is_attached) {
            piece.iter().for_each(|(node, ())| seen.insert(node, ()));
            return Vec::new();
        }
        for other in neighbours(node) {
            if is_material(grid, evidence, other) && piece.insert_with(other, || ()).1 {
                next.push_back(other);
            }
        }
    }
    piece.iter().map(|(node, ())| node).collect()
}

/// Whether a node is in material; beyond the evaluated nodes by the scan.
fn is_material(grid: &mut ReconstructionGrid, evidence: &Evidence<'_>, node: LatticeNode) -> bool {
    if let Some(state) = grid.nodes.get(&node) {
        return state.value < 0.0;
    }
    let x = grid.lattice.position(node);
    let is_inside = || evidence.scan_at(&x).is_some_and(|scan| scan.value < 0.0);
    let (at, _) = grid.beyond.insert_with(node, is_inside);
    grid.beyond.entry(at).1
}
