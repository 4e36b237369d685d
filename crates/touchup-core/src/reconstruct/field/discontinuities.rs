//! Where touches seem to say something that contradicts itself.

use crate::reconstruct::field::lattice::{LatticeNode, neighbours};

/// No distance changes by more than the way: between two neighbours by a pitch, and by noise beyond that.
const JUMP: f64 = 1.1;

/// Whether the field of the touches, `felt` (m) at `node`, jumps from outside into the material on the way to a neighbour:
/// one speaks for another surface than the other, and which of them is wrong cannot be told. What is left around both fills
/// the gap. Depends on what was felt one step away alone.
///
/// - `felt_at`: the field of the touches at a node, m, where there is one.
pub(in crate::reconstruct) fn is_torn(
    felt_at: impl Fn(&LatticeNode) -> Option<f64>,
    node: LatticeNode,
    felt: f64,
    pitch: f64,
) -> bool {
    let is_jump = |other: f64| (felt < 0.0) != (other < 0.0) && (felt - other).abs() > JUMP * pitch;
    neighbours(node).filter_map(|node| felt_at(&node)).any(is_jump)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of a line of nodes one pitch (2 mm) apart are torn.
    fn torn(felt: &[f64]) -> Vec<bool> {
        let felt_at = |node: &LatticeNode| {
            let is_on_line = node[1..] == [0, 0];
            usize::try_from(node[0]).ok().filter(|_| is_on_line).and_then(|at| felt.get(at)).map(|felt| felt * 1e-3)
        };
        (0..).zip(felt).map(|(i, felt)| is_torn(felt_at, [i, 0, 0], felt * 1e-3, 2e-3)).collect()
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
        assert!(is_torn(|node| (*node == [1, 0, 0]).then_some(-2.5e-3), [0; 3], 0.3e-3, 2e-3));
        assert!(!is_torn(|_| None, [0; 3], 0.3e-3, 2e-3));
    }
}
