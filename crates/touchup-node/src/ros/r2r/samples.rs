//! Publishes the measurements of a stylus or a probe.

use r2r::{Publisher, WrappedTypesupport, geometry_msgs::msg as geometry};

use super::back_end::RclErrorContext;
use super::context;
use super::convert::Convert;
use super::topics::profile;
use crate::ros::arguments::NodeConfig;
use crate::ros::convert::{as_pose, as_wrench};
use crate::ros::exchange::RosError;
use crate::ros::port::SamplePort;
use crate::ros::topics::Topic;
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::Message;

/// Nothing is resent: the history serves readers that read at once.
const DEPTH: usize = 100;

struct R2rSamples {
    wrench: Publisher<geometry::WrenchStamped>,
    pose: Publisher<geometry::PoseStamped>,
    // its publishers leave the graph on drop
    _node: r2r::Node,
}

/// Joins ROS as a stylus or probe: the parameter `source` selects the topics. Once per process.
///
/// # Errors
/// [`RosError`]: ROS does not start.
pub fn samples(config: &NodeConfig) -> Result<Box<dyn SamplePort>, RosError> {
    let node = r2r::Node::create(context()?, &config.place.node, &config.place.namespace);
    let mut node = node.during("making the node")?;
    let [wrench, pose] = config.sample_topics();
    let wrench = node
        .create_publisher(wrench, profile(Topic::best_effort(wrench, DEPTH)))
        .during("publishing a topic")?;
    let pose = node
        .create_publisher(pose, profile(Topic::best_effort(pose, DEPTH)))
        .during("publishing a topic")?;
    Ok(Box::new(R2rSamples {
        wrench,
        pose,
        _node: node,
    }))
}

/// Number of listeners; 0 if rcl does not know.
fn count<T: WrappedTypesupport + 'static>(publisher: &Publisher<T>) -> usize {
    publisher
        .get_inter_process_subscription_count()
        .unwrap_or_default()
}

impl SamplePort for R2rSamples {
    fn publish(&self, LiveMessage { frame, message }: LiveMessage) -> bool {
        match message {
            Message::Wrench(wrench) => self
                .wrench
                .publish(&as_wrench(&wrench, &frame).theirs())
                .is_ok(),
            Message::Pose(pose) => self.pose.publish(&as_pose(&pose, &frame).theirs()).is_ok(),
        }
    }

    fn listeners(&mut self) -> [usize; 2] {
        [count(&self.wrench), count(&self.pose)]
    }
}
