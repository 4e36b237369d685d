//! The mesh from outside: closest face against brute force, triangles against exact arithmetic,
//! inside and outside against winding numbers, adjacency against a rebuilt mesh.

mod adjacency;
mod closest;
mod inside;
mod triangles;

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::{FaceId, FaceTree, TriMesh, VertexId, triangle};

use crate::common::{grid, within};

type Triangle = [Point3<f64>; 3];

/// The point of a triangle nearest to `p`: the foot on its plane if that is inside, else the
/// nearest of the feet on its three sides. The code under test uses Voronoi regions instead.
fn nearest(p: &Point3<f64>, t: &Triangle) -> Point3<f64> {
    let (p, t) = (p - t[0], t.map(|x| x - t[0]));
    let on_side = |a: Vector3<f64>, b: Vector3<f64>| {
        let length = (b - a).norm();
        if length == 0.0 {
            a
        } else {
            a + (b - a) * ((p - a).dot(&((b - a) / length)) / length).clamp(0.0, 1.0)
        }
    };
    let mut best = t[0];
    for side in [
        on_side(t[0], t[1]),
        on_side(t[1], t[2]),
        on_side(t[2], t[0]),
    ] {
        if (p - side).norm() < (p - best).norm() {
            best = side;
        }
    }
    let sides = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    if let Some(normal) = t[1].cross(&t[2]).try_normalize(0.0) {
        let foot = p - normal * normal.dot(&p);
        let is_inside = sides
            .iter()
            .all(|(a, b)| normal.dot(&(b - a).cross(&(foot - a))) >= 0.0);
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

/// A mesh of about a unit's size, with a generator for later choices.
fn unit_mesh(kind: Kind, rng: &mut Pcg64) -> TriMesh {
    match kind {
        Kind::Soup => soup(rng, |rng, a| {
            let size = 10f64.powf(within(rng, -3.0, 0.0));
            [a + point(rng) * size, a + point(rng) * size]
        }),
        Kind::Slivers => soup(rng, |rng, a| {
            let along = point(rng);
            let width = if within(rng, 0.0, 1.0) < 0.2 {
                0.0
            } else {
                10f64.powf(within(rng, -12.0, -2.0))
            };
            [
                a + along,
                a + along * within(rng, -0.5, 1.5) + point(rng) * width,
            ]
        }),
        Kind::Ball => ball(12, 20, |direction| direction * within(rng, 0.9, 1.0)),
        Kind::Sheet => grid(12, 1.0 / 6.0, |_, _| within(rng, -0.1, 0.1)),
    }
}

fn point(rng: &mut Pcg64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| within(rng, -1.0, 1.0))
}

fn soup(
    rng: &mut Pcg64,
    others: impl Fn(&mut Pcg64, Vector3<f64>) -> [Vector3<f64>; 2],
) -> TriMesh {
    let count = within(rng, 1.0, 120.0) as u32;
    let positions = (0..count).flat_map(|_| {
        let a = point(rng);
        let [b, c] = others(rng, a);
        [a, b, c].map(Point3::from)
    });
    TriMesh::new(
        positions.collect(),
        (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    )
    .unwrap()
}

/// A closed surface about the origin: `rings` × `sectors` vertices and two poles.
fn ball(rings: u32, sectors: u32, mut place: impl FnMut(Vector3<f64>) -> Vector3<f64>) -> TriMesh {
    let mut positions = vec![];
    let mut put = |up: f64, turn: f64| {
        let across = (1.0 - up * up).max(0.0).sqrt();
        positions.push(Point3::from(place(vector![
            across * turn.cos(),
            across * turn.sin(),
            up
        ])));
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
    TriMesh::new(
        positions,
        mesh.faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect(),
    )
    .unwrap()
}

/// Sizes and places: unchanged, far from the origin (m), and tiny.
const PLACES: [(f64, f64); 4] = [(1.0, 0.0), (1.0, 1e6), (0.1, 10.0), (1e-6, 0.0)];

fn any_mesh() -> impl Strategy<Value = (TriMesh, f64, Vector3<f64>, u64)> {
    let kinds = prop::sample::select(vec![Kind::Soup, Kind::Slivers, Kind::Ball, Kind::Sheet]);
    (kinds, any::<u64>(), prop::sample::select(PLACES.to_vec())).prop_map(
        |(kind, seed, (scale, far))| {
            let shift = vector![far, -0.7 * far, 0.3 * far];
            (
                moved(
                    &unit_mesh(kind, &mut Pcg64::seed_from_u64(seed)),
                    scale,
                    shift,
                ),
                scale,
                shift,
                seed,
            )
        },
    )
}
