//! Closed meshes of known curvature.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use touchup::mesh::TriMesh;

#[path = "subdivided.rs"]
mod subdivided;
pub use subdivided::subdivided;

/// The icosahedron with its edges halved `halvings` times, on a sphere.
pub fn icosphere(radius: f64, halvings: u32) -> TriMesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let corners = (0..12).map(|i| {
        let (a, b) = (
            if i & 1 == 0 { 1.0 } else { -1.0 },
            if i & 2 == 0 { golden } else { -golden },
        );
        let p = [[0.0, a, b], [a, b, 0.0], [b, 0.0, a]][i / 4];
        Point3::from(Vector3::from(p).normalize() * radius)
    });
    let positions: Vec<_> = corners.collect();
    // its faces are the triples of corners at the shortest distance
    let edge = 1.1
        * (positions[0] - positions[2])
            .norm()
            .min((positions[0] - positions[1]).norm());
    let near = |a: usize, b: usize| (positions[a] - positions[b]).norm() < edge;
    let mut faces = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c))))
    {
        if near(a, b) && near(b, c) && near(c, a) {
            let [p, q, r] = [a, b, c].map(|i| positions[i].coords);
            let outward = (q - p).cross(&(r - p)).dot(&p) > 0.0;
            faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
        }
    }
    let on_sphere = |p: Point3<f64>| Point3::from(p.coords.normalize() * radius);
    (0..halvings).fold(TriMesh::new(positions, faces).unwrap(), |mesh, _| {
        subdivided(&mesh, on_sphere)
    })
}

/// The torus about z: `around` × `across` squares of two triangles.
pub fn torus(radius: f64, tube: f64, [around, across]: [u32; 2]) -> TriMesh {
    let positions = (0..around * across).map(|i| {
        let (u, v) = (
            TAU * f64::from(i / across) / f64::from(around),
            TAU * f64::from(i % across) / f64::from(across),
        );
        let rho = radius + tube * v.cos();
        Point3::new(rho * u.cos(), rho * u.sin(), tube * v.sin())
    });
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    let faces = (0..around).flat_map(|i| {
        (0..across).flat_map(move |j| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
    });
    TriMesh::new(positions.collect(), faces.collect()).unwrap()
}

/// A tube or a solid of revolution about z: `outline` in (radius, z), `sides` facets.
pub fn revolved(outline: &[(f64, f64)], sides: u32) -> TriMesh {
    let rows = outline.len() as u32;
    let positions = (0..sides)
        .flat_map(|i| {
            let angle = TAU * f64::from(i) / f64::from(sides);
            outline
                .iter()
                .map(move |&(r, z)| Point3::new(r * angle.cos(), r * angle.sin(), z))
        })
        .collect();
    let id = |i: u32, row: u32| i % sides * rows + row;
    let faces = (0..sides).flat_map(|i| {
        (1..rows).flat_map(move |row| {
            let [a, b, c, d] = [
                id(i, row - 1),
                id(i + 1, row - 1),
                id(i + 1, row),
                id(i, row),
            ];
            [[a, b, c], [a, c, d]]
        })
    });
    touchup::mesh::repair(positions, faces.collect()).unwrap().0
}
