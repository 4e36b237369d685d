//! Comparison of the arm's velocity with its orders.
//!
//! A program that hangs while its motion thread lives does not read its orders: every call returns,
//! the watchdog is fed, and the arm goes on. Only its velocity tells.
//!
//! A model without mass or delay follows the orders: towards the target of the newest order with
//! the acceleration that the order allows. An arm is late, by a time of its own, but passes through
//! the same velocities; so its present velocity was ordered within the last [`WINDOW`], or is
//! slower than that. While it presses, the velocity along the axis is free, up to the speed of
//! force mode.
//!
//! A creep is slower than the noise of a velocity, so at rest the position counts: it may not leave
//! its value after [`WINDOW`] of ordered rest. Missing orders mean rest, for the client then
//! brakes.

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::{Isometry3, Vector3};

use super::interface::ArmError;

/// Maximum delay of an arm.
const WINDOW: Duration = Duration::from_millis(80);
/// Duration of disobedience that is a fault: a contact that springs back is over sooner.
const LASTING: Duration = Duration::from_millis(20);
/// Allowed excess of the speed, as a share of the ordered one.
const SHARE: f64 = 0.2;
/// Additional allowed excess of the speed, m/s: its noise, and a tip that springs.
const NOISE: f64 = 5e-3;
/// Allowed excess of the turn rate, rad/s.
const TURN_NOISE: f64 = 50e-3;
/// Time within which an ordered turn still counts: the controller brakes turns with its own
/// deceleration.
const TURN_WINDOW: Duration = Duration::from_millis(300);
/// Allowed speed of force mode, over the set one.
const PRESS: f64 = 1.5;
/// Deceleration of an arm without orders or contact to its client, m/s²: its driver brakes so.
const REST: f64 = 2.0;
/// Validity of an order without a successor: then the client brakes.
const FRESH: Duration = Duration::from_millis(25);
/// Maximum distance of a resting tip from its position, m: ten times the noise of a position.
const CREEP: f64 = 0.1e-3;
/// Maximum turn of a resting tip, rad.
const CREEP_TURN: f64 = 2e-3;

/// Order to an arm, as it shows in the velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OrderedMotion {
    /// Moves with a velocity.
    Move {
        /// velocity, m/s and rad/s in B
        twist: [f64; 6],
        /// acceleration, m/s²
        acceleration: f64,
    },
    /// Presses along an axis and moves across it with a velocity.
    Press {
        /// unit vector in B
        axis: Vector3<f64>,
        /// largest speed along the axis, m/s
        speed: f64,
        /// velocity across the axis, m/s in B
        feed: Vector3<f64>,
        /// acceleration, m/s²
        acceleration: f64,
    },
    /// Brakes to rest.
    Stop {
        /// deceleration, m/s²
        deceleration: f64,
    },
}

/// Velocity of an order to the arm.
#[derive(Clone, Copy, Debug)]
struct CommandedVelocity {
    at: Duration,
    /// velocity, m/s in B
    linear: Vector3<f64>,
    /// turn rate, rad/s
    turn: f64,
    /// axis in B, and the speed of force mode along it, m/s
    press: Option<(Vector3<f64>, f64)>,
    /// whether the order is rest, even at a velocity above zero
    rests: bool,
}

/// Recent orders to an arm, and its disobedience.
#[derive(Debug)]
pub struct Obedience {
    /// velocities without mass and delay, the newest last
    ordered: VecDeque<CommandedVelocity>,
    target: Vector3<f64>,
    /// acceleration of the newest order, m/s²
    acceleration: f64,
    /// time of the newest order
    ordered_at: Duration,
    since: Option<Duration>,
    /// pose of ordered rest, in B
    rests_at: Option<Isometry3<f64>>,
}

impl Obedience {
    /// For an arm at rest.
    ///
    /// - `now`: time since some moment, as all times here.
    pub fn new(now: Duration) -> Self {
        let rest = CommandedVelocity {
            at: now,
            linear: Vector3::zeros(),
            turn: 0.0,
            press: None,
            rests: true,
        };
        Self {
            ordered: VecDeque::from([rest]),
            target: Vector3::zeros(),
            acceleration: REST,
            ordered_at: now,
            since: None,
            rests_at: None,
        }
    }

