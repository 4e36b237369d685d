//! Distances and intersections of single triangles.

use nalgebra::{Point3, Vector3};

use crate::numeric::{direction, length_and_direction};

/// Quality below which another formula finds the foot inside a triangle, as twice the area over the
/// longest edge squared, itself squared: the quotient of areas loses ε/0.01 of the edge there, and
/// everything without an area.
const THIN: f64 = 0.01;
/// A product of four lengths, m⁴, below which its parts lack digits or are gone: edges of some
/// 1e-73 m.
const SMALLEST_PRODUCT: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// The point of triangle `abc` closest to `p`, with its barycentric coordinates.
///
/// Signed areas give the Voronoi region of `p` (corner, edge or inside) \[Ericson 2005, sec.
/// 5.1.5\]. A triangle without area counts as its sides: the result is always a point of the
/// triangle.
#[inline]
pub fn closest_point(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> (Point3<f64>, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 < 0.0 {
        let t = d1 / (d1 - d3);
        return (a + ab * t, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 < 0.0 {
        let t = d2 / (d2 - d6);
        return (a + ac * t, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * t, [0.0, 1.0 - t, t]);
    }
    let area = va + vb + vc;
    // the squared edges are differences of known terms
    let longest = (d1 - d3).max(d2 - d6).max((d4 - d3) + (d5 - d6));
    if area < (THIN * longest * longest).max(SMALLEST_PRODUCT) {
        return closest_point_of_thin(p, [a, b, c]);
    }
    let scale = 1.0 / area;
    let (v, w) = (vb * scale, vc * scale);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}

/// [`closest_point`] of a triangle with little or no area: the nearest of the points on its sides,
/// and of the foot on its plane if that is inside.
#[cold]
fn closest_point_of_thin(p: &Point3<f64>, corners: [&Point3<f64>; 3]) -> (Point3<f64>, [f64; 3]) {
    let mut best = (*corners[0], [1.0, 0.0, 0.0]);
    let mut take = |point: Point3<f64>, barycentric: [f64; 3]| {
        if (p - point).norm_squared() < (p - best.0).norm_squared() {
            best = (point, barycentric);
        }
    };
    for i in 0..3 {
        let (s, e) = (corners[i], corners[(i + 1) % 3]);
        let side = e - s;
        let length = side.norm_squared();
        let t = if length > 0.0 {
            ((p - s).dot(&side) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let mut barycentric = [0.0; 3];
        (barycentric[i], barycentric[(i + 1) % 3]) = (1.0 - t, t);
        take(s + side * t, barycentric);
    }
    let double = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let (double_area, normal) = length_and_direction(&double);
    if double_area > 0.0 {
        let foot = p - normal * normal.dot(&(p - corners[0]));
        let share = |s: &Point3<f64>, e: &Point3<f64>| {
            normal.dot(&(s - foot).cross(&(e - foot))) / double_area
        };
        let (u, v) = (share(corners[1], corners[2]), share(corners[2], corners[0]));
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            take(foot, [u, v, 1.0 - u - v]);
        }
    }
    best
}

/// Whether the segment from `p` to `q` passes through triangle `abc` or comes within `gap` (m) of
/// doing so at its rim.
///
/// `gap` widens the triangle in its plane and lengthens the segment; pass a small share of the edge
/// length.
#[inline]
pub fn segment_crosses(
    p: &Point3<f64>,
    q: &Point3<f64>,
    [a, b, c]: &[Point3<f64>; 3],
    gap: f64,
) -> bool {
    let normal = (b - a).cross(&(c - a));
    let Some(unit) = direction(&normal) else {
        return false;
    };
    let (hp, hq) = (unit.dot(&(p - a)), unit.dot(&(q - a)));
    if hp.min(hq) > gap || hp.max(hq) < -gap {
        return false;
    }
    if (hp - hq).abs() <= gap {
        // the segment runs along the plane
        return coplanar_overlap(p, q, [a, b, c], &unit, gap);
    }
    let t = (hp / (hp - hq)).clamp(0.0, 1.0);
    let x = p + (q - p) * t;
    [(a, b), (b, c), (c, a)].iter().all(|(s, e)| {
        let edge = *e - *s;
        unit.dot(&edge.cross(&(x - *s))) >= -gap * edge.norm()
    })
}

/// Whether a segment close to the plane of a triangle overlaps the triangle, seen along its unit
/// normal.
fn coplanar_overlap(
    p: &Point3<f64>,
    q: &Point3<f64>,
    corners: [&Point3<f64>; 3],
    unit: &Vector3<f64>,
    gap: f64,
) -> bool {
    // clip the segment by the three edges
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for i in 0..3 {
        let (s, e) = (corners[i], corners[(i + 1) % 3]);
        let inward = unit.cross(&(e - s));
        let margin = gap * inward.norm();
        let (hp, hq) = (inward.dot(&(p - s)) + margin, inward.dot(&(q - s)) + margin);
        if hp < 0.0 && hq < 0.0 {
            return false;
        }
        if hp < 0.0 {
            from = from.max(hp / (hp - hq));
        } else if hq < 0.0 {
            to = to.min(hp / (hp - hq));
        }
    }
    from <= to
}

/// Whether two triangles without a common corner meet, or come within `gap` (m) as in
/// [`segment_crosses`].
pub fn intersect(t: &[Point3<f64>; 3], u: &[Point3<f64>; 3], gap: f64) -> bool {
    (0..3).any(|i| {
        segment_crosses(&t[i], &t[(i + 1) % 3], u, gap)
            || segment_crosses(&u[i], &u[(i + 1) % 3], t, gap)
    })
}

/// Lowest and highest coordinates, m.
pub type Extent = (Vector3<f64>, Vector3<f64>);

/// The extent of a triangle.
#[inline]
pub fn extent([a, b, c]: &[Point3<f64>; 3]) -> Extent {
    (
        a.coords.inf(&b.coords).inf(&c.coords),
        a.coords.sup(&b.coords).sup(&c.coords),
    )
}

/// Whether two extents are farther than `gap` (m) from each other along some axis.
#[inline]
pub fn are_apart(a: &Extent, b: &Extent, gap: f64) -> bool {
    (0..3).any(|i| a.0[i] > b.1[i] + gap || b.0[i] > a.1[i] + gap)
}

/// Whether two triangles that share no edge meet, other than in their common corner, or come within
/// `gap` (m) as in [`intersect`].
///
/// - `common`: index of the common corner in either.
pub fn meet(t: &[Point3<f64>; 3], u: &[Point3<f64>; 3], common: Option<[u8; 2]>, gap: f64) -> bool {
    if are_apart(&extent(t), &extent(u), gap) {
        return false;
    }
    let Some([i, j]) = common.map(|pair| pair.map(usize::from)) else {
        return intersect(t, u, gap);
    };
    segment_crosses(&t[(i + 1) % 3], &t[(i + 2) % 3], u, 0.0)
        || segment_crosses(&u[(j + 1) % 3], &u[(j + 2) % 3], t, 0.0)
}

/// The square of the longest edge, m².
#[inline]
pub(crate) fn longest_edge_squared(t: &[Point3<f64>; 3]) -> f64 {
    (t[1] - t[0])
        .norm_squared()
        .max((t[2] - t[1]).norm_squared())
        .max((t[0] - t[2]).norm_squared())
}

/// Twice the area over the square of the longest edge: 0.87 for an equilateral triangle, 0 for one
/// without area.
#[inline]
pub fn shape_quality(t: &[Point3<f64>; 3], double_area: f64) -> f64 {
    let longest = longest_edge_squared(t);
    if longest > 0.0 {
        double_area / longest
    } else {
        0.0
    }
}
