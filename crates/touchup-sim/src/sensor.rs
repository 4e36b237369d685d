//! From true moments to messages: noise, bias, clocks, and transport errors.

use std::f64::consts::PI;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;

use super::ball::BallContact;
use super::bending::TipBending;
use super::error::{SimError, not_negative, require, up_to};
use super::random::{Drift, gauss, gauss_vector, uniform};
use touchup_method::stylus::{Message, StampedPose, StampedWrench, Wrench};

/// The true state at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueState {
    /// Time since the start, s.
    pub t: f64,
    /// True centre of the ball and true orientation of the stylus.
    pub pose_ot: Isometry3<f64>,
    /// Force of the part on the stylus, N, in O.
    pub force_o: Vector3<f64>,
    /// True contacts of the ball; empty while it is free.
    pub contacts: Vec<BallContact>,
}

settings! {
    /// Errors of sensors and transport. All noise is root mean square.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorParams,
    /// Optical tracking and a small six-axis cell on a busy network.
    default {
        /// Position noise per axis, m.
        pose_noise: f64 = 0.05e-3, up_to("the pose noise", *pose_noise, "m", 1.0, "from zero to 1 m");
        /// Orientation noise per axis, rad.
        orientation_noise: f64 = 0.1f64.to_radians(),
            up_to("the orientation noise", *orientation_noise, "rad", PI, "from zero to half a turn");
        /// Force noise per axis, N.
        force_noise: f64 = 0.05, up_to("the force noise", *force_noise, "N", 1e3, "from zero to 1 kN");
        /// Torque noise per axis, N·m.
        torque_noise: f64 = 1e-3, up_to("the torque noise", *torque_noise, "N m", 1e3, "from zero to 1 kN m");
        /// Slowly drifting force bias per axis, N.
        force_bias: f64 = 0.05, up_to("the force bias", *force_bias, "N", 1e3, "from zero to 1 kN");
        /// Reading of the sensor in free motion, in T, N, without the drift of the bias.
        tare: Vector3<f64> = Vector3::zeros(),
            up_to("the size of the tare", tare.norm(), "N", 1e3, "from zero to 1 kN");
        /// Smallest difference between two readings of the force, per axis, N; zero: none.
        force_step: f64 = 0.0, up_to("the step of the force", *force_step, "N", 1e3, "from zero to 1 kN");
        /// Half the width of the sensor's play, per axis, N: a reading follows the force only
        /// beyond it.
        force_play: f64 = 0.0, up_to("the play of the force", *force_play, "N", 1e3, "from zero to 1 kN");
        /// Slow wander of the pose beside its noise, per axis, m.
        pose_wander: f64 = 0.0, up_to("the wander of the pose", *pose_wander, "m", 1.0, "from zero to 1 m");
        /// Rate of poses, 1/s.
        pose_rate: f64 = 500.0, check_rate("the rate of the poses", *pose_rate);
        /// Rate of wrenches, 1/s.
        wrench_rate: f64 = 1000.0, check_rate("the rate of the wrenches", *wrench_rate);
        /// Lead of the wrench's clock over the pose's at the start, s.
        wrench_clock: f64 = 1.8e-3;
        /// Relative excess rate of the wrench's clock over the pose's.
        clock_rate: f64 = 0.0, up_to("the size of the clock's rate", clock_rate.abs(), "", 1e-2, "within 1 %");
        /// Maps O to the frame of the recorded poses.
        scan_to_space: Isometry3<f64> = Isometry3::identity(),
            not_negative("the size of the part's place", scan_to_space.translation.vector.norm(), "m");
        /// Origin of T from the origin of the recorded pose, in its axes, m.
        tip_offset: Vector3<f64> = Vector3::zeros(),
            up_to("the size of the tip's offset", tip_offset.norm(), "m", 10.0, "from zero to 10 m");
        /// Jitter of the pose's stamps, s; half of it for the wrench.
        jitter: f64 = 0.1e-3, not_negative("the jitter", *jitter, "s");
        /// Share of messages that never arrive.
        lost: f64 = 0.005, up_to("the share of lost messages", *lost, "", 1.0, "from zero to one");
        /// Share of messages that arrive 5 to 15 ms late, after later ones.
        late: f64 = 0.006, up_to("the share of late messages", *late, "", 1.0, "from zero to one");
        /// Rate of silences of a topic, 1/s, of 5 to 60 ms each.
        gap_rate: f64 = 0.1,
            not_negative("the rate of gaps", *gap_rate, "1/s"),
            require(wrench_clock.abs() <= LARGEST_CLOCK, "the wrench clock's offset", *wrench_clock, "s", "within one second");
        /// Stamp of the first moment on the pose's clock, ns.
        start_ns: i64 = 1_700_000_000_000_000_000;
    }
}

