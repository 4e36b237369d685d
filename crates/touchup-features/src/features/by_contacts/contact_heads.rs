//! Heads of counterbored holes by contacts: a wall around a bore, with a floor between both.
//!
//! A ball of radius r in a head rests on its floor and against its wall at once, and against its
//! edge if the head is shallower than r: the force is the sum of two, with the direction of
//! neither. The position of the centre is enough: with its centre below the land around the opening
//! the ball is r away from the wall, and h above the land it is √(r² − h²) away from the edge.

use nalgebra::{Point3, Vector3};

use crate::features::feature::{Feature, FeatureKind, FittedTo};
use crate::features::fit::{Cylinder, FitParams, Observation, fit};
use crate::features::measure::{FittedSurface, Measure};
use crate::features::observe::SegmentTouches;
use touchup_geometry::numeric::{median, tangent_basis};

/// Widths of heads, in bores.
const HEADS: std::ops::Range<f64> = 1.15..3.5;
/// Minimum lean towards the axis of the normal of a contact on a wall or an edge, as a share.
const LEAN: f64 = 0.2;
/// Cosine of the maximum lean of a contact on the floor: 25°.
const LEVEL: f64 = 0.906;
/// Tolerance of one circle, or one level, of contacts, as a share of the ball's radius.
const SEARCHED: f64 = 0.12;
/// Parts of a turn; minimum shares of a turn with contacts on wall and floor; minimum number of
/// contacts.
const PARTS: usize = 24;
const TURN: f64 = 0.6;
const FLOOR_TURN: f64 = 0.4;
const LEAST: usize = 24;
/// Depths of heads, in radii of the ball.
const DEPTHS: std::ops::Range<f64> = 0.25..3.0;
/// A land is square to the axis within 6°.
const SQUARE: f64 = 0.9945;

/// The head of a counterbored hole.
pub(in crate::features) struct Counterbore {
    pub wall: FittedSurface<Cylinder>,
    /// numbers of the touches on its floor
    pub floor: Vec<u32>,
    /// number of the plane around its opening
    pub land: usize,
    /// unit vector out of it
    pub out: Vector3<f64>,
    /// depth of its floor below the land, m
    pub depth: f64,
}

/// A contact seen from the axis of a bore.
#[derive(Clone, Copy)]
struct BoreContact {
    touch: u32,
    /// height of the centre along the axis, m
    z: f64,
    /// distance from the axis, m
    rho: f64,
    /// part of a turn
    part: usize,
    /// share of the normal along the axis, and towards it
    up: f64,
    inward: f64,
}

/// The head around a touched bore, above its floor; `None` if contacts show none.
pub(in crate::features) fn head_of(measure: &Measure, bore: &Feature) -> Option<Counterbore> {
    let observed = measure.observed;
    let (axis, narrow) = (
        bore.axis.as_ref()?.value,
        bore.diameter.as_ref()?.value / 2.0,
    );
    if bore.kind != FeatureKind::Hole || bore.fitted_to != FittedTo::Touches {
        return None;
    }
    [axis, -axis]
        .into_iter()
        .find_map(|out| head_towards(observed, &bore.centre.value, &out, narrow))
}

fn head_towards(
    observed: &SegmentTouches,
    on_axis: &Point3<f64>,
    out: &Vector3<f64>,
    narrow: f64,
) -> Option<Counterbore> {
    let radius = observed.reach();
    let seen = seen_from(observed, on_axis, out, narrow * HEADS.end);
    let parted = observed.parted;
    let is_land = |&number: &usize| {
        parted.is_strong(number)
            && parted
                .plane(number)
                .is_some_and(|plane| plane.normal().dot(out) > SQUARE)
    };
    (0..parted.segmentation.segments.len())
        .filter(is_land)
        .find_map(|land| {
            let level = parted.plane(land)?.along(on_axis, out)?;
            let head = head_under(observed, &seen, on_axis, out, (narrow, level, land))?;
            let around = parted.around(land);
            let ring = [head.wall.surface.radius + 0.5 * radius];
            let top = head.wall.surface.nearest_on_axis(&(on_axis + out * level));
            let (number, share) = parted.plane_around(&around, &top, out, &ring, 0.3 * radius)?;
            (number == land && share > FLOOR_TURN).then_some(head)
        })
}

/// Contacts around an axis.
fn seen_from(
    observed: &SegmentTouches,
    on_axis: &Point3<f64>,
    out: &Vector3<f64>,
    widest: f64,
) -> Vec<BoreContact> {
    let [e, g] = tangent_basis(out);
    let seen = observed.sound().filter_map(|(touch, contact)| {
        let v = contact.centre - on_axis;
        let z = v.dot(out);
        let aside = v - out * z;
        let rho = aside.norm();
        let turn = aside.dot(&g).atan2(aside.dot(&e)) / std::f64::consts::TAU;
        let part = ((turn * PARTS as f64).floor() as i64).rem_euclid(PARTS as i64) as usize;
        let inward = if rho > 0.0 {
            -contact.normal.dot(&aside) / rho
        } else {
            0.0
        };
        (rho < widest).then_some(BoreContact {
            touch,
            z,
            rho,
            part,
            up: contact.normal.dot(out),
            inward,
        })
    });
    seen.collect()
}

