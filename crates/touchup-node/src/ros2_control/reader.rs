//! Combines messages of two topics into states: joints and wrench of one moment.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::params::Ros2ControlParams;
use super::topic_age::TopicAge;
use crate::ros::clock;
use crate::ros::convert::vector_of;
use crate::ros::messages::{JointState, WrenchStamped};
use crate::ros::port::{ArmPort, ArmReport};
use touchup_method::stylus::{StampedWrench, Wrench};
use touchup_probing::arm::{ArmError, Joints, MOST_JOINTS};

/// Maximum number of states that wait for a late caller or for their wrench; older ones drop out.
const WAITING: usize = 64;
/// Maximum number of wrenches among which to search that of a state.
const WRENCHES: usize = 64;
/// Time between the positions that yield velocities, if the topic has none, ns.
const BASE_NS: i64 = 18_000_000;
/// Maximum age of a state's wrench relative to the state while a newer one may still come, ns.
const SAME_NS: i64 = 500_000;

/// Joints at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointSample {
    pub stamp_ns: i64,
    /// positions, rad
    pub joints: Joints,
    /// velocities, rad/s
    pub rates: Joints,
}

/// Measurements of one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArmSample {
    pub sample: JointSample,
    /// reading of the sensor, in the axes of the flange F about its origin
    pub wrench_f: Wrench,
}

/// Receiver of an arm's messages.
pub(super) struct StateReader {
    port: Box<dyn ArmPort>,
    joints: TopicAge,
    wrench: TopicAge,
    waiting: VecDeque<JointSample>,
    wrenches: VecDeque<StampedWrench>,
    /// recent positions, for velocities missing in the messages
    places: VecDeque<(i64, Joints)>,
}

impl StateReader {
    pub fn new(port: Box<dyn ArmPort>, params: &Ros2ControlParams) -> Self {
        let now = params.clock.now();
        Self {
            port,
            joints: TopicAge::new(&params.section.joint_states_topic, now),
            wrench: TopicAge::new(&params.section.wrench_topic, now),
            waiting: VecDeque::new(),
            wrenches: VecDeque::new(),
            places: VecDeque::new(),
        }
    }

    pub fn port(&mut self) -> &mut dyn ArmPort {
        &mut *self.port
    }

    /// Forgets all messages, as if it began to listen now.
    pub fn restart(&mut self, params: &Ros2ControlParams) {
        while self.port.next_report(Duration::ZERO).is_some() {}
        let now = params.clock.now();
        self.joints = TopicAge::new(&params.section.joint_states_topic, now);
        self.wrench = TopicAge::new(&params.section.wrench_topic, now);
        self.waiting.clear();
        self.wrenches.clear();
        self.places.clear();
    }

    /// Stamp of the newest joints, s.
    pub fn newest_s(&self) -> f64 {
        self.joints
            .stamp_ns()
            .map_or(f64::NAN, |stamp_ns| stamp_ns as f64 * 1e-9)
    }

    /// The next state.
    ///
    /// - `silent`: maximum silence of a topic.
    ///
    /// # Errors
    /// Those of [`TopicAge`]; [`ArmError::Unreadable`].
    pub fn next(
        &mut self,
        params: &Ros2ControlParams,
        silent: Duration,
    ) -> Result<ArmSample, ArmError> {
        loop {
            if let Some(measured) = self.paired(params)? {
                return Ok(measured);
            }
            let now = params.clock.now();
            let patience = self
                .joints
                .patience(silent, now)?
                .min(self.wrench.patience(silent, now)?);
            if let Some(report) = self.port.next_report(patience) {
                self.take(report, params)?;
            }
        }
    }

