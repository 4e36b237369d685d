//! The closest face against brute force, also while the mesh changes, and its side against known
//! solids.

use super::*;
use nalgebra::Isometry3;
use touchup::mesh::{BoxQuery, FaceHit, NearbyLeaves};

fn brute_distance(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces()
        .map(|(face, _)| distance(p, &mesh.triangle(face)))
        .fold(f64::INFINITY, f64::min)
}

fn brute_barycentre_distance(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces()
        .map(|(face, _)| (p - mesh.barycentre(face)).norm())
        .fold(f64::INFINITY, f64::min)
}

/// Error bound of a distance computed in doubles, and of the named face against the nearest.
///
/// Let M be the largest coordinate, D the diagonal of the mesh, d the distance; ε/2 is one
/// rounding.
///
/// - A point of a face, a corner and two shares of edges, has two roundings of ε/2 · M along each
///   axis and of ε D for the products; its distance to `p` one of 5/4 ε d. So one distance is off
///   by e = √3 ε M + ε D + 5/4 ε d. Two faces nearer to each other than 2e are indistinguishable
///   and count as equal, so the distance of the named face is off by that and by e for each of the
///   two: 4e < 8 ε M + 4 ε D + 5 ε d.
/// - The shares are quotients of products of edges with `p` − corner: each moves the point along an
///   edge by up to 9 ε (D + d), the quotient of dots of three terms. That counts in full only for a
///   d as small, once for either face.
/// - The brute force works relative to a corner, so M does not enter: 7 ε (D + d), from the same
///   products.
/// - For each face the error of deciding inside from side: the normal of a face of quality q
///   (height over longest edge L) is off by 3 ε/2 / q, and the foot by 16 ε L/q at most; but a
///   mistake between two sides is never more than the height.
fn rounding(mesh: &TriMesh, p: &Point3<f64>, distance: f64) -> f64 {
    let coordinate = mesh
        .positions()
        .iter()
        .map(|x| x.coords.amax())
        .fold(p.coords.amax(), f64::max);
    let (mut lo, mut hi) = (mesh.positions()[0], mesh.positions()[0]);
    mesh.positions()
        .iter()
        .for_each(|x| (lo, hi) = (lo.inf(x), hi.sup(x)));
    let of_face = |t: &Triangle| {
        let longest = (0..3)
            .map(|i| (t[(i + 1) % 3] - t[i]).norm())
            .fold(0.0, f64::max);
        let height = (t[1] - t[0]).cross(&(t[2] - t[0])).norm() / longest;
        // the distance of p counts as the edge does
        let size = longest + distance;
        if longest > 0.0 {
            height.min(16.0 * f64::EPSILON * size * size / height)
        } else {
            0.0
        }
    };
    let of_faces = mesh
        .faces()
        .map(|(face, _)| of_face(&mesh.triangle(face)))
        .fold(0.0, f64::max);
    f64::EPSILON * (8.0 * coordinate + 30.0 * ((hi - lo).norm() + distance)) + of_faces
}

/// Checks one query of either kind, inside and outside the reach.
fn check_query(mesh: &TriMesh, tree: &FaceTree, p: &Point3<f64>) {
    let (wanted, wanted_middle) = (brute_distance(mesh, p), brute_barycentre_distance(mesh, p));
    let tolerance = rounding(mesh, p, wanted);
    let hit = tree
        .closest(mesh, p, f64::INFINITY)
        .expect("a face is there");
    check_hit(mesh, p, &hit, tolerance);
    let found = distance(p, &mesh.triangle(hit.face));
    assert!(
        (found - wanted).abs() <= tolerance,
        "{p}: face {:?} is {found:e} away, nearest {wanted:e}",
        hit.face
    );
    let found = hit.distance_squared.sqrt();
    assert!(
        (found - wanted).abs() <= tolerance,
        "{p}: reported {found:e}, nearest {wanted:e}, by {:e}",
        found - wanted
    );

    let middle = tree
        .closest_barycentre(mesh, p, f64::INFINITY)
        .expect("a face is there");
    let tolerance_middle = rounding(mesh, p, wanted_middle);
    assert!((middle.distance_squared.sqrt() - wanted_middle).abs() <= tolerance_middle);
    assert!((p - mesh.barycentre(middle.face)).norm() <= wanted_middle + tolerance_middle);
    assert_eq!(middle.point, mesh.barycentre(middle.face));

    let around = |distance: f64, tolerance: f64| {
        (
            distance * (1.0 + 1e-9) + tolerance,
            distance * (1.0 - 1e-9) - tolerance,
        )
    };
    let (above, below) = around(wanted, tolerance);
    assert_eq!(
        tree.closest(mesh, p, above),
        Some(hit),
        "a sufficient reach changes nothing"
    );
    assert!(
        below <= 0.0 || tree.closest(mesh, p, below).is_none(),
        "beyond the reach"
    );
    let (above, below) = around(wanted_middle, tolerance_middle);
    assert_eq!(tree.closest_barycentre(mesh, p, above), Some(middle));
    assert!(below <= 0.0 || tree.closest_barycentre(mesh, p, below).is_none());
}

