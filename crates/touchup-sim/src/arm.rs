//! An arm with an elastic probe against a known surface, in its own time.
//!
//! The arm follows its command with limited acceleration, some milliseconds late. Its encoders give
//! the place of its tip without bending: x_c. The part keeps the ball at x; arm and probe pull it
//! back with K (x_c − x), so the part pushes with K (x − x_c). Inside the cone of friction the ball
//! stays; else it slides until the force lies on the cone.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::arm_errors::ArmErrors;
use super::ball::push_ball;
use super::error::{SimError, not_negative, positive, up_to};
use super::random::gauss_vector;
use crate::surfaces::surface::Surface;
use touchup_method::stylus::{Payload, Wrench};
use touchup_probing::arm::{
    Arm, ArmError, ArmGeometry, ArmState, Command, Joints, MOST_JOINTS, Safety, UrGeometry,
};

settings! {
    /// The arm, its mounting, and its imperfections.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ArmParams,
    /// A UR5e, the part on a table before it; an upright probe of 150 mm with a 3 mm ball.
    default {
        /// Lengths.
        geometry: ArmGeometry = UrGeometry::UR5E.into();
        /// The part in the base.
        pose_bo: Isometry3<f64> = Isometry3::translation(-0.4, -0.1, 0.05);
        /// The tip (centre of its ball, z from tip to handle) in the flange.
        pose_ft: Isometry3<f64> = Isometry3::from_parts(
            Vector3::new(0.0, 0.0, 0.15).into(),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        );
        /// True offset of the ball's centre from there, in the axes of the tip, m.
        ball_offset: Vector3<f64> = Vector3::zeros();
        /// Radius of the ball, m.
        radius: f64 = 1.5e-3,
            positive("the ball's radius", *radius, "m"),
            up_to("the offset of the ball", ball_offset.norm(), "m", 0.1, "from zero to 0.1 m");
        /// Stiffness of arm and probe in series, N/m.
        stiffness: f64 = 15e3, positive("the stiffness of the arm", *stiffness, "N/m");
        /// Coefficient of friction.
        friction: f64 = 0.15, up_to("the friction", *friction, "", 10.0, "from zero to ten");
        /// Position noise of the encoders, per axis, root mean square, m.
        // repeatability of a UR5e is 0.03 mm; encoder noise of one reading is less
        pose_noise: f64 = 10e-6, up_to("the pose noise", *pose_noise, "m", 1.0, "from zero to 1 m");
        /// Noise of the force, per axis, root mean square, N.
        force_noise: f64 = 0.15, up_to("the force noise", *force_noise, "N", 1e3, "from zero to 1 kN");
        /// Noise of the torque about the flange's origin, per axis, root mean square, N·m.
        torque_noise: f64 = 5e-3, up_to("the torque noise", *torque_noise, "N·m", 100.0, "from zero to 100 N·m");
        /// Force bias of the sensor before zeroing, N in the flange.
        force_bias: Vector3<f64> = Vector3::new(0.4, -0.3, 1.1), not_negative("the bias of the force", force_bias.norm(), "N");
        /// Torque bias of the sensor before zeroing, N·m in the flange.
        torque_bias: Vector3<f64> = Vector3::new(0.05, -0.08, 0.02),
            not_negative("the bias of the torque", torque_bias.norm(), "N·m");
        /// Payload on the flange: its centre in the flange, gravity in B.
        payload: Payload = WEIGHTLESS, check_payload(payload);
        /// Payload that its controller compensates.
        configured_payload: Payload = WEIGHTLESS, check_payload(configured_payload);
        /// Delay from a command to the motion, s.
        command_latency: f64 = 6e-3, up_to("the latency of commands", *command_latency, "s", 1.0, "from zero to 1 s");
        /// Age of the force at its stamp, s.
        force_latency: f64 = 4e-3, up_to("the latency of the force", *force_latency, "s", 1.0, "from zero to 1 s");
        /// Largest speed of the tip, m/s.
        top_speed: f64 = 0.5, positive("the largest speed", *top_speed, "m/s");
        /// Largest acceleration of the tip, m/s².
        top_acceleration: f64 = 2.0, positive("the largest acceleration", *top_acceleration, "m/s²");
        /// Largest turning speed of the tip, rad/s.
        top_turn_speed: f64 = 0.5, positive("the largest speed of a turn", *top_turn_speed, "rad/s");
        /// Largest speed of a joint, rad/s.
        top_joint_speed: f64 = 3.1, positive("the largest speed of a joint", *top_joint_speed, "rad/s");
        /// Force of the arm's own protective stop, N.
        safety_force: f64 = 150.0, positive("the safety force", *safety_force, "N");
        /// Errors of all of the above.
        errors: ArmErrors = ArmErrors::NONE,
            positive("the true radius of the ball", radius + errors.radius, "m"),
            positive("the true stiffness, as a share of that told", 1.0 + errors.stiffness.min(), ""),
            not_negative("the repeatability", errors.repeatability, "m"),
            not_negative("the play", errors.play, "m");
        /// Seed of the noise.
        seed: u64 = 1;
    }
}

