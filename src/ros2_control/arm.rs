//! An arm behind ros2_control as the trait [`Arm`].

use std::time::{Duration, Instant};

use nalgebra::{Isometry3, SVector, Vector3};

use super::brake_plan::BrakePlan;
use super::params::Ros2ControlParams;
use super::reader::{JointSample, Measured, StateReader};
use crate::probing::arm::{
    Arm, ArmError, ArmState, Command, Freshness, Joints, MOST_JOINTS, Obedience, OrderedMotion,
    Safety, velocity_towards,
};
use crate::ros::port::ArmPort;
use crate::stylus::Wrench;

/// States at the start whose rate is looked at; the middle one of their distances is the period.
const RATED: usize = 21;
/// The longest period, s: contact is to be felt within this.
const LONGEST_PERIOD: f64 = 11e-3;
/// A line comes to its end with so many latencies as its time constant.
const SETTLING: f64 = 3.0;
/// A press comes to its force with so many latencies as its time constant.
const CALM: f64 = 4.0;
/// Of the velocity of a press, m/s².
const PRESS_ACCELERATION: f64 = 2.0;
/// With which it brakes when no order comes any more, and after a fault, m/s².
const FAULT_STOP: f64 = 2.0;
/// Most that anything may ask for, m/s².
const TOP_ACCELERATION: f64 = 10.0;
/// Turns begin and end with this, rad/s².
const TURN_ACCELERATION: f64 = 2.0;
/// A tip stands below this speed, m/s …
const STANDING: f64 = 5e-3;
/// … for so long.
const STANDING_FOR: Duration = Duration::from_millis(20);
/// After a fault the arm is braked and looked at for so long at most.
const BRAKING: Duration = Duration::from_millis(300);
/// A stop is sent again after this time where nothing is heard.
const AGAIN: Duration = Duration::from_millis(10);
/// After joints were ordered to go so far, rad …
const ORDERED: f64 = 20e-3;
/// … they must have gone this share of it.
const FOLLOWED: f64 = 0.2;
/// The same kind of order is sent again after this time, s: a controller that is given a new
/// trajectory in each of its periods repeats its last set point for ever (ros2_controllers before
/// pull request 780).
const ORDER_EVERY: f64 = 8e-3;
/// States of which the mean is the zero of the sensor.
const ZEROING: usize = 64;
/// The means of their halves may differ by this, N, or something moves the tip.
const CALM_FORCE: f64 = 0.5;

/// An arm behind ros2_control that holds a probe.
///
/// After a fault it is braked until its joints stand, and every call but a stop returns the fault,
/// until [`Arm::recover`].
pub struct Ros2ControlArm {
    params: Ros2ControlParams,
    reader: StateReader,
    begun: Instant,
    /// s
    period: f64,
    last: Measured,
    /// of the sensor in the flange
    tare: Wrench,
    plan: BrakePlan,
    planned_at: Instant,
    /// what the plan is for
    doing: Option<OrderedMotion>,
    freshness: Freshness,
    obedience: Obedience,
    way: Way,
    fault: Option<ArmError>,
}

/// How far the joints were ordered to go, and from where.
#[derive(Clone, Debug)]
struct Way {
    from: Joints,
    ordered: SVector<f64, MOST_JOINTS>,
    /// the orders up to here are in it
    until: Instant,
}

impl Ros2ControlArm {
    /// Listens until states have come on all topics. Nothing moves.
    ///
    /// # Errors
    /// [`ArmError::TopicSilent`] for one that brings nothing; [`ArmError::Unreadable`];
    /// [`ArmError::Refused`] for parameters out of range, states that come too seldom, and orders
    /// that nobody listens to.
    pub fn connect(params: &Ros2ControlParams, port: Box<dyn ArmPort>) -> Result<Self, ArmError> {
        params.check()?;
        let mut reader = StateReader::new(port, params);
        let (last, period) = rated(&mut reader, params)?;
        let begun = params.clock.now();
        // who listens is found somewhat later than who sends
        while reader.port().order_listeners() == Some(0)
            && params.clock.since(begun) < params.connect
        {
            reader.next(params, params.silent)?;
        }
        if reader.port().order_listeners() == Some(0) {
            let reason = format!(
                "nobody listens to {}: is joint_trajectory_controller active (`ros2 control list_controllers`)?",
                params.topics.trajectory
            );
            return Err(ArmError::Refused {
                what: "to connect",
                reason,
            });
        }
        let plan = BrakePlan::rest(params.geometry.joint_count());
        let plan = plan.ok_or(ArmError::Refused {
            what: "to connect",
            reason: "it has too many joints".to_owned(),
        })?;
        let now = params.clock.now();
        Ok(Self {
            reader,
            begun: now,
            period,
            last,
            tare: Wrench::default(),
            plan,
            planned_at: now,
            doing: None,
            freshness: Freshness::new(period),
            obedience: Obedience::new(Duration::ZERO),
            way: Way::from(last.sample.joints, now),
            fault: None,
            params: params.clone(),
        })
    }

