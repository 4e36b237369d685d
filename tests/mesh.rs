//! The mesh from outside: closest face against brute force, triangles against exact arithmetic, adjacency against a
//! mesh that is built anew.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::{BoxQuery, FaceHit, FaceId, FaceTree, TriMesh, VertexId, triangle};

#[path = "common/mod.rs"]
mod common;
use common::{grid, within};

type Triangle = [Point3<f64>; 3];

// ---- an independent distance ------------------------------------------------------------------------------------

/// The point of a triangle nearest to `p`: the foot on its plane where that is inside, else the nearest of the feet on
/// its three sides. The code under test goes by Voronoi regions instead.
fn nearest(p: &Point3<f64>, t: &Triangle) -> Point3<f64> {
    let (p, t) = (p - t[0], t.map(|x| x - t[0]));
    let on_side = |a: Vector3<f64>, b: Vector3<f64>| {
        let length = (b - a).norm();
        if length == 0.0 { a } else { a + (b - a) * ((p - a).dot(&((b - a) / length)) / length).clamp(0.0, 1.0) }
    };
    let mut best = t[0];
    for side in [on_side(t[0], t[1]), on_side(t[1], t[2]), on_side(t[2], t[0])] {
        if (p - side).norm() < (p - best).norm() {
            best = side;
        }
    }
    let sides = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    if let Some(normal) = t[1].cross(&t[2]).try_normalize(0.0) {
        let foot = p - normal * normal.dot(&p);
        let is_inside = sides.iter().all(|(a, b)| normal.dot(&(b - a).cross(&(foot - a))) >= 0.0);
        if is_inside && (p - foot).norm() < (p - best).norm() {
            best = foot;
        }
    }
    Point3::from(best)
}

/// Distance from `p` to a triangle, m; relative to a corner, so that a far origin costs no digits.
fn distance(p: &Point3<f64>, t: &Triangle) -> f64 {
    (p - t[0] - nearest(p, t).coords).norm()
}

fn brute_distance(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces().map(|(face, _)| distance(p, &mesh.triangle(face))).fold(f64::INFINITY, f64::min)
}

fn brute_barycentre_distance(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces().map(|(face, _)| (p - mesh.barycentre(face)).norm()).fold(f64::INFINITY, f64::min)
}

/// How far a distance may be from the true one when all is computed in doubles, and the face named from the nearest.
///
/// Let M be the largest coordinate, D the diagonal of the mesh, d the distance; ε/2 is one rounding.
///
/// - A point of a face, a corner and two shares of edges, is rounded twice by ε/2 · M along each axis and by ε D for the
///   products; its distance to `p` by 5/4 ε d. So one distance is off by e = √3 ε M + ε D + 5/4 ε d. Two faces nearer to
///   each other than 2e cannot be told apart and have to be taken for equal, so the distance of the face named is off by
///   that and by e for each of the two: 4e < 8 ε M + 4 ε D + 5 ε d.
/// - The shares are quotients of products of edges with `p` − corner: each moves the point along an edge by up to
///   9 ε (D + d), the quotient of dots of three terms. That counts in full only where d is as small, once for either face.
/// - The brute force works relative to a corner, so M does not enter: 7 ε (D + d), from the same products.
/// - For each face what it costs to tell inside from side: the normal of a face of quality q (height over longest edge L)
///   is off by 3 ε/2 / q, and the foot by 16 ε L/q at most; but a mistake between two sides is never more than the height.
fn rounding(mesh: &TriMesh, p: &Point3<f64>, distance: f64) -> f64 {
    let coordinate = mesh.positions().iter().map(|x| x.coords.amax()).fold(p.coords.amax(), f64::max);
    let (mut lo, mut hi) = (mesh.positions()[0], mesh.positions()[0]);
    mesh.positions().iter().for_each(|x| (lo, hi) = (lo.inf(x), hi.sup(x)));
    let of_face = |t: &Triangle| {
        let longest = (0..3).map(|i| (t[(i + 1) % 3] - t[i]).norm()).fold(0.0, f64::max);
        let height = (t[1] - t[0]).cross(&(t[2] - t[0])).norm() / longest;
        // what p is away counts as the edge does
        let size = longest + distance;
        if longest > 0.0 { height.min(16.0 * f64::EPSILON * size * size / height) } else { 0.0 }
    };
    let of_faces = mesh.faces().map(|(face, _)| of_face(&mesh.triangle(face))).fold(0.0, f64::max);
    f64::EPSILON * (8.0 * coordinate + 30.0 * ((hi - lo).norm() + distance)) + of_faces
}

