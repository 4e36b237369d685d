//! Slots and pockets: two planes that face each other over a void.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::borders::{Borders, is_convex};
use super::fit::{Ends, Plane, SurfaceModel};
use super::segmentation::bodies::Surroundings;
use super::segmentation::facets::NONE;
use super::segmentation::primitive::Primitive;
use super::segmentation::rays::{RayHit, Rays};
use super::segmentation::scene::SegmentedMesh;
use super::walls::Wall;
use touchup_geometry::numeric::{mean, without_repeats};

/// A void between two walls that face each other.
#[derive(Clone, Debug)]
pub(super) struct Slot {
    /// numbers of the walls; empty if contacts alone show them
    pub walls: Vec<usize>,
    /// numbers of the segments that end it, `None` if open or without a named segment
    pub ends: [Option<usize>; 2],
    /// shape of its ends
    pub shape: Ends,
    /// middle of the opening, m, in O
    pub centre: Point3<f64>,
    /// unit vector out of the opening
    pub out: Vector3<f64>,
    /// unit vector along it
    pub direction: Vector3<f64>,
    /// m
    pub width: f64,
    /// m; at an open end to the ends of the walls
    pub length: f64,
    /// m
    pub depth: f64,
    /// `None`: neither a touched floor nor an opening on the other side
    pub through: Option<bool>,
    /// number of the plane of its floor
    pub floor: Option<usize>,
    /// numbers of the touches on its floor, if contacts alone show it
    pub felt_floor: Vec<u32>,
    /// number of the plane, or of the cylinder with the material inside, around the opening
    pub land: usize,
    /// whether planes close both ends, so that only a long one is a slot
    pub is_boxed: bool,
    /// whether both ends exist
    pub is_closed: bool,
    /// whether a wall aslant closes an end: a recess of another outline
    pub is_aslant: bool,
    /// facing area of the walls, m²
    pub area: f64,
}

impl Slot {
    /// Numbers of its walls, then of its ends.
    pub(crate) fn segments(&self) -> impl Iterator<Item = usize> {
        let ends = self.ends.into_iter().flatten();
        self.walls.iter().copied().chain(ends)
    }

    /// Whether the middle of another void is between its walls, and both overlap over more than
    /// half of the depth of the shallower: their apparent depths may differ.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        let v = other.centre - self.centre;
        let middle = v - other.out * (other.depth / 2.0);
        let across = self.out.cross(&self.direction);
        let is_between = middle.dot(&across).abs() < self.width / 2.0
            && middle.dot(&self.direction).abs() < self.length / 2.0;
        let top = v.dot(&self.out);
        let bottom = top - other.depth * other.out.dot(&self.out);
        let overlap = top.max(bottom).min(0.0) - top.min(bottom).max(-self.depth);
        is_between && overlap > self.depth.min(other.depth) / 2.0
    }
}

