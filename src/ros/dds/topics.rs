//! The topics of docs/ros.md, each with its quality of service.

use std::sync::Arc;
use std::time::Instant;

use ros2_client::dds::rustdds::policy::ResourceLimits;
use ros2_client::dds::rustdds::qos::HasQoSPolicy;
use ros2_client::dds::rustdds::{QosPolicyBuilder, TopicDescription, TopicKind};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Name, Node, Publisher, WriteError};

use super::graph::DdsGraph;
use super::incoming::{LastNumbers, Listener, Topic};
use super::{DdsShared, RosError};
use crate::ros::arguments::NodeConfig;
use crate::ros::messages::{
    Clock, DiagnosticArray, FeatureArray, HapticMismatch, Marker, MarkerArray, MeshPatch, Path, PointStamped,
    PoseStamped, ProbeResult, ProbeTouch, RosMessage, TFMessage, WrenchStamped,
};
use crate::ros::port::{Arrival, Publication, TILES_KEPT};
use crate::ros::send_queue::Sent;

/// What is small and urgent.
pub(super) struct UrgentWriters {
    pub features: Publisher<FeatureArray>,
    pub feature_markers: Publisher<MarkerArray>,
    pub tip: Publisher<MarkerArray>,
    pub path: Publisher<Path>,
    pub probe_results: Publisher<ProbeResult>,
    pub mismatch: Publisher<HapticMismatch>,
    pub diagnostics: Publisher<DiagnosticArray>,
}

/// What is large and may wait.
pub(super) struct MeshWriters {
    pub tiles: Publisher<Marker>,
    pub patches: Publisher<MeshPatch>,
    pub probe_touches: Publisher<ProbeTouch>,
}

impl UrgentWriters {
    pub fn send(&self, publication: Publication) -> Sent {
        match publication {
            Publication::Features(message) => sent(self.features.publish(message)),
            Publication::FeatureMarkers(message) => sent(self.feature_markers.publish(message)),
            Publication::Tip(message) => sent(self.tip.publish(message)),
            Publication::Path(message) => sent(self.path.publish(message)),
            Publication::ProbeResult(message) => sent(self.probe_results.publish(*message)),
            Publication::Mismatch(message) => sent(self.mismatch.publish(message)),
            Publication::Diagnostics(message) => sent(self.diagnostics.publish(message)),
            // what may wait has an outbox of its own
            Publication::Tile(_) | Publication::MeshPatch(_) | Publication::ProbeTouch(_) => Sent::Done,
        }
    }
}

impl MeshWriters {
    pub fn send(&self, publication: Publication) -> Sent {
        match publication {
            Publication::Tile(message) => later(self.tiles.publish(message), Publication::Tile),
            Publication::MeshPatch(message) => later(self.patches.publish(message), Publication::MeshPatch),
            Publication::ProbeTouch(message) => {
                later(self.probe_touches.publish(*message), |message| Publication::ProbeTouch(Box::new(message)))
            }
            // the others have an outbox of their own
            _ => Sent::Done,
        }
    }
}

/// What is urgent waits for nobody.
fn sent<M: RosMessage>(result: Result<(), WriteError<M>>) -> Sent {
    match result {
        Ok(()) => Sent::Done,
        Err(WriteError::WouldBlock { .. }) => Sent::Refused,
        Err(error) => {
            tracing::warn!(topic_type = M::TYPE_NAME, %error, "a message is not sent");
            Sent::Refused
        }
    }
}

/// The mesh waits for who listens slowly.
fn later<M: RosMessage>(result: Result<(), WriteError<M>>, publication: fn(M) -> Publication) -> Sent {
    match result {
        Err(WriteError::WouldBlock { data }) => Sent::Later(Box::new(publication(data))),
        other => sent(other),
    }
}

pub(super) const BEST_EFFORT: QosProfile = QosProfile::subscription_default();
/// The thread that sends what is urgent is not held up by who does not listen for longer than this.
const URGENT: QosProfile = BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(10)));
/// The mesh waits for who listens slowly, then tries again.
const PATIENT: QosProfile = BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(100)));

pub(super) const fn keep(profile: QosProfile, depth: usize) -> QosProfile {
    profile.history(History::KeepLast { depth })
}

const fn latched(profile: QosProfile) -> QosProfile {
    profile.durability(Durability::TransientLocal)
}

/// Touches on their way at most, of 33 kB each: together they fit into the buffer that Linux gives a socket (212 kB).
const TOUCHES_SENT: usize = 4;
/// Samples are the last that may be lost: two tenths of a second at 10 kHz. What is kept is no matter of matching.
const SAMPLES: usize = 2048;

/// The writers of all topics that go out.
pub(super) fn writers(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut DdsGraph,
) -> Result<(UrgentWriters, MeshWriters), RosError> {
    let mesh = MeshWriters {
        tiles: limited_writer(config, node, graph, "mesh", latched(PATIENT), TILES_KEPT)?,
        patches: writer(config, node, graph, "mesh_patch", keep(PATIENT, 4096))?,
        probe_touches: limited_writer(config, node, graph, "probe_touches", PATIENT, TOUCHES_SENT)?,
    };
    graph.add_tiles(mesh.tiles.guid());
    let urgent = UrgentWriters {
        features: writer(config, node, graph, "features", latched(keep(URGENT, 1)))?,
        feature_markers: writer(config, node, graph, "feature_markers", latched(keep(URGENT, 1)))?,
        tip: writer(config, node, graph, "tip", keep(URGENT, 1))?,
        path: writer(config, node, graph, "path", latched(keep(URGENT, 1)))?,
        probe_results: writer(config, node, graph, "probe_results", keep(URGENT, 100))?,
        mismatch: writer(config, node, graph, "mismatch", keep(BEST_EFFORT, 100))?,
        diagnostics: writer(config, node, graph, "/diagnostics", keep(URGENT, 10))?,
    };
    Ok((urgent, mesh))
}

