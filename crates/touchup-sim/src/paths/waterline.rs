//! Runs of the ball along walls at constant heights, as a mill cuts steep walls: into every
//! accessible hole, slot and pocket.
//!
//! At each height the ball's centre stays at least a radius from the surface. The runs are the
//! outlines of those parts of this plane region that the ball reaches from above and sideways.
//! Loops that repeat the one above are thinned out.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3, Unit, Vector3};

use super::path::{PathParams, RasterRegion, Stroke, first_contact, free, region_over};
use crate::error::SimError;
use crate::surfaces::surface::{Bounds, Surface};

/// Nodes of the grid to a radius of the ball.
const NODES_PER_RADIUS: f64 = 2.5;
/// Number of heights to a radius of the ball.
const HEIGHTS_PER_RADIUS: f64 = 4.0;
/// Most nodes of the grid of one height.
const MOST_NODES: f64 = 250_000.0;
/// Most heights.
const MOST_HEIGHTS: usize = 400;
/// Factor on the distance of loops around the whole part.
const OUTER_SPARSER: f64 = 4.0;
/// Maximum distance between the middles of similar loops, m, and maximum relative difference of
/// their lengths.
const SAME_MIDDLE: f64 = 0.5e-3;
const SAME_LENGTH: f64 = 0.08;
/// Factor from one thinning of the loops to the next, and number of tries.
const WIDER: f64 = 1.3;
const TRIES: i32 = 12;
/// Repeated share of a loop, to leave no gap at its start.
const OVERLAP: f64 = 0.08;

/// A closed line of the ball's centre at one height.
#[derive(Clone, Debug)]
struct Waterline {
    /// number of the height
    height: usize,
    /// x and y in V, m
    points: Vec<Point2<f64>>,
    /// place of the ball's descent to the height, x and y in V, m
    entry: Point2<f64>,
    is_outer: bool,
    /// m
    length: f64,
    middle: Point2<f64>,
}

impl Waterline {
    fn is_like(&self, other: &Self) -> bool {
        (self.middle - other.middle).norm() < SAME_MIDDLE
            && (self.length - other.length).abs() < SAME_LENGTH * self.length
    }
}

/// The grid over a region and the values at its nodes.
struct Grid<'a> {
    surface: &'a dyn Surface,
    region: &'a RasterRegion,
    /// m
    pitch: f64,
    count: [usize; 2],
    /// lowest z in V that the ball's centre reaches from above, m
    reached: Vec<f64>,
    /// last computed signed distance of a node, m, and its z
    known: Vec<[f64; 2]>,
}

/// Runs along all walls that the ball reaches from one side: around holes, slots, pockets and
/// bosses, and around the part.
///
/// - `bounds`: the part of the surface to go over, in O; `view`: direction in which the hand looks,
///   in O.
/// - The distance of the loops grows beyond [`PathParams::pitch`] if they would last longer than
///   [`PathParams::longest`].
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn plan_waterlines(
    surface: &dyn Surface,
    bounds: &Bounds,
    view: &Unit<Vector3<f64>>,
    params: &PathParams,
) -> Result<Vec<Stroke>, SimError> {
    params.check()?;
    let region = region_over(bounds, view, params.radius);
    let step = (params.radius / HEIGHTS_PER_RADIUS)
        .max((region.clear - region.floor) / MOST_HEIGHTS as f64);
    let heights = ((region.clear - region.floor) / step).floor() as usize;
    let mut grid = Grid::new(surface, &region, params.radius);
    let at = |height: usize| region.clear - height as f64 * step;
    let loops: Vec<Vec<Waterline>> = (0..=heights)
        .map(|height| grid.loops(height, at(height), params))
        .collect();
    let kept = within(&loops, step, params);
    Ok(kept
        .into_iter()
        .flat_map(|run| strokes(run, &region, at(run.height), params))
        .collect())
}

/// The loops for [`PathParams::longest`]: no closer than the pitch, wider apart if that takes too
/// long; without the longest ones if even the last of each kind alone take too long.
fn within<'a>(loops: &'a [Vec<Waterline>], step: f64, params: &PathParams) -> Vec<&'a Waterline> {
    let time = |run: &Waterline| run.length * (1.0 + OVERLAP) / params.wall_speed;
    let is_short =
        |kept: &Vec<&Waterline>| kept.iter().map(|run| time(run)).sum::<f64>() <= params.longest;
    let widths = (0..TRIES).map(|at| params.pitch * WIDER.powi(at));
    let mut kept = Vec::new();
    for pitch in widths {
        kept = thinned(loops, pitch / step);
        if is_short(&kept) {
            return kept;
        }
    }
    let mut shortest: Vec<usize> = (0..kept.len()).collect();
    shortest.sort_by(|&a, &b| kept[a].length.total_cmp(&kept[b].length));
    let mut left = params.longest;
    let mut is_in = vec![false; kept.len()];
    for at in shortest {
        left -= time(kept[at]);
        is_in[at] = left >= 0.0;
    }
    kept.into_iter()
        .zip(is_in)
        .filter(|(_, is_in)| *is_in)
        .map(|(run, _)| run)
        .collect()
}