/// Walls are parallel within 6°.
const PARALLEL: f64 = 0.9945;
/// A land or a floor is square to the walls within 9°.
const SQUARE: f64 = 0.15;
/// Number of points on a wall with rays across.
const SAMPLES: usize = 60;
/// Minimum share of the smaller wall that faces the other.
const LEAST_SHARE: f64 = 0.2;
/// Range of the turn of a half-round end, as shares, and minimum cosine of its direction to its
/// side of the slot.
const END_TURN: std::ops::Range<f64> = 0.42..0.75;
const AWAY: f64 = 0.7;
/// Axes of both ends are parallel within 12°: short ends hardly determine one.
const ENDS_PARALLEL: f64 = 0.978;
/// Maximum distance of two ends of a slot, in widths.
const LONGEST: f64 = 8.0;
/// Width of a ring around an end, in widths of the end.
const RINGS: f64 = 1.15;
/// Minimum length of a slot, in widths; and with flat ends.
pub(super) const LONG: f64 = 1.2;
pub(super) const LONG_BOX: f64 = 2.0;
/// Maximum width of a slot with an open end or without a floor, in depths.
pub(super) const WIDE: f64 = 3.0;
/// Maximum width of a pocket or a closed slot, in depths: shallower is a step that an uneven
/// surface has too.
pub(super) const SHALLOW: f64 = 12.0;
/// Minimum length of a pocket, in widths: allows for the sides of a square one.
pub(super) const SQUARISH: f64 = 0.95;
/// Minimum facing share of a pocket's walls.
const POCKET_SHARE: f64 = 0.5;
/// Cosine between a slot and the normal of a wall that closes it aslant: 20° to 75°.
const ASLANT: std::ops::Range<f64> = 0.26..0.94;
/// Tolerance of widths and positions of one void, as a share of the width.
const SAME: f64 = 0.4;
/// Tolerance of the axis of an end, as a share of the width.
const ABOUT: f64 = 0.1;
/// Ratio above which lengths are the same.
const AS_LONG: f64 = 0.999;
/// Offset from a wall of a line that starts on it, as a share of the width.
const OFF: f64 = 1e-3;
/// Maximum width of a void, and search distance across it, in diagonals.
const FARTHEST: f64 = 1.5;
/// Number of pieces of a line across the part.
const PIECES: f64 = 64.0;
/// Minimum distance of two faces on a line, in diagonals.
const APART: f64 = 1e-9;
/// Maximum number of faces on a line before the wall across: more are no wall.
const MOST_MET: usize = 8;

/// All slots, and all pockets.
///
/// - `of_face`: the segment of each face, seams included.
pub(super) fn slots(
    parted: &SegmentedMesh,
    walls: &[Wall],
    of_face: &[u32],
    borders: &Borders,
) -> (Vec<Slot>, Vec<Slot>) {
    let planes: Vec<_> = parted
        .planes()
        .filter(|&(number, ..)| parted.is_strong(number))
        .collect();
    let (mut slots, mut pockets): (Vec<Slot>, Vec<Slot>) = (Vec::new(), Vec::new());
    let mut views = BTreeMap::new();
    for (at, &(i, p, n)) in planes.iter().enumerate() {
        for &(j, q, m) in &planes[..at] {
            let is_facing = n.dot(&m) < -PARALLEL && (q - p).dot(&n) > 0.0 && (p - q).dot(&m) > 0.0;
            if !is_facing {
                continue;
            }
            let Some((slot, share)) = between(parted, of_face, borders, &mut views, [i, j]) else {
                continue;
            };
            let is_slot = slot.length > if slot.is_boxed { LONG_BOX } else { LONG } * slot.width;
            let is_shut = slot.floor.is_some() && slot.is_closed;
            let widest = if is_shut { SHALLOW } else { WIDE };
            if is_slot && !slot.is_aslant && slot.width < widest * slot.depth {
                slots.push(slot);
            } else if !is_slot && share > POCKET_SHARE && is_pocket(&slot) {
                pockets.push(slot);
            }
        }
    }
    slots.extend(between_round_ends(parted, of_face, walls));
    (
        distinct(slots, is_same_slot),
        distinct(pockets, is_same_pocket),
    )
}

/// Slots with both half-round ends: the walls between may be in pieces, or hardly there.
fn between_round_ends(parted: &SegmentedMesh, of_face: &[u32], walls: &[Wall]) -> Vec<Slot> {
    let is_end =
        |wall: &&Wall| wall.is_concave && !wall.is_cone() && END_TURN.contains(&wall.coverage);
    let ends: Vec<&Wall> = walls.iter().filter(is_end).collect();
    let mut slots = Vec::new();
    for (at, one) in ends.iter().enumerate() {
        for other in &ends[..at] {
            slots.extend(slot_of_ends(parted, of_face, [one, other]));
        }
    }
    slots
}

