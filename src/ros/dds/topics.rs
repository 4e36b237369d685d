//! The topics of docs/ros.md, each with its quality of service.

use std::sync::Arc;

use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Name, Node, Publisher};

use super::graph::Graph;
use super::incoming::{Listener, Topic};
use super::{RosError, Shared};
use crate::ros::arguments::NodeConfig;
use crate::ros::clock::steady_ns;
use crate::ros::messages::{
    Clock, DiagnosticArray, FeatureArray, HapticMismatch, Marker, MarkerArray, MeshPatch, Message, Path, PointStamped,
    PoseStamped, TFMessage, WrenchStamped,
};
use crate::ros::port::Arrival;

/// What is small and urgent.
pub(super) struct UrgentWriters {
    pub features: Publisher<FeatureArray>,
    pub feature_markers: Publisher<MarkerArray>,
    pub tip: Publisher<MarkerArray>,
    pub path: Publisher<Path>,
    pub mismatch: Publisher<HapticMismatch>,
    pub diagnostics: Publisher<DiagnosticArray>,
}

/// What is large and may wait.
pub(super) struct MeshWriters {
    pub tiles: Publisher<Marker>,
    pub patches: Publisher<MeshPatch>,
}

const BEST_EFFORT: QosProfile = QosProfile::subscription_default();
/// The thread that sends what is urgent is not held up by who does not listen for longer than this.
const URGENT: QosProfile = BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(10)));
/// The mesh waits for who listens slowly, then tries again.
const PATIENT: QosProfile = BEST_EFFORT.reliability_reliable(WhenFull::Wait(std::time::Duration::from_millis(100)));

const fn keep(profile: QosProfile, depth: usize) -> QosProfile {
    profile.history(History::KeepLast { depth })
}

const fn latched(profile: QosProfile) -> QosProfile {
    profile.durability(Durability::TransientLocal)
}

/// Samples are the last that may be lost: two tenths of a second at 10 kHz. What is kept is no matter of matching.
const SAMPLES: usize = 2048;

/// The writers of all topics that go out.
pub(super) fn writers(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut Graph,
) -> Result<(UrgentWriters, MeshWriters), RosError> {
    let mesh = MeshWriters {
        tiles: writer(config, node, graph, "mesh", latched(keep(PATIENT, 4096)))?,
        patches: writer(config, node, graph, "mesh_patch", keep(PATIENT, 4096))?,
    };
    let urgent = UrgentWriters {
        features: writer(config, node, graph, "features", latched(keep(URGENT, 1)))?,
        feature_markers: writer(config, node, graph, "feature_markers", latched(keep(URGENT, 1)))?,
        tip: writer(config, node, graph, "tip", keep(URGENT, 1))?,
        path: writer(config, node, graph, "path", latched(keep(URGENT, 1)))?,
        mismatch: writer(config, node, graph, "mismatch", keep(BEST_EFFORT, 100))?,
        diagnostics: writer(config, node, graph, "/diagnostics", keep(URGENT, 10))?,
    };
    Ok((urgent, mesh))
}

/// Everything that is listened to.
pub(super) fn readers(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut Graph,
    shared: &Arc<Shared>,
) -> Result<Vec<Box<dyn Listener>>, RosError> {
    let is_probe = config.parameters.string("source") == "probe";
    let [wrench, pose] = if is_probe { ["probe/wrench", "probe/pose"] } else { ["stylus/wrench", "stylus/pose"] };
    let mut made = Readers { config, node, graph, shared, listeners: Vec::new() };
    made.add::<WrenchStamped>(wrench, keep(BEST_EFFORT, SAMPLES), |_, m| Some(Arrival::Wrench(m, steady_ns())))?;
    made.add::<PoseStamped>(pose, keep(BEST_EFFORT, SAMPLES), |_, m| Some(Arrival::Pose(m, steady_ns())))?;
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
    graph: &'a mut Graph,
    shared: &'a Arc<Shared>,
    listeners: Vec<Box<dyn Listener>>,
}

impl Readers<'_> {
    fn add<M: Message>(
        &mut self,
        name: &'static str,
        qos: QosProfile,
        arrival: fn(&Shared, M) -> Option<Arrival>,
    ) -> Result<(), RosError> {
        let topic = topic::<M>(self.config, self.node, self.graph, name, &qos)?;
        let subscription = self.node.create_subscription::<M>(&topic, Some(qos));
        let subscription = subscription.map_err(|error| RosError::dds("subscribing to a topic", &error))?;
        self.graph.add(subscription.guid(), &topic);
        self.listeners.push(Box::new(Topic { name, subscription, shared: self.shared.clone(), arrival }));
        Ok(())
    }
}

fn writer<M: Message>(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut Graph,
    name: &'static str,
    qos: QosProfile,
) -> Result<Publisher<M>, RosError> {
    let topic = topic::<M>(config, node, graph, name, &qos)?;
    let publisher = node.create_publisher::<M>(&topic, Some(qos));
    let publisher = publisher.map_err(|error| RosError::dds("publishing a topic", &error))?;
    graph.add(publisher.guid(), &topic);
    Ok(publisher)
}

fn topic<M: Message>(
    config: &NodeConfig,
    node: &Node,
    graph: &mut Graph,
    name: &'static str,
    qos: &QosProfile,
) -> Result<ros2_client::dds::rustdds::Topic, RosError> {
    let whole = config.resolve(name)?;
    let mut parts = M::TYPE_NAME.split('/');
    let (package, type_name) = (parts.next().unwrap_or_default(), parts.next_back().unwrap_or_default());
    let topic = node.create_topic(&dds_name(&whole)?, MessageTypeName::new(package, type_name), qos);
    let topic = topic.map_err(|error| RosError::dds("making a topic", &error))?;
    graph.name(&topic, whole);
    Ok(topic)
}

/// The name as ros2-client has it.
pub(super) fn dds_name(whole: &str) -> Result<Name, RosError> {
    Name::parse(whole).map_err(|error| RosError::dds("naming a topic or service", &error))
}
