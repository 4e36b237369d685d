//! Paths of the hand: rasters, runs along walls, free moves between them.

use nalgebra::{Isometry3, Point2, Point3, Unit, Vector2, Vector3};

use crate::error::{SimError, not_negative, positive, up_to};
use crate::surfaces::plate::{Extrusion, Plate, PlateStadium};
use crate::surfaces::surface::{Bounds, Surface};
use touchup_geometry::numeric::turned_to;

/// One pull of the hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Polyline that the hand wants the ball's centre to follow, m, in O.
    pub points: Vec<Point3<f64>>,
    /// m/s
    pub speed: f64,
    /// Pressing direction of the hand, in O. With it the line limits the depth of the ball, and the
    /// hand follows the line only sideways; without it the hand follows the line as well as the
    /// part allows.
    pub press: Option<Unit<Vector3<f64>>>,
}

/// A rectangle seen from the hand: in a frame V whose z axis points towards the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterRegion {
    /// V in O
    pub frame_ov: Isometry3<f64>,
    /// smallest x and y in V, m
    pub low: Point2<f64>,
    /// largest x and y in V, m
    pub high: Point2<f64>,
    /// lowest z in V of the ball's centre, m
    pub floor: f64,
    /// z in V at which the ball's centre is free of the part, m
    pub clear: f64,
}

/// Direction of the lines of a raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RasterDirection {
    /// along x of the region's frame
    AlongX,
    /// along y
    AlongY,
}

settings! {
    /// Speed and density of the hand's paths.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PathParams,
    /// A hand with a 1.5 mm ball: lines closer than the ball's width, at the speed of a rubbing
    /// hand.
    default {
        /// Ball radius, m.
        radius: f64 = 1.5e-3, positive("the ball's radius", *radius, "m");
        /// Distance between the lines of a raster, m.
        pitch: f64 = 2e-3, positive("the distance of the lines", *pitch, "m");
        /// Speed along rasters, m/s.
        speed: f64 = 0.04, positive("the speed along rasters", *speed, "m/s");
        /// Speed along walls, m/s.
        wall_speed: f64 = 0.025, positive("the speed along walls", *wall_speed, "m/s");
        /// Distance of the guide behind the surface of the wall, m.
        lean: f64 = 0.4e-3, not_negative("the size of the lean", lean.abs(), "m");
        /// Share of a turn in a run around a wall; at 1 it goes a little farther, to leave no gap
        /// at its start.
        turn: f64 = 1.0, share_of_turn(*turn);
        /// Longest time for the rasters of [`plan_mesh`], s; the pitch grows to keep it.
        longest: f64 = 90.0, positive("the longest time", *longest, "s");
    }
}

fn share_of_turn(turn: f64) -> Result<(), SimError> {
    positive("the share of a turn", turn, "")?;
    up_to("the share of a turn", turn, "", 1.0, "1 or less")
}

/// Maximum number of lines in a raster: 200 m of them at the usual pitch.
const MAX_LINES: f64 = 1e5;
/// Speed of free moves, m/s.
const FREE_SPEED: f64 = 0.08;
/// Room between ball and part on free moves, m.
const CLEARANCE: f64 = 3e-3;
/// Repeated share of a turn around a wall, to leave no gap at its start.
const OVERLAP: f64 = 0.1;
/// Overrun of a raster beyond a whole part, in radii of the ball: the ball leaves the edge and
/// sinks beside it.
const OVERRUN: f64 = 2.5;
/// Length of the pieces in which a planned line follows the surface, m.
const PIECE: f64 = 1e-3;
/// Maximum distance of a touching ball, m: far less than the depth of a press.
const TOUCHING: f64 = 10e-6;
/// Minimum radius of the centre's guide for a run inside a hole, m.
const ROOM: f64 = 0.5e-3;
/// Longest chord of a run along a curved wall, m.
const CHORD: f64 = 0.2e-3;

impl RasterRegion {
    /// A point of V in O.
    pub(crate) fn at(&self, q: Point2<f64>, z: f64) -> Point3<f64> {
        self.frame_ov * Point3::new(q.x, q.y, z)
    }
}

/// A free move from the current place of the ball.
pub(crate) fn free(points: Vec<Point3<f64>>) -> Stroke {
    Stroke {
        points,
        speed: FREE_SPEED,
        press: None,
    }
}

