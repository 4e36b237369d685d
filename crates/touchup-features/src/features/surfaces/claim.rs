//! Faces of the mesh on touched surfaces.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::touched_surface::TouchedSurface;
use crate::features::fit::{Cylinder, SurfaceModel};
use crate::features::segmentation::primitive::{Primitive, belongs};
use crate::features::segmentation::scene::SegmentedMesh;
use crate::features::segmentation::segment::Segment;
use touchup_geometry::mesh::{BoxQuery, FaceId, PointTree, Region};
use touchup_geometry::numeric::distinct;

/// Maximum distance of a face from a contact on its surface, and of its corners from that, in radii
/// of the ball.
const REACH: f64 = 1.0;
pub(in crate::features) const BESIDE_CONTACTS: f64 = 0.25;
/// Tolerance of a touched surface, in radii of the ball.
const TOLERANCE: f64 = 0.05;
/// Mesh beside a touched bore has its radius and its axis within a share of the radius, at most
/// within one of the ball's, and its direction within 25°.
const SAME_RADIUS: f64 = 0.15;
const SAME_OF_BALL: f64 = 0.35;
const SAME_DIRECTION: f64 = 0.906;

/// Gives the faces beside contacts to the surfaces of these.
///
/// - `radius`: of the ball, m.
pub(in crate::features) fn claim(
    parted: &mut SegmentedMesh,
    surfaces: &[TouchedSurface],
    radius: f64,
) {
    let mut faces = vec![Vec::new(); surfaces.len()];
    for (face, (_, number)) in nearest(parted, surfaces, radius) {
        faces[number].push(face);
    }
    for (surface, mut faces) in surfaces.iter().zip(faces) {
        if let Primitive::Cylinder(cylinder) = &surface.primitive {
            faces.extend(faces_of_same(parted, cylinder, surface, radius));
            faces = distinct(faces);
        }
        let segment = Segment {
            primitive: surface.primitive,
            area: parted.facets.area_of(&faces),
            faces,
            tolerance: TOLERANCE * radius,
            is_exact: false,
            felt: surface.felt.clone(),
        };
        parted.segmentation.add(&parted.facets, segment);
    }
}

/// Faces beside contacts, each with the distance, m, of the nearest one whose surface it is on, and
/// the number of that.
fn nearest(
    parted: &SegmentedMesh,
    surfaces: &[TouchedSurface],
    radius: f64,
) -> BTreeMap<u32, (f64, usize)> {
    let mut nearest: BTreeMap<u32, (f64, usize)> = BTreeMap::new();
    let mut query = BoxQuery::default();
    let (reach, beside) = (REACH * radius, BESIDE_CONTACTS * radius);
    for (number, surface) in surfaces.iter().enumerate() {
        let places: Vec<Point3<f64>> = surface.felt.iter().map(|felt| felt.place).collect();
        let Some(around) = Region::around(&places) else {
            continue;
        };
        let (around, contacts) = (around.grown(reach), PointTree::new(&places));
        parted
            .tree
            .faces_in_box(&around.low, &around.high, &mut query);
        for &FaceId(face) in &query.faces {
            if !belongs(&parted.facets, face, &surface.primitive, beside) {
                continue;
            }
            let middle = parted.facets.mesh.barycentre(FaceId(face));
            let known = nearest.get(&face).map_or(reach, |known| known.0);
            if let Some((_, distance)) = contacts.nearest(&middle, 1, known).next() {
                nearest.insert(face, (distance, number));
            }
        }
    }
    nearest
}

/// Faces of round segments of the mesh that go on beside a touched one.
fn faces_of_same(
    parted: &SegmentedMesh,
    found: &Cylinder,
    surface: &TouchedSurface,
    of_ball: f64,
) -> Vec<u32> {
    let near = (SAME_RADIUS * found.radius).min(SAME_OF_BALL * of_ball);
    let (axis, centre) = (found.axis(), found.center());
    let height = |p: Point3<f64>| (p - centre).dot(&axis);
    let span = |heights: &mut dyn Iterator<Item = f64>| {
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| {
            [low.min(t), high.max(t)]
        })
    };
    let ends = span(&mut surface.felt.iter().map(|felt| height(felt.place)));
    let is_same = |segment: &&Segment| {
        let Primitive::Cylinder(other) = segment.primitive else {
            return false;
        };
        let aside = (other.center() - centre).cross(&axis).norm();
        let corners = segment
            .faces
            .iter()
            .flat_map(|&face| parted.facets.triangle(face));
        let [low, high] = span(&mut corners.map(height));
        other.concave == found.concave
            && (other.radius - found.radius).abs() < near
            && aside < near
            && other.axis().dot(&axis).abs() > SAME_DIRECTION
            && low < ends[1] + found.radius
            && high > ends[0] - found.radius
    };
    let segments = parted.segmentation.segments.iter().filter(is_same);
    segments
        .flat_map(|segment| segment.faces.iter().copied())
        .collect()
}
