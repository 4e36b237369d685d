//! The field at the nodes of the lattice, around everything that was touched or swept.

use nalgebra::Point3;

use crate::reconstruct::evidence::point_evidence::{Evidence, Source};
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::field::discontinuities::is_discontinuous;
use crate::reconstruct::field::lattice::{CellBox, Lattice, LatticeNode, LatticeRegion, NodeValues, neighbours};
use crate::reconstruct::field::piecewise::FieldScratch;
use crate::reconstruct::table::CellTable;

/// The field at one node.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct NodeState {
    /// f, m
    pub value: f64,
    /// the evidence for it
    pub source: Source,
    /// the scan's own value, m
    pub scan: f64,
    /// where nothing is known: value of a touched surface going straight on, m, and its weight, 0 to 1
    pub straight: (f64, f64),
    /// the ball was here: f is no less than this, m
    pub least: f64,
    /// … and ended its path here without touching anything, deep inside the scan
    pub is_free_end: bool,
    /// it is out of reach of all evidence, and was looked at because a surface that is filled in goes on there
    pub is_further: bool,
    /// value of the field of the touches, m; `None` out of their support
    pub touched_value: Option<f64>,
    /// … in an inner corner that two touched surfaces go on into
    pub is_corner: bool,
    /// number of the renewal that gave it this value
    pub renewal: u32,
}

impl NodeState {
    /// Whether nothing is known here, so that the value is filled in.
    pub fn is_open_question(&self) -> bool {
        matches!(self.source, Source::Nothing | Source::Far)
    }

    /// Whether the skin differs from the scan here.
    fn is_changed(&self) -> bool {
        match self.source {
            Source::Touch | Source::Both | Source::Nothing => true,
            Source::Far => (self.value < 0.0) != (self.scan < 0.0),
            Source::Scan | Source::Beyond => false,
        }
    }

    /// Whether it shows another surface than `other`, by more than `slack` (m).
    pub fn differs(&self, other: &Self, slack: f64) -> bool {
        self.source != other.source
            || (self.value < 0.0) != (other.value < 0.0)
            || (self.value - other.value).abs() > slack
    }
}

/// Changes of the evidence: where the contacts are whose mean is new or moved, and the centres that were kept, m, in O.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct GridChanges {
    pub means: Vec<Point3<f64>>,
    pub centres: Vec<Point3<f64>>,
}

impl GridChanges {
    pub fn is_empty(&self) -> bool {
        self.means.is_empty() && self.centres.is_empty()
    }

    pub fn extend(&mut self, more: &Self) {
        self.means.extend_from_slice(&more.means);
        self.centres.extend_from_slice(&more.centres);
    }
}

/// What a renewal changed.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Changed {
    /// nodes that are new, or whose value or source is another
    pub nodes: Vec<LatticeNode>,
    /// those of them on which the surface in the cells around them depends
    pub at_surface: Vec<LatticeNode>,
    /// cells that are to stay open now, or no more
    pub open: Vec<LatticeNode>,
}

/// The field around everything that was touched or swept.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct ReconstructionGrid {
    /// every node looked at
    pub nodes: CellTable<LatticeNode, NodeState>,
    /// cells in which a freely moving ball alone would support the surface: they stay open
    pub open: CellTable<LatticeNode, ()>,
    /// the nodes at which a ball ended its path freely
    pub ends: CellTable<LatticeNode, ()>,
    /// cells with a contact, and with a ball that went into the scan: what is around them is looked at
    touched: CellTable<LatticeNode, ()>,
    free_space: CellTable<LatticeNode, ()>,
    /// signed distance of the scan at each of `nodes`: it never changes
    pub scan: Vec<ScanDistance>,
    /// whether the scan has material at nodes that are not looked at, as far as that was evaluated
    pub beyond: CellTable<LatticeNode, bool>,
    pub renewals: u32,
}

