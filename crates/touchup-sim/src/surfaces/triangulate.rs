//! Triangles for a polygon with holes, by cutting ears.

use nalgebra::{Point2, Vector2};

/// Triangulates the polygon `outline` (counter-clockwise) without `holes` (clockwise), all given as
/// indices into `points`; the triangles are counter-clockwise and use only these points.
///
/// A cut to a visible corner joins each hole to the outline, then ears are cut off, the one with
/// the largest smallest angle first. O(n³) for n points: meant for drawings, not for scans.
pub(crate) fn triangulate(
    points: &[Point2<f64>],
    outline: &[u32],
    holes: &[Vec<u32>],
) -> Vec<[u32; 3]> {
    let at = |v: u32| points[v as usize];
    let rightmost = |hole: &Vec<u32>| hole.iter().map(|&v| at(v).x).fold(f64::MIN, f64::max);
    let mut holes: Vec<&Vec<u32>> = holes.iter().collect();
    holes.sort_by(|a, b| rightmost(b).total_cmp(&rightmost(a)));
    let mut ring = outline.to_vec();
    for (done, hole) in holes.iter().enumerate() {
        join(&mut ring, hole, &holes[done..], points);
    }
    let mut triangles = Vec::with_capacity(ring.len());
    while ring.len() > 3 {
        let n = ring.len();
        let corner = |i: usize| [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
        let ear = (0..n)
            .filter(|&i| is_ear(corner(i).map(at), &ring, points))
            .max_by(|&a, &b| {
                smallest_angle(corner(a).map(at)).total_cmp(&smallest_angle(corner(b).map(at)))
            })
            .expect("a simple polygon of more than three corners has an ear");
        triangles.push(corner(ear));
        ring.remove(ear);
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

/// Joins a hole to the ring by the shortest cut that crosses neither the ring nor a remaining hole.
fn join(ring: &mut Vec<u32>, hole: &[u32], open: &[&Vec<u32>], points: &[Point2<f64>]) {
    let at = |v: u32| points[v as usize];
    let sides = |loop_: &[u32]| -> Vec<[Point2<f64>; 2]> {
        (0..loop_.len())
            .map(|i| [at(loop_[i]), at(loop_[(i + 1) % loop_.len()])])
            .collect()
    };
    let mut walls = sides(ring);
    open.iter().for_each(|hole| walls.extend(sides(hole)));
    let (i, j) = (0..ring.len())
        .flat_map(|i| (0..hole.len()).map(move |j| (i, j)))
        .filter(|&(i, j)| {
            walls
                .iter()
                .all(|wall| !crosses([at(ring[i]), at(hole[j])], *wall))
        })
        .filter(|&(i, j)| opens_towards(ring, i, at(hole[j]), points))
        .min_by(|a, b| {
            let length = |&(i, j): &(usize, usize)| (at(ring[i]) - at(hole[j])).norm_squared();
            length(a).total_cmp(&length(b))
        })
        .expect("from every hole some corner of the outline can be seen");
    let cut = hole[j..]
        .iter()
        .chain(&hole[..=j])
        .copied()
        .chain([ring[i]]);
    let cut: Vec<u32> = cut.collect();
    ring.splice(i + 1..i + 1, cut);
}

/// Whether `target` lies inside the angle of corner `i`: corners doubled by a cut open to one side
/// each.
fn opens_towards(ring: &[u32], i: usize, target: Point2<f64>, points: &[Point2<f64>]) -> bool {
    let at = |k: usize| points[ring[k % ring.len()] as usize];
    let (before, here, after) = (at(i + ring.len() - 1), at(i), at(i + 1));
    let left_of = |a: Point2<f64>, b: Point2<f64>| (b - a).perp(&(target - a)) > 0.0;
    let convex = (here - before).perp(&(after - here)) > 0.0;
    let (first, second) = (left_of(before, here), left_of(here, after));
    if convex {
        first && second
    } else {
        first || second
    }
}

/// Whether two segments share a point other than a common end.
fn crosses([a, b]: [Point2<f64>; 2], [c, d]: [Point2<f64>; 2]) -> bool {
    if [a, b].iter().any(|p| *p == c || *p == d) {
        // with a common end they may still overlap
        let (u, v): (Vector2<f64>, Vector2<f64>) = (b - a, d - c);
        return u.perp(&v) == 0.0 && (a != c && a != d || b != c && b != d) && {
            let shared = if a == c || a == d { a } else { b };
            let (mine, other) = (
                if shared == a { b } else { a },
                if shared == c { d } else { c },
            );
            (mine - shared).dot(&(other - shared)) > 0.0
        };
    }
    let side = |p: Point2<f64>, q: Point2<f64>, x: Point2<f64>| (q - p).perp(&(x - p));
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// Whether the corner is convex and no other corner of the ring lies in its triangle.
fn is_ear([a, b, c]: [Point2<f64>; 3], ring: &[u32], points: &[Point2<f64>]) -> bool {
    let side = |p: Point2<f64>, q: Point2<f64>, x: Point2<f64>| (q - p).perp(&(x - p));
    let inside =
        |x: Point2<f64>| side(a, b, x) >= 0.0 && side(b, c, x) >= 0.0 && side(c, a, x) >= 0.0;
    let others = ring
        .iter()
        .map(|&v| points[v as usize])
        .filter(|x| *x != a && *x != b && *x != c);
    side(a, b, c) > 0.0 && !others.into_iter().any(inside)
}

/// Smallest angle of a triangle, rad.
fn smallest_angle([a, b, c]: [Point2<f64>; 3]) -> f64 {
    [(a, b, c), (b, c, a), (c, a, b)]
        .iter()
        .map(|(p, q, r)| (q - p).angle(&(r - p)))
        .fold(f64::MAX, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_with_two_square_holes_keeps_its_area_and_corners() {
        let square = |x: f64, y: f64, s: f64| {
            [(x, y), (x + s, y), (x + s, y + s), (x, y + s)].map(|(x, y)| Point2::new(x, y))
        };
        let points: Vec<_> = [
            square(0.0, 0.0, 10.0),
            square(2.0, 2.0, 2.0),
            square(6.0, 5.0, 3.0),
        ]
        .concat();
        let triangles = triangulate(
            &points,
            &[0, 1, 2, 3],
            &[vec![7, 6, 5, 4], vec![11, 10, 9, 8]],
        );
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).perp(&(c - a)) / 2.0
        };
        assert!(triangles.iter().all(|t| area(t) > 0.0));
        assert!((triangles.iter().map(area).sum::<f64>() - (100.0 - 4.0 - 9.0)).abs() < 1e-12);
        // V − 2 + 2 · holes triangles
        assert_eq!(triangles.len(), 12 - 2 + 2 * 2);
    }
}
