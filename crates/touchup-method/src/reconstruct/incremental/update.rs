//! Incremental update: refills the field around new evidence, and lists the changes.

use crate::reconstruct::evidence::point_evidence::{Evidence, NodeState, Source};
use crate::reconstruct::field::floating_components::floating_components;
use crate::reconstruct::field::grid::{EarlierStates, LatticeChanges, ReconstructionGrid};
use crate::reconstruct::field::harmonic_fill::{end_reach, harmonic_fill, open_cells};
use crate::reconstruct::lattice::{CellBox, LatticeNode, Numbers, stepped};

/// Minimum change of a node's value, in cells: 3 µm for a ball of 1.5 mm.
const SLACK: f64 = 4e-3;
/// Margin of the refilled field around the nodes evaluated again, in cells.
const FILL_MARGIN: i32 = 4;

impl ReconstructionGrid {
    /// Fills the unknown nodes in and around `area`; finds differences from `before`, or from the
    /// earlier value.
    pub(in crate::reconstruct) fn update(
        &mut self,
        evidence: &Evidence<'_>,
        area: &CellBox,
        before: &EarlierStates,
    ) -> LatticeChanges {
        if area.is_empty() {
            return LatticeChanges::default();
        }
        let radius = evidence.params.radius;
        let mut area = area.widened(FILL_MARGIN, FILL_MARGIN);
        let (mut at, mut was) = self.known_in(&area, before);
        let mut numbers = Numbers::new(&self.nodes, &area);
        harmonic_fill(self, &at, &numbers, radius);
        let dropped = self.drop_floating_components(evidence, &at);
        if !dropped.is_empty() {
            let known = at
                .iter()
                .zip(was)
                .map(|(&at, was)| (self.nodes.entry(at).0, was));
            let mut before: EarlierStates = known.collect();
            for (node, was) in dropped.iter() {
                before.insert_with(node, || *was);
                area.take(&node);
            }
            area = area.widened(FILL_MARGIN, FILL_MARGIN);
            (at, was) = self.known_in(&area, &before);
            numbers = Numbers::new(&self.nodes, &area);
            harmonic_fill(self, &at, &numbers, radius);
        }
        let (mut changed, mut turned) = (LatticeChanges::default(), Vec::new());
        for (&at, was) in at.iter().zip(&was) {
            let (node, now) = *self.nodes.entry(at);
            let state = self.nodes.value_mut(at);
            match was {
                Some(was) if !now.differs(was, SLACK * self.lattice.pitch) => {
                    (state.value, state.renewal) = (was.value.max(now.least), was.renewal);
                }
                _ => {
                    state.renewal = self.renewals;
                    changed.nodes.push(node);
                    turned.push(was.is_some_and(|was| (was.value < 0.0) != (now.value < 0.0)));
                }
            }
        }
        let nodes = changed.nodes.iter().zip(turned);
        let at_surface =
            nodes.filter(|(node, has_turned)| *has_turned || self.is_at_surface(&numbers, node));
        changed.at_surface = at_surface.map(|(node, _)| *node).collect();
        // a closed scan has a known bottom
        changed.open = if evidence.is_closed {
            Vec::new()
        } else {
            self.renew_open(&area, radius)
        };
        changed
    }

    /// Whether the surface in the cells around a node depends on its value: one of them is crossed,
    /// or an edge from a neighbour, at whose crossing the node contributes to the slope.
    fn is_at_surface(&self, numbers: &Numbers, node: &LatticeNode) -> bool {
        let is_material = |node: LatticeNode| {
            let at = numbers.of(&self.nodes, &node)?;
            Some(self.nodes.entry(at).1.value < 0.0)
        };
        let here = is_material(*node);
        let beyond = (0..6).map(|i| stepped(*node, i / 2, if i % 2 == 0 { 2 } else { -2 }));
        let is_other =
            |other: LatticeNode| is_material(other).is_some_and(|other| Some(other) != here);
        CellBox {
            lo: *node,
            hi: *node,
        }
        .widened(1, 1)
        .iter()
        .chain(beyond)
        .any(is_other)
    }

    /// The nodes in `area` and their earlier state: from `before`, or the current one.
    fn known_in(
        &self,
        area: &CellBox,
        before: &EarlierStates,
    ) -> (Vec<u32>, Vec<Option<NodeState>>) {
        let at = self.indices_in(area);
        let was = |&at: &u32| {
            let (node, state) = self.nodes.entry(at);
            before.get(node).map_or(Some(*state), |before| *before)
        };
        let was = at.iter().map(was).collect();
        (at, was)
    }

    /// Drops floating components; returns their nodes and the nodes beside them, with their earlier
    /// state: `None` for new nodes.
    fn drop_floating_components(&mut self, evidence: &Evidence<'_>, at: &[u32]) -> EarlierStates {
        let floating_components = floating_components(self, evidence, at);
        let mut dropped = EarlierStates::default();
        // the faces of the scan go with it, up to the nodes on their other side
        let around = |&node: &LatticeNode| CellBox { lo: node, hi: node }.widened(1, 1).iter();
        for node in floating_components.iter().flat_map(around) {
            dropped.insert_with(node, || self.nodes.get(&node).copied());
            self.add(evidence, node, false);
        }
        for node in &floating_components {
            if let Some(state) = self.nodes.get_mut(node) {
                (
                    state.source,
                    state.value,
                    state.straight,
                    state.touched_value,
                ) = (Source::Nothing, 0.0, (0.0, 0.0), None);
            }
        }
        dropped
    }

    /// Numbers of the nodes in a box; in order of insertion if that is all of them.
    fn indices_in(&self, area: &CellBox) -> Vec<u32> {
        if area.volume() < self.nodes.len() as f64 {
            let mut at = Vec::new();
            area.each(|node| at.extend(self.nodes.index_of(&node)));
            at
        } else {
            (0..self.nodes.len() as u32)
                .filter(|&at| area.contains(&self.nodes.entry(at).0))
                .collect()
        }
    }

    /// Updates the cells that stay open, if a path ends near `area`; returns the changed cells.
    fn renew_open(&mut self, area: &CellBox, radius: f64) -> Vec<LatticeNode> {
        let reach = end_reach(self, radius);
        let near = area.widened(reach, reach);
        if !self.ends.iter().any(|(end, ())| near.contains(&end)) && self.open.is_empty() {
            return Vec::new();
        }
        let open = open_cells(self, reach);
        let old = std::mem::replace(&mut self.open, open);
        let gone = old.iter().filter(|(cell, ())| !self.open.contains(cell));
        gone.chain(self.open.iter().filter(|(cell, ())| !old.contains(cell)))
            .map(|(cell, ())| cell)
            .collect()
    }
}