/// Unit vector from one to the other of two half-round walls, each open towards the other, and the
/// distance of their axes, m.
fn facing_ends(one: &Wall, other: &Wall) -> Option<(Vector3<f64>, f64)> {
    let width = one.radius() + other.radius();
    let axis = one.axis;
    let is_alike = (one.radius() - other.radius()).abs() < ABOUT * width
        && axis.dot(&other.axis).abs() > ENDS_PARALLEL;
    let v = other.at(other.middle()) - one.at(one.middle());
    let apart = v - axis * v.dot(&axis);
    let is_beside = v.dot(&axis).abs() < (one.height() + other.height()) / 2.0;
    let distance = apart.norm();
    let is_far = distance > (LONG - 1.0) * width && distance < LONGEST * width;
    if !is_alike || !is_beside || !is_far {
        return None;
    }
    let direction = apart / distance;
    let is_away = one.towards.dot(&direction) < -AWAY && other.towards.dot(&direction) > AWAY;
    is_away.then_some((direction, distance))
}

/// The opening on the side of a plane, or a cylinder, around one of two half-round walls: its
/// outward direction, the number of that land, and the distance of its plane from `middle`, m.
fn land_of_ends(
    parted: &SegmentedMesh,
    around: &Surroundings,
    ends: [&Wall; 2],
    middle: &Point3<f64>,
) -> Option<(Vector3<f64>, usize, f64)> {
    let width = ends[0].radius() + ends[1].radius();
    let rings = [RINGS * width / 2.0];
    [1.0, -1.0].into_iter().find_map(|sign| {
        let out = ends[0].axis * sign;
        ends.into_iter().find_map(|end| {
            let t = end.ends[usize::from(end.axis.dot(&out) > 0.0)];
            let (land, _) = parted
                .land_around(around, &end.at(t), &out, &rings, 0.2 * width)
                .filter(|&(_, share)| share > 0.2)?;
            let up = parted.exit(land, middle, &out).filter(|&up| up > 0.0)?;
            Some((out, land, up))
        })
    })
}

/// The slot between two half-round walls, each open towards the other.
fn slot_of_ends(parted: &SegmentedMesh, of_face: &[u32], ends: [&Wall; 2]) -> Option<Slot> {
    let [one, other] = ends;
    let width = one.radius() + other.radius();
    let axis = one.axis;
    let (direction, distance) = facing_ends(one, other)?;
    let middle = nalgebra::center(&one.at(one.middle()), &other.at(other.middle()));
    let across = axis.cross(&direction);
    let around = parted.around(one.segments[0]);
    let mut rays = around.rays(width);
    // nothing stands between them
    if [direction, -direction]
        .iter()
        .any(|along| rays.free(&middle, along, distance) < distance / 2.0)
    {
        return None;
    }
    let sides = [across, -across].map(|out| rays.first(&middle, &out, 1.2 * width));
    // a recess of another outline is wider there, or narrower
    let is_straight = |met: &RayHit| (met.distance - width / 2.0).abs() < ABOUT * width;
    if sides.iter().all(Option::is_none) || !sides.iter().flatten().all(is_straight) {
        return None;
    }
    let sides = sides.map(|met| segment_met(of_face, met));
    let (out, land, up) = land_of_ends(parted, &around, ends, &middle)?;
    if rays.free(&middle, &out, up + width) < up + width / 2.0 {
        return None;
    }
    let lowest = |wall: &Wall| {
        wall.ends
            .map(|t| (wall.at(t) - middle).dot(&-out))
            .into_iter()
            .fold(0.0, f64::max)
    };
    let deepest = lowest(one).max(lowest(other));
    let met = rays.first(&middle, &-out, deepest + width);
    let floor = segment_met(of_face, met).filter(|&number| is_square(parted, number, &out));
    let down = floor
        .and_then(|number| parted.exit(number, &middle, &-out))
        .or(met.map(|met| met.distance))
        .unwrap_or(deepest);
    let [from, to] = ends.map(|wall| wall.segments[0]);
    Some(Slot {
        walls: vec![sides[0].unwrap_or(from), sides[1].unwrap_or(to)],
        ends: [Some(to), Some(from)],
        shape: Ends::Round,
        centre: middle + out * up,
        out,
        direction,
        width,
        length: distance + width,
        depth: up + down,
        through: Some(met.is_none()),
        floor,
        felt_floor: Vec::new(),
        land,
        is_boxed: false,
        is_closed: true,
        is_aslant: false,
        // existing flat walls take precedence
        area: 0.0,
    })
}

