//! A slide: the ball presses on the surface with a constant force and follows a path.
//!
//! The arm complies only along the normal of the current station; it is driven along the path, and
//! held beside it. The path sets the direction, the force the depth: the ball follows a surface
//! that is displaced by less than a ball.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use super::interface::{ArmState, Command};
use super::touch_params::TouchParams;
use super::watched::{ProbeError, SupervisedArm, TRIGGERS};
use crate::plan::Station;

/// A planned slide, in B.
#[derive(Clone, Debug, PartialEq)]
pub struct SlideTarget {
    /// orientation of the tip
    pub rotation: UnitQuaternion<f64>,
    /// stations in order, at least two
    pub stations: Vec<Station>,
    /// distance from a station along its normal at which the ball is clear, m
    pub lift: f64,
    /// allowed displacement of the surface, m
    pub give: f64,
}

impl SlideTarget {
    fn lifted(&self, station: usize) -> Isometry3<f64> {
        let Station { centre, normal } = self.stations[station];
        Isometry3::from_parts(
            (centre + normal.into_inner() * self.lift).into(),
            self.rotation,
        )
    }
}

/// End of a slide.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SlideEnding {
    /// at the last station
    #[error("arrived")]
    Arrived,
    /// no contact at the first station
    #[error("no surface where it begins")]
    NoSurface,
    /// surface lost
    #[error("lost the surface")]
    Lost,
    /// obstacle on the path
    #[error("something stood in the way")]
    Blocked,
}

/// A completed slide.
#[derive(Clone, Debug, PartialEq)]
pub struct SlideRecord {
    /// its end
    pub ending: SlideEnding,
    /// start and end of the motion along the path, by the arm's clock, ns
    pub stamps_ns: [i64; 2],
    /// last station reached
    pub reached: usize,
    /// mean force along the normal, N
    pub mean_force: f64,
    /// largest difference of the mean force over a tenth of a second from the set force, N
    pub worst_force: f64,
    /// largest force of the slide, N
    pub peak_force: f64,
}

/// Averaging time of the force, s.
const WINDOW: f64 = 0.1;
/// Share of the set force within which the force stays for a window before the ball moves along.
const SETTLED: f64 = 0.2;
/// Time after which the ball moves along in any case, s.
const SETTLING: f64 = 1.0;
/// Maximum turn rate of the normal, rad/s: the force follows it.
const TURNING: f64 = 2.0;
/// Maximum lead of the pressed normal, in stations.
const MOST_AHEAD: f64 = 2.0;
/// Rate of correction of a deviation from the path, 1/s.
const BACK_TO_PATH: f64 = 5.0;
/// Share of the force below which, for two windows, there is no contact.
const NONE: f64 = 0.25;
/// Share of the force against the path above which there is an obstacle: friction is less.
const AGAINST: f64 = 0.8;
/// Consecutive states with such a force that make an obstacle: noise makes fewer.
const BLOCKED: usize = 4;
/// Time limit of a slide over its expected duration: factor and addition, s.
const PATIENCE: (f64, f64) = (3.0, 2.0);

const SLIDING: &str = "sliding over the surface";

/// Progress and contact of a slide.
struct SlideProgress<'a> {
    target: &'a SlideTarget,
    params: &'a TouchParams,
    /// speed along the path, m/s
    speed: f64,
    /// feed of the last command, m/s in B, and its largest change per command, m/s
    feed: Vector3<f64>,
    ramp: f64,
    station: usize,
    /// start of the motion along the path, and stamp of the last state, ns
    stamps_ns: [i64; 2],
    /// normal force of each state
    forces: Vec<f64>,
    /// consecutive states without a surface, and with an obstacle
    none: usize,
    against: usize,
    /// states per window
    window: usize,
}