/// The loops at least `every` heights below a similar one, and the last of each kind.
fn thinned(loops: &[Vec<Waterline>], every: f64) -> Vec<&Waterline> {
    let mut kept: Vec<&Waterline> = Vec::new();
    for (height, at_height) in loops.iter().enumerate() {
        for run in at_height {
            let every = every * if run.is_outer { OUTER_SPARSER } else { 1.0 };
            let above = kept
                .iter()
                .rev()
                .find(|other| run.is_like(other))
                .map(|other| other.height);
            let is_far = above.is_none_or(|above| (height - above) as f64 >= every);
            let below = loops.get(height + 1).map_or(&[][..], Vec::as_slice);
            // the last above a floor
            let is_last = !below.iter().any(|other| run.is_like(other));
            let is_apart =
                above.is_none_or(|above| (height - above) as f64 >= (every / 4.0).min(2.0));
            if is_far || is_last && is_apart && !run.is_outer {
                kept.push(run);
            }
        }
    }
    kept
}

/// Down to a loop, around it, and up again.
fn strokes(run: &Waterline, region: &RasterRegion, z: f64, params: &PathParams) -> [Stroke; 3] {
    let above = region.at(run.entry, region.clear);
    let entry = region.at(run.entry, z);
    let mut line: Vec<Point3<f64>> = run.points.iter().map(|&q| region.at(q, z)).collect();
    line.extend_from_within(..(line.len() as f64 * OVERLAP).ceil() as usize);
    [
        free(vec![above, entry]),
        Stroke {
            points: line,
            speed: params.wall_speed,
            press: None,
        },
        free(vec![entry, above]),
    ]
}

impl<'a> Grid<'a> {
    fn new(surface: &'a dyn Surface, region: &'a RasterRegion, radius: f64) -> Self {
        let size = region.high - region.low;
        let pitch = (radius / NODES_PER_RADIUS).max((size.x * size.y / MOST_NODES).sqrt());
        let count = [size.x, size.y].map(|side| (side / pitch).ceil() as usize + 1);
        let mut grid = Self {
            surface,
            region,
            pitch,
            count,
            reached: Vec::new(),
            known: Vec::new(),
        };
        let nodes = count[0] * count[1];
        let reached = |node: usize| {
            first_contact(surface, region, &grid.at(node), radius).unwrap_or(region.floor)
        };
        grid.reached = (0..nodes).map(reached).collect();
        grid.known = vec![[0.0, f64::INFINITY]; nodes];
        grid
    }

    /// x and y of a node in V, m.
    fn at(&self, node: usize) -> Point2<f64> {
        let [i, j] = [node % self.count[0], node / self.count[0]];
        self.region.low + nalgebra::Vector2::new(i as f64, j as f64) * self.pitch
    }

    /// Signed distance at a node, m; far from `level` any value on the same side.
    fn distance(&mut self, node: usize, z: f64, level: f64) -> f64 {
        let [value, at] = self.known[node];
        let (moved, side) = ((at - z).abs(), (value - level).signum());
        if moved.is_finite() && side * (value - level) - moved > 2.0 * self.pitch {
            return value - side * moved;
        }
        let q = self.at(node);
        let value = self.surface.signed_distance(&self.region.at(q, z));
        self.known[node] = [value, z];
        value
    }

    /// The outlines of the ball's free region at one height.
    fn loops(&mut self, height: usize, z: f64, params: &PathParams) -> Vec<Waterline> {
        let level = params.radius - params.lean;
        let values: Vec<f64> = (0..self.reached.len())
            .map(|node| self.distance(node, z, level) - level)
            .collect();
        let part = self.reachable(&values, z, params.lean);
        let next = self.segments(&values, &part);
        let mut loops: Vec<Waterline> = closed(&next)
            .into_iter()
            .filter_map(|nodes| {
                let place = |&[inner, outer]: &[usize; 2]| {
                    let (p, q) = (self.at(inner), self.at(outer));
                    p + (q - p) * (values[inner] / (values[inner] - values[outer]))
                };
                let number = part[nodes[0][0]];
                self.loop_of(height, z, nodes.iter().map(place).collect(), number, &part)
            })
            .collect();
        loops.retain(|run| run.length > params.radius);
        loops
    }