/// Values are cut off at ± this many cells: far from the surface only the sign matters.
const WIDEST: f64 = 2.7;
/// Nodes within this many radii of a contact are looked at.
const REACH: f64 = 2.8;
/// … and within this many cells of a ball that went into the scan.
const BALL_MARGIN: f64 = 2.0;
/// Changes count most within this many radii.
const NEAR: f64 = 1.1;

impl ReconstructionGrid {
    /// Brings the field up to date with the changes of `evidence`.
    ///
    /// - `changes`: taken in up to where they count most.
    /// - `late`: earlier changes, taken in up to where they count at all.
    pub fn renew(
        &mut self,
        evidence: &Evidence<'_>,
        lattice: &Lattice,
        changes: &GridChanges,
        late: &GridChanges,
    ) -> Changed {
        self.renewals += 1;
        let mut look = CellTable::default();
        if !self.nodes.is_empty() {
            let p = evidence.params;
            self.look_near(lattice, &changes.means, NEAR * p.radius, &mut look);
            let cover = evidence.free_space.cover_radius(p.radius);
            self.look_near(lattice, &changes.centres, cover, &mut look);
            self.look_near(lattice, &late.means, p.field.reach.max(p.scan_removal + p.scan_reach), &mut look);
            self.look_near(lattice, &late.centres, cover + p.swept_reach + p.scan_reach, &mut look);
            self.look_at_ends(evidence, lattice, late, &mut look);
        }
        self.widen(evidence, lattice, changes, &mut look);
        let mut area = CellBox::EMPTY;
        let mut scratch = FieldScratch::default();
        for at in 0..look.len() as u32 {
            let node = look.entry(at).0;
            let known = self.nodes.index_of(&node);
            let before = known.map(|known| self.nodes.entry(known).1);
            let scan = match known {
                Some(known) => self.scan[known as usize],
                None => match ScanDistance::at(evidence.scan, evidence.tree, &lattice.position(node)) {
                    Some(scan) => scan,
                    None => continue,
                },
            };
            let mut state = evaluate(evidence, lattice, node, &scan, &mut scratch);
            if let Some(before) = before.filter(|before| before.is_open_question() && state.is_open_question()) {
                state.value = before.value.max(state.least);
            }
            *look.value_mut(at) = before;
            self.put(node, state, scan);
            area.take(&node);
        }
        self.drop_discontinuities(lattice, &mut look, &mut area);
        self.update(evidence, lattice, &area, &look)
    }

    /// Evaluates further nodes that are not known yet in and around `cells`: a surface that is filled in goes on there.
    pub fn look_further(&mut self, evidence: &Evidence<'_>, lattice: &Lattice, cells: &LatticeRegion) -> Changed {
        let mut look = CellTable::default();
        let mut area = CellBox::EMPTY;
        let mut scratch = FieldScratch::default();
        for (cell, ()) in cells.iter() {
            for node in (CellBox { lo: cell, hi: cell }).widened(1, 2).iter() {
                if !self.nodes.contains(&node)
                    && let Some(scan) = ScanDistance::at(evidence.scan, evidence.tree, &lattice.position(node))
                {
                    let state = evaluate(evidence, lattice, node, &scan, &mut scratch);
                    self.put(node, NodeState { is_further: true, ..state }, scan);
                    look.insert_with(node, || None);
                    area.take(&node);
                }
            }
        }
        self.update(evidence, lattice, &area, &look)
    }

    /// Whether some corner of a cell was not looked at.
    pub fn is_beyond(&self, cell: LatticeNode) -> bool {
        (0..8).any(|corner| !self.nodes.contains(&node_at(cell, corner)))
    }

