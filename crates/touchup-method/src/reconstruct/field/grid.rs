//! The field at the nodes of the lattice, around all contacts and the swept volume.

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::reconstruct::evidence::piecewise::FieldScratch;
use crate::reconstruct::evidence::point_evidence::{
    Evidence, FREE_REACH, NodeState, SCAN_REMOVAL, SWEPT_REACH, Source,
};
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::evidence_changes::GridChanges;
use crate::reconstruct::lattice::{
    CellBox, Lattice, LatticeNode, LatticeRegion, NodeValues, cell_at, neighbours, node_at,
};
use crate::reconstruct::table::CellTable;
use touchup_geometry::numeric::{VoxelKey, voxel_neighbourhood, voxel_of};

/// Changes from a renewal.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct LatticeChanges {
    /// nodes that are new, or have a new value or source
    pub nodes: Vec<LatticeNode>,
    /// those that affect the surface in the cells around them
    pub at_surface: Vec<LatticeNode>,
    /// cells that now stay open, or no longer do
    pub open: Vec<LatticeNode>,
}

/// Nodes for renewed evaluation, each with its earlier state, if known.
pub(in crate::reconstruct) type EarlierStates = CellTable<LatticeNode, Option<NodeState>>;

/// The field around all contacts and the swept volume.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct ReconstructionGrid {
    pub lattice: Lattice,
    /// every evaluated node
    pub nodes: CellTable<LatticeNode, NodeState>,
    /// cells with a surface that only a freely moving ball would support: they stay open
    pub open: CellTable<LatticeNode, ()>,
    /// nodes at the free ends of paths of the ball
    pub ends: CellTable<LatticeNode, ()>,
    /// cells with a contact, and with a ball that entered the scan: nodes around are evaluated
    touched: CellTable<LatticeNode, ()>,
    free_space: CellTable<LatticeNode, ()>,
    /// signed distance of the scan at each of `nodes`; constant
    pub scan: Vec<ScanDistance>,
    /// whether the scan has material at other nodes, cached
    pub beyond: CellTable<LatticeNode, bool>,
    pub renewals: u32,
    scratch: FieldScratch,
}

/// Maximum step of a distance field between neighbours, in pitches: the distance between the
/// points, one pitch, and noise.
const LARGEST_STEP: f64 = 1.1;
/// Radius of evaluated nodes around a contact, in radii of the tip.
const REACH: f64 = 2.8;
/// Margin of evaluated nodes around a ball that entered the scan, in cells.
const BALL_MARGIN: f64 = 2.0;
/// Radius within which changes count most, in radii of the tip.
const NEAR: f64 = 1.1;

impl ReconstructionGrid {
    /// A grid without nodes.
    pub(crate) fn new(lattice: Lattice) -> Self {
        Self {
            lattice,
            ..Self::default()
        }
    }

    /// Updates the field with the changes of `evidence`.
    ///
    /// - `changes`: applied up to the radius at which they count most.
    /// - `late`: earlier changes, applied up to the radius at which they count at all.
    pub(crate) fn renew(
        &mut self,
        evidence: &Evidence<'_>,
        changes: &GridChanges,
        late: &GridChanges,
    ) -> LatticeChanges {
        self.renewals += 1;
        let mut look = EarlierStates::default();
        if !self.nodes.is_empty() {
            let p = evidence.params;
            let cover = evidence.free_space.cover_radius(p.radius);
            self.look_near(&changes.means, NEAR * p.radius, &mut look);
            self.look_near(&changes.centres, cover, &mut look);
            self.look_near(
                &late.means,
                p.field.reach.max(SCAN_REMOVAL * p.radius + p.scan_reach),
                &mut look,
            );
            self.look_near(
                &late.centres,
                cover + SWEPT_REACH * p.radius + p.scan_reach,
                &mut look,
            );
            self.look_at_ends(evidence, late, &mut look);
        }
        self.widen(evidence, changes, &mut look);
        let mut area = CellBox::EMPTY;
        for at in 0..look.len() as u32 {
            let node = look.entry(at).0;
            let known = self.nodes.index_of(&node);
            let before = known.map(|known| self.nodes.entry(known).1);
            let scan = known.map(|known| self.scan[known as usize]);
            let Some(scan) = scan.or_else(|| evidence.scan_at(&self.lattice.position(node))) else {
                continue;
            };
            let mut state = self.evaluate(evidence, node, &scan);
            if let Some(before) =
                before.filter(|before| before.is_open_question() && state.is_open_question())
            {
                state.value = before.value.max(state.least);
            }
            *look.value_mut(at) = before;
            self.put(node, state, scan);
            area.take(&node);
        }
        self.drop_discontinuities(&mut look, &mut area);
        self.update(evidence, &area, &look)
    }