    /// What was measured, as the trait has it.
    fn seen(&self, measured: &Measured) -> ArmState {
        let pose_bf = self.params.geometry.flange(&measured.sample.joints);
        let free = self.unweighed(measured);
        let (force, torque) = (free.force - self.tare.force, free.torque - self.tare.torque);
        // about the centre of the ball
        let torque = torque - self.params.pose_ft.translation.vector.cross(&force);
        ArmState {
            stamp_ns: measured.sample.stamp_ns,
            pose_bt: pose_bf * self.params.pose_ft,
            wrench_b: Wrench {
                force: pose_bf.rotation * force,
                torque: pose_bf.rotation * torque,
            },
            raw_wrench_f: measured.wrench_f,
            joints: measured.sample.joints,
            safety: Safety::Normal,
        }
    }

    /// What the sensor has but for the weight, in the flange.
    fn unweighed(&self, measured: &Measured) -> Wrench {
        let r_bf = self
            .params
            .geometry
            .flange(&measured.sample.joints)
            .rotation;
        let (weight, raw) = (self.params.payload.weight_o(&r_bf), measured.wrench_f);
        Wrench {
            force: raw.force - r_bf.inverse() * weight.force,
            torque: raw.torque - r_bf.inverse() * weight.torque,
        }
    }

    /// From the flange to the tip, m in B.
    fn arm_of_tip(&self) -> Vector3<f64> {
        let pose_bf: Isometry3<f64> = self.params.geometry.flange(&self.last.sample.joints);
        pose_bf.rotation * self.params.pose_ft.translation.vector
    }

    /// Velocity of the tip by that of the joints, m/s and rad/s in B.
    fn twist_of(&self, rates: &Joints) -> [f64; 6] {
        let mut all = SVector::<f64, MOST_JOINTS>::zeros();
        rates
            .iter()
            .enumerate()
            .for_each(|(joint, rate)| all[joint] = *rate);
        let of_flange = self.params.geometry.jacobian(&self.last.sample.joints) * all;
        let angular = Vector3::new(of_flange[3], of_flange[4], of_flange[5]);
        let linear = Vector3::new(of_flange[0], of_flange[1], of_flange[2])
            + angular.cross(&self.arm_of_tip());
        [
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        ]
    }

    /// Velocity of the joints by that of the tip, rad/s.
    fn rates_of(&self, [x, y, z, a, b, c]: [f64; 6]) -> Result<Joints, ArmError> {
        let angular = Vector3::new(a, b, c);
        let of_flange = Vector3::new(x, y, z) - angular.cross(&self.arm_of_tip());
        let refused = |reason| ArmError::Refused {
            what: "a velocity",
            reason,
        };
        let rates = self
            .params
            .geometry
            .turning(&self.last.sample.joints, &of_flange, &angular);
        let rates = rates.ok_or_else(|| {
            refused("the arm is in a singularity: begin from another pose".to_owned())
        })?;
        let most = self.params.top_joint_speed;
        match rates.iter().position(|rate| rate.abs() > most) {
            Some(joint) => Err(refused(format!(
                "{} would have to turn with {:.0}°/s, and may with {:.0}: the arm is near a singularity",
                self.params.joint_names[joint],
                rates[joint].abs().to_degrees(),
                most.to_degrees()
            ))),
            None => Ok(rates),
        }
    }

    /// Velocity of the joints that the controller should have by now, rad/s.
    fn ordered_now(&self, now: Instant) -> Joints {
        self.plan
            .velocity(now.saturating_duration_since(self.planned_at).as_secs_f64())
    }

    /// Changes of velocity take no shorter, s: the controller may be behind what it is thought to
    /// do by its share of the latency.
    fn least_ramp(&self) -> f64 {
        (2.0 * self.period).max(0.5 * self.params.latency)
    }

