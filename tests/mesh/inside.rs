use super::*;
use touchup::mesh::signed_distance;

/// A prism over the polygon `outline` (convex, counter-clockwise seen from above) from z = −1 to z = 1, normals outside.
fn prism(outline: &[[f64; 2]]) -> TriMesh {
    let count = outline.len() as u32;
    let positions = [-1.0, 1.0].iter().flat_map(|&z| outline.iter().map(move |&[x, y]| Point3::new(x, y, z)));
    let mut faces = vec![];
    for i in 0..count {
        let j = (i + 1) % count;
        faces.extend([[i, j, count + i], [j, count + j, count + i]]);
    }
    for i in 1..count - 1 {
        faces.extend([[0, i + 1, i], [count, count + i, count + i + 1]]);
    }
    TriMesh::new(positions.collect(), faces).unwrap()
}

/// Distance outside the half-planes of a convex outline and of z = ±1; > 0 outside, < 0 inside.
fn outside(outline: &[[f64; 2]], p: &Point3<f64>) -> f64 {
    let mut most = p.z.abs() - 1.0;
    for i in 0..outline.len() {
        let ([ax, ay], [bx, by]) = (outline[i], outline[(i + 1) % outline.len()]);
        let out = vector![by - ay, ax - bx].normalize();
        most = most.max(out.dot(&vector![p.x - ax, p.y - ay]));
    }
    most
}

/// Points straight off every edge and corner in all directions, where two to six faces are equally near.
#[test]
fn at_edges_and_corners_the_sign_tells_inside_from_outside() {
    let cube = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    // tan 5° · 2 = 0.175: a wedge of 5° at x = 1
    let wedge = [[-1.0, -0.0875], [1.0, 0.0], [-1.0, 0.0875]];
    let mut rng = Pcg64::seed_from_u64(3);
    for outline in [&cube[..], &wedge] {
        let solid = prism(outline);
        let mut cavity = solid.clone();
        (0..solid.face_count()).for_each(|face| cavity.flip_face(FaceId(face as u32)));
        for (mesh, sign) in [(&solid, 1.0), (&cavity, -1.0)] {
            let tree = FaceTree::new(mesh);
            let mut tried = [0, 0];
            for (_, corners) in mesh.faces() {
                for i in 0..3 {
                    let (a, b) = (mesh.position(corners[i]), mesh.position(corners[(i + 1) % 3]));
                    for step in 0..60 {
                        let on_edge = if step % 3 == 0 { a } else { a + (b - a) * within(&mut rng, 0.0, 1.0) };
                        let p = on_edge + point(&mut rng) * 10f64.powf(within(&mut rng, -4.0, 0.0));
                        let truth = outside(outline, &p);
                        if truth.abs() < 1e-9 {
                            continue;
                        }
                        let hit = tree.closest(mesh, &p, f64::INFINITY).unwrap();
                        let told = (p - hit.point).dot(&mesh.normal(hit.face)) * sign;
                        assert!(told * truth > 0.0, "{p}: {told:e} where {truth:e} is true");
                        tried[usize::from(truth > 0.0)] += 1;
                    }
                }
            }
            assert!(tried.iter().all(|&count| count > 50), "{tried:?}: both sides are met");
        }
    }
}

/// By hand: the ball over a ridge of 90° whose sides have their normals along +x and +z; the edge is the y axis.
#[test]
fn off_an_edge_the_face_that_the_point_is_most_squarely_above_is_named() {
    let p = Point3::new;
    let positions = vec![p(0.0, -1.0, 0.0), p(0.0, 1.0, 0.0), p(-1.0, 0.0, 0.0), p(0.0, 0.0, -1.0)];
    let mesh = TriMesh::new(positions, vec![[0, 1, 2], [1, 0, 3]]).unwrap();
    assert_eq!([mesh.normal(FaceId(0)), mesh.normal(FaceId(1))], [Vector3::z(), Vector3::x()]);
    let tree = FaceTree::new(&mesh);
    let face = |x, z| tree.closest(&mesh, &p(x, 0.2, z), 9.0).unwrap().face.0;
    assert_eq!((face(0.1, 0.3), face(0.3, 0.1)), (0, 1));
    assert_eq!(face(0.2, 0.2), 0, "among equals the smallest id");
}

