//! Single triangles: projection against another method, crossings against exact integers.

use super::*;

fn corner() -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-1.0..1.0).prop_map(Point3::from)
}

proptest! {
    #[test]
    fn closest_point_is_the_projection(t in prop::array::uniform3(corner()), p in corner(), seed: u64) {
        let (point, barycentric) = triangle::closest_point(&p, &t);
        prop_assert!((t[0] + nearest(&p, &t).coords - point).norm() < 1e-6, "{}", (t[0] + nearest(&p, &t).coords - point).norm());
        prop_assert!(((p - point).norm() - distance(&p, &t)).abs() < 1e-14);
        prop_assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 4.0 * f64::EPSILON);
        // and no point of the triangle is nearer
        let mut rng = Pcg64::seed_from_u64(seed);
        for _ in 0..64 {
            let (u, v) = (within(&mut rng, 0.0, 1.0), within(&mut rng, 0.0, 1.0));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let other = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
            prop_assert!((p - other).norm() >= (p - point).norm() - 1e-14);
        }
    }

    /// Corners on a small lattice, in which half of all pairs touch, overlap in a plane or share a
    /// point; the expected answer is in exact integers. Parts that do not meet are at least 1e-3
    /// apart there, far more than the gap.
    #[test]
    fn crossings_are_those_of_exact_arithmetic(cells in prop::array::uniform6(prop::array::uniform3(0i64..4))) {
        let real = cells.map(|[x, y, z]| Point3::new(x as f64, y as f64, z as f64));
        let (t, u) = ([real[0], real[1], real[2]], [real[3], real[4], real[5]]);
        let (exact_t, exact_u) = ([cells[0], cells[1], cells[2]], [cells[3], cells[4], cells[5]]);
        prop_assume!(exact::normal(&exact_t) != [0; 3] && exact::normal(&exact_u) != [0; 3]);
        for i in 0..3 {
            let j = (i + 1) % 3;
            let wanted = exact::segment_meets(&exact_u[i], &exact_u[j], &exact_t);
            prop_assert_eq!(triangle::segment_crosses(&u[i], &u[j], &t, 1e-7), wanted, "side {} of {:?}", i, cells);
        }
        prop_assert_eq!(triangle::intersect(&t, &u, 1e-7), exact::triangles_meet(&exact_t, &exact_u), "{:?}", cells);
    }
}

/// Closed intersections of lattice triangles in integers.
mod exact {
    pub type Cell = [i64; 3];

    fn minus(a: &Cell, b: &Cell) -> Cell {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: &Cell, b: &Cell) -> Cell {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }

    fn dot(a: &Cell, b: &Cell) -> i64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    pub fn normal([a, b, c]: &[Cell; 3]) -> Cell {
        cross(&minus(b, a), &minus(c, a))
    }

    pub fn segment_meets(p: &Cell, q: &Cell, t: &[Cell; 3]) -> bool {
        let n = normal(t);
        let (hp, hq) = (dot(&n, &minus(p, &t[0])), dot(&n, &minus(q, &t[0])));
        if hp == 0 && hq == 0 {
            return inside(p, t, &n)
                || inside(q, t, &n)
                || (0..3).any(|i| cross_in_plane(p, q, &t[i], &t[(i + 1) % 3], &n));
        }
        if hp.signum() * hq.signum() > 0 {
            return false;
        }
        // (hp − hq) · (x − s) for the crossing x of line and plane
        (0..3).all(|i| {
            let (s, e) = (&t[i], &t[(i + 1) % 3]);
            let (to_p, to_q) = (minus(p, s), minus(q, s));
            let x: Cell = std::array::from_fn(|k| hp * to_q[k] - hq * to_p[k]);
            dot(&n, &cross(&minus(e, s), &x)) * (hp - hq).signum() >= 0
        })
    }

    fn inside(p: &Cell, t: &[Cell; 3], n: &Cell) -> bool {
        (0..3).all(|i| dot(n, &cross(&minus(&t[(i + 1) % 3], &t[i]), &minus(p, &t[i]))) >= 0)
    }

    /// Which side of the line from `a` to `b` the point lies on, in the plane of normal `n`.
    fn side(a: &Cell, b: &Cell, p: &Cell, n: &Cell) -> i64 {
        dot(n, &cross(&minus(b, a), &minus(p, a))).signum()
    }

    fn on_segment(p: &Cell, a: &Cell, b: &Cell, n: &Cell) -> bool {
        side(a, b, p, n) == 0 && dot(&minus(p, a), &minus(p, b)) <= 0
    }

