//! Supervision of a moving arm: each state passes the checks before the wait for the next; a fault
//! stops the arm first and is reported second.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Vector3};

use super::interface::{Arm, ArmError, ArmState, Command, Safety, SpeedReduction};
use super::limits::{LimitError, Limits};
use super::liveness::{Liveness, StuckForce};
use super::measured_motion::MeasuredMotion;
use super::touch_params::{TouchParams, UNEXPECTED};
use touchup_geometry::numeric::mean;

/// Why probing ended early. The stop command to the arm comes before this error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// A fault of the arm.
    #[error("while {doing}: {error}")]
    Arm {
        /// the motion or measurement at hand
        doing: &'static str,
        /// its error
        error: ArmError,
    },
    /// A limit exceeded.
    #[error("while {doing}: {error}")]
    Limit {
        /// the motion or measurement at hand
        doing: &'static str,
        /// limit and excess
        error: LimitError,
    },
    /// A force at rest too large for zeroing the sensor.
    #[error(
        "while {doing}: the sensor feels {force_n:.1} N at rest, and is zeroed below {most_n:.1} N only: free the tip, or tell the \
         arm what it holds (`touchup calibrate payload`)"
    )]
    Loaded {
        /// the motion or measurement at hand
        doing: &'static str,
        /// force at rest, N
        force_n: f64,
        /// largest force for zeroing, N
        most_n: f64,
    },
    /// A force at rest that changes during zeroing.
    #[error(
        "while {doing}: what the sensor feels at rest changes by {change_n:.1} N: something moves the tip, or its cable"
    )]
    Unsteady {
        /// the motion or measurement at hand
        doing: &'static str,
        /// change, N
        change_n: f64,
    },
    /// The part pulls.
    #[error(
        "while {doing}: the part pulls with {force_n:.1} N where it should push: the sign of the force is turned (docs/ur.md has the check), or the force \
         comes late"
    )]
    Pulls {
        /// the motion or measurement at hand
        doing: &'static str,
        /// pull, N
        force_n: f64,
    },
    /// An obstacle on a supposedly clear path.
    #[error("while {doing}: up to {force_n:.1} N at ({:.1} {:.1} {:.1}) mm, where the path is clear by the mesh; look what is there",
            place_mm[0], place_mm[1], place_mm[2])]
    Obstacle {
        /// the motion or measurement at hand
        doing: &'static str,
        /// largest force until the arm stood, N
        force_n: f64,
        /// position of the tip in B at the contact, mm
        place_mm: [f64; 3],
        /// whether the move was a fast one through free air
        is_link: bool,
    },
    /// Noise of the force that would count as contact.
    #[error(
        "while {doing}: the force has a noise of {noise_n:.2} N rms at rest, so no contact of {trigger_n:.2} N can be told from it: raise \
         robot.trigger_n to {least_n:.1} N with touch_force_n above it, or look what shakes the sensor"
    )]
    Noisy {
        /// the motion or measurement at hand
        doing: &'static str,
        /// noise of the force at rest, N rms
        noise_n: f64,
        /// set trigger, N
        trigger_n: f64,
        /// smallest usable trigger, N
        least_n: f64,
    },
    /// A drift of the reading in free air.
    #[error(
        "while {doing}: {force_n:.2} N in free air {seconds:.0} s after the sensor was zeroed, {per_s:.2} N/s: it drifts (warms up, or \
         its cable pulls), so contacts of {trigger_n:.2} N cannot be told from that; let it warm up, or look at the cable"
    )]
    Drifts {
        /// the motion or measurement at hand
        doing: &'static str,
        /// reading in free air, N
        force_n: f64,
        /// time since zeroing, s
        seconds: f64,
        /// drift, N/s
        per_s: f64,
        /// trigger, N
        trigger_n: f64,
    },
    /// A stuck force sensor.
    #[error(
        "while {doing}: the force sensor {stuck}, and no sensor is without noise: look at its cable, its range and its driver, \
         zero it, and check it by hand (docs/probing.md)"
    )]
    Senseless {
        /// the motion or measurement at hand
        doing: &'static str,
        /// stuck reading
        stuck: StuckForce,
    },
    /// A reference contact that has moved.
    #[error(
        "while {doing}: {reference} {how}, so the probe is bent or loose, the part has slipped, the arm has drifted or its sensor feels \
         less, some time after {since}: nothing that was touched after that holds; look, calibrate tip and place anew, and probe it again"
    )]
    Displaced {
        /// the motion or measurement at hand
        doing: &'static str,
        /// name of the contact
        reference: String,
        /// its change
        how: String,
        /// last valid touch
        since: String,
    },
    /// States come too seldom to stop in time.
    #[error(
        "while {doing}: the arm's states came {gap_ms:.0} ms apart; they have to come each {period_ms:.0} ms"
    )]
    LowRate {
        /// the motion or measurement at hand
        doing: &'static str,
        /// gap between states, ms
        gap_ms: f64,
        /// required period, ms
        period_ms: f64,
    },
    /// A motion does not end.
    #[error("while {doing}: the arm did not arrive within {limit_s:.1} s{}", slowed.map(|by| format!(": {by}")).unwrap_or_default())]
    TooLong {
        /// the motion or measurement at hand
        doing: &'static str,
        /// time limit, s
        limit_s: f64,
        /// causes, if the arm reports them
        slowed: Option<SpeedReduction>,
    },
    /// A stop on request.
    #[error("cancelled while {doing}")]
    Cancelled {
        /// the motion or measurement at hand
        doing: &'static str,
        /// the request
        request: StopRequest,
    },
}

