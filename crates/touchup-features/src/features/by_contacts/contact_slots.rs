//! Slots and pockets by contacts: two straight walls that face each other over a void, whatever the
//! mesh between them.
//!
//! Seen along the axis of its opening, a ball of radius r that runs along a straight wall keeps its
//! centre on a line; beside the half-round end of a slot of width w it keeps it on a circle of
//! radius w/2 − r about the axis of the end, beside a flat end on a line across.

use nalgebra::{Point2, Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::contacts::{
    ALIKE, ProjectedContact, SQUARE, TOGETHER, axes, large_planes, projected, thinned,
    together_along,
};
use crate::features::fit::Ends;
use crate::features::segmentation::scene::SegmentedMesh;
use crate::features::slots::{LONG, LONG_BOX, SHALLOW, SQUARISH, Slot, WIDE};
use touchup_geometry::numeric::{
    distinct, median, order_statistic, tangent_basis, without_repeats,
};
use touchup_method::stylus::ProbedPoint;

/// Minimum number of contacts on a wall.
const LEAST: usize = 8;
/// Minimum length of a wall, and maximum gap between its contacts, in radii of the ball.
const LEAST_RADII: f64 = 1.5;
const GAP_RADII: f64 = 6.0;
/// Maximum number of contacts to start a wall from in one group, number of partners of each, and
/// maximum number of counted contacts.
const STARTS: usize = 48;
const PARTNERS: usize = 12;
const COUNTED: usize = 1500;
/// Seed of the draws.
const SEED: u64 = 1;
/// Maximum number of walls in one group.
const MOST_IN_GROUP: usize = 10;
/// Tolerance of a contact on a wall, as a share of the ball's radius.
const SEARCHED: f64 = 0.1;
/// Walls that face each other are parallel within 6°.
const PARALLEL: f64 = 0.9945;
/// Minimum overlap of facing walls, as a share of the longer one.
const FACING: f64 = 0.4;
/// Maximum gap along the axis between contacts of one wall, in radii.
const LAYER_RADII: f64 = 2.5;
/// Share of a wall's contacts, at the top and at the bottom, that its height leaves out: possible
/// outliers.
const OUTER: f64 = 0.05;
/// Minimum number of contacts on an island between the walls, which makes it two voids, and their
/// minimum lean.
const ISLAND: usize = 6;
const ISLAND_LEAN: f64 = 0.7;
/// Minimum number of contacts that determine an end, and their minimum lean along the slot.
const END_CONTACTS: usize = 2;
const END_LEAN: f64 = 0.5;
/// Typical distance of a contact from the outline at an end, as a share of the ball's radius, and
/// typical error of its direction.
const END_OFF: f64 = 0.15;
const END_TURNED: f64 = 0.3;
/// Maximum cost of one contact against a shape.
const MOST_MISFIT: f64 = 9.0;
/// Maximum depth, in lengths of the slot.
const DEEPEST: f64 = 2.0;
/// A land around the opening is square to the walls within 9°; minimum share of places beside them
/// with the land.
const LAND: f64 = 0.988;
const LAND_SHARE: f64 = 0.3;
/// Tolerance of the mesh at a place of the land, as a share of the ball's radius, and distances of
/// the places from a wall, in radii.
const LAND_OFF: f64 = 0.3;
const LAND_RADII: [f64; 3] = [0.5, 1.0, 2.0];
/// Number of places along each wall that test the surface beside it.
const PLACES: usize = 9;
/// Minimum number of contacts of a floor.
const FLOOR_CONTACTS: usize = 6;
/// Maximum lean of a floor's contacts, 25° as a cosine, and their maximum distance from its level,
/// as a share of the ball's radius.
const FLOOR_LEAN: f64 = 0.906;
const FLOOR_OFF: f64 = 0.2;
/// Maximum depth of a floor below the walls' contacts, in radii: the ball rests on it beside them.
const FLOOR_RADII: f64 = 3.0;

/// A straight wall, seen along an axis.
struct WallLine {
    /// ball centres on it, m
    centres: Vec<Point2<f64>>,
    touches: Vec<usize>,
    /// a point of the line of centres, m
    at: Point2<f64>,
    /// unit normal into the air
    normal: Vector2<f64>,
}

/// All slots and pockets that contacts show.
///
/// - `is_round`: by contact, whether it is on a wall that is round all around
pub(in crate::features) fn contact_slots(
    parted: &SegmentedMesh,
    touches: &[ProbedPoint],
    is_round: &[bool],
) -> Vec<Slot> {
    let kept = thinned(touches);
    let Some(radius) = kept.first().map(|&at| touches[at].radius) else {
        return Vec::new();
    };
    let kept: Vec<usize> = kept.into_iter().filter(|&at| !is_round[at]).collect();
    let planes = large_planes(parted);
    let mut found: Vec<(f64, Slot)> = Vec::new();
    for axis in axes(parted, &planes, touches, &kept, radius) {
        let upright: Vec<usize> = kept
            .iter()
            .copied()
            .filter(|&at| touches[at].normal.dot(&axis).abs() < SQUARE)
            .collect();
        let view = AxisView {
            parted,
            touches,
            kept: &kept,
            axis,
            plane: tangent_basis(&axis),
            radius,
        };
        let groups = together_along(touches, &upright, &axis, TOGETHER * radius);
        let lines: Vec<WallLine> = groups
            .iter()
            .flat_map(|members| view.lines(members))
            .collect();
        for (at, one) in lines.iter().enumerate() {
            for other in &lines[..at] {
                let count = (one.touches.len() + other.touches.len()) as f64;
                let seen = view.between(one, other);
                found.extend(seen.map(|(slot, share)| (share * count, slot)));
            }
        }
    }
    // of walls in pieces or in several views, the slot with the most contacts next to its land
    // counts: flat walls are lines along every axis in both
    found.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    without_repeats(found.into_iter().map(|(_, slot)| slot), |one, other| {
        one.holds(other) || other.holds(one)
    })
}

/// Contacts seen along an axis.
struct AxisView<'a> {
    parted: &'a SegmentedMesh<'a>,
    touches: &'a [ProbedPoint],
    /// contacts in use
    kept: &'a [usize],
    axis: Vector3<f64>,
    /// unit vectors square to the axis
    plane: [Vector3<f64>; 2],
    /// radius of the ball, m
    radius: f64,
}

