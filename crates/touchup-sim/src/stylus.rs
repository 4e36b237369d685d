//! A hand-held stylus: a tip led over a rigid surface, and its sensor readings.
//!
//! The hand pulls the tip, by default a ball, along [`Stroke`]s, presses, slows at obstacles and
//! climbs out of gaps. The tip does not enter the part ([`super::push_ball`]); its contacts give
//! the direction of the force, the hand its size, friction adds a part against the motion: F = N Σ
//! w_i (n_i − μ t_i), Σ w_i = 1. The reported pose belongs to a rigid stylus, so a tip of
//! compliance C makes it read centre − C F ([`TipBending`]).

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::ball::BallContact;
use super::bending::TipBending;
use super::error::{SimError, not_negative, positive, up_to};
use super::random::{Drift, SmoothField};
use super::sensor::{Sensor, SensorParams, TICK, TrueState};
use super::tip::SimTip;
use crate::paths::path::{Stroke, free};
use crate::surfaces::surface::{Bounds, Surface};
use touchup_geometry::numeric::turned_to;
use touchup_method::stylus::{Message, TipShape};

settings! {
    /// The stylus and the hand that leads it.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct StylusParams,
    /// A light aluminium stylus with a 3 mm ball on dry steel, led by a calm hand.
    default {
        /// Radius of the ball, of the flat end, or of the nose of the cone, m.
        radius: f64 = 1.5e-3,
            positive("the ball's radius", *radius, "m"), up_to("the ball's radius", *radius, "m", 1.0, "1 m or less");
        /// Shape of the tip; its z points along the shaft. Sharp edges and noses have a rounding of
        /// 0.05 mm.
        shape: TipShape = TipShape::Ball;
        /// Stiffness of the tip, N/m.
        stiffness: f64 = 20e3, positive("the tip's stiffness", *stiffness, "N/m");
        /// Stiffness along each of three perpendicular directions over `stiffness`.
        stiffness_shares: Vector3<f64> = Vector3::repeat(1.0),
            positive("the smallest share of the tip's stiffness", stiffness_shares.min(), ""),
            up_to("the largest share of the tip's stiffness", stiffness_shares.max(), "", 1e3, "from zero to 1000");
        /// Turns these directions to the axes of T.
        stiffness_axes: UnitQuaternion<f64> = UnitQuaternion::identity();
        /// Coefficient of friction.
        friction: f64 = 0.15, up_to("the friction", *friction, "", 10.0, "from zero to ten");
        /// Variation of the friction over the part, root mean square over the mean.
        friction_variation: f64 = 0.0,
            up_to("the variation of friction", *friction_variation, "", 1.0, "from zero to one");
        /// Correlation length of the friction, m.
        friction_length: f64 = 10e-3, positive("the length of the friction's variation", *friction_length, "m");
        /// Mean force of the hand, N.
        force: f64 = 2.5, up_to("the hand's force", *force, "N", LARGEST_FORCE, "from zero to 1 kN");
        /// Variation of the force, root mean square, N.
        force_variation: f64 = 0.5,
            up_to("the variation of force", *force_variation, "N", LARGEST_FORCE, "from zero to 1 kN");
        /// Smallest and largest force of the hand, N.
        force_range: [f64; 2] = [1.0, 4.0], check_range(*force_range, *stiffness);
        /// Root mean square of the shaft's tilt about each of two axes, rad.
        tilt: f64 = 5f64.to_radians(), up_to("the tilt", *tilt, "rad", std::f64::consts::PI, "from zero to half a turn");
        /// Root mean square deviation of the hand from its line, per axis, m.
        stray: f64 = 0.15e-3, up_to("the straying of the hand", *stray, "m", 1.0, "from zero to 1 m");
        /// Errors of sensors and transport.
        sensor: SensorParams = SensorParams::default(), sensor.check();
    }
}

fn check_range([least, most]: [f64; 2], stiffness: f64) -> Result<(), SimError> {
    up_to(
        "the smallest force",
        least,
        "N",
        LARGEST_FORCE,
        "from zero to 1 kN",
    )?;
    up_to(
        "the largest force",
        most - least,
        "N above the smallest",
        LARGEST_FORCE,
        "from zero to 1 kN",
    )?;
    up_to(
        "the bending of the tip",
        most / stiffness,
        "m",
        LARGEST_BEND,
        "1 m or less: take a stiffer one",
    )
}