/// Goes over a region in lines to and fro, pressing; begins and ends with a free move at the
/// region's clear height.
///
/// # Errors
/// [`SimError::BadParameter`], also for more than 100,000 lines.
pub fn raster(
    region: &RasterRegion,
    lines: RasterDirection,
    params: &PathParams,
) -> Result<Vec<Stroke>, SimError> {
    params.check()?;
    let size = region.high - region.low;
    let (length, width) = if lines == RasterDirection::AlongX {
        (size.x, size.y)
    } else {
        (size.y, size.x)
    };
    not_negative("the length of the region", length, "m")?;
    not_negative("the width of the region", width, "m")?;
    let count = (width / params.pitch).round().max(1.0);
    up_to(
        "the number of lines",
        count,
        "",
        MAX_LINES,
        "100000 or less: take a larger distance",
    )?;
    let count = count as usize;
    let corner = |i: usize, far: bool| {
        let (s, t) = (
            if far { length } else { 0.0 },
            width * i as f64 / count as f64,
        );
        region.low
            + if lines == RasterDirection::AlongX {
                Vector2::new(s, t)
            } else {
                Vector2::new(t, s)
            }
    };
    let track: Vec<_> = (0..=count)
        .flat_map(|i| [corner(i, i % 2 == 1), corner(i, i % 2 == 0)])
        .collect();
    let (first, last) = (track[0], track[track.len() - 1]);
    let points = track
        .into_iter()
        .map(|q| region.at(q, region.floor))
        .collect();
    let press = Some(Unit::new_unchecked(region.frame_ov * -Vector3::z()));
    Ok(vec![
        free(vec![region.at(first, region.clear)]),
        Stroke {
            points,
            speed: params.speed,
            press,
        },
        // straight up first
        free(vec![region.at(last, region.clear)]),
    ])
}

/// Runs around the wall along z over an outline, by [`PathParams::turn`] of a turn, at each of the
/// given heights of the ball's centre.
///
/// - `inside`: along a hole or slot from within, else around a boss from without.
/// - `heights`: z, m, in O; `clear`: z at which the ball is free, m, in O.
pub fn around_wall(
    outline: &PlateStadium,
    inside: bool,
    heights: &[f64],
    clear: f64,
    params: &PathParams,
) -> Vec<Stroke> {
    let lean = if inside {
        params.lean - params.radius
    } else {
        params.radius - params.lean
    };
    let track = PlateStadium {
        radius: outline.radius + lean,
        ..*outline
    };
    let mut ring = track.polygon(CHORD * CHORD / (8.0 * track.radius));
    if params.turn < 1.0 {
        ring.truncate((ring.len() as f64 * params.turn).ceil() as usize + 1);
    } else {
        ring.extend_from_within(..(ring.len() as f64 * OVERLAP).ceil() as usize + 1);
    }
    let centre = outline.centre();
    // from the middle of a hole, or from beside a boss
    let start = if inside {
        centre
    } else {
        centre + (ring[0] - centre) * (1.0 + CLEARANCE / track.radius)
    };
    let at = |q: Point2<f64>, z: f64| Point3::new(q.x, q.y, z);
    let mut strokes = vec![free(vec![at(start, clear)])];
    for &z in heights {
        strokes.push(free(vec![
            at(start, clear.min(z + CLEARANCE)),
            at(start, z),
        ]));
        let run = ring.iter().map(|&q| at(q, z)).collect();
        strokes.push(Stroke {
            points: run,
            speed: params.wall_speed,
            press: None,
        });
        strokes.push(free(vec![at(start, z)]));
    }
    strokes.push(free(vec![at(start, clear)]));
    strokes
}

/// About a minute over the plate's features: rasters in both directions, walls of the holes, slot
/// and boss, and the step's edge. The far end of the plate and its rim stay untouched.
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn plan_demo(plate: &Plate, params: &PathParams) -> Result<Vec<Stroke>, SimError> {
    let top = plate.bounds().max.z;
    let clear = top + params.radius + CLEARANCE;
    let region = |low: [f64; 2], high: [f64; 2]| RasterRegion {
        frame_ov: Isometry3::identity(),
        low: low.into(),
        high: high.into(),
        floor: params.radius,
        clear,
    };
    let features = region([0.009, 0.008], [0.055, 0.042]);
    let mut strokes = raster(&features, RasterDirection::AlongX, params)?;
    strokes.extend(raster(&features, RasterDirection::AlongY, params)?);
    let step = plate.step_x;
    // across the edge in close lines, then along both of its sides
    strokes.extend(raster(
        &region([step - 4e-3, 0.010], [step + 5e-3, 0.036]),
        RasterDirection::AlongX,
        params,
    )?);
    strokes.extend(raster(
        &region([step - 1e-3, 0.010], [step + 2e-3, 0.036]),
        RasterDirection::AlongY,
        params,
    )?);
    strokes.extend(plan_walls(plate, params)?);
    Ok(strokes)
}

