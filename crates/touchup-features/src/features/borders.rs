//! Straight edges between planes.
//!
//! Between two planes of a measured mesh there is often a seam of faces that belong to neither.
//! Each segment first grows over the surrounding faces without a strong segment; an edge lies along
//! the border of the grown segments near the intersection of both planes.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::fit::Plane;
use super::segmentation::facets::NONE;
use super::segmentation::primitive::Primitive;
use super::segmentation::scene::SegmentedMesh;
use touchup_geometry::numeric::distinct;

/// A straight edge between two planes.
#[derive(Clone, Debug)]
pub(super) struct StraightEdge {
    /// numbers of the planes, the smaller first
    pub planes: [usize; 2],
    /// its ends, m, in O
    pub ends: [Point3<f64>; 2],
    /// whether the material is inside of it
    pub is_convex: bool,
}

/// Maximum width of a seam on each side, faces.
const SEAM: usize = 3;
/// Sine of the minimum angle between planes of an edge: 15°.
const SHARP: f64 = 0.26;
/// Maximum distance of a border from the edge, in tolerances of the planes, or in median edges.
const NEAR_TOLERANCES: f64 = 4.0;
const NEAR_EDGES: f64 = 1.5;
/// Maximum gap between pieces of one edge, in median edges.
const GAP_EDGES: f64 = 3.0;
/// The same, in diagonals of the mesh.
const GAP: f64 = 0.005;
/// Minimum length of an edge, in diagonals.
const SHORTEST: f64 = 0.02;

/// The segment of each face, with the faces of the seams.
pub(super) fn without_seams(parted: &SegmentedMesh) -> Vec<u32> {
    let is_strong: Vec<bool> = (0..parted.segmentation.segments.len())
        .map(|number| parted.is_strong(number))
        .collect();
    let label = |&number: &u32| {
        if number != NONE && is_strong[number as usize] {
            number
        } else {
            NONE
        }
    };
    let mut of_face: Vec<u32> = parted.segmentation.of_face.iter().map(label).collect();
    let without = (0..of_face.len() as u32).filter(|&face| of_face[face as usize] == NONE);
    let beside = without
        .flat_map(|face| parted.facets.beside(face))
        .map(|(_, other)| other);
    let mut front = distinct(beside.filter(|&face| of_face[face as usize] != NONE));
    for _ in 0..SEAM {
        let mut next = Vec::new();
        for face in front {
            for (_, other) in parted.facets.beside(face) {
                if of_face[other as usize] == NONE {
                    of_face[other as usize] = of_face[face as usize];
                    next.push(other);
                }
            }
        }
        front = next;
    }
    of_face
}

/// A mesh edge between two segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Border {
    /// m, in O
    pub ends: [Point3<f64>; 2],
    /// the faces beside it, in the order of the segments
    pub faces: [u32; 2],
}

/// The mesh edges between each two segments, the smaller number first.
pub(super) type Borders = BTreeMap<[u32; 2], Vec<Border>>;

pub(super) fn borders(parted: &SegmentedMesh, of_face: &[u32]) -> Borders {
    let mut borders = Borders::new();
    for face in 0..of_face.len() as u32 {
        let label = of_face[face as usize];
        for (edge, other) in parted.facets.beside(face) {
            let beside = of_face[other as usize];
            if beside != NONE && label < beside {
                let border = Border {
                    ends: parted.facets.edge(face, edge),
                    faces: [face, other],
                };
                borders.entry([label, beside]).or_default().push(border);
            }
        }
    }
    borders
}

/// All straight edges, in order of their planes.
pub(super) fn straight_edges(parted: &SegmentedMesh, borders: &Borders) -> Vec<StraightEdge> {
    borders
        .iter()
        .flat_map(|(&[i, j], border)| edges_between(parted, [i as usize, j as usize], border))
        .collect()
}

fn edges_between(
    parted: &SegmentedMesh,
    planes: [usize; 2],
    border: &[Border],
) -> Vec<StraightEdge> {
    let segments = planes.map(|number| parted.segment(number));
    let Some((one, other)) = parted.plane(planes[0]).zip(parted.plane(planes[1])) else {
        return Vec::new();
    };
    let Some(direction) = one.normal().cross(&other.normal()).try_normalize(SHARP) else {
        return Vec::new();
    };
    let origin = on_both([one, other], &border[0].ends[0]);
    let tolerance = segments[0].tolerance.max(segments[1].tolerance);
    let near =
        (NEAR_TOLERANCES * tolerance).max(NEAR_EDGES * parted.edge.min(GAP * parted.diagonal));
    let is_near = |x: &Point3<f64>| {
        let v = x - origin;
        (v - direction * v.dot(&direction)).norm() < near
    };
    let mut pieces: Vec<[f64; 2]> = border
        .iter()
        .filter(|border| border.ends.iter().all(is_near))
        .map(|border| border.ends.map(|x| (x - origin).dot(&direction)))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    pieces.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let gap = (GAP_EDGES * parted.edge)
        .min(GAP * parted.diagonal)
        .max(near);
    let mut joint: Vec<[f64; 2]> = Vec::new();
    for piece in pieces {
        match joint.last_mut() {
            Some(last) if piece[0] - last[1] <= gap => last[1] = last[1].max(piece[1]),
            _ => joint.push(piece),
        }
    }
    let is_convex = is_convex(parted, border, planes);
    joint
        .into_iter()
        .filter(|[a, b]| b - a > SHORTEST * parted.diagonal)
        .map(|ends| StraightEdge {
            planes,
            ends: ends.map(|t| origin + direction * t),
            is_convex,
        })
        .collect()
}

/// Whether each of two segments falls away from the other at their border.
pub(super) fn is_convex(parted: &SegmentedMesh, border: &[Border], numbers: [usize; 2]) -> bool {
    let surfaces = numbers.map(|number| &parted.segment(number).primitive);
    let height = |face: u32, surface: &Primitive| {
        parted
            .facets
            .triangle(face)
            .map(|x| surface.distance(&x))
            .iter()
            .sum::<f64>()
    };
    let along = |border: &Border| (border.ends[1] - border.ends[0]).norm();
    let above =
        |b: &Border| (height(b.faces[1], surfaces[0]) + height(b.faces[0], surfaces[1])) * along(b);
    border.iter().map(above).sum::<f64>() < 0.0
}

/// The point on both planes closest to `near`.
pub(super) fn on_both(planes: [&Plane; 2], near: &Point3<f64>) -> Point3<f64> {
    let ([p, q], [n, m]) = (planes.map(Plane::point), planes.map(Plane::normal));
    let (a, b, c) = ((p - near).dot(&n), (q - near).dot(&m), n.dot(&m));
    let square = 1.0 - c * c;
    near + n * ((a - c * b) / square) + m * ((b - c * a) / square)
}
