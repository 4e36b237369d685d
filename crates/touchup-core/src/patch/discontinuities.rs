//! Where touches seem to say something that contradicts itself.

use super::grid::{NodeState, neighbours};
use super::lattice::LatticeNode;
use super::table::CellTable;

/// No distance changes by more than the way: between two neighbours by a pitch, and by noise beyond that.
const JUMP: f64 = 1.1;

/// Whether the field of the touches, `felt` (m) at `node`, jumps from outside into the material on the way to a neighbour:
/// one speaks for another surface than the other, and which of them is wrong cannot be told. What is left around both fills
/// the gap. Depends on what was felt one step away alone.
pub(super) fn is_torn(nodes: &CellTable<LatticeNode, NodeState>, node: LatticeNode, felt: f64, pitch: f64) -> bool {
    let is_jump = |other: f64| (felt < 0.0) != (other < 0.0) && (felt - other).abs() > JUMP * pitch;
    neighbours(node).filter_map(|node| nodes.get(&node)?.felt).any(is_jump)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::patch::Source;

    fn state(value: f64) -> NodeState {
        let (source, straight) = (Source::Touch, (value, 1.0));
        NodeState {
            value,
            source,
            is_corner: false,
            scan: 0.0,
            straight,
            least: 0.0,
            is_free_end: false,
            is_further: false,
            felt: Some(value),
            renewal: 0,
        }
    }

    /// Which of a line of nodes one pitch (2 mm) apart are torn.
    fn torn(felt: &[f64]) -> Vec<bool> {
        let nodes: CellTable<LatticeNode, NodeState> =
            (0..).zip(felt).map(|(i, &felt)| ([i, 0, 0], state(felt * 1e-3))).collect();
        nodes.iter().map(|(node, state)| is_torn(&nodes, node, state.value, 2e-3)).collect()
    }

    #[test]
    fn a_distance_stays_and_a_jump_goes_on_both_sides() {
        // a wall at 3.1 mm, met head-on: its distance changes by the way
        assert_eq!(torn(&[3.1, 1.1, -0.9, -2.9]), [false; 4]);
        // 0.3 mm before one surface and, one node on, 2.5 mm behind another
        assert_eq!(torn(&[2.3, 0.3, -2.5, -4.5]), [false, true, true, false]);
        // far inside it makes no surface
        assert_eq!(torn(&[-0.3, -5.0]), [false; 2]);
    }

    #[test]
    fn what_rests_on_something_else_is_no_contradiction() {
        let mut nodes: CellTable<LatticeNode, NodeState> =
            [([0, 0, 0], state(0.3e-3)), ([1, 0, 0], state(-2.5e-3))].into_iter().collect();
        assert!(is_torn(&nodes, [0; 3], 0.3e-3, 2e-3));
        nodes.value_mut(1).felt = None;
        assert!(!is_torn(&nodes, [0; 3], 0.3e-3, 2e-3));
    }
}
