//! The topics of docs/ros.md, each with its quality of service.

use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::messages::{
    Clock, DiagnosticArray, FeatureArray, HapticMismatch, Marker, MarkerArray, MeshPatch, Path,
    PointStamped, ProbeResult, ProbeTouch, TFMessage,
};
use crate::ros::port::{Arrival, MESH_PATCH_TOPIC, Publication};
use crate::ros::sample_source::SampleSource;
use crate::ros::send_queue::SendOutcome;
use touchup_io::recording::SampleKind;

/// A topic and its quality of service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Topic {
    /// name in docs/ros.md
    pub name: &'static str,
    /// reliable, else best effort
    pub is_reliable: bool,
    /// transient local: late joiners get the kept messages
    pub is_latched: bool,
    /// number of kept messages
    pub depth: usize,
}

impl Topic {
    pub const fn best_effort(name: &'static str, depth: usize) -> Self {
        Self {
            name,
            is_reliable: false,
            is_latched: false,
            depth,
        }
    }

    const fn reliable(name: &'static str, depth: usize) -> Self {
        Self {
            name,
            is_reliable: true,
            is_latched: false,
            depth,
        }
    }

    const fn latched(name: &'static str, depth: usize) -> Self {
        Self {
            name,
            is_reliable: true,
            is_latched: true,
            depth,
        }
    }
}

pub(super) const MESH: Topic = Topic::latched("mesh", 4096);
pub(super) const PROBE_TOUCHES: Topic = Topic::reliable("probe_touches", 4096);
pub(super) const MESH_PATCH: Topic = Topic::reliable(MESH_PATCH_TOPIC, 4096);

/// Depth for samples, the last messages to lose: two tenths of a second at 10 kHz. Depth does not
/// affect matching.
const SAMPLES: usize = 2048;

/// Sends messages of one topic.
pub(super) type Publisher<M> = Box<dyn Fn(M) -> SendOutcome<M> + Send>;

/// A back end that publishes messages of one type.
pub(super) trait Publishes<M> {
    /// Announces the topic.
    fn publisher(&mut self, topic: Topic) -> Result<Publisher<M>, RosError>;
}

/// A back end that subscribes to messages of one type.
pub(super) trait Subscribes<M> {
    /// Subscribes: messages go to the inbox of the node.
    fn subscribe(
        &mut self,
        topic: Topic,
        arrival: fn(&PortState, M) -> Arrival,
    ) -> Result<(), RosError>;
}

/// A back end that subscribes to poses and wrenches of any suitable type.
pub(super) trait SubscribesSamples {
    /// Subscribes: messages go to the inbox of the node.
    fn subscribe_samples(&mut self, topic: Topic, source: SampleSource) -> Result<(), RosError>;
}