    fn cross_in_plane(p: &Cell, q: &Cell, a: &Cell, b: &Cell, n: &Cell) -> bool {
        let crossed =
            side(a, b, p, n) * side(a, b, q, n) < 0 && side(p, q, a, n) * side(p, q, b, n) < 0;
        crossed
            || on_segment(p, a, b, n)
            || on_segment(q, a, b, n)
            || on_segment(a, p, q, n)
            || on_segment(b, p, q, n)
    }

    pub fn triangles_meet(t: &[Cell; 3], u: &[Cell; 3]) -> bool {
        (0..3).any(|i| {
            segment_meets(&t[i], &t[(i + 1) % 3], u) || segment_meets(&u[i], &u[(i + 1) % 3], t)
        })
    }
}

#[test]
fn a_triangle_without_area_is_its_sides() {
    let p = Point3::new;
    let (a, b) = (p(1.0, 0.0, 0.0), p(3.0, 0.0, 0.0));
    for t in [
        [a, a, b],
        [a, b, a],
        [b, a, a],
        [a, b, b],
        [a, p(2.0, 0.0, 0.0), b],
        [b, p(1.5, 0.0, 0.0), a],
    ] {
        for (x, foot) in [(0.0, 1.0), (1.25, 1.25), (2.5, 2.5), (4.0, 3.0)] {
            for y in [0.0, 0.5] {
                let (point, barycentric) = triangle::closest_point(&p(x, y, 0.0), &t);
                assert_eq!(point, p(foot, 0.0, 0.0), "{t:?} {x}");
                assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            }
        }
    }
    assert_eq!(triangle::closest_point(&b, &[a, a, a]).0, a);
}

#[test]
fn crossings_by_hand() {
    let p = Point3::new;
    let t = [p(0.0, 0.0, 0.0), p(4.0, 0.0, 0.0), p(0.0, 4.0, 0.0)];
    let crosses = |a: Point3<f64>, b: Point3<f64>, gap| triangle::segment_crosses(&a, &b, &t, gap);
    assert!(crosses(p(1.0, 1.0, 1.0), p(1.0, 1.0, -1.0), 0.0));
    assert!(
        !crosses(p(3.0, 3.0, 1.0), p(3.0, 3.0, -1.0), 0.0),
        "beside it"
    );
    assert!(
        !crosses(p(1.0, 1.0, 2.0), p(1.0, 1.0, 1.0), 0.0),
        "above it"
    );
    assert!(
        crosses(p(1.0, 1.0, 2.0), p(1.0, 1.0, 0.1), 0.2),
        "the gap lengthens it"
    );
    assert!(
        crosses(p(-0.1, 1.0, 1.0), p(-0.1, 1.0, -1.0), 0.2),
        "the gap widens the triangle"
    );
    assert!(!crosses(p(-0.1, 1.0, 1.0), p(-0.1, 1.0, -1.0), 0.05));
    assert!(
        crosses(p(-1.0, 1.0, 0.0), p(9.0, 1.0, 0.0), 0.0),
        "in the plane, right across"
    );
    assert!(
        !crosses(p(-1.0, 5.0, 0.0), p(9.0, 5.0, 0.0), 0.0),
        "in the plane, past it"
    );
    assert!(
        !triangle::segment_crosses(&p(0.0, 0.0, 1.0), &p(0.0, 0.0, -1.0), &[t[0]; 3], 0.1),
        "no area, no crossing"
    );
    let above = t.map(|corner| corner + vector![0.0, 0.0, 0.5]);
    assert!(!triangle::intersect(&t, &above, 0.1) && triangle::intersect(&t, &above, 0.6));
}

#[test]
fn shape_quality_by_hand() {
    let p = |x, y| Point3::new(x, y, 0.0);
    let quality =
        |t: Triangle| triangle::shape_quality(&t, (t[1] - t[0]).cross(&(t[2] - t[0])).norm());
    assert!(
        (quality([p(0.0, 0.0), p(1.0, 0.0), p(0.5, 0.75f64.sqrt())]) - 0.75f64.sqrt()).abs()
            < 1e-15
    );
    assert_eq!(quality([p(0.0, 0.0), p(2.0, 0.0), p(0.0, 2.0)]), 0.5);
    assert_eq!(
        (
            quality([p(0.0, 0.0), p(2.0, 0.0), p(1.0, 0.0)]),
            quality([p(1.0, 1.0); 3])
        ),
        (0.0, 0.0)
    );
}