    /// Records an order.
    pub fn order(&mut self, what: &OrderedMotion, now: Duration) {
        self.follow(now);
        let (target, turn, acceleration, press) = match *what {
            OrderedMotion::Move {
                twist: [x, y, z, a, b, c],
                acceleration,
            } => (
                Vector3::new(x, y, z),
                Vector3::new(a, b, c).norm(),
                acceleration,
                None,
            ),
            OrderedMotion::Press {
                axis,
                speed,
                feed,
                acceleration,
            } => (feed, 0.0, acceleration, Some((axis, speed))),
            OrderedMotion::Stop { deceleration } => (Vector3::zeros(), 0.0, deceleration, None),
        };
        (self.target, self.acceleration, self.ordered_at) = (target, acceleration, now);
        let linear = self.newest().linear;
        let rests = target == Vector3::zeros() && turn == 0.0 && press.is_none();
        self.push(CommandedVelocity {
            at: now,
            linear,
            turn,
            press,
            rests,
        });
    }

    fn newest(&self) -> CommandedVelocity {
        // never empty
        self.ordered[self.ordered.len() - 1]
    }

    /// Continues the ordered velocity until now, or until its order is stale.
    fn follow(&mut self, now: Duration) {
        let stale = self.ordered_at + FRESH;
        let goes = self.target != Vector3::zeros()
            || self.newest().turn > 0.0
            || self.newest().press.is_some();
        if goes && now > stale {
            self.go_on(stale);
            (self.target, self.acceleration) = (Vector3::zeros(), REST);
            let linear = self.newest().linear;
            self.push(CommandedVelocity {
                at: stale,
                linear,
                turn: 0.0,
                press: None,
                rests: true,
            });
        }
        self.go_on(now);
    }

    fn go_on(&mut self, now: Duration) {
        let last = self.newest();
        let room = self.acceleration * now.saturating_sub(last.at).as_secs_f64();
        let linear = last.linear + (self.target - last.linear).cap_magnitude(room);
        self.push(CommandedVelocity {
            at: now,
            linear,
            ..last
        });
    }

    fn push(&mut self, ordered: CommandedVelocity) {
        self.ordered.push_back(ordered);
        // one older entry stays: it was in force when the window began
        while self
            .ordered
            .get(1)
            .is_some_and(|next| ordered.at.saturating_sub(next.at) > TURN_WINDOW)
        {
            self.ordered.pop_front();
        }
    }

    /// Takes a state of the arm; returns the fault of a disobedient one.
    ///
    /// - `pose`: of the tip in B; `velocity`: m/s and rad/s in B.
    pub fn see(
        &mut self,
        pose: &Isometry3<f64>,
        velocity: &[f64; 6],
        now: Duration,
    ) -> Option<ArmError> {
        self.follow(now);
        let [x, y, z, a, b, c] = *velocity;
        let (linear, turn) = (Vector3::new(x, y, z), Vector3::new(a, b, c).norm());
        let recent = |window| {
            let begin = self
                .ordered
                .iter()
                .rposition(|one| now.saturating_sub(one.at) > window);
            self.ordered.iter().skip(begin.unwrap_or(0))
        };
        let is_ordered =
            recent(WINDOW).any(|one| one.beyond(&linear) <= NOISE + SHARE * one.linear.norm());
        let most_turn = recent(TURN_WINDOW).map(|one| one.turn).fold(0.0, f64::max);
        let rests = most_turn == 0.0
            && recent(WINDOW).all(|one| one.rests && one.linear == Vector3::zeros());
        let ordered_mm_per_s = self.newest().linear.norm() * 1e3;
        let fault = || ArmError::Disobeys {
            mm_per_s: linear.norm() * 1e3,
            ordered_mm_per_s,
            deg_per_s: turn.to_degrees(),
        };
        if self.creeps(rests, pose) {
            return Some(fault());
        }
        if is_ordered && turn <= most_turn * (1.0 + SHARE) + TURN_NOISE {
            self.since = None;
            return None;
        }
        let since = *self.since.get_or_insert(now);
        (now.saturating_sub(since) > LASTING).then(fault)
    }

    /// Whether an arm has left its place against an order to rest.
    fn creeps(&mut self, rests: bool, pose: &Isometry3<f64>) -> bool {
        if !rests {
            self.rests_at = None;
            return false;
        }
        let rests_at = self.rests_at.get_or_insert(*pose);
        let way = (pose.translation.vector - rests_at.translation.vector).norm();
        way > CREEP || pose.rotation.angle_to(&rests_at.rotation) > CREEP_TURN
    }
}

