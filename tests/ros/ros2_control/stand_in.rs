//! Broadcasters, joint_trajectory_controller and drives of an arm, in the test's process and time:
//! messages in, messages out.
//!
//! The controller follows its documentation and the described behaviour of its set point: a
//! trajectory without places and with stamp zero begins at its arrival, from the set point of the
//! period before, its velocity is linear between points, and the last point holds. It refuses one
//! that does not end at rest. An old one ([`World::repeats`]) begins from the set point as if it
//! were that of now, and so repeats it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use touchup::clock::{Clock, ManualClock};
use touchup::probing::arm::{ArmState, Joints};
use touchup::ros::messages::{Header, JointState, JointTrajectory, Time, WrenchStamped};
use touchup::ros::port::{ArmPort, ArmReport};
use touchup::sim::SimArm;

/// Of the controller manager, ns: 500 Hz.
const PERIOD_NS: i64 = 2_000_000;
/// Time goes on in such steps, ns.
const STEP_NS: i64 = 1_000_000;
/// On the network, ns.
const ON_THE_WAY_NS: i64 = 1_000_000;
/// Delay of the drives behind the set point, periods.
const DRIVES_LATE: usize = 2;
/// Of the encoders, rad, and of the velocities that come of them, rad/s.
const NOISE: [f64; 2] = [5e-6, 1e-3];
/// Its clock is not that of the machine.
const EPOCH_NS: i64 = 1_700_000_000_000_000_000;

/// Faults of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    JointsSilent,
    WrenchSilent,
    /// All states come later from now on.
    Late(Duration),
    /// The clock of the controller jumps ahead or back, ms.
    StampsJump(i64),
    /// The same states come again and again; the drives hold.
    Frozen,
    /// It is inactive: it finishes its motion, and takes no more orders.
    Inactive,
    /// All of it ends; the drives hold their place.
    Dead,
    /// It goes on in spite of any order.
    RunsOn,
    /// Addition to the force along z of the flange, N.
    Force(f64),
}

struct Active {
    begin_ns: i64,
    from: (Joints, Joints),
    /// ns after its beginning, rad/s
    points: Vec<(i64, Joints)>,
}

pub struct World {
    pub arm: SimArm<'static>,
    hand: ManualClock,
    rng: Pcg64,
    pub now_ns: i64,
    names: Vec<String>,
    pose_fs: Isometry3<f64>,
    set_point: (Joints, Joints),
    active: Option<Active>,
    driven: VecDeque<Joints>,
    orders: VecDeque<(i64, JointTrajectory)>,
    reports: VecDeque<(i64, ArmReport)>,
    faults: Vec<(i64, Fault)>,
    pub has: Vec<Fault>,
    late_ns: i64,
    jump_ns: i64,
    last: Option<ArmState>,
    /// whether a new trajectory repeats the last set point
    pub repeats: bool,
    pub refused: usize,
    pub taken: usize,
    /// when the tip was last faster than 1 mm/s, ns
    pub moved_ns: i64,
    pub places: Vec<(i64, Point3<f64>)>,
}

pub struct StandIn(Arc<Mutex<World>>);

pub type SharedWorld = Arc<Mutex<World>>;

/// A controller of an arm at rest, its port, and its clock.
pub fn start(
    arm: SimArm<'static>,
    names: Vec<String>,
    pose_fs: Isometry3<f64>,
) -> (SharedWorld, StandIn, Clock) {
    let (clock, hand) = Clock::manual();
    let joints = arm.joints();
    let still = joints.mapped(|_, _| 0.0);
    let world = World {
        arm,
        hand,
        rng: Pcg64::seed_from_u64(3),
        now_ns: 0,
        names,
        pose_fs,
        set_point: (joints, still),
        active: None,
        driven: VecDeque::from(vec![joints; DRIVES_LATE]),
        orders: VecDeque::new(),
        reports: VecDeque::new(),
        faults: Vec::new(),
        has: Vec::new(),
        late_ns: 0,
        jump_ns: 0,
        last: None,
        repeats: false,
        refused: 0,
        taken: 0,
        moved_ns: 0,
        places: Vec::new(),
    };
    let world = Arc::new(Mutex::new(world));
    (world.clone(), StandIn(world), clock)
}

impl World {
    pub fn fail_in(&mut self, ms: i64, fault: Fault) {
        self.faults.push((self.now_ns + ms * 1_000_000, fault));
    }

    pub fn has(&self, fault: Fault) -> bool {
        self.has.contains(&fault)
    }