    fn go(
        &mut self,
        twist: [f64; 6],
        acceleration: f64,
        motion: &OrderedMotion,
    ) -> Result<(), ArmError> {
        let to = self.rates_of(twist)?;
        if self.is_early(motion) {
            return Ok(());
        }
        let from = self.ordered_now(self.params.clock.now());
        let change = self.twist_of(&to.mapped(|joint, rate| rate - from[joint]));
        let ramp = lasting(&change, acceleration).max(self.least_ramp());
        let brake = lasting(&twist, FAULT_STOP).max(self.least_ramp());
        self.send(BrakePlan::going(from, to, ramp, brake), motion)
    }

    fn stop(&mut self, deceleration: f64) -> Result<(), ArmError> {
        let motion = OrderedMotion::Stop { deceleration };
        if self.is_early(&motion) {
            return Ok(());
        }
        let from = self.ordered_now(self.params.clock.now());
        let ramp = lasting(&self.twist_of(&from), deceleration).max(self.least_ramp());
        self.send(BrakePlan::stopping(from, ramp), &motion)
    }

    /// Whether the order before is of the same kind, and too young to be replaced.
    fn is_early(&self, motion: &OrderedMotion) -> bool {
        let same =
            |doing: &OrderedMotion| std::mem::discriminant(doing) == std::mem::discriminant(motion);
        let age = self.params.clock.since(self.planned_at).as_secs_f64();
        age < ORDER_EVERY && self.doing.as_ref().is_some_and(same)
    }

    fn send(&mut self, plan: BrakePlan, motion: &OrderedMotion) -> Result<(), ArmError> {
        let now = self.params.clock.now();
        self.way.follow(&self.plan, self.planned_at, now);
        self.obedience
            .order(motion, now.saturating_duration_since(self.begun));
        if !self
            .reader
            .port()
            .publish_trajectory(plan.message(&self.params.joint_names))
        {
            return Err(ArmError::Dropped { what: "orders" });
        }
        (self.plan, self.planned_at, self.doing) = (plan, now, Some(*motion));
        Ok(())
    }

    /// The next state, with all that can be wrong with it.
    fn await_state(&mut self) -> Result<ArmState, ArmError> {
        self.last = self.reader.next(&self.params, self.params.silent)?;
        let now = self.params.clock.now();
        let twist = self.twist_of(&self.last.sample.rates);
        let pose = self.seen(&self.last).pose_bt;
        if let Some(fault) =
            self.obedience
                .see(&pose, &twist, now.saturating_duration_since(self.begun))
        {
            return Err(fault);
        }
        self.way.follow(&self.plan, self.planned_at, now);
        if let Some([ordered, moved]) = self.way.ignored(&self.last.sample.joints, now) {
            let topic = self.params.topics.trajectory.clone();
            return Err(ArmError::Ignores {
                topic,
                ordered_deg: ordered.to_degrees(),
                moved_deg: moved.to_degrees(),
            });
        }
        Ok(self.seen(&self.last))
    }

    /// Brakes until the arm is seen to stand; from now on it is stopped for a reason.
    fn fail(&mut self, first: ArmError) -> ArmError {
        let clock = self.params.clock.clone();
        let begun = clock.now();
        let (mut moving, mut still_since) = (None, None);
        let mut last_ns = self.last.sample.stamp_ns;
        while clock.since(begun) < BRAKING {
            // an order that is not sent is one that the trajectory before does without: it ends at
            // rest
            let _ = self.stop(FAULT_STOP);
            let Some(sample) = self.reader.watch(&self.params, AGAIN) else {
                continue;
            };
            if std::mem::replace(&mut last_ns, sample.stamp_ns) == sample.stamp_ns {
                // the same again says nothing of now
                continue;
            }
            let speed = self.speed_of(&sample);
            if speed > STANDING {
                (moving, still_since) = (Some(speed), None);
                continue;
            }
            moving = None;
            if clock.since(*still_since.get_or_insert(clock.now())) >= STANDING_FOR {
                break;
            }
        }
        let fault = match moving {
            Some(speed) => ArmError::GoesOn {
                mm_per_s: speed * 1e3,
                first: first.to_string(),
            },
            None => first,
        };
        self.fault = Some(fault.clone());
        fault
    }

    /// Of the tip, m/s.
    fn speed_of(&self, sample: &JointSample) -> f64 {
        let [x, y, z, ..] = self.twist_of(&sample.rates);
        Vector3::new(x, y, z).norm()
    }

