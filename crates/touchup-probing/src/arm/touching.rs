//! One touch: approach, search, back off, a slower search, retract.
//!
//! The first search finds the surface; the second starts just above it, presses slowly to the set
//! force, and returns through the corner at the same speed. Its curve is the input of
//! [`find_onset`].

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::plan::ExpectedTravel;
use touchup_geometry::numeric::mean;

use super::interface::{ArmState, Command};
use super::onset::{Onset, OnsetError, TouchMoment, find_onset};
use super::touch_params::{CRAWL, TouchParams};
use super::watched::{ProbeError, SupervisedArm, TRIGGERS};

/// A planned touch, in B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchTarget {
    /// Start of the search: pose of the tip, clear of the part.
    pub standoff_bt: Isometry3<f64>,
    /// Direction of the search, into the part.
    pub direction: Unit<Vector3<f64>>,
    /// Length of the search, m.
    pub search: f64,
    /// Position of the surface, predicted from earlier touches.
    pub expected: Option<ExpectedTravel>,
}

/// The outcome of a touch.
#[derive(Clone, Debug, PartialEq)]
pub enum TouchOutcome {
    /// The ball touched the part.
    Contact {
        /// corner of the curve
        onset: Onset,
        /// centre of the ball at the onset, m in B
        centre: Point3<f64>,
        /// mean force of the part on the tip above half of the largest, N in B
        force_b: Vector3<f64>,
    },
    /// No contact along the whole search.
    Miss {
        /// travel of the ball from the stand-off, m
        travel: f64,
    },
    /// A contact whose curve has no onset.
    Unclear(OnsetError),
}

/// A touch with all its data.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchRecord {
    /// planned touch
    pub target: TouchTarget,
    /// start and end by the arm's clock, ns
    pub stamps_ns: [i64; 2],
    /// speed of the measuring search, m/s
    pub speed: f64,
    /// curve of the measuring search, in and out
    pub curve: Vec<TouchMoment>,
    /// start of the curve by the arm's clock, ns
    pub curve_ns: i64,
    /// largest force of the whole touch, N
    pub peak_force: f64,
    /// outcome of the touch
    pub outcome: TouchOutcome,
}

