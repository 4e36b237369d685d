//! Paths of the ball over a touched feature: along its walls, and across its rims.
//!
//! At a rim a surface above bends down into a wall. The ball's centre stays one radius off both:
//! straight above, around the rim on a quarter of a circle, straight down along the wall; its
//! normal turns with it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Unit, Vector3};

use super::search_context::SearchContext;

/// A station of a slide: in O for a plan, in B for its execution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// centre of the ball in contact without pressure, m
    pub centre: Point3<f64>,
    /// normal out of the part
    pub normal: Unit<Vector3<f64>>,
}

/// Path of a slide of the ball, in O.
#[derive(Clone, Debug, PartialEq)]
pub struct Slide {
    /// stations in order, a small share of the ball apart at most
    pub stations: Vec<Station>,
    /// distance along the normal at which the ball is clear of all surfaces, m
    pub lift: f64,
    /// direction of the free path up from there
    up: Unit<Vector3<f64>>,
    /// height of its end along it, m from the origin of O
    height: f64,
}

impl Slide {
    /// Centre of the ball clear of the surface at a station, m.
    pub fn lifted(&self, station: usize) -> Point3<f64> {
        let Station { centre, normal } = self.stations[station];
        centre + normal.into_inner() * self.lift
    }

    /// Place straight above [`Self::lifted`], m.
    pub fn above(&self, station: usize) -> Point3<f64> {
        let lifted = self.lifted(station);
        lifted + self.up.into_inner() * (self.height - lifted.coords.dot(&self.up)).max(0.0)
    }

    /// Length of the ball's path, m.
    pub fn length(&self) -> f64 {
        self.stations
            .windows(2)
            .map(|pair| (pair[1].centre - pair[0].centre).norm())
            .sum()
    }
}

/// Maximum distance of two stations, over the ball's radius.
const CLOSE: f64 = 0.1;
/// Distance of lines, over the ball's radius.
const LINES: f64 = 1.0;
/// Maximum number of lines along the wall of a feature.
const MOST_LEVELS: usize = 8;
/// Maximum number of crossings of its rim.
const MOST_CROSSINGS: usize = 24;
/// Distance of crossings along a rim, over the ball's radius.
const CROSSINGS: f64 = 2.0;
/// Pieces in the length of a path between two crossings.
const PIECES: usize = 8;
/// Minimum room for lifting the ball off a wall, over its radius.
const LEAST_ROOM: f64 = 0.2;

/// A rim, in F: its place and the direction over it, from the surface above into the open, at a
/// share of its length.
pub(super) struct RimStation<'a> {
    pub at: &'a dyn Fn(f64) -> (Point3<f64>, Vector3<f64>),
    /// length of the rim, m
    pub length: f64,
    /// whether its end is its beginning
    pub is_closed: bool,
    /// extent of the known surface above back from the rim, to the ball's centre, m
    pub back: f64,
    /// depths of the ball's centre below the rim, m; above the first the rim may be broken
    pub depths: [f64; 2],
    /// room for lifting the ball off the wall, m
    pub room: f64,
}

impl RimStation<'_> {
    /// - `path`: length of the path of the ball's centre from above the surface to down at the
    ///   wall, m; 0 at the start of its turn.
    fn station(&self, context: &SearchContext, share: f64, path: f64) -> Station {
        let ball = context.params.ball_radius;
        let (rim, over) = (self.at)(share);
        let angle = (path / ball).clamp(0.0, FRAC_PI_2);
        let normal = Vector3::z() * angle.cos() + over * angle.sin();
        let down = (path - FRAC_PI_2 * ball).max(0.0);
        let centre = rim + normal * ball + over * path.min(0.0) - Vector3::z() * down;
        Station {
            centre: context.pose_of * centre,
            normal: Unit::new_normalize(context.pose_of.rotation * normal),
        }
    }

    fn slide(&self, context: &SearchContext, stations: Vec<Station>) -> Slide {
        Slide {
            lift: context.params.clearance.min(self.room),
            ..context.slide(stations)
        }
    }

    /// Along the wall at several depths, then across the rim again and again.
    pub(crate) fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let ball = context.params.ball_radius;
        let [highest, deepest] = self.depths;
        if self.room < LEAST_ROOM * ball || deepest < highest {
            return Vec::new();
        }
        let on_wall = |depth: f64| FRAC_PI_2 * ball + depth;
        let levels = (((deepest - highest) / (LINES * ball)).ceil() as usize + 1).min(MOST_LEVELS);
        let along_wall = |level: usize| {
            let depth = highest + (deepest - highest) * level as f64 / (levels - 1).max(1) as f64;
            let around =
                steps(self.length, ball).map(|share| self.station(context, share, on_wall(depth)));
            self.slide(context, around.collect())
        };
        (0..levels)
            .map(along_wall)
            .chain([self.zigzag(context, on_wall(highest))])
            .collect()
    }

    /// Down over the rim, on along the wall, up over the rim, on along the surface above, and
    /// again.
    fn zigzag(&self, context: &SearchContext, deep: f64) -> Slide {
        let ball = context.params.ball_radius;
        let count = ((self.length / (CROSSINGS * ball)) as usize).clamp(2, MOST_CROSSINGS);
        // a closed rim has no crossing at its end
        let share = |crossing: usize| {
            crossing as f64 / if self.is_closed { count } else { count - 1 } as f64
        };
        let mut stations = Vec::new();
        for crossing in 0..count {
            let (from, to) = if crossing % 2 == 0 {
                (-self.back, deep)
            } else {
                (deep, -self.back)
            };
            let across = steps((to - from).abs(), ball).map(|gone| from + (to - from) * gone);
            stations.extend(across.map(|path| self.station(context, share(crossing), path)));
            if crossing + 1 < count {
                let [here, next] = [share(crossing), share(crossing + 1)];
                let between = |gone: f64| self.station(context, here + (next - here) * gone, to);
                // beside a round rim the path is longer, or shorter, than the rim
                let pieces: Vec<_> = (0..=PIECES)
                    .map(|at| between(at as f64 / PIECES as f64).centre)
                    .collect();
                let length = pieces
                    .windows(2)
                    .map(|pair| (pair[1] - pair[0]).norm())
                    .sum();
                stations.extend(steps(length, ball).skip(1).map(between));
            }
        }
        self.slide(context, stations)
    }
}