    /// The number of the reachable part of each node, 0 for none; 1 is the part around everything.
    fn reachable(&self, values: &[f64], z: f64, lean: f64) -> Vec<u32> {
        let mut part = vec![0; values.len()];
        let mut number = 0;
        for seed in 0..values.len() {
            if part[seed] != 0 || self.reached[seed] > z || values[seed] < lean {
                continue;
            }
            number += 1;
            part[seed] = number;
            let mut open = vec![seed];
            while let Some(node) = open.pop() {
                for other in self.beside(node).into_iter().flatten() {
                    if part[other] == 0 && values[other] > 0.0 {
                        part[other] = number;
                        open.push(other);
                    }
                }
            }
        }
        part
    }

    fn beside(&self, node: usize) -> [Option<usize>; 4] {
        let [i, j] = [node % self.count[0], node / self.count[0]];
        [
            (i > 0).then(|| node - 1),
            (i + 1 < self.count[0]).then_some(node + 1),
            (j > 0).then(|| node - self.count[0]),
            (j + 1 < self.count[1]).then_some(node + self.count[0]),
        ]
    }

    /// From each crossing of the outline to the next, the free side on the left; its free node and
    /// its other node identify a crossing.
    fn segments(&self, values: &[f64], part: &[u32]) -> BTreeMap<[usize; 2], [usize; 2]> {
        let mut next = BTreeMap::new();
        let is_free = |node: usize| values[node] > 0.0 && part[node] != 0;
        for j in 0..self.count[1] - 1 {
            for i in 0..self.count[0] - 1 {
                let low = j * self.count[0] + i;
                // counter-clockwise
                let corners = [low, low + 1, low + 1 + self.count[0], low + self.count[0]];
                // an outline enters from free to not free, and leaves in the reverse direction
                let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]);
                let (mut ins, mut outs) = (Vec::new(), Vec::new());
                for (k, [from, to]) in sides.enumerate() {
                    match (is_free(from), is_free(to)) {
                        (true, false) => ins.push((k, [from, to])),
                        (false, true) => outs.push((k, [to, from])),
                        _ => {}
                    }
                }
                for &(k, start) in &ins {
                    // at a saddle the free corners stay apart
                    let end = outs.iter().min_by_key(|(l, _)| (k + 4 - l) % 4);
                    if let Some(&(_, end)) = end {
                        next.insert(start, end);
                    }
                }
            }
        }
        next
    }

    fn loop_of(
        &self,
        height: usize,
        z: f64,
        mut points: Vec<Point2<f64>>,
        number: u32,
        part: &[u32],
    ) -> Option<Waterline> {
        let is_entry = |&node: &usize| part[node] == number && self.reached[node] <= z;
        let far = |node: usize, p: &Point2<f64>| (self.at(node) - p).norm_squared();
        let first = *points.first()?;
        let entry = (0..part.len())
            .filter(is_entry)
            .min_by(|&a, &b| far(a, &first).total_cmp(&far(b, &first)))?;
        let entry = self.at(entry);
        let to_entry = |p: &Point2<f64>| (p - entry).norm_squared();
        let start = (0..points.len())
            .min_by(|&a, &b| to_entry(&points[a]).total_cmp(&to_entry(&points[b])))?;
        points.rotate_left(start);
        points.push(points[0]);
        let length = points
            .windows(2)
            .map(|ends| (ends[1] - ends[0]).norm())
            .sum();
        let sum = points
            .iter()
            .fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
        let middle = (sum / points.len() as f64).into();
        Some(Waterline {
            height,
            points,
            entry,
            is_outer: number == 1,
            length,
            middle,
        })
    }
}

/// The closed lines of a map from each crossing to the next.
fn closed(next: &BTreeMap<[usize; 2], [usize; 2]>) -> Vec<Vec<[usize; 2]>> {
    let mut left = next.clone();
    let mut lines = Vec::new();
    while let Some((start, mut at)) = left.pop_first() {
        let mut line = vec![start];
        while at != start {
            line.push(at);
            let Some(after) = left.remove(&at) else { break };
            at = after;
        }
        if at == start {
            lines.push(line);
        }
    }
    lines
}