impl SupervisedArm<'_> {
    /// Touches once. The arm ends at the stand-off.
    ///
    /// # Errors
    /// [`ProbeError`]; a miss is none.
    pub fn touch(
        &mut self,
        target: &TouchTarget,
        params: &TouchParams,
    ) -> Result<TouchRecord, ProbeError> {
        (self.peak_force, self.reached) = (0.0, None);
        let going = "going to the stand-off";
        self.line(
            going,
            &target.standoff_bt,
            params.safe_speed(),
            params,
            params.trigger,
        )?;
        let begun = self.next(going)?.stamp_ns;
        self.reached = Some(0);
        let line = ApproachLine {
            start: target.standoff_bt.translation.vector,
            target,
            params,
        };
        let mut states = Vec::new();
        let outcome = self.search_and_measure(&line, &mut states)?;
        // the retraction may begin in contact
        self.leave("retracting", &target.standoff_bt, params.link_speed, params)?;
        let ended = self.last.map_or(begun, |state| state.stamp_ns);
        Ok(TouchRecord {
            target: *target,
            stamps_ns: [begun, ended],
            speed: params.measure_speed,
            curve: line.curve(&states, &line.contact_axis(&states)),
            curve_ns: states.first().map_or(ended, |state| state.stamp_ns),
            peak_force: self.peak_force,
            outcome,
        })
    }

    /// Finds the surface along the line, and measures it; `states` become the measured curve.
    fn search_and_measure(
        &mut self,
        line: &ApproachLine,
        states: &mut Vec<ArmState>,
    ) -> Result<TouchOutcome, ProbeError> {
        let params = line.params;
        let travel = line.target.search.min(self.limits.search);
        let mut search = SurfaceSearch {
            line,
            velocity: line.along(params.safe_speed().min(self.limits.speed)),
            contacts: 0,
            reached: 0.0,
        };
        let mut gone = 0.0;
        let mut is_contact = false;
        // a predicted surface needs no first search, only a measurement from just above it
        if let Some([at, room]) = line.predicted(travel) {
            gone = at - room;
            is_contact = search.run(self, "approaching", gone)?;
            self.halt("approaching", &mut |_| {})?;
            if !is_contact {
                let pressed = self.press(line, room + at - gone, states)?;
                gone = self.last.map_or(gone, |state| line.depth(&state)).max(gone);
                if pressed {
                    return Ok(line.outcome_of(states));
                }
            }
        }
        if is_contact || search.run(self, "searching", travel - gone)? {
            return self.measure(line, states);
        }
        states.clear();
        self.halt("stopping after a miss", &mut |_| {})?;
        Ok(TouchOutcome::Miss {
            travel: search.reached,
        })
    }

    /// Stops at the surface, backs off, and measures it.
    fn measure(
        &mut self,
        line: &ApproachLine,
        states: &mut Vec<ArmState>,
    ) -> Result<TouchOutcome, ProbeError> {
        let params = line.params;
        let stopping = "stopping at the surface";
        let mut forces = Vec::new();
        self.halt(stopping, &mut |state| forces.push(state.wrench_b.force))?;
        self.check_sign(stopping, line, mean(forces.into_iter()))?;
        let is_free = self.back_off(line)?;
        if is_free && self.press(line, SECOND * params.back_off, states)? {
            return Ok(line.outcome_of(states));
        }
        // contact in the first search, but not in the second
        let peak_n = states
            .iter()
            .map(|state| line.felt(state))
            .fold(0.0, f64::max);
        Ok(TouchOutcome::Unclear(OnsetError::NoContact {
            peak_n,
            contact_n: params.force,
        }))
    }

    /// A part pushes: a pull shows the wrong sign of the force.
    ///
    /// - `force_b`: mean while the arm came to rest, N.
    fn check_sign(
        &mut self,
        doing: &'static str,
        line: &ApproachLine,
        force_b: Vector3<f64>,
    ) -> Result<(), ProbeError> {
        let force_n = force_b.norm();
        let pulls =
            force_n > line.params.trigger && force_b.dot(&line.target.direction) > PULLS * force_n;
        if !pulls {
            return Ok(());
        }
        self.come_free(&Command::Velocity {
            linear: line.along(CRAWL),
            acceleration: self.limits.acceleration,
        })?;
        Err(ProbeError::Pulls { doing, force_n })
    }

    /// Backs off until free of the surface, then a little farther.
    ///
    /// The stand-off ends it; returns whether the tip is free.
    fn back_off(&mut self, line: &ApproachLine) -> Result<bool, ProbeError> {
        let (params, slow) = (line.params, line.along(self.slow(line)));
        let way_back = self
            .last
            .map_or(0.0, |state| line.depth(&state))
            .max(SECOND * params.back_off);
        let mut free_at = None;
        let is_free = self.search("backing off", -slow * BACK, way_back, &mut |state| {
            if line.felt(state) < params.trigger * FREE {
                free_at.get_or_insert(line.depth(state));
            }
            free_at.is_some_and(|free_at: f64| line.depth(state) < free_at - params.back_off)
        })?;
        self.halt("backing off", &mut |_| {})?;
        Ok(is_free)
    }

    /// Measuring search, from just above the surface, in and out; returns whether it reached the
    /// set force.
    ///
    /// - `room`: largest distance of the surface, m.
    fn press(
        &mut self,
        line: &ApproachLine,
        room: f64,
        states: &mut Vec<ArmState>,
    ) -> Result<bool, ProbeError> {
        let (params, slow) = (line.params, line.along(self.slow(line)));
        states.clear();
        let stop_at = params.force - self.overshoot(params, slow.norm());
        let is_pressed = |state: &ArmState| line.felt(state) > stop_at;
        self.search(
            "measuring",
            slow,
            room + params.force / params.stiffness * SECOND,
            &mut |state| {
                states.push(*state);
                is_pressed(state)
            },
        )?;
        let pressed = states.iter().any(is_pressed);
        self.halt("measuring", &mut |state| states.push(*state))?;
        if let Some(corner) = states
            .iter()
            .find(|state| state.wrench_b.force.norm() > params.trigger)
            .map(|at| line.depth(at))
        {
            self.search(
                "coming back from the surface",
                -slow,
                self.limits.search,
                &mut |state| {
                    states.push(*state);
                    line.depth(state) < corner - params.back_off
                },
            )?;
            self.halt("coming back from the surface", &mut |_| {})?;
        }
        Ok(pressed)
    }

    /// Speed of the measuring search, m/s.
    fn slow(&self, ApproachLine { params, .. }: &ApproachLine) -> f64 {
        params
            .measure_speed
            .min(params.safe_speed())
            .min(self.limits.speed)
    }

    /// Overshoot of the force after the stop of a search, N.
    fn overshoot(&self, params: &TouchParams, speed: f64) -> f64 {
        let acceleration = params.acceleration.min(self.limits.acceleration);
        let most = params.stiffness * speed * (params.latency + speed / (2.0 * acceleration));
        most.min(params.force - params.trigger)
    }
}

/// A search for the surface, fast.
struct SurfaceSearch<'a> {
    line: &'a ApproachLine<'a>,
    velocity: Vector3<f64>,
    /// consecutive states in contact
    contacts: u32,
    /// travel of the ball, m
    reached: f64,
}

impl SurfaceSearch<'_> {
    /// Goes on by up to `far`, m; returns whether it met the surface.
    fn run(
        &mut self,
        arm: &mut SupervisedArm,
        doing: &'static str,
        far: f64,
    ) -> Result<bool, ProbeError> {
        arm.search(doing, self.velocity, far, &mut |state| {
            self.reached = self.line.depth(state);
            self.contacts = if self.line.felt(state) > self.line.params.trigger {
                self.contacts + 1
            } else {
                0
            };
            self.contacts >= TRIGGERS
        })
    }
}

