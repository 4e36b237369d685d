//! The arm itself: it follows a velocity with a limited acceleration, bends against the part, and
//! measures the contact force.
//!
//! The encoders give the place of the tip without bending, x_c; the ball is at x, outside the part,
//! and the part pushes with K (x − x_c). Across the normal friction holds the ball back. In force
//! mode the velocity along one axis comes from the force: v = (F − f) / (4 K τ), which settles
//! without ringing for a delay τ.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use touchup_method::stylus::Payload;
use touchup_probing::arm::Joints;
use touchup_sim::{ArmParams, Surface, push_ball};

/// Time between two states, s.
pub const PERIOD: f64 = 2e-3;
/// Steps of the motion in it.
const STEPS: usize = 4;
const STEP: f64 = PERIOD / STEPS as f64;
/// Of a turning flange, rad/s².
const TURN_ACCELERATION: f64 = 10.0;
/// With which it stops when it has to, m/s².
pub const HARD_STOP: f64 = 8.0;
/// Speed of a rising part, m/s: one that jumped over the ball would hold it inside.
const RISING: f64 = 30e-3;
/// States that a spike lasts.
const SPIKE: u32 = 3;

/// Commanded motion of the tip: a velocity, m/s and rad/s in B, and its largest rate of change,
/// m/s².
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub linear: Vector3<f64>,
    pub angular: Vector3<f64>,
    pub acceleration: f64,
}

impl Motion {
    pub fn rest(acceleration: f64) -> Self {
        Self {
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
            acceleration,
        }
    }
}

/// Pressing along one axis of B.
#[derive(Clone, Copy, Debug)]
pub struct Force {
    pub axis: Vector3<f64>,
    /// N
    pub force: f64,
    /// m/s
    pub speed: f64,
}

pub struct Body<'a> {
    surface: &'a (dyn Surface + Sync),
    params: ArmParams,
    rng: Pcg64,
    pub time: f64,
    /// of the tip if nothing bent, in B
    nominal: Isometry3<f64>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
    pub joints: Joints,
    /// in O
    ball: Point3<f64>,
    /// of the part on the tip, N in B; newest last
    forces: VecDeque<Vector3<f64>>,
    /// N in the flange
    tare: Vector3<f64>,
    /// payload that the controller subtracts
    pub configured_payload: Payload,
    waiting: VecDeque<(f64, Motion, Option<Force>)>,
    motion: Motion,
    force: Option<Force>,
    /// height of the part in O, m; and the height that it moves to
    raised: f64,
    raised_to: f64,
    /// speed slider of the panel, a factor of each velocity of a program, 0 to 1
    pub slider: f64,
    /// of the sensor along z of the flange, N/s
    pub drift: f64,
    drifted: f64,
    /// of the force per axis beside that of the parameters, root mean square, N
    pub more_noise: f64,
    spike: u32,
    spike_force: f64,
    /// TCP set by the client, in the flange
    pub tcp: Isometry3<f64>,
}