/// Equal stamps in a row that make a fault.
const FROZEN: u32 = 5;
/// Maximum gap between states, in periods.
const LATE: f64 = 10.0;
/// Maximum distance from the position [`REST_STATES`] before for an arm at rest, m: above the noise
/// of reported positions. At 500 Hz that is 3 mm/s, from which 0.5 m/s² stop within 9 µm.
const REST: f64 = 60e-6;
/// States in the test for rest.
const REST_STATES: usize = 10;
/// Distance from its end at which a line has arrived, m.
const THERE: f64 = 80e-6;
/// Angle from its end at which a line has arrived, rad.
const TURNED: f64 = 2e-3;
/// Turn rate that the time limit of a line allows for, rad/s.
const TURN_SPEED: f64 = 0.2;
/// Time limit of a motion over its expected duration: factor and addition, s.
const PATIENCE: (f64, f64) = (3.0, 2.0);
/// Force below which the tip is free, N.
const FREE_N: f64 = 1.0;
/// Growth of the force that ends the retreat, N: several deviations of its noise.
const WORSE_N: f64 = 2.0;
/// Speed of the retreat, m/s.
const FREEING: f64 = 2e-3;
/// Maximum length of the retreat, m: travel of the arm while braking, and its bending.
const FREEING_WAY: f64 = 5e-3;
/// Share of the force along the path below which the surface is beside it: the retreat is along
/// that surface as well.
const BESIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Maximum number of times that the tip leaves a surface beside one path and goes on.
const GRAZES: u32 = 3;
/// Additional distance from such a surface, m: more than the noise of positions.
const OFF: f64 = 0.1e-3;
/// Duration of the check before zeroing, s.
const STEADY: f64 = 0.1;
/// Allowed change of the mean force during this check, N.
const DRIFT: f64 = 0.2;
/// Additional allowed change, in its standard deviations.
const CHANGED: f64 = 3.0;
/// Consecutive forces above the trigger that make a contact; one alone is noise.
pub(super) const TRIGGERS: u32 = 2;

/// Request to stop an arm; the later variant outranks the earlier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum StopRequest {
    /// Stop at once, then retract into free air.
    #[error("the arm stopped and retracted")]
    Retract,
    /// Stop at once, without any further motion, also no retraction.
    #[error("the arm stopped and stays where it is")]
    Stay,
}

