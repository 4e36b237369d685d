//! An arm that is watched while it moves: each state is checked before the next is awaited; a fault
//! stops the arm first and is reported second.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Vector3};

use super::interface::{Arm, ArmError, ArmState, Command, Safety, Slowed};
use super::limits::{LimitError, Limits};
use super::liveness::{Liveness, StuckForce};
use super::measured_motion::MeasuredMotion;
use super::touch_params::{TouchParams, UNEXPECTED};
use crate::numeric::mean;

/// Why probing was broken off. The arm was commanded to stop before this was made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// The arm.
    #[error("while {doing}: {error}")]
    Arm {
        /// the motion or measurement at hand
        doing: &'static str,
        /// what it said
        error: ArmError,
    },
    /// A limit.
    #[error("while {doing}: {error}")]
    Limit {
        /// the motion or measurement at hand
        doing: &'static str,
        /// which
        error: LimitError,
    },
    /// The sensor is not zeroed.
    #[error(
        "while {doing}: the sensor feels {force_n:.1} N at rest, and is zeroed below {most_n:.1} N only: free the tip, or tell the \
         arm what it holds (`touchup calibrate payload`)"
    )]
    Loaded {
        /// the motion or measurement at hand
        doing: &'static str,
        /// N
        force_n: f64,
        /// N
        most_n: f64,
    },
    /// Nor where what it feels changes.
    #[error(
        "while {doing}: what the sensor feels at rest changes by {change_n:.1} N: something moves the tip, or its cable"
    )]
    Unsteady {
        /// the motion or measurement at hand
        doing: &'static str,
        /// N
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
        /// N
        force_n: f64,
    },
    /// An obstacle where the path should be clear.
    #[error("while {doing}: up to {force_n:.1} N at ({:.1} {:.1} {:.1}) mm, where the path is clear by the mesh; look what is there",
            place_mm[0], place_mm[1], place_mm[2])]
    Obstacle {
        /// the motion or measurement at hand
        doing: &'static str,
        /// until the arm stood, N
        force_n: f64,
        /// of the tip in B, when it was felt, mm
        place_mm: [f64; 3],
        /// whether that was in a fast move through free air
        is_link: bool,
    },
    /// Noise would be contact.
    #[error(
        "while {doing}: the force has a noise of {noise_n:.2} N rms at rest, so no contact of {trigger_n:.2} N can be told from it: raise \
         robot.trigger_n to {least_n:.1} N with touch_force_n above it, or look what shakes the sensor"
    )]
    Noisy {
        /// the motion or measurement at hand
        doing: &'static str,
        /// N
        noise_n: f64,
        /// N
        trigger_n: f64,
        /// N
        least_n: f64,
    },
    /// Its reading in free air has left zero.
    #[error(
        "while {doing}: {force_n:.2} N in free air {seconds:.0} s after the sensor was zeroed, {per_s:.2} N/s: it drifts (warms up, or \
         its cable pulls), so contacts of {trigger_n:.2} N cannot be told from that; let it warm up, or look at the cable"
    )]
    Drifts {
        /// the motion or measurement at hand
        doing: &'static str,
        /// N
        force_n: f64,
        /// s
        seconds: f64,
        /// N/s
        per_s: f64,
        /// N
        trigger_n: f64,
    },
    /// The sensor does not sense.
    #[error(
        "while {doing}: the force sensor {stuck}, and no sensor is without noise: look at its cable, its range and its driver, \
         zero it, and check it by hand (docs/probing.md)"
    )]
    Senseless {
        /// the motion or measurement at hand
        doing: &'static str,
        /// its readings
        stuck: StuckForce,
    },
    /// A contact that was touched again is not where it was.
    #[error(
        "while {doing}: {reference} {how}, so the probe is bent or loose, the part has slipped, the arm has drifted or its sensor feels \
         less, some time after {since}: nothing that was touched after that holds; look, calibrate tip and place anew, and probe it again"
    )]
    Displaced {
        /// the motion or measurement at hand
        doing: &'static str,
        /// which contact
        reference: String,
        /// how it is now
        how: String,
        /// the last touch that holds
        since: String,
    },
    /// States come too seldom to stop in time.
    #[error(
        "while {doing}: the arm's states came {gap_ms:.0} ms apart; they have to come each {period_ms:.0} ms"
    )]
    LowRate {
        /// the motion or measurement at hand
        doing: &'static str,
        /// ms
        gap_ms: f64,
        /// ms
        period_ms: f64,
    },
    /// A motion does not end.
    #[error("while {doing}: the arm did not arrive within {limit_s:.1} s{}", slowed.map(|by| format!(": {by}")).unwrap_or_default())]
    TooLong {
        /// the motion or measurement at hand
        doing: &'static str,
        /// s
        limit_s: f64,
        /// by what, where it says so
        slowed: Option<Slowed>,
    },
    /// A request stopped it.
    #[error("cancelled while {doing}")]
    Cancelled {
        /// the motion or measurement at hand
        doing: &'static str,
        /// what was asked for
        request: StopRequest,
    },
}

