//! A void between two walls, with its ends, floor and opening.

use std::ops::Range;

use nalgebra::{Point3, Vector2, Vector3};

use super::axis_view::AxisView;
use super::evidence::SegmentPlace;
use super::slot::Slot;

use crate::features::fit::Ends;
use crate::features::segmentation::facets::NONE;
use crate::features::segmentation::primitive::Primitive;
use crate::features::segmentation::scene::SegmentedMesh;

/// Minimum length of a slot, in widths, and with flat ends.
pub(super) const LONG: f64 = 1.2;
pub(super) const LONG_BOX: f64 = 2.0;
/// Minimum length of a pocket, in widths: allows for the sides of a square one.
const SQUARISH: f64 = 0.95;
/// Maximum width of a void with an open end, in depths.
const WIDE: f64 = 3.0;
/// Maximum width of a closed or felt void, in depths: shallower is a step that an uneven surface has
/// too.
const SHALLOW: f64 = 12.0;
/// Maximum depth, in lengths.
const DEEPEST: f64 = 2.0;
/// Maximum distance of the land above the walls, in widths and in radii of the ball, and of the floor
/// below them, in widths.
const ABOVE: f64 = 0.5;
const ABOVE_RADII: f64 = 2.0;
const BELOW: f64 = 1.0;
/// A land or a floor is square to the walls within 9°.
const LEVEL: f64 = 0.988;
/// Number of places beside each wall that examine its land, their distances from it, in widths, and
/// the maximum distance of its faces from them, in tolerances and in widths.
const PLACES: usize = 9;
const BESIDE: [f64; 3] = [0.05, 0.15, 0.4];
const ON_LAND: [f64; 2] = [3.0, 0.02];
/// Minimum share of these places on the land.
const LAND_SHARE: f64 = 0.3;
/// Minimum number of places of a floor, or of an end, in the void.
const LEAST_PLACES: usize = 3;
/// Minimum number of places of a segment that stands between felt walls, their minimum distance from
/// these, in radii of the ball, and minimum cosine of their normals to the walls'.
const LEAST_ISLAND: usize = 6;
const OF_ISLAND: f64 = 1.5;
const ISLAND_NORMAL: f64 = 0.7;
/// Minimum free shares of the width across untouched walls, and above them; places across with free
/// ways out, in widths.
const FREE_ACROSS: f64 = 0.35;
const FREE_ABOVE: f64 = 0.5;
const NO_CEILING: [f64; 3] = [0.0, 0.4, -0.4];
/// Tolerance of the width of a round end, and of its place across, in widths.
const END_WIDTH: f64 = 0.2;
const END_ACROSS: f64 = 0.15;
/// Cosine between a slot and the normal of a wall that closes it aslant: 20° to 75°; of a flat end.
const ASLANT: f64 = 0.26;
const FLAT: f64 = 0.98;
/// Ranges across a void, in widths, with places of a flat end, and of a half-round one: a rounded
/// corner is on one side.
const FLAT_END: Range<f64> = -0.4..0.4;
const ROUND_SIDES: [Range<f64>; 2] = [-0.5..-0.1, 0.1..0.5];
/// Half of the range with places of a floor, in widths.
const OF_FLOOR: f64 = 0.45;
/// Number of places of an outline that evidence covers; their levels about half of the depth, in
/// depths; its maximum distance, in widths; minimum
/// cosine between its normal and that of the outline; minimum share that it covers.
const OUTLINE: usize = 48;
const LEVELS: [f64; 3] = [0.0, 0.35, -0.35];
const COVER: f64 = 0.08;
const COVER_NORMAL: f64 = 0.8;
const LEAST_COVERED: f64 = 0.35;

/// One end of a void.
#[derive(Clone, Copy)]
pub(super) struct VoidEnd {
    /// number of the segment that closes it
    segment: Option<usize>,
    /// from the middle, m
    distance: f64,
    shape: EndShape,
}

#[derive(Clone, Copy, PartialEq)]
enum EndShape {
    Open,
    Round,
    Flat,
    Aslant,
}