impl StylusParams {
    /// Bending of the tip.
    pub fn bending(&self) -> TipBending {
        TipBending {
            stiffness: self.stiffness,
            shares: self.stiffness_shares,
            axes: self.stiffness_axes,
        }
    }
}

/// A simulated recording with the truth behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// Messages in order of arrival: poses in O, wrenches in T.
    pub messages: Vec<Message>,
    /// One for each tick of 1 ms.
    pub moments: Vec<TrueState>,
}

/// Maximum force of a hand, N; a sample may hold a hundred times as much.
const LARGEST_FORCE: f64 = 1e3;
/// Maximum bend of a tip, m; a sample may be a thousand times as far.
const LARGEST_BEND: f64 = 1.0;
/// Rate at which the hand closes a distance, 1/s: a lag of 0.4 mm at 40 mm/s.
const FOLLOW: f64 = 100.0;
/// Maximum speed of the hand, m/s.
const TOP_SPEED: f64 = 0.08;
/// Maximum speed of sinking and climbing, m/s.
const SINK_SPEED: f64 = 0.06;
/// Lag at which the hand slows down, m; it waits at three times as much.
const LAG: f64 = 0.6e-3;
/// Lag at which the hand starts to climb, m, until it is back at [`LAG`].
const BLOCKED: f64 = 1.2e-3;
/// Time constant of the force, s.
const FIRM: f64 = 0.01;
/// Sliding speed at half of the friction, m/s.
const CREEP: f64 = 1e-3;
/// Patience of the hand with a line, s, beyond [`PATIENCE_FACTOR`] times its nominal duration.
const PATIENCE: f64 = 0.5;
const PATIENCE_FACTOR: f64 = 2.0;
/// Consecutive points missed in time by a trapped ball: in free motion, and pressed, when it climbs
/// over obstacles.
const CAUGHT: usize = 3;
const CAUGHT_PRESSED: usize = 8;
/// Step of the search for a way out of a trap, as a share of the ball's radius.
const LOOK: f64 = 0.2;
/// Maximum excess approach to the surface on the way out, m: a trapped ball touches.
const GRAZE: f64 = 1e-6;
/// Maximum turn in one step on the way around the part, rad.
const BEND: f64 = 0.8;

/// Slow motions of the hand.
struct Hand {
    force: Drift,
    tilt: [Drift; 3],
    stray: [Drift; 3],
}

impl Hand {
    fn new(seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut drift = |period: f64| Drift::new(period, &mut rng);
        Self {
            force: drift(1.0),
            tilt: [(); 3].map(|()| drift(4.0)),
            stray: [(); 3].map(|()| drift(1.5)),
        }
    }

    fn stray(&self, t: f64) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.stray[i].at(t))
    }
}

/// State of a simulated touch: the ball in the hand, in motion.
struct TouchSimulation<'a> {
    surface: &'a dyn Surface,
    params: &'a StylusParams,
    hand: Hand,
    upright: UnitQuaternion<f64>,
    tip: SimTip,
    friction: SmoothField,
    centre: Point3<f64>,
    climbing: bool,
    firmness: f64,
    moments: Vec<TrueState>,
}