/// Observer of a moving arm.
pub trait Observer {
    /// Receives each state, in order.
    fn on_state(&mut self, state: &ArmState);

    /// Request to stop, polled after each state.
    fn stop_request(&self) -> Option<StopRequest> {
        None
    }
}

/// A supervised arm.
pub struct SupervisedArm<'a> {
    pub(super) arm: &'a mut dyn Arm,
    pub(crate) limits: Limits,
    observer: &'a mut dyn Observer,
    pub(super) last: Option<ArmState>,
    frozen: u32,
    liveness: Liveness,
    motion: MeasuredMotion,
    pub(super) peak_force: f64,
    /// Last station that the ball has reached on the current slide, also if the slide ended early;
    /// of a touch 0 from its stand-off on. `None` before the first.
    pub reached: Option<usize>,
    /// least request that stops the arm: a retraction goes on unless it has to stay
    pub(crate) heeds: StopRequest,
    /// whether the arm is coming free of a contact: then no force stops it
    comes_free: bool,
}

impl<'a> SupervisedArm<'a> {
    /// - `observer`: receives each state, and may stop the arm.
    pub fn new(arm: &'a mut dyn Arm, limits: Limits, observer: &'a mut dyn Observer) -> Self {
        let (peak_force, heeds) = (0.0, StopRequest::Retract);
        let motion = MeasuredMotion::default();
        Self {
            arm,
            limits,
            observer,
            last: None,
            frozen: 0,
            liveness: Liveness::default(),
            motion,
            peak_force,
            reached: None,
            heeds,
            comes_free: false,
        }
    }

    /// Largest force of the current touch, or of all lines without a touch, N; and stamp of the
    /// last state by the arm's clock, ns: `None` without a state since the start or since zeroing.
    pub(crate) fn seen(&self) -> (f64, Option<i64>) {
        (self.peak_force, self.last.map(|state| state.stamp_ns))
    }

    /// Next state, after all checks.
    pub(super) fn next(&mut self, doing: &'static str) -> Result<ArmState, ProbeError> {
        let result = self.look(doing);
        if result.is_err() {
            // stop first, report second; if no command gets through, the arm's watchdog stops it
            let _ = self.arm.command(&self.hard_stop());
        }
        result
    }

    fn look(&mut self, doing: &'static str) -> Result<ArmState, ProbeError> {
        let arm = |error| ProbeError::Arm { doing, error };
        let state = self.arm.next_state().map_err(arm)?;
        self.observer.on_state(&state);
        if let Some(last) = self.last.replace(state) {
            let gap = (state.stamp_ns - last.stamp_ns) as f64 * 1e-9;
            if gap < 0.0 {
                return Err(arm(ArmError::WentBack {
                    back_ms: -gap * 1e3,
                }));
            }
            self.frozen = if gap > 0.0 { 0 } else { self.frozen + 1 };
            if self.frozen >= FROZEN {
                return Err(arm(ArmError::Stale));
            }
            if gap > LATE * self.arm.period() {
                return Err(ProbeError::LowRate {
                    doing,
                    gap_ms: gap * 1e3,
                    period_ms: self.arm.period() * 1e3,
                });
            }
        }
        if state.safety != Safety::Normal {
            return Err(arm(ArmError::Stopped {
                safety: state.safety,
            }));
        }
        self.peak_force = self.peak_force.max(state.wrench_b.force.norm());
        // frozen stamps have no speed
        if self.frozen == 0 {
            self.motion
                .take(&state, &self.limits)
                .map_err(|error| ProbeError::Limit { doing, error })?;
        }
        if let Some(stuck) = self.liveness.take(&state) {
            return Err(ProbeError::Senseless { doing, stuck });
        }
        match self.limits.check_state(&state) {
            Err(LimitError::Force { .. }) if self.comes_free => {}
            checked => checked.map_err(|error| ProbeError::Limit { doing, error })?,
        }
        match self
            .observer
            .stop_request()
            .filter(|request| *request >= self.heeds)
        {
            Some(request) => Err(ProbeError::Cancelled { doing, request }),
            None => Ok(state),
        }
    }

