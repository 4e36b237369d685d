//! The topics of docs/ros.md, each with its quality of service.

use std::sync::Arc;
use std::time::Instant;

use r2r::qos::QosProfile;
use r2r::{
    Node, Publisher, WrappedTypesupport, diagnostic_msgs, geometry_msgs, nav_msgs, rosgraph_msgs, tf2_msgs,
    visualization_msgs,
};

use super::convert::Convert;
use super::graph::R2rGraph;
use super::{During, PollSource, R2rShared, RosError, source, touchup_msgs};
use crate::ros::arguments::NodeConfig;
use crate::ros::messages::{Clock, PointStamped, PoseStamped, RosMessage, TFMessage, WrenchStamped};
use crate::ros::port::{Arrival, Publication};
use crate::ros::send_queue::Sent;

/// What is small and urgent.
pub(super) struct UrgentPublishers {
    features: Publisher<touchup_msgs::msg::FeatureArray>,
    feature_markers: Publisher<visualization_msgs::msg::MarkerArray>,
    tip: Publisher<visualization_msgs::msg::MarkerArray>,
    path: Publisher<nav_msgs::msg::Path>,
    probe_results: Publisher<touchup_msgs::msg::ProbeResult>,
    mismatch: Publisher<touchup_msgs::msg::HapticMismatch>,
    diagnostics: Publisher<diagnostic_msgs::msg::DiagnosticArray>,
}

/// What is large and may wait.
pub(super) struct MeshPublishers {
    tiles: Publisher<visualization_msgs::msg::Marker>,
    patches: Publisher<touchup_msgs::msg::MeshPatch>,
    probe_touches: Publisher<touchup_msgs::msg::ProbeTouch>,
}

const fn reliable(depth: usize) -> QosProfile {
    QosProfile::default().reliable().keep_last(depth)
}

const fn latched(depth: usize) -> QosProfile {
    reliable(depth).transient_local()
}

pub(super) const fn best_effort(depth: usize) -> QosProfile {
    QosProfile::sensor_data().keep_last(depth)
}

const MESH: (&str, QosProfile) = ("mesh", latched(4096));
const MESH_PATCH: (&str, QosProfile) = ("mesh_patch", reliable(4096));
const FEATURES: (&str, QosProfile) = ("features", latched(1));
const FEATURE_MARKERS: (&str, QosProfile) = ("feature_markers", latched(1));
const TIP: (&str, QosProfile) = ("tip", reliable(1));
const PATH: (&str, QosProfile) = ("path", latched(1));
const PROBE_RESULTS: (&str, QosProfile) = ("probe_results", reliable(100));
const PROBE_TOUCHES: (&str, QosProfile) = ("probe_touches", reliable(4096));
const MISMATCH: (&str, QosProfile) = ("mismatch", best_effort(100));
const DIAGNOSTICS: (&str, QosProfile) = ("/diagnostics", reliable(10));

/// Samples are the last that may be lost: two tenths of a second at 10 kHz. What is kept is no matter of matching.
const SAMPLES: usize = 2048;

impl MeshPublishers {
    pub fn new(config: &NodeConfig, node: &mut Node, graph: &mut R2rGraph) -> Result<Self, RosError> {
        let mut made = R2rTopics { config, node, graph };
        Ok(Self {
            tiles: made.publisher(MESH)?,
            patches: made.publisher(MESH_PATCH)?,
            probe_touches: made.publisher(PROBE_TOUCHES)?,
        })
    }

    pub fn send(&self, publication: Publication) -> Sent {
        sent(match publication {
            Publication::Tile(message) => self.tiles.publish(&message.convert()),
            Publication::MeshPatch(message) => self.patches.publish(&message.convert()),
            Publication::ProbeTouch(message) => self.probe_touches.publish(&message.convert()),
            // the others have an outbox of their own
            _ => Ok(()),
        })
    }
}

impl UrgentPublishers {
    pub fn new(config: &NodeConfig, node: &mut Node, graph: &mut R2rGraph) -> Result<Self, RosError> {
        let mut made = R2rTopics { config, node, graph };
        Ok(Self {
            features: made.publisher(FEATURES)?,
            feature_markers: made.publisher(FEATURE_MARKERS)?,
            tip: made.publisher(TIP)?,
            path: made.publisher(PATH)?,
            probe_results: made.publisher(PROBE_RESULTS)?,
            mismatch: made.publisher(MISMATCH)?,
            diagnostics: made.publisher(DIAGNOSTICS)?,
        })
    }

    pub fn send(&self, publication: Publication) -> Sent {
        sent(match publication {
            Publication::Features(message) => self.features.publish(&message.convert()),
            Publication::FeatureMarkers(message) => self.feature_markers.publish(&message.convert()),
            Publication::Tip(message) => self.tip.publish(&message.convert()),
            Publication::Path(message) => self.path.publish(&message.convert()),
            Publication::ProbeResult(message) => self.probe_results.publish(&message.convert()),
            Publication::Mismatch(message) => self.mismatch.publish(&message.convert()),
            Publication::Diagnostics(message) => self.diagnostics.publish(&message.convert()),
            // what may wait has an outbox of its own
            Publication::Tile(_) | Publication::MeshPatch(_) | Publication::ProbeTouch(_) => Ok(()),
        })
    }
}