/// No payload on the flange; the base is upright.
pub const WEIGHTLESS: Payload = Payload {
    mass: 0.0,
    p_sc: Vector3::new(0.0, 0.0, 0.0),
    gravity_o: Vector3::new(0.0, 0.0, -9.81),
};

fn check_payload(payload: &Payload) -> Result<(), SimError> {
    up_to(
        "the payload",
        payload.mass,
        "kg",
        100.0,
        "from zero to 100 kg",
    )?;
    not_negative(
        "the distance of the payload's centre",
        payload.p_sc.norm(),
        "m",
    )?;
    not_negative("gravity", payload.gravity_o.norm(), "m/s²")
}

/// An injected fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArmFault {
    /// States stop coming; the arm stops without commands.
    LinkLost,
    /// States come with frozen stamps; the arm is at rest.
    ControllerKilled,
    /// Somebody presses the button.
    OperatorStop,
    /// A safety plane, or too much force.
    ProtectiveStop,
    /// An impact on the probe for three states, N along the shaft.
    ForceSpike(f64),
    /// A fault of the force sensor from then on.
    Sensor(SensorFault),
    /// Bent probe: displacement of its ball, m in the axes of the tip.
    TipBent(Vector3<f64>),
    /// Moved part: rotation by a scaled axis about the origin of O, rad, then a shift, m; in O.
    PartMoved(Vector3<f64>, Vector3<f64>),
}

/// A fault of a force sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// Each reading repeats the last one, except along the live axes (1) of the flange; 0: frozen.
    Frozen(Vector3<f64>),
    /// Frozen in all axes, with added noise of this root mean square, N.
    Dithers(f64),
    /// All readings are zero.
    Zero,
    /// Largest reading along each axis of the flange, N.
    Clipped(f64),
    /// New root mean square of the noise, N.
    Noise(f64),
    /// Drift of the bias along each axis of the flange, N/s.
    Drifts(Vector3<f64>),
    /// Additional delay, s.
    Late(f64),
    /// Factor on the force.
    Gain(f64),
}

/// Time between two states, s.
const PERIOD: f64 = 2e-3;
/// Steps of the motion in one period.
const STEPS: usize = 4;
const STEP: f64 = PERIOD / STEPS as f64;
/// Time without a command until the arm stops, s: the watchdog of a UR.
const WATCHDOG: f64 = 0.1;
/// Deceleration of safety stops, m/s².
const HARD_STOP: f64 = 8.0;
/// Length of a spike in states.
const SPIKE: u32 = 3;
/// Settling time of a force, in multiples of its latencies.
const CALM: f64 = 4.0;
/// Minimum distance of a new approach from the last contact, with a new error of place, m: a second
/// search begins nearer.
const NEW_APPROACH: f64 = 1e-3;
/// Maximum remaining length of a completed line, m.
const ARRIVED: f64 = 1e-9;

