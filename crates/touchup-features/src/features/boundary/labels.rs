//! The surface of each face, with the strips between surfaces divided among them.
//!
//! Beside an edge a scan is blurred: a strip of faces belongs to no segment. Each of its faces goes
//! to the surface nearest to it, of those across a strip no wider than [`StripWidth`]; a strip with
//! one surface beside it, or a wider one, stays without (a morphological closing).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::scale::BoundaryScale;
use super::surfaces::PartSurfaces;
use crate::features::segmentation::facets::{Facets, NONE};
use crate::features::segmentation::scene::SegmentedMesh;
use touchup_geometry::mesh::{FaceId, VertexId};
use touchup_geometry::numeric::flood;

/// Number of surfaces compared at one face: a corner has three.
const CANDIDATES: usize = 4;
/// Weight of the distance along the mesh beside that from the surface.
const ALONG: f64 = 0.2;
/// Cosine of the tolerance of the normal of a face on which a touched surface goes on: 60°, of a
/// rough scan.
const SPREAD_ALIKE: f64 = 0.5;
/// Rounds of smoothing of the borders.
const ROUNDS: usize = 4;

/// Surface of each face, or [`NONE`].
///
pub(super) fn labels(
    parted: &SegmentedMesh,
    surfaces: &PartSurfaces,
    scale: &BoundaryScale,
) -> Vec<u32> {
    let &BoundaryScale {
        near_touched,
        width,
        least_area,
        ..
    } = scale;
    let facets = &parted.facets;
    let surface_of = |&segment: &u32| match surfaces.of_segment.get(segment as usize) {
        Some(Some(surface)) => *surface as u32,
        _ => NONE,
    };
    let mut labels: Vec<u32> = parted.segmentation.of_face.iter().map(surface_of).collect();
    if width > 0.0 {
        spread_touched(facets, surfaces, &mut labels, near_touched);
        for _ in 0..2 {
            drop_small(facets, &mut labels, least_area);
            let strip = none(facets, &labels);
            divide_strips(facets, surfaces, &mut labels, &strip, width);
        }
        drop_small(facets, &mut labels, least_area);
        let holes = pieces(facets, &labels, |label| label == NONE).1;
        let small = holes
            .into_iter()
            .filter(|hole| facets.area_of(hole) < least_area);
        let holes: Vec<u32> = small.flatten().collect();
        divide_strips(facets, surfaces, &mut labels, &holes, f64::MAX);
        clean(facets, &mut labels, least_area);
    }
    labels
}

/// Lets touched surfaces go on over unexplained faces beside them, the nearest first.
///
/// - `near`: maximum distance of a corner of a face from its surface, m.
fn spread_touched(facets: &Facets, surfaces: &PartSurfaces, labels: &mut [u32], near: f64) {
    let is_on = |face: u32, label: u32| {
        let own = &surfaces.all[label as usize];
        let out = own.surface.normal(&facets.mesh.barycentre(FaceId(face)));
        let out = if own.is_outward { out } else { -out };
        let corners = facets.triangle(face).into_iter();
        let mut off = corners.map(|p| own.surface.signed_distance(&p).abs());
        off.all(|off| off <= near) && facets.normal(face).dot(&out) > SPREAD_ALIKE
    };
    let is_touched = |label: u32| label != NONE && surfaces.all[label as usize].is_touched;
    let known = (0..).zip(labels.to_vec());
    let touched = known.filter(|(_, label)| is_touched(*label));
    let touched = touched.map(|(face, label)| queued(0.0, face, label));
    nearest_first(facets, touched, |face, label, distance| {
        let own = &mut labels[face as usize];
        if *own == NONE && is_on(face, label) {
            *own = label;
            return true;
        }
        distance == 0.0
    });
}

/// Faces without a label.
fn none(facets: &Facets, labels: &[u32]) -> Vec<u32> {
    let is_none = |face: &u32| labels[*face as usize] == NONE && facets.area(*face) > 0.0;
    (0..labels.len() as u32).filter(is_none).collect()
}

/// Number of the connected piece of each face with a wanted label, and the faces of each piece.
pub(super) fn pieces(
    facets: &Facets,
    labels: &[u32],
    is_wanted: impl Fn(u32) -> bool,
) -> (Vec<u32>, Vec<Vec<u32>>) {
    let (mut piece_of, mut pieces) = (vec![NONE; labels.len()], Vec::new());
    for face in 0..labels.len() as u32 {
        if !is_wanted(labels[face as usize]) || piece_of[face as usize] != NONE {
            continue;
        }
        let number = pieces.len() as u32;
        piece_of[face as usize] = number;
        let beside = |face: u32| facets.beside(face).map(|(_, other)| other);
        let takes = |other: u32| {
            let is_new =
                labels[other as usize] == labels[face as usize] && piece_of[other as usize] == NONE;
            if is_new {
                piece_of[other as usize] = number;
            }
            is_new
        };
        pieces.push(flood(vec![face], beside, takes));
    }
    (piece_of, pieces)
}