    fn check(&self, what: &'static str, speed: f64, acceleration: f64) -> Result<(), ArmError> {
        let most = self.params.top_speed;
        let refuse = |reason| Err(ArmError::Refused { what, reason });
        if !(0.0..=most).contains(&speed) {
            return refuse(format!("{speed} m/s is not from 0 to {most} m/s"));
        }
        if acceleration.is_nan() || acceleration <= 0.0 || acceleration > TOP_ACCELERATION {
            return refuse(format!(
                "{acceleration} m/s² is not above 0 and up to {TOP_ACCELERATION} m/s²"
            ));
        }
        Ok(())
    }

    #[expect(clippy::too_many_lines)]
    fn obey(&mut self, command: &Command) -> Result<(), ArmError> {
        let refuse = |what, reason: &str| {
            Err(ArmError::Refused {
                what,
                reason: reason.to_owned(),
            })
        };
        match *command {
            Command::Stop { deceleration } => {
                self.check("a stop", 0.0, deceleration)?;
                self.stop(deceleration)
            }
            Command::Velocity {
                linear,
                acceleration,
            } => {
                self.check("a velocity", linear.norm(), acceleration)?;
                self.go_at([linear.x, linear.y, linear.z, 0.0, 0.0, 0.0], acceleration)
            }
            Command::Line {
                to,
                speed,
                acceleration,
            } => {
                self.check("a line", speed, acceleration)?;
                let is_pose = to
                    .translation
                    .vector
                    .iter()
                    .chain(to.rotation.coords.iter())
                    .all(|part| part.is_finite());
                if !is_pose {
                    return refuse("a line", "its end is no pose");
                }
                let from = self.seen(&self.last).pose_bt;
                let settling = SETTLING * self.params.latency;
                self.go_at(
                    velocity_towards(&from, &to, [speed, acceleration], settling),
                    acceleration,
                )
            }
            Command::Press {
                axis,
                force,
                feed,
                speed,
            } => {
                self.check("a press", feed.norm().max(speed), PRESS_ACCELERATION)?;
                if !(0.0..=self.params.top_force).contains(&force) {
                    return refuse(
                        "a press",
                        &format!("{force} N is not from 0 to {} N", self.params.top_force),
                    );
                }
                let Some(axis) = axis
                    .try_normalize(0.5)
                    .filter(|axis| axis.iter().all(|part| part.is_finite()))
                else {
                    return refuse("a press", "its axis is no direction");
                };
                // dF/dt = K v: with v = (F − F_now)/(K T) the force comes to its end with T, stable
                // while T is some latencies
                let felt = -self.seen(&self.last).wrench_b.force.dot(&axis);
                let gain =
                    1.0 / (CALM * self.params.stiffness * (self.params.latency + self.period));
                let across = feed - axis * feed.dot(&axis);
                let v = axis * ((force - felt) * gain).clamp(-speed, speed) + across;
                let motion = OrderedMotion::Press {
                    axis,
                    speed,
                    feed: across,
                    acceleration: PRESS_ACCELERATION,
                };
                self.go([v.x, v.y, v.z, 0.0, 0.0, 0.0], PRESS_ACCELERATION, &motion)
            }
        }
    }

    fn go_at(&mut self, twist: [f64; 6], acceleration: f64) -> Result<(), ArmError> {
        self.go(
            twist,
            acceleration,
            &OrderedMotion::Move {
                twist,
                acceleration,
            },
        )
    }

    fn zero(&mut self) -> Result<(), ArmError> {
        let mut halves = [Wrench::default(); 2];
        for number in 0..ZEROING {
            self.stop(FAULT_STOP)?;
            self.await_state()?;
            if self.speed_of(&self.last.sample) > STANDING {
                let reason = "the arm moves: its sensor is zeroed at rest".to_owned();
                return Err(ArmError::Refused {
                    what: "to zero its sensor",
                    reason,
                });
            }
            let free = self.unweighed(&self.last);
            let half = &mut halves[number * 2 / ZEROING];
            half.force += free.force * (2.0 / ZEROING as f64);
            half.torque += free.torque * (2.0 / ZEROING as f64);
        }
        let [first, second] = halves;
        let change = (second.force - first.force).norm();
        if change > CALM_FORCE {
            let reason = format!(
                "what it feels at rest changes by {change:.1} N: something moves the tip, or its cable"
            );
            return Err(ArmError::Refused {
                what: "to zero its sensor",
                reason,
            });
        }
        self.tare = Wrench {
            force: (first.force + second.force) * 0.5,
            torque: (first.torque + second.torque) * 0.5,
        };
        Ok(())
    }
}