    fn stop(&self) -> Command {
        Command::Stop {
            deceleration: self.limits.acceleration,
        }
    }

    fn hard_stop(&self) -> Command {
        Command::Stop {
            deceleration: self.limits.fault_stop(),
        }
    }

    pub(super) fn send(
        &mut self,
        doing: &'static str,
        command: &Command,
    ) -> Result<(), ProbeError> {
        self.arm
            .command(command)
            .map_err(|error| ProbeError::Arm { doing, error })
    }

    /// Repeats a command, as the arm's watchdog requires, until a state gives a result.
    ///
    /// - `begun_ns`: start of the motion; `None`: with its first state. `limit_s`: time limit of
    ///   the motion.
    pub(super) fn repeat<T>(
        &mut self,
        doing: &'static str,
        command: &Command,
        mut begun_ns: Option<i64>,
        limit_s: f64,
        until: &mut dyn FnMut(&ArmState) -> Option<T>,
    ) -> Result<T, ProbeError> {
        loop {
            self.send(doing, command)?;
            let state = match self.next(doing) {
                Err(
                    error @ ProbeError::Limit {
                        error: LimitError::Force { .. },
                        ..
                    },
                ) if !self.comes_free => {
                    self.come_free(command)?;
                    return Err(error);
                }
                next => next?,
            };
            if let Some(result) = until(&state) {
                return Ok(result);
            }
            let begun_ns = *begun_ns.get_or_insert(state.stamp_ns);
            if (state.stamp_ns - begun_ns) as f64 * 1e-9 > limit_s {
                return self.too_long(doing, limit_s);
            }
        }
    }

    /// Brakes as hard as allowed, and goes back along the path until free; from a surface beside
    /// the path, off that surface.
    ///
    /// Returns the offset beside the path for going on, m in B, after coming free sideways.
    ///
    /// - `command`: motion that led to the contact.
    pub(super) fn come_free(
        &mut self,
        command: &Command,
    ) -> Result<Option<Vector3<f64>>, ProbeError> {
        let (heeds, doing) = (self.heeds, "coming free of what it met");
        (self.comes_free, self.heeds) = (true, StopRequest::Stay);
        let freed = self.stop_and_free(doing, command);
        (self.comes_free, self.heeds) = (false, heeds);
        freed
    }

    fn stop_and_free(
        &mut self,
        doing: &'static str,
        command: &Command,
    ) -> Result<Option<Vector3<f64>>, ProbeError> {
        let met = self.last;
        self.stand(doing, &self.hard_stop(), &mut |_| {})?;
        let (Some(met), Some(stood)) = (met, self.last) else {
            return Ok(None);
        };
        let Some(way) = way_of(command, &met.pose_bt.translation.vector) else {
            return Ok(None);
        };
        let is_free = |state: &ArmState| state.wrench_b.force.norm() < FREE_N;
        // an obstacle passed while braking pushes no more
        let push = if is_free(&stood) { met } else { stood }.wrench_b.force;
        let (along, met_n) = (push.dot(&way), push.norm());
        let aside = (push - way * along)
            .try_normalize(0.0)
            .filter(|_| along.abs() < BESIDE * met_n);
        if !is_free(&stood) {
            self.go_until_free(doing, aside.unwrap_or(-way), met_n)?;
        }
        let gone =
            |state: ArmState| state.pose_bt.translation.vector - stood.pose_bt.translation.vector;
        let by = self.last.filter(is_free).map(gone).zip(aside);
        Ok(by.map(|(gone, aside)| aside * (gone.dot(&aside).max(0.0) + OFF)))
    }

