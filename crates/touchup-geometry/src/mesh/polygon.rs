//! Triangles of polygons, and of plane regions with holes, on their own corners: a constrained
//! Delaunay triangulation, which avoids thin triangles.

use std::collections::HashMap;

use nalgebra::{Point2, Point3, Vector3};
use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{ConstrainedDelaunayTriangulation, Triangulation};

use crate::numeric::{flood, tangent_basis};

/// Indices of three corners, counter-clockwise.
type Triangle = [u32; 3];

type Delaunay = ConstrainedDelaunayTriangulation<spade::Point2<f64>>;

/// Triangles of a polygon of any shape, as indices of its corners, in its own sense of rotation.
///
/// A polygon that is convex or without area becomes the fan from its first corner. The others are
/// divided in the plane across their mean normal (Newell's), on which corners need not lie. A cut,
/// a side passed both ways, may join a hole to the rim. `None` if sides cross.
pub fn triangulate(corners: &[Point3<f64>]) -> Option<Vec<[u32; 3]>> {
    let fan = || {
        (2..corners.len() as u32)
            .map(|at| [0, at - 1, at])
            .collect()
    };
    let Some(points) = in_mean_plane(corners).filter(|points| !is_convex(points)) else {
        return Some(fan());
    };
    // the ends of a cut appear twice
    let mut named = HashMap::new();
    let mut outline: Vec<u32> = points
        .iter()
        .zip(0..)
        .map(|(p, at)| *named.entry([p.x, p.y].map(f64::to_bits)).or_insert(at))
        .collect();
    outline.dedup();
    while outline.len() > 1 && outline.first() == outline.last() {
        outline.pop();
    }
    let triangles = fill(&points, &[outline])?;
    // a cut outside of the polygon would fill the wrong side
    let filled: f64 = triangles
        .iter()
        .map(|corners| doubled_area(corners.map(|at| points[at as usize])))
        .sum();
    let wanted: f64 = fan_areas(&points).sum();
    ((filled - wanted).abs() < ROUNDING).then_some(triangles)
}

/// The corners in the plane across the mean normal, counter-clockwise about it, in parts of their
/// extent; `None` without an area.
fn in_mean_plane(corners: &[Point3<f64>]) -> Option<Vec<Point2<f64>>> {
    let first = corners.get(..4)?[0];
    let extent = corners
        .iter()
        .map(|p| (p - first).amax())
        .fold(0.0, f64::max);
    let from_first: Vec<Vector3<f64>> = corners.iter().map(|p| (p - first) / extent).collect();
    let normal: Vector3<f64> = from_first
        .windows(2)
        .map(|side| side[0].cross(&side[1]))
        .sum();
    let [u, v] = tangent_basis(&normal.try_normalize(ROUNDING)?);
    // rounds a mere rounding error, and −0, to 0
    let rounded = |x: f64| if x.abs() > f64::EPSILON { x } else { 0.0 };
    let at = |p: &Vector3<f64>| Point2::new(rounded(p.dot(&u)), rounded(p.dot(&v)));
    Some(from_first.iter().map(at).collect())
}

/// Twice the areas of the triangles from the first corner to each side, positive counter-clockwise;
/// their sum is twice the area of the polygon.
fn fan_areas(points: &[Point2<f64>]) -> impl Iterator<Item = f64> {
    points
        .windows(2)
        .map(|side| doubled_area([points[0], side[0], side[1]]))
}

fn doubled_area([a, b, c]: [Point2<f64>; 3]) -> f64 {
    (b - a).perp(&(c - a))
}

/// Whether a polygon makes a single turn, and to the left alone.
fn is_convex(points: &[Point2<f64>]) -> bool {
    let count = points.len();
    let corner = |at: usize| doubled_area([0, 1, 2].map(|next| points[(at + next) % count]));
    fan_areas(points).all(|area| area >= 0.0) && (0..count).all(|at| corner(at) >= 0.0)
}

/// Rounding error of sums of areas, over the square of the extent.
const ROUNDING: f64 = 1e-10;

