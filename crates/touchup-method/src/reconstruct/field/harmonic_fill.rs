//! Harmonic fill of the field between evidence.
//!
//! Between the known values lies the smoothest field: ∇²f = 0. Flat goes on flat, a gap between two
//! touched walls closes, and no island can arise. In the swept volume f stays above its depth
//! there. Deep in the material the scan's own distance pulls weakly, so that a pocket touched down
//! to some depth gets a bottom.

use crate::reconstruct::evidence::point_evidence::{NodeState, Source};
use crate::reconstruct::field::grid::ReconstructionGrid;
use crate::reconstruct::lattice::{self, LatticeNode, Numbers, cell_at, node_at};
use crate::reconstruct::table::CellTable;
use touchup_geometry::numeric::flood;

/// Over-relaxation factor that converges fast on domains some ten nodes across.
const RELAXATION: f64 = 1.6;
/// Maximum weight of the straight continuation of a touched surface, beside the six neighbours of a
/// node: as much as all of them.
const STRAIGHT: f64 = 6.0;
/// Weight of the scan out of reach of all evidence: the surface is back at it within a cell or two.
const FURTHER_PULL: f64 = 1.0;
/// Maximum number of nodes of a noise speck: two cells in each direction.
const SPECK: usize = 8;
/// Number of opposite neighbours, of six, from which a node counts as alone.
const ALONE: usize = 5;
/// Maximum distance from the surface, in cells, at which a lone node changes sides.
const NEARLY: f64 = 0.5;
/// Maximum number of sweeps: twice the need of the largest gaps of the tested parts.
const SWEEPS: usize = 200;
/// Change, in pitches, below which the relaxation ends.
const ENOUGH: f64 = 1e-6;
/// Radius of the opening of a hole around the end of a path, in radii: as wide as holes that let a
/// ball through.
const END_REACH: f64 = 3.0;
/// No neighbour.
const NONE: u32 = u32::MAX;

/// Fills the unknown nodes among `at`, then drops pieces without evidence; nodes around them stay
/// as they are.
///
/// - `numbers`: of the nodes around these.
/// - `radius`: of the ball, m.
pub(in crate::reconstruct) fn harmonic_fill(
    grid: &mut ReconstructionGrid,
    at: &[u32],
    numbers: &Numbers,
    radius: f64,
) {
    // the pull reaches two radii deep
    let pull = (grid.lattice.pitch / (2.0 * radius)).powi(2);
    relax(grid, at, numbers, pull);
    if drop_islands(grid, at, numbers) {
        relax(grid, at, numbers, pull);
    }
    blunt(grid, at, numbers);
}

/// Moves nodes near the surface that differ from nearly all around them to the other side: tips and
/// pits that noise makes if the surface passes through a node.
fn blunt(grid: &mut ReconstructionGrid, at: &[u32], numbers: &Numbers) {
    let nearly = NEARLY * grid.lattice.pitch;
    for &at in at {
        let state = grid.nodes.entry(at).1;
        if state.value.abs() < nearly && state.least <= 0.0 {
            let is_other =
                |other: u32| (grid.nodes.entry(other).1.value < 0.0) != (state.value < 0.0);
            let around = neighbours(grid, at, numbers);
            if around
                .into_iter()
                .filter(|&other| other != NONE && is_other(other))
                .count()
                >= ALONE
            {
                grid.nodes.value_mut(at).value = -f64::MIN_POSITIVE.copysign(state.value);
            }
        }
    }
}

/// An unknown node, and the equation for its value.
struct OpenQuestion {
    /// its number, and those of its neighbours with a value, among the gathered values
    here: u32,
    around: [u32; 6],
    neighbours: u8,
    /// Σ w f and Σ w over all but the neighbours, then over all
    pull: f64,
    weight: f64,
    least: f64,
}