/// Runs along the walls of the plate's holes, slot and boss, for a ball that goes in; without holes
/// too narrow for it.
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn plan_walls(plate: &Plate, params: &PathParams) -> Result<Vec<Stroke>, SimError> {
    params.check()?;
    let clear = plate.bounds().max.z + params.radius + CLEARANCE;
    let walls = [
        (&plate.through, true),
        (&plate.blind, true),
        (&plate.slot, true),
        (&plate.boss, false),
    ];
    let reached = walls
        .into_iter()
        .filter(|(e, inside)| !inside || e.outline.radius + params.lean > params.radius + ROOM);
    let around = |(e, inside): (&Extrusion, bool)| {
        // near the floor (the ball touches floor and wall at once), halfway up, and just below the
        // rim
        let heights = [
            e.low + 0.9 * params.radius,
            (e.low + e.high) / 2.0,
            e.high - params.radius / 2.0,
        ];
        around_wall(&e.outline, inside, &heights, clear, params)
    };
    Ok(reached.flat_map(around).collect())
}

/// Rasters in both directions over the reachable surface from one side.
///
/// - `bounds`: the part of it to go over, in O; `view`: direction in which the hand looks and
///   presses, in O.
/// - The ball drops into every gap that fits it and a little way down the outer walls, but not
///   behind overhangs. The pitch grows beyond [`PathParams::pitch`] if the rasters would last
///   longer than [`PathParams::longest`].
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn plan_mesh(
    surface: &dyn Surface,
    bounds: &Bounds,
    view: &Unit<Vector3<f64>>,
    params: &PathParams,
) -> Result<Vec<Stroke>, SimError> {
    params.check()?;
    let region = region_over(bounds, view, params.radius);
    let size = region.high - region.low;
    let needed = 2.0 * size.x * size.y / (params.speed * params.longest);
    let params = PathParams {
        pitch: params.pitch.max(needed),
        ..*params
    };
    let mut strokes = raster(&region, RasterDirection::AlongX, &params)?;
    strokes.extend(raster(&region, RasterDirection::AlongY, &params)?);
    for stroke in strokes.iter_mut().filter(|stroke| stroke.press.is_some()) {
        stroke.points = follow_heights(surface, &region, &stroke.points, &params);
    }
    Ok(strokes)
}

/// A region over all of a box, seen along `view` (in O), extended as far as a ball of `radius` (m)
/// needs.
pub(crate) fn region_over(bounds: &Bounds, view: &Unit<Vector3<f64>>, radius: f64) -> RasterRegion {
    let frame_ov = looking_along(view, bounds);
    let seen = bounds.seen_from(&frame_ov);
    let overrun = Vector2::repeat(OVERRUN * radius);
    RasterRegion {
        frame_ov,
        low: seen.min.xy() - overrun,
        high: seen.max.xy() + overrun,
        floor: seen.min.z + radius,
        clear: seen.max.z + radius + CLEARANCE,
    }
}

/// The line in short pieces, at each point as deep as a ball from above goes, and a little deeper.
fn follow_heights(
    surface: &dyn Surface,
    region: &RasterRegion,
    line: &[Point3<f64>],
    params: &PathParams,
) -> Vec<Point3<f64>> {
    let mut level = region.clear;
    let pieces = line.windows(2).flat_map(|ends| {
        let count = ((ends[1] - ends[0]).norm() / PIECE).ceil().max(1.0);
        (0..=count as usize).map(move |i| ends[0] + (ends[1] - ends[0]) * (i as f64 / count))
    });
    let at_depth = |p: Point3<f64>| {
        let q = region.frame_ov.inverse() * p;
        // beside the part the ball goes down the wall it left
        level = first_contact(surface, region, &q.xy(), params.radius)
            .unwrap_or(level - PIECE)
            .max(region.floor);
        region.at(q.xy(), level - params.lean)
    };
    pieces.map(at_depth).collect()
}

/// z in V at which a ball coming down at (x, y) first touches; `None` when it passes the floor.
pub(crate) fn first_contact(
    surface: &dyn Surface,
    region: &RasterRegion,
    q: &Point2<f64>,
    radius: f64,
) -> Option<f64> {
    let mut z = region.clear;
    while z > region.floor {
        // the distance bounds the next free step of the ball
        let gap = surface.signed_distance(&region.at(*q, z)) - radius;
        if gap < TOUCHING {
            return Some(z);
        }
        z -= gap.max(TOUCHING);
    }
    None
}

/// A frame in the middle of a box whose z axis points against the direction of view, with an
/// arbitrary turn about it.
pub(crate) fn looking_along(view: &Unit<Vector3<f64>>, bounds: &Bounds) -> Isometry3<f64> {
    Isometry3::from_parts(
        bounds.centre().coords.into(),
        turned_to(&-view.into_inner()),
    )
}