impl VoidEnd {
    pub(super) fn round(segment: usize, distance: f64) -> Self {
        Self {
            segment: Some(segment),
            distance,
            shape: EndShape::Round,
        }
    }
}

/// The plane, or the shaft, around an opening.
#[derive(Clone, Copy)]
struct VoidOpening {
    /// number of the segment
    land: usize,
    /// unit vector out of it
    out: Vector3<f64>,
    /// from the middle of the void, m
    distance: f64,
    /// share of the places beside the walls
    share: f64,
}

/// The bottom of a void.
struct Bottom {
    /// number of its floor
    floor: Option<usize>,
    /// from the middle of the void, m
    distance: f64,
    /// `None`: neither a floor nor an opening on the other side
    through: Option<bool>,
}

/// A void between two walls.
pub(super) struct Void<'a> {
    pub view: &'a AxisView<'a>,
    /// numbers of its walls
    pub walls: [usize; 2],
    /// middle of the overlap of both walls, m, in O
    pub middle: Point3<f64>,
    /// unit vectors
    pub along: Vector3<f64>,
    pub across: Vector3<f64>,
    /// m
    pub width: f64,
    /// half of the overlap of its walls along it, m
    pub half: f64,
    /// distance of the farther ends of its walls along it, and against, m
    pub reach: [f64; 2],
    /// maximum distance of their ends from the middle along the axis, m
    pub half_height: f64,
}

