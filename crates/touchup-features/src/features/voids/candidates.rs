//! Voids between walls, and between half-round ends, along an axis.

use nalgebra::{Point2, Vector2, Vector3};

use super::axis_view::{AxisView, in_order};
use super::evidence::{SegmentEvidence, WallPiece};
use super::slot::Slot;
use super::void::{LONG, Void, VoidEnd};
use crate::features::walls::Wall;

/// Minimum distance of two walls, in tolerances.
const APART: f64 = 4.0;
/// Minimum overlap of facing walls along the slot, as a share of the shorter one.
const FACING: f64 = 0.5;
/// Range of the turn of a half-round end, as shares, the minimum if it is felt, perhaps in part, and
/// minimum cosine of its direction to its side of the slot.
const END_TURN: std::ops::Range<f64> = 0.42..0.75;
const LEAST_FELT_TURN: f64 = 0.3;
const AWAY: f64 = 0.7;
/// Axes of ends agree with that of the slot within 20°: short ends hardly determine one.
const ENDS_PARALLEL: f64 = 0.94;
/// Maximum distance of the ends of a slot, in widths.
const LONGEST: f64 = 8.0;
/// Tolerance of the widths and positions of ends, as a share of the width.
const ABOUT: f64 = 0.1;

/// Half-round walls that may end a slot.
pub(super) fn half_round<'a>(walls: &'a [Wall], evidence: &SegmentEvidence) -> Vec<&'a Wall> {
    let is_end = |wall: &&Wall| {
        let is_felt = wall.segments.iter().any(|&at| evidence.is_felt(at));
        let least = if is_felt {
            LEAST_FELT_TURN
        } else {
            END_TURN.start
        };
        let is_half = (least..END_TURN.end).contains(&wall.coverage);
        wall.is_concave && !wall.is_cone() && is_half
    };
    walls.iter().filter(is_end).collect()
}

/// The known axis of an end, else its own.
pub(super) fn axis_of_end(end: &Wall, known: &[Vector3<f64>]) -> Vector3<f64> {
    let turn = |axis: &&Vector3<f64>| axis.dot(&end.axis).abs();
    let nearest = known.iter().max_by(|a, b| turn(a).total_cmp(&turn(b)));
    *nearest
        .filter(|axis| turn(axis) > ENDS_PARALLEL)
        .unwrap_or(&end.axis)
}