#[test]
fn a_query_that_is_no_point_or_finds_nothing_gives_none() {
    let mesh = grid(10, 1.0, |_, _| 0.0);
    let tree = FaceTree::new(&mesh);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for p in [Point3::new(bad, 0.0, 0.0), Point3::new(0.0, 0.0, bad), Point3::new(bad, bad, bad)] {
            for reach in [1.0, f64::INFINITY] {
                assert_eq!(tree.closest(&mesh, &p, reach), None, "{p}");
                assert_eq!(tree.closest_barycentre(&mesh, &p, reach), None, "{p}");
            }
        }
    }
    for reach in [0.0, f64::NAN] {
        assert_eq!(tree.closest(&mesh, &Point3::new(0.1, 0.1, 0.1), reach), None);
    }
    let empty = TriMesh::new(vec![], vec![]).unwrap();
    let mut found = BoxQuery::default();
    FaceTree::new(&empty).faces_in_box(&Point3::new(-1.0, -1.0, -1.0), &Point3::new(1.0, 1.0, 1.0), &mut found);
    assert_eq!((FaceTree::new(&empty).closest(&empty, &Point3::origin(), 1.0), found.faces), (None, vec![]));
}

#[test]
fn faces_at_one_place_are_all_searched() {
    // a thousand equal faces cannot be told apart by a split; the smallest id is named
    let positions = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    let mut mesh = TriMesh::new(positions, vec![[0, 1, 2]; 1000]).unwrap();
    let mut tree = FaceTree::new(&mesh);
    assert_eq!(tree.closest(&mesh, &Point3::new(0.2, 0.2, 0.5), 1.0).unwrap().face, FaceId(0));
    mesh.set_position(VertexId(0), Point3::new(0.0, 0.0, 2.0));
    tree.refit(&mesh, mesh.star(VertexId(0)));
    check_query(&mesh, &tree, &Point3::new(0.0, 0.0, 2.5));
}

// ---- triangles --------------------------------------------------------------------------------------------------

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

    /// Corners on a small lattice, where half of all pairs touch, overlap in a plane or share a point; the expected
    /// answer is in exact integers. Parts that do not meet are at least 1e-3 apart there, far more than the gap.
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
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
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
        // (hp − hq) · (x − s) for the point x where the line meets the plane
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
        let crossed = side(a, b, p, n) * side(a, b, q, n) < 0 && side(p, q, a, n) * side(p, q, b, n) < 0;
        crossed || on_segment(p, a, b, n) || on_segment(q, a, b, n) || on_segment(a, p, q, n) || on_segment(b, p, q, n)
    }

    pub fn triangles_meet(t: &[Cell; 3], u: &[Cell; 3]) -> bool {
        (0..3).any(|i| segment_meets(&t[i], &t[(i + 1) % 3], u) || segment_meets(&u[i], &u[(i + 1) % 3], t))
    }
}