    /// Evaluates further unknown nodes in and around `cells`: a filled surface goes on there.
    pub(crate) fn look_further(
        &mut self,
        evidence: &Evidence<'_>,
        cells: &LatticeRegion,
    ) -> LatticeChanges {
        let (mut look, mut area) = (EarlierStates::default(), CellBox::EMPTY);
        for (cell, ()) in cells.iter() {
            for node in (CellBox { lo: cell, hi: cell }).widened(1, 2).iter() {
                if self.add(evidence, node, true) {
                    look.insert_with(node, || None);
                    area.take(&node);
                }
            }
        }
        self.update(evidence, &area, &look)
    }

    /// Evaluates an unknown node; returns whether it is new.
    pub(crate) fn add(
        &mut self,
        evidence: &Evidence<'_>,
        node: LatticeNode,
        is_further: bool,
    ) -> bool {
        if self.nodes.contains(&node) {
            return false;
        }
        let Some(scan) = evidence.scan_at(&self.lattice.position(node)) else {
            return false;
        };
        let state = self.evaluate(evidence, node, &scan);
        self.put(
            node,
            NodeState {
                is_further,
                ..state
            },
            scan,
        );
        true
    }

    /// Whether a cell has an unevaluated corner.
    pub(crate) fn is_beyond(&self, cell: LatticeNode) -> bool {
        (0..8).any(|corner| !self.nodes.contains(&node_at(cell, corner)))
    }

    /// Drops, or restores, the values of the touches at discontinuities: at the nodes evaluated
    /// again and beside them.
    fn drop_discontinuities(&mut self, look: &mut EarlierStates, area: &mut CellBox) {
        let beside = |node: LatticeNode| std::iter::once(node).chain(neighbours(node));
        let near: CellTable<LatticeNode, ()> =
            look.iter().flat_map(|(node, _)| beside(node)).collect();
        for (node, ()) in near.iter() {
            let Some(before) = self.nodes.get(&node).copied() else {
                continue;
            };
            let Some(touched_value) = before.touched_value else {
                continue;
            };
            let is_discontinuous = self.is_discontinuous(node, touched_value);
            if is_discontinuous == (before.source == Source::Nothing) {
                continue;
            }
            let (at, _) = look.insert_with(node, || Some(before));
            let last = look.entry(at).1.filter(NodeState::is_open_question);
            let state = NodeState {
                source: if is_discontinuous {
                    Source::Nothing
                } else {
                    Source::Touch
                },
                value: if is_discontinuous {
                    last.map_or(touched_value, |last| last.value)
                } else {
                    touched_value
                },
                straight: (0.0, 0.0),
                ..before
            };
            self.nodes.insert(node, state);
            area.take(&node);
        }
    }

    /// Whether the field of the touches, `value` (m) at `node`, is discontinuous from outside into
    /// the material towards a neighbour: the two are values of different surfaces, and the wrong
    /// one is unknown. The remainder around both fills the gap. Depends on the touched values one
    /// step away alone.
    fn is_discontinuous(&self, node: LatticeNode, value: f64) -> bool {
        let is_other = |other: f64| {
            (value < 0.0) != (other < 0.0)
                && (value - other).abs() > LARGEST_STEP * self.lattice.pitch
        };
        neighbours(node)
            .into_iter()
            .filter_map(|node| self.nodes.get(&node)?.touched_value)
            .any(is_other)
    }