impl CommandedVelocity {
    /// Distance of a velocity from the range between rest and the ordered velocity, m/s.
    fn beyond(&self, velocity: &Vector3<f64>) -> f64 {
        let mut off = velocity - self.linear;
        let mut own = *velocity;
        if let Some((axis, speed)) = &self.press {
            let along = velocity.dot(axis);
            let free = along.clamp(-PRESS * speed, PRESS * speed);
            (off, own) = (off - axis * free, own - axis * free);
        }
        let squared = self.linear.norm_squared();
        if squared > 0.0 {
            let share = (own.dot(&self.linear) / squared).clamp(0.0, 1.0);
            off = own - self.linear * share;
        }
        off.norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn along(speed: f64) -> [f64; 6] {
        [speed, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn go(speed: f64) -> OrderedMotion {
        OrderedMotion::Move {
            twist: along(speed),
            acceleration: 0.5,
        }
    }

    const STOP: OrderedMotion = OrderedMotion::Stop { deceleration: 0.5 };

    /// One order and one state per 2 ms; returns the time of the first fault, ms. The position does
    /// not follow the velocity.
    fn first_fault(
        ms: u32,
        order: impl Fn(u32) -> OrderedMotion,
        velocity: impl Fn(u32) -> [f64; 6],
    ) -> Option<u32> {
        first_fault_of(ms, |at| Some(order(at)), |at| ([0.0; 6], velocity(at)))
    }

    /// As `first_fault`, with positions, and orders that may be missing.
    fn first_fault_of(
        ms: u32,
        order: impl Fn(u32) -> Option<OrderedMotion>,
        state: impl Fn(u32) -> ([f64; 6], [f64; 6]),
    ) -> Option<u32> {
        let begun = Duration::from_secs(3);
        let mut obedience = Obedience::new(begun);
        (0..ms).step_by(2).find(|&at| {
            let now = begun + at * MS;
            let (pose, velocity) = state(at);
            let [x, y, z, a, b, c] = pose;
            let pose = Isometry3::new(Vector3::new(x, y, z), Vector3::new(a, b, c));
            let fault = obedience.see(&pose, &velocity, now);
            if let Some(order) = order(at) {
                obedience.order(&order, now);
            }
            fault.is_some()
        })
    }

    /// Speed, m/s, of an arm that reaches 50 mm/s with 0.5 m/s² from 0 ms on and brakes from 200 ms
    /// on, late by some time.
    fn late(at: u32, by: u32) -> f64 {
        let at = f64::from(at.saturating_sub(by)) * 1e-3;
        (0.5 * at).min(0.05).min((0.05 - 0.5 * (at - 0.2)).max(0.0))
    }

    #[test]
    fn an_arm_that_is_late_by_up_to_80_ms_obeys() {
        let order = |at| if at < 200 { go(0.05) } else { STOP };
        for by in [0, 10, 40, 80] {
            assert_eq!(
                first_fault(800, order, |at| along(late(at, by))),
                None,
                "late by {by} ms"
            );
        }
        // braking sooner and harder than ordered, as when the client brakes by itself
        assert_eq!(
            first_fault(800, order, |at| along(if at < 150 {
                late(at, 10)
            } else {
                0.0
            })),
            None
        );
    }

    /// From 50 to 35 mm/s, the allowed deviation, takes 30 ms; then come the 80 ms of delay, and
    /// the 20 ms.
    #[test]
    fn an_arm_that_goes_on_after_a_stop_is_seen_within_140_ms() {
        let order = |at| if at < 200 { go(0.05) } else { STOP };
        let seen = first_fault(800, order, |at| along(late(at.min(200), 0))).unwrap();
        assert!((300..=340).contains(&seen), "{seen} ms");
    }

    #[test]
    fn an_arm_that_moves_without_an_order_is_seen_after_20_ms() {
        assert_eq!(
            first_fault(400, |_| STOP, |at| along(if at < 200 { 0.0 } else { 8e-3 })),
            Some(222)
        );
        assert_eq!(
            first_fault(400, |_| STOP, |_| along(4e-3)),
            None,
            "the noise of its velocity"
        );
    }

    /// 2 mm/s from the beginning, within the noise of the velocity; the position of the first state
    /// counts, and the 26th state after it is more than 0.1 mm off.
    #[test]
    fn an_arm_that_creeps_where_rest_is_ordered_is_seen_after_a_tenth_of_a_millimetre() {
        let creeping =
            |speed: f64| move |at: u32| (along(speed * f64::from(at) * 1e-3), along(speed));
        assert_eq!(
            first_fault_of(400, |_| Some(STOP), creeping(2e-3)),
            Some(52)
        );
        // 0.1 mm/s: 1000 ms, and the state after
        assert_eq!(
            first_fault_of(2000, |_| Some(STOP), creeping(0.1e-3)),
            Some(1002)
        );
        // the order to rest comes at 200 ms, counts 80 ms later, and 0.1 mm takes 50 ms
        let order = |at| Some(if at < 200 { go(2e-3) } else { STOP });
        let seen = first_fault_of(600, order, creeping(2e-3)).unwrap();
        assert!((320..=345).contains(&seen), "{seen} ms");
        // the noise of a position, 30 um, and an arm that follows its order
        let noisy = |at: u32| {
            (
                along(if at.is_multiple_of(4) { 30e-6 } else { -30e-6 }),
                along(0.0),
            )
        };
        assert_eq!(first_fault_of(2000, |_| Some(STOP), noisy), None);
        assert_eq!(
            first_fault_of(2000, |_| Some(go(2e-3)), creeping(2e-3)),
            None
        );
        let turning = |at: u32| {
            (
                [0.0, 0.0, 0.0, 0.0, 0.0, 0.02 * f64::from(at) * 1e-3],
                [0.0; 6],
            )
        };
        assert_eq!(
            first_fault_of(400, |_| Some(STOP), turning),
            Some(102),
            "2 mrad at 20 mrad/s"
        );
    }

    /// 25 ms after the last order the client brakes with 2 m/s², so 15 mm/s off is 7 ms later; then
    /// come the 80 ms and the 20 ms.
    #[test]
    fn an_arm_that_goes_on_where_orders_stay_away_is_seen_within_140_ms() {
        let order = |at| (at < 200).then(|| go(0.05));
        let goes_on = |at: u32| ([0.0; 6], along(late(at.min(200), 0)));
        let seen = first_fault_of(800, order, goes_on).unwrap();
        assert!((300..=340).contains(&seen), "{seen} ms");
        // a client that brakes 6 ms late
        let speed =
            |at: u32| (0.05_f64).min((0.05 - 2.0 * (f64::from(at) * 1e-3 - 0.231)).max(0.0));
        let braked = |at: u32| ([0.0; 6], along(speed(at).min(late(at.min(200), 0))));
        assert_eq!(first_fault_of(800, order, braked), None);
    }

    #[test]
    fn an_arm_that_goes_elsewhere_as_fast_as_ordered_disobeys() {
        let aside = |at: u32| [0.0, late(at.min(200), 0), 0.0, 0.0, 0.0, 0.0];
        assert!(first_fault(400, |_| go(0.05), aside).is_some());
        assert!(first_fault(400, |_| go(0.05), |at| along(-late(at.min(200), 0))).is_some());
        // a bend of the path by a right angle is obedient: it goes through ordered velocities
        let bend = |at| {
            if at < 200 {
                go(0.05)
            } else {
                OrderedMotion::Move {
                    twist: [0.0, 0.05, 0.0, 0.0, 0.0, 0.0],
                    acceleration: 0.5,
                }
            }
        };
        let bent = |at: u32| {
            let share = (f64::from(at.saturating_sub(220)) * 1e-3 / 0.1414).min(1.0);
            [
                late(at.min(200), 20) * (1.0 - share),
                0.05 * share,
                0.0,
                0.0,
                0.0,
                0.0,
            ]
        };
        assert_eq!(first_fault(600, bend, bent), None);
    }

    #[test]
    fn a_turn_that_nobody_ordered_is_seen() {
        let turning = |at: u32| [0.0, 0.0, 0.0, 0.0, 0.0, if at < 100 { 0.0 } else { 0.1 }];
        assert_eq!(first_fault(400, |_| STOP, turning), Some(122));
        let order = |at| {
            let turn = if at < 100 { 0.5 } else { 0.0 };
            OrderedMotion::Move {
                twist: [0.0, 0.0, 0.0, 0.0, 0.0, turn],
                acceleration: 0.5,
            }
        };
        let braked = |at: u32| [0.0, 0.0, 0.0, 0.0, 0.0, if at < 250 { 0.5 } else { 0.0 }];
        assert_eq!(first_fault(800, order, braked), None);
        assert!(
            first_fault(800, order, |_| [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]).is_some_and(|at| at < 450)
        );
    }

    fn press(feed: [f64; 3]) -> OrderedMotion {
        OrderedMotion::Press {
            axis: -Vector3::x(),
            speed: 10e-3,
            feed: feed.into(),
            acceleration: 0.5,
        }
    }

    #[test]
    fn along_the_axis_of_a_press_the_arm_has_its_own_velocity_up_to_the_speed_of_it() {
        let of = |along: f64, across: f64| move |_| [along, across, 0.0, 0.0, 0.0, 0.0];
        let feed = |_| press([0.0, 10e-3, 0.0]);
        assert_eq!(first_fault(400, feed, of(-10e-3, 5e-3)), None);
        assert_eq!(first_fault(400, feed, of(12e-3, 5e-3)), None);
        assert!(first_fault(400, feed, of(40e-3, 5e-3)).is_some());
        assert!(first_fault(400, feed, of(0.0, 40e-3)).is_some());
    }
}
