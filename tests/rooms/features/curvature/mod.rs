//! Curvature against Gauss and Bonnet and against surfaces of known curvature; clusters against the
//! true features.

#[path = "clusters.rs"]
mod clusters_of;

use std::f64::consts::{PI, TAU};

use crate::common::{grid, within};
use crate::shapes::{icosphere, subdivided, torus};
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::features::{VertexKind, curvature};
use touchup::mesh::TriMesh;

const MM: f64 = 1e-3;

/// Each vertex displaced at random by up to `by`.
fn crumpled(mesh: &TriMesh, by: f64, seed: u64) -> TriMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    let moved = |p: &Point3<f64>| p + Vector3::from_fn(|_, _| within(&mut rng, -by, by));
    TriMesh::new(mesh.positions().iter().map(moved).collect(), faces_of(mesh)).unwrap()
}

fn faces_of(mesh: &TriMesh) -> Vec<[u32; 3]> {
    mesh.faces()
        .map(|(_, corners)| corners.map(|v| v.0))
        .collect()
}

#[test]
fn defects_of_closed_meshes_sum_to_the_euler_number() {
    let cases = [(icosphere(1.0, 3), 2.0), (torus(1.0, 0.4, [24, 12]), 0.0)];
    for (mesh, euler) in cases {
        for by in [0.0, 0.02, 0.5] {
            let mesh = crumpled(&mesh, by, 5);
            let found = curvature(&mesh);
            let sum: f64 = found.iter().map(|c| c.defect).sum();
            assert!(
                (sum - TAU * euler).abs() < 1e-11 * found.len() as f64,
                "{sum}"
            );
            assert!(found.iter().all(|c| c.kind == VertexKind::Inner));
            let area: f64 = mesh
                .faces()
                .map(|(f, _)| mesh.double_area_normal(f).norm() / 2.0)
                .sum();
            assert!(
                (found.iter().map(|c| c.area).sum::<f64>() / area - 1.0).abs() < 1e-12,
                "areas share out the mesh"
            );
        }
    }
}

#[test]
fn angles_are_as_exact_as_those_of_atan2() {
    for (by, seed) in [(0.0, 1), (0.1, 2), (1.0, 3), (30.0, 4)] {
        let mesh = crumpled(&icosphere(1.0, 3), by, seed);
        for (c, v) in curvature(&mesh).iter().zip(0..) {
            let star = mesh.star(touchup::mesh::VertexId(v));
            let angles = star.iter().map(|&f| {
                let at = mesh.corners(f).iter().position(|c| c.0 == v).unwrap();
                let t = mesh.triangle(f);
                let (e, f) = (t[(at + 1) % 3] - t[at], t[(at + 2) % 3] - t[at]);
                e.cross(&f).norm().atan2(e.dot(&f))
            });
            let defect = TAU - angles.sum::<f64>();
            assert!((c.defect - defect).abs() < 1e-14, "{} {defect}", c.defect);
        }
    }
}

#[test]
fn curvature_of_a_sphere_converges_to_its_own() {
    let radius = 20.0 * MM;
    let errors = [2, 3, 4, 5].map(|halvings| {
        let found = curvature(&icosphere(radius, halvings));
        let gaussian = found
            .iter()
            .map(|c| (c.gaussian() * radius * radius - 1.0).abs())
            .fold(0.0, f64::max);
        let mean = found
            .iter()
            .map(|c| (c.mean() * radius - 1.0).abs())
            .fold(0.0, f64::max);
        [gaussian, mean]
    });
    println!("{errors:?}");
    for pair in errors.windows(2) {
        // second order: a quarter with each halving
        assert!((0..2).all(|i| pair[1][i] < 0.3 * pair[0][i]), "{pair:?}");
    }
    assert!(errors[3].iter().all(|e| *e < 1e-3));
    let inside_out: Vec<_> = faces_of(&icosphere(radius, 2))
        .iter()
        .map(|[a, b, c]| [*a, *c, *b])
        .collect();
    let hollow = TriMesh::new(icosphere(radius, 2).positions().to_vec(), inside_out).unwrap();
    assert!(
        curvature(&hollow)
            .iter()
            .all(|c| c.gaussian() > 0.0 && c.mean() < 0.0),
        "a hollow is a depression"
    );
}