/// Leads a ball along `path` over `surface` and records the stylus' messages.
///
/// Starts at the path's first point. The shaft is opposite to the first direction of pressing
/// (along z without any), give or take the tilt. Same surface, path, parameters and seed give the
/// same messages.
///
/// # Errors
/// [`SimError::BadParameter`], [`SimError::EmptyPath`], [`SimError::StartsInside`].
pub fn touch(
    surface: &dyn Surface,
    path: &[Stroke],
    params: &StylusParams,
    seed: u64,
) -> Result<Touch, SimError> {
    params.check()?;
    path.iter()
        .try_for_each(|stroke| positive("the speed of a stroke", stroke.speed, "m/s"))?;
    let farthest = path.iter().flat_map(|s| &s.points).flat_map(|p| p.iter());
    farthest
        .copied()
        .try_for_each(|x| not_negative("the size of a path's coordinate", x.abs(), "m"))?;
    let start = path
        .iter()
        .flat_map(|s| &s.points)
        .next()
        .ok_or(SimError::EmptyPath)?;
    let shaft = path
        .iter()
        .find_map(|s| s.press)
        .map_or_else(Vector3::z, |press| -press.into_inner());
    let upright = turned_to(&shaft);
    let mut leading = TouchSimulation {
        surface,
        params,
        hand: Hand::new(seed),
        upright,
        tip: SimTip::new(params.shape, params.radius, surface, start, upright)?,
        friction: SmoothField::new(
            params.friction_length,
            &mut Pcg64::seed_from_u64(seed ^ 0x4b1d_f00d_29c4_e653),
        ),
        centre: *start,
        climbing: false,
        firmness: 0.0,
        moments: Vec::new(),
    };
    let mut is_caught = false;
    for stroke in path {
        if is_caught {
            let Some(first) = stroke
                .points
                .first()
                .filter(|p| stroke.press.is_none() && leading.is_beside(p))
            else {
                continue;
            };
            leading.go_around_to(first);
        }
        is_caught = !leading.follow(stroke);
    }
    let moments = leading.moments;
    let messages = Sensor::new(&params.sensor, params.bending(), seed).record(&moments);
    Ok(Touch { messages, moments })
}