    pub fn repair(&mut self) {
        self.has.clear();
        self.late_ns = 0;
    }

    /// Time goes on without a client.
    pub fn advance(&mut self, ms: i64) {
        (0..ms).for_each(|_| self.step());
    }

    fn step(&mut self) {
        self.now_ns += STEP_NS;
        self.hand.advance(Duration::from_nanos(STEP_NS as u64));
        let now_ns = self.now_ns;
        let due: Vec<_> = self
            .faults
            .extract_if(.., |(at_ns, _)| *at_ns <= now_ns)
            .map(|(_, fault)| fault)
            .collect();
        for fault in due {
            match fault {
                Fault::Late(by) => self.late_ns = by.as_nanos() as i64,
                Fault::StampsJump(ms) => self.jump_ns += ms * 1_000_000,
                fault => self.has.push(fault),
            }
        }
        if now_ns % PERIOD_NS == 0 {
            self.period();
        }
    }

    fn period(&mut self) {
        let now_ns = self.now_ns;
        while let Some(order) = due(&mut self.orders, now_ns) {
            if !(self.has(Fault::Inactive) || self.has(Fault::Dead) || self.has(Fault::RunsOn)) {
                self.take(&order);
            }
        }
        let holds = self.has(Fault::Dead) || self.has(Fault::Frozen);
        if self.has(Fault::RunsOn) {
            let rates = self.set_point.1;
            self.set_point.0 = self
                .set_point
                .0
                .mapped(|joint, angle| angle + rates[joint] * 2e-3);
        } else if holds {
            self.active = None;
            self.set_point.1 = self.set_point.1.mapped(|_, _| 0.0);
        } else if let Some(active) = &self.active {
            self.set_point = active.at(now_ns);
        }
        self.driven.push_back(self.set_point.0);
        let before = (self.arm.joints(), self.arm.ball());
        let next = self.driven.pop_front().unwrap();
        let state = self.arm.drive(&next);
        if (self.arm.ball() - before.1).norm() > 1e-3 * 2e-3 {
            self.moved_ns = now_ns;
        }
        self.places.push((now_ns, self.arm.ball()));
        if self.has(Fault::Dead) {
            return;
        }
        let state = match self.last {
            Some(last) if self.has(Fault::Frozen) => last,
            _ => ArmState {
                stamp_ns: EPOCH_NS + now_ns + self.jump_ns,
                ..state
            },
        };
        self.last = Some(state);
        let due_ns = now_ns + ON_THE_WAY_NS + self.late_ns;
        if !self.has(Fault::JointsSilent) {
            let report = ArmReport::Joints(self.joint_state(&state, &before.0));
            self.reports.push_back((due_ns, report));
        }
        if !self.has(Fault::WrenchSilent) {
            let report = ArmReport::Wrench(self.wrench(&state));
            self.reports.push_back((due_ns, report));
        }
    }

    /// In the reverse order of the arm's own, with a gripper among them.
    fn joint_state(&mut self, state: &ArmState, before: &Joints) -> JointState {
        let [place, rate] = NOISE.map(|noise| Normal::new(0.0, noise).unwrap());
        let mut message = JointState {
            header: header(state.stamp_ns, ""),
            ..JointState::default()
        };
        for joint in (0..self.names.len()).rev() {
            message.name.push(self.names[joint].clone());
            message
                .position
                .push(state.joints[joint] + place.sample(&mut self.rng));
            message
                .velocity
                .push((state.joints[joint] - before[joint]) / 2e-3 + rate.sample(&mut self.rng));
            if joint == 3 {
                message.name.push("finger".to_owned());
                message.position.push(0.02);
                message.velocity.push(f64::NAN);
            }
        }
        message
    }

    fn wrench(&self, state: &ArmState) -> WrenchStamped {
        let added = self
            .has
            .iter()
            .map(|fault| {
                if let Fault::Force(force) = fault {
                    *force
                } else {
                    0.0
                }
            })
            .sum::<f64>();
        let force_f = state.raw_wrench_f.force + Vector3::z() * added;
        let torque_f = state.raw_wrench_f.torque - self.pose_fs.translation.vector.cross(&force_f);
        let turned = |v: Vector3<f64>| self.pose_fs.rotation.inverse() * v;
        let (force, torque) = (turned(force_f), turned(torque_f));
        let mut message = WrenchStamped {
            header: header(state.stamp_ns, "ft_sensor"),
            ..WrenchStamped::default()
        };
        (
            message.wrench.force.x,
            message.wrench.force.y,
            message.wrench.force.z,
        ) = (force.x, force.y, force.z);
        (
            message.wrench.torque.x,
            message.wrench.torque.y,
            message.wrench.torque.z,
        ) = (torque.x, torque.y, torque.z);
        message
    }

