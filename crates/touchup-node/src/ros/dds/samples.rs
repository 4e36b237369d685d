//! Publishes the measurements of a stylus or a probe.

use std::collections::BTreeSet;

use ros2_client::dds::rustdds::{
    DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, GUID, StatusEvented,
};
use ros2_client::{Node, NodeOptions, Publisher};

use super::back_end::{DdsErrorContext, join};
use super::topics::{BEST_EFFORT, keep, make_topic};
use crate::ros::arguments::NodeConfig;
use crate::ros::convert::{as_pose, as_wrench};
use crate::ros::exchange::RosError;
use crate::ros::messages::{PoseStamped, RosMessage, WrenchStamped};
use crate::ros::port::SamplePort;
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::Message;

/// Nothing is resent: the history serves readers that read at once.
const DEPTH: usize = 100;

struct DdsSamples {
    wrench: Publisher<WrenchStamped>,
    pose: Publisher<PoseStamped>,
    listener: DomainParticipantStatusListener,
    /// of wrenches, of poses
    listeners: [BTreeSet<GUID>; 2],
    // its entities leave the graph on drop
    _node: Node,
}

/// Joins the network as a stylus or probe: the parameter `source` selects the topics.
///
/// # Errors
/// [`RosError`]: an invalid name, no network.
pub fn samples(config: &NodeConfig) -> Result<Box<dyn SamplePort>, RosError> {
    let (context, mut node) = join(config, NodeOptions::new().start_parameter_services(false))?;
    let listener = context.domain_participant().status_listener();
    let [wrench, pose] = config.sample_topics();
    let (wrench, pose) = (
        publisher(config, &mut node, wrench)?,
        publisher(config, &mut node, pose)?,
    );
    Ok(Box::new(DdsSamples {
        wrench,
        pose,
        listener,
        listeners: Default::default(),
        _node: node,
    }))
}

fn publisher<M: RosMessage>(
    config: &NodeConfig,
    node: &mut Node,
    name: &str,
) -> Result<Publisher<M>, RosError> {
    let qos = keep(BEST_EFFORT, DEPTH);
    let topic = make_topic::<M>(node, &config.resolve(name)?, &qos)?;
    node.create_publisher(&topic, Some(qos))
        .during("publishing a topic")
}

fn send<M: RosMessage>(publisher: &Publisher<M>, message: M) -> bool {
    publisher
        .publish(message)
        .inspect_err(|error| tracing::debug!(topic_type = M::TYPE_NAME, %error, "not sent"))
        .is_ok()
}

impl SamplePort for DdsSamples {
    fn publish(&self, LiveMessage { frame, message }: LiveMessage) -> bool {
        match message {
            Message::Wrench(wrench) => send(&self.wrench, as_wrench(&wrench, &frame)),
            Message::Pose(pose) => send(&self.pose, as_pose(&pose, &frame)),
        }
    }

    fn listeners(&mut self) -> [usize; 2] {
        let writers = [self.wrench.guid(), self.pose.guid()];
        while let Some(event) = self.listener.try_recv_status() {
            match event {
                Event::RemoteReaderMatched {
                    local_writer,
                    remote_reader,
                } => {
                    let of = writers.iter().position(|writer| *writer == local_writer);
                    of.map(|stream| self.listeners[stream].insert(remote_reader));
                }
                Event::ReaderLost { guid, .. } => self.listeners.iter_mut().for_each(|listeners| {
                    listeners.remove(&guid);
                }),
                _ => {}
            }
        }
        self.listeners.each_ref().map(BTreeSet::len)
    }
}