/// Drops pieces of no more than noise, and parts others that touch themselves.
///
/// - `least_area`: of a piece, m²; 0 for a drawing, which stays as it is.
pub(super) fn clean(facets: &Facets, labels: &mut [u32], least_area: f64) {
    if least_area > 0.0 {
        part_pinches(facets, labels);
        drop_small(facets, labels, least_area);
    }
}

fn drop_small(facets: &Facets, labels: &mut [u32], least_area: f64) {
    for piece in pieces(facets, labels, |label| label != NONE).1 {
        if facets.area_of(&piece) < least_area {
            piece.iter().for_each(|&face| labels[face as usize] = NONE);
        }
    }
}

/// Place in a queue by distance, the nearest first; a distance is not negative, so its bits are in
/// its order.
type QueueEntry = Reverse<(u64, u32, u32)>;

fn queued(distance: f64, face: u32, label: u32) -> QueueEntry {
    Reverse((distance.to_bits(), face, label))
}

/// Surfaces beside a face across the strip, the nearest first, each with the distance, m.
type Candidates = [(u32, f64); CANDIDATES];

const UNKNOWN: Candidates = [(NONE, f64::INFINITY); CANDIDATES];

/// - `strip`: faces without a label.
fn divide_strips(
    facets: &Facets,
    surfaces: &PartSurfaces,
    labels: &mut [u32],
    strip: &[u32],
    width: f64,
) {
    let mut place_of = vec![NONE; labels.len()];
    (0..)
        .zip(strip)
        .for_each(|(place, &face)| place_of[face as usize] = place);
    let candidates = candidates(facets, labels, &place_of, strip.len(), width);
    let is_core = |place: usize| candidates[place][0].1 > width / 2.0;
    let core = (0..strip.len()).filter(|&place| is_core(place));
    let core: Vec<u32> = core.map(|place| strip[place]).collect();
    let is_open = opened(facets, &core, &place_of, strip.len(), width / 2.0);
    for (place, &face) in strip.iter().enumerate() {
        if is_open[place] {
            continue;
        }
        let middle = facets.mesh.barycentre(FaceId(face));
        let cost = |&(label, along): &(u32, f64)| {
            let off = surfaces.all[label as usize]
                .surface
                .signed_distance(&middle);
            off.abs() + ALONG * along
        };
        let known = candidates[place].iter().filter(|(label, _)| *label != NONE);
        let nearest = known.min_by(|a, b| cost(a).total_cmp(&cost(b)));
        labels[face as usize] = nearest.map_or(NONE, |(label, _)| *label);
    }
    smooth(facets, labels, strip);
}

fn candidates(
    facets: &Facets,
    labels: &[u32],
    place_of: &[u32],
    count: usize,
    width: f64,
) -> Vec<Candidates> {
    let step = step_between(facets);
    let mut found = vec![UNKNOWN; count];
    let halfway = |face: u32| {
        let beside = facets.beside(face).map(|(_, other)| other);
        let step = &step;
        beside.map(move |other| queued(step(face, other) / 2.0, other, labels[face as usize]))
    };
    let labelled = (0..labels.len() as u32).filter(|&face| labels[face as usize] != NONE);
    nearest_first(
        facets,
        labelled.flat_map(halfway),
        |face, label, distance| {
            let Some(own) = found.get_mut(place_of[face as usize] as usize) else {
                return false;
            };
            let mut places = own.iter_mut();
            let free = places.find(|(known, _)| *known == NONE || *known == label);
            let free = free.filter(|(known, _)| *known == NONE && distance <= width);
            free.map(|free| *free = (label, distance)).is_some()
        },
    );
    found
}

/// Whether each face of the strips is within a distance of a core.
fn opened(facets: &Facets, core: &[u32], place_of: &[u32], count: usize, reach: f64) -> Vec<bool> {
    let mut is_open = vec![false; count];
    let core = core.iter().map(|&face| queued(0.0, face, 0));
    nearest_first(facets, core, |face, _, distance| {
        let own = is_open.get_mut(place_of[face as usize] as usize);
        let own = own.filter(|own| !**own && distance <= reach);
        own.map(|own| *own = true).is_some()
    });
    is_open
}

/// Goes from faces to those beside them, the nearest first, on from each that takes the label.
///
/// - `takes`: of the face, the label and the distance, m.
fn nearest_first(
    facets: &Facets,
    from: impl Iterator<Item = QueueEntry>,
    mut takes: impl FnMut(u32, u32, f64) -> bool,
) {
    let step = step_between(facets);
    let mut queue: BinaryHeap<QueueEntry> = from.collect();
    while let Some(Reverse((bits, face, label))) = queue.pop() {
        let distance = f64::from_bits(bits);
        if takes(face, label, distance) {
            for (_, other) in facets.beside(face) {
                queue.push(queued(distance + step(face, other), other, label));
            }
        }
    }
}