/// Successive over-relaxation, bounded from below by the swept volume.
///
/// - `pull`: weight of the scan beside the six neighbours of a node far from it.
fn relax(grid: &mut ReconstructionGrid, at: &[u32], numbers: &Numbers, pull: f64) {
    let open: Vec<u32> = at
        .iter()
        .copied()
        .filter(|&at| grid.nodes.entry(at).1.is_open_question())
        .collect();
    // the values, gathered close together
    let mut met: CellTable<u32, f64> = CellTable::default();
    let mut number = |at: u32| met.insert_with(at, || grid.nodes.entry(at).1.value).0;
    let questions: Vec<OpenQuestion> = open
        .iter()
        .map(|&at| question(grid, at, numbers, pull, &mut number))
        .collect();
    let mut values: Vec<f64> = met.iter().map(|(_, value)| *value).collect();
    for _ in 0..SWEEPS {
        let mut largest = 0.0f64;
        for question in questions.iter().filter(|question| question.weight > 0.0) {
            let mut sum = question.pull;
            for &other in &question.around[..question.neighbours as usize] {
                sum += values[other as usize];
            }
            let value = &mut values[question.here as usize];
            let next = (*value + RELAXATION * (sum / question.weight - *value)).max(question.least);
            largest = largest.max((next - *value).abs());
            *value = next;
        }
        if largest < ENOUGH * grid.lattice.pitch {
            break;
        }
    }
    for (&at, question) in open.iter().zip(&questions) {
        grid.nodes.value_mut(at).value = values[question.here as usize];
    }
}

fn question(
    grid: &ReconstructionGrid,
    at: u32,
    numbers: &Numbers,
    pull: f64,
    mut number: impl FnMut(u32) -> u32,
) -> OpenQuestion {
    let state = &grid.nodes.entry(at).1;
    let pull = match state.source {
        _ if state.is_further => FURTHER_PULL,
        Source::Far => pull,
        _ => 0.0,
    };
    let (straight, share) = state.straight;
    let weight = STRAIGHT * share;
    let mut question = OpenQuestion {
        here: number(at),
        around: [0; 6],
        neighbours: 0,
        pull: pull * state.scan + weight * straight,
        weight: pull + weight,
        least: state.least,
    };
    // nodes evaluated further follow; their extent does not matter here
    let counts =
        |other: u32| other != NONE && (state.is_further || !grid.nodes.entry(other).1.is_further);
    for other in neighbours(grid, at, numbers)
        .into_iter()
        .filter(|&other| counts(other))
    {
        question.around[question.neighbours as usize] = number(other);
        question.neighbours += 1;
        question.weight += 1.0;
    }
    question
}

/// The nodes around one, if they exist and have a value.
fn neighbours(grid: &ReconstructionGrid, at: u32, numbers: &Numbers) -> [u32; 6] {
    lattice::neighbours(grid.nodes.entry(at).0).map(|other| {
        let index = numbers.of(&grid.nodes, &other);
        index
            .filter(|&index| grid.nodes.entry(index).1.source != Source::Beyond)
            .unwrap_or(NONE)
    })
}

/// Drops material and void without evidence: a piece of one sign, within the nodes at hand, neither
/// touched nor swept, or smaller than a ball can resolve. Returns whether there was any.
fn drop_islands(grid: &mut ReconstructionGrid, at: &[u32], numbers: &Numbers) -> bool {
    let mut seen = vec![VisitState::Outside; grid.nodes.len()];
    at.iter()
        .for_each(|&at| seen[at as usize] = VisitState::NotYet);
    let (mut island, mut has_dropped) = (Vec::new(), false);
    for &start in at {
        if seen[start as usize] != VisitState::NotYet {
            continue;
        }
        seen[start as usize] = VisitState::Yes;
        island.clear();
        island.push(start);
        if !is_attached(grid, &mut island, &mut seen, numbers) {
            has_dropped = true;
            for &at in &island {
                let state = grid.nodes.value_mut(at);
                (state.source, state.value) = (Source::Nothing, 0.0);
            }
        }
    }
    has_dropped
}

/// Visit state of a node while gathering pieces.
#[derive(Clone, Copy, PartialEq, Eq)]
enum VisitState {
    /// not among the nodes at hand
    Outside,
    NotYet,
    Yes,
}

/// Gathers the piece of one sign around its first node; returns whether it is attached beyond the
/// nodes at hand, or has evidence and enough size.
fn is_attached(
    grid: &ReconstructionGrid,
    piece: &mut Vec<u32>,
    seen: &mut [VisitState],
    numbers: &Numbers,
) -> bool {
    let (mut next, mut is_touched, mut goes_on) = (0, false, false);
    while let Some(&at) = piece.get(next) {
        next += 1;
        let state = &grid.nodes.entry(at).1;
        let around = neighbours(grid, at, numbers);
        is_touched |= matches!(state.source, Source::Touch | Source::Beyond) || state.least > 0.0;
        goes_on |= around.contains(&NONE);
        for other in around.into_iter().filter(|&other| other != NONE) {
            let is_same = (grid.nodes.entry(other).1.value < 0.0) == (state.value < 0.0);
            goes_on |= is_same && seen[other as usize] == VisitState::Outside;
            if is_same && seen[other as usize] == VisitState::NotYet {
                seen[other as usize] = VisitState::Yes;
                piece.push(other);
            }
        }
    }
    goes_on || is_touched && piece.len() > SPECK
}