/// Shares of a path sampled in small steps, from 0 to 1.
fn steps(length: f64, ball: f64) -> impl Iterator<Item = f64> {
    let count = (length / (CLOSE * ball)).ceil().max(1.0);
    (0..=count as usize).map(move |step| step as f64 / count)
}

/// Length of the rim of a slot, m, and the rim in the frame of the slot: x along it, the origin in
/// its middle.
pub(super) fn stadium_rim(
    width: f64,
    length: f64,
) -> (f64, impl Fn(f64) -> (Point3<f64>, Vector3<f64>)) {
    let (radius, half) = (width / 2.0, (length - width).max(0.0) / 2.0);
    let (straight, round) = (2.0 * half, FRAC_PI_2 * width);
    let total = 2.0 * (straight + round);
    let at = move |share: f64| {
        let gone = share * total;
        // one half is the other one turned by half a turn
        let (gone, sign) = if gone < total / 2.0 {
            (gone, 1.0)
        } else {
            (gone - total / 2.0, -1.0)
        };
        let (middle, direction) = if gone < straight {
            (Vector3::new(half - gone, 0.0, 0.0), Vector3::y())
        } else {
            let angle = FRAC_PI_2 + (gone - straight) / radius;
            (
                Vector3::new(-half, 0.0, 0.0),
                Vector3::new(angle.cos(), angle.sin(), 0.0),
            )
        };
        (
            Point3::from((middle + direction * radius) * sign),
            -direction * sign,
        )
    };
    (total, at)
}

impl SearchContext {
    /// A slide: down from free air to its stations, and up again from its actual end.
    fn slide(&self, stations: Vec<Station>) -> Slide {
        let up = Unit::new_normalize(self.out());
        let above = self.pose_of * Point3::new(0.0, 0.0, self.clear());
        Slide {
            stations,
            lift: self.params.clearance,
            up,
            height: above.coords.dot(&up),
        }
    }

    /// Slide to and fro over a field of the surface, within a radius around the flag.
    pub(super) fn raster(&self, radius: f64) -> Slide {
        let ball = self.params.ball_radius;
        let count = (2.0 * radius / (LINES * ball)).ceil().max(1.0);
        let line = |line: usize| {
            let across = radius * ((2 * line + 1) as f64 / count - 1.0);
            let half = (radius * radius - across * across).sqrt();
            let sign = if line.is_multiple_of(2) { 1.0 } else { -1.0 };
            [-half, half].map(|along| Point3::new(sign * along, across, self.height))
        };
        self.along(&(0..count as usize).flat_map(line).collect::<Vec<_>>())
    }

    /// Slide over places of the surface, in F, from one to the next.
    pub(super) fn along(&self, places: &[Point3<f64>]) -> Slide {
        let ball = self.params.ball_radius;
        let mut stations = Vec::new();
        for pair in places.windows(2) {
            let direction = pair[1] - pair[0];
            let Some(along) = direction.try_normalize(0.0) else {
                continue;
            };
            let normal = (Vector3::z() - along * along.z)
                .try_normalize(0.0)
                .unwrap_or_else(Vector3::z);
            let station = |gone: f64| Station {
                centre: self.pose_of * (pair[0] + direction * gone + normal * ball),
                normal: Unit::new_normalize(self.pose_of.rotation * normal),
            };
            stations.extend(steps(direction.norm(), ball).map(station));
        }
        self.slide(stations)
    }
}
