//! Cones at the ends of the walls of holes: countersinks, chamfers, tips of drills.
//!
//! A short cone hardly determines its axis, but its hole does: the search therefore starts at the
//! ends of holes.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector2, Vector3};

use super::fit::{Cone, SurfaceModel};
use super::segmentation::facets::NONE;
use super::segmentation::primitive::{Primitive, belongs, refined};
use super::segmentation::scene::SegmentedMesh;
use super::segmentation::segment::Segment;
use super::walls::Wall;
use touchup_geometry::numeric::{distinct, flood, median, tangent_basis};

/// Number of directions that examine the ring beyond an end.
const AROUND: usize = 36;
/// Difference of a ring's radius from the hole's, and its distance beyond the end, as a share of
/// the radius.
const BESIDE: f64 = 0.08;
/// Maximum distance of a face from its ring, in radii.
const NEAR: f64 = 0.15;
/// Sines of the sharpest and of the flattest half angle, 20° and 75°: drills and countersinks have
/// 30° to 70°.
const SINES: [f64; 2] = [0.34, 0.966];
/// Minimum widening of a cone, as a share of the radius.
const LEAST_WIDTH: f64 = 0.1;
/// Minimum share of a cone that faces cover.
const FILLED: f64 = 0.4;
/// Tolerance of the sines around a ring.
const ALIKE: f64 = 0.2;
/// Minimum share of a ring within the tolerance.
const LEAST_SHARE: f64 = 0.5;
/// Maximum distance of corners from a cone, and from its first guess, in radii.
const SLACK: f64 = 0.005;
const FIRST_SLACK: f64 = 0.05;
/// Minimum share of a turn that a cone covers.
const COVERAGE: f64 = 0.6;

/// Adds the cones at both ends of each hole's wall to the segmentation and to the walls.
pub(super) fn add_cones(parted: &mut SegmentedMesh, walls: &mut Vec<Wall>) {
    walls.retain(|wall| !wall.is_cone());
    let holes: Vec<Wall> = walls
        .iter()
        .filter(|wall| wall.is_concave && wall.coverage > COVERAGE)
        .cloned()
        .collect();
    for wall in holes {
        for (end, out) in wall.ends.into_iter().zip([-1.0, 1.0]) {
            let Some(segment) = cone_beyond(parted, &wall, end, out) else {
                continue;
            };
            let number = parted.segmentation.segments.len();
            let cone = Wall::of_faces(
                &parted.facets,
                &segment.primitive,
                &segment.faces,
                vec![number],
            );
            let is_sound = |cone: &Wall| {
                let width = (cone.radius_at(cone.ends[1]) - cone.radius_at(cone.ends[0])).abs();
                cone.coverage > COVERAGE
                    && cone.filled > FILLED
                    && width > LEAST_WIDTH * wall.radius()
            };
            if let Some(cone) = cone.filter(is_sound) {
                walls.push(cone);
                parted.segmentation.add(&parted.facets, segment);
            }
        }
    }
}

fn cone_beyond(parted: &SegmentedMesh, wall: &Wall, end: f64, out: f64) -> Option<Segment> {
    let radius = wall.radius();
    let of_hole = parted.segment(wall.segments[0]);
    let (tolerance, is_exact) = (of_hole.tolerance.max(SLACK * radius), of_hole.is_exact);
    [1.0 + BESIDE, 1.0 - BESIDE].into_iter().find_map(|wider| {
        let faces = ring(parted, wall, end + out * BESIDE * radius, wider * radius);
        let start = cone_of(parted, wall, &faces, out)?;
        let faces = faces_on(parted, faces, &start, tolerance.max(FIRST_SLACK * radius));
        let moved = refined(&start, &parted.facets, &faces).filter(|better| is_along(better, wall));
        // sum of the squares by which corners are off a cone, m²
        let corners = || faces.iter().flat_map(|&face| parted.facets.triangle(face));
        let misfit = |cone: &Primitive| corners().map(|p| cone.distance(&p).powi(2)).sum::<f64>();
        // the fit to a measured mesh is no better than its facets
        let drawn = parted
            .rounding
            .and_then(|_| through_corners(parted, wall, &faces, &start));
        let better = [moved, drawn, Some(start)].into_iter().flatten();
        let better = better.min_by(|a, b| misfit(a).total_cmp(&misfit(b)))?;
        let faces = faces_on(parted, faces, &better, tolerance);
        let area = parted.facets.area_of(&faces);
        (!faces.is_empty()).then_some(Segment {
            primitive: better,
            faces,
            area,
            tolerance,
            is_exact,
            felt: Vec::new(),
        })
    })
}