impl SlideProgress<'_> {
    /// Direction of the path at the current station, unit vector, and distance to the next station,
    /// m.
    fn ahead(&self) -> (Vector3<f64>, f64) {
        let stations = &self.target.stations;
        let direction = stations[self.station + 1].centre - stations[self.station].centre;
        (
            direction.try_normalize(0.0).unwrap_or_else(Vector3::zeros),
            direction.norm(),
        )
    }

    /// Advances to the station that the ball has passed; returns whether there are more.
    fn advance(&mut self, place: &Vector3<f64>) -> bool {
        while self.station + 1 < self.target.stations.len() {
            let (direction, length) = self.ahead();
            if (place - self.target.stations[self.station].centre.coords).dot(&direction) < length {
                return true;
            }
            self.station += 1;
        }
        false
    }

    fn press(&self, normal: &Unit<Vector3<f64>>, feed: Vector3<f64>) -> Command {
        let speed = self.speed.min(self.params.search_speed);
        Command::Press {
            axis: -normal.into_inner(),
            force: self.params.force,
            feed,
            speed,
        }
    }

    /// Command along the path, and back to it for a ball beside it; within the speed of a slide and
    /// the allowed acceleration.
    fn command(&mut self, place: &Vector3<f64>) -> Command {
        let Station {
            centre,
            normal: here,
        } = self.target.stations[self.station];
        let next = self.target.stations[self.station + 1].normal;
        let (direction, length) = self.ahead();
        let speed = self
            .speed
            .min(TURNING * length / here.angle(&next).max(f64::MIN_POSITIVE));
        // position of the ball when the command takes effect: half of the latency is transmission
        let gone = (place - centre.coords).dot(&direction) + speed * self.params.latency / 2.0;
        let share = (gone / length.max(f64::MIN_POSITIVE)).clamp(0.0, MOST_AHEAD);
        let normal = Unit::new_normalize(
            here.into_inner() + (next.into_inner() - here.into_inner()) * share,
        );
        let side = normal.cross(&direction);
        let beside = (place - centre.coords).dot(&side);
        let along = direction - normal.into_inner() * direction.dot(&normal);
        let wanted = (along * speed - side * (beside * BACK_TO_PATH)).cap_magnitude(speed);
        self.feed += (wanted - self.feed).cap_magnitude(self.ramp);
        self.press(&normal, self.feed)
    }

    /// Records the state; returns the end of the slide, if any.
    fn observe(&mut self, state: &ArmState) -> Option<SlideEnding> {
        let Station { centre, normal } = self.target.stations[self.station];
        let force = state.wrench_b.force.dot(&normal);
        let (direction, _) = self.ahead();
        let off = (state.pose_bt.translation.vector - centre.coords).dot(&normal);
        self.forces.push(force);
        self.none = if force < NONE * self.params.force {
            self.none + 1
        } else {
            0
        };
        let is_against = -state.wrench_b.force.dot(&direction) > AGAINST * self.params.force;
        self.against = if is_against { self.against + 1 } else { 0 };
        if self.none > 2 * self.window
            || off.abs() > self.target.give + self.params.force / self.params.stiffness
        {
            Some(SlideEnding::Lost)
        } else if self.against >= BLOCKED {
            Some(SlideEnding::Blocked)
        } else {
            None
        }
    }

    fn seconds(&self) -> f64 {
        let pairs = self.target.stations.windows(2);
        let seconds = |pair: &[Station]| {
            let turn = pair[0].normal.angle(&pair[1].normal);
            ((pair[1].centre - pair[0].centre).norm() / self.speed).max(turn / TURNING)
        };
        pairs.map(seconds).sum()
    }
}

