//! Slots and pockets: two walls that face each other over a void, by all evidence on them.

mod axis_view;
mod candidates;
mod evidence;
mod slot;
mod void;

use nalgebra::Vector3;

use super::fit::SurfaceModel;
use super::segmentation::primitive::Primitive;
use super::segmentation::scene::SegmentedMesh;
use super::walls::Wall;
use axis_view::AxisView;
use candidates::{axis_of_end, half_round};
use evidence::SegmentEvidence;
use touchup_geometry::numeric::without_repeats;
use void::LONG_BOX;

pub(super) use slot::{Slot, undercut_groups};

/// Directions of axes are the same within 3°.
const SAME_AXIS: f64 = 0.9986;
/// Maximum number of axes.
const MOST_AXES: usize = 16;

/// All slots, and all pockets; of several views of one void the one with the most evidence.
///
/// - `of_face`: the segment of each face, seams included.
/// - `radius`: of the ball, m.
pub(super) fn voids(
    parted: &SegmentedMesh,
    walls: &[Wall],
    of_face: &[u32],
    radius: f64,
) -> (Vec<Slot>, Vec<Slot>) {
    let evidence = SegmentEvidence::of(parted, of_face, radius);
    let ends = half_round(walls, &evidence);
    let known = axes(parted);
    let mut found: Vec<Slot> = Vec::new();
    for &axis in &known {
        found.extend(AxisView::along(axis, &evidence, of_face).beside_walls(&ends));
    }
    for (at, one) in ends.iter().enumerate() {
        let view = AxisView::along(axis_of_end(one, &known), &evidence, of_face);
        let others = ends[..at].iter();
        found.extend(others.filter_map(|other| view.between_ends([one, other])));
    }
    found.sort_by(|one, other| other.area.total_cmp(&one.area));
    let all = without_repeats(found, |one, other| one.holds(other) || other.holds(one));
    all.into_iter()
        .partition(|slot| !slot.is_boxed || slot.length > LONG_BOX * slot.width)
}

/// Directions of possible openings, those of the largest segments first.
fn axes(parted: &SegmentedMesh) -> Vec<Vector3<f64>> {
    let mut area: Vec<(f64, Vector3<f64>)> = Vec::new();
    for number in (0..parted.segmentation.segments.len()).filter(|&at| parted.is_strong(at)) {
        let segment = parted.segment(number);
        let axis = match &segment.primitive {
            Primitive::Plane(plane) => plane.normal(),
            Primitive::Cylinder(cylinder) => cylinder.axis(),
            Primitive::Cone(_) | Primitive::Sphere(_) => continue,
        };
        let same = area
            .iter_mut()
            .find(|(_, other)| other.dot(&axis).abs() > SAME_AXIS);
        match same {
            Some((sum, _)) => *sum += segment.area,
            None => area.push((segment.area, axis)),
        }
    }
    area.sort_by(|a, b| b.0.total_cmp(&a.0));
    area.truncate(MOST_AXES);
    area.into_iter().map(|(_, axis)| axis).collect()
}