    /// Goes slowly in a direction, until free or until the force exceeds `met_n`.
    ///
    /// - `direction`: unit vector in B.
    /// - `met_n`: force at the obstacle, N
    fn go_until_free(
        &mut self,
        doing: &'static str,
        direction: Vector3<f64>,
        met_n: f64,
    ) -> Result<(), ProbeError> {
        let (mut free, mut worse) = (0, 0);
        self.search(doing, direction * FREEING, FREEING_WAY, &mut |state| {
            let force_n = state.wrench_b.force.norm();
            free = if force_n < FREE_N { free + 1 } else { 0 };
            // the direction is not off the obstacle, or there was no contact
            worse = if force_n > met_n + WORSE_N {
                worse + 1
            } else {
                0
            };
            free >= TRIGGERS || worse >= TRIGGERS
        })?;
        self.stand(doing, &self.stop(), &mut |_| {})
    }

    /// Goes straight to a pose through supposedly free air.
    ///
    /// # Errors
    /// [`ProbeError`]; [`ProbeError::Obstacle`] if the force exceeds `trigger` (N): the arm has
    /// stopped, and come free of the obstacle.
    ///
    /// - `speed`: maximum, m/s; near the part not above `TouchParams::safe_speed`.
    pub fn line(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        speed: f64,
        params: &TouchParams,
        trigger: f64,
    ) -> Result<(), ProbeError> {
        match self.go(doing, to, speed, params, &mut |_| trigger)? {
            None => Ok(()),
            Some(met) => Err(met.obstacle(doing)),
        }
    }

    /// As [`Self::line`], from a pose that may be in contact, also above the force limit: after the
    /// tip is free, any contact is an obstacle; before that, any larger force than at the
    /// beginning.
    ///
    /// A surface beside the path, such as the wall of a hole, is none: the tip goes off it and on
    /// beside the path, and ends beside `to` by the same offset.
    ///
    /// # Errors
    /// As [`Self::line`].
    pub fn leave(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        speed: f64,
        params: &TouchParams,
    ) -> Result<(), ProbeError> {
        let (mut is_free, limit, mut to) = (false, self.limits.force, *to);
        let (mut most, mut grazes) = (None, 0);
        loop {
            self.comes_free = true;
            let met = self.go(doing, &to, speed, params, &mut |force| {
                let most = *most.get_or_insert(limit.max(force + WORSE_N));
                is_free |= force < params.trigger;
                if is_free {
                    (UNEXPECTED * params.trigger).min(limit)
                } else {
                    most
                }
            });
            self.comes_free = false;
            let Some(met) = met? else { return Ok(()) };
            grazes += 1;
            let Some(aside) = met.aside.filter(|_| grazes <= GRAZES) else {
                return Err(met.obstacle(doing));
            };
            to.translation.vector += aside;
        }
    }

    /// Goes to a pose; returns an obstacle met before the end, after coming free of it.
    ///
    /// - `trigger`: smallest force of an obstacle, N, at the present force.
    fn go(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        speed: f64,
        params: &TouchParams,
        trigger: &mut dyn FnMut(f64) -> f64,
    ) -> Result<Option<ObstacleContact>, ProbeError> {
        let place = to.translation.vector;
        self.limits
            .check_place(&place)
            .map_err(|error| ProbeError::Limit { doing, error })?;
        let begun = self.next(doing)?;
        let speed = speed.min(params.bounded_speed(&self.limits));
        let acceleration = params.acceleration.min(self.limits.acceleration);
        let distance = (place - begun.pose_bt.translation.vector).norm();
        let turn = begun.pose_bt.rotation.angle_to(&to.rotation);
        let limit_s =
            PATIENCE.0 * (distance / speed + speed / acceleration + turn / TURN_SPEED) + PATIENCE.1;
        let command = Command::Line {
            to: *to,
            speed,
            acceleration,
        };
        let mut contacts = 0;
        let met = self.repeat(
            doing,
            &command,
            Some(begun.stamp_ns),
            limit_s,
            &mut |state| {
                let here = state.pose_bt.translation.vector;
                let force_n = state.wrench_b.force.norm();
                contacts = if force_n > trigger(force_n) {
                    contacts + 1
                } else {
                    0
                };
                if contacts >= TRIGGERS {
                    return Some(Some(here));
                }
                let turn = state.pose_bt.rotation.angle_to(&to.rotation);
                ((here - place).norm() < THERE && turn < TURNED).then_some(None)
            },
        )?;
        let Some(place) = met else { return Ok(None) };
        let before = std::mem::take(&mut self.peak_force);
        let aside = self.come_free(&command)?;
        let force_n = self.peak_force;
        self.peak_force = before.max(force_n);
        Ok(Some(ObstacleContact {
            place,
            force_n,
            is_link: speed > params.safe_speed(),
            aside,
        }))
    }