/// Whether a void with flat ends is a pocket, seen by the pair of walls that is closer.
fn is_pocket(slot: &Slot) -> bool {
    let is_closed = slot.is_boxed && slot.floor.is_some();
    is_closed && slot.length > SQUARISH * slot.width && slot.width < SHALLOW * slot.depth
}

/// Drops repeated views of a void by several pairs of walls: the largest pair names it.
fn distinct(mut all: Vec<Slot>, is_same: fn(&Slot, &Slot) -> bool) -> Vec<Slot> {
    all.sort_by(|a, b| b.area.total_cmp(&a.area));
    without_repeats(all, is_same)
}

/// Whether two views by pairs of walls are one pocket.
fn is_same_pocket(one: &Slot, other: &Slot) -> bool {
    (one.centre - other.centre).norm() < SAME * one.width
}

/// Whether two voids are one slot, whose walls may be in pieces.
fn is_same_slot(one: &Slot, other: &Slot) -> bool {
    let between = other.centre - one.centre;
    let along = between.dot(&one.direction);
    let aside = (between - one.direction * along - one.out * between.dot(&one.out)).norm();
    one.direction.dot(&other.direction).abs() > PARALLEL
        && (one.width - other.width).abs() < SAME * one.width
        && aside < SAME * one.width
        && along.abs() < (one.length + other.length) / 2.0
}

/// Faces across from a point of a wall.
struct OppositeFaces {
    from: Point3<f64>,
    /// faces on the line along the normal: distance, m, and segment; up to the first beyond the
    /// wall itself, however wide the void
    met: Vec<(f64, u32)>,
}

impl OppositeFaces {
    /// The first segment across a void of `width`.
    fn across(&self, width: f64) -> Option<u32> {
        let &(distance, segment) = self
            .met
            .iter()
            .find(|(distance, _)| *distance >= OFF * width)?;
        (distance <= (1.1 + OFF) * width).then_some(segment)
    }
}

/// Views from the points of a wall, computed once: many other walls may face it.
fn views(
    parted: &SegmentedMesh,
    of_face: &[u32],
    wall: usize,
    normal: &Vector3<f64>,
) -> Vec<OppositeFaces> {
    let mut rays = parted.around(wall).rays(parted.diagonal / PIECES);
    let farthest = FARTHEST * parted.diagonal;
    let mut view = |from: Point3<f64>| {
        let (mut met, mut at) = (Vec::new(), APART * parted.diagonal);
        while met.len() < MOST_MET
            && met
                .last()
                .is_none_or(|&(distance, _)| distance < OFF * farthest)
        {
            let Some(hit) = rays.first(&(from + normal * at), normal, farthest - at) else {
                break;
            };
            met.push((at + hit.distance, of_face[hit.face.0 as usize]));
            at += hit.distance + APART * parted.diagonal;
        }
        OppositeFaces { from, met }
    };
    samples(parted, wall).into_iter().map(&mut view).collect()
}

