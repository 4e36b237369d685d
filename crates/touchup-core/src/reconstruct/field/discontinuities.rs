//! Discontinuities of the field of the touches: where it contradicts itself.

use crate::reconstruct::field::lattice::{LatticeNode, neighbours};

/// A distance field changes by no more than the distance between two points: between neighbours by a pitch, and by noise beyond.
const LARGEST_STEP: f64 = 1.1;

/// Whether the field of the touches, `value` (m) at `node`, is discontinuous from outside into the material towards a
/// neighbour: the two are values of different surfaces, and which of them is wrong is unknown. What is left around both
/// fills the gap. Depends on the touched values one step away alone.
///
/// - `value_at`: the field of the touches at a node, m, where there is one.
pub(in crate::reconstruct) fn is_discontinuous(
    value_at: impl Fn(&LatticeNode) -> Option<f64>,
    node: LatticeNode,
    value: f64,
    pitch: f64,
) -> bool {
    let is_discontinuity = |other: f64| (value < 0.0) != (other < 0.0) && (value - other).abs() > LARGEST_STEP * pitch;
    neighbours(node).filter_map(|node| value_at(&node)).any(is_discontinuity)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of a line of nodes one pitch (2 mm) apart are discontinuous.
    fn discontinuous(value: &[f64]) -> Vec<bool> {
        let value_at = |node: &LatticeNode| {
            let is_on_line = node[1..] == [0, 0];
            usize::try_from(node[0]).ok().filter(|_| is_on_line).and_then(|at| value.get(at)).map(|value| value * 1e-3)
        };
        (0..).zip(value).map(|(i, value)| is_discontinuous(value_at, [i, 0, 0], value * 1e-3, 2e-3)).collect()
    }

    #[test]
    fn a_distance_stays_and_a_discontinuity_goes_on_both_sides() {
        // a wall at 3.1 mm, met head-on: its distance changes by the pitch
        assert_eq!(discontinuous(&[3.1, 1.1, -0.9, -2.9]), [false; 4]);
        // 0.3 mm before one surface and, one node on, 2.5 mm behind another
        assert_eq!(discontinuous(&[2.3, 0.3, -2.5, -4.5]), [false, true, true, false]);
        // far inside it makes no surface
        assert_eq!(discontinuous(&[-0.3, -5.0]), [false; 2]);
    }

    #[test]
    fn a_node_without_touches_is_no_contradiction() {
        assert!(is_discontinuous(|node| (*node == [1, 0, 0]).then_some(-2.5e-3), [0; 3], 0.3e-3, 2e-3));
        assert!(!is_discontinuous(|_| None, [0; 3], 0.3e-3, 2e-3));
    }
}