    /// Stops, waits for rest, and zeroes the sensor; returns the noise of its force, root mean
    /// square along the axis of the base with the most noise, N.
    ///
    /// # Errors
    /// [`ProbeError`]; [`ProbeError::Loaded`] and [`ProbeError::Unsteady`] for a force on the
    /// sensor.
    pub fn zero(&mut self) -> Result<f64, ProbeError> {
        self.zero_below(self.limits.tare)
    }

    /// As [`Self::zero`], for a sensor that may carry a weight.
    ///
    /// - `most_n`: largest force for zeroing, N
    pub(crate) fn zero_below(&mut self, most_n: f64) -> Result<f64, ProbeError> {
        let doing = "zeroing the sensor in free air";
        let forces = self.forces_at_rest(doing)?;
        let (all, (first, second)) = (
            mean(forces.iter().copied()),
            forces.split_at(forces.len() / 2),
        );
        let squares = mean(
            forces
                .iter()
                .map(|force| (force - all).component_mul(&(force - all))),
        );
        let spread = squares.sum();
        let mean = |forces: &[Vector3<f64>]| mean(forces.iter().copied());
        let change_n = (mean(second) - mean(first)).norm();
        if all.norm() > most_n {
            return Err(ProbeError::Loaded {
                doing,
                force_n: all.norm(),
                most_n,
            });
        }
        // difference of two means of n/2, with that spread in all three directions
        if change_n > DRIFT + CHANGED * (spread * 4.0 / forces.len().max(1) as f64).sqrt() {
            return Err(ProbeError::Unsteady { doing, change_n });
        }
        self.arm
            .zero_sensor()
            .map_err(|error| ProbeError::Arm { doing, error })?;
        // zeroing took its time
        self.last = None;
        self.liveness = Liveness::default();
        self.motion.forget();
        Ok(squares.max().sqrt())
    }

    /// Readings of the sensor at rest, N in B.
    fn forces_at_rest(&mut self, doing: &'static str) -> Result<Vec<Vector3<f64>>, ProbeError> {
        let mut forces = Vec::new();
        self.dwell(doing, STEADY, &mut |state| {
            forces.push(state.wrench_b.force)
        })?;
        Ok(forces)
    }

    /// Refuses a sensor whose zero in free air has drifted by more than the trigger.
    ///
    /// - `zeroed_ns`: stamp of the zeroing.
    ///
    /// # Errors
    /// [`ProbeError::Drifts`]
    pub(crate) fn check_zero(
        &mut self,
        zeroed_ns: i64,
        params: &TouchParams,
    ) -> Result<(), ProbeError> {
        let doing = "looking at the zero of the sensor";
        let force_n = mean(self.forces_at_rest(doing)?.into_iter()).norm();
        let now_ns = self.last.map_or(zeroed_ns, |state| state.stamp_ns);
        let seconds = (now_ns - zeroed_ns) as f64 * 1e-9;
        if force_n <= params.trigger {
            return Ok(());
        }
        Err(ProbeError::Drifts {
            doing,
            force_n,
            seconds,
            per_s: force_n / seconds,
            trigger_n: params.trigger,
        })
    }

