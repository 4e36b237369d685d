//! An arm behind ros2_control as the trait [`Arm`].

use std::time::{Duration, Instant};

use nalgebra::{Isometry3, SVector, Vector3};

use super::brake_plan::BrakePlan;
use super::params::Ros2ControlParams;
use super::reader::{ArmSample, JointSample, StateReader};
use crate::ros::port::ArmPort;
use touchup_method::stylus::Wrench;
use touchup_probing::arm::{
    Arm, ArmError, ArmState, Command, Freshness, Joints, MOST_JOINTS, Obedience, OrderedMotion,
    Safety, velocity_towards,
};

/// Number of states at the start; the median time between them is the period.
const RATED: usize = 21;
/// Maximum period for feeling contact, s.
const LONGEST_PERIOD: f64 = 11e-3;
/// Time constant of the end of a line, in latencies.
const SETTLING: f64 = 3.0;
/// Time constant of the force of a press, in latencies.
const CALM: f64 = 4.0;
/// Acceleration of a press, m/s².
const PRESS_ACCELERATION: f64 = 2.0;
/// Deceleration without orders, and after a fault, m/s².
const FAULT_STOP: f64 = 2.0;
/// Acceleration of rotations, rad/s².
const TURN_ACCELERATION: f64 = 2.0;
/// Maximum speed of a standing tip, m/s.
const STANDING: f64 = 5e-3;
/// Minimum duration of standing.
const STANDING_FOR: Duration = Duration::from_millis(20);
/// Maximum duration of braking and watching after a fault.
const BRAKING: Duration = Duration::from_millis(300);
/// Period of resending a stop while no message comes.
const AGAIN: Duration = Duration::from_millis(10);
/// Minimum ordered travel of the joints for the check that they follow, rad.
const ORDERED: f64 = 20e-3;
/// Minimum share of the ordered travel that the joints make.
const FOLLOWED: f64 = 0.2;
/// Minimum time between orders of the same kind, s: a controller with a new trajectory in each of
/// its periods repeats its last set point forever (ros2_controllers before pull request 780).
const ORDER_EVERY: f64 = 8e-3;
/// Number of states whose mean is the zero of the sensor.
const ZEROING: usize = 64;
/// Maximum difference of the means of the two halves, N; beyond it something moves the tip.
const CALM_FORCE: f64 = 0.5;

/// An arm behind ros2_control that holds a probe.
///
/// After a fault it brakes until its joints stand, and every call but a stop returns the fault,
/// until [`Arm::recover`].
pub struct Ros2ControlArm {
    params: Ros2ControlParams,
    reader: StateReader,
    begun: Instant,
    /// median time between states, s
    period: f64,
    last: ArmSample,
    /// zero of the sensor in the flange
    tare: Wrench,
    plan: BrakePlan,
    planned_at: Instant,
    /// motion of the plan
    doing: Option<OrderedMotion>,
    freshness: Freshness,
    obedience: Obedience,
    way: Way,
    fault: Option<ArmError>,
}

/// Ordered travel of the joints, and its start.
#[derive(Clone, Debug)]
struct Way {
    from: Joints,
    ordered: SVector<f64, MOST_JOINTS>,
    /// end of the orders included
    until: Instant,
}