fn check_rate(name: &'static str, rate: f64) -> Result<(), SimError> {
    require(
        (1.0..=1e4).contains(&rate),
        name,
        rate,
        "1/s",
        "from 1 to 10000",
    )
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

/// Largest sensible clock offset, s.
const LARGEST_CLOCK: f64 = 1.0;
/// Time between two moments, s.
pub(super) const TICK: f64 = 1e-3;
/// The same, ns.
const TICK_NS: u64 = 1_000_000;
/// Maximum jitter as a share of the period: stamps keep their order.
const JITTER_LIMIT: f64 = 0.45;
/// Time on the wire: minimum, and mean beyond that, s.
const LATENCY: [f64; 2] = [0.3e-3, 0.4e-3];
/// Extra time of late messages, s.
const LATE: [f64; 2] = [5e-3, 15e-3];
/// Length of gaps, s.
const GAP: [f64; 2] = [5e-3, 60e-3];
/// Period of the bias' drift, s.
const DRIFT_PERIOD: f64 = 40.0;
/// Period of the pose's wander, s.
const WANDER_PERIOD: f64 = 8.0;

pub(super) struct Sensor<'a> {
    params: &'a SensorParams,
    tip: TipBending,
    bias: [Drift; 3],
    wander: [Drift; 3],
    /// Force within its play, N, in T.
    played: Vector3<f64>,
    rng: Pcg64,
}

/// Transport of one topic: loss, and time of arrival.
#[derive(Clone, Copy)]
struct TopicTransport {
    period: f64,
    jitter: f64,
    clock: f64,
    clock_rate: f64,
    silent_until: f64,
}

