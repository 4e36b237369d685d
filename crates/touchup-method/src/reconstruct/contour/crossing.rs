//! Crossings of the surface and the edges of the lattice.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::piecewise::FieldScratch;
use crate::reconstruct::evidence::point_evidence::{Evidence, Source};
use crate::reconstruct::field::grid::ReconstructionGrid;
use crate::reconstruct::lattice::{Edge, LatticeNode, stepped};
use crate::reconstruct::table::CellTable;
use touchup_geometry::numeric::direction;

/// Maximum number of steps to the zero of a field: one on a plane, some more at an edge.
const STEPS: usize = 8;
/// Share of the segment below which a value is zero.
const ENOUGH: f64 = 1e-3;

/// Sign change of f on an edge of the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// the point, m, in O; moved inside the edge if it is not there
    pub point: Point3<f64>,
    /// unit normal of the surface there, out of the material
    pub normal: Vector3<f64>,
}

/// Crossings of the touched field, valid as long as the values at both ends stay.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct Crossings {
    /// with the renewals of the values at the ends
    known: CellTable<Edge, ([u32; 2], Crossing)>,
    scratch: FieldScratch,
}

impl Crossings {
    /// The crossing of an edge with ends of opposite sign: from the touched field between touched
    /// nodes, else interpolated between the ends, and in free space moved to the surface of the
    /// ball.
    pub(crate) fn at(
        &mut self,
        grid: &ReconstructionGrid,
        evidence: &Evidence<'_>,
        edge: &Edge,
    ) -> Crossing {
        let ends = [edge.node, edge.end()];
        let [Some(a), Some(b)] = ends.map(|node| grid.nodes.get(&node)) else {
            return between(grid, edge, [0.0; 2]);
        };
        let values = [a.value, b.value];
        if [a, b].iter().any(|state| state.source != Source::Touch) {
            return between_beside_free_space(grid, evidence, edge, values);
        }
        let renewals = [a.renewal, b.renewal];
        if let Some((_, known)) = self.known.get(edge).filter(|(of, _)| *of == renewals) {
            return *known;
        }
        let [a, b] = ends.map(|node| grid.lattice.position(node));
        let crossing = of_touches(evidence, [&a, &b], values, &mut self.scratch)
            .unwrap_or_else(|| between_beside_free_space(grid, evidence, edge, values));
        self.known.insert(*edge, (renewals, crossing));
        crossing
    }
}

/// Interpolated crossing of an edge; in free space, on the surface of the ball.
fn between_beside_free_space(
    grid: &ReconstructionGrid,
    evidence: &Evidence<'_>,
    edge: &Edge,
    values: [f64; 2],
) -> Crossing {
    let inner = if values[0] < 0.0 {
        edge.node
    } else {
        edge.end()
    };
    out_of_free_space(
        evidence,
        between(grid, edge, values),
        &grid.lattice.position(inner),
    )
}

/// Interpolated crossing of an edge from the values at its ends.
fn between(grid: &ReconstructionGrid, edge: &Edge, values: [f64; 2]) -> Crossing {
    let ends = [edge.node, edge.end()];
    let [a, b] = ends.map(|node| grid.lattice.position(node));
    let share = share_of(values);
    let slope = gradient(grid, &ends[0]) * (1.0 - share) + gradient(grid, &ends[1]) * share;
    let outward = (b - a) * (values[1] - values[0]).signum();
    let normal = direction(&slope).unwrap_or_else(|| outward.normalize());
    Crossing {
        point: a + (b - a) * share,
        normal,
    }
}

/// Zero of a straight line between two values, as a share of the segment.
fn share_of([at_a, at_b]: [f64; 2]) -> f64 {
    if at_a == at_b {
        0.5
    } else {
        (at_a / (at_a - at_b)).clamp(0.0, 1.0)
    }
}

/// Moves a crossing in free space to the boundary of free space on the path into the material: the
/// values at the nodes respect free space, a straight line between them does not.
///
/// - `inner`: the end of the edge in the material.
fn out_of_free_space(evidence: &Evidence<'_>, crossing: Crossing, inner: &Point3<f64>) -> Crossing {
    let depth = |x: &Point3<f64>| evidence.free_depth(x).map(|(depth, _)| depth);
    let depths = [&crossing.point, inner].map(depth);
    let [Some(here @ 0.0..), Some(at_inner @ ..0.0)] = depths else {
        return crossing;
    };
    let field = |x: &Point3<f64>| {
        let (depth, centre) = evidence.free_depth(x)?;
        let outward = direction(&(centre - x)).filter(|_| evidence.free_space.is_of_ball());
        Some((depth, outward.unwrap_or(crossing.normal)))
    };
    zero_between([&crossing.point, inner], [here, at_inner], field).unwrap_or(crossing)
}

/// The crossing of the touched field between two points with values of opposite sign. `None` if the
/// field is discontinuous between two surfaces: the gradient of neither matches the step between
/// them.
fn of_touches(
    evidence: &Evidence<'_>,
    [a, b]: [&Point3<f64>; 2],
    values: [f64; 2],
    scratch: &mut FieldScratch,
) -> Option<Crossing> {
    let crossing = zero_between([a, b], values, |x| {
        let here = evidence.touched(x, None, scratch)?;
        Some((here.value, here.gradient))
    })?;
    let rises = crossing.normal.dot(&(b - a)) > 0.0;
    (rises == (values[1] > values[0])).then_some(crossing)
}