impl SupervisedArm<'_> {
    /// Slides once. The ball ends clear of the surface, beside the last station reached.
    ///
    /// # Errors
    /// [`ProbeError`]; a surface that is missing, or ends, is none.
    pub fn slide(
        &mut self,
        target: &SlideTarget,
        params: &TouchParams,
    ) -> Result<SlideRecord, ProbeError> {
        (self.peak_force, self.reached) = (0.0, None);
        self.line(
            "going to where a slide begins",
            &target.lifted(0),
            params.safe_speed(),
            params,
            params.trigger,
        )?;
        self.reached = Some(0);
        let stamps_ns = [self.next(SLIDING)?.stamp_ns; 2];
        let window = (WINDOW / self.arm.period()).ceil() as usize;
        let speed = params.slide_speed.min(params.bounded_speed(&self.limits));
        let (feed, ramp) = (
            Vector3::zeros(),
            self.limits.acceleration * self.arm.period(),
        );
        let (station, forces, none, against) = (0, Vec::new(), 0, 0);
        let mut slid = SlideProgress {
            target,
            params,
            speed,
            feed,
            ramp,
            station,
            stamps_ns,
            forces,
            none,
            against,
            window,
        };
        let mut ending = SlideEnding::NoSurface;
        if self.find_surface(target, params)? {
            self.settle(&slid)?;
            ending = self.go_along(&mut slid)?;
        }
        // off the surface along its normal
        let leaving = "leaving the surface after a slide";
        self.halt(leaving, &mut |_| {})?;
        self.leave(
            leaving,
            &target.lifted(slid.station),
            params.safe_speed(),
            params,
        )?;
        let mean = |forces: &[f64]| forces.iter().sum::<f64>() / forces.len().max(1) as f64;
        let worst = slid
            .forces
            .windows(window)
            .map(|forces| (mean(forces) - params.force).abs())
            .fold(0.0, f64::max);
        Ok(SlideRecord {
            ending,
            stamps_ns: slid.stamps_ns,
            reached: slid.station,
            mean_force: mean(&slid.forces),
            worst_force: worst,
            peak_force: self.peak_force,
        })
    }

    /// Goes down to the surface at the first station; returns whether it is there.
    fn find_surface(
        &mut self,
        target: &SlideTarget,
        params: &TouchParams,
    ) -> Result<bool, ProbeError> {
        let normal = target.stations[0].normal.into_inner();
        let mut contacts = 0;
        let (doing, far) = (
            "looking for the surface of a slide",
            target.lift + target.give,
        );
        self.search(doing, -normal * params.safe_speed(), far, &mut |state| {
            contacts = if state.wrench_b.force.norm() > params.trigger {
                contacts + 1
            } else {
                0
            };
            contacts >= TRIGGERS
        })
    }

    /// Presses until the force has its set value.
    fn settle(&mut self, slid: &SlideProgress<'_>) -> Result<(), ProbeError> {
        let doing = "pressing before a slide";
        let normal = slid.target.stations[0].normal;
        let begun_ns = self.next(doing)?.stamp_ns;
        let mut settled = 0;
        self.repeat(
            doing,
            &slid.press(&normal, Vector3::zeros()),
            None,
            f64::INFINITY,
            &mut |state| {
                let off = state.wrench_b.force.dot(&normal) - slid.params.force;
                settled = if off.abs() < SETTLED * slid.params.force {
                    settled + 1
                } else {
                    0
                };
                let is_over = (state.stamp_ns - begun_ns) as f64 * 1e-9 > SETTLING;
                (settled >= slid.window || is_over).then_some(())
            },
        )
    }

    fn go_along(&mut self, slid: &mut SlideProgress<'_>) -> Result<SlideEnding, ProbeError> {
        let limit_s = PATIENCE.0 * slid.seconds() + PATIENCE.1;
        let mut state = self.next(SLIDING)?;
        slid.stamps_ns = [state.stamp_ns; 2];
        while slid.advance(&state.pose_bt.translation.vector) {
            self.reached = Some(slid.station);
            if let Some(ending) = slid.observe(&state) {
                return Ok(ending);
            }
            if (state.stamp_ns - slid.stamps_ns[0]) as f64 * 1e-9 > limit_s {
                return self.too_long(SLIDING, limit_s);
            }
            self.send(SLIDING, &slid.command(&state.pose_bt.translation.vector))?;
            state = self.next(SLIDING)?;
            slid.stamps_ns[1] = state.stamp_ns;
        }
        self.reached = Some(slid.station);
        Ok(SlideEnding::Arrived)
    }
}