/// The parts of one hit agree with each other.
fn check_hit(mesh: &TriMesh, p: &Point3<f64>, hit: &FaceHit, tolerance: f64) {
    let sum: f64 = hit.barycentric.iter().sum();
    assert!((sum - 1.0).abs() <= 4.0 * f64::EPSILON, "{sum}");
    assert!(
        hit.barycentric
            .iter()
            .all(|&x| (-4.0 * f64::EPSILON..=1.0 + 4.0 * f64::EPSILON).contains(&x))
    );
    let t = mesh.triangle(hit.face);
    let made: Vector3<f64> = t
        .iter()
        .zip(hit.barycentric)
        .map(|(corner, x)| (corner - t[0]) * x)
        .sum();
    assert!(
        (hit.point - t[0] - made).norm() <= tolerance,
        "the barycentric coordinates name the point"
    );
    assert!(((p - hit.point).norm() - hit.distance_squared.sqrt()).abs() <= tolerance);
}

/// A point near the mesh, in a face, or exactly on a corner.
fn query(mesh: &TriMesh, scale: f64, shift: Vector3<f64>, rng: &mut Pcg64) -> Point3<f64> {
    let face = FaceId(within(rng, 0.0, mesh.face_count() as f64) as u32);
    match within(rng, 0.0, 4.0) as u32 {
        0 => mesh.triangle(face)[1],
        1 => mesh.barycentre(face) + point(rng) * (1e-3 * scale),
        _ => Point3::from(point(rng) * (1.5 * scale) + shift),
    }
}

proptest! {
    #[test]
    fn closest_face_is_that_of_brute_force((mesh, scale, shift, seed) in any_mesh()) {
        let mut rng = Pcg64::seed_from_u64(!seed);
        let tree = FaceTree::new(&mesh);
        for _ in 0..24 {
            check_query(&mesh, &tree, &query(&mesh, scale, shift, &mut rng));
        }
    }

    /// Moves of a vertex, a little or across the whole mesh, each passed to the tree.
    #[test]
    fn closest_face_stays_that_of_brute_force_while_vertices_move((mut mesh, scale, shift, seed) in any_mesh()) {
        let mut rng = Pcg64::seed_from_u64(!seed);
        let mut tree = FaceTree::new(&mesh);
        for _ in 0..8 {
            for _ in 0..within(&mut rng, 1.0, 20.0) as u32 {
                move_one(&mut mesh, &mut tree, &mut rng, scale, shift);
            }
            for _ in 0..4 {
                check_query(&mesh, &tree, &query(&mesh, scale, shift, &mut rng));
            }
        }
    }

    #[test]
    fn faces_in_box_miss_none_and_come_once((mut mesh, scale, shift, seed) in any_mesh()) {
        let mut rng = Pcg64::seed_from_u64(!seed);
        let mut tree = FaceTree::new(&mesh);
        let mut in_box = BoxQuery::default();
        for _ in 0..12 {
            move_one(&mut mesh, &mut tree, &mut rng, scale, shift);
            let (a, b) = (query(&mesh, scale, shift, &mut rng), query(&mesh, scale, shift, &mut rng));
            let (lo, hi) = (a.inf(&b), a.sup(&b));
            tree.faces_in_box(&lo, &hi, &mut in_box);
            let mut found = in_box.faces.clone();
            found.sort_unstable();
            prop_assert!(found.windows(2).all(|pair| pair[0] != pair[1]), "none comes twice");
            for (face, _) in mesh.faces() {
                let t = mesh.triangle(face);
                let meets = (0..3).all(|i| {
                    let side = t.map(|corner| corner[i]);
                    side.into_iter().fold(f64::INFINITY, f64::min) <= hi[i]
                        && side.into_iter().fold(f64::NEG_INFINITY, f64::max) >= lo[i]
                });
                prop_assert!(!meets || found.binary_search(&face).is_ok(), "{:?} is missing", face);
            }
        }
    }
}

