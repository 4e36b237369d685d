//! From what really was to messages: noise, bias, clocks, and what goes wrong on the wire.

use std::f64::consts::PI;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;

use super::ball::BallContact;
use super::error::{not_negative, require, up_to};
use super::random::{Drift, gauss, gauss_vector, uniform};
use touchup_core::stylus::{Message, StampedPose, StampedWrench, Wrench};

/// What really was, at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Time since the start, s.
    pub t: f64,
    /// True centre of the ball and true orientation of the stylus.
    pub pose_ot: Isometry3<f64>,
    /// Force of the part on the stylus, N, in O.
    pub force_o: Vector3<f64>,
    /// Where the ball really touched; empty while it is free.
    pub contacts: Vec<BallContact>,
}

settings! {
    /// Errors of sensors and transport. All noise is root mean square.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorParams,
    /// Optical tracking and a small six-axis cell on a busy network.
    default {
        /// Per axis, m.
        pose_noise: f64 = 0.05e-3, up_to("the pose noise", *pose_noise, "m", 1.0, "from zero to 1 m");
        /// Per axis, rad.
        orientation_noise: f64 = 0.1f64.to_radians(),
            up_to("the orientation noise", *orientation_noise, "rad", PI, "from zero to half a turn");
        /// Per axis, N.
        force_noise: f64 = 0.05, up_to("the force noise", *force_noise, "N", 1e3, "from zero to 1 kN");
        /// Per axis, N·m.
        torque_noise: f64 = 1e-3, up_to("the torque noise", *torque_noise, "N m", 1e3, "from zero to 1 kN m");
        /// Slowly drifting, per axis, N.
        force_bias: f64 = 0.05, up_to("the force bias", *force_bias, "N", 1e3, "from zero to 1 kN");
        /// How much later the wrench's clock reads than the pose's, s.
        wrench_clock: f64 = 1.8e-3;
        /// Of the pose's stamps, s; those of the wrench have half of it.
        jitter: f64 = 0.1e-3, not_negative("the jitter", *jitter, "s");
        /// Share of messages that never arrive.
        lost: f64 = 0.005, up_to("the share of lost messages", *lost, "", 1.0, "from zero to one");
        /// Share of messages that arrive 5 to 15 ms late, after later ones.
        late: f64 = 0.006, up_to("the share of late messages", *late, "", 1.0, "from zero to one");
        /// Times per second that a topic falls silent for 5 to 60 ms.
        gap_rate: f64 = 0.1,
            not_negative("the rate of gaps", *gap_rate, "1/s"),
            require(wrench_clock.abs() <= LARGEST_CLOCK, "the wrench clock's offset", *wrench_clock, "s", "within one second");
        /// Stamp of the first moment on the pose's clock, ns.
        start_ns: i64 = 1_700_000_000_000_000_000;
    }
}

impl SensorParams {
    /// No noise, no bias, no clock error, every message in order.
    pub fn ideal() -> Self {
        Self {
            pose_noise: 0.0,
            orientation_noise: 0.0,
            force_noise: 0.0,
            torque_noise: 0.0,
            force_bias: 0.0,
            wrench_clock: 0.0,
            jitter: 0.0,
            lost: 0.0,
            late: 0.0,
            gap_rate: 0.0,
            ..Self::default()
        }
    }
}

/// Largest clock offset that makes sense, s.
const LARGEST_CLOCK: f64 = 1.0;
/// Time between two moments, s: the wrench's period.
pub(super) const TICK: f64 = 1e-3;
/// Ticks between two poses.
const POSE_EVERY: usize = 2;
/// Jitter is cut off at this share of the period, so that stamps keep their order.
const JITTER_LIMIT: f64 = 0.45;
/// Time on the wire: at least, and on average beyond that, s.
const LATENCY: [f64; 2] = [0.3e-3, 0.4e-3];
/// Extra time of late messages, s.
const LATE: [f64; 2] = [5e-3, 15e-3];
/// Length of gaps, s.
const GAP: [f64; 2] = [5e-3, 60e-3];
/// Period of the bias' drift, s.
const DRIFT_PERIOD: f64 = 40.0;

