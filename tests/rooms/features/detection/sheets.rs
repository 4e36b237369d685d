//! Open meshes: a sheet that ends in a circle has a hole, one that ends anyhow has none.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind};
use touchup::io::mesh_file::MeshUnit::{Metre, Millimetre};
use touchup::io::mesh_file::read_mesh;
use touchup::mesh::TriMesh;

use crate::common::{grid, within};
use crate::features::detection::{found, mesh_of, of_kind, part, triangles};
use crate::shared::shared;

/// Rings of `sides` corners about z, (radius, z) each, m: from outside to inside the mesh faces up.
fn rings(outline: &[[f64; 2]], sides: u32) -> TriMesh {
    let at = |[r, z]: [f64; 2], i: u32| {
        let angle = TAU * f64::from(i) / f64::from(sides);
        Point3::new(r * angle.cos(), r * angle.sin(), z)
    };
    let quads = outline.windows(2).flat_map(|pair| {
        (0..sides).flat_map(move |i| {
            let [a, b, c, d] = [
                at(pair[0], i),
                at(pair[1], i),
                at(pair[1], i + 1),
                at(pair[0], i + 1),
            ];
            [[a, c, b], [a, d, c]]
        })
    });
    mesh_of(&quads.collect::<Vec<_>>())
}

fn holes(mesh: &TriMesh) -> Vec<Feature> {
    of_kind(&found(mesh), FeatureKind::Hole)
        .into_iter()
        .cloned()
        .collect()
}

/// An open wavy sheet of unknown unit. Its borders, by the edges that occur once: 107 vertices
/// around it, and 60 whose x and y are within 1.979 and 2.001 of (6.00, 6.00); the circle of least
/// squares through them has r 1.996.
#[test]
fn the_wavy_sheet_has_one_hole_without_depth() {
    let Some(mesh) = part("noether_wavy_mesh_with_hole.ply", Millimetre) else {
        return;
    };
    let holes = holes(&mesh);
    assert_eq!(holes.len(), 1);
    let hole = &holes[0];
    assert!(
        (hole.diameter.as_ref().unwrap().value * 1e3 - 3.992).abs() < 0.02,
        "{:?}",
        hole.diameter
    );
    let off = hole.centre.value.xy() * 1e3 - Vector3::new(6.001, 5.999, 0.0).xy();
    assert!(
        off.coords.norm() < 0.05 && hole.axis.as_ref().unwrap().value.z > 0.99,
        "{hole:?}"
    );
    assert_eq!((hole.through, &hole.depth), (None, &None));
}

#[test]
fn a_flat_ring_and_a_dome_have_a_hole_in_the_middle() {
    let dome = [[0.04, 0.0], [0.03, 0.008], [0.02, 0.013], [0.012, 0.015]];
    for (mesh, z) in [
        (rings(&[[0.03, 0.0], [0.012, 0.0]], 40), 0.0),
        (rings(&dome, 40), 0.015),
    ] {
        let holes = holes(&mesh);
        assert_eq!(holes.len(), 1);
        assert!(
            (holes[0].diameter.as_ref().unwrap().value - 0.024).abs() < 1e-6,
            "{:?}",
            holes[0].diameter
        );
        assert!(
            (holes[0].centre.value - Point3::new(0.0, 0.0, z)).norm() < 1e-6,
            "{:?}",
            holes[0].centre
        );
        assert!(holes[0].axis.as_ref().unwrap().value.z > 1.0 - 1e-9);
    }
}

/// The upper side of a plate and the wall of its hole, open below: the lower end of the wall is the
/// same hole, and its bottom is unknown.
#[test]
fn the_open_end_of_a_wall_is_no_second_hole() {
    for depth in [0.002, 0.006, 0.02] {
        let mesh = rings(&[[0.04, 0.0], [0.01, 0.0], [0.01, -depth]], 48);
        let holes = holes(&mesh);
        assert_eq!(holes.len(), 1, "{depth}");
        assert!(
            (holes[0].diameter.as_ref().unwrap().value - 0.02).abs() < 1e-6,
            "{:?}",
            holes[0].diameter
        );
        assert_eq!(holes[0].through, None);
    }
}

#[test]
fn ends_of_a_pipe_are_no_holes() {
    assert_eq!(
        holes(&rings(&[[0.01, 0.05], [0.01, 0.0]], 48))
            .iter()
            .filter(|hole| hole.depth.is_none())
            .count(),
        0
    );
    assert_eq!(
        holes(&rings(&[[0.01, 0.0], [0.01, 0.05]], 48))
            .iter()
            .filter(|hole| hole.depth.is_none())
            .count(),
        0
    );
}

/// A sheet without the faces within a blob about its middle, whose outline `radius` gives by the
/// angle, m.
fn torn(radius: impl Fn(f64) -> f64) -> TriMesh {
    let sheet = grid(60, 1e-3, |x, y| 2e-3 * (x * 40.0).sin() * (y * 40.0).cos());
    let is_left = |corners: &[Point3<f64>; 3]| {
        corners
            .iter()
            .all(|p| p.coords.xy().norm() > radius(p.y.atan2(p.x)))
    };
    mesh_of(
        &triangles(&sheet)
            .into_iter()
            .filter(is_left)
            .collect::<Vec<_>>(),
    )
}

#[test]
fn a_ragged_gap_is_no_hole() {
    for seed in 0..20 {
        let mut rng = Pcg64::new(seed, 9);
        let waves: Vec<[f64; 3]> = (2..7)
            .map(|k| {
                [
                    f64::from(k),
                    within(&mut rng, 0.05, 0.15),
                    within(&mut rng, 0.0, TAU),
                ]
            })
            .collect();
        let size = within(&mut rng, 4e-3, 15e-3);
        let mesh = torn(|angle| {
            size * (1.0
                + waves
                    .iter()
                    .map(|[k, a, at]| a * (k * angle + at).cos())
                    .sum::<f64>())
        });
        assert_eq!(holes(&mesh).len(), 0, "seed {seed}");
    }
    // square, oblong, and a slit
    assert_eq!(
        holes(&torn(
            |angle| 8e-3 / angle.cos().abs().max(angle.sin().abs())
        ))
        .len(),
        0
    );
    assert_eq!(
        holes(&torn(|angle| 12e-3 / (1.0 + 0.3 * (2.0 * angle).cos()))).len(),
        0
    );
    assert_eq!(
        holes(&torn(|angle| 1e-3 / angle.sin().abs().max(0.07))).len(),
        0
    );
}

/// A panel with three ragged cut-outs and a cowl, both open, from depth cameras or similar.
#[test]
fn gaps_of_scanned_panels_are_no_holes() {
    let Some(folder) = shared("scans/crs_scans") else {
        return;
    };
    for name in ["swri_part.stl", "part_5.stl"] {
        let mesh = read_mesh(&folder.join(name), Metre).unwrap().mesh;
        assert_eq!(holes(&mesh).len(), 0, "{name}");
    }
}

#[test]
fn missing_faces_are_no_holes() {
    for seed in 0..10 {
        let mut rng = Pcg64::new(seed, 5);
        let sheet = triangles(&grid(40, 1e-3, |x, _| 1e-3 * (x * 60.0).sin()));
        let left: Vec<_> = sheet
            .into_iter()
            .filter(|_| within(&mut rng, 0.0, 1.0) > 0.1)
            .collect();
        assert_eq!(holes(&mesh_of(&left)).len(), 0, "seed {seed}");
    }
}