    /// Reads all waiting messages.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub fn drain(&mut self, params: &Ros2ControlParams) -> Result<(), ArmError> {
        while let Some(report) = self.port.next_report(Duration::ZERO) {
            self.take(report, params)?;
        }
        Ok(())
    }

    /// The next joints despite any fault in them or in the wrench: to see whether the arm stands.
    pub fn watch(&mut self, params: &Ros2ControlParams, timeout: Duration) -> Option<JointSample> {
        match self.port.next_report(timeout)? {
            ArmReport::Joints(message) => self.sample(&message, params).ok().flatten(),
            _ => None,
        }
    }

    fn take(&mut self, report: ArmReport, params: &Ros2ControlParams) -> Result<(), ArmError> {
        let now = params.clock.now();
        match report {
            ArmReport::Joints(message) => {
                let Some(sample) = self.sample(&message, params)? else {
                    return Ok(());
                };
                if self.joints.see(sample.stamp_ns, params.silent, now)? {
                    keep(&mut self.waiting, sample, WAITING);
                }
            }
            ArmReport::Wrench(message) => {
                let wrench = wrench_in_flange(&message, params)?;
                if self.wrench.see(wrench.stamp_ns, params.silent, now)? {
                    keep(&mut self.wrenches, wrench, WRENCHES);
                }
            }
            ArmReport::Unreadable(reason) => {
                let topic = format!(
                    "{} or {}",
                    params.section.joint_states_topic, params.section.wrench_topic
                );
                return Err(ArmError::Unreadable { topic, reason });
            }
        }
        Ok(())
    }

    /// The oldest waiting joints, with the wrench nearest in time.
    fn paired(&mut self, params: &Ros2ControlParams) -> Result<Option<ArmSample>, ArmError> {
        let Some(sample) = self.waiting.front().copied() else {
            return Ok(None);
        };
        let Some(newest_ns) = self.wrenches.back().map(|newest| newest.stamp_ns) else {
            return Ok(None);
        };
        let apart_ns = |stamp_ns: i64| stamp_ns.saturating_sub(sample.stamp_ns).saturating_abs();
        let most_ns = params.silent.as_nanos() as i64;
        if newest_ns < sample.stamp_ns.saturating_sub(SAME_NS) && apart_ns(newest_ns) <= most_ns {
            return Ok(None);
        }
        let nearest = self
            .wrenches
            .iter()
            .min_by_key(|wrench| apart_ns(wrench.stamp_ns));
        let Some(&StampedWrench { stamp_ns, wrench }) = nearest else {
            return Ok(None);
        };
        if apart_ns(stamp_ns) > most_ns {
            let apart_ms = apart_ns(stamp_ns) as f64 * 1e-6;
            let joints = &params.section.joint_states_topic;
            let reason = format!(
                "its stamps are {apart_ms:.0} ms from those of {joints}: both have to come from one controller manager, \
                 or from clocks that agree"
            );
            return Err(ArmError::Unreadable {
                topic: params.section.wrench_topic.clone(),
                reason,
            });
        }
        self.waiting.pop_front();
        Ok(Some(ArmSample {
            sample,
            wrench_f: wrench,
        }))
    }

    /// The arm's joints in a message; `None` for a message with none of them, such as a gripper's.
    fn sample(
        &mut self,
        message: &JointState,
        params: &Ros2ControlParams,
    ) -> Result<Option<JointSample>, ArmError> {
        let unreadable = |reason| ArmError::Unreadable {
            topic: params.section.joint_states_topic.clone(),
            reason,
        };
        let place_of = |name: &Arc<str>| message.name.iter().position(|other| **other == **name);
        let places: Vec<_> = params.joint_names.iter().map(place_of).collect();
        if places.iter().all(Option::is_none) {
            return Ok(None);
        }
        if let Some(missing) = places.iter().position(Option::is_none) {
            let name = &params.joint_names[missing];
            return Err(unreadable(format!(
                "the joint {name} is missing in a message that has others of the arm"
            )));
        }
        let of = |values: &[f64]| {
            let mut joints = [0.0; MOST_JOINTS];
            for (joint, place) in joints.iter_mut().zip(&places) {
                *joint = values
                    .get((*place)?)
                    .copied()
                    .filter(|value| value.is_finite())?;
            }
            Joints::of(&joints[..places.len()])
        };
        let joints = of(&message.position);
        let joints = joints.ok_or_else(|| {
            unreadable("a position of its joints is missing or no number".to_owned())
        })?;
        let stamp_ns = clock::stamp_ns(message.header.stamp);
        let rates = of(&message.velocity).unwrap_or_else(|| self.difference(stamp_ns, &joints));
        if self
            .places
            .back()
            .is_some_and(|(last_ns, _)| *last_ns >= stamp_ns)
        {
            self.places.clear();
        }
        while self
            .places
            .get(1)
            .is_some_and(|(then_ns, _)| stamp_ns.saturating_sub(*then_ns) >= BASE_NS)
        {
            self.places.pop_front();
        }
        keep(&mut self.places, (stamp_ns, joints), WAITING);
        Ok(Some(JointSample {
            stamp_ns,
            joints,
            rates,
        }))
    }

    /// Velocities from positions, rad/s; zero without an earlier position.
    fn difference(&self, stamp_ns: i64, joints: &Joints) -> Joints {
        let then = self
            .places
            .front()
            .filter(|(then_ns, _)| *then_ns < stamp_ns);
        joints.mapped(|joint, angle| match then {
            Some((then_ns, before)) => {
                (angle - before[joint]) / (stamp_ns.saturating_sub(*then_ns) as f64 * 1e-9)
            }
            None => 0.0,
        })
    }
}

fn keep<T>(queue: &mut VecDeque<T>, item: T, most: usize) {
    if queue.len() >= most {
        queue.pop_front();
    }
    queue.push_back(item);
}

/// Reading of the sensor in the axes of the flange F about its origin.
fn wrench_in_flange(
    message: &WrenchStamped,
    params: &Ros2ControlParams,
) -> Result<StampedWrench, ArmError> {
    let unreadable = |reason| {
        Err(ArmError::Unreadable {
            topic: params.section.wrench_topic.clone(),
            reason,
        })
    };
    let (named, wanted) = (&message.header.frame_id, &params.section.wrench_frame);
    if named != wanted {
        return unreadable(format!(
            "it is in the frame {named:?}, and robot.ros2_control.wrench_frame of the scene is {wanted:?}: name that frame there, and its \
             pose in the flange"
        ));
    }
    let wrench_s = Wrench {
        force: vector_of(&message.wrench.force),
        torque: vector_of(&message.wrench.torque),
    };
    let mut parts = wrench_s.force.iter().chain(&wrench_s.torque);
    if !parts.all(|part| part.is_finite()) {
        return unreadable("it has a part that is no number".to_owned());
    }
    Ok(StampedWrench {
        stamp_ns: clock::stamp_ns(message.header.stamp),
        wrench: wrench_s.moved(&params.section.pose_fs()),
    })
}