/// Everything that is listened to.
pub(super) fn readers(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut DdsGraph,
    shared: &Arc<DdsShared>,
) -> Result<Vec<Box<dyn Listener>>, RosError> {
    let [wrench, pose] = config.sample_topics();
    let mut made = Readers { config, node, graph, shared, listeners: Vec::new() };
    made.add::<WrenchStamped>(wrench, keep(BEST_EFFORT, SAMPLES), |_, m| Some(Arrival::Wrench(m, Instant::now())))?;
    made.add::<PoseStamped>(pose, keep(BEST_EFFORT, SAMPLES), |_, m| Some(Arrival::Pose(m, Instant::now())))?;
    made.add::<TFMessage>("/tf", keep(BEST_EFFORT, SAMPLES), |_, m| Some(Arrival::Tf(m)))?;
    made.add::<TFMessage>("/tf_static", latched(keep(PATIENT, 100)), |_, m| Some(Arrival::TfStatic(m)))?;
    made.add::<PointStamped>("/clicked_point", keep(PATIENT, 10), |_, m| Some(Arrival::ClickedPoint(m)))?;
    if config.parameters.bool("use_sim_time") {
        made.add::<Clock>("/clock", keep(BEST_EFFORT, 1), |shared, m| {
            shared.clock.set(m.clock);
            Some(Arrival::Clock(m))
        })?;
    }
    Ok(made.listeners)
}

struct Readers<'a> {
    config: &'a NodeConfig,
    node: &'a mut Node,
    graph: &'a mut DdsGraph,
    shared: &'a Arc<DdsShared>,
    listeners: Vec<Box<dyn Listener>>,
}

impl Readers<'_> {
    fn add<M: RosMessage>(
        &mut self,
        name: &'static str,
        qos: QosProfile,
        arrival: fn(&DdsShared, M) -> Option<Arrival>,
    ) -> Result<(), RosError> {
        let topic = topic::<M>(self.config, self.node, self.graph, name, &qos)?;
        let subscription = self.node.create_subscription::<M>(&topic, Some(qos));
        let subscription = subscription.map_err(|error| RosError::dds("subscribing to a topic", &error))?;
        self.graph.add(subscription.guid(), &topic);
        let counter = ["wrench", "pose"].iter().position(|sample| name.ends_with(sample));
        let (shared, numbers) = (self.shared.clone(), LastNumbers::default());
        self.listeners.push(Box::new(Topic { name, subscription, shared, arrival, counter, numbers }));
        Ok(())
    }
}

fn writer<M: RosMessage>(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut DdsGraph,
    name: &'static str,
    qos: QosProfile,
) -> Result<Publisher<M>, RosError> {
    let topic = topic::<M>(config, node, graph, name, &qos)?;
    let publisher = node.create_publisher::<M>(&topic, Some(qos));
    let publisher = publisher.map_err(|error| RosError::dds("publishing a topic", &error))?;
    graph.add(publisher.guid(), &topic);
    Ok(publisher)
}

/// One of large messages. No more of them are on their way than it keeps: RustDDS keeps each until everybody has it, and who
/// listens slowly or is silent would see what was long ago, or lose some of many at once.
fn limited_writer<M: RosMessage>(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut DdsGraph,
    name: &'static str,
    profile: QosProfile,
    most: usize,
) -> Result<Publisher<M>, RosError> {
    let profile = keep(profile, most);
    let topic = topic::<M>(config, node, graph, name, &profile)?;
    // a profile of ROS has no such limit, a topic of DDS has
    let most = most as i32;
    let limits = ResourceLimits { max_samples: most, max_instances: 1, max_samples_per_instance: most };
    let qos = topic.qos().modify_by(&QosPolicyBuilder::new().resource_limits(limits).build());
    let participant = topic.participant().ok_or_else(|| RosError::dds("making a topic", &"the participant is gone"))?;
    let type_name = topic.get_type().name().to_owned();
    let limited = participant.create_topic(topic.name(), type_name, &qos, TopicKind::NoKey);
    let limited = limited.map_err(|error| RosError::dds("making a topic", &error))?;
    let publisher = node.create_publisher(&limited, Some(profile));
    let publisher = publisher.map_err(|error| RosError::dds("publishing a topic", &error))?;
    graph.add(publisher.guid(), &limited);
    Ok(publisher)
}

fn topic<M: RosMessage>(
    config: &NodeConfig,
    node: &Node,
    graph: &mut DdsGraph,
    name: &'static str,
    qos: &QosProfile,
) -> Result<ros2_client::dds::rustdds::Topic, RosError> {
    let whole = config.resolve(name)?;
    let topic = make_topic::<M>(node, &whole, qos)?;
    graph.name(&topic, whole);
    Ok(topic)
}

/// - `whole`: absolute, remapped.
pub(super) fn make_topic<M: RosMessage>(
    node: &Node,
    whole: &str,
    qos: &QosProfile,
) -> Result<ros2_client::dds::rustdds::Topic, RosError> {
    let mut parts = M::TYPE_NAME.split('/');
    let (package, type_name) = (parts.next().unwrap_or_default(), parts.next_back().unwrap_or_default());
    let topic = node.create_topic(&dds_name(whole)?, MessageTypeName::new(package, type_name), qos);
    topic.map_err(|error| RosError::dds("making a topic", &error))
}

/// The name as ros2-client has it.
pub(super) fn dds_name(whole: &str) -> Result<Name, RosError> {
    Name::parse(whole).map_err(|error| RosError::dds("naming a topic or service", &error))
}