impl<'a> Sensor<'a> {
    pub(super) fn new(params: &'a SensorParams, tip: TipBending, seed: u64) -> Self {
        // a stream of its own: the sensors do not change the hand's motion
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x5e75_0412_93ab_77c1);
        let bias = [(); 3].map(|()| Drift::new(DRIFT_PERIOD, &mut rng));
        let mut own = Pcg64::seed_from_u64(seed ^ 0x77a9_de11_4c20_5b3d);
        let wander = [(); 3].map(|()| Drift::new(WANDER_PERIOD, &mut own));
        Self {
            params,
            tip,
            bias,
            wander,
            played: Vector3::zeros(),
            rng,
        }
    }

    /// All messages, in order of arrival.
    pub(super) fn record(mut self, moments: &[TrueState]) -> Vec<Message> {
        let p = self.params;
        let silent = TopicTransport {
            period: 0.0,
            jitter: 0.0,
            clock: 0.0,
            clock_rate: 0.0,
            silent_until: f64::MIN,
        };
        let mut poses = TopicTransport {
            period: p.pose_rate.recip(),
            jitter: p.jitter,
            ..silent
        };
        let mut wrenches = TopicTransport {
            period: p.wrench_rate.recip(),
            jitter: p.jitter / 2.0,
            clock: p.wrench_clock,
            clock_rate: p.clock_rate,
            ..silent
        };
        let mut arrivals: Vec<(f64, Message)> = Vec::with_capacity(moments.len() * 2);
        let (mut pose_count, mut wrench_count) = (0, 0);
        loop {
            let [pose_ns, wrench_ns] = [(pose_count, p.pose_rate), (wrench_count, p.wrench_rate)]
                .map(|(n, rate)| nanoseconds(n, rate));
            let Some(moment) = moment_at(moments, pose_ns.min(wrench_ns)) else {
                break;
            };
            if pose_ns <= wrench_ns {
                pose_count += 1;
                let pose = self.pose(&moment);
                let sent = self.send(&mut poses, moment.t);
                arrivals.extend(sent.map(|(at, stamp_ns)| {
                    (
                        at,
                        Message::Pose(StampedPose {
                            stamp_ns,
                            pose_ot: pose,
                        }),
                    )
                }));
            } else {
                wrench_count += 1;
                let wrench = self.wrench(&moment);
                let sent = self.send(&mut wrenches, moment.t);
                arrivals.extend(sent.map(|(at, stamp_ns)| {
                    (at, Message::Wrench(StampedWrench { stamp_ns, wrench }))
                }));
            }
        }
        arrivals.sort_by(|a, b| a.0.total_cmp(&b.0));
        arrivals.into_iter().map(|(_, message)| message).collect()
    }

    fn shake(&mut self, rms: f64) -> Vector3<f64> {
        gauss_vector(&mut self.rng) * rms
    }

    /// The reported pose: of a stylus without bending, in the frame of the recorded poses.
    fn pose(&mut self, moment: &TrueState) -> Isometry3<f64> {
        let p = self.params;
        let bend = self.tip.bend(&moment.pose_ot.rotation, &moment.force_o);
        let bent = moment.pose_ot.translation.vector - bend;
        let turn = UnitQuaternion::from_scaled_axis(self.shake(p.orientation_noise));
        let wander = Vector3::from_fn(|i, _| self.wander[i].at(moment.t)) * p.pose_wander;
        let shake = self.shake(p.pose_noise) + wander;
        let pose_wt = p.scan_to_space * Isometry3::from_parts(bent.into(), moment.pose_ot.rotation);
        let origin = pose_wt.translation.vector - pose_wt.rotation * p.tip_offset;
        Isometry3::from_parts((origin + shake).into(), pose_wt.rotation * turn)
    }

    /// The reported wrench: in T, about the ball's centre, through which every contact force goes.
    fn wrench(&mut self, moment: &TrueState) -> Wrench {
        let p = self.params;
        let bias = Vector3::from_fn(|i, _| self.bias[i].at(moment.t)) * p.force_bias + p.tare;
        let felt = moment.pose_ot.rotation.inverse() * moment.force_o;
        self.played = felt.zip_map(&self.played, |f, last| {
            last.clamp(f - p.force_play, f + p.force_play)
        });
        let force = self.played + bias + self.shake(p.force_noise);
        let read = |f: f64| {
            if p.force_step > 0.0 {
                (f / p.force_step).round() * p.force_step
            } else {
                f
            }
        };
        Wrench {
            force: force.map(read),
            torque: self.shake(p.torque_noise),
        }
    }

    /// Time of arrival (s) and stamp (ns) of a message; `None` for a lost one.
    fn send(&mut self, wire: &mut TopicTransport, t: f64) -> Option<(f64, i64)> {
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
        let delay = LATENCY[0]
            + if ideal { 0.0 } else { LATENCY[1] * wait }
            + if late < p.late { extra } else { 0.0 };
        let seconds = t * (1.0 + wire.clock_rate) + wire.clock + jitter;
        Some((t + delay, p.start_ns + (seconds * 1e9).round() as i64))
    }
}

/// Time of the reading of this number, ns.
fn nanoseconds(count: u64, rate: f64) -> u64 {
    (count as f64 * 1e9 / rate).round() as u64
}

/// State at a time after the start: all but the contacts is interpolated between two moments.
/// `None` past the last.
fn moment_at(moments: &[TrueState], at_ns: u64) -> Option<TrueState> {
    let before = moments.get((at_ns / TICK_NS) as usize)?;
    let share = (at_ns % TICK_NS) as f64 / TICK_NS as f64;
    if share == 0.0 {
        return Some(before.clone());
    }
    let after = moments.get((at_ns / TICK_NS) as usize + 1)?;
    let pose_ot = Isometry3::from_parts(
        before
            .pose_ot
            .translation
            .vector
            .lerp(&after.pose_ot.translation.vector, share)
            .into(),
        before
            .pose_ot
            .rotation
            .nlerp(&after.pose_ot.rotation, share),
    );
    let force_o = before.force_o.lerp(&after.force_o, share);
    Some(TrueState {
        t: before.t + share * TICK,
        pose_ot,
        force_o,
        contacts: before.contacts.clone(),
    })
}