/// Announces topics; the result sends their messages, or returns those delayed by slow listeners.
macro_rules! publishers {
    ($(#[$doc:meta])* fn $announce:ident; $($send:ident: $publication:ident($message:ident) on $topic:expr;)+) => {
        $(#[$doc])*
        pub(super) fn $announce<B>(back_end: &mut B) -> Result<Publisher<Publication>, RosError>
        where
            $(B: Publishes<$message>,)+
        {
            $(let $send = Publishes::<$message>::publisher(back_end, $topic)?;)+
            Ok(Box::new(move |publication| match publication {
                $(Publication::$publication(message) => $send(message).map(Publication::$publication),)+
                // others have a send queue of their own
                _ => SendOutcome::Done,
            }))
        }
    };
}

publishers! {
    /// Small and urgent publications, which wait for nobody.
    fn urgent;
    features: Features(FeatureArray) on Topic::latched("features", 1);
    feature_markers: FeatureMarkers(MarkerArray) on Topic::latched("feature_markers", 1);
    tip: Tip(MarkerArray) on Topic::reliable("tip", 1);
    path: Path(Path) on Topic::latched("path", 1);
    probe_results: ProbeResult(ProbeResult) on Topic::reliable("probe_results", 100);
    mismatch: Mismatch(HapticMismatch) on Topic::best_effort("mismatch", 100);
    diagnostics: Diagnostics(DiagnosticArray) on Topic::reliable("/diagnostics", 10);
}

publishers! {
    /// Large publications, which may wait.
    fn mesh;
    tiles: Tile(Marker) on MESH;
    patches: MeshPatch(MeshPatch) on MESH_PATCH;
    probe_touches: ProbeTouch(ProbeTouch) on PROBE_TOUCHES;
}

/// Makes all subscriptions.
pub(super) fn subscribe<B>(config: &NodeConfig, back_end: &mut B) -> Result<(), RosError>
where
    B: SubscribesSamples + Subscribes<TFMessage> + Subscribes<PointStamped> + Subscribes<Clock>,
{
    let [wrench, pose] = config.sample_topics();
    // an arm passes its samples within the process
    let has_arm = config.parameters.has_arm();
    let topics = (!has_arm).then_some([(wrench, SampleKind::Wrench), (pose, SampleKind::Pose)]);
    for (topic, kind) in topics.into_iter().flatten() {
        let remedy = "name a type that can be read, or none";
        let refused = |reason| RosError::Refused {
            call: "subscribing to a topic",
            reason,
            remedy,
        };
        if let Some(source) = SampleSource::of(config, kind).map_err(refused)? {
            back_end.subscribe_samples(Topic::best_effort(topic, SAMPLES), source)?;
        }
    }
    back_end.subscribe(Topic::best_effort("/tf", SAMPLES), |_, message| {
        Arrival::Tf(message)
    })?;
    back_end.subscribe(Topic::latched("/tf_static", 100), |_, message| {
        Arrival::TfStatic(message)
    })?;
    back_end.subscribe(Topic::reliable("/clicked_point", 10), |_, message| {
        Arrival::ClickedPoint(message)
    })?;
    if config.parameters.bool("use_sim_time") {
        back_end.subscribe(Topic::best_effort("/clock", 1), |exchange, now: Clock| {
            exchange.clock.set(now.clock);
            Arrival::Clock(now)
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Announced(Vec<Topic>);

    impl<M> Subscribes<M> for Announced {
        fn subscribe(
            &mut self,
            topic: Topic,
            _: fn(&PortState, M) -> Arrival,
        ) -> Result<(), RosError> {
            self.0.push(topic);
            Ok(())
        }
    }

    impl SubscribesSamples for Announced {
        fn subscribe_samples(&mut self, topic: Topic, _: SampleSource) -> Result<(), RosError> {
            self.0.push(topic);
            Ok(())
        }
    }

    #[test]
    fn a_node_with_an_arm_hears_no_other_samples() {
        let heard = |parameters: &[&str]| {
            let words = parameters
                .iter()
                .flat_map(|one| ["-p", one].map(str::to_owned));
            let config = NodeConfig::new(&words.collect::<Vec<_>>(), |_| None).unwrap();
            let mut subscribed = Announced::default();
            subscribe(&config, &mut subscribed).unwrap();
            let topics = subscribed.0.into_iter().map(|topic| topic.name);
            let named = config.heard_topics();
            (topics.collect::<Vec<_>>(), named)
        };
        let others = ["/tf", "/tf_static", "/clicked_point"];
        let samples = vec!["probe/wrench", "probe/pose"];
        let all = [&samples[..], &others].concat();
        assert_eq!(heard(&["source:=probe"]), (all, samples));
        let probing = ["source:=probe", "robot:=sim"];
        assert_eq!(heard(&probing), (others.into(), vec![]));
        let by_tf = ["source:=probe", "robot:=sim", "pose_frame:=tool0"];
        assert_eq!(heard(&by_tf), (others.into(), vec!["/tf"]));
    }

    impl<M> Publishes<M> for Announced {
        fn publisher(&mut self, topic: Topic) -> Result<Publisher<M>, RosError> {
            self.0.push(topic);
            Ok(Box::new(|_| SendOutcome::Done))
        }
    }

    #[test]
    fn the_quality_of_service_is_that_of_the_documentation() {
        let text =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/ros.md"))
                .unwrap();
        let (_, table) = text.split_once("| topic | type | reliability |").unwrap();
        let mut documented: Vec<_> = table
            .lines()
            .skip(2)
            .take_while(|line| line.starts_with('|'))
            .map(|line| {
                let cells: Vec<_> = line
                    .trim_matches('|')
                    .split('|')
                    .map(|cell| cell.replace('`', "").trim().into())
                    .collect();
                let [name, _, reliability, durability, depth, _]: [String; 6] =
                    cells.try_into().unwrap();
                [name, reliability, durability, depth]
            })
            .collect();
        let mut published = Announced::default();
        drop(urgent(&mut published).and(mesh(&mut published)).unwrap());
        let mut here: Vec<_> = published
            .0
            .into_iter()
            .map(
                |Topic {
                     name,
                     is_reliable,
                     is_latched,
                     depth,
                 }| {
                    let reliability = if is_reliable {
                        "reliable"
                    } else {
                        "best effort"
                    };
                    let durability = if is_latched {
                        "transient local"
                    } else {
                        "volatile"
                    };
                    [
                        name.to_owned(),
                        reliability.to_owned(),
                        durability.to_owned(),
                        depth.to_string(),
                    ]
                },
            )
            .collect();
        here.sort();
        documented.sort();
        assert_eq!(here, documented);
    }
}