pub(super) struct Sensor<'a> {
    params: &'a SensorParams,
    stiffness: f64,
    bias: [Drift; 3],
    rng: Pcg64,
}

/// Which messages of one topic arrive, and when.
struct Wire {
    period: f64,
    jitter: f64,
    clock: f64,
    silent_until: f64,
}

impl<'a> Sensor<'a> {
    pub(super) fn new(params: &'a SensorParams, stiffness: f64, seed: u64) -> Self {
        // a stream of its own, so that the hand moves the same whatever the sensors do
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x5e75_0412_93ab_77c1);
        let bias = [(); 3].map(|()| Drift::new(DRIFT_PERIOD, &mut rng));
        Self { params, stiffness, bias, rng }
    }

    /// All messages, in order of arrival.
    pub(super) fn record(mut self, moments: &[Moment]) -> Vec<Message> {
        let p = self.params;
        let mut poses = Wire { period: TICK * POSE_EVERY as f64, jitter: p.jitter, clock: 0.0, silent_until: f64::MIN };
        let mut wrenches = Wire { period: TICK, jitter: p.jitter / 2.0, clock: p.wrench_clock, silent_until: f64::MIN };
        let mut arrivals: Vec<(f64, Message)> = Vec::with_capacity(moments.len() * 2);
        for (tick, moment) in moments.iter().enumerate() {
            if tick % POSE_EVERY == 0 {
                let pose_ot = self.pose(moment);
                let sent = self.send(&mut poses, moment.t);
                arrivals.extend(sent.map(|(at, stamp_ns)| (at, Message::Pose(StampedPose { stamp_ns, pose_ot }))));
            }
            let wrench = self.wrench(moment);
            let sent = self.send(&mut wrenches, moment.t);
            arrivals.extend(sent.map(|(at, stamp_ns)| (at, Message::Wrench(StampedWrench { stamp_ns, wrench }))));
        }
        arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
        arrivals.into_iter().map(|(_, message)| message).collect()
    }

    fn shake(&mut self, rms: f64) -> Vector3<f64> {
        gauss_vector(&mut self.rng) * rms
    }

    /// The pose as reported: of a stylus that does not bend.
    fn pose(&mut self, moment: &Moment) -> Isometry3<f64> {
        let bent = moment.pose_ot.translation.vector - moment.force_o / self.stiffness;
        let turn = UnitQuaternion::from_scaled_axis(self.shake(self.params.orientation_noise));
        let centre = bent + self.shake(self.params.pose_noise);
        Isometry3::from_parts(centre.into(), moment.pose_ot.rotation * turn)
    }

    /// The wrench as reported: in T, about the ball's centre, through which every contact force goes.
    fn wrench(&mut self, moment: &Moment) -> Wrench {
        let bias = Vector3::from_fn(|i, _| self.bias[i].at(moment.t)) * self.params.force_bias;
        let force = moment.pose_ot.rotation.inverse() * moment.force_o + bias + self.shake(self.params.force_noise);
        Wrench { force, torque: self.shake(self.params.torque_noise) }
    }

    /// When a message arrives (s) and what its stamp says (ns); `None` when it is lost.
    fn send(&mut self, wire: &mut Wire, t: f64) -> Option<(f64, i64)> {
        let p = self.params;
        let limit = JITTER_LIMIT * wire.period;
        let jitter = (gauss(&mut self.rng) * wire.jitter).clamp(-limit, limit);
        let wait: f64 = Exp1.sample(&mut self.rng);
        let [lost, late, gap] = [(); 3].map(|()| uniform(&mut self.rng, [0.0, 1.0]));
        let (extra, silence) = (uniform(&mut self.rng, LATE), uniform(&mut self.rng, GAP));
        if gap < p.gap_rate * wire.period {
            wire.silent_until = t + silence;
        }
        if lost < p.lost || t < wire.silent_until {
            return None;
        }
        // an ideal wire keeps the order
        let ideal = p.late == 0.0;
        let delay = LATENCY[0] + if ideal { 0.0 } else { LATENCY[1] * wait } + if late < p.late { extra } else { 0.0 };
        let seconds = t + wire.clock + jitter;
        Some((t + delay, p.start_ns + (seconds * 1e9).round() as i64))
    }
}