/// Triangles of the region within `loops`: each a list of indices into `points`, with the region on
/// its left.
///
/// Loops may share points, and pass one twice. `None` if rounding has put two points in one place
/// or lets two sides cross.
pub fn fill(points: &[Point2<f64>], loops: &[Vec<u32>]) -> Option<Vec<Triangle>> {
    if let [corners] = loops
        && let [a, b, c] = corners[..]
    {
        return Some(vec![[a, b, c]]);
    }
    let mut delaunay = Delaunay::new();
    let mut names = Vec::new();
    let mut handles = vec![None; points.len()];
    for &corner in loops.iter().flatten() {
        let (handle, p) = (&mut handles[corner as usize], points[corner as usize]);
        if handle.is_none() {
            *handle = Some(delaunay.insert(spade::Point2::new(p.x, p.y)).ok()?);
            names.push(corner);
        }
    }
    if delaunay.num_vertices() != names.len() {
        return None;
    }
    let sides = || {
        loops
            .iter()
            .flat_map(|corners| corners.iter().zip(corners.iter().cycle().skip(1)))
    };
    let ends = |(a, b): (&u32, &u32)| Some([handles[*a as usize]?, handles[*b as usize]?]);
    for [from, to] in sides().filter_map(ends) {
        if !delaunay.can_add_constraint(from, to) {
            return None;
        }
        delaunay.add_constraint(from, to);
    }
    let inside = faces_inside(&delaunay, sides().filter_map(ends));
    let name = |handle: FixedVertexHandle| names[handle.index()];
    Some(
        inside
            .into_iter()
            .map(|face| {
                delaunay
                    .face(face)
                    .vertices()
                    .map(|vertex| name(vertex.fix()))
            })
            .collect(),
    )
}