/// A simulated arm. Its base is B, the surface is in O.
pub struct SimArm<'a> {
    surface: &'a dyn Surface,
    params: ArmParams,
    rng: Pcg64,
    torque_rng: Pcg64,
    approach_rng: Pcg64,
    time: f64,
    /// true pose of the part in the base
    pose_bo: Isometry3<f64>,
    /// true geometry
    geometry: ArmGeometry,
    /// from the tip by the nominal kinematics to the true tip, in B
    kinematic: Isometry3<f64>,
    /// error of place of this approach, in B, m
    approach: Vector3<f64>,
    /// place of the tip held by the drives, in B, m
    driven: Vector3<f64>,
    /// centre of the ball at the last contact of this approach, in O
    touched: Option<Point3<f64>>,
    /// pose of the tip without bending, in B
    nominal: Isometry3<f64>,
    velocity: Vector3<f64>,
    joints: Joints,
    /// place of the ball, in O
    ball: Point3<f64>,
    /// forces of the part on the tip, N in B; newest last
    forces: VecDeque<Vector3<f64>>,
    /// N in the flange
    tare: Vector3<f64>,
    safety: Safety,
    waiting: VecDeque<(f64, Command)>,
    doing: Command,
    heard_at: f64,
    faults: Vec<(f64, ArmFault)>,
    /// faults after a number of contacts that the ball has left
    faults_of_contacts: Vec<(usize, ArmFault)>,
    contacts: usize,
    /// start of a sensor fault, s, the fault, and the last reading before it, N in the flange
    sensor: Option<(f64, SensorFault, Vector3<f64>)>,
    last_force: Vector3<f64>,
    spike: u32,
    spike_force: f64,
    is_lost: bool,
    is_killed: bool,
    last_stamp_ns: i64,
    /// time of the last motion, s
    moved_at: f64,
    /// largest force ever, N
    peak_force: f64,
}

/// Refuses a ball inside the part.
fn check_free(surface: &dyn Surface, ball: &Point3<f64>, radius_m: f64) -> Result<(), SimError> {
    let clearance_m = surface.signed_distance(ball);
    if clearance_m < radius_m {
        return Err(SimError::StartsInside {
            clearance_m,
            radius_m,
        });
    }
    Ok(())
}

impl<'a> SimArm<'a> {
    /// An arm at rest with its tip at a pose in B.
    ///
    /// # Errors
    /// [`SimError::BadParameter`]; [`SimError::OutOfReach`]; [`SimError::StartsInside`] for a ball
    /// inside the part.
    pub fn new(
        surface: &'a dyn Surface,
        params: ArmParams,
        start_bt: &Isometry3<f64>,
    ) -> Result<Self, SimError> {
        params.check()?;
        let flange = start_bt * params.pose_ft.inverse();
        let joints = params
            .geometry
            .most_dexterous(&flange)
            .ok_or(SimError::OutOfReach)?;
        let pose_bo = params.pose_bo * params.errors.displacement();
        let geometry = params.errors.geometry(&params.geometry);
        let offset = params.ball_offset + params.errors.tip;
        let kinematic = kinematic_error(&geometry, &params, &joints);
        let ball = pose_bo.inverse_transform_point(&(kinematic * start_bt * Point3::from(offset)));
        check_free(surface, &ball, params.radius + params.errors.radius)?;
        let mut approach_rng = Pcg64::seed_from_u64(params.seed ^ 0x2d31_6f0a_94c5_e87b);
        let late = (params.force_latency / STEP).round() as usize;
        Ok(Self {
            surface,
            rng: Pcg64::seed_from_u64(params.seed ^ 0x0a5f_3d21_77c8_9be4),
            torque_rng: Pcg64::seed_from_u64(params.seed ^ 0x51d3_90b7_2e64_fa08),
            approach: gauss_vector(&mut approach_rng) * params.errors.repeatability,
            approach_rng,
            driven: start_bt.translation.vector,
            touched: None,
            pose_bo,
            geometry,
            kinematic,
            params,
            time: 0.0,
            nominal: *start_bt,
            velocity: Vector3::zeros(),
            joints,
            ball,
            forces: VecDeque::from(vec![Vector3::zeros(); late + 1]),
            tare: Vector3::zeros(),
            safety: Safety::Normal,
            waiting: VecDeque::new(),
            doing: Command::Stop {
                deceleration: HARD_STOP,
            },
            heard_at: 0.0,
            faults: Vec::new(),
            faults_of_contacts: Vec::new(),
            contacts: 0,
            sensor: None,
            last_force: Vector3::zeros(),
            spike: 0,
            spike_force: 0.0,
            is_lost: false,
            is_killed: false,
            last_stamp_ns: 0,
            moved_at: 0.0,
            peak_force: 0.0,
        })
    }