/// The zero of a field between two points with values of opposite sign, by false position
/// (Illinois).
///
/// - `field`: value, m, and unit gradient at a point.
fn zero_between(
    [a, b]: [&Point3<f64>; 2],
    values: [f64; 2],
    mut field: impl FnMut(&Point3<f64>) -> Option<(f64, Vector3<f64>)>,
) -> Option<Crossing> {
    let mut ends = [(0.0, values[0]), (1.0, values[1])];
    let mut last = None;
    let mut best: Option<(f64, Crossing)> = None;
    for _ in 0..STEPS {
        let share = ends[0].0 + (ends[1].0 - ends[0].0) * share_of(ends.map(|(_, value)| value));
        let point = a + (b - a) * share;
        let (value, normal) = field(&point)?;
        if best.is_none_or(|(least, _)| value.abs() < least) {
            best = Some((value.abs(), Crossing { point, normal }));
        }
        if value.abs() < ENOUGH * (b - a).norm() {
            break;
        }
        let side = usize::from((value < 0.0) != (values[0] < 0.0));
        ends[side] = (share, value);
        if last == Some(side) {
            // the other end has stayed: the field bends
            ends[1 - side].1 /= 2.0;
        }
        last = Some(side);
    }
    best.map(|(_, crossing)| crossing)
}

/// Slope of the values at a node, unnormalised: central differences, one-sided beside a missing
/// neighbour.
fn gradient(grid: &ReconstructionGrid, node: &LatticeNode) -> Vector3<f64> {
    let value = |node: LatticeNode| {
        let state = grid.nodes.get(&node)?;
        (state.source != Source::Beyond).then_some(state.value)
    };
    let here = value(*node).unwrap_or(0.0);
    Vector3::from_fn(|axis, _| {
        match (
            value(stepped(*node, axis, -1)),
            value(stepped(*node, axis, 1)),
        ) {
            (Some(below), Some(above)) => (above - below) / 2.0,
            (None, Some(above)) => above - here,
            (Some(below), None) => here - below,
            (None, None) => 0.0,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::evidence::free_space::FreeSpace;
    use crate::reconstruct::model::KnownSurfaces;
    use crate::reconstruct::{ContactMap, ContactSigma, EvidenceParams, SurfaceContact};
    use crate::stylus::{TipBody, TipShape};
    use touchup_geometry::mesh::{FaceTree, TriMesh};

    const RADIUS: f64 = 1.5e-3;

    /// Contacts of a step: the face z = 0 for y < 0, and the wall y = 0 below it.
    fn step() -> ContactMap {
        let mut contacts = ContactMap::new(RADIUS / 3.0, 2.0 * RADIUS, None);
        for (i, j) in (-12..=12)
            .flat_map(|i| (1..=16).map(move |j| (f64::from(i) * 0.5e-3, f64::from(j) * 0.5e-3)))
        {
            for (point, normal) in [
                (Point3::new(i, -j, 0.0), Vector3::z()),
                (Point3::new(i, 0.0, -j), Vector3::y()),
            ] {
                contacts.add(&SurfaceContact {
                    point,
                    normal,
                    weight: 5.0,
                    stamp_ns: 0,
                    sigma: ContactSigma::default(),
                });
            }
        }
        contacts
    }

    #[test]
    fn just_below_an_edge_the_crossing_is_that_of_the_wall() {
        let contacts = step();
        let scan = TriMesh::new(
            vec![
                Point3::origin(),
                Point3::new(1.0, 0.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
            ],
            vec![[0, 1, 2]],
        );
        let scan = scan.unwrap();
        let (tree, params) = (FaceTree::new(&scan), EvidenceParams::new(RADIUS, 0.3e-3));
        let tip = TipBody::new(TipShape::Ball, RADIUS).unwrap();
        let free_space = FreeSpace::new(tip, 0.1 * RADIUS, 2.0 * RADIUS);
        let (contacts, free_space) = (&contacts, &free_space);
        let evidence = Evidence {
            params: &params,
            contacts,
            free_space,
            known: &KnownSurfaces::new(RADIUS),
            scan: &scan,
            tree: &tree,
            prior: None,
            agreement: None,
            is_closed: false,
        };
        let mut scratch = FieldScratch::default();
        for (depth, share) in [(0.02e-3, 0.5), (0.05e-3, 0.7), (0.1e-3, 0.9), (0.3e-3, 0.2)] {
            let [a, b] =
                [-share, 1.0 - share].map(|y| Point3::new(0.1e-3, y * RADIUS / 2.0, -depth));
            let values =
                [&a, &b].map(|p| params.field.at(contacts, p, &mut scratch).unwrap().value);
            assert!(values[0] < 0.0 && values[1] > 0.0);
            let found = of_touches(&evidence, [&a, &b], values, &mut scratch).unwrap();
            assert!(
                found.point.y.abs() < 0.02 * RADIUS / 2.0
                    && (found.normal - Vector3::y()).norm() < 1e-9,
                "{depth}: {found:?}"
            );
        }
        // from outside below into the material above the face: no touched surface
        let [a, b] = [-0.2e-3, 0.2e-3].map(|z| Point3::new(0.1e-3, -4e-3, z));
        assert!(of_touches(&evidence, [&a, &b], [-0.2e-3, 0.2e-3], &mut scratch).is_some());
        assert_eq!(
            of_touches(&evidence, [&a, &b], [0.2e-3, -0.2e-3], &mut scratch),
            None
        );
    }
}