/// The faces on the left of the sides, and those connected to them without crossing a side.
fn faces_inside(
    delaunay: &Delaunay,
    sides: impl Iterator<Item = [FixedVertexHandle; 2]>,
) -> Vec<FixedFaceHandle<InnerTag>> {
    let mut is_inside = vec![false; delaunay.num_all_faces()];
    let mut takes =
        |face: FixedFaceHandle<InnerTag>| !std::mem::replace(&mut is_inside[face.index()], true);
    let beside = |side: [FixedVertexHandle; 2]| {
        let side = delaunay.get_edge_from_neighbors(side[0], side[1])?;
        Some(side.face().as_inner()?.fix())
    };
    let first = sides
        .filter_map(beside)
        .filter(|&face| takes(face))
        .collect();
    let neighbours = |face: FixedFaceHandle<InnerTag>| {
        let open = delaunay
            .face(face)
            .adjacent_edges()
            .into_iter()
            .filter(|edge| !edge.is_constraint_edge());
        open.filter_map(|edge| Some(edge.rev().face().as_inner()?.fix()))
    };
    flood(first, neighbours, takes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(points: &[Point2<f64>], triangles: &[Triangle]) -> Vec<f64> {
        let at = |i: u32| points[i as usize];
        triangles
            .iter()
            .map(|t| (at(t[1]) - at(t[0])).perp(&(at(t[2]) - at(t[0]))))
            .collect()
    }

    /// A square with `holes` square holes in a row, and points on its lower side.
    fn holed(holes: u32) -> (Vec<Point2<f64>>, Vec<Vec<u32>>) {
        let width = f64::from(2 * holes + 1);
        let mut points: Vec<_> = [(0.0, 0.0), (width, 0.0), (width, 3.0), (0.0, 3.0)]
            .map(|(x, y)| Point2::new(x, y))
            .into();
        let mut loops = vec![vec![0, 1, 2, 3]];
        for hole in 0..holes {
            let (x, first) = (f64::from(2 * hole + 1), points.len() as u32);
            points.extend(
                [(0., 1.), (0., 2.), (1., 2.), (1., 1.)].map(|(dx, y)| Point2::new(x + dx, y)),
            );
            loops.push((first..first + 4).collect());
        }
        let first = points.len() as u32;
        points.extend((1..4).map(|i| Point2::new(f64::from(i) * 0.25, 0.0)));
        loops[0].splice(1..1, first..first + 3);
        (points, loops)
    }

    #[test]
    fn a_square_with_holes_is_filled_once() {
        for holes in 0..6 {
            let (points, loops) = holed(holes);
            let triangles = fill(&points, &loops).unwrap();
            let corners: usize = loops.iter().map(Vec::len).sum();
            assert_eq!(triangles.len(), corners + 2 * holes as usize - 2);
            let areas = areas(&points, &triangles);
            assert!(areas.iter().all(|&a| a > 0.0), "{holes} holes: {areas:?}");
            let wanted = 2.0 * (3.0 * f64::from(2 * holes + 1) - f64::from(holes));
            assert!((areas.iter().sum::<f64>() - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn holes_that_meet_at_a_point_and_islands_are_filled() {
        let at = |(x, y): (i32, i32)| Point2::new(f64::from(x), f64::from(y));
        // two squares meet at (2, 2); one loop goes round both
        let points = [
            (0, 0),
            (4, 0),
            (4, 4),
            (0, 4),
            (2, 2),
            (1, 2),
            (1, 1),
            (2, 1),
            (3, 2),
            (3, 3),
            (2, 3),
        ]
        .map(at);
        let triangles = fill(&points, &[vec![0, 1, 2, 3], vec![4, 7, 6, 5, 4, 10, 9, 8]]).unwrap();
        assert_eq!(
            areas(&points, &triangles).iter().sum::<f64>(),
            2.0 * (16.0 - 2.0)
        );
        let points = [(0, 0), (1, 0), (0, 1), (5, 0), (6, 0), (5, 1)].map(at);
        assert_eq!(
            fill(&points, &[vec![0, 1, 2], vec![3, 4, 5]])
                .unwrap()
                .len(),
            2
        );
    }

    #[test]
    fn a_polygon_without_area_or_with_a_bend_is_a_fan() {
        let fan = Some(vec![[0, 1, 2], [0, 2, 3]]);
        let at = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        assert_eq!(triangulate(&[at(5.0, 5.0, 5.0); 4]), fan);
        let line = [0.0, 1.0, 3.0, 2.0].map(|x| at(x, 2.0 * x, 1.0));
        assert_eq!(triangulate(&line), fan);
        let bent = [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.4),
            (1.0, 1.0, 0.0),
            (0.0, 1.0, 0.4),
        ];
        assert_eq!(triangulate(&bent.map(|(x, y, z)| at(x, y, z))), fan);
        assert_eq!(
            triangulate(&bent.map(|(x, y, z)| at(x * f64::NAN, y, z))),
            fan
        );
        assert_eq!(triangulate(&[at(0.0, 0.0, 0.0); 2]), Some(vec![]));
    }

    /// The corner at 2 is inside of the triangle of the other three: one diagonal alone is inside.
    #[test]
    fn an_arrow_has_the_diagonal_that_is_inside() {
        let arrow = [(0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)];
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.48, 0.64, -0.6)] {
            let [u, v] = tangent_basis(&Vector3::new(x, y, z));
            for first in 0..4 {
                let corner = |at: usize| arrow[(first + at) % 4];
                let corners = [0, 1, 2, 3]
                    .map(corner)
                    .map(|(a, b)| Point3::from(u * a + v * b));
                let triangles = triangulate(&corners).unwrap();
                let areas: Vec<f64> = triangles
                    .iter()
                    .map(|t| t.map(|at| corners[at as usize]))
                    .map(|[a, b, c]| (b - a).cross(&(c - a)).dot(&Vector3::new(x, y, z)) / 2.0)
                    .collect();
                assert!(
                    areas.len() == 2 && areas.iter().all(|&area| (area - 2.0).abs() < 1e-12),
                    "{areas:?}"
                );
            }
        }
    }

    #[test]
    fn points_in_one_place_and_crossing_sides_are_refused() {
        let at = |(x, y): (i32, i32)| Point2::new(f64::from(x), f64::from(y));
        let twice = [(0, 0), (1, 0), (1, 1), (1, 1)].map(at);
        assert_eq!(fill(&twice, &[vec![0, 1, 2, 3]]), None);
        let bow = [(0, 0), (1, 1), (1, 0), (0, 1)].map(at);
        assert_eq!(fill(&bow, &[vec![0, 1, 2, 3]]), None);
    }
}
