//! When two triangles may replace the four around an edge: the tests of intersection-free
//! contouring \[Ju Udeshi 2006\].
//!
//! Four cells with vertices c0 … c3 meet at an edge E of the lattice. If each segment from ci to
//! ci+1 passes through the square between the two cells, the tetrahedra (E, ci, ci+1) belong to E
//! alone; a triangle inside their union cannot meet a triangle of another edge.

use nalgebra::{Point3, Vector2, Vector3};

use crate::reconstruct::lattice::{Lattice, Square, across};
use touchup_geometry::mesh::triangle::shape_quality;
use touchup_geometry::numeric::direction;

/// Minimum distance of a segment from the rim of a square, as a share of the pitch.
const INSET: f64 = 1e-3;
/// Minimum volume that counts as to one side, as a share of the cube of the lattice's pitch.
const SLACK: f64 = 1e-9;
/// Difference of the angles (cosine) at the two diagonals above which the flatter diagonal wins: a
/// crease runs along it.
const CREASE: f64 = 0.06;
/// Places tried on either side of the middle of a fan that folds over.
const STEPS: u32 = 8;
/// Sine of the angle between two normals on a square above which a corner lies between them: 37°.
const CORNER: f64 = 0.6;

/// Whether the segment from `a` to `b`, on either side of a square, passes through its inside.
pub(in crate::reconstruct) fn passes(
    lattice: &Lattice,
    square: &Square,
    a: &Point3<f64>,
    b: &Point3<f64>,
) -> bool {
    let axis = square.axis as usize;
    let share = (lattice.coordinate(axis, square.node[axis]) - a[axis]) / (b[axis] - a[axis]);
    let is_inside = |i: usize| {
        let step =
            (a[i] + (b[i] - a[i]) * share - lattice.coordinate(i, square.node[i])) / lattice.pitch;
        (INSET..=1.0 - INSET).contains(&step)
    };
    let (u, v) = across(axis);
    is_inside(u) && is_inside(v)
}

/// Bend of the surface on a square: the point of the square in which the planes at the two ends of
/// a segment meet, or the segment's middle if the planes hardly differ.
///
/// - `ends`: points on two edges of the square, with the unit normals of the surface there.
pub(in crate::reconstruct) fn bend(
    lattice: &Lattice,
    square: &Square,
    ends: &[(Point3<f64>, Vector3<f64>); 2],
) -> Point3<f64> {
    let (u, v) = across(square.axis as usize);
    let flat = ends.map(|(p, n)| (Vector2::new(p[u], p[v]), Vector2::new(n[u], n[v])));
    let middle = nalgebra::center(&ends[0].0, &ends[1].0);
    let [(p, m), (q, n)] = flat;
    let turn = m.perp(&n);
    if turn.abs() < CORNER * m.norm() * n.norm() || turn == 0.0 {
        return middle;
    }
    let (a, b) = (m.dot(&p), n.dot(&q));
    let mut point = middle;
    (point[u], point[v]) = ((a * n.y - b * m.y) / turn, (m.x * b - n.x * a) / turn);
    lattice.clamped(point, square.node, square.corners()[2], INSET)
}

/// Six times the signed volume of a tetrahedron.
#[inline]
fn volume(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>) -> f64 {
    (b - a).dot(&(c - a).cross(&(d - a)))
}

/// Whether the segment from `p` to `q` clearly passes through the inside of triangle `abc`.
fn pierces(p: &Point3<f64>, q: &Point3<f64>, [a, b, c]: [&Point3<f64>; 3], slack: f64) -> bool {
    let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    let (below, above) = (volume(p, a, b, c), volume(q, a, b, c));
    (turns.iter().all(|&x| x > slack) || turns.iter().all(|&x| x < -slack))
        && (below.min(above) < -slack && below.max(above) > slack)
}

/// The safe diagonal of the quadrilateral c0 … c3 around the edge from `e0` to `e1`: 0 for c0–c2, 1
/// for c1–c3, `None` if only the fan around a point of the edge is safe.
pub(in crate::reconstruct) fn diagonal(
    e0: &Point3<f64>,
    e1: &Point3<f64>,
    c: &[Point3<f64>; 4],
    pitch: f64,
) -> Option<usize> {
    let slack = SLACK * pitch * pitch * pitch;
    // the diagonal passes one of the other two vertices on the side of the edge, the edge passes
    // the other triangle
    let is_safe = |i: usize| {
        let (a, b, opposite, d) = (&c[i], &c[i + 1], &c[i + 2], &c[(i + 3) % 4]);
        [(b, d), (d, b)].iter().any(|(near, far)| {
            pierces(a, opposite, [e0, e1, near], slack)
                && pierces(e0, e1, [a, opposite, far], slack)
        })
    };
    match [is_safe(0), is_safe(1)] {
        [false, false] => None,
        [true, false] => Some(0),
        [false, true] => Some(1),
        [true, true] => Some(better(c)),
    }
}

