//! Where the skin crosses an edge of the lattice.

use nalgebra::{Point3, Vector3};

use super::contour::Crossing;
use super::evidence::{Evidence, Source};
use super::field::FieldScratch;
use super::lattice::{Edge, Lattice, Node, stepped};
use super::restore::Restored;
use super::table::Table;

/// Steps towards the zero of the touched field: the values at the ends are its own, so few are needed.
const STEPS: usize = 3;

/// Crossings of the touched field, kept as long as the values at both ends stay.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossings {
    known: Table<Edge, Known>,
    scratch: FieldScratch,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    crossing: Crossing,
    /// the renewals that gave the ends their values
    renewals: [u32; 2],
}

impl Crossings {
    /// The crossing of an edge whose ends differ in sign: by the touched field itself between touched nodes, else between
    /// the values at the ends.
    pub fn at(&mut self, restored: &Restored, evidence: &Evidence<'_>, lattice: &Lattice, edge: &Edge) -> Crossing {
        let ends = [edge.node, edge.end()];
        let [Some(a), Some(b)] = ends.map(|node| restored.nodes.get(&node)) else {
            return between(restored, lattice, edge, [0.0; 2]);
        };
        let values = [a.value, b.value];
        if [a, b].iter().any(|state| state.source != Source::Touch) {
            return between(restored, lattice, edge, values);
        }
        let renewals = [a.renewal, b.renewal];
        if let Some(known) = self.known.get(edge).filter(|known| known.renewals == renewals) {
            return known.crossing;
        }
        let [a, b] = ends.map(|node| lattice.position(node));
        let crossing = of_touches(evidence, [&a, &b], values, &mut self.scratch)
            .unwrap_or_else(|| between(restored, lattice, edge, values));
        self.known.insert(*edge, Known { crossing, renewals });
        crossing
    }
}

/// The crossing of an edge by the values at its ends.
fn between(restored: &Restored, lattice: &Lattice, edge: &Edge, values: [f64; 2]) -> Crossing {
    let ends = [edge.node, edge.end()];
    let [a, b] = ends.map(|node| lattice.position(node));
    let share = share_of(values);
    let slope = gradient(restored, &ends[0]) * (1.0 - share) + gradient(restored, &ends[1]) * share;
    let outward = (b - a) * (values[1] - values[0]).signum();
    let normal = slope.try_normalize(0.0).unwrap_or_else(|| outward.normalize());
    Crossing { point: a + (b - a) * share, normal }
}

/// Where a straight line between two values is 0, as a share of the way.
fn share_of([at_a, at_b]: [f64; 2]) -> f64 {
    if at_a == at_b { 0.5 } else { (at_a / (at_a - at_b)).clamp(0.0, 1.0) }
}

/// The crossing of the touched field between two points at which its values differ in sign, by false position.
fn of_touches(
    evidence: &Evidence<'_>,
    [a, b]: [&Point3<f64>; 2],
    mut values: [f64; 2],
    scratch: &mut FieldScratch,
) -> Option<Crossing> {
    let (mut low, mut high) = (0.0, 1.0);
    let mut share = share_of(values);
    let mut normal = Vector3::zeros();
    for _ in 0..STEPS {
        let here = evidence.touched(&(a + (b - a) * share), scratch)?;
        normal = here.gradient;
        if (here.value < 0.0) == (values[0] < 0.0) {
            (low, values[0]) = (share, here.value);
        } else {
            (high, values[1]) = (share, here.value);
        }
        share = low + (high - low) * share_of(values);
    }
    Some(Crossing { point: a + (b - a) * share, normal })
}

/// Slope of the values at a node, of any length: by central differences, one-sided where a neighbour is missing.
fn gradient(restored: &Restored, node: &Node) -> Vector3<f64> {
    let value = |node: Node| {
        let state = restored.nodes.get(&node)?;
        (state.source != Source::Beyond).then_some(state.value)
    };
    let here = value(*node).unwrap_or(0.0);
    Vector3::from_fn(|axis, _| match (value(stepped(*node, axis, -1)), value(stepped(*node, axis, 1))) {
        (Some(below), Some(above)) => (above - below) / 2.0,
        (None, Some(above)) => above - here,
        (Some(below), None) => here - below,
        (None, None) => 0.0,
    })
}
