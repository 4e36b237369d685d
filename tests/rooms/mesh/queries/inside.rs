//! Inside and outside against winding numbers.

use super::*;
use touchup::mesh::signed_distance;

/// Winding number of a closed mesh around `p`: the solid angles of its faces \[Van Oosterom
/// Strackee 1983\] over 4π.
fn winding(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    let of_face = |t: Triangle| {
        let [a, b, c] = t.map(|x| x - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        2.0 * a
            .dot(&b.cross(&c))
            .atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
    };
    mesh.faces()
        .map(|(face, _)| of_face(mesh.triangle(face)))
        .sum::<f64>()
        / (2.0 * TAU)
}

/// Distance from `p` to the nearest face, m.
fn nearest_of(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
    mesh.faces()
        .map(|(face, _)| distance(p, &mesh.triangle(face)))
        .fold(f64::INFINITY, f64::min)
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