    /// Schedules a fault at a time of the arm, s.
    pub fn fail_at(&mut self, time: f64, fault: ArmFault) {
        self.faults.push((time, fault));
    }

    /// Schedules a fault after the ball has left a number of contacts for new ones.
    pub fn fail_after_contacts(&mut self, contacts: usize, fault: ArmFault) {
        self.faults_of_contacts.push((contacts, fault));
    }

    /// Its own time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Its current joints.
    pub fn joints(&self) -> Joints {
        self.joints
    }

    /// Start of its present rest, s.
    pub fn at_rest_since(&self) -> f64 {
        self.moved_at
    }

    /// The largest force of the part on it up to now, N.
    pub fn peak_force(&self) -> f64 {
        self.peak_force
    }

    /// True place of the ball, m in O.
    pub fn ball(&self) -> Point3<f64> {
        self.ball
    }

    /// Lets time pass without requests.
    pub fn advance(&mut self, seconds: f64) {
        (0..(seconds / PERIOD).round() as usize).for_each(|_| self.tick());
    }

    /// Turns the joints to others within one period, like the drives of a foreign controller,
    /// whatever the command; returns the final state, without the noise of its place.
    ///
    /// - `joints`: near the current ones.
    ///
    /// # Panics
    /// For another number of joints than the arm has.
    pub fn drive(&mut self, joints: &Joints) -> ArmState {
        self.begin_faults();
        let begin = self.nominal;
        let end = self.params.geometry.flange(joints) * self.params.pose_ft;
        self.velocity = (end.translation.vector - begin.translation.vector) / PERIOD;
        let turn = (end.rotation * begin.rotation.inverse()).scaled_axis();
        for step in 1..=STEPS {
            self.time += STEP;
            if *joints != self.joints {
                self.moved_at = self.time;
            }
            let share = step as f64 / STEPS as f64;
            self.nominal.translation.vector += self.velocity * STEP;
            self.nominal.rotation = UnitQuaternion::new(turn * share) * begin.rotation;
            self.bend();
        }
        self.spike = self.spike.saturating_sub(1);
        (self.nominal, self.joints) = (end, *joints);
        self.kinematic = kinematic_error(&self.geometry, &self.params, &self.joints);
        let raw_wrench_f = self.read();
        self.state(self.nominal, raw_wrench_f)
    }

    fn tick(&mut self) {
        self.begin_faults();
        (0..STEPS).for_each(|_| self.step());
        self.spike = self.spike.saturating_sub(1);
    }

    fn begin_faults(&mut self) {
        let now = self.time;
        let due: Vec<_> = self
            .faults
            .extract_if(.., |(at, _)| *at <= now)
            .map(|(_, fault)| fault)
            .collect();
        let (left, touched) = (self.contacts, self.touched.is_some());
        let is_due = |(contacts, _): &mut (usize, ArmFault)| !touched && *contacts <= left;
        let of_contacts = self.faults_of_contacts.extract_if(.., is_due);
        let of_contacts: Vec<_> = of_contacts.map(|(_, fault)| fault).collect();
        for fault in due.into_iter().chain(of_contacts) {
            match fault {
                ArmFault::LinkLost => self.is_lost = true,
                ArmFault::ControllerKilled => (self.is_killed, self.safety) = (true, Safety::Fault),
                ArmFault::OperatorStop => self.safety = Safety::OperatorStop,
                ArmFault::ProtectiveStop => self.safety = Safety::ProtectiveStop,
                ArmFault::ForceSpike(force) => (self.spike, self.spike_force) = (SPIKE, force),
                ArmFault::TipBent(by) => self.params.errors.tip += by,
                ArmFault::PartMoved(turn, by) => {
                    self.pose_bo *= Isometry3::new(by, turn);
                }
                ArmFault::Sensor(SensorFault::Noise(noise)) => self.params.force_noise = noise,
                ArmFault::Sensor(SensorFault::Late(by)) => {
                    let oldest = self.contact_force();
                    (0..(by / STEP) as usize).for_each(|_| self.forces.push_front(oldest));
                }
                ArmFault::Sensor(fault) => self.sensor = Some((now, fault, self.last_force)),
            }
        }
    }