impl<'a> Body<'a> {
    /// At rest, upright, with its ball at a place of O.
    pub fn new(
        surface: &'a (dyn Surface + Sync),
        params: ArmParams,
        start: Point3<f64>,
    ) -> anyhow::Result<Self> {
        let place = params.pose_bo * start;
        let nominal = Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity());
        let joints = params
            .geometry
            .most_dexterous(&(nominal * params.pose_ft.inverse()));
        let late = (params.force_latency / STEP).round() as usize;
        Ok(Self {
            surface,
            rng: Pcg64::seed_from_u64(params.seed),
            time: 0.0,
            nominal,
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
            joints: joints.ok_or_else(|| anyhow::anyhow!("the arm does not reach its start"))?,
            ball: start,
            forces: VecDeque::from(vec![Vector3::zeros(); late + 1]),
            tare: Vector3::zeros(),
            configured_payload: params.configured_payload,
            waiting: VecDeque::new(),
            motion: Motion::rest(HARD_STOP),
            force: None,
            raised: 0.0,
            raised_to: 0.0,
            slider: 1.0,
            drift: 0.0,
            drifted: 0.0,
            more_noise: 0.0,
            spike: 0,
            spike_force: 0.0,
            tcp: Isometry3::identity(),
            params,
        })
    }

    /// A command of the program; the arm follows some milliseconds later.
    pub fn follow(&mut self, motion: Motion, force: Option<Force>) {
        self.waiting
            .push_back((self.time + self.params.command_latency, motion, force));
    }

    /// A command that needs no program, followed at once.
    pub fn brake(&mut self) {
        self.waiting.clear();
        (self.motion, self.force) = (Motion::rest(HARD_STOP), None);
    }

    /// Hits the probe along its shaft, N.
    pub fn hit(&mut self, force: f64) {
        (self.spike, self.spike_force) = (SPIKE, force);
    }

    /// Ends the drift of the sensor and removes its offset.
    pub fn settle(&mut self) {
        (self.drift, self.drifted) = (0.0, 0.0);
    }

    /// The part rises by this, m.
    pub fn raise(&mut self, by: f64) {
        self.raised_to += by;
    }

    pub fn zero_sensor(&mut self) {
        // a mean of many readings: the noise of one does not stay
        self.tare = self.unweighed();
    }

    /// Force without the configured payload's weight, N in the flange: contact, bias, and the
    /// weight beyond the configured payload.
    fn unweighed(&self) -> Vector3<f64> {
        let r_bf = self.flange().rotation;
        let weight = |payload: &Payload| payload.weight_o(&r_bf).force;
        let load = weight(&self.params.payload) - weight(&self.configured_payload);
        r_bf.inverse() * (self.contact_force() + load)
            + self.params.force_bias
            + Vector3::z() * self.drifted
    }

    /// Force that the controller attributes to the part, N in B.
    fn compensated(&self) -> Vector3<f64> {
        self.flange().rotation * (self.unweighed() - self.tare)
    }

    /// One period.
    pub fn tick(&mut self) {
        (0..STEPS).for_each(|_| self.step());
        self.spike = self.spike.saturating_sub(1);
        let flange = self.flange();
        if let Ok(next) = self.params.geometry.nearest(&flange, &self.joints) {
            self.joints = next;
        }
    }

    fn step(&mut self) {
        self.time += STEP;
        self.drifted += self.drift * STEP;
        self.raised += (self.raised_to - self.raised).clamp(-RISING * STEP, RISING * STEP);
        while let Some(&(at, motion, force)) = self.waiting.front()
            && at <= self.time
        {
            self.waiting.pop_front();
            (self.motion, self.force) = (motion, force);
        }
        let (mut wanted, mut acceleration) =
            (self.motion.linear * self.slider, self.motion.acceleration);
        if let Some(Force { axis, force, speed }) = self.force {
            let late = self.params.command_latency + self.params.force_latency + PERIOD;
            let gain = 1.0 / (4.0 * self.params.stiffness * late);
            let pressed = force + self.compensated().dot(&axis);
            wanted += axis * ((pressed * gain).clamp(-speed, speed) - wanted.dot(&axis));
            acceleration = self.params.top_acceleration;
        }
        self.linear += (wanted.cap_magnitude(self.params.top_speed) - self.linear)
            .cap_magnitude(acceleration * STEP);
        self.angular += (self.motion.angular * self.slider - self.angular)
            .cap_magnitude(TURN_ACCELERATION * STEP);
        // the velocity is that of the configured TCP
        let mut tool = self.flange() * self.tcp;
        let turn = UnitQuaternion::from_scaled_axis(self.angular * STEP);
        tool = Isometry3::from_parts(
            Translation3::from(tool.translation.vector + self.linear * STEP),
            turn * tool.rotation,
        );
        self.nominal = tool * self.tcp.inverse() * self.params.pose_ft;
        self.bend();
    }

    fn bend(&mut self) {
        let params = &self.params;
        // in the part's own axes, which rise with it
        let up = Vector3::z() * self.raised;
        let nominal = params
            .pose_bo
            .inverse_transform_point(&Point3::from(self.nominal.translation.vector))
            - up;
        self.ball -= up;
        let (rest, contacts) = push_ball(self.surface, &self.ball, &nominal, params.radius);
        let normal = contacts
            .iter()
            .map(|c| c.normal * c.held_back)
            .sum::<Vector3<f64>>();
        let mut next = rest;
        if let Some(out) = normal.try_normalize(0.0) {
            let behind = self.ball - rest;
            let kept =
                (behind - out * behind.dot(&out)).cap_magnitude(params.friction * normal.norm());
            next = push_ball(self.surface, &rest, &(rest + kept), params.radius).0;
        }
        self.ball = next + up;
        let force = if contacts.is_empty() {
            Vector3::zeros()
        } else {
            (next - nominal) * params.stiffness
        };
        self.forces.push_back(params.pose_bo.rotation * force);
        self.forces.pop_front();
    }

    fn contact_force(&self) -> Vector3<f64> {
        self.forces.front().copied().unwrap_or_default()
    }

    /// Force of the part on the tip, N, without errors of the sensor.
    pub fn true_force(&self) -> f64 {
        self.forces.back().map_or(0.0, Vector3::norm)
    }

    /// Of the tip in B, m.
    pub fn place(&self) -> Vector3<f64> {
        self.nominal.translation.vector
    }

    /// Velocity of the tool, m/s and rad/s in B.
    pub fn velocity(&self) -> [Vector3<f64>; 2] {
        [self.linear, self.angular]
    }

    pub fn is_over_its_force(&self) -> bool {
        self.true_force() > self.params.safety_force
    }

    fn flange(&self) -> Isometry3<f64> {
        self.nominal * self.params.pose_ft.inverse()
    }

    /// Of the tool as the encoders have it, in B.
    pub fn read_pose(&mut self) -> Isometry3<f64> {
        let mut pose = self.flange() * self.tcp;
        pose.translation.vector += self.noise(self.params.pose_noise);
        pose
    }

    /// `actual_TCP_force`, N in B; and `ft_raw_wrench`, N and N m in the flange about its origin.
    pub fn read_wrenches(&mut self) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let shaft = self.nominal.rotation * Vector3::z();
        let spike = if self.spike > 0 {
            shaft * self.spike_force
        } else {
            Vector3::zeros()
        };
        let (noise, torque_noise) = (
            self.noise(self.params.force_noise + self.more_noise),
            self.noise(self.params.torque_noise),
        );
        let ArmParams {
            payload,
            pose_ft,
            force_bias,
            torque_bias,
            ..
        } = &self.params;
        let r_bf = self.flange().rotation;
        let (weight, contact) = (
            payload.weight_o(&r_bf),
            r_bf.inverse() * (self.contact_force() + spike),
        );
        let force = contact + r_bf.inverse() * (weight.force + noise) + force_bias;
        let lever = pose_ft.translation.vector;
        let torque =
            lever.cross(&contact) + r_bf.inverse() * weight.torque + torque_bias + torque_noise;
        (self.compensated() + spike + noise, [force, torque])
    }

    fn noise(&mut self, deviation: f64) -> Vector3<f64> {
        match Normal::new(0.0, deviation) {
            Ok(normal) => Vector3::from_fn(|_, _| normal.sample(&mut self.rng)),
            Err(_) => Vector3::zeros(),
        }
    }
}
