//! Meshes without the features that they resemble.

use nalgebra::{Point3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind};
use touchup::io::mesh_file::MeshUnit::{Metre, Millimetre};
use touchup::mesh::TriMesh;

use crate::common::grid;
use crate::features::detection::{found, mesh_of, of_kind, part};
use crate::shapes::{icosphere, torus};

/// Holes, slots, pockets and bosses together.
fn cut_or_raised(features: &[Feature]) -> usize {
    [
        FeatureKind::Hole,
        FeatureKind::Slot,
        FeatureKind::Pocket,
        FeatureKind::Boss,
    ]
    .map(|kind| of_kind(features, kind).len())
    .iter()
    .sum()
}

/// Rendered from six sides: sharp and smooth edges without an opening, genus 0; a panel with
/// shallow beads, genus 0; a wrist that appears in the pictures as one smooth outline, genus 0.
#[test]
fn parts_without_holes_have_none() {
    for (name, unit) in [
        ("trimesh_fandisk.obj", Millimetre),
        ("crs_part_2.stl", Metre),
        ("ur5e_wrist2_collision.stl", Metre),
    ] {
        let Some(mesh) = part(name, unit) else { return };
        assert_eq!(cut_or_raised(&found(&mesh)), 0, "{name}");
    }
}

fn cube(edge: f64) -> TriMesh {
    let at = |i: usize| Point3::from([0, 1, 2].map(|k| if i >> k & 1 == 0 { 0.0 } else { edge }));
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    mesh_of(&faces.map(|corners| corners.map(at)).collect::<Vec<_>>())
}

#[test]
fn a_cube_has_its_planes_edges_and_corners_alone() {
    let features = found(&cube(0.04));
    let counts = [FeatureKind::Plane, FeatureKind::Edge, FeatureKind::Corner]
        .map(|kind| of_kind(&features, kind).len());
    assert_eq!((counts, features.len()), ([6, 12, 8], 26));
    assert!(
        of_kind(&features, FeatureKind::Edge)
            .iter()
            .all(|edge| edge.is_convex == Some(true))
    );
    assert!(
        of_kind(&features, FeatureKind::Edge)
            .iter()
            .all(|edge| (edge.length.as_ref().unwrap().value - 0.04).abs() < 1e-9)
    );
}

#[test]
fn a_flat_square_is_one_plane() {
    let features = found(&grid(20, 2e-3, |_, _| 0.0));
    assert_eq!(features.len(), 1);
    assert_eq!(features[0].kind, FeatureKind::Plane);
}

#[test]
fn a_sphere_has_nothing_cut_or_raised() {
    for halvings in 2..6 {
        assert_eq!(
            cut_or_raised(&found(&icosphere(0.03, halvings))),
            0,
            "{halvings}"
        );
    }
}

/// The inside of a ring is round, but no cylinder.
#[test]
fn a_torus_has_nothing_cut_or_raised() {
    for (tube, across) in [(4e-3, 24), (8e-3, 40), (8e-3, 16)] {
        assert_eq!(
            cut_or_raised(&found(&torus(0.02, tube, [60, across]))),
            0,
            "{tube} {across}"
        );
    }
}

#[test]
fn a_rough_sphere_has_nothing_cut_or_raised() {
    for seed in 0..8 {
        let mut rng = Pcg64::new(seed, 3);
        let mut mesh = icosphere(0.03, 5);
        let vertices: Vec<_> = mesh.faces().flat_map(|(_, corners)| corners).collect();
        for vertex in vertices {
            let p = mesh.position(vertex);
            // bumps of 1 mm, 10 mm long, and noise of a tenth of an edge
            let bumps = 0.5e-3 * (p.x * 600.0).sin() * (p.y * 600.0 + p.z * 300.0).cos();
            let noise: f64 = StandardNormal.sample(&mut rng);
            mesh.set_position(
                vertex,
                p + Vector3::from(p.coords.normalize()) * ((bumps + 0.1e-3 * noise) / 6.0),
            );
        }
        assert_eq!(cut_or_raised(&found(&mesh)), 0, "seed {seed}");
    }
}

#[test]
fn next_to_nothing_is_no_reason_to_fall() {
    let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
    assert!(found(&TriMesh::new(Vec::new(), Vec::new()).unwrap()).is_empty());
    assert!(found(&TriMesh::new(vec![p(0.0, 0.0)], Vec::new()).unwrap()).is_empty());
    assert!(
        found(&mesh_of(&[[p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)]]))
            .iter()
            .all(|f| f.kind == FeatureKind::Plane)
    );
    // without area, and with an edge of three faces
    let flat = TriMesh::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(2.0, 0.0)], vec![[0, 1, 2]]).unwrap();
    assert!(found(&flat).is_empty());
    let up = Point3::new(0.0, 0.0, 1.0);
    let fan = [
        [p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)],
        [p(1.0, 0.0), p(0.0, 0.0), p(0.0, -1.0)],
        [p(0.0, 0.0), p(1.0, 0.0), up],
    ];
    assert_eq!(cut_or_raised(&found(&mesh_of(&fan))), 0);
}
