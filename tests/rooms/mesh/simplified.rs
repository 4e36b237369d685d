//! Simplified meshes against closed forms, and the transfer of motion to the original.

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3, vector};
use touchup::mesh::{SimplifiedMesh, TriMesh, VertexId};

use crate::common::grid;
use crate::shapes::{icosphere, torus};
use crate::soundness::soundness;

/// V − E + F of a mesh in which every edge has two faces.
fn euler(mesh: &TriMesh) -> i64 {
    let used = (0..mesh.vertex_slots() as u32)
        .filter(|&v| !mesh.star(VertexId(v)).is_empty())
        .count() as i64;
    let faces = mesh.face_count() as i64;
    used - faces * 3 / 2 + faces
}

fn moved(mesh: &TriMesh, place: impl Fn(Point3<f64>) -> Point3<f64>) -> TriMesh {
    let mut moved = mesh.clone();
    for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
        moved.set_position(vertex, place(mesh.position(vertex)));
    }
    moved
}

#[test]
fn a_closed_mesh_stays_closed_and_keeps_its_handles() {
    for (mesh, expected, edge) in [
        (icosphere(10.0, 6), 2, 1.0),
        (icosphere(10.0, 6), 2, 2.5),
        (torus(10.0, 3.0, [400, 130]), 0, 1.2),
    ] {
        let simplified = SimplifiedMesh::new(&mesh, edge).unwrap().mesh;
        let soundness = soundness(&simplified);
        assert_eq!((soundness.rims.len(), euler(&simplified)), (0, expected));
        let faces = simplified.face_count();
        assert!(
            faces * 5 < mesh.face_count(),
            "{faces} of {}",
            mesh.face_count()
        );
    }
}

#[test]
fn edges_are_about_as_long_as_asked_for_and_vertices_lie_on_the_surface() {
    let (radius, edge) = (10.0, 1.0);
    let simplified = SimplifiedMesh::new(&icosphere(radius, 6), edge)
        .unwrap()
        .mesh;
    let mut lengths = Vec::new();
    for (_, [a, b, c]) in simplified.faces() {
        lengths.extend(
            [(a, b), (b, c), (c, a)]
                .map(|(p, q)| (simplified.position(p) - simplified.position(q)).norm()),
        );
    }
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    assert!((mean - edge).abs() < 0.15 * edge, "{mean}");
    // a cap of half an edge is this high
    let sag = edge * edge / (8.0 * radius);
    for p in simplified.positions() {
        assert!(
            (p.coords.norm() - radius).abs() < sag,
            "{}",
            p.coords.norm() - radius
        );
    }
}

#[test]
fn an_edge_of_the_part_stays_sharp() {
    // a roof with a ridge along y, 45 degrees to both sides
    let roof = grid(120, 0.1, |x, _| -x.abs());
    let simplified = SimplifiedMesh::new(&roof, 0.8).unwrap().mesh;
    let inside = |p: &&Point3<f64>| p.x.abs() < 5.0 && p.y.abs() < 5.0;
    for p in simplified.positions().iter().filter(inside) {
        let off = (p.z + p.x.abs()).abs() / 2f64.sqrt();
        assert!(off < 0.02, "{p} is {off} off the roof");
    }
    let at_ridge = simplified
        .positions()
        .iter()
        .filter(inside)
        .filter(|p| p.x.abs() < 0.02)
        .count();
    assert!(at_ridge >= 10, "{at_ridge} vertices on 10 mm of ridge");
}

#[test]
fn the_two_sides_of_a_thin_sheet_stay_apart() {
    let (cells, edge) = (80, 0.1);
    let side = grid(cells, edge, |_, _| 0.0);
    let mut positions = side.positions().to_vec();
    positions.extend(side.positions().iter().map(|p| p + Vector3::z() * -0.15));
    let count = side.vertex_slots() as u32;
    let mut faces: Vec<[u32; 3]> = side
        .faces()
        .map(|(_, corners)| corners.map(|v| v.0))
        .collect();
    faces.extend(
        side.faces()
            .map(|(_, [a, b, c])| [a, c, b].map(|v| v.0 + count)),
    );
    let simplified = SimplifiedMesh::new(&TriMesh::new(positions, faces).unwrap(), 0.8)
        .unwrap()
        .mesh;
    for (face, corners) in simplified.faces() {
        let heights = corners.map(|v| simplified.position(v).z);
        assert!(
            heights.iter().all(|z| (z - heights[0]).abs() < 1e-9),
            "{face:?} joins the sides: {heights:?}"
        );
    }
    let top = simplified
        .faces()
        .filter(|(_, corners)| simplified.position(corners[0]).z > -0.1)
        .count();
    assert!((top as f64 / simplified.face_count() as f64 - 0.5).abs() < 0.05);
}

#[test]
fn the_rim_of_an_open_mesh_stays_where_it_is() {
    let simplified = SimplifiedMesh::new(&grid(100, 0.1, |_, _| 0.0), 0.8)
        .unwrap()
        .mesh;
    let [lo, hi] = simplified.bounds();
    assert!(
        (lo - Point3::new(-5.0, -5.0, 0.0)).norm() < 0.5
            && (hi - Point3::new(5.0, 5.0, 0.0)).norm() < 0.5
    );
    let rims = soundness(&simplified).rims;
    assert!(!rims.is_empty());
    for v in rims.iter().flatten() {
        let p = simplified.position(VertexId(*v));
        let from_rim = (5.0 - p.x.abs()).min(5.0 - p.y.abs());
        assert!(from_rim < 0.3, "{p}");
    }
}

#[test]
fn fine_detail_rides_along_and_what_does_not_move_stays_bit_by_bit() {
    let texture = |x: f64, y: f64| 0.03 * (9.0 * x).sin() * (7.0 * y).cos();
    let scan = grid(120, 0.1, texture);
    let simplified = SimplifiedMesh::new(&scan, 0.8).unwrap();
    assert!(simplified.carry(&scan, &simplified.mesh).positions() == scan.positions());

    let shift = vector![0.3, -0.2, 0.5];
    let shifted = simplified.carry(&scan, &moved(&simplified.mesh, |p| p + shift));
    for (p, q) in scan.positions().iter().zip(shifted.positions()) {
        assert!((q - p - shift).norm() < 1e-12);
    }

    // tilted about an axis in the plane, no vertex at its old place: every one turns with its
    // normal
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4);
    let flat = SimplifiedMesh::new(&grid(120, 0.1, |_, _| 0.0), 0.8).unwrap();
    let turned = flat.carry(&scan, &moved(&flat.mesh, |p| turn * p + shift));
    let expected = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.4);
    for (p, q) in scan.positions().iter().zip(turned.positions()) {
        assert!((q - expected * p - shift).norm() < 1e-9, "{p} went to {q}");
    }

    // one vertex alone: everything beyond its faces stays
    let mut dented = simplified.mesh.clone();
    let middle = (0..dented.vertex_slots() as u32)
        .map(VertexId)
        .min_by(|a, b| {
            dented
                .position(*a)
                .coords
                .norm()
                .total_cmp(&dented.position(*b).coords.norm())
        });
    let (middle, before) = (middle.unwrap(), dented.position(middle.unwrap()));
    dented.set_position(middle, before - Vector3::z() * 0.2);
    let dented = simplified.carry(&scan, &dented);
    let gone = scan
        .positions()
        .iter()
        .zip(dented.positions())
        .filter(|(p, q)| p != q);
    let farthest = gone.map(|(p, _)| (p - before).norm()).fold(0.0, f64::max);
    assert!(farthest > 0.4 && farthest < 2.0, "{farthest}");
}
