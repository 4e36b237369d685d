//! Trimmed faces of parts whose faces, edges and corners are counted by hand. Their files are read by another kernel in
//! tests/python/test_step_of_parts.py.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::brep::{Brep, FaceLoop, SurfaceShape};
use touchup::features::detect_boundary;
use touchup::mesh::{TriMesh, repair};
use touchup::sim::Plate;

use crate::shapes::icosphere;

/// Half sizes of a box, m.
const HALF: [f64; 3] = [0.02, 0.015, 0.01];
/// Number of squares along each side of a box.
const SQUARES: u32 = 60;

/// Sides of a box in squares, each corner moved.
fn cuboid(sides: usize, mut place: impl FnMut(Vector3<f64>) -> Vector3<f64>) -> TriMesh {
    let (mut corners, mut faces) = (Vec::new(), Vec::new());
    for side in 0..sides {
        let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        let at = |i: u32, j: u32| {
            let along = |k: u32| 2.0 * f64::from(k) / f64::from(SQUARES) - 1.0;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut p = Vector3::zeros();
            (p[axis], p[u], p[v]) = (sign * HALF[axis], along(i) * HALF[u], along(j) * HALF[v]);
            p
        };
        for (i, j) in (0..SQUARES).flat_map(|i| (0..SQUARES).map(move |j| (i, j))) {
            let square = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for triangle in [[0, 1, 2], [0, 2, 3]] {
                let mut triangle = triangle.map(|k| square[k]);
                if sign < 0.0 {
                    triangle.reverse();
                }
                faces.push([0, 1, 2].map(|k| corners.len() as u32 + k));
                corners.extend(triangle.map(Point3::from));
            }
        }
    }
    let mut mesh = repair(corners, faces).unwrap().0;
    for vertex in 0..mesh.vertex_slots() as u32 {
        let vertex = touchup::mesh::VertexId(vertex);
        let moved = place(mesh.position(vertex).coords);
        mesh.set_position(vertex, moved.into());
    }
    mesh
}

/// The nearest place of a box with round edges.
fn rounded(p: Vector3<f64>, radius: f64) -> Vector3<f64> {
    let inner = Vector3::from_fn(|i, _| p[i].clamp(radius - HALF[i], HALF[i] - radius));
    inner + (p - inner).normalize() * radius
}

fn brep_of(mesh: &TriMesh) -> Brep {
    let (_, boundary) = detect_boundary(mesh, &[]);
    assert_eq!(boundary.left_out, 0);
    boundary.brep.unwrap()
}

fn counts(brep: &Brep) -> [usize; 3] {
    let parts = brep.parts();
    [parts.vertices.len(), parts.edges.len(), parts.faces.len()]
}

/// Largest distance of a corner of the box from the nearest vertex.
fn off_corners(brep: &Brep) -> f64 {
    let corner = |bits: usize| {
        Point3::from(Vector3::from_fn(|i, _| {
            if bits >> i & 1 == 1 {
                HALF[i]
            } else {
                -HALF[i]
            }
        }))
    };
    let nearest = |corner: Point3<f64>| {
        let off = brep.parts().vertices.iter().map(|p| (p - corner).norm());
        off.fold(f64::INFINITY, f64::min)
    };
    (0..8).map(|bits| nearest(corner(bits))).fold(0.0, f64::max)
}

/// Euler: 8 − 12 + 6 = 2.
#[test]
fn a_box_has_its_corners_edges_and_sides() {
    let brep = brep_of(&cuboid(6, |p| p));
    assert_eq!(counts(&brep), [8, 12, 6]);
    assert!(brep.shells().iter().all(|shell| shell.is_closed));
    assert!(off_corners(&brep) < 1e-9);
    assert!(brep.parts().faces.iter().all(|face| !face.is_touched));
}

/// Round edges narrower than half a strip belong to no side (wider ones are cylinders of their own); planes meet in the sharp edges of the box.
#[test]
fn the_blurred_edges_of_a_scan_are_bridged() {
    let mut noise = Pcg64::seed_from_u64(1);
    let mut shaken = |p: Vector3<f64>| {
        rounded(p, 0.0005) + Vector3::from_fn(|_, _| noise.random_range(-1.0..1.0) * 10e-6)
    };
    let brep = brep_of(&cuboid(6, &mut shaken));
    assert_eq!(counts(&brep), [8, 12, 6]);
    assert!(brep.shells().iter().all(|shell| shell.is_closed));
    // the mean of thousands of vertices; corners add three planes, tilted by much less
    assert!(off_corners(&brep) < 10e-6, "{}", off_corners(&brep));
}

/// Without one side four edges have one face.
#[test]
fn a_side_that_is_not_there_leaves_an_open_shell() {
    let brep = brep_of(&cuboid(5, |p| p));
    assert_eq!(brep.parts().faces.len(), 5);
    let shells: Vec<_> = brep.shells().iter().map(|shell| shell.is_closed).collect();
    assert_eq!(shells, [false]);
    let uses = |edge: usize| {
        let loops = brep.parts().faces.iter().flat_map(|face| &face.loops);
        let edges = loops.flat_map(|one| match one {
            FaceLoop::Edges(edges) => edges.clone(),
            FaceLoop::Vertex(_) => Vec::new(),
        });
        edges.filter(|one| one.edge == edge).count()
    };
    let open = (0..brep.parts().edges.len()).filter(|&edge| uses(edge) == 1);
    assert_eq!(open.count(), 4);
    assert!(off_corners(&brep) < 1e-9);
}

/// 6 sides, the step's 2, the floors of hole and slot, 2 walls of the slot, and the top of the boss; walls of 2 holes, the boss and 2 ends.
#[test]
fn the_drawn_plate_is_closed() {
    let brep = brep_of(&Plate::default().mesh(10e-6).unwrap());
    let is_plane = |face: &&touchup::brep::BrepFace| face.surface.shape == SurfaceShape::Plane;
    let planes = brep.parts().faces.iter().filter(is_plane).count();
    assert_eq!([planes, brep.parts().faces.len()], [13, 18]);
    assert_eq!(brep.shells().len(), 1);
    assert!(brep.shells()[0].is_closed);
}

#[test]
fn a_surface_that_nothing_explains_has_no_face() {
    let mut noise = Pcg64::seed_from_u64(2);
    let ball = icosphere(0.02, 4);
    let mut rough = ball.clone();
    for vertex in 0..ball.vertex_slots() as u32 {
        let vertex = touchup::mesh::VertexId(vertex);
        let by = Vector3::from_fn(|_, _| noise.random_range(-1.0..1.0) * 3e-4);
        rough.set_position(vertex, ball.position(vertex) + by);
    }
    let (_, boundary) = detect_boundary(&rough, &[]);
    assert_eq!(boundary.brep, None);
}
