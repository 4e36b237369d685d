//! Whether a mesh is one closed skin: edges, rims, intersections; by other methods than the code
//! that made it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use touchup::mesh::{FaceId, TriMesh};

/// Connection of the faces of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Soundness {
    /// edges with one face, as ordered pairs of vertices
    pub rims: BTreeSet<[u32; 2]>,
    /// edges with more than two faces, or two that run along it in the same direction
    pub bad_edges: usize,
    /// vertices around which the faces form more than one fan
    pub bad_vertices: usize,
    /// V − E + F of the used vertices
    pub euler: i64,
}

/// Counts edges and fans.
pub fn soundness(mesh: &TriMesh) -> Soundness {
    let mut edges: BTreeMap<[u32; 2], Vec<bool>> = BTreeMap::new();
    let mut links: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for (_, corners) in mesh.faces() {
        let c = corners.map(|v| v.0);
        for i in 0..3 {
            let (a, b) = (c[i], c[(i + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(a < b);
            links.entry(c[i]).or_default().push([b, c[(i + 2) % 3]]);
        }
    }
    let bad = |directions: &&Vec<bool>| {
        directions.len() > 2 || (directions.len() == 2 && directions[0] == directions[1])
    };
    Soundness {
        rims: edges
            .iter()
            .filter(|(_, d)| d.len() == 1)
            .map(|(edge, _)| *edge)
            .collect(),
        bad_edges: edges.values().filter(bad).count(),
        bad_vertices: links.values().filter(|link| fans(link) != 1).count(),
        euler: links.len() as i64 - edges.len() as i64 + mesh.face_count() as i64,
    }
}

/// Connected parts of the edges around one vertex.
fn fans(link: &[[u32; 2]]) -> usize {
    let mut parts: Vec<BTreeSet<u32>> = Vec::new();
    for ends in link {
        let (mut joined, apart): (Vec<_>, Vec<_>) = parts
            .into_iter()
            .partition(|part: &BTreeSet<u32>| ends.iter().any(|end| part.contains(end)));
        let mut part: BTreeSet<u32> = joined.drain(..).flatten().collect();
        part.extend(ends);
        parts = apart;
        parts.push(part);
    }
    parts.len()
}

/// Length of the rims, m.
pub fn rim_length(mesh: &TriMesh, rims: &BTreeSet<[u32; 2]>) -> f64 {
    let p = mesh.positions();
    rims.iter()
        .map(|[a, b]| (p[*a as usize] - p[*b as usize]).norm())
        .sum()
}

/// Six times the volume of a tetrahedron.
fn volume(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>) -> f64 {
    (b - a).dot(&(c - a).cross(&(d - a)))
}

/// Whether a segment passes through the inside of a triangle; volumes below `slack` count as
/// touching only.
fn pierces(p: &Point3<f64>, q: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3], slack: f64) -> bool {
    let (below, above) = (volume(p, a, b, c), volume(q, a, b, c));
    if below.min(above) > -slack || below.max(above) < slack {
        return false;
    }
    let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    turns.iter().all(|&x| x > slack) || turns.iter().all(|&x| x < -slack)
}

/// Whether two faces meet elsewhere than at their common vertices, or lie on each other at a common
/// edge.
fn meet(mesh: &TriMesh, f: FaceId, g: FaceId, slack: f64) -> bool {
    let (cf, cg) = (mesh.corners(f), mesh.corners(g));
    let (tf, tg) = (mesh.triangle(f), mesh.triangle(g));
    let common: Vec<usize> = (0..3).filter(|&i| cg.contains(&cf[i])).collect();
    match common.len() {
        0 => (0..3).any(|i| {
            pierces(&tf[i], &tf[(i + 1) % 3], &tg, slack)
                || pierces(&tg[i], &tg[(i + 1) % 3], &tf, slack)
        }),
        1 => {
            let i = common[0];
            let j = (0..3).find(|&j| cg[j] == cf[i]).unwrap();
            pierces(&tf[(i + 1) % 3], &tf[(i + 2) % 3], &tg, slack)
                || pierces(&tg[(j + 1) % 3], &tg[(j + 2) % 3], &tf, slack)
        }
        2 => {
            let i = (0..3).find(|i| !common.contains(i)).unwrap();
            let j = (0..3).find(|&j| !cf.contains(&cg[j])).unwrap();
            let along = (tf[(i + 2) % 3] - tf[(i + 1) % 3]).normalize();
            let away = |p: Vector3<f64>| (p - along * along.dot(&p)).normalize();
            away(tf[i] - tf[(i + 1) % 3]).dot(&away(tg[j] - tf[(i + 1) % 3])) > 1.0 - 1e-12
        }
        _ => true,
    }
}

/// Pairs of faces that intersect each other, among pairs in which `is_watched` holds for one.
///
/// The search sweeps boxes along x; the test is exact up to volumes of 10⁻¹² of the cube of `size`
/// (m).
pub fn intersections(
    mesh: &TriMesh,
    size: f64,
    is_watched: impl Fn(FaceId) -> bool,
) -> Vec<[FaceId; 2]> {
    let slack = 1e-12 * size.powi(3);
    let mut boxes: Vec<(FaceId, Vector3<f64>, Vector3<f64>, bool)> = mesh
        .faces()
        .map(|(face, _)| {
            let [a, b, c] = mesh.triangle(face).map(|p| p.coords);
            (face, a.inf(&b).inf(&c), a.sup(&b).sup(&c), is_watched(face))
        })
        .collect();
    boxes.sort_by(|a, b| a.1.x.total_cmp(&b.1.x));
    let mut found = Vec::new();
    for (i, (f, lo, hi, watched)) in boxes.iter().enumerate() {
        for (g, other_lo, other_hi, other_watched) in
            boxes[i + 1..].iter().take_while(|other| other.1.x <= hi.x)
        {
            let apart = (1..3).any(|k| other_lo[k] > hi[k] || lo[k] > other_hi[k]);
            if !apart && (*watched || *other_watched) && meet(mesh, *f, *g, slack) {
                found.push([*f, *g]);
            }
        }
    }
    found
}