/// Faces on a ring around the axis, with normals towards it.
fn ring(parted: &SegmentedMesh, wall: &Wall, t: f64, radius: f64) -> Vec<u32> {
    let [e, g] = tangent_basis(&wall.axis);
    let around = parted.around(wall.segments[0]);
    distinct((0..AROUND).filter_map(|i| {
        let (sine, cosine) = (std::f64::consts::TAU * i as f64 / AROUND as f64).sin_cos();
        let radial = e * cosine + g * sine;
        let p = wall.at(t) + radial * radius;
        let face = around.closest(&p, NEAR * wall.radius())?;
        (parted.facets.normal(face).dot(&radial) < -SINES[0]).then_some(face)
    }))
}

/// The cone about the axis of the wall through most faces of a ring.
fn cone_of(parted: &SegmentedMesh, wall: &Wall, faces: &[u32], out: f64) -> Option<Primitive> {
    let along = |face: u32| parted.facets.normal(face).dot(&wall.axis) * out;
    let sine = median(&mut faces.iter().map(|&face| along(face)).collect::<Vec<_>>())?;
    let is_alike = |face: u32| (along(face) - sine).abs() < ALIKE;
    let alike: Vec<u32> = faces
        .iter()
        .copied()
        .filter(|&face| is_alike(face))
        .collect();
    let is_steep = sine.abs() > SINES[0] && sine.abs() < SINES[1];
    if !is_steep || alike.len() as f64 <= LEAST_SHARE * faces.len() as f64 {
        return None;
    }
    let (axis, half_angle) = (wall.axis * (out * sine.signum()), sine.abs().asin());
    let apex_of = |&face: &u32| {
        let v = parted.facets.triangle(face)[0] - wall.origin;
        let t = v.dot(&axis);
        t - (v - axis * t).norm() / half_angle.tan()
    };
    let apex: Point3<f64> =
        wall.origin + axis * median(&mut alike.iter().map(apex_of).collect::<Vec<_>>())?;
    Some(cone_from(apex, &axis, half_angle, wall))
}

/// A hollow cone, by its circle as wide as the wall.
fn cone_from(apex: Point3<f64>, axis: &Vector3<f64>, half_angle: f64, wall: &Wall) -> Primitive {
    let radius = wall.radius();
    Primitive::Cone(Cone::new(
        apex + axis * (radius / half_angle.tan()),
        axis,
        radius,
        half_angle,
        true,
    ))
}

/// The cone about the axis of the wall through the corners of faces: on a coarse cone they are
/// exact, its facets are not.
fn through_corners(
    parted: &SegmentedMesh,
    wall: &Wall,
    faces: &[u32],
    start: &Primitive,
) -> Option<Primitive> {
    let Primitive::Cone(start) = start else {
        return None;
    };
    let axis = start.axis();
    let corners = || {
        faces
            .iter()
            .flat_map(|&face| parted.facets.triangle(face))
            .map(|p| p - wall.origin)
    };
    // radius over height, a straight line
    let place = |v: Vector3<f64>| Vector2::new(v.dot(&axis), (v - axis * v.dot(&axis)).norm());
    let mean = corners().map(place).sum::<Vector2<f64>>() / (3 * faces.len()).max(1) as f64;
    let (mut square, mut product) = (0.0, 0.0);
    for d in corners().map(|v| place(v) - mean) {
        (square, product) = (square + d.x * d.x, product + d.x * d.y);
    }
    let slope = product / square;
    let apex = wall.origin + axis * (mean.x - mean.y / slope);
    let is_cone = slope > 0.0 && apex.coords.iter().all(|x| x.is_finite());
    is_cone.then(|| cone_from(apex, &axis, slope.atan(), wall))
}

/// Whether a cone has the axis of its hole.
fn is_along(cone: &Primitive, wall: &Wall) -> bool {
    let Primitive::Cone(cone) = cone else {
        return false;
    };
    let off = |apex: Point3<f64>| (apex - wall.origin).cross(&wall.axis).norm();
    cone.axis().dot(&wall.axis).abs() > SINES[1]
        && cone
            .apex()
            .is_some_and(|apex| off(apex) < NEAR * wall.radius())
}

/// Faces on the cone, connected with `seeds`, without those of a sphere: a ball-nosed end looks like a
/// cone at its wall.
fn faces_on(
    parted: &SegmentedMesh,
    mut seeds: Vec<u32>,
    cone: &Primitive,
    tolerance: f64,
) -> Vec<u32> {
    let facets = &parted.facets;
    let is_of_sphere = |face: u32| {
        let number = parted.segmentation.of_face[face as usize];
        number != NONE
            && matches!(
                parted.segment(number as usize).primitive,
                Primitive::Sphere(_)
            )
    };
    let is_on = |face: u32| !is_of_sphere(face) && belongs(facets, face, cone, tolerance);
    seeds.retain(|&face| is_on(face));
    let mut seen: BTreeSet<u32> = seeds.iter().copied().collect();
    let is_new = |other| other != NONE && seen.insert(other) && is_on(other);
    flood(seeds, |face| facets.beside[face as usize], is_new)
}