/// A contact in the frame of a slot: x along it, y across, z along the axis.
struct SlotContact {
    touch: usize,
    /// position of the ball's centre, m
    x: f64,
    y: f64,
    /// position of the contact, m
    contact_x: f64,
    contact_y: f64,
    z: f64,
    normal: Vector3<f64>,
}

/// One end of a slot.
#[derive(Clone, Copy)]
struct SlotEnd {
    /// end of the slot along x, m, if round and if flat
    at: [f64; 2],
    /// misfit of contacts to either
    costs: [f64; 2],
}

impl AxisView<'_> {
    /// The straight walls of some contacts, the largest number of contacts first.
    fn lines(&self, members: &[usize]) -> Vec<WallLine> {
        let mut left = projected(self.touches, members, self.plane);
        let mut rng = Pcg64::seed_from_u64(SEED);
        let mut found = Vec::new();
        while found.len() < MOST_IN_GROUP && left.len() >= LEAST {
            let step = left.len().div_ceil(COUNTED);
            let mut best: Option<(usize, Point2<f64>, Vector2<f64>)> = None;
            for start in (0..left.len()).step_by(left.len().div_ceil(STARTS)) {
                for _ in 0..PARTNERS {
                    let [p, q] = [&left[start], &left[rng.random_range(0..left.len())]];
                    let Some(normal) = self.through(p, q) else {
                        continue;
                    };
                    let count = left
                        .iter()
                        .step_by(step)
                        .filter(|one| self.is_on_line(one, &p.at, &normal))
                        .count();
                    if best.as_ref().is_none_or(|&(most, ..)| count > most) {
                        best = Some((count, p.at, normal));
                    }
                }
            }
            let Some(line) = best.and_then(|(_, at, normal)| self.fitted_line(&left, at, normal))
            else {
                break;
            };
            let taken = distinct(line.touches.iter().copied());
            left.retain(|one| taken.binary_search(&one.touch).is_err());
            found.push(line);
        }
        found
    }

    /// Normal of a possible wall through two contacts.
    fn through(&self, p: &ProjectedContact, q: &ProjectedContact) -> Option<Vector2<f64>> {
        let apart = q.at - p.at;
        let length = apart.norm();
        if length < LEAST_RADII * self.radius || p.normal.dot(&q.normal) < ALIKE {
            return None;
        }
        let normal = Vector2::new(-apart.y, apart.x) / length;
        let normal = normal * normal.dot(&p.normal).signum();
        (normal.dot(&p.normal) > ALIKE && normal.dot(&q.normal) > ALIKE).then_some(normal)
    }

    fn is_on_line(&self, one: &ProjectedContact, at: &Point2<f64>, normal: &Vector2<f64>) -> bool {
        (one.at - at).dot(normal).abs() < SEARCHED * self.radius && one.normal.dot(normal) > ALIKE
    }

    /// The line through the longest connected run of contacts near a line; `None`: too few.
    fn fitted_line(
        &self,
        all: &[ProjectedContact],
        mut at: Point2<f64>,
        mut normal: Vector2<f64>,
    ) -> Option<WallLine> {
        let mut line = None;
        for _ in 0..3 {
            let along = Vector2::new(normal.y, -normal.x);
            let mut on: Vec<(f64, &ProjectedContact)> = all
                .iter()
                .filter(|one| self.is_on_line(one, &at, &normal))
                .map(|one| ((one.at - at).dot(&along), one))
                .collect();
            on.sort_by(|a, b| a.0.total_cmp(&b.0));
            let run = on
                .chunk_by(|a, b| b.0 - a.0 < GAP_RADII * self.radius)
                .max_by_key(|run| run.len())?;
            let is_long = run.last()?.0 - run.first()?.0 > LEAST_RADII * self.radius;
            if run.len() < LEAST || !is_long {
                return None;
            }
            let count = run.len() as f64;
            let middle = run
                .iter()
                .map(|(_, one)| one.at.coords)
                .sum::<Vector2<f64>>()
                / count;
            let [mut xx, mut xy] = [0.0; 2];
            for (_, one) in run {
                let v = one.at.coords - middle;
                xx += v.dot(&along).powi(2);
                xy += v.dot(&along) * v.dot(&normal);
            }
            let turned = normal - along * (xy / xx);
            (at, normal) = (Point2::from(middle), turned.normalize());
            let centres = run.iter().map(|(_, one)| one.at).collect();
            line = Some(WallLine {
                centres,
                touches: run.iter().map(|(_, one)| one.touch).collect(),
                at,
                normal,
            });
        }
        line
    }

    /// The void between two facing walls, with the share of them next to its land.
    fn between(&self, one: &WallLine, other: &WallLine) -> Option<(Slot, f64)> {
        let across = (one.normal - other.normal).try_normalize(0.0)?;
        let gap = (other.at - one.at).dot(&across);
        if one.normal.dot(&other.normal) > -PARALLEL || gap < 0.0 {
            return None;
        }
        let along = Vector2::new(across.y, -across.x);
        let span = |line: &WallLine| {
            let x = line.centres.iter().map(|p| (p - one.at).dot(&along));
            x.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            })
        };
        let [a, b] = [span(one), span(other)];
        let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
        let longest = (a[1] - a[0]).max(b[1] - b[0]);
        if high - low < FACING * longest {
            return None;
        }
        let origin = one.at + across * (gap / 2.0) + along * ((low + high) / 2.0);
        let [e, g] = self.plane;
        let in_space = |v: &Vector2<f64>| e * v.x + g * v.y;
        let heights = [one, other].map(|line| {
            let height = |&touch: &usize| self.touches[touch].point.coords.dot(&self.axis);
            let mut z: Vec<f64> = line.touches.iter().map(height).collect();
            z.sort_by(f64::total_cmp);
            // a wall beyond may lie on the same line
            let run = z
                .chunk_by(|a, b| b - a < LAYER_RADII * self.radius)
                .max_by_key(|run| run.len());
            let mut run = run.unwrap_or_default().to_vec();
            [0.0, 1.0].map(|end| {
                order_statistic(&mut run, OUTER + end * (1.0 - 2.0 * OUTER)).unwrap_or_default()
            })
        });
        let (bottom, top) = (
            heights[0][0].min(heights[1][0]),
            heights[0][1].max(heights[1][1]),
        );
        if heights[0][0].max(heights[1][0]) > heights[0][1].min(heights[1][1]) + self.radius {
            return None;
        }
        let void = Void {
            view: self,
            origin: Point3::from(in_space(&origin.coords) + self.axis * ((bottom + top) / 2.0)),
            along: in_space(&along),
            across: in_space(&across),
            gap,
            felt: (high - low) / 2.0,
            reach: [a[0].min(b[0]), a[1].max(b[1])].map(|x| x - (low + high) / 2.0),
            half_height: (top - bottom) / 2.0,
        };
        void.slot()
    }
}