impl TouchSimulation<'_> {
    /// Whether a point is outside of the box around the surface.
    fn is_beside(&self, p: &Point3<f64>) -> bool {
        let Bounds { min, max } = self.surface.bounds();
        min.inf(p) != min || max.sup(p) != max
    }

    /// Takes the ball off the part, and around it to a point outside of the box around the surface.
    fn go_around_to(&mut self, point: &Point3<f64>) {
        let bounds = self.surface.bounds();
        let away = bounds.size().norm() / 2.0 + 4.0 * self.params.radius;
        let (middle, out) = (bounds.centre(), self.way_out(away));
        let from = (self.centre + out * (2.0 * away) - middle).normalize();
        let to = (point - middle).try_normalize(0.0).unwrap_or(out);
        let mut points = vec![middle + from * (2.0 * away)];
        // to the opposite side all ways around are equally short
        let aside = Unit::new_normalize(turned_to(&from) * Vector3::x());
        let turn = UnitQuaternion::rotation_between(&from, &to)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&aside, std::f64::consts::PI));
        let count = (turn.angle() / BEND).ceil().max(1.0) as usize;
        points.extend(
            (1..=count).map(|i| middle + turn.powf(i as f64 / count as f64) * from * (2.0 * away)),
        );
        points.push(*point);
        self.follow(&free(points));
    }

    /// A direction in which the ball can leave straight for `away` (m); along the shaft if there is
    /// none.
    fn way_out(&self, away: f64) -> Vector3<f64> {
        let shaft = self.upright * Vector3::z();
        let pushed = self
            .moments
            .iter()
            .rev()
            .find(|moment| !moment.contacts.is_empty());
        let pushed = pushed.map_or(shaft, |moment| {
            moment.contacts.iter().map(|contact| contact.normal).sum()
        });
        let signs = [0.0, 1.0, -1.0];
        let around = signs.iter().flat_map(|x| {
            signs
                .iter()
                .flat_map(move |y| signs.map(|z| Vector3::new(*x, *y, z)))
        });
        let directions = [pushed, shaft]
            .into_iter()
            .chain(around)
            .filter_map(|way: Vector3<f64>| way.try_normalize(0.0));
        let step = LOOK * self.params.radius;
        let is_free = |way: &Vector3<f64>| {
            let mut at =
                (1..=(away / step).ceil() as usize).map(|i| self.centre + way * (i as f64 * step));
            at.all(|x| self.surface.signed_distance(&x) > self.params.radius - GRAZE)
        };
        directions.clone().find(is_free).unwrap_or(shaft)
    }

    /// Goes along one stroke from the current place of the ball. Returns whether it got through:
    /// the part may trap it.
    fn follow(&mut self, stroke: &Stroke) -> bool {
        // consecutive missed points, and their maximum
        let mut missed = 0;
        let (most, most_at_end) = if stroke.press.is_some() {
            (CAUGHT_PRESSED, CAUGHT_PRESSED)
        } else {
            (CAUGHT, 1)
        };
        // a pressed stroke starts sideways of the ball, and sinks from there
        let mut guide = stroke
            .press
            .and(stroke.points.first())
            .copied()
            .unwrap_or(self.centre);
        for target in &stroke.points {
            let patience = PATIENCE + PATIENCE_FACTOR * (target - guide).norm() / stroke.speed;
            let until = self.moments.len() + (patience / TICK) as usize;
            missed += 1;
            while self.moments.len() < until {
                let lag = self.step(stroke, &guide);
                let left = target - guide;
                let advance = stroke.speed * TICK * (1.0 - (lag / LAG - 1.0) / 2.0).clamp(0.0, 1.0);
                if left.norm() > advance {
                    guide += left.normalize() * advance;
                } else {
                    guide = *target;
                    missed = 0;
                    break;
                }
            }
            if missed == most {
                return false;
            }
        }
        missed < most_at_end
    }

    /// One tick towards the guide; returns the ball's lag behind it, m.
    fn step(&mut self, stroke: &Stroke, guide: &Point3<f64>) -> f64 {
        let t = self.moments.len() as f64 * TICK;
        let mut error = guide + self.hand.stray(t) * self.params.stray - self.centre;
        let mut sink = Vector3::zeros();
        if let Some(press) = stroke.press {
            let depth = error.dot(&press);
            error -= *press * depth;
            self.climbing = error.norm() > if self.climbing { LAG } else { BLOCKED };
            let wanted = if self.climbing {
                -SINK_SPEED
            } else {
                (depth * FOLLOW).clamp(-SINK_SPEED, SINK_SPEED)
            };
            sink = *press * wanted;
        }
        let velocity = sink + (error * FOLLOW).cap_magnitude(TOP_SPEED);
        let to = self.centre + velocity * TICK;
        let orientation = self.orientation(t);
        let (centre, contacts) = self.tip.push(self.surface, &self.centre, &to, orientation);
        let sliding = (centre - self.centre) / TICK;
        self.centre = centre;
        self.note(t, orientation, sliding, contacts);
        error.norm()
    }

    /// The true orientation of the stylus.
    fn orientation(&self, t: f64) -> UnitQuaternion<f64> {
        let [x, y, z] = [0, 1, 2].map(|i| self.hand.tilt[i].at(t) * self.params.tilt);
        self.upright * UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
    }

    /// Adds the moment's force and orientation to the record.
    fn note(
        &mut self,
        t: f64,
        orientation: UnitQuaternion<f64>,
        sliding: Vector3<f64>,
        contacts: Vec<BallContact>,
    ) {
        let p = self.params;
        let goal = if contacts.is_empty() { 0.0 } else { 1.0 };
        self.firmness += (goal - self.firmness) * (TICK / FIRM);
        let wanted = (p.force + p.force_variation * self.hand.force.at(t))
            .clamp(p.force_range[0], p.force_range[1]);
        let total: f64 = contacts.iter().map(|c| c.held_back).sum();
        let varied =
            |c: &BallContact| (1.0 + p.friction_variation * self.friction.at(&c.point)).max(0.0);
        let friction = |c: &BallContact| {
            if p.friction_variation > 0.0 {
                p.friction * varied(c)
            } else {
                p.friction
            }
        };
        let force = |c: &BallContact| {
            let along = sliding - c.normal * sliding.dot(&c.normal);
            let drag = along * (friction(c) / (along.norm() + CREEP));
            (c.normal - drag) * (c.held_back / total)
        };
        let force_o = contacts.iter().map(force).sum::<Vector3<f64>>() * (wanted * self.firmness);
        let pose_ot = Isometry3::from_parts(self.centre.coords.into(), orientation);
        self.moments.push(TrueState {
            t,
            pose_ot,
            force_o,
            contacts,
        });
    }
}