    /// Stops, waits for rest, and passes on the states of a duration (s) after that.
    ///
    /// # Errors
    /// [`ProbeError`]
    pub fn dwell(
        &mut self,
        doing: &'static str,
        seconds: f64,
        each: &mut dyn FnMut(&ArmState),
    ) -> Result<(), ProbeError> {
        self.halt(doing, &mut |_| {})?;
        let mut begun_ns = None;
        self.repeat(doing, &self.stop(), None, f64::INFINITY, &mut |state| {
            let begun_ns = *begun_ns.get_or_insert(state.stamp_ns);
            let is_over = (state.stamp_ns - begun_ns) as f64 * 1e-9 >= seconds;
            if !is_over {
                each(state);
            }
            is_over.then_some(())
        })
    }

    /// Stops, and waits for rest.
    pub(super) fn halt(
        &mut self,
        doing: &'static str,
        each: &mut dyn FnMut(&ArmState),
    ) -> Result<(), ProbeError> {
        self.stand(doing, &self.stop(), each)
    }

    fn stand(
        &mut self,
        doing: &'static str,
        stop: &Command,
        each: &mut dyn FnMut(&ArmState),
    ) -> Result<(), ProbeError> {
        let limit_s = PATIENCE.0 * self.limits.speed / self.limits.acceleration + PATIENCE.1;
        let mut places = VecDeque::new();
        self.repeat(doing, stop, None, limit_s, &mut |state| {
            each(state);
            let place = state.pose_bt.translation.vector;
            places.push_back(place);
            let before: Option<Vector3<f64>> = if places.len() > REST_STATES {
                places.pop_front()
            } else {
                None
            };
            before
                .filter(|before| (place - before).norm() < REST)
                .map(|_| ())
        })
    }

    /// Goes on until `until` holds or the travel is over; returns whether `until` held.
    pub(super) fn search(
        &mut self,
        doing: &'static str,
        velocity: Vector3<f64>,
        travel: f64,
        until: &mut dyn FnMut(&ArmState) -> bool,
    ) -> Result<bool, ProbeError> {
        let velocity = velocity * (self.limits.speed / velocity.norm()).min(1.0);
        let command = Command::Velocity {
            linear: velocity,
            acceleration: self.limits.acceleration,
        };
        let begun = self.next(doing)?;
        let limit_s = PATIENCE.0 * travel / velocity.norm() + PATIENCE.1;
        self.repeat(
            doing,
            &command,
            Some(begun.stamp_ns),
            limit_s,
            &mut |state| {
                let gone = || state.pose_bt.translation.vector - begun.pose_bt.translation.vector;
                let is_over = || gone().dot(&velocity) / velocity.norm() >= travel;
                if until(state) {
                    Some(true)
                } else {
                    is_over().then_some(false)
                }
            },
        )
    }

    pub(super) fn too_long<T>(
        &mut self,
        doing: &'static str,
        limit_s: f64,
    ) -> Result<T, ProbeError> {
        self.send(doing, &self.hard_stop())?;
        Err(ProbeError::TooLong {
            doing,
            limit_s,
            slowed: self.arm.slowed(),
        })
    }
}

/// An obstacle in free air.
struct ObstacleContact {
    /// position of the tip at the contact, m in B
    place: Vector3<f64>,
    /// largest force until the arm stood, N
    force_n: f64,
    /// whether the move was fast
    is_link: bool,
    /// offset beside the path for going on, m in B
    aside: Option<Vector3<f64>>,
}

impl ObstacleContact {
    fn obstacle(&self, doing: &'static str) -> ProbeError {
        let Self {
            place,
            force_n,
            is_link,
            ..
        } = *self;
        ProbeError::Obstacle {
            doing,
            force_n,
            place_mm: (place * 1e3).into(),
            is_link,
        }
    }
}

/// Direction of a command from a place, unit vector in B; `None` without motion.
fn way_of(command: &Command, from: &Vector3<f64>) -> Option<Vector3<f64>> {
    match command {
        Command::Line { to, .. } => to.translation.vector - from,
        Command::Velocity { linear, .. } => *linear,
        Command::Press { axis, .. } => *axis,
        Command::Stop { .. } => return None,
    }
    .try_normalize(0.0)
}