/// Line of a touch.
struct ApproachLine<'a> {
    start: Vector3<f64>,
    target: &'a TouchTarget,
    params: &'a TouchParams,
}

impl ApproachLine<'_> {
    /// Travel to a surface predicted well enough for a measurement at once, and the room above it,
    /// m.
    ///
    /// - `travel`: length of the search, m.
    fn predicted(&self, travel: f64) -> Option<[f64; 2]> {
        let back_off = self.params.back_off;
        let expected = self.target.expected?;
        let (at, room) = (expected.travel, KNOWN * expected.sigma + back_off);
        (room <= MOST_ROOM * back_off && room < at && at + room <= travel).then_some([at, room])
    }

    /// Vector of this length along the line.
    fn along(&self, by: f64) -> Vector3<f64> {
        self.target.direction.into_inner() * by
    }

    /// Travel of the ball, m.
    fn depth(&self, state: &ArmState) -> f64 {
        (state.pose_bt.translation.vector - self.start).dot(&self.target.direction)
    }

    /// Force against the approach, N.
    fn presses(&self, state: &ArmState) -> f64 {
        -state.wrench_b.force.dot(&self.target.direction)
    }

    /// Contact force, N: against the approach, or aside at a wall met at a flat angle or on the way
    /// down a rim.
    fn felt(&self, state: &ArmState) -> f64 {
        self.presses(state).max(state.wrench_b.force.norm() / ASIDE)
    }

    /// - `axis`: of the force, unit vector in B.
    fn curve(&self, states: &[ArmState], axis: &Vector3<f64>) -> Vec<TouchMoment> {
        let begun = states.first().map_or(0, |state| state.stamp_ns);
        let moment = |state: &ArmState| {
            let force = state.wrench_b.force.dot(axis);
            let lateral = (state.wrench_b.force - axis * force).norm();
            TouchMoment {
                t: (state.stamp_ns - begun) as f64 * 1e-9,
                travel: self.depth(state),
                force,
                lateral,
            }
        };
        states.iter().map(moment).collect()
    }

    /// Direction of the contact's push, unit vector in B: against the approach; for a wall met at a
    /// flat angle, along the force, which bends at the same travel and is larger.
    fn contact_axis(&self, states: &[ArmState]) -> Vector3<f64> {
        let back = -self.along(1.0);
        let norm = |state: &ArmState| state.wrench_b.force.norm();
        let most = states.iter().map(norm).fold(0.0, f64::max);
        let hard: Vector3<f64> = states
            .iter()
            .filter(|state| norm(state) > 0.5 * most)
            .map(|state| state.wrench_b.force)
            .sum();
        let pushes = hard.try_normalize(0.0).unwrap_or(back);
        if pushes.dot(&back) < FLAT {
            pushes
        } else {
            back
        }
    }

    /// Outcome of a curve that reached the set force.
    fn outcome_of(&self, states: &[ArmState]) -> TouchOutcome {
        let axis = self.contact_axis(states);
        let onset = match find_onset(&self.curve(states, &axis), &self.params.onset) {
            Ok(onset) => onset,
            Err(error) => return TouchOutcome::Unclear(error),
        };
        // line of the ball, by all poses of the curve
        let aside = mean(states.iter().map(|state| {
            let gone = state.pose_bt.translation.vector - self.start;
            gone - self.along(gone.dot(&self.target.direction))
        }));
        let force = |state: &ArmState| state.wrench_b.force;
        let hard = states
            .iter()
            .map(force)
            .filter(|force| force.dot(&axis) - onset.bias > 0.5 * onset.peak);
        let (sum, count) = hard.fold((Vector3::zeros(), 0u32), |(sum, n), force| {
            (sum + force, n + 1)
        });
        let centre = Point3::from(self.start + self.along(onset.travel) + aside);
        TouchOutcome::Contact {
            onset,
            centre,
            force_b: sum / f64::from(count.max(1)),
        }
    }
}

/// Total force that also stops the ball, over the limit along its direction: a wall met at 45°
/// pushes √2 times as much.
const ASIDE: f64 = 1.42;
/// Cosine of 33°: a wall whose push is farther from the approach is met at a flat angle.
const FLAT: f64 = 0.8387;
/// Pull of a contact, over its force, that shows a wrong sign.
const PULLS: f64 = 0.7;
/// Standard deviations of margin above a predicted surface, without a first search.
const KNOWN: f64 = 4.0;
/// Maximum margin above a predicted surface without a first search, over the back-off.
const MOST_ROOM: f64 = 3.0;
/// Speed of the retraction, over the measuring search.
const BACK: f64 = 2.0;
/// Share of the trigger below which the tip is free.
const FREE: f64 = 0.5;
/// Length of the second search, over the necessary one.
const SECOND: f64 = 3.0;