/// A void between two walls, in the frame of a slot.
struct Void<'a> {
    view: &'a AxisView<'a>,
    /// middle of the touched part of both walls, m, in O
    origin: Point3<f64>,
    /// unit vectors along and across it
    along: Vector3<f64>,
    across: Vector3<f64>,
    /// distance between the lines of ball centres, m
    gap: f64,
    /// half length of the touched overlap of both walls, m
    felt: f64,
    /// touched range along it of either wall, m
    reach: [f64; 2],
    /// half of the touched height of the walls, m
    half_height: f64,
}

impl Void<'_> {
    fn width(&self) -> f64 {
        self.gap + 2.0 * self.view.radius
    }

    /// The contacts in the void or around its ends.
    fn contacts(&self, among: impl Iterator<Item = usize>) -> Vec<SlotContact> {
        let (r, w) = (self.view.radius, self.width());
        let local = |touch: usize| {
            let contact = &self.view.touches[touch];
            let (v, p) = (contact.centre - self.origin, contact.point - self.origin);
            let to = |v: &Vector3<f64>| {
                [
                    v.dot(&self.along),
                    v.dot(&self.across),
                    v.dot(&self.view.axis),
                ]
            };
            let ([x, y, _], [contact_x, contact_y, z]) = (to(&v), to(&p));
            let normal = Vector3::from(to(&contact.normal));
            let is_beside = x > self.reach[0] - w
                && x < self.reach[1] + w
                && y.abs() < self.gap / 2.0 + 0.3 * r;
            (is_beside && !contact.is_rejected).then_some(SlotContact {
                touch,
                x,
                y,
                contact_x,
                contact_y,
                z,
                normal,
            })
        };
        among.filter_map(local).collect()
    }

    /// End of the slot on one side, by the contacts that lean back from there.
    fn end(&self, contacts: &[SlotContact], sign: f64) -> Option<SlotEnd> {
        let (r, half) = (self.view.radius, self.gap / 2.0);
        let is_of = |one: &&SlotContact| {
            let is_level = one.z.abs() < self.half_height + r && one.normal.z.abs() < SQUARE;
            is_level && one.normal.x * sign < -END_LEAN && one.x * sign > self.felt - half.max(r)
        };
        let of_end: Vec<&SlotContact> = contacts.iter().filter(is_of).collect();
        // another slot may end beyond: the nearest counts
        let nearest = of_end
            .iter()
            .map(|one| one.x * sign)
            .fold(f64::INFINITY, f64::min);
        let of_end: Vec<&SlotContact> = of_end
            .into_iter()
            .filter(|one| one.x * sign < nearest + half.max(0.5 * r))
            .collect();
        if of_end.len() < END_CONTACTS {
            return None;
        }
        let half_width = self.width() / 2.0;
        // contacts and not centres: a ball that fills the end hardly moves in it
        let from_axis = |one: &SlotContact| {
            (half_width * half_width - one.contact_y.powi(2))
                .max(0.0)
                .sqrt()
        };
        let axis_at = |one: &SlotContact| one.contact_x * sign - from_axis(one);
        let middle_of = |place: &dyn Fn(&SlotContact) -> f64| {
            median(&mut of_end.iter().map(|one| place(one)).collect::<Vec<_>>())
        };
        let (round, flat) = (
            middle_of(&axis_at)?,
            middle_of(&|one| one.contact_x * sign)?,
        );
        let end_at = [
            middle_of(&|one| one.x * sign - (half * half - one.y * one.y).max(0.0).sqrt())?
                + half_width,
            middle_of(&|one| one.x * sign)? + r,
        ];
        let misfit = |off: f64, normal: &Vector2<f64>, expected: &Vector2<f64>| {
            let misfit = (off / (END_OFF * r)).powi(2)
                + (normal - expected).norm_squared() / END_TURNED.powi(2);
            misfit.min(MOST_MISFIT)
        };
        let mut costs = [0.0; 2];
        for one in &of_end {
            let normal = Vector2::new(one.normal.x * sign, one.normal.y).normalize();
            let of_circle = -Vector2::new(from_axis(one), one.contact_y) / half_width;
            costs[0] += misfit(axis_at(one) - round, &normal, &of_circle);
            costs[1] += misfit(one.contact_x * sign - flat, &normal, &-Vector2::x());
        }
        Some(SlotEnd {
            at: end_at.map(|at| at * sign),
            costs,
        })
    }

    /// The slot or pocket, and the share of its walls next to the land; `None`: no slot.
    #[expect(clippy::too_many_lines)]
    fn slot(&self) -> Option<(Slot, f64)> {
        let width = self.width();
        let contacts = self.contacts(self.view.kept.iter().copied());
        if self.has_island(&contacts) {
            return None;
        }
        // open ends are left to the mesh
        let ends = [self.end(&contacts, 1.0)?, self.end(&contacts, -1.0)?];
        let total = |shape: usize| ends[0].costs[shape] + ends[1].costs[shape];
        let shape = if total(0) <= total(1) {
            Ends::Round
        } else {
            Ends::Straight
        };
        let [high, low] = ends.map(|end| end.at[usize::from(shape == Ends::Straight)]);
        let length = high - low;
        if length < SQUARISH * width {
            return None;
        }
        let (axis, middle) = (
            self.view.axis,
            self.origin + self.along * ((high + low) / 2.0),
        );
        let openings = [axis, -axis].map(|out| self.land(&middle, &out));
        let out_at = match openings {
            [Some(up), Some(down)] => usize::from(down.distance < up.distance),
            [Some(_), None] => 0,
            [None, Some(_)] => 1,
            [None, None] => return None,
        };
        let (land, out) = (openings[out_at]?, if out_at == 0 { axis } else { -axis });
        let floor = self.floor(
            &self.contacts(0..self.view.touches.len()),
            &out,
            [low, high],
        );
        let is_reached = |end: &SurroundingSurface| {
            floor.is_none() && end.distance < self.half_height + self.view.radius
        };
        let opposite = openings[1 - out_at].filter(is_reached);
        let lowest = opposite.map_or(self.half_height, |end| end.distance);
        let down = floor.as_ref().map_or(lowest, |(_, distance)| *distance);
        let depth = land.distance + down;
        let is_through = if floor.is_some() {
            Some(false)
        } else {
            opposite.map(|_| true)
        };
        let (is_shut, is_boxed) = (floor.is_some(), shape == Ends::Straight);
        let is_long = length > width * if is_boxed { LONG_BOX } else { LONG };
        let is_pocket = !is_long && is_boxed && is_shut;
        let is_deep = width < depth * if is_shut { SHALLOW } else { WIDE };
        // the undercut of a T-slot, seen along it, has walls and ends too
        let is_one = is_deep && depth < DEEPEST * length && (is_long || is_pocket);
        let slot = || Slot {
            walls: Vec::new(),
            ends: [None; 2],
            shape,
            centre: middle + out * land.distance,
            out,
            direction: self.along,
            width,
            length,
            depth,
            through: is_through,
            floor: None,
            felt_floor: floor.map(|(touches, _)| touches).unwrap_or_default(),
            land: land.number,
            is_boxed: is_pocket,
            is_closed: true,
            is_aslant: false,
            area: length * depth,
        };
        is_one.then(|| (slot(), land.share))
    }

    /// Whether an island stands between the walls.
    fn has_island(&self, contacts: &[SlotContact]) -> bool {
        let r = self.view.radius;
        let is_between = |one: &&SlotContact| {
            let is_inside = one.x.abs() < self.felt && one.y.abs() < self.gap / 2.0 - 0.5 * r;
            is_inside && one.z.abs() < self.half_height && one.normal.y.abs() > ISLAND_LEAN
        };
        contacts.iter().filter(is_between).count() >= ISLAND
    }

    /// The plane, or the cylinder with the material inside, around the opening towards `out`.
    fn land(&self, middle: &Point3<f64>, out: &Vector3<f64>) -> Option<SurroundingSurface> {
        let (parted, r) = (self.view.parted, self.view.radius);
        let farthest = self.half_height + (2.0 * r).max(0.5 * self.width());
        let mut best: Option<SurroundingSurface> = None;
        for number in 0..parted.segmentation.segments.len() {
            let is_plane = parted
                .plane(number)
                .is_some_and(|plane| plane.normal().dot(out) > LAND);
            if !parted.is_strong(number) || !(is_plane || parted.is_shaft(number)) {
                continue;
            }
            let Some(distance) = parted.exit(number, middle, out) else {
                continue;
            };
            if distance < self.half_height - r || distance > farthest {
                continue;
            }
            let around = parted.around(number);
            let primitive = &parted.segment(number).primitive;
            let is_there = |beside: Point3<f64>| {
                let Some(up) = parted.exit(number, &beside, out) else {
                    return false;
                };
                let place = beside + out * up;
                let normal = primitive.distance_and_normal(&place).1;
                around
                    .closest(&place, LAND_OFF * r)
                    .is_some_and(|face| parted.facets.normal(face).dot(&normal) > ALIKE)
            };
            let mut count = 0;
            for (side, at) in [1.0, -1.0]
                .into_iter()
                .flat_map(|side| (0..PLACES).map(move |at| (side, at)))
            {
                let x = self.felt * (2.0 * at as f64 / (PLACES - 1) as f64 - 1.0);
                let beside = |off: f64| {
                    middle + self.along * x + self.across * (side * (self.width() / 2.0 + off))
                };
                count += usize::from(LAND_RADII.iter().any(|radii| is_there(beside(radii * r))));
            }
            let share = count as f64 / (2 * PLACES) as f64;
            if share > LAND_SHARE && best.is_none_or(|best| share > best.share) {
                best = Some(SurroundingSurface {
                    number,
                    distance,
                    share,
                });
            }
        }
        best
    }

    /// The contacts on the floor, with its distance below the middle, m.
    fn floor(
        &self,
        contacts: &[SlotContact],
        out: &Vector3<f64>,
        [low, high]: [f64; 2],
    ) -> Option<(Vec<u32>, f64)> {
        let r = self.view.radius;
        let side = -self.view.axis.dot(out).signum();
        let deepest = self.half_height + FLOOR_RADII * r;
        let is_of = |one: &&SlotContact| {
            let is_inside =
                one.x > low && one.x < high && one.y.abs() < self.gap / 2.0 + SEARCHED * r;
            is_inside
                && one.normal.z * side < -FLOOR_LEAN
                && one.z * side > self.half_height - 0.5 * r
                && one.z * side < deepest
        };
        let of_floor: Vec<&SlotContact> = contacts.iter().filter(is_of).collect();
        let level = median(&mut of_floor.iter().map(|one| one.z * side).collect::<Vec<_>>())?;
        let on = of_floor
            .iter()
            .filter(|one| (one.z * side - level).abs() < FLOOR_OFF * r);
        let on: Vec<u32> = on.map(|one| one.touch as u32).collect();
        (on.len() >= FLOOR_CONTACTS).then_some((on, level))
    }
}

/// Surface around an opening.
#[derive(Clone, Copy)]
struct SurroundingSurface {
    /// number of the segment
    number: usize,
    /// distance from the middle of the slot, m
    distance: f64,
    /// share of the places beside the walls on it
    share: f64,
}