#[test]
fn a_triangle_without_area_is_its_sides() {
    let p = Point3::new;
    let (a, b) = (p(1.0, 0.0, 0.0), p(3.0, 0.0, 0.0));
    for t in [[a, a, b], [a, b, a], [b, a, a], [a, b, b], [a, p(2.0, 0.0, 0.0), b], [b, p(1.5, 0.0, 0.0), a]] {
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
    assert!(!crosses(p(3.0, 3.0, 1.0), p(3.0, 3.0, -1.0), 0.0), "beside it");
    assert!(!crosses(p(1.0, 1.0, 2.0), p(1.0, 1.0, 1.0), 0.0), "above it");
    assert!(crosses(p(1.0, 1.0, 2.0), p(1.0, 1.0, 0.1), 0.2), "the gap lengthens it");
    assert!(crosses(p(-0.1, 1.0, 1.0), p(-0.1, 1.0, -1.0), 0.2), "the gap widens the triangle");
    assert!(!crosses(p(-0.1, 1.0, 1.0), p(-0.1, 1.0, -1.0), 0.05));
    assert!(crosses(p(-1.0, 1.0, 0.0), p(9.0, 1.0, 0.0), 0.0), "in the plane, right across");
    assert!(!crosses(p(-1.0, 5.0, 0.0), p(9.0, 5.0, 0.0), 0.0), "in the plane, past it");
    assert!(!triangle::segment_crosses(&p(0.0, 0.0, 1.0), &p(0.0, 0.0, -1.0), &[t[0]; 3], 0.1), "no area, no crossing");
    let above = t.map(|corner| corner + vector![0.0, 0.0, 0.5]);
    assert!(!triangle::intersect(&t, &above, 0.1) && triangle::intersect(&t, &above, 0.6));
}

#[test]
fn shape_quality_by_hand() {
    let p = |x, y| Point3::new(x, y, 0.0);
    let quality = |t: Triangle| triangle::shape_quality(&t, (t[1] - t[0]).cross(&(t[2] - t[0])).norm());
    assert!((quality([p(0.0, 0.0), p(1.0, 0.0), p(0.5, 0.75f64.sqrt())]) - 0.75f64.sqrt()).abs() < 1e-15);
    assert_eq!(quality([p(0.0, 0.0), p(2.0, 0.0), p(0.0, 2.0)]), 0.5);
    assert_eq!((quality([p(0.0, 0.0), p(2.0, 0.0), p(1.0, 0.0)]), quality([p(1.0, 1.0); 3])), (0.0, 0.0));
}

// ---- adjacency --------------------------------------------------------------------------------------------------

#[derive(Clone, Debug)]
enum Edit {
    AddVertex,
    AddFace([usize; 3]),
    Remove(usize),
    Flip(usize),
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let edit = prop_oneof![
        1 => Just(Edit::AddVertex),
        4 => any::<[usize; 3]>().prop_map(Edit::AddFace),
        4 => any::<usize>().prop_map(Edit::Remove),
        1 => any::<usize>().prop_map(Edit::Flip),
    ];
    prop::collection::vec(edit, 0..200)
}

proptest! {
    #[test]
    fn stars_are_those_of_a_mesh_built_anew(edits in edits()) {
        let mut mesh = grid(3, 1.0, |_, _| 0.0);
        let mut faces: Vec<Option<[u32; 3]>> = mesh.faces().map(|(_, corners)| Some(corners.map(|v| v.0))).collect();
        for edit in edits {
            let vertices = mesh.vertex_count();
            match edit {
                Edit::AddVertex => prop_assert_eq!(mesh.add_vertex(Point3::origin()).unwrap().0 as usize, vertices),
                Edit::AddFace(corners) => {
                    let corners = corners.map(|at| (at % vertices) as u32);
                    let [a, b, c] = corners;
                    match mesh.add_face(corners.map(VertexId)) {
                        Ok(face) => {
                            faces.resize(faces.len().max(face.0 as usize + 1), None);
                            prop_assert_eq!(faces[face.0 as usize].replace(corners), None, "an id that was in use");
                        }
                        Err(_) => prop_assert!(a == b || b == c || c == a),
                    }
                }
                Edit::Remove(at) => {
                    let at = at % faces.len();
                    prop_assert_eq!(mesh.remove_face(FaceId(at as u32)), faces[at].take().is_some());
                }
                Edit::Flip(at) => {
                    let at = at % faces.len();
                    if let Some(corners) = &mut faces[at] {
                        mesh.flip_face(FaceId(at as u32));
                        corners.swap(1, 2);
                    }
                }
            }
        }
        let kept: Vec<_> = faces.iter().flatten().copied().collect();
        prop_assert_eq!(mesh.face_count(), kept.len());
        prop_assert_eq!(mesh.faces().map(|(_, corners)| corners.map(|v| v.0)).collect::<Vec<_>>(), kept.clone());
        prop_assert!(faces.iter().enumerate().all(|(id, face)| mesh.has_face(FaceId(id as u32)) == face.is_some()));
        let anew = TriMesh::new(mesh.positions().to_vec(), kept).unwrap();
        let star = |mesh: &TriMesh, vertex| {
            let mut star: Vec<_> = mesh.star(vertex).iter().map(|&face| mesh.corners(face)).collect();
            star.sort_unstable();
            star
        };
        for vertex in (0..mesh.vertex_count() as u32).map(VertexId) {
            prop_assert_eq!(star(&mesh, vertex), star(&anew, vertex));
        }
        // a tree over what is left sees no face that was removed
        let tree = FaceTree::new(&mesh);
        if let Some(hit) = tree.closest(&mesh, &Point3::new(0.1, 0.2, 0.3), f64::INFINITY) {
            prop_assert!(mesh.has_face(hit.face));
        }
    }
}

// ---- inside and outside -----------------------------------------------------------------------------------------

/// How often a closed mesh winds around `p`: the solid angles of its faces \[Van Oosterom Strackee 1983\] over 4π.
fn winding(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    let of_face = |t: Triangle| {
        let [a, b, c] = t.map(|x| x - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        2.0 * a.dot(&b.cross(&c)).atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
    };
    mesh.faces().map(|(face, _)| of_face(mesh.triangle(face))).sum::<f64>() / (2.0 * TAU)
}

/// Distance from `p` to the nearest face, m.
fn nearest_of(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces().map(|(face, _)| distance(p, &mesh.triangle(face))).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_signed_distance_is_negative_where_the_mesh_winds_around() {
    let mut rng = Pcg64::seed_from_u64(7);
    for _ in 0..8 {
        // spikes and dents: every second point lies nearest to an edge or a corner
        let mesh = ball(8, 12, |direction| direction * within(&mut rng, 0.4, 1.0));
        let tree = FaceTree::new(&mesh);
        for _ in 0..500 {
            let p = Point3::from(point(&mut rng));
            let d = signed_distance(&mesh, &tree, &p, f64::INFINITY).unwrap();
            assert!((d.abs() - nearest_of(&mesh, &p)).abs() < 1e-12);
            assert_eq!(d < 0.0, winding(&mesh, &p) > 0.5, "{p}: {d}");
        }
    }
}