#[test]
fn cylinder_and_plane_have_none_and_their_rim_is_no_curvature() {
    let (r, edge) = (5.0 * MM, 0.5 * MM);
    let flat = grid(20, edge, |_, _| 0.0);
    // rolled up over its x: edges along z stay, those along x become chords of one angle
    let rolled = |p: &Point3<f64>| Point3::new(r * (p.x / r).sin(), p.y, r * (p.x / r).cos());
    let cylinder = TriMesh::new(
        flat.positions().iter().map(rolled).collect(),
        faces_of(&flat),
    )
    .unwrap();
    let crumpled = crumpled(&flat, 0.0, 0);
    for (mesh, mean) in [(flat, 0.0), (crumpled, 0.0), (cylinder, 0.5 / r)] {
        let found = curvature(&mesh);
        assert_eq!(
            found.iter().filter(|c| c.kind == VertexKind::Rim).count(),
            80
        );
        for c in &found {
            assert!(c.gaussian().abs() * r * r < 1e-10, "{c:?}");
            let wanted = if c.kind == VertexKind::Inner {
                mean
            } else {
                0.0
            };
            assert!((c.mean() - wanted).abs() < 2e-3 / r, "{c:?}");
        }
        // the rim turns once: 2π, at the corners and (rolled up) nowhere else
        let turn: f64 = found
            .iter()
            .filter(|c| c.kind == VertexKind::Rim)
            .map(|c| c.defect)
            .sum();
        assert!((turn - TAU).abs() < 1e-9);
    }
}

#[test]
fn odd_vertices_are_named() {
    let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
    let corners = vec![
        p(0.0, 0.0, 0.0),
        p(1.0, 0.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, 0.0, 1.0),
    ];
    let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let kinds = |positions: &[Point3<f64>], faces: &[[u32; 3]]| -> Vec<VertexKind> {
        curvature(&TriMesh::new(positions.to_vec(), faces.to_vec()).unwrap())
            .iter()
            .map(|c| c.kind)
            .collect()
    };
    use VertexKind::{Inner, Irregular, Rim, Unused};
    assert_eq!(kinds(&corners, &tetrahedron), [Inner; 4]);
    assert_eq!(kinds(&corners, &tetrahedron[..3]), [Inner, Rim, Rim, Rim]);
    assert_eq!(kinds(&corners, &tetrahedron[..1]), [Rim, Rim, Rim, Unused]);
    // one face turned over
    let turned = [tetrahedron[0], tetrahedron[1], tetrahedron[2], [1, 3, 2]];
    assert_eq!(
        kinds(&corners, &turned),
        [Inner, Irregular, Irregular, Irregular]
    );
    // two tetrahedra that share a corner, then one more face at an edge
    let mirrored: Vec<_> = corners
        .iter()
        .chain(&[p(-1.0, 0.0, 0.0), p(0.0, -1.0, 0.0), p(0.0, 0.0, -1.0)])
        .copied()
        .collect();
    let other = [[0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]];
    let both: Vec<_> = tetrahedron.into_iter().chain(other).collect();
    assert_eq!(
        kinds(&mirrored, &both),
        [Irregular, Inner, Inner, Inner, Inner, Inner, Inner]
    );
    let fin: Vec<_> = tetrahedron.into_iter().chain([[1, 2, 4]]).collect();
    assert_eq!(
        kinds(&mirrored, &fin)[1..5],
        [Irregular, Irregular, Inner, Rim]
    );
    // the corner of a cube: a quarter of the sphere's 4π over eight corners
    let found = curvature(&TriMesh::new(corners.clone(), tetrahedron.to_vec()).unwrap());
    assert!((found[0].defect - PI / 2.0).abs() < 1e-15);
    // a face without area adds its angle and nothing else
    let found = curvature(
        &TriMesh::new(
            vec![p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(2.0, 0.0, 0.0)],
            vec![[0, 1, 2]],
        )
        .unwrap(),
    );
    assert_eq!(
        found.iter().map(|c| (c.defect, c.area)).collect::<Vec<_>>(),
        [(PI, 0.0), (0.0, 0.0), (PI, 0.0)]
    );
}

#[test]
fn fans_of_any_size_and_scale_are_summed() {
    for count in [3, 8, 9, 200, 3000] {
        for scale in [1e-9, 1.0, 1e3] {
            // a cone: the angle at the apex is the same in each of its faces
            let ring = (0..count).map(|i| {
                let angle = TAU * f64::from(i) / f64::from(count);
                Point3::new(angle.cos(), angle.sin(), -0.5) * scale
            });
            let positions: Vec<_> = std::iter::once(Point3::origin()).chain(ring).collect();
            let faces = (0..count)
                .map(|i| [0, 1 + i, 1 + (i + 1) % count])
                .collect();
            let apex = curvature(&TriMesh::new(positions, faces).unwrap())[0];
            let half = ((PI / f64::from(count)).sin() / 1.25f64.sqrt()).asin();
            let defect = TAU - 2.0 * f64::from(count) * half;
            assert_eq!(apex.kind, VertexKind::Inner);
            assert!(
                (apex.defect - defect).abs() < 2e-15 * f64::from(count),
                "{count}: {} {defect}",
                apex.defect
            );
            assert!(apex.integrated_mean > 0.0);
        }
    }
}