/// The void between two walls, and the share of the smaller one that faces the other.
///
/// - `seen`: views of the walls until now.
fn between(
    parted: &SegmentedMesh,
    of_face: &[u32],
    borders: &Borders,
    seen: &mut BTreeMap<usize, Vec<OppositeFaces>>,
    walls: [usize; 2],
) -> Option<(Slot, f64)> {
    let planes = [parted.plane(walls[0])?, parted.plane(walls[1])?];
    let n = planes[0].normal();
    // across from the smaller wall: the larger one may go on far beyond
    let [from, to] = if parted.segment(walls[0]).area < parted.segment(walls[1]).area {
        walls
    } else {
        [walls[1], walls[0]]
    };
    let (normal, opposite) = (parted.plane(from)?.normal(), parted.plane(to)?);
    let starts = seen
        .entry(from)
        .or_insert_with(|| views(parted, of_face, from, &normal));
    let mut middles = Vec::new();
    for view in &*starts {
        let width = opposite.along(&view.from, &normal)?;
        if width > 0.0 && view.across(width) == Some(to as u32) {
            middles.push(view.from + normal * (width / 2.0));
        }
    }
    let share = middles.len() as f64 / starts.len().max(1) as f64;
    if share < LEAST_SHARE {
        return None;
    }
    let centroid = Point3::from(mean(middles.iter().map(|p| p.coords)));
    let far = |p: &Point3<f64>| (p - centroid).norm();
    let middle = *middles.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let width = planes[1].along(&middle, &n)? + planes[0].along(&middle, &-n)?;
    let area = share * parted.segment(from).area;
    let lands = lands(parted, borders, walls, &middle, &n);
    let seen = lands.into_iter().filter_map(|(land, out)| {
        opened(
            parted,
            of_face,
            &SlotCandidate {
                walls,
                middle,
                across: n,
                width,
                land,
                out,
                area,
            },
        )
    });
    let seen: Vec<Slot> = seen.collect();
    let longest = seen.iter().map(|slot| slot.length).fold(0.0, f64::max);
    // equally long from both of its sides, as the neck of a T-slot: from the deeper side
    let deepest = seen
        .into_iter()
        .filter(|slot| slot.length > AS_LONG * longest);
    let deepest = deepest.max_by(|a, b| a.depth.total_cmp(&b.depth))?;
    Some((deepest, share))
}