    fn put(&mut self, node: LatticeNode, state: NodeState, scan: ScanDistance) {
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
    fn look_near(&self, points: &[Point3<f64>], reach: f64, look: &mut EarlierStates) {
        let offsets = ball((reach / self.lattice.pitch).ceil() as i32 + 1);
        for point in points {
            let cell = self.lattice.cell_of(point);
            for node in offsets.iter().map(|offset| moved(&cell, offset)) {
                let is_near = (self.lattice.position(node) - point).norm_squared() < reach * reach;
                if is_near && self.nodes.contains(&node) {
                    look.insert_with(node, || None);
                }
            }
        }
    }

    /// Adds the ends of paths near the changes: the end of a path depends on the path, and on
    /// contacts beside it.
    fn look_at_ends(
        &self,
        evidence: &Evidence<'_>,
        changes: &GridChanges,
        look: &mut EarlierStates,
    ) {
        let p = evidence.params;
        for (end, ()) in self.ends.iter() {
            let x = self.lattice.position(end);
            let is_near =
                |points: &[Point3<f64>], reach: f64| points.iter().any(|p| (p - x).norm() < reach);
            if is_near(&changes.means, p.radius + FREE_REACH * p.radius)
                || is_near(&changes.centres, 1.5 * p.radius)
            {
                look.insert_with(end, || None);
            }
        }
    }

    /// Adds the nodes near contacts, and near a ball that entered the scan.
    fn widen(&mut self, evidence: &Evidence<'_>, changes: &GridChanges, look: &mut EarlierStates) {
        let radius = evidence.params.radius;
        let around_contact = ball((REACH * radius / self.lattice.pitch).ceil() as i32);
        let cover = evidence.free_space.cover_radius(radius);
        let around_ball = ball((cover / self.lattice.pitch + BALL_MARGIN).ceil() as i32);
        let mut add = |cell: &LatticeNode, offsets: &[LatticeNode]| {
            for node in offsets.iter().map(|offset| moved(cell, offset)) {
                if self.nodes.get(&node).is_none_or(|state| state.is_further) {
                    look.insert_with(node, || None);
                }
            }
        };
        for cell in changes
            .means
            .iter()
            .map(|point| self.lattice.cell_of(point))
        {
            if self.touched.insert_with(cell, || ()).1 {
                add(&cell, &around_contact);
            }
        }
        for centre in &changes.centres {
            let cell = self.lattice.cell_of(centre);
            let is_near = || {
                evidence
                    .tree
                    .closest(evidence.scan, centre, cover + self.lattice.pitch)
                    .is_some()
            };
            // in a closed scan all of the path is a void with a surface around it
            let is_inside = || {
                evidence.is_closed
                    && evidence
                        .scan_at(centre)
                        .is_some_and(|scan| scan.value < 0.0)
            };
            if !self.free_space.contains(&cell) && (is_near() || is_inside()) {
                self.free_space.insert_with(cell, || ());
                add(&cell, &around_ball);
            }
        }
    }

    fn evaluate(
        &mut self,
        evidence: &Evidence<'_>,
        node: LatticeNode,
        scan: &ScanDistance,
    ) -> NodeState {
        evidence.beside(
            scan,
            &self.lattice.position(node),
            self.lattice.pitch,
            &mut self.scratch,
        )
    }

    /// Whether the skin in a cell differs from the scan.
    pub(crate) fn is_in_region(&self, cell: LatticeNode) -> bool {
        let corners = || (0..8).filter_map(|corner| self.nodes.get(&node_at(cell, corner)));
        let is_on_rim = corners().any(|state| state.source == Source::Rim);
        let is_other = if is_on_rim {
            NodeState::is_turned
        } else {
            NodeState::is_changed
        };
        self.can_take(cell) && corners().any(is_other)
    }

    /// Whether the field is known at all corners of a cell that need not stay open.
    pub(crate) fn can_take(&self, cell: LatticeNode) -> bool {
        let is_known = |node: LatticeNode| {
            self.nodes
                .get(&node)
                .is_some_and(|state| state.source != Source::Beyond)
        };
        !self.open.contains(&cell) && (0..8).all(|corner| is_known(node_at(cell, corner)))
    }

    /// Values at the corners of the cells in a box.
    pub(crate) fn values_in(&self, cells: &CellBox) -> NodeValues {
        let mut values = NodeValues::default();
        cells.widened(0, 1).each_in(&self.nodes, |node, state| {
            if state.source != Source::Beyond {
                values.insert_with(node, || state.value);
            }
        });
        values
    }
}

/// Number of nodes of a lattice of `pitch` (m) around one contact of a tip of `radius` (m).
pub(in crate::reconstruct) fn nodes_around_contact(radius: f64, pitch: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * (REACH * radius / pitch).powi(3)
}

/// Approximate number of nodes around all of `contacts`: of the cubes of half the reach that are
/// next to one with a contact. Along a sheet these are three cubes high instead of the four
/// evaluated, which the factor compensates.
pub(in crate::reconstruct) fn nodes_around_contacts(
    contacts: impl Iterator<Item = Point3<f64>>,
    radius: f64,
    pitch: f64,
) -> f64 {
    let edge = REACH * radius / 2.0;
    let touched: BTreeSet<VoxelKey> = contacts.map(|contact| voxel_of(&contact, edge)).collect();
    let around: BTreeSet<VoxelKey> = touched.into_iter().flat_map(voxel_neighbourhood).collect();
    around.len() as f64 * 4.0 / 3.0 * (edge / pitch).powi(3)
}

/// Steps from a node to all nodes within `radius` steps.
fn ball(radius: i32) -> Vec<LatticeNode> {
    let all = CellBox {
        lo: [-radius; 3],
        hi: [radius; 3],
    };
    all.iter()
        .filter(|[i, j, k]| i * i + j * j + k * k <= radius * radius)
        .collect()
}

fn moved(node: &LatticeNode, offset: &LatticeNode) -> LatticeNode {
    std::array::from_fn(|i| node[i].saturating_add(offset[i]))
}

/// Cells that a renewal may have added to the region or removed from it.
pub(in crate::reconstruct) fn cells_of(changed: &LatticeChanges) -> LatticeRegion {
    let around = changed
        .nodes
        .iter()
        .flat_map(|&node| (0..8).map(move |corner| cell_at(node, corner)));
    around.chain(changed.open.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of pitch 2 mm with these values of the touches, m.
    fn touched(values: impl Iterator<Item = (LatticeNode, f64)>) -> ReconstructionGrid {
        let mut grid = ReconstructionGrid::new(Lattice {
            origin: Point3::origin(),
            pitch: 2e-3,
        });
        values.for_each(|(node, value)| grid.nodes.insert(node, NodeState::touched(value)));
        grid
    }

    /// Discontinuity of each of a line of nodes one pitch (2 mm) apart.
    fn discontinuous(value: &[f64]) -> Vec<bool> {
        let grid = touched((0..).zip(value).map(|(i, value)| ([i, 0, 0], value * 1e-3)));
        (0..)
            .zip(value)
            .map(|(i, value)| grid.is_discontinuous([i, 0, 0], value * 1e-3))
            .collect()
    }

    #[test]
    fn a_distance_stays_and_a_discontinuity_goes_on_both_sides() {
        // a wall at 3.1 mm, met head-on: its distance changes by the pitch
        assert_eq!(discontinuous(&[3.1, 1.1, -0.9, -2.9]), [false; 4]);
        // 0.3 mm before one surface and, one node on, 2.5 mm behind another
        assert_eq!(
            discontinuous(&[2.3, 0.3, -2.5, -4.5]),
            [false, true, true, false]
        );
        // far inside it makes no surface
        assert_eq!(discontinuous(&[-0.3, -5.0]), [false; 2]);
    }

    #[test]
    fn a_node_without_touches_is_no_contradiction() {
        assert!(touched([([1, 0, 0], -2.5e-3)].into_iter()).is_discontinuous([0; 3], 0.3e-3));
        assert!(!touched(std::iter::empty()).is_discontinuous([0; 3], 0.3e-3));
    }
}