fn sent(result: r2r::Result<()>) -> Sent {
    match result {
        Ok(()) => Sent::Done,
        Err(error) => {
            tracing::warn!(%error, "a message is not sent");
            Sent::Refused
        }
    }
}

/// Everything that is listened to.
pub(super) fn subscriptions(
    config: &NodeConfig,
    node: &mut Node,
    graph: &mut R2rGraph,
    shared: &Arc<R2rShared>,
) -> Result<Vec<PollSource>, RosError> {
    use geometry_msgs::msg as geometry;
    use tf2_msgs::msg as tf2;
    let [wrench, pose] = config.sample_topics();
    let samples = best_effort(SAMPLES);
    let mut made = R2rTopics { config, node, graph };
    let mut sources = vec![
        made.source::<geometry::WrenchStamped, WrenchStamped>(wrench, samples.clone(), shared, |_, message| {
            Arrival::Wrench(message, Instant::now())
        })?,
        made.source::<geometry::PoseStamped, PoseStamped>(pose, samples.clone(), shared, |_, message| {
            Arrival::Pose(message, Instant::now())
        })?,
        made.source::<tf2::TFMessage, TFMessage>("/tf", samples, shared, |_, m| Arrival::Tf(m))?,
        made.source::<tf2::TFMessage, TFMessage>("/tf_static", latched(100), shared, |_, m| Arrival::TfStatic(m))?,
        made.source::<geometry::PointStamped, PointStamped>("/clicked_point", reliable(10), shared, |_, message| {
            Arrival::ClickedPoint(message)
        })?,
    ];
    if config.parameters.bool("use_sim_time") {
        let set = |shared: &R2rShared, now: Clock| {
            shared.clock.set(now.clock);
            Arrival::Clock(now)
        };
        sources.push(made.source::<rosgraph_msgs::msg::Clock, _>("/clock", best_effort(1), shared, set)?);
    }
    Ok(sources)
}

struct R2rTopics<'a> {
    config: &'a NodeConfig,
    node: &'a mut Node,
    graph: &'a mut R2rGraph,
}

impl R2rTopics<'_> {
    fn publisher<T>(&mut self, (name, qos): (&str, QosProfile)) -> Result<Publisher<T>, RosError>
    where
        T: WrappedTypesupport + 'static,
    {
        let publisher = self.node.create_publisher::<T>(name, qos).during("publishing a topic")?;
        self.graph.watch_listeners(self.config.resolve(name)?, name == MESH.0, publisher.clone());
        Ok(publisher)
    }

    fn source<T, M>(
        &mut self,
        name: &str,
        qos: QosProfile,
        shared: &Arc<R2rShared>,
        arrival: fn(&R2rShared, M) -> Arrival,
    ) -> Result<PollSource, RosError>
    where
        T: WrappedTypesupport + Convert<M> + Send + 'static,
        M: RosMessage,
    {
        let messages = self.node.subscribe::<T>(name, qos.clone()).during("subscribing to a topic")?;
        self.graph.watch_senders(self.config.resolve(name)?, M::TYPE_NAME, qos);
        let shared = shared.clone();
        Ok(source(messages, move |message| shared.arrivals.put(arrival(&shared, message.convert()))))
    }
}

#[cfg(test)]
mod tests {
    use r2r::qos::{DurabilityPolicy, HistoryPolicy, ReliabilityPolicy};

    use super::*;

    #[test]
    fn the_quality_of_service_is_that_of_the_documentation() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/ros.md")).unwrap();
        let (_, table) = text.split_once("| topic | type | reliability |").unwrap();
        let documented = table.lines().skip(2).take_while(|line| line.starts_with('|')).map(|line| {
            let cells: Vec<_> =
                line.trim_matches('|').split('|').map(|cell| cell.replace('`', "").trim().into()).collect();
            let [name, _, reliability, durability, depth, _]: [String; 6] = cells.try_into().unwrap();
            [name, reliability, durability, depth]
        });
        let published = [
            MESH,
            MESH_PATCH,
            FEATURES,
            FEATURE_MARKERS,
            TIP,
            PATH,
            PROBE_RESULTS,
            PROBE_TOUCHES,
            MISMATCH,
            DIAGNOSTICS,
        ];
        let here = published.map(|(name, qos)| {
            assert_eq!(qos.history, HistoryPolicy::KeepLast, "{name}");
            let reliability = match qos.reliability {
                ReliabilityPolicy::Reliable => "reliable",
                ReliabilityPolicy::BestEffort => "best effort",
                other => panic!("{name}: {other:?}"),
            };
            let durability = match qos.durability {
                DurabilityPolicy::TransientLocal => "transient local",
                DurabilityPolicy::Volatile => "volatile",
                other => panic!("{name}: {other:?}"),
            };
            [name.to_owned(), reliability.to_owned(), durability.to_owned(), qos.depth.to_string()]
        });
        assert_eq!(here.to_vec(), documented.collect::<Vec<_>>());
    }
}