/// States with equal stamps before that is a fault.
const FROZEN: u32 = 5;
/// States may come this many periods apart.
const LATE: f64 = 10.0;
/// An arm is at rest when it is not farther than this from where it was [`REST_STATES`] before, m:
/// above the noise of what is reported. At 500 Hz that is 3 mm/s, from which 0.5 m/s² stop within 9
/// µm.
const REST: f64 = 60e-6;
/// States over which rest is tested.
const REST_STATES: usize = 10;
/// A line has ended within this of its end, m.
const THERE: f64 = 80e-6;
/// … and this, rad.
const TURNED: f64 = 2e-3;
/// A line also takes as long as its turn at this speed, rad/s.
const TURN_SPEED: f64 = 0.2;
/// Longer than it should take by this factor, and by this time (s), is too long.
const PATIENCE: (f64, f64) = (3.0, 2.0);
/// Below this the tip is free of what it met, N …
const FREE_N: f64 = 1.0;
/// … and where it grows by this on the way back the tip goes no farther, N: several deviations of
/// its noise …
const WORSE_N: f64 = 2.0;
/// … to which it goes back with this speed, m/s …
const FREEING: f64 = 2e-3;
/// … by no more than this, m: what an arm goes on while it brakes, and what it bends.
const FREEING_WAY: f64 = 5e-3;
/// A force with less than this share along the way comes from a surface beside it: the way back is
/// along that surface as well.
const BESIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// So often on one way the tip is freed of what is beside it, and goes on …
const GRAZES: u32 = 3;
/// … this much farther from it than where it was free, m: more than the noise of its place.
const OFF: f64 = 0.1e-3;
/// A sensor is looked at for so long before it is zeroed, s.
const STEADY: f64 = 0.1;
/// In which its mean may change by this, N …
const DRIFT: f64 = 0.2;
/// … and by this many of its standard deviations.
const CHANGED: f64 = 3.0;
/// Forces above the trigger in a row that are contact; one alone is noise.
pub(super) const TRIGGERS: u32 = 2;

/// How an arm is asked to stop; the later one outranks the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum StopRequest {
    /// At once; then back into free air.
    #[error("the arm stopped and retracted")]
    Retract,
    /// At once, and nothing more moves, no retraction either.
    #[error("the arm stopped and stays where it is")]
    Stay,
}

/// Observes an arm while it moves.
pub trait Observer {
    /// Receives each state, in their order.
    fn on_state(&mut self, state: &ArmState);

    /// Is asked after each state whether to stop.
    fn stop_request(&self) -> Option<StopRequest> {
        None
    }
}

/// An arm that is watched while it moves.
pub struct Watched<'a> {
    pub(super) arm: &'a mut dyn Arm,
    pub(crate) limits: Limits,
    observer: &'a mut dyn Observer,
    pub(super) last: Option<ArmState>,
    frozen: u32,
    liveness: Liveness,
    motion: MeasuredMotion,
    pub(super) peak_force: f64,
    /// The station that the ball has come to on the current slide, also where that breaks off; of a
    /// touch 0 from its stand-off on. `None` while it is not at the first.
    pub reached: Option<usize>,
    /// the least request that stops it: a retraction goes on unless it has to stay
    pub(crate) heeds: StopRequest,
    /// whether it comes free of a contact: then no force stops it
    comes_free: bool,
}

impl<'a> Watched<'a> {
    /// - `observer`: receives each state, and may stop it.
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

    /// The largest force of the current touch, or of all lines where there was none, N; and when
    /// the arm was seen last, by its clock, ns: `None` where it was not, or not since the sensor
    /// was zeroed.
    pub(crate) fn seen(&self) -> (f64, Option<i64>) {
        (self.peak_force, self.last.map(|state| state.stamp_ns))
    }