/// Checks one query of either kind, inside and outside the reach.
fn check_query(mesh: &TriMesh, tree: &FaceTree, p: &Point3<f64>) {
    let (wanted, wanted_middle) = (brute_distance(mesh, p), brute_barycentre_distance(mesh, p));
    let tolerance = rounding(mesh, p, wanted);
    let hit = tree.closest(mesh, p, f64::INFINITY).expect("a face is there");
    check_hit(mesh, p, &hit, tolerance);
    let found = distance(p, &mesh.triangle(hit.face));
    assert!((found - wanted).abs() <= tolerance, "{p}: face {:?} is {found:e} away, nearest {wanted:e}", hit.face);
    let told = hit.distance_squared.sqrt();
    assert!((told - wanted).abs() <= tolerance, "{p}: told {told:e}, nearest {wanted:e}, by {:e}", told - wanted);

    let middle = tree.closest_barycentre(mesh, p, f64::INFINITY).expect("a face is there");
    let tolerance_middle = rounding(mesh, p, wanted_middle);
    assert!((middle.distance_squared.sqrt() - wanted_middle).abs() <= tolerance_middle);
    assert!((p - mesh.barycentre(middle.face)).norm() <= wanted_middle + tolerance_middle);
    assert_eq!(middle.point, mesh.barycentre(middle.face));

    let around =
        |distance: f64, tolerance: f64| (distance * (1.0 + 1e-9) + tolerance, distance * (1.0 - 1e-9) - tolerance);
    let (above, below) = around(wanted, tolerance);
    assert_eq!(tree.closest(mesh, p, above), Some(hit), "a sufficient reach changes nothing");
    assert!(below <= 0.0 || tree.closest(mesh, p, below).is_none(), "beyond the reach");
    let (above, below) = around(wanted_middle, tolerance_middle);
    assert_eq!(tree.closest_barycentre(mesh, p, above), Some(middle));
    assert!(below <= 0.0 || tree.closest_barycentre(mesh, p, below).is_none());
}

/// The parts of one hit agree with each other.
fn check_hit(mesh: &TriMesh, p: &Point3<f64>, hit: &FaceHit, tolerance: f64) {
    let sum: f64 = hit.barycentric.iter().sum();
    assert!((sum - 1.0).abs() <= 4.0 * f64::EPSILON, "{sum}");
    assert!(hit.barycentric.iter().all(|&x| (-4.0 * f64::EPSILON..=1.0 + 4.0 * f64::EPSILON).contains(&x)));
    let t = mesh.triangle(hit.face);
    let made: Vector3<f64> = t.iter().zip(hit.barycentric).map(|(corner, x)| (corner - t[0]) * x).sum();
    assert!((hit.point - t[0] - made).norm() <= tolerance, "the barycentric coordinates name the point");
    assert!(((p - hit.point).norm() - hit.distance_squared.sqrt()).abs() <= tolerance);
}

// ---- random meshes ----------------------------------------------------------------------------------------------

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// triangles anywhere, of any size
    Soup,
    /// the same, nearly without width or without any
    Slivers,
    /// closed
    Ball,
    /// open
    Sheet,
}

/// A mesh of about a unit's size, with the generator for what follows.
fn unit_mesh(kind: Kind, rng: &mut Pcg64) -> TriMesh {
    match kind {
        Kind::Soup => soup(rng, |rng, a| {
            let size = 10f64.powf(within(rng, -3.0, 0.0));
            [a + point(rng) * size, a + point(rng) * size]
        }),
        Kind::Slivers => soup(rng, |rng, a| {
            let along = point(rng);
            let width = if within(rng, 0.0, 1.0) < 0.2 { 0.0 } else { 10f64.powf(within(rng, -12.0, -2.0)) };
            [a + along, a + along * within(rng, -0.5, 1.5) + point(rng) * width]
        }),
        Kind::Ball => ball(12, 20, |direction| direction * within(rng, 0.9, 1.0)),
        Kind::Sheet => grid(12, 1.0 / 6.0, |_, _| within(rng, -0.1, 0.1)),
    }
}

fn point(rng: &mut Pcg64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| within(rng, -1.0, 1.0))
}

