//! Measurements of the node's own arm.

use std::time::Instant;

use crate::ros::inbox::Inbox;
use crate::ros::port::{Arrival, SamplePort};
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::Message;

/// Passes the measurements of an arm to its node within the process, and publishes them for others:
/// with an arm the node does not subscribe to these topics.
pub struct ArmSamples {
    /// arrivals of the node
    pub inbox: Inbox,
    /// whether the arm gives the poses, and not `/tf`
    pub has_poses: bool,
    /// publishes on the topics of the probe
    pub topics: Box<dyn SamplePort>,
}

impl SamplePort for ArmSamples {
    fn publish(&self, message: LiveMessage) -> bool {
        if self.has_poses || matches!(message.message, Message::Wrench(_)) {
            let arrival = Arrival::Message(message.clone(), Instant::now());
            self.inbox.put(arrival);
        }
        self.topics.publish(message)
    }

    fn listeners(&mut self) -> [usize; 2] {
        self.topics.listeners()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::in_process::start;
    use crate::ros::inbox::{Arrivals, inbox};
    use nalgebra::Isometry3;
    use touchup_method::stylus::{StampedPose, StampedWrench, Wrench};
    use touchup_session::clock::Clock;

    fn pose() -> LiveMessage {
        let (stamp_ns, pose_ot) = (0, Isometry3::identity());
        LiveMessage {
            frame: String::new(),
            message: Message::Pose(StampedPose { stamp_ns, pose_ot }),
        }
    }

    fn wrench() -> LiveMessage {
        let (stamp_ns, wrench) = (0, Wrench::default());
        LiveMessage {
            frame: String::new(),
            message: Message::Wrench(StampedWrench { stamp_ns, wrench }),
        }
    }

    /// Names of the arrivals, `+` for a wrench and `-` for a pose.
    fn names(arrivals: &Arrivals) -> String {
        let name = |arrival| match arrival {
            Arrival::Message(LiveMessage { message, .. }, _) => match message {
                Message::Wrench(_) => '+',
                Message::Pose(_) => '-',
            },
            other => panic!("{other:?}"),
        };
        std::iter::from_fn(|| arrivals.try_recv().ok())
            .map(name)
            .collect()
    }

    #[test]
    fn the_node_and_its_network_get_each_measurement_and_a_slow_node_delays_none() {
        let clock = Clock::system();
        // whatever listens to the topics is another node
        let ((own, arrivals), (other, heard)) = (inbox(2, &clock), inbox(8, &clock));
        let (_port, world) = start(other, &clock);
        let mut samples = ArmSamples {
            inbox: own.clone(),
            has_poses: true,
            topics: Box::new(world),
        };
        for _ in 0..2 {
            assert!(samples.publish(pose()) && samples.publish(wrench()));
        }
        assert_eq!(
            (names(&arrivals), names(&heard)),
            ("-+".into(), "-+-+".into())
        );
        assert_eq!((own.dropped(), samples.listeners()), ([2, 0], [1, 1]));
        // poses of `/tf` do not mix with those of the arm
        samples.has_poses = false;
        assert!(samples.publish(pose()) && samples.publish(wrench()));
        assert_eq!((names(&arrivals), names(&heard)), ("+".into(), "-+".into()));
    }
}