    /// The reading of the sensor for a force, N in the flange.
    fn sensed(&mut self, force: Vector3<f64>) -> Vector3<f64> {
        let Some((since, fault, held)) = self.sensor else {
            self.last_force = force;
            return force;
        };
        match fault {
            SensorFault::Frozen(alive) => held + (force - held).component_mul(&alive),
            SensorFault::Dithers(noise) => held + gauss_vector(&mut self.rng) * noise,
            SensorFault::Zero => Vector3::zeros(),
            SensorFault::Clipped(most) => force.map(|along| along.clamp(-most, most)),
            SensorFault::Drifts(rate) => force + rate * (self.time - since),
            SensorFault::Gain(gain) => force * gain,
            SensorFault::Noise(_) | SensorFault::Late(_) => force,
        }
    }

    fn step(&mut self) {
        self.time += STEP;
        while let Some(&(at, command)) = self.waiting.front()
            && at <= self.time
        {
            self.waiting.pop_front();
            self.doing = command;
        }
        if self.time - self.heard_at > WATCHDOG || self.safety != Safety::Normal {
            self.doing = Command::Stop {
                deceleration: HARD_STOP,
            };
            self.waiting.clear();
        }
        let (wanted, acceleration) = self.wanted();
        let is_stop = matches!(self.doing, Command::Stop { .. });
        let most = acceleration.min(if is_stop {
            HARD_STOP
        } else {
            self.params.top_acceleration
        });
        self.velocity += (wanted.cap_magnitude(self.params.top_speed) - self.velocity)
            .cap_magnitude(most * STEP);
        if self.velocity.norm() > 0.0 {
            self.moved_at = self.time;
        }
        self.nominal.translation.vector += self.velocity * STEP;
        self.bend();
    }

    /// - `silent`: time since the last message over the link, s.
    fn check_link(&self, silent: f64) -> Result<(), ArmError> {
        if self.is_lost {
            Err(ArmError::Lost {
                silent_ms: (silent * 1e3) as u64,
            })
        } else {
            Ok(())
        }
    }

    /// Velocity that the current command requests, and its acceleration.
    fn wanted(&mut self) -> (Vector3<f64>, f64) {
        match self.doing {
            Command::Stop { deceleration } => (Vector3::zeros(), deceleration),
            Command::Velocity {
                linear,
                acceleration,
            } => (linear, acceleration),
            Command::Line {
                to,
                speed,
                acceleration,
            } => {
                let left = to.translation.vector - self.nominal.translation.vector;
                let distance = left.norm();
                if distance < ARRIVED {
                    self.turn(&to.rotation, 1.0);
                    return (Vector3::zeros(), acceleration);
                }
                // as fast as possible, but able to stop there in whole steps
                let brake = acceleration.min(self.params.top_acceleration);
                let fast = (2.0 * brake * distance).sqrt() - brake * STEP;
                let least = (distance / (2.0 * STEP)).min(brake * STEP);
                let next = speed.min(fast.max(least)).min(distance / STEP);
                let share = (self.velocity.norm() * STEP / distance).min(1.0);
                self.turn(&to.rotation, share);
                (left * (next / distance), acceleration)
            }
            Command::Press {
                axis,
                force,
                feed,
                speed,
            } => {
                let force_along = -self.contact_force().dot(&axis);
                let late = self.params.command_latency + self.params.force_latency + PERIOD;
                let gain = 1.0 / (CALM * self.params.stiffness * late);
                (
                    axis * ((force - force_along) * gain).clamp(-speed, speed) + feed,
                    self.params.top_acceleration,
                )
            }
        }
    }