/// Share of a turn with contacts.
fn turn_of<'a>(of: impl Iterator<Item = &'a BoreContact>) -> f64 {
    let mut parts = [false; PARTS];
    of.for_each(|one| parts[one.part] = true);
    parts.iter().filter(|part| **part).count() as f64 / PARTS as f64
}

/// A contact of a wall: radius of the wall, distance of the ball's centre from it, m, and itself.
type WallContact<'a> = (f64, f64, &'a BoreContact);

/// Radius of the wall with contacts over most of a turn, m.
///
/// - `near`: tolerance of one circle, m.
fn most_felt_width(walls: &[WallContact], near: f64) -> Option<f64> {
    let on = |wide: f64| {
        walls
            .iter()
            .filter(move |(other, ..)| (other - wide).abs() < near)
    };
    let candidates = walls
        .iter()
        .step_by(walls.len().div_ceil(200).max(1))
        .map(|(wide, ..)| *wide);
    let counted = candidates.map(|wide| {
        (
            turn_of(on(wide).map(|(.., one)| *one)),
            on(wide).count(),
            wide,
        )
    });
    let best = counted.filter(|&(turn, count, _)| turn >= TURN && count >= LEAST);
    let (.., wide) = best.max_by(|a, b| {
        (a.0, a.1)
            .partial_cmp(&(b.0, b.1))
            .unwrap_or(std::cmp::Ordering::Equal)
    })?;
    Some(wide)
}

/// The wall of a head by its contacts.
fn head_wall(
    observed: &SegmentTouches,
    of_wall: &[&WallContact],
    guess: &Cylinder,
) -> Option<FittedSurface<Cylinder>> {
    let numbers: Vec<u32> = of_wall.iter().map(|(.., one)| one.touch).collect();
    let observations: Vec<Observation> = observed
        .of_touches(&numbers)
        .into_iter()
        .zip(of_wall)
        .map(|(observation, (_, away, _))| Observation {
            offset: *away,
            ..observation
        })
        .collect();
    let params = FitParams {
        axis_sigma: Some(1e-3),
        ..observed.fit_params(&numbers)
    };
    let found = fit(guess, &observations, &params).ok()?;
    let touches = numbers
        .into_iter()
        .zip(&found.used)
        .filter(|&(_, used)| *used)
        .map(|(touch, _)| touch)
        .collect();
    let surface = found.surface;
    Some(FittedSurface {
        surface,
        fit: Some(found),
        touches,
        to: FittedTo::Touches,
        uneven: 0.0,
        is_confirmed: true,
    })
}

/// The head under a land.
///
/// - `narrow`, `level`, `land`: radius of the bore, m; distance of the land along `out`, m; its
///   number
fn head_under(
    observed: &SegmentTouches,
    seen: &[BoreContact],
    on_axis: &Point3<f64>,
    out: &Vector3<f64>,
    (narrow, level, land): (f64, f64, usize),
) -> Option<Counterbore> {
    let radius = observed.reach();
    // distance of the ball's centre from the wall or its edge
    let away = |one: &BoreContact| {
        let above = (one.z - level).max(0.0);
        (above < radius).then(|| (radius * radius - above * above).sqrt())
    };
    let is_beside = |one: &&BoreContact| one.inward > LEAN && one.z > level - DEPTHS.end * radius;
    let walls: Vec<WallContact> = seen
        .iter()
        .filter(is_beside)
        .filter_map(|one| Some((one.rho + away(one)?, away(one)?, one)))
        .filter(|(wide, ..)| HEADS.contains(&(wide / narrow)))
        .collect();
    let near = SEARCHED * radius;
    let on = |wide: f64| {
        walls
            .iter()
            .filter(move |(other, ..)| (other - wide).abs() < near)
    };
    let wide = most_felt_width(&walls, near)?;
    let wide = median(&mut on(wide).map(|(other, ..)| *other).collect::<Vec<_>>())?;
    // the floor between both
    let is_floor = |one: &&BoreContact| {
        one.up > LEVEL && one.rho < wide && one.z < level + radius * (1.0 - DEPTHS.start)
    };
    let of_floor: Vec<&BoreContact> = seen
        .iter()
        .filter(is_floor)
        .filter(|one| one.rho > narrow - 0.5 * radius)
        .collect();
    let height = median(&mut of_floor.iter().map(|one| one.z).collect::<Vec<_>>())?;
    let floor: Vec<&BoreContact> = of_floor
        .into_iter()
        .filter(|one| (one.z - height).abs() < near)
        .collect();
    let depth = level - (height - radius);
    if !DEPTHS.contains(&(depth / radius))
        || turn_of(floor.iter().copied()) < FLOOR_TURN
        || floor.len() < LEAST / 2
    {
        return None;
    }
    let of_wall: Vec<&WallContact> = on(wide).filter(|(.., one)| one.z > height - near).collect();
    let axis_point = on_axis + out * (level - depth / 2.0);
    let guess = Cylinder::new(axis_point, out, wide, true);
    let wall = head_wall(observed, &of_wall, &guess)?;
    Some(Counterbore {
        wall,
        floor: floor.into_iter().map(|one| one.touch).collect(),
        land,
        out: *out,
        depth,
    })
}