impl Void<'_> {
    fn parted(&self) -> &SegmentedMesh<'_> {
        self.view.evidence.parted
    }

    /// Coordinates along, across and out of it, m.
    fn local(&self, p: &Point3<f64>) -> Vector3<f64> {
        let v = p - self.middle;
        Vector3::new(
            v.dot(&self.along),
            v.dot(&self.across),
            v.dot(&self.view.axis),
        )
    }

    /// Whether the ball was on both walls.
    fn is_felt(&self) -> bool {
        self.walls
            .iter()
            .all(|&wall| self.view.evidence.is_felt(wall))
    }

    /// Whether a part of the void holds some places of a segment.
    ///
    /// - `part`: ranges along, across and out of it, m.
    fn has_places(&self, least: usize, number: usize, part: &[Range<f64>; 3]) -> bool {
        let around = &self.view.evidence.around[number];
        let middle = self.local(&nalgebra::center(&around.low, &around.high));
        let half = (around.high - around.low) / 2.0;
        let ways = [self.along, self.across, self.view.axis];
        let is_apart = |at: usize| {
            let reach = ways[at].abs().dot(&half);
            middle[at] + reach < part[at].start || middle[at] - reach > part[at].end
        };
        if (0..3).any(is_apart) {
            return false;
        }
        let is_there = |one: &&SegmentPlace| {
            let q = self.local(&one.point);
            let height = part[2].start - one.half..part[2].end + one.half;
            part[0].contains(&q.x) && part[1].contains(&q.y) && height.contains(&q.z)
        };
        let places = self.view.evidence.of_segment[number].iter();
        places.filter(is_there).take(least).count() == least
    }

    /// Whether contacts show material between the walls.
    fn has_island(&self) -> bool {
        let free = self.width / 2.0 - OF_ISLAND * self.view.evidence.radius;
        let between = [self.half, free, self.half_height].map(|half| -half..half);
        let is_island = |number: usize| {
            let primitive = &self.parted().segment(number).primitive;
            let normal = primitive.distance_and_normal(&self.middle).1;
            !self.walls.contains(&number)
                && self.view.evidence.is_felt(number)
                && normal.dot(&self.across).abs() > ISLAND_NORMAL
                && self.has_places(LEAST_ISLAND, number, &between)
        };
        (0..self.parted().segmentation.segments.len()).any(is_island)
    }

    /// Whether nothing closes it on the way out, or stands in it.
    fn is_free(&self, opening: &VoidOpening) -> bool {
        if self.is_felt() {
            return !self.has_island();
        }
        let mut rays = self.parted().around(self.walls[0]).rays(self.width);
        let up = opening.distance;
        let beyond = FREE_ABOVE * self.width.min(up.max(0.2 * FREE_ABOVE * self.width));
        let far = up + self.width;
        let mut is_open = |share: &f64| {
            let from = self.middle + self.across * (share * self.width);
            rays.free(&from, &opening.out, far) >= up + beyond
        };
        NO_CEILING.iter().all(&mut is_open)
            && [self.across, -self.across]
                .iter()
                .all(|side| rays.free(&self.middle, side, self.width) >= FREE_ACROSS * self.width)
    }

    /// Its end along it, or against.
    ///
    /// - `sign`: ±1.
    pub(super) fn end(&self, sign: f64) -> VoidEnd {
        let inner = (self.half - 0.5 * self.width).max(0.0);
        let farthest = self.reach[usize::from(sign < 0.0)] + self.width;
        let along = match sign > 0.0 {
            true => inner..farthest,
            false => -farthest..-inner,
        };
        let open = VoidEnd {
            segment: None,
            distance: self.half,
            shape: EndShape::Open,
        };
        let mut best = (farthest, open);
        for &number in self
            .view
            .closers
            .iter()
            .filter(|at| !self.walls.contains(at))
        {
            let Some((nearest, end)) = self.end_by(number, sign) else {
                continue;
            };
            let is_in = |across: &Range<f64>| {
                let across = across.start * self.width..across.end * self.width;
                let part = [along.clone(), across, -self.half_height..self.half_height];
                self.has_places(LEAST_PLACES, number, &part)
            };
            let is_next = nearest > self.half - 0.5 * self.width && nearest < best.0;
            let is_across = || match end.shape {
                EndShape::Round => ROUND_SIDES.iter().all(is_in),
                _ => is_in(&FLAT_END),
            };
            if is_next && is_across() {
                best = (nearest, end);
            }
        }
        best.1
    }

    /// Its end if a segment closes it, with the distance of that from the middle, m.
    fn end_by(&self, number: usize, sign: f64) -> Option<(f64, VoidEnd)> {
        match &self.parted().segment(number).primitive {
            Primitive::Cylinder(cylinder) => {
                let q = self.local(&cylinder.nearest_on_axis(&self.middle));
                let off = (2.0 * cylinder.radius - self.width).abs();
                let is_end = off < END_WIDTH * self.width && q.y.abs() < END_ACROSS * self.width;
                let end = VoidEnd::round(number, q.x * sign + self.width / 2.0);
                let nearest = q.x * sign + cylinder.radius;
                is_end.then_some((nearest, end))
            }
            Primitive::Plane(plane) => {
                let along = self.along * sign;
                let facing = -plane.normal().dot(&along);
                if facing < ASLANT {
                    return None;
                }
                let distance = plane.along(&self.middle, &along)?;
                let shape = if facing > FLAT {
                    EndShape::Flat
                } else {
                    EndShape::Aslant
                };
                let end = VoidEnd {
                    segment: Some(number),
                    distance,
                    shape,
                };
                Some((distance, end))
            }
            Primitive::Cone(_) | Primitive::Sphere(_) => None,
        }
    }

    /// The opening on one side.
    fn opening(&self, out: Vector3<f64>) -> Option<VoidOpening> {
        let parted = self.parted();
        let above = (ABOVE * self.width).max(ABOVE_RADII * self.view.evidence.radius);
        let mut best: Option<VoidOpening> = None;
        for land in 0..parted.segmentation.segments.len() {
            let is_level = parted
                .plane(land)
                .is_some_and(|plane| plane.normal().dot(&out) > LEVEL);
            if !is_level && !parted.is_shaft(land) || self.walls.contains(&land) {
                continue;
            }
            let distance = parted.exit(land, &self.middle, &out);
            let is_near = |distance: &f64| (0.0..self.half_height + above).contains(distance);
            let Some(distance) = distance.filter(is_near) else {
                continue;
            };
            let share = self.land_share(land, &out);
            let is_better = best.is_none_or(|best| share > best.share);
            if share > LAND_SHARE && is_better {
                best = Some(VoidOpening {
                    land,
                    out,
                    distance,
                    share,
                });
            }
        }
        best
    }

    /// Share of the places beside both walls on a land.
    fn land_share(&self, land: usize, out: &Vector3<f64>) -> f64 {
        let parted = self.parted();
        let around = parted.around(land);
        let near = (ON_LAND[0] * parted.segment(land).tolerance).max(ON_LAND[1] * self.width);
        let is_there = |x: f64, y: f64| {
            let p = self.middle + self.along * x + self.across * y;
            let up = parted.exit(land, &p, out);
            let on = up.map(|up| p + out * up);
            let on = on.filter(|on| self.view.evidence.is_near(land, on, near));
            let face = on.and_then(|on| around.closest(&on, near));
            face.is_some_and(|face| self.view.of_face[face as usize] == land as u32)
        };
        let mut count = 0;
        for (side, at) in [1.0, -1.0]
            .into_iter()
            .flat_map(|side| (0..PLACES).map(move |at| (side, at)))
        {
            let x = self.half * (2.0 * (at as f64 + 0.5) / PLACES as f64 - 1.0);
            let mut beside = BESIDE.iter();
            let is_land = beside.any(|beside| is_there(x, side * self.width * (0.5 + beside)));
            count += usize::from(is_land);
        }
        count as f64 / (2 * PLACES) as f64
    }

    /// The floor: its number and distance below the middle, m.
    ///
    /// - `range`: along the void, m.
    fn floor(&self, out: &Vector3<f64>, range: &Range<f64>) -> Option<(usize, f64)> {
        let lowest = self.half_height + BELOW * self.width;
        let half = OF_FLOOR * self.width;
        let part = [range.clone(), -half..half, f64::NEG_INFINITY..f64::INFINITY];
        let floor = |(number, _, normal): (usize, _, Vector3<f64>)| {
            let down = self.parted().exit(number, &self.middle, &-out)?;
            let is_floor = normal.dot(out) > LEVEL
                && (0.0..lowest).contains(&down)
                && self.has_places(LEAST_PLACES, number, &part);
            is_floor.then_some((number, down))
        };
        let floors = self.parted().planes().filter_map(floor);
        floors.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The bottom, below the middle of the opening.
    ///
    /// - `other`: the opening on the other side.
    fn bottom(
        &self,
        middle: &Point3<f64>,
        out: &Vector3<f64>,
        range: &Range<f64>,
        other: Option<&VoidOpening>,
    ) -> Bottom {
        if let Some((floor, distance)) = self.floor(out, range) {
            return Bottom {
                floor: Some(floor),
                distance,
                through: Some(false),
            };
        }
        let mut rays = self.parted().around(self.walls[0]).rays(self.width);
        let met = rays.first(middle, &-out, self.parted().diagonal);
        let lowest = self.half_height + 2.0 * self.width;
        match met.filter(|met| met.distance < lowest) {
            Some(met) => {
                let is_named = self.view.of_face[met.face.0 as usize] != NONE;
                let is_closed = is_named || self.parted().rounding.is_some();
                Bottom {
                    floor: None,
                    distance: met.distance,
                    through: is_closed.then_some(false),
                }
            }
            None => Bottom {
                floor: None,
                distance: other.map_or(self.half_height, |other| other.distance),
                through: Some(true),
            },
        }
    }

    /// The opening with the most land around it, of two the farther one from its bottom.
    ///
    /// - `sides`: openings along its axis, and against; a floor between closes them.
    /// - `middle`: in its range along it, m, in O.
    fn opened(
        &self,
        sides: [Option<VoidOpening>; 2],
        middle: &Point3<f64>,
        range: &Range<f64>,
    ) -> Option<(VoidOpening, Bottom)> {
        let is_above_floors = |side: &VoidOpening| {
            let floor = self.floor(&-side.out, range);
            floor.is_none_or(|(_, distance)| side.distance < distance)
        };
        let sides = sides.map(|side| side.filter(is_above_floors));
        let opened = [[0, 1], [1, 0]].map(|[near, far]| {
            let opening = sides[near]?;
            let bottom = self.bottom(middle, &opening.out, range, sides[far].as_ref());
            Some((opening, bottom))
        });
        let better = |(a, below): &(VoidOpening, Bottom), (b, other): &(VoidOpening, Bottom)| {
            let depths = [a.distance + below.distance, b.distance + other.distance];
            a.share
                .total_cmp(&b.share)
                .then(depths[0].total_cmp(&depths[1]))
        };
        opened.into_iter().flatten().max_by(better)
    }

    /// The slot or pocket with its ends: along it, and against.
    pub(super) fn slot(&self, ends: impl FnOnce(&Self) -> [VoidEnd; 2]) -> Option<Slot> {
        let sides = [self.view.axis, -self.view.axis].map(|out| self.opening(out));
        if sides.iter().all(Option::is_none) {
            return None;
        }
        let ends = ends(self);
        let range = -ends[1].distance..ends[0].distance;
        let middle = self.middle + self.along * ((range.start + range.end) / 2.0);
        let (opening, bottom) = self.opened(sides, &middle, &range)?;
        let is_ended = ends.iter().any(|end| end.segment.is_some());
        let is_shown = !self.is_felt()
            || is_ended
            || bottom.floor.is_some()
            || bottom.through == Some(true)
            || self.has_land_beyond(&opening, &range);
        if !is_shown || !self.is_free(&opening) {
            return None;
        }
        let out = opening.out;
        let is_round = ends.iter().any(|end| end.shape == EndShape::Round);
        let mut slot = Slot {
            walls: self.walls.to_vec(),
            ends: ends.map(|end| end.segment),
            shape: if is_round {
                Ends::Round
            } else {
                Ends::Straight
            },
            centre: middle + out * opening.distance,
            out,
            direction: self.along,
            width: self.width,
            length: range.end - range.start,
            depth: opening.distance + bottom.distance,
            through: bottom.through,
            floor: bottom.floor,
            land: opening.land,
            is_boxed: ends.iter().all(|end| end.shape == EndShape::Flat),
            is_closed: ends.iter().all(|end| end.segment.is_some()),
            is_aslant: ends.iter().any(|end| end.shape == EndShape::Aslant),
            area: 0.0,
        };
        let is_shut = slot.is_closed
            && (slot.floor.is_some() || ends.iter().all(|end| end.shape == EndShape::Round));
        let widest = if is_shut || self.is_felt() {
            SHALLOW
        } else {
            WIDE
        };
        if !is_slot(&slot) || slot.width >= widest * slot.depth {
            return None;
        }
        let covered = self.covered(&slot);
        slot.area = covered * opening.share * 2.0 * self.half * slot.depth;
        (covered >= LEAST_COVERED).then_some(slot)
    }

    /// Whether the land goes on beyond an end.
    ///
    /// - `range`: along the void, m.
    fn has_land_beyond(&self, opening: &VoidOpening, range: &Range<f64>) -> bool {
        let half = self.width / 2.0;
        let ends = [
            range.start - self.width..range.start,
            range.end..range.end + self.width,
        ];
        ends.into_iter().any(|along| {
            let part = [along, -half..half, f64::NEG_INFINITY..f64::INFINITY];
            self.has_places(LEAST_PLACES, opening.land, &part)
        })
    }

    /// Share of the outline of a slot with evidence of a wall.
    fn covered(&self, slot: &Slot) -> f64 {
        let outline = SlotOutline::of(slot);
        let near = COVER * self.width;
        let level = slot.centre - slot.out * (slot.depth / 2.0);
        let reach = (slot.depth / 2.0 + near)
            .hypot(2.0 * near)
            .max(self.view.evidence.radius);
        let around = self.parted().around(self.walls[0]);
        let is_covered = |at: &usize| {
            let (p, n) = outline.place((*at as f64 + 0.5) / OUTLINE as f64);
            let normal = self.along * n.x + self.across * n.y;
            let middle = level + self.along * p.x + self.across * p.y;
            let faces = |segment: usize, at: &Point3<f64>| {
                let primitive = &self.parted().segment(segment).primitive;
                primitive.distance_and_normal(at).1.dot(&normal) > COVER_NORMAL
            };
            let is_mesh = |level: &f64| {
                let p = middle + slot.out * (slot.depth * level);
                let face = around.closest(&p, near);
                let of = face.map_or(NONE, |face| self.view.of_face[face as usize]);
                of != NONE && faces(of as usize, &p)
            };
            let is_felt = |one: &SegmentPlace| {
                let v = one.point - middle;
                let off = v.dot(&normal);
                let aside = (v - normal * off - slot.out * v.dot(&slot.out)).norm();
                off.abs() < near
                    && aside < (2.0 * near).max(one.half) + one.half
                    && faces(one.segment as usize, &one.point)
            };
            LEVELS.iter().any(is_mesh) || self.view.evidence.felt_near(&middle, reach).any(is_felt)
        };
        (0..OUTLINE).filter(is_covered).count() as f64 / OUTLINE as f64
    }
}