/// Distance between the middles of two faces, m.
fn step_between(facets: &Facets) -> impl Fn(u32, u32) -> f64 {
    |a, b| (facets.mesh.barycentre(FaceId(a)) - facets.mesh.barycentre(FaceId(b))).norm()
}

/// Parts regions that touch themselves at a vertex: of the faces there with one label, the largest
/// group side by side keeps it.
fn part_pinches(facets: &Facets, labels: &mut [u32]) {
    let mesh = facets.mesh;
    for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
        let mut around: Vec<u32> = mesh.star(vertex).iter().map(|face| face.0).collect();
        around.retain(|&face| labels[face as usize] != NONE);
        let mut groups: Vec<Vec<u32>> = Vec::new();
        while let Some(face) = around.pop() {
            let beside = |face: u32| facets.beside(face).map(|(_, other)| other);
            let takes = |other: u32| {
                let at = around.iter().position(|&face| face == other);
                let at = at.filter(|_| labels[other as usize] == labels[face as usize]);
                at.map(|at| around.swap_remove(at)).is_some()
            };
            groups.push(flood(vec![face], beside, takes));
        }
        groups.sort_by_key(|group| Reverse(group.len()));
        let mut kept = Vec::new();
        for group in groups {
            let label = labels[group[0] as usize];
            if kept.contains(&label) {
                group.iter().for_each(|&face| labels[face as usize] = NONE);
            }
            kept.push(label);
        }
    }
}

/// Faces of strips with one label on two sides take it.
fn smooth(facets: &Facets, labels: &mut [u32], strip: &[u32]) {
    for _ in 0..ROUNDS {
        for &face in strip {
            let [a, b, c] = facets.beside[face as usize].map(|other| match other {
                NONE => NONE,
                other => labels[other as usize],
            });
            let most = if a == b || a == c { a } else { b };
            let is_most =
                most != NONE && [a, b, c].iter().filter(|&&label| label == most).count() > 1;
            if is_most && labels[face as usize] != NONE {
                labels[face as usize] = most;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::boundary::surfaces::PartSurface;
    use nalgebra::{Point3, Vector3};
    use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};
    use touchup_geometry::mesh::TriMesh;

    /// Squares of 8 by 8, 1 mm wide, with the heights of their corners in mm.
    fn field(height: impl Fn(u32, u32) -> f64) -> TriMesh {
        let place = |at: u32| {
            let (x, y) = (at % 9, at / 9);
            Point3::new(f64::from(x), f64::from(y), height(x, y)) * 1e-3
        };
        let faces = (0..64).flat_map(|at| {
            let a = 9 * (at / 8) + at % 8;
            [[a, a + 1, a + 10], [a, a + 10, a + 9]]
        });
        TriMesh::new((0..81).map(place).collect(), faces.collect()).unwrap()
    }

    fn floor() -> PartSurfaces {
        let surface = AnalyticSurface::along(Point3::origin(), Vector3::z(), SurfaceShape::Plane);
        let floor = PartSurface {
            surface,
            is_outward: true,
            is_touched: true,
            uncertainties: Vec::new(),
            tolerance: 1e-5,
        };
        PartSurfaces {
            all: vec![floor],
            of_segment: Vec::new(),
        }
    }

    /// Waves of 0.2 mm lie within 0.25 mm; of the columns from 5 on, 1 mm higher, no corner does.
    #[test]
    fn a_touched_surface_goes_on_over_waves_up_to_a_step() {
        let mesh = field(|x, y| 0.2 * f64::from((x + y) % 2) + f64::from(u8::from(x > 4)));
        let mut labels = vec![NONE; 128];
        labels[64] = 0;
        spread_touched(&Facets::of(&mesh), &floor(), &mut labels, 0.25e-3);
        for (face, label) in (0..).zip(labels) {
            let is_low = face / 2 % 8 < 4;
            assert_eq!(label, if is_low { 0 } else { NONE }, "{face}");
        }
    }

    /// Two squares that share a corner: one of them keeps the faces there.
    #[test]
    fn a_region_does_not_touch_itself_at_a_vertex() {
        let mesh = field(|_, _| 0.0);
        let mut labels = vec![NONE; 128];
        // columns and rows 2 and 3, then 4 and 5
        for square in [18, 19, 26, 27, 36, 37, 44, 45] {
            (labels[2 * square], labels[2 * square + 1]) = (0, 0);
        }
        part_pinches(&Facets::of(&mesh), &mut labels);
        let corner = VertexId(9 * 4 + 4);
        let star = mesh.star(corner).iter();
        let kept = star.filter(|face| labels[face.0 as usize] == 0);
        assert_eq!(kept.count(), 2);
        assert_eq!(labels.iter().filter(|label| **label == 0).count(), 14);
    }
}
