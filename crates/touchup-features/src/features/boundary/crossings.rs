//! Crossings of the loops of a face.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector2, Vector3};

use touchup_geometry::brep::{
    AnalyticSurface, BrepEdge, BrepFace, BrepParts, OrientedEdge, SurfaceShape,
};
use touchup_geometry::numeric::length_and_direction;

/// Distance of a crossing of edges from a vertex that makes it none, in their tolerances.
const NEAR_VERTEX: f64 = 3.0;
/// Minimum tolerance of an edge, m: splines are that near to their surfaces.
pub(super) const LEAST_TOLERANCE: f64 = 1e-7;

/// Largest distance of an edge from a surface, and of its vertices from it, m.
pub(super) fn worst(parts: &BrepParts, edge: &BrepEdge, surface: &AnalyticSurface) -> f64 {
    let [from, to] = [edge.start, edge.end].map(|vertex| parts.vertices[vertex]);
    let off = edge.curve.points(&from, &to).into_iter();
    let off = off.map(|p| surface.signed_distance(&p).abs());
    let ends = [from, to].map(|p| edge.curve.distance(&p));
    off.chain(ends).fold(LEAST_TOLERANCE, f64::max)
}

/// Share of a piece within which it ends, and sine of parallel pieces: far above roundings.
const ROUNDING: f64 = 1e-6;

/// Piece of a loop in the plane of a surface's parameters, m.
#[derive(Clone, Copy)]
struct LoopPiece {
    from: Vector2<f64>,
    to: Vector2<f64>,
    /// its beginning in space, m
    begin: Point3<f64>,
    /// distance from a vertex at which it may cross another, m
    near: f64,
    /// number of its edge, and its own along that
    number: [usize; 2],
}

impl LoopPiece {
    /// Place of a crossing with another piece, not its neighbour.
    fn crossing(&self, other: &Self) -> Option<Vector2<f64>> {
        if self.number[0] == other.number[0] && self.number[1].abs_diff(other.number[1]) < 2 {
            return None;
        }
        let (along, across) = (self.to - self.from, other.to - other.from);
        let off = other.from - self.from;
        let square = along.perp(&across);
        let shares = [off.perp(&across) / square, off.perp(&along) / square];
        let inside = -ROUNDING..1.0 + ROUNDING;
        let is_inside = shares.iter().all(|share| inside.contains(share));
        let is_parallel = square.abs() <= ROUNDING * along.norm() * across.norm();
        (is_inside && !is_parallel).then(|| self.from + along * shares[0])
    }

    fn low(&self) -> f64 {
        self.from.y.min(self.to.y)
    }

    fn moved(&self, by: f64) -> Self {
        let by = Vector2::new(by, 0.0);
        Self {
            from: self.from + by,
            to: self.to + by,
            ..*self
        }
    }
}

/// Distance between the middles of two edges that are one, in their length.
const ONE_EDGE: f64 = 0.05;

/// Whether two edges between the same vertices run along each other.
pub(super) fn are_one(parts: &BrepParts, pair: [&OrientedEdge; 2]) -> bool {
    let [a, b] = pair.map(|one| &parts.edges[one.edge]);
    let is_same = [(a.start, a.end), (a.end, a.start)].contains(&(b.start, b.end));
    if !is_same || a.start == a.end {
        return false;
    }
    let [from, to] = [a.start, a.end].map(|vertex| parts.vertices[vertex]);
    let points = a.curve.points(&from, &to);
    b.curve.distance(&points[points.len() / 2]) <= ONE_EDGE * (to - from).norm()
}

/// A place in which the loops of a face meet twice: a vertex of two of its corners, one edge for
/// two, or a crossing.
pub(super) fn crossing(parts: &BrepParts, face: &BrepFace) -> Option<Point3<f64>> {
    let edges: Vec<&OrientedEdge> = face.edges().collect();
    let from = |one: &OrientedEdge| parts.ends(one)[0];
    let is_double = |&(at, one): &(usize, &&OrientedEdge)| {
        let mut others = edges[at + 1..].iter();
        others.any(|other| from(one) == from(other) || are_one(parts, [one, other]))
    };
    let double = edges.iter().enumerate().find(is_double);
    let place = double.map(|(_, one)| parts.vertices[from(one)]);
    place.or_else(|| FlatLoops::of(parts, &face.surface, &edges).crossing())
}

/// Loops of a face in the plane of its surface's parameters.
struct FlatLoops {
    /// from below
    pieces: Vec<LoopPiece>,
    /// vertices, m
    ends: Vec<Vector2<f64>>,
    /// length of a turn of the surface along x, m; 0 of a plane or sphere
    turn: f64,
}

impl FlatLoops {
    fn of(parts: &BrepParts, surface: &AnalyticSurface, edges: &[&OrientedEdge]) -> Self {
        let mut loops = Self {
            pieces: Vec::new(),
            ends: Vec::new(),
            turn: TAU * section_radius(surface),
        };
        for one in edges {
            let edge = &parts.edges[one.edge];
            let ends = parts
                .ends(one)
                .map(|vertex| flat(surface, &parts.vertices[vertex]));
            loops.ends.extend(ends);
            let points = parts.points(one);
            let near = NEAR_VERTEX * worst(parts, edge, surface);
            let piece = |(at, pair): (usize, &[Point3<f64>])| {
                let [from, to] = [&pair[0], &pair[1]].map(|p| flat(surface, p));
                LoopPiece {
                    from,
                    to: from + loops.step(&from, &to),
                    begin: pair[0],
                    near,
                    number: [one.edge, at],
                }
            };
            let pieces: Vec<_> = points.windows(2).enumerate().map(piece).collect();
            loops.pieces.extend(pieces);
        }
        loops.pieces.sort_by(|a, b| a.low().total_cmp(&b.low()));
        loops
    }