/// Whether a void has the proportions of a slot or of a pocket.
fn is_slot(slot: &Slot) -> bool {
    let long = if slot.is_boxed { LONG_BOX } else { LONG };
    let is_long = slot.length > long * slot.width;
    let is_pocket = slot.is_boxed && slot.floor.is_some() && slot.length > SQUARISH * slot.width;
    slot.depth < DEEPEST * slot.length && (is_long && !slot.is_aslant || !is_long && is_pocket)
}

/// The outline of a slot in the plane of its opening, about its middle.
struct SlotOutline {
    half_width: f64,
    /// length of its straight sides, m
    straight: f64,
    /// length of one of its ends, m
    of_end: f64,
    is_round: bool,
}

impl SlotOutline {
    fn of(slot: &Slot) -> Self {
        let is_round = slot.shape == Ends::Round;
        let half_width = slot.width / 2.0;
        let (straight, of_end) = if is_round {
            (
                (slot.length - slot.width).max(0.0),
                std::f64::consts::PI * half_width,
            )
        } else {
            (slot.length, slot.width)
        };
        Self {
            half_width,
            straight,
            of_end,
            is_round,
        }
    }

    /// Place along and across, m, and inward unit normal, at a share of its length.
    fn place(&self, share: f64) -> (Vector2<f64>, Vector2<f64>) {
        let (half, straight) = (self.half_width, self.straight);
        let (share, sign) = if share < 0.5 {
            (share, 1.0)
        } else {
            (share - 0.5, -1.0)
        };
        let s = 2.0 * share * (straight + self.of_end);
        let (p, n) = if s < straight {
            (Vector2::new(straight / 2.0 - s, half), -Vector2::y())
        } else if self.is_round {
            let turn = (s - straight) / half + std::f64::consts::FRAC_PI_2;
            let v = Vector2::new(turn.cos(), turn.sin());
            (v * half - Vector2::x() * (straight / 2.0), -v)
        } else {
            (
                Vector2::new(-straight / 2.0, half - (s - straight)),
                Vector2::x(),
            )
        };
        (p * sign, n * sign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stadium of 30 × 10 mm: two sides of 20 mm, two half circles of 5 mm.
    #[test]
    fn an_outline_runs_once_around_a_slot() {
        let outline = SlotOutline {
            half_width: 5.0,
            straight: 20.0,
            of_end: 5.0 * std::f64::consts::PI,
            is_round: true,
        };
        let count = 1000;
        let length = 40.0 + 10.0 * std::f64::consts::PI;
        let mut before = outline.place(0.9995).0;
        for at in 0..count {
            let (p, n) = outline.place((f64::from(at) + 0.5) / f64::from(count));
            let core = Vector2::new(p.x.clamp(-10.0, 10.0), 0.0);
            assert!(((p - core).norm() - 5.0).abs() < 1e-9);
            assert!(((core - p).normalize() - n).norm() < 1e-9, "inward");
            let step = (p - before).norm();
            assert!((step - length / f64::from(count)).abs() < 1e-4);
            before = p;
        }
    }
}