/// Moves the middle of a fan along its edge if the fan would fold over: there the surface hardly
/// leaves the edge, and the crossing is arbitrary. Any point of the edge is safe.
///
/// - `middle`: a point of the edge; `normal`: unit normal of the surface there.
/// - `edge`: the parts of the edge below and above the middle, m, as vectors.
/// - `ring`: the steps around the fan, counter-clockwise seen against the normal.
/// - `drift`: maximum distance of the middle from the surface, m.
pub(in crate::reconstruct) fn unfolded(
    middle: &Point3<f64>,
    normal: &Vector3<f64>,
    edge: [Vector3<f64>; 2],
    ring: &[[Point3<f64>; 2]],
    drift: f64,
) -> Point3<f64> {
    let least_height = |move_by: Vector3<f64>| {
        let from = middle + move_by;
        let height = |[p, q]: &[Point3<f64>; 2]| {
            (p - from).cross(&(q - from)).dot(normal) / (q - p).norm().max(drift)
        };
        ring.iter().map(height).fold(f64::INFINITY, f64::min)
    };
    let (mut best, mut most) = (Vector3::zeros(), least_height(Vector3::zeros()));
    if most >= 0.0 {
        return *middle;
    }
    for side in edge {
        let share = (drift / normal.dot(&side).abs()).min(1.0);
        for step in 1..=STEPS {
            let move_by = side * (share * f64::from(step) / f64::from(STEPS));
            let height = least_height(move_by);
            if height > most {
                (best, most) = (move_by, height);
            }
        }
    }
    middle + best
}

/// The flatter diagonal if they differ clearly, else the diagonal with the better triangles.
fn better(c: &[Point3<f64>; 4]) -> usize {
    let rate = |i: usize| {
        let triangles = [[c[i], c[i + 1], c[i + 2]], [c[i], c[i + 2], c[(i + 3) % 4]]];
        let normals = triangles.map(|t| (t[1] - t[0]).cross(&(t[2] - t[0])));
        let worse = [0, 1].map(|k| shape_quality(&triangles[k], normals[k].norm()));
        let [m, n] = normals.map(|n| direction(&n).unwrap_or_else(Vector3::zeros));
        (m.dot(&n), worse[0].min(worse[1]))
    };
    let ((flat0, shape0), (flat1, shape1)) = (rate(0), rate(1));
    let is_first = if (flat0 - flat1).abs() > CREASE {
        flat0 > flat1
    } else {
        shape0 >= shape1
    };
    usize::from(!is_first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge() -> [Point3<f64>; 2] {
        [Point3::new(0.0, 0.0, -0.5), Point3::new(0.0, 0.0, 0.5)]
    }

    fn points(c: [(f64, f64, f64); 4]) -> [Point3<f64>; 4] {
        c.map(|(x, y, z)| Point3::new(x, y, z))
    }

    #[test]
    fn a_convex_quadrilateral_is_split_along_its_shorter_or_flatter_diagonal() {
        let [e0, e1] = edge();
        let flat = points([
            (0.3, 0.4, 0.0),
            (-0.6, 0.7, 0.0),
            (-0.4, -0.3, 0.0),
            (0.6, -0.6, 0.0),
        ]);
        assert_eq!(diagonal(&e0, &e1, &flat, 1.0), Some(0));
        // along c1–c3 it bends by a right angle, along c0–c2 by a few degrees
        let bent = points([
            (0.1, 0.11, -0.1),
            (-0.9, 0.9, 0.0),
            (-0.1, -0.1, -0.1),
            (0.9, -0.9, 0.0),
        ]);
        assert_eq!(diagonal(&e0, &e1, &bent, 1.0), Some(0));
        let turned = [bent[3], bent[0], bent[1], bent[2]];
        assert_eq!(better(&turned), 1);
    }

    #[test]
    fn only_the_fan_is_safe_where_the_edge_is_missed() {
        let [e0, e1] = edge();
        // c0 lies so near the edge that c1–c3 passes c0 on the edge's side
        let c = points([
            (0.05, 0.05, 0.0),
            (-0.5, 0.9, 0.0),
            (-0.5, -0.6, 0.0),
            (0.9, -0.5, 0.0),
        ]);
        assert_eq!(diagonal(&e0, &e1, &c, 1.0), Some(0));
        // all four lie above the upper end of the edge
        let high = c.map(|p| p + Vector3::new(0.0, 0.0, 0.7));
        assert_eq!(diagonal(&e0, &e1, &high, 1.0), None);
    }

    #[test]
    fn a_segment_passes_a_square_or_misses_it() {
        let lattice = Lattice {
            origin: Point3::origin(),
            pitch: 0.5,
        };
        let square = Square {
            node: [1, 0, 0],
            axis: 0,
        };
        let a = Point3::new(0.4, 0.1, 0.1);
        assert!(passes(&lattice, &square, &a, &Point3::new(0.9, 0.4, 0.4)));
        assert!(!passes(
            &lattice,
            &square,
            &Point3::new(0.1, 0.45, 0.1),
            &Point3::new(0.6, 0.55, 0.4)
        ));
    }

    #[test]
    fn the_middle_of_a_fan_that_folds_over_moves_to_where_it_does_not() {
        // a square in the plane x = 0, which holds the edge
        let ring =
            [(-1.0, 0.2), (1.0, 0.2), (1.0, 0.6), (-1.0, 0.6)].map(|(y, z)| Point3::new(0.0, y, z));
        let steps: Vec<_> = (0..4).map(|i| [ring[i], ring[(i + 1) % 4]]).collect();
        let unfold = |z: f64, normal: Vector3<f64>| {
            let edge = [Vector3::new(0.0, 0.0, -z), Vector3::new(0.0, 0.0, 1.0 - z)];
            unfolded(&Point3::new(0.0, 0.0, z), &normal, edge, &steps, 0.05).z
        };
        assert_eq!(unfold(0.3, Vector3::x()), 0.3, "it does not fold over");
        assert!(
            (0.2..=0.6).contains(&unfold(0.1, Vector3::x()))
                && (0.2..=0.6).contains(&unfold(0.9, Vector3::x()))
        );
        let steep = Vector3::new(0.8, 0.0, 0.6);
        assert!(
            unfold(0.1, steep) - 0.1 <= 0.05 / 0.6 + 1e-12,
            "it stays near the surface"
        );
    }
}