    /// Drops, or restores, the values of the touches at discontinuities: at the nodes looked at and beside them.
    fn drop_discontinuities(
        &mut self,
        lattice: &Lattice,
        look: &mut CellTable<LatticeNode, Option<NodeState>>,
        area: &mut CellBox,
    ) {
        let beside = |node: LatticeNode| std::iter::once(node).chain(neighbours(node));
        let near: CellTable<LatticeNode, ()> = look.iter().flat_map(|(node, _)| beside(node)).collect();
        for (node, ()) in near.iter() {
            let Some(before) = self.nodes.get(&node).copied() else { continue };
            let Some(touched_value) = before.touched_value else { continue };
            let is_discontinuous =
                is_discontinuous(|node| self.nodes.get(node)?.touched_value, node, touched_value, lattice.pitch);
            if is_discontinuous == (before.source == Source::Nothing) {
                continue;
            }
            let (at, _) = look.insert_with(node, || Some(before));
            let last = look.entry(at).1.filter(NodeState::is_open_question);
            let state = NodeState {
                source: if is_discontinuous { Source::Nothing } else { Source::Touch },
                value: if is_discontinuous { last.map_or(touched_value, |last| last.value) } else { touched_value },
                straight: (0.0, 0.0),
                ..before
            };
            self.nodes.insert(node, state);
            area.take(&node);
        }
    }

    pub fn put(&mut self, node: LatticeNode, state: NodeState, scan: ScanDistance) {
        let (at, is_new) = self.nodes.insert_with(node, || state);
        if is_new {
            self.scan.push(scan);
        }
        *self.nodes.value_mut(at) = state;
        if state.is_free_end {
            self.ends.insert_with(node, || ());
        } else if !self.ends.is_empty() {
            self.ends.remove(&node);
        }
    }

    /// Adds the known nodes within `reach` (m) of any of `points`.
    fn look_near(
        &self,
        lattice: &Lattice,
        points: &[Point3<f64>],
        reach: f64,
        look: &mut CellTable<LatticeNode, Option<NodeState>>,
    ) {
        let offsets = ball((reach / lattice.pitch).ceil() as i32 + 1);
        for point in points {
            let cell = lattice.cell_of(point);
            for node in offsets.iter().map(|offset| moved(&cell, offset)) {
                let is_near = (lattice.position(node) - point).norm_squared() < reach * reach;
                if is_near && self.nodes.contains(&node) {
                    look.insert_with(node, || None);
                }
            }
        }
    }

    /// Adds the ends of paths near the changes: whether a path ended there depends on the path, and on contacts beside its end.
    fn look_at_ends(
        &self,
        evidence: &Evidence<'_>,
        lattice: &Lattice,
        changes: &GridChanges,
        look: &mut CellTable<LatticeNode, Option<NodeState>>,
    ) {
        let p = evidence.params;
        for (end, ()) in self.ends.iter() {
            let x = lattice.position(end);
            let is_near = |points: &[Point3<f64>], reach: f64| points.iter().any(|p| (p - x).norm() < reach);
            if is_near(&changes.means, p.radius + p.free_reach) || is_near(&changes.centres, 1.5 * p.radius) {
                look.insert_with(end, || None);
            }
        }
    }

    /// Adds the nodes near contacts, and those near the ball where it went into the scan.
    fn widen(
        &mut self,
        evidence: &Evidence<'_>,
        lattice: &Lattice,
        changes: &GridChanges,
        look: &mut CellTable<LatticeNode, Option<NodeState>>,
    ) {
        let radius = evidence.params.radius;
        let around_contact = ball((REACH * radius / lattice.pitch).ceil() as i32);
        let cover = evidence.free_space.cover_radius(radius);
        let around_ball = ball((cover / lattice.pitch + BALL_MARGIN).ceil() as i32);
        let mut add = |cell: &LatticeNode, offsets: &[LatticeNode]| {
            for node in offsets.iter().map(|offset| moved(cell, offset)) {
                if self.nodes.get(&node).is_none_or(|state| state.is_further) {
                    look.insert_with(node, || None);
                }
            }
        };
        for cell in changes.means.iter().map(|point| lattice.cell_of(point)) {
            if self.touched.insert_with(cell, || ()).1 {
                add(&cell, &around_contact);
            }
        }
        for centre in &changes.centres {
            let cell = lattice.cell_of(centre);
            let is_near = || evidence.tree.closest(evidence.scan, centre, cover + lattice.pitch).is_some();
            if !self.free_space.contains(&cell) && is_near() {
                self.free_space.insert_with(cell, || ());
                add(&cell, &around_ball);
            }
        }
    }