    /// Turns by a share of the remaining angle, within the largest turning speed.
    fn turn(&mut self, to: &UnitQuaternion<f64>, share: f64) {
        let left = self.nominal.rotation.rotation_to(to);
        let most = self.params.top_turn_speed * STEP;
        let by = (share * left.angle()).min(most);
        if let Some(axis) = left.axis().filter(|_| by > 0.0) {
            self.nominal.rotation =
                UnitQuaternion::from_axis_angle(&axis, by) * self.nominal.rotation;
            self.moved_at = self.time;
        }
    }

    /// Place of the ball without bending, in O: by the true kinematics, the play and the error of
    /// this approach.
    fn unbent(&mut self) -> Point3<f64> {
        let ArmParams {
            ball_offset,
            errors,
            ..
        } = &self.params;
        let ahead = self.nominal.translation.vector - self.driven;
        self.driven += ahead - ahead.cap_magnitude(errors.play);
        let tip = Isometry3::from_parts(self.driven.into(), self.nominal.rotation);
        let place = self.kinematic * tip * Point3::from(ball_offset + errors.tip);
        let is_away = |touched: Point3<f64>| (self.ball - touched).norm() > NEW_APPROACH;
        if self.touched.is_some_and(is_away) {
            self.touched = None;
            self.contacts += 1;
            self.approach = gauss_vector(&mut self.approach_rng) * errors.repeatability;
        }
        self.pose_bo
            .inverse_transform_point(&(place + self.approach))
    }

    /// Moves the ball as far as the part lets it; the ball pulls back.
    fn bend(&mut self) {
        let (nominal, pose_bo) = (self.unbent(), self.pose_bo);
        let radius = self.params.radius + self.params.errors.radius;
        let (rest, contacts) = push_ball(self.surface, &self.ball, &nominal, radius);
        let normal = contacts
            .iter()
            .map(|c| c.normal * c.held_back)
            .sum::<Vector3<f64>>();
        let mut next = rest;
        if let Some(out) = normal.try_normalize(0.0) {
            // friction holds the ball at its old place as far as it can
            let behind = self.ball - rest;
            let across = behind - out * behind.dot(&out);
            let most = self.params.friction * normal.norm();
            let kept = across.cap_magnitude(most);
            next = push_ball(self.surface, &rest, &(rest + kept), radius).0;
        }
        self.ball = next;
        let force = if contacts.is_empty() {
            Vector3::zeros()
        } else {
            self.touched = Some(next);
            let share = self.params.errors.stiffness.add_scalar(1.0) * self.params.stiffness;
            (pose_bo.rotation * (next - nominal)).component_mul(&share)
        };
        self.peak_force = self.peak_force.max(force.norm());
        if force.norm() > self.params.safety_force && self.safety == Safety::Normal {
            self.safety = Safety::ProtectiveStop;
        }
        self.forces.push_back(force);
        self.forces.pop_front();
    }

    /// Force of the part as the sensor currently has it, N in B.
    fn contact_force(&self) -> Vector3<f64> {
        self.forces.front().copied().unwrap_or_default()
    }

    /// Orientation of the flange in B.
    fn flange(&self) -> UnitQuaternion<f64> {
        self.nominal.rotation * self.params.pose_ft.rotation.inverse()
    }

    /// Reading of the sensor: contact, weight, bias and noise, in the axes of the flange about its
    /// origin.
    fn read(&mut self) -> Wrench {
        let noise = gauss_vector(&mut self.rng) * self.params.force_noise;
        let shaft = self.nominal.rotation * Vector3::z();
        let spike = if self.spike > 0 {
            shaft * self.spike_force
        } else {
            Vector3::zeros()
        };
        let torque_noise = gauss_vector(&mut self.torque_rng) * self.params.torque_noise;
        let ArmParams {
            payload,
            pose_ft,
            ball_offset,
            errors,
            force_bias,
            torque_bias,
            ..
        } = &self.params;
        let r_bf = self.flange();
        let (weight, contact) = (
            payload.weight_o(&r_bf),
            r_bf.inverse() * (self.contact_force() + spike),
        );
        let ball = pose_ft * Point3::from(ball_offset + errors.tip);
        let mut wrench = Wrench {
            force: contact + r_bf.inverse() * (weight.force + noise) + force_bias,
            torque: ball.coords.cross(&contact)
                + r_bf.inverse() * weight.torque
                + torque_bias
                + torque_noise,
        };
        wrench.force = self.sensed(wrench.force);
        wrench
    }