    /// The shorter way from one place to another, over the seam too.
    fn step(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Vector2<f64> {
        let mut step = to - from;
        if self.turn > 0.0 {
            step.x = (step.x + self.turn / 2.0).rem_euclid(self.turn) - self.turn / 2.0;
        }
        step
    }

    /// A place in which they cross, not at a vertex.
    fn crossing(&self) -> Option<Point3<f64>> {
        let is_end = |p: &Vector2<f64>, near: f64| {
            let mut ends = self.ends.iter();
            ends.any(|end| self.step(p, end).norm() <= near)
        };
        let shifts = if self.turn > 0.0 {
            vec![0.0, self.turn, -self.turn]
        } else {
            vec![0.0]
        };
        let crosses = |&(at, piece): &(usize, &LoopPiece)| {
            let top = piece.from.y.max(piece.to.y);
            let beside = self.pieces[at + 1..].iter();
            let mut beside = beside.take_while(|other| other.low() <= top);
            beside.any(|other| {
                let places = shifts.iter().map(|by| piece.crossing(&other.moved(*by)));
                places
                    .flatten()
                    .any(|place| !is_end(&place, piece.near.max(other.near)))
            })
        };
        let mut pieces = self.pieces.iter().enumerate();
        pieces.find(crosses).map(|(_, piece)| piece.begin)
    }
}

/// Coordinates of a point of a surface in a plane, m: of a round one along the turn, at its own
/// radius, and along the axis; of a sphere away from its pole.
fn flat(surface: &AnalyticSurface, p: &Point3<f64>) -> Vector2<f64> {
    let at = surface.placement.local(p);
    match surface.shape {
        SurfaceShape::Plane => at.xy(),
        SurfaceShape::Sphere { radius } => {
            let (across, away) = length_and_direction(&Vector3::new(at.x, at.y, 0.0));
            away.xy() * (radius * across.atan2(at.z))
        }
        _ => Vector2::new(at.y.atan2(at.x) * section_radius(surface), at.z),
    }
}

/// Radius of a cylinder, or of a cone at its origin, m; 0 of a plane or sphere.
fn section_radius(surface: &AnalyticSurface) -> f64 {
    match surface.shape {
        SurfaceShape::Cylinder { radius } => radius,
        // the parameters of a cone need any radius above 0
        SurfaceShape::Cone { radius, .. } => radius.max(f64::EPSILON),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_geometry::brep::{FaceLoop, intersection};

    /// Faces of the plane z = 0 bounded by polygons.
    fn crossed(polygons: &[&[[f64; 2]]]) -> Option<Point3<f64>> {
        let mut parts = BrepParts::default();
        let mut vertex = |&[x, y]: &[f64; 2]| {
            let place = Point3::new(x, y, 0.0);
            let known = parts.vertices.iter().position(|p| *p == place);
            known.unwrap_or_else(|| parts.vertex(place))
        };
        let loops: Vec<Vec<usize>> = polygons
            .iter()
            .map(|corners| corners.iter().map(&mut vertex).collect())
            .collect();
        let loops = loops.iter().map(|corners| parts.polygon(corners)).collect();
        let plane = AnalyticSurface::along(Point3::origin(), Vector3::z(), SurfaceShape::Plane);
        crossing(&parts, &BrepFace::new("plane", plane, true, loops))
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]];

    #[test]
    fn loops_that_meet_twice_are_found_with_the_place() {
        let hole = |x: f64| [[x, 4.0], [x + 1.0, 6.0], [x + 2.0, 4.0]];
        assert_eq!(crossed(&[&SQUARE, &hole(3.0)]), None);
        let out = crossed(&[&SQUARE, &hole(6.5)]).unwrap();
        assert!(
            (out.x - 8.0).abs() < 0.75 && (4.0..6.0).contains(&out.y),
            "{out}"
        );
        // the diagonals of the square cross in its middle
        let bow = crossed(&[&[SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]]).unwrap();
        assert!((bow - Point3::new(4.0, 4.0, 0.0)).norm() < 3.0, "{bow}");
        let at_corner = [SQUARE[2], [5.0, 7.0], [7.0, 5.0]];
        let corner = Point3::new(8.0, 8.0, 0.0);
        assert_eq!(crossed(&[&SQUARE, &at_corner]), Some(corner));
    }

    /// Cuts aslant to both sides cross at their height on the axis if that is one.
    #[test]
    fn rings_around_a_cylinder_cross_over_its_seam_too() {
        let shape = SurfaceShape::Cylinder { radius: 0.01 };
        let tube = AnalyticSurface::along(Point3::origin(), Vector3::z(), shape);
        let crossed = |height: f64, turn: f64| {
            let mut parts = BrepParts::default();
            let slope = Vector3::new(turn.cos(), turn.sin(), 0.0) * 0.5;
            let cuts = [(0.0, slope), (height, -slope)].map(|(z, slope)| {
                let (origin, normal) = (Point3::new(0.0, 0.0, z), Vector3::z() + slope);
                let plane = AnalyticSurface::along(origin, normal, SurfaceShape::Plane);
                let cut = intersection(&tube, &plane).unwrap();
                FaceLoop::Edges(vec![parts.ring(&cut[0])])
            });
            crossing(&parts, &BrepFace::new("tube", tube, true, cuts.into()))
        };
        for turn in [0.1, 1.6, 3.1, 4.7] {
            assert_eq!(crossed(0.02, turn), None);
            assert!(
                crossed(0.0, turn).is_some_and(|p| p.z.abs() < 1e-3),
                "{turn}"
            );
        }
    }
}