impl AxisView<'_> {
    /// Whether a half-round wall is along the axis.
    fn is_along(&self, end: &Wall) -> bool {
        end.axis.dot(&self.axis).abs() > ENDS_PARALLEL
    }

    /// All voids beside flat walls.
    pub(super) fn beside_walls(&self, ends: &[&Wall]) -> Vec<Slot> {
        let has_ends = ends.iter().any(|end| self.is_along(end));
        let pieces = self.evidence.pieces(&self.axis, &self.basis, has_ends);
        let mut found = Vec::new();
        for (at, one) in pieces.iter().enumerate() {
            found.extend(
                pieces[..at]
                    .iter()
                    .filter_map(|other| self.between(one, other)),
            );
            found.extend(ends.iter().filter_map(|end| self.beside_end(one, end)));
        }
        found
    }

    /// The void between two flat walls.
    fn between(&self, one: &WallPiece, other: &WallPiece) -> Option<Slot> {
        let (across, width) = one.width_to(other)?;
        let along = Vector2::new(across.y, -across.x);
        let span = |wall: &WallPiece| {
            in_order(
                wall.span
                    .map(|x| (wall.at + wall.along() * x - one.at).dot(&along)),
            )
        };
        let (a, b) = (span(one), span(other));
        let [low, high] = [a[0].max(b[0]), a[1].min(b[1])];
        let shorter = (a[1] - a[0]).min(b[1] - b[0]);
        let shared = [
            one.height[0].max(other.height[0]),
            one.height[1].min(other.height[1]),
        ];
        let tolerance = |wall: &WallPiece| self.evidence.parted.segment(wall.segment).tolerance;
        let is_facing = width > APART * tolerance(one).max(tolerance(other))
            && high > low
            && high - low >= FACING * shorter
            && shared[1] - shared[0] >= -self.evidence.radius;
        if !is_facing {
            return None;
        }
        let middle = (low + high) / 2.0;
        let origin = one.at + across * (width / 2.0) + along * middle;
        // both walls are there
        let level = (shared[0] + shared[1]) / 2.0;
        let bottom = one.height[0].min(other.height[0]);
        let top = one.height[1].max(other.height[1]);
        let void = Void {
            view: self,
            walls: [one.segment, other.segment],
            middle: self.at(&origin, level),
            along: self.in_space(&along),
            across: self.in_space(&across),
            width,
            half: (high - low) / 2.0,
            reach: [a[1].max(b[1]) - middle, middle - a[0].min(b[0])],
            half_height: (top - level).max(level - bottom),
        };
        void.slot(|void| [void.end(1.0), void.end(-1.0)])
    }

    /// The slot between a flat wall and the half-round end that continues it: its other wall may
    /// hardly be felt.
    fn beside_end(&self, wall: &WallPiece, end: &Wall) -> Option<Slot> {
        let width = 2.0 * end.radius();
        let centre = Point2::from(self.flat(&end.at(end.middle()).coords));
        let v = centre - wall.at;
        let apex = self.flat(&end.towards).dot(&wall.along());
        let is_beside = (v.dot(&wall.normal) - end.radius()).abs() < ABOUT * width;
        if !is_beside || !self.is_along(end) || apex.abs() < AWAY {
            return None;
        }
        // from the end on
        let (along, far) = if apex > 0.0 {
            (-wall.along(), -wall.span[0])
        } else {
            (wall.along(), wall.span[1])
        };
        let distance = far - v.dot(&along);
        let of_end = self.heights(end);
        let shared = of_end[1].min(wall.height[1]) - of_end[0].max(wall.height[0]);
        if !is_apart(distance, width) || shared < -self.evidence.radius {
            return None;
        }
        let (bottom, top) = (of_end[0].min(wall.height[0]), of_end[1].max(wall.height[1]));
        let void = Void {
            view: self,
            walls: [wall.segment, end.segments[0]],
            middle: self.at(&(centre + along * (distance / 2.0)), (bottom + top) / 2.0),
            along: self.in_space(&along),
            across: self.in_space(&wall.normal),
            width,
            half: distance / 2.0,
            reach: [distance / 2.0; 2],
            half_height: (top - bottom) / 2.0,
        };
        let known = VoidEnd::round(end.segments[0], (distance + width) / 2.0);
        void.slot(|void| [void.end(1.0), known])
    }

    /// The slot between two half-round ends, each open towards the other: its flat walls may hardly
    /// be felt.
    pub(super) fn between_ends(&self, ends: [&Wall; 2]) -> Option<Slot> {
        let [one, other] = ends;
        let width = one.radius() + other.radius();
        let [from, to] = ends.map(|end| self.flat(&end.at(end.middle()).coords));
        let distance = (to - from).norm();
        let heights = ends.map(|end| self.heights(end));
        let shared = heights[0][1].min(heights[1][1]) - heights[0][0].max(heights[1][0]);
        let is_alike = (one.radius() - other.radius()).abs() < ABOUT * width
            && self.is_along(other)
            && shared > -ABOUT * width;
        if !is_alike || !is_apart(distance, width) {
            return None;
        }
        let along = self.in_space(&((to - from) / distance));
        if one.towards.dot(&along) > -AWAY || other.towards.dot(&along) < AWAY {
            return None;
        }
        let bottom = heights[0][0].min(heights[1][0]);
        let top = heights[0][1].max(heights[1][1]);
        let middle = Point2::from((from + to) / 2.0);
        let void = Void {
            view: self,
            walls: ends.map(|end| end.segments[0]),
            middle: self.at(&middle, (bottom + top) / 2.0),
            along,
            across: self.axis.cross(&along),
            width,
            half: distance / 2.0,
            reach: [distance / 2.0; 2],
            half_height: (top - bottom) / 2.0,
        };
        let far = (distance + width) / 2.0;
        void.slot(|_| [other, one].map(|end| VoidEnd::round(end.segments[0], far)))
    }
}

/// Whether the axes of the ends of a slot may have a distance, m.
fn is_apart(distance: f64, width: f64) -> bool {
    ((LONG - 1.0) * width..LONGEST * width).contains(&distance)
}