    fn take(&mut self, order: &JointTrajectory) {
        let place = |name: &String| order.joint_names.iter().position(|other| other == name);
        let places: Option<Vec<_>> = self.names.iter().map(place).collect();
        let times: Vec<_> = order
            .points
            .iter()
            .map(|point| length_ns(&point.time_from_start))
            .collect();
        let ends_at_rest = order
            .points
            .last()
            .is_some_and(|point| point.velocities.iter().all(|velocity| *velocity == 0.0));
        let is_whole = order.points.iter().all(|point| {
            point.velocities.len() == self.names.len()
                && point.positions.is_empty()
                && point.velocities.iter().all(|velocity| velocity.is_finite())
        });
        let begins_now = order.header.stamp.sec == 0 && order.header.stamp.nanosec == 0;
        let rises = times.first().is_some_and(|first| *first > 0)
            && times.windows(2).all(|pair| pair[0] < pair[1]);
        let Some(places) = places.filter(|_| ends_at_rest && is_whole && begins_now && rises)
        else {
            self.refused += 1;
            return;
        };
        self.taken += 1;
        let velocity = |at: usize| {
            self.set_point
                .1
                .mapped(|joint, _| order.points[at].velocities[places[joint]])
        };
        let before_ns = if self.repeats { 0 } else { PERIOD_NS };
        let points = times
            .iter()
            .enumerate()
            .map(|(at, time_ns)| (before_ns + time_ns, velocity(at)))
            .collect();
        self.active = Some(Active {
            begin_ns: self.now_ns - before_ns,
            from: self.set_point,
            points,
        });
    }
}

impl Active {
    /// Place and velocity of the set point.
    fn at(&self, now_ns: i64) -> (Joints, Joints) {
        let after_ns = now_ns - self.begin_ns;
        let (mut angles, mut rates, mut from_ns) = (self.from.0, self.from.1, 0);
        for (to_ns, end) in &self.points {
            let share = (after_ns.min(*to_ns) - from_ns) as f64 / (to_ns - from_ns) as f64;
            let seconds = (after_ns.min(*to_ns) - from_ns) as f64 * 1e-9;
            let reached = rates.mapped(|joint, rate| rate + (end[joint] - rate) * share);
            angles = angles
                .mapped(|joint, angle| angle + 0.5 * (rates[joint] + reached[joint]) * seconds);
            rates = reached;
            if after_ns <= *to_ns {
                break;
            }
            from_ns = *to_ns;
        }
        (angles, rates)
    }
}

impl StandIn {
    fn world(&self) -> MutexGuard<'_, World> {
        self.0.lock().unwrap()
    }
}

impl ArmPort for StandIn {
    fn next_report(&mut self, timeout: Duration) -> Option<ArmReport> {
        let mut world = self.world();
        let end_ns = world.now_ns + timeout.as_nanos() as i64;
        loop {
            let now_ns = world.now_ns;
            if let Some(report) = due(&mut world.reports, now_ns) {
                return Some(report);
            }
            if now_ns >= end_ns {
                return None;
            }
            world.step();
        }
    }

    fn publish_trajectory(&mut self, order: JointTrajectory) -> bool {
        let mut world = self.world();
        let due_ns = world.now_ns + ON_THE_WAY_NS;
        world.orders.push_back((due_ns, order));
        true
    }

    fn order_listeners(&mut self) -> Option<usize> {
        Some(usize::from(!self.world().has(Fault::Inactive)))
    }
}

/// The first of a queue, if it is due.
fn due<T>(queue: &mut VecDeque<(i64, T)>, now_ns: i64) -> Option<T> {
    queue.front().filter(|(due_ns, _)| *due_ns <= now_ns)?;
    queue.pop_front().map(|(_, item)| item)
}

fn header(stamp_ns: i64, frame: &str) -> Header {
    let stamp = Time {
        sec: (stamp_ns / 1_000_000_000) as i32,
        nanosec: (stamp_ns % 1_000_000_000) as u32,
    };
    Header {
        stamp,
        frame_id: frame.to_owned(),
    }
}

fn length_ns(length: &touchup::ros::messages::Duration) -> i64 {
    i64::from(length.sec) * 1_000_000_000 + i64::from(length.nanosec)
}

/// A sensor that sits turned and shifted in the flange.
pub fn mounted() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.7);
    Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.03).into(), turn)
}
