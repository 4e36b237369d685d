//! Gives up what touches seem to say where it contradicts itself.

use super::evidence::Source;
use super::lattice::{Node, stepped};
use super::restore::NodeState;
use super::table::Table;

/// No distance changes by more than the way: between two neighbours by a pitch, and by noise beyond that.
const JUMP: f64 = 1.1;

/// Takes the touches away from both nodes of each edge over which their field jumps from outside into the material: one
/// speaks for another surface than the other, and which of them is wrong cannot be told. What is left around them fills
/// the gap. Depends on the nodes one step away alone, as they were evaluated.
pub(super) fn drop_jumps(nodes: &mut Table<Node, NodeState>, pitch: f64) {
    let is_torn = |node: Node, state: &NodeState| {
        let beside = (0..6).map(|i| stepped(node, i / 2, if i % 2 == 0 { 1 } else { -1 }));
        state.source == Source::Touch
            && beside.filter_map(|node| nodes.get(&node)).any(|other| is_jump(state, other, JUMP * pitch))
    };
    let torn: Vec<Node> = nodes.iter().filter(|(node, state)| is_torn(*node, state)).map(|(node, _)| node).collect();
    for node in torn {
        if let Some(state) = nodes.get_mut(&node) {
            (state.source, state.straight) = (Source::Nothing, (0.0, 0.0));
        }
    }
}

fn is_jump(a: &NodeState, b: &NodeState, most: f64) -> bool {
    b.source == Source::Touch && (a.value < 0.0) != (b.value < 0.0) && (a.value - b.value).abs() > most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(value: f64) -> NodeState {
        NodeState { value, source: Source::Touch, scan: 0.0, straight: (value, 1.0), least: 0.0, is_free_end: false }
    }

    /// Sources along a line of nodes one pitch (2 mm) apart, after the drop.
    fn after(values: &[f64]) -> Vec<Source> {
        let mut nodes: Table<Node, NodeState> =
            (0..).zip(values).map(|(i, &value)| ([i, 0, 0], state(value * 1e-3))).collect();
        drop_jumps(&mut nodes, 2e-3);
        nodes.iter().map(|(_, state)| state.source).collect()
    }

    #[test]
    fn a_distance_stays_and_a_jump_goes_on_both_sides() {
        use Source::{Nothing, Touch};
        // a wall at 3.1 mm, met head-on: its distance changes by the way
        assert_eq!(after(&[3.1, 1.1, -0.9, -2.9]), [Touch; 4]);
        // 0.3 mm before one surface and, one node on, 2.5 mm behind another
        assert_eq!(after(&[2.3, 0.3, -2.5, -4.5]), [Touch, Nothing, Nothing, Touch]);
        // far inside it makes no surface
        assert_eq!(after(&[-0.3, -5.0]), [Touch; 2]);
    }

    #[test]
    fn what_rests_on_something_else_is_no_contradiction() {
        let mut nodes: Table<Node, NodeState> =
            [([0, 0, 0], state(0.3e-3)), ([1, 0, 0], state(-2.5e-3))].into_iter().collect();
        nodes.value_mut(1).source = Source::Both;
        drop_jumps(&mut nodes, 2e-3);
        assert_eq!(nodes.entry(0).1.source, Source::Touch);
    }
}