    /// The next state, if it is valid.
    pub(super) fn next(&mut self, doing: &'static str) -> Result<ArmState, ProbeError> {
        let result = self.look(doing);
        if result.is_err() {
            // stop first, report second; where no command gets through, its watchdog stops it
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

    /// Repeats a command, as the watchdog of the arm needs it, until a state gives a result.
    ///
    /// - `begun_ns`: when the motion began; `None`: with its first state. `limit_s`: it ends within
    ///   this, or has failed.
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

    /// Brakes as hard as it may, and goes back the way it came until nothing is felt any more; of a
    /// surface beside the way, off that surface.
    ///
    /// Returns how far beside the way it is to go on, m in B, where it went aside and is free.
    ///
    /// - `command`: that led to the contact.
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
        // what was passed while it braked pushes no more
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

    /// Slowly in a direction, until nothing is felt or more than what was met.
    ///
    /// - `direction`: unit vector in B.
    /// - `met_n`: N
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
            // what was met is not that way, or was no contact
            worse = if force_n > met_n + WORSE_N {
                worse + 1
            } else {
                0
            };
            free >= TRIGGERS || worse >= TRIGGERS
        })?;
        self.stand(doing, &self.stop(), &mut |_| {})
    }

    /// Goes straight to a pose through what should be free air.
    ///
    /// # Errors
    /// [`ProbeError`]; [`ProbeError::Obstacle`] when the force exceeds `trigger` (N): the arm has
    /// stopped, and come free of it.
    ///
    /// - `speed`: m/s, at most; near the part not above `TouchParams::safe_speed`.
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

    /// As [`Self::line`], from where the tip may be in contact, also with more than the limit: once
    /// it is free, what it meets is an obstacle, and before that whatever presses more than at the
    /// beginning.
    ///
    /// A surface beside the way, as the wall of a hole that it goes up in, is none: the tip goes
    /// off it and on beside the way, and ends as far beside `to`.
    ///
    /// # Errors
    /// As there.
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

    /// What it met before it arrived; it has come free of it.
    ///
    /// - `trigger`: above which a force is an obstacle, N, where that much is felt now.
    fn go(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        speed: f64,
        params: &TouchParams,
        trigger: &mut dyn FnMut(f64) -> f64,
    ) -> Result<Option<Met>, ProbeError> {
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
        Ok(Some(Met {
            place,
            force_n,
            is_link: speed > params.safe_speed(),
            aside,
        }))
    }

    /// Stops, waits until the arm is at rest, and zeroes the sensor; returns the noise of its force,
    /// root mean square along the axis of the base where it is largest, N.
    ///
    /// # Errors
    /// [`ProbeError`]; [`ProbeError::Loaded`] and [`ProbeError::Unsteady`] where it feels
    /// something.
    pub fn zero(&mut self) -> Result<f64, ProbeError> {
        self.zero_below(self.limits.tare)
    }

    /// As [`Self::zero`], of a sensor that may feel a weight.
    ///
    /// - `most_n`: N
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
        // of two means of n/2 with that spread in all three directions
        if change_n > DRIFT + CHANGED * (spread * 4.0 / forces.len().max(1) as f64).sqrt() {
            return Err(ProbeError::Unsteady { doing, change_n });
        }
        self.arm
            .zero_sensor()
            .map_err(|error| ProbeError::Arm { doing, error })?;
        // that took its time
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

    /// Refuses a sensor whose zero has gone in free air by more than the trigger.
    ///
    /// - `zeroed_ns`: when it was zeroed.
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

    /// Stops, waits until the arm is at rest, and passes on the states of some time (s) after that.
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

    /// Stops, and waits until the arm is at rest.
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

    /// Goes on and on until `until` says so; returns whether it did before the travel was over.
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

/// What was met on a way through free air.
struct Met {
    /// of the tip when it was felt, m in B
    place: Vector3<f64>,
    /// until the arm stood, N
    force_n: f64,
    /// whether that was in a fast move
    is_link: bool,
    /// so far beside the way it may go on, m in B
    aside: Option<Vector3<f64>>,
}

impl Met {
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

/// Where a command takes the tip from a place, unit vector in B; `None`: nowhere.
fn way_of(command: &Command, from: &Vector3<f64>) -> Option<Vector3<f64>> {
    match command {
        Command::Line { to, .. } => to.translation.vector - from,
        Command::Velocity { linear, .. } => *linear,
        Command::Press { axis, .. } => *axis,
        Command::Stop { .. } => return None,
    }
    .try_normalize(0.0)
}
