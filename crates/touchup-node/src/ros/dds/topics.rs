//! Topics as writers and readers of DDS.

use ros2_client::dds::rustdds::policy::ResourceLimits;
use ros2_client::dds::rustdds::qos::HasQoSPolicy;
use ros2_client::dds::rustdds::{self, QosPolicyBuilder, TopicDescription, TopicKind};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Name, Node, WriteError};

use super::back_end::{DdsBackEnd, DdsErrorContext};
use super::incoming::HeardTopic;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::messages::RosMessage;
use crate::ros::port::{Arrival, TILES_KEPT};
use crate::ros::send_queue::SendOutcome;
use crate::ros::topics::{
    MESH, MESH_PATCH, PROBE_TOUCHES, Publisher, Publishes, Subscribes, Topic,
};

pub(super) const BEST_EFFORT: QosProfile = QosProfile::subscription_default();
/// Profile of urgent messages: an unresponsive listener delays the sending thread by 10 ms at most.
pub(super) const URGENT: QosProfile =
    BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(10)));
/// Profile of the mesh: waits for slow listeners, then tries again.
const PATIENT: QosProfile =
    BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(100)));

pub(super) const fn keep(profile: QosProfile, depth: usize) -> QosProfile {
    profile.history(History::KeepLast { depth })
}

/// Maximum number of touches in flight, of 33 kB each: together they fit into the buffer that Linux
/// gives a socket (212 kB).
const TOUCHES_SENT: usize = 4;

pub(super) fn profile(topic: Topic) -> QosProfile {
    let profile = match topic.is_reliable {
        false => BEST_EFFORT,
        true if [MESH, MESH_PATCH, PROBE_TOUCHES].contains(&topic) => PATIENT,
        true => URGENT,
    };
    let profile = if topic.is_latched {
        profile.durability(Durability::TransientLocal)
    } else {
        profile
    };
    keep(profile, limit(topic).unwrap_or(topic.depth))
}

/// Maximum number of large messages in flight: RustDDS keeps each until everybody has it, and a
/// slow or silent listener would get old ones, or lose some of many at once.
fn limit(topic: Topic) -> Option<usize> {
    [(MESH, TILES_KEPT), (PROBE_TOUCHES, TOUCHES_SENT)]
        .into_iter()
        .find(|(one, _)| *one == topic)
        .map(|(_, most)| most)
}

impl<M: RosMessage> Publishes<M> for DdsBackEnd<'_> {
    fn publisher(&mut self, topic: Topic) -> Result<Publisher<M>, RosError> {
        let (profile, whole) = (profile(topic), self.config.resolve(topic.name)?);
        let mut announced = make_topic::<M>(&self.node, &whole, &profile)?;
        if let Some(most) = limit(topic) {
            announced = limited(&announced, most)?;
        }
        let publisher = self
            .node
            .create_publisher::<M>(&announced, Some(profile))
            .during("publishing a topic")?;
        let mut graph = locked(&self.graph);
        graph.add(publisher.guid(), &announced, whole);
        if topic == MESH {
            graph.tiles = Some(publisher.guid());
            self.exchange.inbox.put(Arrival::Viewers(0));
        }
        drop(graph);
        Ok(Box::new(move |message| match publisher.publish(message) {
            Ok(()) => SendOutcome::Done,
            Err(WriteError::WouldBlock { data }) => SendOutcome::Later(data),
            Err(error) => {
                tracing::warn!(topic_type = M::TYPE_NAME, %error, "a message is not sent");
                SendOutcome::Refused
            }
        }))
    }
}

impl<M: RosMessage> Subscribes<M> for DdsBackEnd<'_> {
    fn subscribe(
        &mut self,
        topic: Topic,
        arrival: fn(&PortState, M) -> Arrival,
    ) -> Result<(), RosError> {
        let (profile, whole) = (profile(topic), self.config.resolve(topic.name)?);
        let announced = make_topic::<M>(&self.node, &whole, &profile)?;
        let subscription = self
            .node
            .create_subscription::<M>(&announced, Some(profile));
        let subscription = subscription.during("subscribing to a topic")?;
        locked(&self.graph).add(subscription.guid(), &announced, whole);
        let (name, exchange) = (topic.name, self.exchange.clone());
        self.listeners.push(Box::new(HeardTopic {
            name,
            subscription,
            exchange,
            arrival,
        }));
        Ok(())
    }
}

/// The same topic with a limit, which ROS profiles lack.
fn limited(topic: &rustdds::Topic, most: usize) -> Result<rustdds::Topic, RosError> {
    let most = most as i32;
    let limits = ResourceLimits {
        max_samples: most,
        max_instances: 1,
        max_samples_per_instance: most,
    };
    let qos = topic
        .qos()
        .modify_by(&QosPolicyBuilder::new().resource_limits(limits).build());
    let participant = topic
        .participant()
        .ok_or("the participant is gone")
        .during("making a topic")?;
    let limited = participant.create_topic(
        topic.name(),
        topic.get_type().name().to_owned(),
        &qos,
        TopicKind::NoKey,
    );
    limited.during("making a topic")
}

/// - `whole`: absolute, remapped.
pub(super) fn make_topic<M: RosMessage>(
    node: &Node,
    whole: &str,
    qos: &QosProfile,
) -> Result<rustdds::Topic, RosError> {
    topic_of(M::TYPE_NAME, node, whole, qos)
}

/// - `type_name`: package, kind, name; `whole`: absolute, remapped.
pub(super) fn topic_of(
    type_name: &str,
    node: &Node,
    whole: &str,
    qos: &QosProfile,
) -> Result<rustdds::Topic, RosError> {
    let mut parts = type_name.split('/');
    let (package, type_name) = (
        parts.next().unwrap_or_default(),
        parts.next_back().unwrap_or_default(),
    );
    node.create_topic(
        &dds_name(whole)?,
        MessageTypeName::new(package, type_name),
        qos,
    )
    .during("making a topic")
}

/// A name of ros2-client.
pub(super) fn dds_name(whole: &str) -> Result<Name, RosError> {
    Name::parse(whole).during("naming a topic or service")
}
