//! Measurements of the node's own arm.

use std::time::Instant;

use crate::ros::inbox::Inbox;
use crate::ros::messages::{PoseStamped, WrenchStamped};
use crate::ros::port::{Arrival, SamplePort};

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
    fn publish_wrench(&self, wrench: WrenchStamped) -> bool {
        self.inbox
            .put(Arrival::Wrench(wrench.clone(), Instant::now()));
        self.topics.publish_wrench(wrench)
    }

    fn publish_pose(&self, pose: PoseStamped) -> bool {
        if self.has_poses {
            self.inbox.put(Arrival::Pose(pose.clone(), Instant::now()));
        }
        self.topics.publish_pose(pose)
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
    use touchup_session::clock::Clock;

    /// Names of the arrivals, `+` for a wrench and `-` for a pose.
    fn names(arrivals: &Arrivals) -> String {
        let name = |arrival| match arrival {
            Arrival::Wrench(..) => '+',
            Arrival::Pose(..) => '-',
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
            assert!(samples.publish_pose(PoseStamped::default()));
            assert!(samples.publish_wrench(WrenchStamped::default()));
        }
        assert_eq!(
            (names(&arrivals), names(&heard)),
            ("-+".into(), "-+-+".into())
        );
        assert_eq!((own.dropped(), samples.listeners()), ([2, 0], [1, 1]));
        // poses of `/tf` do not mix with those of the arm
        samples.has_poses = false;
        assert!(samples.publish_pose(PoseStamped::default()));
        assert!(samples.publish_wrench(WrenchStamped::default()));
        assert_eq!((names(&arrivals), names(&heard)), ("+".into(), "-+".into()));
    }
}
