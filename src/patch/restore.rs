//! The field at the nodes of the lattice, around everything that was touched or swept.

use super::complete::{CompleteParams, complete};
use super::evidence::{Evidence, Source};
use super::field::FieldScratch;
use super::lattice::{Lattice, Node};
use super::table::Table;
use super::{NodeValues, Region};

/// The field at one node.
#[derive(Clone, Copy, Debug)]
pub struct NodeState {
    /// f, m
    pub value: f64,
    /// what it rests on
    pub source: Source,
    /// the scan's own value, m
    pub scan: f64,
    /// where nothing is known: value of a touched surface going straight on, m, and how far it is believed, 0 to 1
    pub straight: (f64, f64),
    /// the ball was here: f is no less than this, m
    pub least: f64,
    /// … and ended its way here without touching anything, deep inside the scan
    pub is_free_end: bool,
}

/// The field around everything that was touched or swept.
#[derive(Clone, Debug, Default)]
pub struct Restored {
    /// every node looked at
    pub nodes: Table<Node, NodeState>,
    /// cells in which the surface would rest on a freely moving ball alone: they stay open
    pub open: Table<Node, ()>,
}

/// A touched node within this many cells of the surface counts as outside.
const IN_PLANE: f64 = 0.05;
/// Values are cut off at ± this many cells: far from the surface only the sign matters.
const WIDEST: f64 = 2.7;
/// Nodes within this many radii of a contact are looked at.
const REACH: f64 = 2.8;
/// … and within this many cells of a ball that went into the scan.
const BALL_MARGIN: f64 = 2.0;

/// Evaluates the field around all touches and completes it where nothing is known.
pub fn restore(evidence: &Evidence<'_>, lattice: &Lattice) -> Restored {
    let mut restored = Restored::default();
    let mut scratch = FieldScratch::default();
    for (node, ()) in domain(evidence, lattice).iter() {
        if let Some(state) = evaluate(evidence, lattice, node, &mut scratch) {
            restored.nodes.insert_with(node, || state);
        }
    }
    complete(&mut restored, &CompleteParams::new(lattice.pitch, evidence.params.radius));
    restored
}

fn evaluate(evidence: &Evidence<'_>, lattice: &Lattice, node: Node, scratch: &mut FieldScratch) -> Option<NodeState> {
    let found = evidence.at(&lattice.position(node), scratch)?;
    let widest = WIDEST * lattice.pitch;
    let least = match found.source {
        Source::Touch => f64::NEG_INFINITY,
        _ if found.swept_depth > 0.0 => found.swept_depth.min(widest),
        _ => f64::NEG_INFINITY,
    };
    Some(NodeState {
        value: match found.source {
            // where a plane of the lattice lies in the surface, noise would fold it from one side to the other
            Source::Touch if found.value.abs() < IN_PLANE * lattice.pitch => f64::MIN_POSITIVE,
            _ => found.value.clamp(-widest, widest).max(least),
        },
        source: found.source,
        scan: found.scan.clamp(-widest, widest),
        straight: found.straight.map_or((0.0, 0.0), |(value, share)| (value.clamp(-widest, widest), share)),
        least,
        is_free_end: least > 0.0 && found.is_free_end && found.scan < -evidence.params.scan_reach,
    })
}

/// The nodes near contacts, and those near the ball where it went into the scan.
fn domain(evidence: &Evidence<'_>, lattice: &Lattice) -> Table<Node, ()> {
    let radius = evidence.params.radius;
    let mut touched: Table<Node, ()> = Table::default();
    for mean in evidence.contacts.means() {
        touched.insert_with(lattice.cell_of(&mean.point), || ());
    }
    let mut swept: Table<Node, ()> = Table::default();
    let cover = evidence.swept.cover_radius(radius);
    evidence.swept.cover(|centre| {
        if evidence.tree.closest(evidence.scan, centre, cover + lattice.pitch).is_some() {
            swept.insert_with(lattice.cell_of(centre), || ());
        }
    });
    let mut domain = Table::default();
    add_balls(&mut domain, &touched, (REACH * radius / lattice.pitch).ceil() as i32);
    add_balls(&mut domain, &swept, (cover / lattice.pitch + BALL_MARGIN).ceil() as i32);
    domain
}

fn add_balls(domain: &mut Table<Node, ()>, centres: &Table<Node, ()>, radius: i32) {
    let offsets: Vec<Node> = (-radius..=radius)
        .flat_map(|i| (-radius..=radius).flat_map(move |j| (-radius..=radius).map(move |k| [i, j, k])))
        .filter(|[i, j, k]| i * i + j * j + k * k <= radius * radius)
        .collect();
    for (centre, ()) in centres.iter() {
        for offset in &offsets {
            domain.insert_with(std::array::from_fn(|i| centre[i].saturating_add(offset[i])), || ());
        }
    }
}

impl Restored {
    /// The cells in which the skin is not the scan.
    pub fn region(&self) -> Region {
        let mut region = Region::default();
        for (node, state) in self.nodes.iter().filter(|(_, state)| is_changed(state)) {
            debug_assert!(state.value.is_finite());
            for corner in 0..8 {
                let cell = cell_at(node, corner);
                if self.can_take(cell) {
                    region.insert_with(cell, || ());
                }
            }
        }
        region
    }

    /// Whether the field is known at all corners of a cell that is not to stay open.
    pub fn can_take(&self, cell: Node) -> bool {
        let is_known = |node: Node| self.nodes.get(&node).is_some_and(|state| state.source != Source::Beyond);
        !self.open.contains(&cell) && (0..8).all(|corner| is_known(node_at(cell, corner)))
    }

    /// The values alone.
    pub fn values(&self) -> NodeValues {
        let known = self.nodes.iter().filter(|(_, state)| state.source != Source::Beyond);
        known.map(|(node, state)| (node, state.value)).collect()
    }
}

fn is_changed(state: &NodeState) -> bool {
    match state.source {
        Source::Touch | Source::Both | Source::Nothing => true,
        Source::Far => (state.value < 0.0) != (state.scan < 0.0),
        Source::Scan | Source::Beyond => false,
    }
}

/// Corner `corner` of a cell: bit i says whether it is the upper one along axis i.
pub(super) fn node_at(cell: Node, corner: u8) -> Node {
    std::array::from_fn(|i| cell[i].saturating_add(i32::from(corner >> i & 1)))
}

/// The cell that has `node` as its corner `corner`.
pub(super) fn cell_at(node: Node, corner: u8) -> Node {
    std::array::from_fn(|i| node[i].saturating_sub(i32::from(corner >> i & 1)))
}