fn move_one(
    mesh: &mut TriMesh,
    tree: &mut FaceTree,
    rng: &mut Pcg64,
    scale: f64,
    shift: Vector3<f64>,
) {
    let vertex = VertexId(within(rng, 0.0, mesh.vertex_count() as f64) as u32);
    let here = mesh.position(vertex);
    let there = match within(rng, 0.0, 3.0) as u32 {
        0 => Point3::from(point(rng) * scale + shift),
        1 => mesh.position(VertexId(0)),
        _ => here + point(rng) * (0.01 * scale),
    };
    mesh.set_position(vertex, there);
    tree.refit(mesh, mesh.star(vertex));
}

#[test]
#[ignore = "a slow proof"]
fn twenty_thousand_faces_after_five_thousand_edits() {
    let mut rng = Pcg64::seed_from_u64(20);
    let mut mesh = grid(100, 2e-3, |_, _| within(&mut rng, -1e-3, 1e-3));
    assert_eq!(mesh.face_count(), 20_000);
    let mut tree = FaceTree::new(&mesh);
    for _ in 0..5_000 {
        move_one(&mut mesh, &mut tree, &mut rng, 0.1, Vector3::zeros());
    }
    for _ in 0..1_000 {
        let p = query(&mesh, 0.1, Vector3::zeros(), &mut rng);
        check_query(&mesh, &tree, &p);
    }
}

// ---- inside and outside

/// A prism over the polygon `outline` (convex, counter-clockwise seen from above) from z = −1 to z
/// = 1, normals outside.
fn prism(outline: &[[f64; 2]]) -> TriMesh {
    let count = outline.len() as u32;
    let positions = [-1.0, 1.0]
        .iter()
        .flat_map(|&z| outline.iter().map(move |&[x, y]| Point3::new(x, y, z)));
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

/// Points straight off every edge and corner in all directions, with two to six equally near faces;
/// also far from the origin and askew, with different roundings of the closest point of each.
#[test]
fn at_edges_and_corners_the_sign_separates_inside_from_outside() {
    let cube = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    // tan 5° · 2 = 0.175: a wedge of 5° at x = 1
    let wedge = [[-1.0, -0.0875], [1.0, 0.0], [-1.0, 0.0875]];
    let mut rng = Pcg64::seed_from_u64(3);
    for (outline, far) in [(&cube[..], 0.0), (&wedge, 0.0), (&cube, 1e6), (&wedge, 1e6)] {
        let shift = vector![far, -0.7 * far, 0.3 * far];
        let pose = Isometry3::new(shift, vector![0.3, 0.5, 0.7] * (far / 1e6));
        let upright = prism(outline);
        let faces = upright
            .faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect();
        let solid = TriMesh::new(
            upright.positions().iter().map(|x| pose * x).collect(),
            faces,
        )
        .unwrap();
        let mut cavity = solid.clone();
        (0..solid.face_count()).for_each(|face| cavity.flip_face(FaceId(face as u32)));
        for (mesh, sign) in [(&solid, 1.0), (&cavity, -1.0)] {
            let tree = FaceTree::new(mesh);
            let mut tried = [0, 0];
            for (_, corners) in mesh.faces() {
                for i in 0..3 {
                    let (a, b) = (
                        mesh.position(corners[i]),
                        mesh.position(corners[(i + 1) % 3]),
                    );
                    for step in 0..60 {
                        let on_edge = if step % 3 == 0 {
                            a
                        } else {
                            a + (b - a) * within(&mut rng, 0.0, 1.0)
                        };
                        let p = on_edge + point(&mut rng) * 10f64.powf(within(&mut rng, -4.0, 0.0));
                        let truth = outside(outline, &pose.inverse_transform_point(&p));
                        // rounding of corners is 6e-11 along each axis at 1e6
                        if truth.abs() < 1e-9 + 1e-15 * far {
                            continue;
                        }
                        let hit = tree.closest(mesh, &p, f64::INFINITY).unwrap();
                        let found = (p - hit.point).dot(&mesh.normal(hit.face)) * sign;
                        assert!(
                            found * truth > 0.0,
                            "{p}: {found:e} where {truth:e} is true"
                        );
                        tried[usize::from(truth > 0.0)] += 1;
                    }
                }
            }
            assert!(
                tried.iter().all(|&count| count > 50),
                "{tried:?}: both sides are met"
            );
        }
    }
}

/// By hand: the ball over a ridge of 90° whose sides have their normals along +x and +z; the edge
/// is the y axis.
#[test]
fn off_an_edge_the_face_that_the_point_is_most_squarely_above_is_named() {
    let p = Point3::new;
    let positions = vec![
        p(0.0, -1.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(-1.0, 0.0, 0.0),
        p(0.0, 0.0, -1.0),
    ];
    let mesh = TriMesh::new(positions, vec![[0, 1, 2], [1, 0, 3]]).unwrap();
    assert_eq!(
        [mesh.normal(FaceId(0)), mesh.normal(FaceId(1))],
        [Vector3::z(), Vector3::x()]
    );
    let tree = FaceTree::new(&mesh);
    let face = |x, z| tree.closest(&mesh, &p(x, 0.2, z), 9.0).unwrap().face.0;
    assert_eq!((face(0.1, 0.3), face(0.3, 0.1)), (0, 1));
    assert_eq!(face(0.2, 0.2), 0, "among equals the smallest id");
}

/// By hand: a point in the plane of a flat face, 0.6 off its open edge, 7e-5 from the end of that.
/// A face that has only this corner in common is (7e-5)² / (2 · 0.6) = 4.1e-9 farther and lies
/// squarely: more than rounding makes up for at 1e6 (4 √3 ε · 1e6 = 1.5e-9), so it is not named.
#[test]
fn a_face_that_is_nearly_as_near_is_not_named() {
    for far in [0.0, 1e6] {
        let at = |x: f64, y: f64, z: f64| Point3::new(far + x, far + y, far + z);
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
        ];
        let positions = positions.map(|[x, y, z]| at(x, y, z)).to_vec();
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 3, 4]]).unwrap();
        let hit = FaceTree::new(&mesh)
            .closest(&mesh, &at(-7e-5, -0.6, 0.0), 9.0)
            .unwrap();
        assert_eq!(hit.face, FaceId(1), "{far}");
    }
}