impl Ros2ControlArm {
    /// Listens until states have come on all topics. Nothing moves.
    ///
    /// # Errors
    /// [`ArmError::TopicSilent`] for a topic without messages; [`ArmError::Unreadable`];
    /// [`ArmError::Refused`] for parameters out of range, a low rate of states, and orders without
    /// a listener.
    pub fn connect(params: &Ros2ControlParams, port: Box<dyn ArmPort>) -> Result<Self, ArmError> {
        params.check()?;
        let mut reader = StateReader::new(port, params);
        let (last, period) = rated(&mut reader, params)?;
        let begun = params.clock.now();
        // discovery finds listeners somewhat later than senders
        while reader.port().order_listeners() == Some(0)
            && params.clock.since(begun) < params.connect
        {
            reader.next(params, params.silent)?;
        }
        if reader.port().order_listeners() == Some(0) {
            let reason = format!(
                "nobody listens to {}: is joint_trajectory_controller active (`ros2 control list_controllers`)?",
                params.section.trajectory_topic
            );
            return Err(ArmError::refused("to connect", reason));
        }
        let plan = BrakePlan::rest(params.geometry.joint_count());
        let too_many = || ArmError::refused("to connect", "it has too many joints");
        let plan = plan.ok_or_else(too_many)?;
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

    /// Converts a measurement to the state of the trait.
    fn seen(&self, measured: &ArmSample) -> ArmState {
        let pose_bf = self.params.geometry.flange(&measured.sample.joints);
        let contact_f = self.unweighed(measured) - self.tare;
        let p_tf = -self.params.pose_ft.translation.vector;
        ArmState {
            stamp_ns: measured.sample.stamp_ns,
            pose_bt: pose_bf * self.params.pose_ft,
            wrench_b: contact_f.about(&p_tf).turned(&pose_bf.rotation),
            raw_wrench_f: measured.wrench_f,
            joints: measured.sample.joints,
            safety: Safety::Normal,
        }
    }

    /// Reading of the sensor less the weight, in the flange.
    fn unweighed(&self, measured: &ArmSample) -> Wrench {
        let r_bf = self
            .params
            .geometry
            .flange(&measured.sample.joints)
            .rotation;
        let weight = self.params.payload.weight_o(&r_bf);
        measured.wrench_f - weight.turned(&r_bf.inverse())
    }

    /// Vector from the flange to the tip, m in B.
    fn arm_of_tip(&self) -> Vector3<f64> {
        let pose_bf: Isometry3<f64> = self.params.geometry.flange(&self.last.sample.joints);
        pose_bf.rotation * self.params.pose_ft.translation.vector
    }

    /// Twist of the tip from joint velocities, m/s and rad/s in B.
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

    /// Joint velocities from the twist of the tip, rad/s.
    fn rates_of(&self, [x, y, z, a, b, c]: [f64; 6]) -> Result<Joints, ArmError> {
        let angular = Vector3::new(a, b, c);
        let of_flange = Vector3::new(x, y, z) - angular.cross(&self.arm_of_tip());
        let rates = self
            .params
            .geometry
            .turning(&self.last.sample.joints, &of_flange, &angular);
        let rates = rates.ok_or_else(|| {
            let reason = "the arm is in a singularity: begin from another pose";
            ArmError::refused("a velocity", reason)
        })?;
        let most = self.params.top_joint_speed;
        match rates.iter().position(|rate| rate.abs() > most) {
            Some(joint) => {
                let reason = format!(
                    "{} would have to turn with {:.0}°/s, and may with {:.0}: the arm is near a singularity",
                    self.params.joint_names[joint],
                    rates[joint].abs().to_degrees(),
                    most.to_degrees()
                );
                Err(ArmError::refused("a velocity", reason))
            }
            None => Ok(rates),
        }
    }

    /// Expected joint velocities of the controller, rad/s.
    fn ordered_now(&self, now: Instant) -> Joints {
        self.plan
            .velocity(now.saturating_duration_since(self.planned_at).as_secs_f64())
    }

    /// Minimum duration of a change of velocity, s: the controller may lag the plan by its share of
    /// the latency.
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

    /// Whether the previous order is of the same kind, and too young for a replacement.
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

    /// Waits for the next state and checks it for all faults.
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
            let topic = self.params.section.trajectory_topic.clone();
            return Err(ArmError::Ignores {
                topic,
                ordered_deg: ordered.to_degrees(),
                moved_deg: moved.to_degrees(),
            });
        }
        Ok(self.seen(&self.last))
    }

    /// Brakes until the states show standstill; from now on the arm keeps the fault.
    fn fail(&mut self, first: ArmError) -> ArmError {
        let clock = self.params.clock.clone();
        let begun = clock.now();
        let (mut moving, mut still_since) = (None, None);
        let mut last_ns = self.last.sample.stamp_ns;
        while clock.since(begun) < BRAKING {
            // a lost order does no harm: the previous trajectory ends at rest
            let _ = self.stop(FAULT_STOP);
            let Some(sample) = self.reader.watch(&self.params, AGAIN) else {
                continue;
            };
            if std::mem::replace(&mut last_ns, sample.stamp_ns) == sample.stamp_ns {
                // a repeated state is not new evidence
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

    /// Speed of the tip, m/s.
    fn speed_of(&self, sample: &JointSample) -> f64 {
        let [x, y, z, ..] = self.twist_of(&sample.rates);
        Vector3::new(x, y, z).norm()
    }

    fn obey(&mut self, command: &Command) -> Result<(), ArmError> {
        match command.checked(self.params.top_speed, self.params.top_force)? {
            Command::Stop { deceleration } => self.stop(deceleration),
            Command::Velocity {
                linear,
                acceleration,
            } => self.go_at([linear.x, linear.y, linear.z, 0.0, 0.0, 0.0], acceleration),
            Command::Line {
                to,
                speed,
                acceleration,
            } => {
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
            } => self.press(axis, force, feed, speed),
        }
    }

    fn press(
        &mut self,
        axis: Vector3<f64>,
        force: f64,
        feed: Vector3<f64>,
        speed: f64,
    ) -> Result<(), ArmError> {
        // dF/dt = K v: with v = (F − F_now)/(K T) the force converges with time constant T,
        // stable for T of some latencies
        let felt = -self.seen(&self.last).wrench_b.force.dot(&axis);
        let gain = 1.0 / (CALM * self.params.stiffness * (self.params.latency + self.period));
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
                let reason = "the arm moves: its sensor is zeroed at rest";
                return Err(ArmError::refused("to zero its sensor", reason));
            }
            let free = self.unweighed(&self.last);
            let half = &mut halves[number * 2 / ZEROING];
            *half = *half + free * (2.0 / ZEROING as f64);
        }
        let [first, second] = halves;
        let change = (second.force - first.force).norm();
        if change > CALM_FORCE {
            let reason = format!(
                "what it feels at rest changes by {change:.1} N: something moves the tip, or its cable"
            );
            return Err(ArmError::refused("to zero its sensor", reason));
        }
        self.tare = (first + second) * 0.5;
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

    /// Adds the orders of a plan up to now.
    fn follow(&mut self, plan: &BrakePlan, planned_at: Instant, now: Instant) {
        let after = |at: Instant| at.saturating_duration_since(planned_at).as_secs_f64();
        self.ordered += plan.way(after(self.until), after(now));
        self.until = now;
    }

    /// Ordered and actual travel of the joints, rad, once it is long enough to judge and shows that
    /// they do not follow.
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

/// Duration of a change of the tip's twist, s.
fn lasting([x, y, z, a, b, c]: &[f64; 6], acceleration: f64) -> f64 {
    let (linear, angular) = (
        Vector3::new(*x, *y, *z).norm(),
        Vector3::new(*a, *b, *c).norm(),
    );
    (linear / acceleration).max(angular / TURN_ACCELERATION)
}

/// The last of the first states, and their period, s.
fn rated(
    reader: &mut StateReader,
    params: &Ros2ControlParams,
) -> Result<(ArmSample, f64), ArmError> {
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
        let topic = &params.section.joint_states_topic;
        let reason = format!(
            "{topic} comes with {hz:.0} Hz, and {needed:.0} Hz are needed: raise update_rate of the controller manager"
        );
        return Err(ArmError::refused("to connect", reason));
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
            // a stop is right at any time
            Some(_) if is_stop => return self.obey(command),
            Some(fault) => return Err(fault.clone()),
            None => {}
        }
        self.reader
            .drain(&self.params)
            .map_err(|error| self.fail(error))?;
        let followed_s = self.last.sample.stamp_ns as f64 * 1e-9;
        // without a new order the previous one ends at rest
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

    /// Listens anew: states have to come on all topics, and the arm has to stand. Sends no order,
    /// and does not zero the sensor, as the probe may still be pressed.
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
