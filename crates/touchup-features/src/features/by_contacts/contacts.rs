//! Contacts as evidence of walls: thinning, connected groups, and projection along possible axes of
//! walls.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::features::fit::SurfaceModel;
use crate::features::segmentation::scene::SegmentedMesh;
use touchup_geometry::numeric::{
    DisjointSets, PointGrid, VoxelKey, spreads, thinnest_direction, voxel_of,
};
use touchup_method::stylus::ProbedPoint;

/// Cell size of thinning, as a share of the ball's radius: one contact is enough.
const THIN: f64 = 0.25;
/// Maximum distance of a contact from its plane, in standard deviations, or as a share of the
/// radius.
const ON_PLANE_SIGMAS: f64 = 4.0;
const ON_PLANE: f64 = 0.06;
/// Cosine of the tolerance of its normal: 25°.
pub(in crate::features) const ALIKE: f64 = 0.906;
/// Maximum distance of connected contacts, in radii of the ball.
pub(in crate::features) const TOGETHER: f64 = 1.6;
/// A wall's contacts are square to its axis within 20°: friction and noise.
pub(in crate::features) const SQUARE: f64 = 0.34;
/// Directions of axes are the same within 3°.
const SAME_AXIS: f64 = 0.9986;
/// Maximum number of axes, the largest planes first.
const MOST_AXES: usize = 12;
/// Minimum number of contacts on a wall.
pub(in crate::features) const LEAST: usize = 12;

/// A contact seen along an axis.
pub(in crate::features) struct ProjectedContact {
    pub touch: usize,
    /// centre of the ball, m
    pub at: Point2<f64>,
    /// unit normal into the air
    pub normal: Vector2<f64>,
}

/// Contacts seen along an axis.
///
/// - `plane`: two directions square to the axis
pub(in crate::features) fn projected(
    touches: &[ProbedPoint],
    members: &[usize],
    [e, g]: [Vector3<f64>; 2],
) -> Vec<ProjectedContact> {
    let project = |&touch: &usize| {
        let (p, n) = (touches[touch].centre.coords, touches[touch].normal);
        let normal = Vector2::new(n.dot(&e), n.dot(&g)).try_normalize(0.0)?;
        Some(ProjectedContact {
            touch,
            at: Point2::new(p.dot(&e), p.dot(&g)),
            normal,
        })
    };
    members.iter().filter_map(project).collect()
}

/// Thinned contacts: one per cell.
pub(in crate::features) fn thinned(touches: &[ProbedPoint]) -> Vec<usize> {
    let mut seen = BTreeSet::<VoxelKey>::new();
    let mut is_new = |touch: &ProbedPoint| seen.insert(voxel_of(&touch.point, THIN * touch.radius));
    let is_sound = |touch: &ProbedPoint| !touch.is_rejected && touch.radius > 0.0;
    (0..touches.len())
        .filter(|&at| is_sound(&touches[at]) && is_new(&touches[at]))
        .collect()
}

/// Numbers of the planes under possible holes, the largest first.
pub(in crate::features) fn large_planes(parted: &SegmentedMesh) -> Vec<usize> {
    let mut numbers: Vec<usize> = parted
        .planes()
        .map(|(number, ..)| number)
        .filter(|&number| parted.is_strong(number))
        .collect();
    numbers.sort_by(|&a, &b| parted.segment(b).area.total_cmp(&parted.segment(a).area));
    numbers
}

/// Whether a contact is on the plane of a segment.
pub(in crate::features) fn is_on(
    parted: &SegmentedMesh,
    number: usize,
    touch: &ProbedPoint,
) -> bool {
    let Some(plane) = parted.plane(number) else {
        return false;
    };
    let near = (ON_PLANE_SIGMAS * touch.sigma_along_normal()).max(ON_PLANE * touch.radius);
    (plane.distance(&touch.centre) - touch.radius).abs() < near
        && plane.normal().dot(&touch.normal) > ALIKE
}

/// Candidate directions of axes.
pub(in crate::features) fn axes(
    parted: &SegmentedMesh,
    planes: &[usize],
    touches: &[ProbedPoint],
    free: &[usize],
    radius: f64,
) -> Vec<Vector3<f64>> {
    let mut axes: Vec<Vector3<f64>> = Vec::new();
    let mut add = |axis: Vector3<f64>| {
        if axes.len() < MOST_AXES
            && axes
                .iter()
                .all(|other: &Vector3<f64>| other.dot(&axis).abs() < SAME_AXIS)
        {
            axes.push(axis);
        }
    };
    planes
        .iter()
        .filter_map(|&number| parted.plane(number))
        .for_each(|plane| add(plane.normal()));
    // the normals of a round wall are square to its axis
    for members in together(touches, free, TOGETHER * radius) {
        let normals = members.iter().map(|&at| touches[at].normal);
        let [least, second, _] = spreads(normals.clone());
        if members.len() >= LEAST && least < 0.5 * second {
            add(thinnest_direction(normals.map(|n| n * n.transpose()).sum()));
        }
    }
    axes
}

/// Groups of connected contacts: no farther apart than `reach`, m.
pub(in crate::features) fn together(
    touches: &[ProbedPoint],
    numbers: &[usize],
    reach: f64,
) -> Vec<Vec<usize>> {
    hanging(numbers, |at| touches[at].point, reach, |_, _| true)
}

/// Groups of connected contacts of walls along an axis, in the view along it: one wall, touched
/// from above, below or both. Direct neighbours have like normals.
pub(in crate::features) fn together_along(
    touches: &[ProbedPoint],
    numbers: &[usize],
    axis: &Vector3<f64>,
    reach: f64,
) -> Vec<Vec<usize>> {
    let seen = |at: usize| touches[at].point - axis * touches[at].point.coords.dot(axis);
    hanging(numbers, seen, reach, |one, other| {
        touches[one].normal.dot(&touches[other].normal) > ALIKE
    })
}

fn hanging(
    numbers: &[usize],
    place: impl Fn(usize) -> Point3<f64>,
    reach: f64,
    may_hang: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<usize>> {
    let points: Vec<Point3<f64>> = numbers.iter().map(|&at| place(at)).collect();
    let grid = PointGrid::of(&points, 0..points.len(), reach);
    let mut sets = DisjointSets::of(points.len());
    for (at, point) in points.iter().enumerate() {
        for other in grid
            .near(point, reach)
            .filter(|&other| other < at && may_hang(numbers[at], numbers[other]))
        {
            sets.join(at as u32, other as u32);
        }
    }
    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (at, &number) in numbers.iter().enumerate() {
        members
            .entry(sets.root(at as u32))
            .or_default()
            .push(number);
    }
    members.into_values().collect()
}
