//! The topics of docs/ros.md, each with its quality of service.

use std::time::Instant;

use super::arguments::NodeConfig;
use super::exchange::{Exchange, RosError};
use super::messages::{
    Clock, DiagnosticArray, FeatureArray, HapticMismatch, Marker, MarkerArray, MeshPatch, Path, PointStamped,
    PoseStamped, ProbeResult, ProbeTouch, TFMessage, WrenchStamped,
};
use super::port::{Arrival, Publication};
use super::send_queue::Sent;

/// A topic and its quality of service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Topic {
    /// as in docs/ros.md
    pub name: &'static str,
    /// or best effort
    pub is_reliable: bool,
    /// transient local: who joins late gets what is kept
    pub is_latched: bool,
    /// messages that are kept
    pub depth: usize,
}

impl Topic {
    pub const fn best_effort(name: &'static str, depth: usize) -> Self {
        Self { name, is_reliable: false, is_latched: false, depth }
    }

    const fn reliable(name: &'static str, depth: usize) -> Self {
        Self { name, is_reliable: true, is_latched: false, depth }
    }

    const fn latched(name: &'static str, depth: usize) -> Self {
        Self { name, is_reliable: true, is_latched: true, depth }
    }
}

pub(super) const MESH: Topic = Topic::latched("mesh", 4096);
pub(super) const PROBE_TOUCHES: Topic = Topic::reliable("probe_touches", 4096);
pub(super) const MESH_PATCH: Topic = Topic::reliable("mesh_patch", 4096);
const FEATURES: Topic = Topic::latched("features", 1);
const FEATURE_MARKERS: Topic = Topic::latched("feature_markers", 1);
const TIP: Topic = Topic::reliable("tip", 1);
const PATH: Topic = Topic::latched("path", 1);
const PROBE_RESULTS: Topic = Topic::reliable("probe_results", 100);
const MISMATCH: Topic = Topic::best_effort("mismatch", 100);
const DIAGNOSTICS: Topic = Topic::reliable("/diagnostics", 10);

/// Samples are the last that may be lost: two tenths of a second at 10 kHz. What is kept is no matter of matching.
const SAMPLES: usize = 2048;

/// Sends messages of one topic.
pub(super) type Publisher<M> = Box<dyn Fn(M) -> Sent<M> + Send>;

/// A back end that publishes messages of one type.
pub(super) trait Publishes<M> {
    /// Announces the topic.
    fn publisher(&mut self, topic: Topic) -> Result<Publisher<M>, RosError>;
}

/// A back end that listens to messages of one type.
pub(super) trait Subscribes<M> {
    /// Listens: what comes goes to the inbox of the node.
    fn subscribe(&mut self, topic: Topic, arrival: fn(&Exchange, M) -> Arrival) -> Result<(), RosError>;
}

/// Announces the topics of what is small and urgent; what sends it, which waits for nobody.
pub(super) fn urgent<B>(back_end: &mut B) -> Result<Publisher<Publication>, RosError>
where
    B: Publishes<FeatureArray>
        + Publishes<MarkerArray>
        + Publishes<Path>
        + Publishes<ProbeResult>
        + Publishes<HapticMismatch>
        + Publishes<DiagnosticArray>,
{
    let (features, feature_markers) = (back_end.publisher(FEATURES)?, back_end.publisher(FEATURE_MARKERS)?);
    let (tip, path, probe_results) =
        (back_end.publisher(TIP)?, back_end.publisher(PATH)?, back_end.publisher(PROBE_RESULTS)?);
    let (mismatch, diagnostics) = (back_end.publisher(MISMATCH)?, back_end.publisher(DIAGNOSTICS)?);
    Ok(Box::new(move |publication| match publication {
        Publication::Features(message) => features(message).now(),
        Publication::FeatureMarkers(message) => feature_markers(message).now(),
        Publication::Tip(message) => tip(message).now(),
        Publication::Path(message) => path(message).now(),
        Publication::ProbeResult(message) => probe_results(*message).now(),
        Publication::Mismatch(message) => mismatch(message).now(),
        Publication::Diagnostics(message) => diagnostics(message).now(),
        // what may wait has a send queue of its own
        Publication::Tile(_) | Publication::MeshPatch(_) | Publication::ProbeTouch(_) => Sent::Done,
    }))
}

/// Announces the topics of what is large and may wait; what sends it, or gives back what a slow listener holds up.
pub(super) fn mesh<B>(back_end: &mut B) -> Result<Publisher<Publication>, RosError>
where
    B: Publishes<Marker> + Publishes<MeshPatch> + Publishes<ProbeTouch>,
{
    let (tiles, patches) = (back_end.publisher(MESH)?, back_end.publisher(MESH_PATCH)?);
    let probe_touches = back_end.publisher(PROBE_TOUCHES)?;
    Ok(Box::new(move |publication| match publication {
        Publication::Tile(message) => tiles(message).or_later(Publication::Tile),
        Publication::MeshPatch(message) => patches(message).or_later(Publication::MeshPatch),
        Publication::ProbeTouch(message) => {
            probe_touches(*message).or_later(|message| Publication::ProbeTouch(Box::new(message)))
        }
        // the others have a send queue of their own
        _ => Sent::Done,
    }))
}

/// Everything that is listened to.
pub(super) fn subscribe<B>(config: &NodeConfig, back_end: &mut B) -> Result<(), RosError>
where
    B: Subscribes<WrenchStamped>
        + Subscribes<PoseStamped>
        + Subscribes<TFMessage>
        + Subscribes<PointStamped>
        + Subscribes<Clock>,
{
    let [wrench, pose] = config.sample_topics();
    back_end.subscribe(Topic::best_effort(wrench, SAMPLES), |_, message| Arrival::Wrench(message, Instant::now()))?;
    back_end.subscribe(Topic::best_effort(pose, SAMPLES), |_, message| Arrival::Pose(message, Instant::now()))?;
    back_end.subscribe(Topic::best_effort("/tf", SAMPLES), |_, message| Arrival::Tf(message))?;
    back_end.subscribe(Topic::latched("/tf_static", 100), |_, message| Arrival::TfStatic(message))?;
    back_end.subscribe(Topic::reliable("/clicked_point", 10), |_, message| Arrival::ClickedPoint(message))?;
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
        let here = published.map(|Topic { name, is_reliable, is_latched, depth }| {
            let reliability = if is_reliable { "reliable" } else { "best effort" };
            let durability = if is_latched { "transient local" } else { "volatile" };
            [name.to_owned(), reliability.to_owned(), durability.to_owned(), depth.to_string()]
        });
        assert_eq!(here.to_vec(), documented.collect::<Vec<_>>());
    }
}