/// Radius of the opening of a hole around the end of a path of a ball of `radius` (m), in cells.
pub(in crate::reconstruct) fn end_reach(grid: &ReconstructionGrid, radius: f64) -> i32 {
    (END_REACH * radius / grid.lattice.pitch).ceil() as i32
}

/// Cells with a filled surface that depends on a ball that ended its path freely, from there to the
/// nearest evidence within `reach` cells: a hole that the ball left at its far end has no bottom.
pub(in crate::reconstruct) fn open_cells(
    grid: &ReconstructionGrid,
    reach: i32,
) -> CellTable<LatticeNode, ()> {
    let is_end = |state: &NodeState| state.is_free_end && state.value <= state.least;
    let ends = grid
        .ends
        .iter()
        .map(|(end, ())| end)
        .filter(|end| grid.nodes.get(end).is_some_and(is_end));
    let mut open = CellTable::default();
    let mut takes = |(cell, end): (LatticeNode, LatticeNode)| {
        let is_near = (0..3).map(|i| (cell[i] - end[i]).pow(2)).sum::<i32>() <= reach * reach;
        is_near && is_unsupported_surface(grid, cell) && open.insert_with(cell, || ()).1
    };
    let cells = ends.flat_map(|end| (0..8).map(move |corner| (cell_at(end, corner), end)));
    let first = cells.filter(|&cell| takes(cell)).collect();
    flood(
        first,
        |(cell, end)| lattice::neighbours(cell).map(|cell| (cell, end)),
        takes,
    );
    open
}

/// Whether the surface passes through a cell without a known corner.
fn is_unsupported_surface(grid: &ReconstructionGrid, cell: LatticeNode) -> bool {
    let mut material = 0;
    for corner in 0..8 {
        let Some(state) = grid.nodes.get(&node_at(cell, corner)) else {
            return false;
        };
        if !state.is_open_question() || state.source == Source::Rim {
            return false;
        }
        material += u8::from(state.value < 0.0);
    }
    material % 8 != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::lattice::{CellBox, Lattice};

    const PITCH: f64 = 0.75e-3;
    const BOX: CellBox = CellBox {
        lo: [0; 3],
        hi: [6; 3],
    };

    /// A filled grid with touched nodes everywhere, initially with values `value` (pitches).
    fn completed(value: impl Fn(LatticeNode) -> f64) -> ReconstructionGrid {
        let mut grid = ReconstructionGrid::new(Lattice {
            pitch: PITCH,
            ..Lattice::default()
        });
        BOX.each(|node| {
            grid.nodes
                .insert(node, NodeState::touched(value(node) * PITCH));
        });
        let at: Vec<u32> = (0..grid.nodes.len() as u32).collect();
        let numbers = Numbers::new(&grid.nodes, &BOX);
        harmonic_fill(&mut grid, &at, &numbers, 1.5e-3);
        grid
    }

    /// Material below z = 2.8 pitches.
    fn floor([.., k]: LatticeNode) -> f64 {
        f64::from(k) - 2.8
    }

    fn is_material(grid: &ReconstructionGrid, node: LatticeNode) -> bool {
        grid.nodes.get(&node).is_some_and(|state| state.value < 0.0)
    }

    #[test]
    fn a_tip_of_noise_goes_and_a_ridge_stays() {
        let tip = [3, 3, 3];
        let with_tip =
            |depth: f64| completed(move |node| if node == tip { -depth } else { floor(node) });
        assert!(!is_material(&with_tip(0.1), tip));
        assert!(is_material(&with_tip(0.6), tip), "more than noise");
        let ridge = completed(|node| {
            if node[0] == 3 && node[2] == 3 {
                -0.1
            } else {
                floor(node)
            }
        });
        assert!(is_material(&ridge, tip));
    }

    #[test]
    fn a_speck_goes_whatever_it_is_attached_to() {
        let speck = completed(|node| if node == [3, 3, 5] { -1.0 } else { floor(node) });
        assert!(!is_material(&speck, [3, 3, 5]) && is_material(&speck, [3, 3, 2]));
        let block = completed(|node| if node[2] == 5 { -1.0 } else { floor(node) });
        assert!(
            is_material(&block, [3, 3, 5]),
            "it goes on beyond what was looked at"
        );
    }
}