    /// Whether the skin in a cell is not the scan.
    pub fn is_in_region(&self, cell: LatticeNode) -> bool {
        self.can_take(cell)
            && (0..8).any(|corner| self.nodes.get(&node_at(cell, corner)).is_some_and(NodeState::is_changed))
    }

    /// Whether the field is known at all corners of a cell that is not to stay open.
    pub fn can_take(&self, cell: LatticeNode) -> bool {
        let is_known = |node: LatticeNode| self.nodes.get(&node).is_some_and(|state| state.source != Source::Beyond);
        !self.open.contains(&cell) && (0..8).all(|corner| is_known(node_at(cell, corner)))
    }

    /// The values at the corners of the cells in a box.
    pub fn values_in(&self, cells: &CellBox) -> NodeValues {
        let mut values = NodeValues::default();
        cells.widened(0, 1).each_in(&self.nodes, |node, state| {
            if state.source != Source::Beyond {
                values.insert_with(node, || state.value);
            }
        });
        values
    }
}

pub(in crate::reconstruct) fn evaluate(
    evidence: &Evidence<'_>,
    lattice: &Lattice,
    node: LatticeNode,
    scan: &ScanDistance,
    scratch: &mut FieldScratch,
) -> NodeState {
    let found = evidence.beside(scan, &lattice.position(node), scratch);
    let widest = WIDEST * lattice.pitch;
    let least = match found.source {
        Source::Touch => f64::NEG_INFINITY,
        _ if found.swept_depth > 0.0 => found.swept_depth.min(widest),
        _ => f64::NEG_INFINITY,
    };
    let value = found.value.clamp(-widest, widest).max(least);
    NodeState {
        value,
        touched_value: (found.source == Source::Touch).then_some(value),
        source: found.source,
        is_corner: found.is_corner,
        scan: found.scan.clamp(-widest, widest),
        straight: found.straight.map_or((0.0, 0.0), |(value, share)| (value.clamp(-widest, widest), share)),
        least,
        is_free_end: least > 0.0 && found.is_free_end && found.scan < -evidence.params.scan_reach,
        is_further: false,
        renewal: 0,
    }
}

/// The steps from a node to those within `radius` steps.
fn ball(radius: i32) -> Vec<LatticeNode> {
    let all = CellBox { lo: [-radius; 3], hi: [radius; 3] };
    all.iter().filter(|[i, j, k]| i * i + j * j + k * k <= radius * radius).collect()
}

fn moved(node: &LatticeNode, offset: &LatticeNode) -> LatticeNode {
    std::array::from_fn(|i| node[i].saturating_add(offset[i]))
}

/// Corner `corner` of a cell: bit i says whether it is the upper one along axis i.
pub(in crate::reconstruct) fn node_at(cell: LatticeNode, corner: u8) -> LatticeNode {
    std::array::from_fn(|i| cell[i].saturating_add(i32::from(corner >> i & 1)))
}

/// The cell that has `node` as its corner `corner`.
pub(in crate::reconstruct) fn cell_at(node: LatticeNode, corner: u8) -> LatticeNode {
    std::array::from_fn(|i| node[i].saturating_sub(i32::from(corner >> i & 1)))
}

/// The cells that a renewal may have taken into the region or out of it.
pub(in crate::reconstruct) fn cells_of(changed: &Changed) -> LatticeRegion {
    let around = changed.nodes.iter().flat_map(|&node| (0..8).map(move |corner| cell_at(node, corner)));
    around.chain(changed.open.iter().copied()).collect()
}