/// Points of a segment, spread over its faces.
pub(super) fn samples(parted: &SegmentedMesh, number: usize) -> Vec<Point3<f64>> {
    let faces = &parted.segment(number).faces;
    let step = faces.len().div_ceil(SAMPLES).max(1);
    let each = (SAMPLES / faces.len().max(1)).clamp(1, 16);
    let rows = (each as f64).sqrt() as usize;
    let mut points = Vec::new();
    for &face in faces.iter().step_by(step) {
        let [a, b, c] = parted.facets.triangle(face);
        for k in 0..rows * rows {
            // a lattice of the unit square, folded onto the triangle
            let (u, v) = ((k % rows) as f64 + 0.4, (k / rows) as f64 + 0.4);
            let (u, v) = (u / rows as f64, v / rows as f64);
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// Planes and cylinders around an opening: they fall away from one of the walls, square to both.
/// With the outward direction at the middle of the void.
fn lands(
    parted: &SegmentedMesh,
    borders: &Borders,
    walls: [usize; 2],
    middle: &Point3<f64>,
    across: &Vector3<f64>,
) -> Vec<(usize, Vector3<f64>)> {
    let mut lands: Vec<(usize, Vector3<f64>)> = Vec::new();
    for (pair, border) in borders {
        let [a, b] = pair.map(|number| number as usize);
        let land = if walls.contains(&a) { b } else { a };
        if walls.contains(&a) == walls.contains(&b) {
            continue;
        }
        if parted.plane(land).is_none() && !parted.is_shaft(land) {
            continue;
        }
        let out = parted.segment(land).primitive.distance_and_normal(middle).1;
        let is_new = lands.iter().all(|(_, other)| other.dot(&out) < PARALLEL);
        if is_new && out.dot(across).abs() < SQUARE && is_convex(parted, border, [a, b]) {
            let out = (out - across * out.dot(across)).normalize();
            lands.push((land, out));
        }
    }
    lands
}

/// Two walls that may bound a slot, seen from one of the planes around them.
struct SlotCandidate {
    walls: [usize; 2],
    middle: Point3<f64>,
    across: Vector3<f64>,
    width: f64,
    land: usize,
    out: Vector3<f64>,
    area: f64,
}

/// An end of a void between two walls.
struct VoidEnd {
    segment: Option<usize>,
    /// distance from the middle, m
    distance: f64,
    is_flat: bool,
    /// whether a wall aslant closes it
    is_aslant: bool,
}

impl SlotCandidate {
    /// Distance along a direction to the nearer end of both walls, m: one of them may go on beyond
    /// the slot.
    fn walls_end(&self, parted: &SegmentedMesh, along: &Vector3<f64>) -> f64 {
        let of_wall = |number: usize| {
            let corners = parted
                .segment(number)
                .faces
                .iter()
                .flat_map(|&face| parted.facets.triangle(face));
            corners
                .map(|p| (p - self.middle).dot(along))
                .fold(0.0, f64::max)
        };
        of_wall(self.walls[0]).min(of_wall(self.walls[1]))
    }

    /// The end along a direction.
    fn end_along(
        &self,
        parted: &SegmentedMesh,
        of_face: &[u32],
        rays: &mut Rays,
        along: &Vector3<f64>,
    ) -> VoidEnd {
        let (out, width) = (&self.out, self.width);
        let walls_end = self.walls_end(parted, along);
        let met = rays
            .first(&self.middle, along, parted.diagonal)
            .filter(|met| met.distance < walls_end + 1.5 * width);
        let distance = met.map_or(walls_end, |met| met.distance);
        let number = segment_met(of_face, met);
        let is_flat = number.is_some_and(|number| is_square(parted, number, along));
        let is_aslant = number.is_some_and(|number| is_wall_aslant(parted, number, along, out));
        // a floor that only reaches there over a seam is no end
        let met = number.filter(|&number| is_flat || is_round_end(parted, number, out, width));
        let segment = met.or_else(|| {
            let middle = self.middle + along * (distance - width / 2.0);
            round_end_about(parted, &middle, out, width)
        });
        VoidEnd {
            segment,
            distance,
            is_flat,
            is_aslant,
        }
    }
}

fn opened(parted: &SegmentedMesh, of_face: &[u32], seen: &SlotCandidate) -> Option<Slot> {
    let SlotCandidate {
        walls,
        middle,
        across,
        width,
        land,
        out,
        area,
    } = *seen;
    let mut rays = parted.around(walls[0]).rays(width);
    let reach = parted.diagonal;
    let up = parted.exit(land, &middle, &out)?;
    if up < 0.0 || rays.free(&middle, &out, reach) < up + width / 2.0 {
        return None;
    }
    let below = rays.first(&middle, &-out, reach);
    // a floor far below belongs to something else
    let deepest = seen.walls_end(parted, &-out) + 2.0 * width;
    let met = below.filter(|met| met.distance < deepest);
    let flat_floor = segment_met(of_face, met).filter(|&number| is_square(parted, number, &out));
    let down = match (flat_floor, met) {
        (Some(number), _) => parted.plane(number)?.along(&middle, &-out)?,
        (None, Some(met)) => met.distance,
        (None, None) => seen.walls_end(parted, &-out),
    };
    let direction = out.cross(&across).normalize();
    let [one, other] =
        [direction, -direction].map(|along| seen.end_along(parted, of_face, &mut rays, &along));
    let ends = [one.segment, other.segment];
    let centre = middle + out * up + direction * ((one.distance - other.distance) / 2.0);
    let is_round =
        |&number: &usize| matches!(parted.segment(number).primitive, Primitive::Cylinder(_));
    let shape = if ends.iter().flatten().any(is_round) {
        Ends::Round
    } else {
        Ends::Straight
    };
    Some(Slot {
        walls: walls.to_vec(),
        ends,
        shape,
        centre,
        out,
        direction,
        width,
        length: one.distance + other.distance,
        depth: up + down,
        through: Some(met.is_none()),
        floor: flat_floor,
        felt_floor: Vec::new(),
        land,
        is_boxed: one.is_flat && other.is_flat,
        is_closed: ends.iter().all(Option::is_some),
        is_aslant: one.is_aslant || other.is_aslant,
        area,
    })
}

/// The segment met by a ray.
fn segment_met(of_face: &[u32], met: Option<RayHit>) -> Option<usize> {
    let number = of_face[met?.face.0 as usize];
    (number != NONE).then_some(number as usize)
}

/// Whether a segment is a plane square to `along`.
fn is_square(parted: &SegmentedMesh, number: usize, along: &Vector3<f64>) -> bool {
    parted
        .plane(number)
        .is_some_and(|plane| plane.normal().dot(along).abs() > PARALLEL.powi(4))
}

/// Whether a segment is an upright wall that `along` meets aslant.
fn is_wall_aslant(
    parted: &SegmentedMesh,
    number: usize,
    along: &Vector3<f64>,
    out: &Vector3<f64>,
) -> bool {
    let Some(normal) = parted.plane(number).map(Plane::normal) else {
        return false;
    };
    ASLANT.contains(&-normal.dot(along)) && normal.dot(out).abs() < SQUARE
}

/// The half-round end about a point: with few touches the wall may be in pieces, and the line may
/// meet another.
fn round_end_about(
    parted: &SegmentedMesh,
    middle: &Point3<f64>,
    out: &Vector3<f64>,
    width: f64,
) -> Option<usize> {
    let is_there = |number: usize| match parted.segment(number).primitive {
        Primitive::Cylinder(end) => {
            (middle - end.center()).cross(&end.axis()).norm() < ABOUT * width
        }
        _ => false,
    };
    // the largest first
    (0..parted.segmentation.segments.len())
        .find(|&at| is_there(at) && is_round_end(parted, at, out, width))
}

/// Whether a segment is a half-round end of a slot.
fn is_round_end(parted: &SegmentedMesh, number: usize, out: &Vector3<f64>, width: f64) -> bool {
    let Primitive::Cylinder(end) = parted.segment(number).primitive else {
        return false;
    };
    end.concave
        && end.axis().dot(out).abs() > PARALLEL
        && (2.0 * end.radius - width).abs() < 0.2 * width
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(top: f64, depth: f64) -> Slot {
        Slot {
            walls: Vec::new(),
            ends: [None; 2],
            shape: Ends::Round,
            centre: Point3::new(0.0, 0.0, top),
            out: Vector3::z(),
            direction: Vector3::x(),
            width: 6.0,
            length: 20.0,
            depth,
            through: None,
            floor: None,
            felt_floor: Vec::new(),
            land: 0,
            is_boxed: false,
            is_closed: true,
            is_aslant: false,
            area: 0.0,
        }
    }

    #[test]
    fn a_void_is_the_same_however_deep_it_is_seen_and_a_step_of_it_is_not() {
        let upside_down = Slot {
            centre: Point3::new(0.0, 0.0, -11.0),
            out: -Vector3::z(),
            ..slot(0.0, 11.0)
        };
        // touched at its top alone, and closed in the mesh far below; or seen from below
        for other in [slot(0.0, 11.0), slot(0.1, 3.0), upside_down] {
            assert!(slot(0.0, 4.0).holds(&other) && other.holds(&slot(0.0, 4.0)));
        }
        // in its floor, and farther along
        assert!(!slot(0.0, 4.0).holds(&slot(-4.0, 3.0)));
        assert!(!slot(0.0, 4.0).holds(&slot(4.0, 4.5)));
        let beyond = Slot {
            centre: Point3::new(22.0, 0.0, 0.0),
            ..slot(0.0, 4.0)
        };
        assert!(!slot(0.0, 4.0).holds(&beyond));
    }
}