    /// A force less the controller's weight compensation, N in the flange.
    fn unweighed(&self, raw: &Wrench) -> Vector3<f64> {
        let r_bf = self.flange();
        raw.force - r_bf.inverse() * self.params.configured_payload.weight_o(&r_bf).force
    }

    fn state(&mut self, pose_bt: Isometry3<f64>, raw_wrench_f: Wrench) -> ArmState {
        let force = self.flange() * (self.unweighed(&raw_wrench_f) - self.tare);
        let stamp_ns = if self.is_killed {
            self.last_stamp_ns
        } else {
            (self.time * 1e9).round() as i64
        };
        self.last_stamp_ns = stamp_ns;
        let wrench_b = Wrench {
            force,
            torque: Vector3::zeros(),
        };
        ArmState {
            stamp_ns,
            pose_bt,
            wrench_b,
            raw_wrench_f,
            joints: self.joints,
            safety: self.safety,
        }
    }

    /// Joints for the pose; the arm stops if there are none, or if they would have to jump.
    fn follow_joints(&mut self) {
        let flange = self.nominal * self.params.pose_ft.inverse();
        let most = self.params.top_joint_speed * PERIOD;
        let is_near = |next: &Joints| {
            next.iter()
                .zip(self.joints.iter())
                .all(|(next, now)| (next - now).abs() <= most)
        };
        match self
            .params
            .geometry
            .nearest(&flange, &self.joints)
            .ok()
            .filter(is_near)
        {
            Some(next) => self.joints = next,
            None if self.safety == Safety::Normal => self.safety = Safety::ProtectiveStop,
            None => {}
        }
        self.kinematic = kinematic_error(&self.geometry, &self.params, &self.joints);
    }
}

/// From the flange by the nominal kinematics to the true flange, in B.
fn kinematic_error(geometry: &ArmGeometry, params: &ArmParams, joints: &Joints) -> Isometry3<f64> {
    let offsets = params.errors.joints;
    if *geometry == params.geometry && offsets == [0.0; MOST_JOINTS] {
        return Isometry3::identity();
    }
    let truly = joints.mapped(|joint, angle| angle + offsets[joint]);
    geometry.flange(&truly) * params.geometry.flange(joints).inverse()
}

impl Arm for SimArm<'_> {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        self.tick();
        self.check_link(PERIOD)?;
        self.follow_joints();
        let raw_wrench_f = self.read();
        let noise = gauss_vector(&mut self.rng) * self.params.pose_noise;
        let mut pose_bt = self.nominal;
        pose_bt.translation.vector += noise;
        Ok(self.state(pose_bt, raw_wrench_f))
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.check_link(0.0)?;
        self.heard_at = self.time;
        if self.safety != Safety::Normal && !matches!(command, Command::Stop { .. }) {
            return Err(ArmError::Stopped {
                safety: self.safety,
            });
        }
        self.waiting
            .push_back((self.time + self.params.command_latency, *command));
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        self.check_link(0.0)?;
        self.heard_at = self.time;
        // a controller averages its readings for a while
        let readings = 64;
        let mut sum = Vector3::zeros();
        for _ in 0..readings {
            self.heard_at = self.time;
            self.tick();
            let raw = self.read();
            sum += self.unweighed(&raw);
        }
        self.tare = sum / f64::from(readings);
        Ok(())
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        if self.is_killed {
            return Err(ArmError::Stopped {
                safety: self.safety,
            });
        }
        self.safety = Safety::Normal;
        self.is_lost = false;
        self.heard_at = self.time;
        Ok(())
    }

    fn period(&self) -> f64 {
        PERIOD
    }
}