impl Way {
    fn from(from: Joints, now: Instant) -> Self {
        Self {
            from,
            ordered: SVector::zeros(),
            until: now,
        }
    }

    /// The orders of a plan up to now count.
    fn follow(&mut self, plan: &BrakePlan, planned_at: Instant, now: Instant) {
        let after = |at: Instant| at.saturating_duration_since(planned_at).as_secs_f64();
        self.ordered += plan.way(after(self.until), after(now));
        self.until = now;
    }

    /// How far they were ordered to go and went, rad, once that is clear and where it is not
    /// enough.
    fn ignored(&mut self, joints: &Joints, now: Instant) -> Option<[f64; 2]> {
        let ordered = self.ordered.norm();
        if ordered < ORDERED {
            return None;
        }
        let moved = joints
            .iter()
            .zip(self.from.iter())
            .map(|(to, from)| (to - from).powi(2))
            .sum::<f64>()
            .sqrt();
        *self = Self::from(*joints, now);
        (moved < FOLLOWED * ordered).then_some([ordered, moved])
    }
}

/// How long a change of the velocity of the tip takes, s.
fn lasting([x, y, z, a, b, c]: &[f64; 6], acceleration: f64) -> f64 {
    let (linear, angular) = (
        Vector3::new(*x, *y, *z).norm(),
        Vector3::new(*a, *b, *c).norm(),
    );
    (linear / acceleration).max(angular / TURN_ACCELERATION)
}

/// The first states, and their period, s.
fn rated(
    reader: &mut StateReader,
    params: &Ros2ControlParams,
) -> Result<(Measured, f64), ArmError> {
    let mut last = reader.next(params, params.connect)?;
    let mut apart = Vec::with_capacity(RATED);
    for _ in 0..RATED {
        let next = reader.next(params, params.connect)?;
        apart.push((next.sample.stamp_ns - last.sample.stamp_ns) as f64 * 1e-9);
        last = next;
    }
    apart.sort_by(f64::total_cmp);
    let period = apart[RATED / 2];
    if period > LONGEST_PERIOD {
        let (hz, needed) = (1.0 / period, 1.0 / LONGEST_PERIOD);
        let topic = &params.topics.joint_states;
        let reason = format!(
            "{topic} comes with {hz:.0} Hz, and {needed:.0} Hz are needed: raise update_rate of the controller manager"
        );
        return Err(ArmError::Refused {
            what: "to connect",
            reason,
        });
    }
    Ok((last, period))
}

impl Arm for Ros2ControlArm {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        match self.fault.clone() {
            Some(fault) => Err(fault),
            None => self.await_state().map_err(|error| self.fail(error)),
        }
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        let is_stop = matches!(command, Command::Stop { .. });
        match &self.fault {
            // a stop is right whenever it comes
            Some(_) if is_stop => return self.obey(command),
            Some(fault) => return Err(fault.clone()),
            None => {}
        }
        self.reader
            .drain(&self.params)
            .map_err(|error| self.fail(error))?;
        let followed_s = self.last.sample.stamp_ns as f64 * 1e-9;
        // the order before ends at rest, where none is sent
        if is_stop
            || self
                .freshness
                .may_send(followed_s, (self.reader.newest_s(), 0.0))?
        {
            self.obey(command)?;
        }
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        self.zero().map_err(|error| match error {
            ArmError::Refused { .. } => error,
            fault => self.fail(fault),
        })
    }

    /// Listens anew: states have to come on all topics, and the arm has to stand. No order is sent,
    /// and the sensor is not zeroed, for the probe may still be pressed.
    fn recover(&mut self) -> Result<(), ArmError> {
        self.reader.restart(&self.params);
        let (last, period) = rated(&mut self.reader, &self.params)?;
        (self.last, self.period, self.freshness) = (last, period, Freshness::new(period));
        let speed = self.speed_of(&last.sample);
        if speed > STANDING {
            let first = "it is to recover".to_owned();
            return Err(ArmError::GoesOn {
                mm_per_s: speed * 1e3,
                first,
            });
        }
        let now = self.params.clock.now();
        self.plan = BrakePlan::stopping(last.sample.joints.mapped(|_, _| 0.0), self.least_ramp());
        (self.planned_at, self.begun, self.doing) = (now, now, None);
        self.obedience = Obedience::new(Duration::ZERO);
        self.way = Way::from(last.sample.joints, now);
        self.fault = None;
        Ok(())
    }

    fn period(&self) -> f64 {
        self.period
    }
}