fn soup(rng: &mut Pcg64, others: impl Fn(&mut Pcg64, Vector3<f64>) -> [Vector3<f64>; 2]) -> TriMesh {
    let count = within(rng, 1.0, 120.0) as u32;
    let positions = (0..count).flat_map(|_| {
        let a = point(rng);
        let [b, c] = others(rng, a);
        [a, b, c].map(Point3::from)
    });
    TriMesh::new(positions.collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap()
}

/// A closed surface about the origin: `rings` × `sectors` vertices and two poles.
fn ball(rings: u32, sectors: u32, mut place: impl FnMut(Vector3<f64>) -> Vector3<f64>) -> TriMesh {
    let mut positions = vec![];
    let mut put = |up: f64, turn: f64| {
        let across = (1.0 - up * up).max(0.0).sqrt();
        positions.push(Point3::from(place(vector![across * turn.cos(), across * turn.sin(), up])));
    };
    put(-1.0, 0.0);
    for ring in 0..rings {
        for sector in 0..sectors {
            put(
                -(TAU / 2.0 * f64::from(ring + 1) / f64::from(rings + 1)).cos(),
                TAU * f64::from(sector) / f64::from(sectors),
            );
        }
    }
    put(1.0, 0.0);
    let at = |ring: u32, sector: u32| 1 + ring * sectors + sector % sectors;
    let top = 1 + rings * sectors;
    let mut faces = vec![];
    for s in 0..sectors {
        faces.push([0, at(0, s + 1), at(0, s)]);
        for r in 0..rings - 1 {
            faces.push([at(r, s), at(r, s + 1), at(r + 1, s)]);
            faces.push([at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)]);
        }
        faces.push([top, at(rings - 1, s), at(rings - 1, s + 1)]);
    }
    TriMesh::new(positions, faces).unwrap()
}

/// The same mesh elsewhere: x → scale · x + shift.
fn moved(mesh: &TriMesh, scale: f64, shift: Vector3<f64>) -> TriMesh {
    let positions = mesh.positions().iter().map(|p| p * scale + shift).collect();
    TriMesh::new(positions, mesh.faces().map(|(_, corners)| corners.map(|v| v.0)).collect()).unwrap()
}

/// Sizes and places: as it is, far from the origin (m), and tiny.
const PLACES: [(f64, f64); 4] = [(1.0, 0.0), (1.0, 1e6), (0.1, 10.0), (1e-6, 0.0)];

fn any_mesh() -> impl Strategy<Value = (TriMesh, f64, Vector3<f64>, u64)> {
    let kinds = prop::sample::select(vec![Kind::Soup, Kind::Slivers, Kind::Ball, Kind::Sheet]);
    (kinds, any::<u64>(), prop::sample::select(PLACES.to_vec())).prop_map(|(kind, seed, (scale, far))| {
        let shift = vector![far, -0.7 * far, 0.3 * far];
        (moved(&unit_mesh(kind, &mut Pcg64::seed_from_u64(seed)), scale, shift), scale, shift, seed)
    })
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

    /// Moves of a vertex, a little or across the whole mesh, each told to the tree.
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

fn move_one(mesh: &mut TriMesh, tree: &mut FaceTree, rng: &mut Pcg64, scale: f64, shift: Vector3<f64>) {
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

// ---- inside and outside -----------------------------------------------------------------------------------------

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

/// Points straight off every edge and corner in all directions, where two to six faces are equally near; also far from
/// the origin and askew, where the closest point of each is rounded differently.
#[test]
fn at_edges_and_corners_the_sign_tells_inside_from_outside() {
    let cube = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    // tan 5° · 2 = 0.175: a wedge of 5° at x = 1
    let wedge = [[-1.0, -0.0875], [1.0, 0.0], [-1.0, 0.0875]];
    let mut rng = Pcg64::seed_from_u64(3);
    for (outline, far) in [(&cube[..], 0.0), (&wedge, 0.0), (&cube, 1e6), (&wedge, 1e6)] {
        let shift = vector![far, -0.7 * far, 0.3 * far];
        let pose = Isometry3::new(shift, vector![0.3, 0.5, 0.7] * (far / 1e6));
        let upright = prism(outline);
        let faces = upright.faces().map(|(_, corners)| corners.map(|v| v.0)).collect();
        let solid = TriMesh::new(upright.positions().iter().map(|x| pose * x).collect(), faces).unwrap();
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
                        let truth = outside(outline, &pose.inverse_transform_point(&p));
                        // corners are rounded by 6e-11 along each axis at 1e6
                        if truth.abs() < 1e-9 + 1e-15 * far {
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

/// By hand: a point in the plane of a flat face, 0.6 off its open edge, 7e-5 from the end of that. A face that has only
/// this corner in common is (7e-5)² / (2 · 0.6) = 4.1e-9 farther and lies squarely: more than rounding makes up for at
/// 1e6 (4 √3 ε · 1e6 = 1.5e-9), so it is not named.
#[test]
fn a_face_that_is_nearly_as_near_is_not_named() {
    for far in [0.0, 1e6] {
        let at = |x: f64, y: f64, z: f64| Point3::new(far + x, far + y, far + z);
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
        let positions = positions.map(|[x, y, z]| at(x, y, z)).to_vec();
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 3, 4]]).unwrap();
        let hit = FaceTree::new(&mesh).closest(&mesh, &at(-7e-5, -0.6, 0.0), 9.0).unwrap();
        assert_eq!(hit.face, FaceId(1), "{far}");
    }
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