#[test]
fn a_query_that_is_no_point_or_finds_nothing_gives_none() {
    let mesh = grid(10, 1.0, |_, _| 0.0);
    let tree = FaceTree::new(&mesh);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for p in [
            Point3::new(bad, 0.0, 0.0),
            Point3::new(0.0, 0.0, bad),
            Point3::new(bad, bad, bad),
        ] {
            for reach in [1.0, f64::INFINITY] {
                assert_eq!(tree.closest(&mesh, &p, reach), None, "{p}");
                assert_eq!(tree.closest_barycentre(&mesh, &p, reach), None, "{p}");
            }
        }
    }
    for reach in [0.0, f64::NAN] {
        assert_eq!(
            tree.closest(&mesh, &Point3::new(0.1, 0.1, 0.1), reach),
            None
        );
    }
    let empty = TriMesh::new(vec![], vec![]).unwrap();
    let mut found = BoxQuery::default();
    FaceTree::new(&empty).faces_in_box(
        &Point3::new(-1.0, -1.0, -1.0),
        &Point3::new(1.0, 1.0, 1.0),
        &mut found,
    );
    assert_eq!(
        (
            FaceTree::new(&empty).closest(&empty, &Point3::origin(), 1.0),
            found.faces
        ),
        (None, vec![])
    );
}

#[test]
fn faces_at_one_place_are_all_searched() {
    // no split can separate a thousand equal faces; the answer is the smallest id
    let positions = vec![
        Point3::origin(),
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
    ];
    let mut mesh = TriMesh::new(positions, vec![[0, 1, 2]; 1000]).unwrap();
    let mut tree = FaceTree::new(&mesh);
    assert_eq!(
        tree.closest(&mesh, &Point3::new(0.2, 0.2, 0.5), 1.0)
            .unwrap()
            .face,
        FaceId(0)
    );
    mesh.set_position(VertexId(0), Point3::new(0.0, 0.0, 2.0));
    tree.refit(&mesh, mesh.star(VertexId(0)));
    check_query(&mesh, &tree, &Point3::new(0.0, 0.0, 2.5));
}

/// If the hint leaves no distance at all, rounding of a needle's normal must not lose its own
/// corner.
#[test]
fn a_corner_of_a_needle_is_found_from_its_own_face() {
    let mut rng = Pcg64::seed_from_u64(11);
    for _ in 0..20_000 {
        let [a, along, aside] = [0; 3].map(|_| point(&mut rng));
        let corners = [
            a,
            a + along,
            a + along * 0.7 + aside * within(&mut rng, 2e-3, 2e-2),
        ]
        .map(Point3::from);
        let mesh = TriMesh::new(corners.into(), vec![[0, 1, 2]]).unwrap();
        let tree = FaceTree::new(&mesh);
        for corner in corners {
            let hit = tree.closest_nearby(
                &mesh,
                &corner,
                FaceId(0),
                f64::INFINITY,
                &mut NearbyLeaves::default(),
            );
            assert_eq!(
                hit.map(|hit| hit.distance_squared),
                Some(0.0),
                "{corners:?} from {corner}"
            );
        }
    }
}
