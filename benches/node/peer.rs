//! The other processes of the bench over DDS: one plays the sensors and takes the answers, one
//! plays the viewer.

use std::collections::{BTreeMap, HashMap};
use std::io::{Read, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ros2_client::dds::rustdds::mio1::{Events, Interest, Poll, Token};
use ros2_client::dds::rustdds::{
    DomainParticipantBuilder, DomainParticipantStatusEvent, StatusEvented,
};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, Subscription,
};
use touchup::live::Latencies;
use touchup::ros::clock::stamp_ns;
use touchup::ros::messages::{
    DiagnosticArray, HapticMismatch, Marker, MeshPatch, Point, PoseStamped, RosMessage,
    WrenchStamped,
};
use touchup::sim::wavy::{STEP_NS, slide};

use crate::course::{Answers, Drawn, SecondDrawn, Times};
use crate::{WIDTH, messages, shown};

/// ns
const SECOND_NS: i64 = 1_000_000_000;
/// Silence after the last tile that marks the tiles as complete.
const QUIET: Duration = Duration::from_secs(1);
/// Time limit for discovery of the other end.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time limit for the answers after the last sample.
const REST: Duration = Duration::from_secs(2);

const SAMPLES: QosProfile =
    QosProfile::subscription_default().history(History::KeepLast { depth: 2048 });
const MESH: QosProfile = QosProfile::subscription_default()
    .history(History::KeepLast { depth: 4096 })
    .reliability_reliable(WhenFull::Wait(Duration::from_millis(100)))
    .durability(Durability::TransientLocal);

const CHANGES: QosProfile =
    SAMPLES.reliability_reliable(WhenFull::Wait(Duration::from_millis(100)));

/// Time of all processes, ns since 1970.
pub fn wall_ns() -> i64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos() as i64)
}

fn joined(domain: u16, name: &str) -> (Context, Node) {
    let participant =
        DomainParticipantBuilder::new(domain).with_only_networks([std::net::Ipv4Addr::LOCALHOST]);
    let participant = participant.build().expect("the loopback interface is up");
    let context = Context::from_domain_participant(participant).expect("a participant has a graph");
    let name = NodeName::new("/", name).expect("it is a name");
    let node = context
        .new_node(name, NodeOptions::new())
        .expect("a context makes nodes");
    (context, node)
}

fn topic<M: RosMessage>(
    node: &Node,
    name: &str,
    qos: &QosProfile,
) -> ros2_client::dds::rustdds::Topic {
    let mut parts = M::TYPE_NAME.split('/');
    let (package, kind) = (
        parts.next().unwrap_or_default(),
        parts.next_back().unwrap_or_default(),
    );
    let name = Name::parse(name).expect("it is a name");
    node.create_topic(&name, MessageTypeName::new(package, kind), qos)
        .expect("a node makes topics")
}

fn reader<M: RosMessage>(node: &mut Node, name: &str, qos: QosProfile) -> Subscription<M> {
    let topic = topic::<M>(node, name, &qos);
    node.create_subscription(&topic, Some(qos))
        .expect("a node subscribes")
}

fn writer<M: RosMessage>(node: &mut Node, name: &str) -> Publisher<M> {
    let topic = topic::<M>(node, name, &SAMPLES);
    node.create_publisher(&topic, Some(SAMPLES))
        .expect("a node publishes")
}

/// Returns when all of `wanted` readers and writers have a match at the other end.
fn wait_for_matches(context: &Context, wanted: usize) {
    let events = context.domain_participant().status_listener();
    let (begun, mut matched) = (Instant::now(), 0);
    while matched < wanted {
        match events.try_recv_status() {
            Some(
                DomainParticipantStatusEvent::RemoteReaderMatched { .. }
                | DomainParticipantStatusEvent::RemoteWriterMatched { .. },
            ) => matched += 1,
            Some(_) => {}
            None => sleep(Duration::from_millis(10)),
        }
        assert!(
            begun.elapsed() < PATIENCE,
            "the other end was not discovered"
        );
    }
    // the other end learns of it a little later
    sleep(QUIET);
}

/// Place of a vertex in a mesh change: x y z in single precision, as bits.
type VertexBits = [u32; 3];

fn place(point: &Point) -> VertexBits {
    [point.x, point.y, point.z].map(|coordinate| (coordinate as f32).to_bits())
}

/// The mesh as a viewer has it.
#[derive(Default)]
struct Tiles {
    /// corners of the displayed triangles, by tile
    seen: BTreeMap<i32, Vec<VertexBits>>,
    changed: Option<Instant>,
    received: u64,
}

impl Tiles {
    /// Returns which came.
    fn take(&mut self, mesh: &mut Subscription<Marker>) -> Vec<i32> {
        let mut came = Vec::new();
        while let Ok(Some((tile, _))) = mesh.take() {
            (self.changed, self.received) = (Some(Instant::now()), self.received + 1);
            if tile.action == Marker::DELETE {
                self.seen.remove(&tile.id);
            } else {
                self.seen
                    .insert(tile.id, tile.points.iter().map(place).collect());
                came.push(tile.id);
            }
        }
        came
    }

    fn is_quiet(&self) -> bool {
        self.changed
            .is_some_and(|changed| changed.elapsed() >= QUIET)
    }
}

/// Joins; prints the number of tiles of the mesh and the time until the last.
pub fn join_late(domain: u16) {
    let begun = Instant::now();
    let (_context, mut node) = joined(domain, "late");
    let mut mesh = reader::<Marker>(&mut node, "/mesh", MESH);
    let mut tiles = Tiles::default();
    while !tiles.is_quiet() && begun.elapsed() < PATIENCE {
        tiles.take(&mut mesh);
        sleep(Duration::from_millis(1));
    }
    let took = tiles
        .changed
        .map_or(f64::NAN, |changed| (changed - begun).as_secs_f64());
    println!(
        "a late joiner has {} tiles after {took:.1} s",
        tiles.seen.len()
    );
}

/// State of the viewer.
#[derive(Default)]
struct Viewer {
    /// when a vertex was first drawn here, ns since 1970
    drawn: HashMap<VertexBits, i64>,
    /// vertices reported at a place and not yet drawn there
    pending: HashMap<VertexBits, u32>,
    /// of each of these vertices the stamps of the samples that moved it, ns, and its new place, in
    /// their order
    moves: HashMap<u32, Vec<(i64, VertexBits)>>,
    visible: Latencies,
    /// the same by the second of the stamp
    seconds: BTreeMap<i64, Latencies>,
    /// diagnostics of the node by the second: age of the patch, renewals, and late renewals
    shown: BTreeMap<i64, (Times, [u64; 2])>,
}

impl Viewer {
    /// Notes moved vertices; an earlier tile may show the new position.
    fn note(&mut self, patch: &MeshPatch) {
        let moved_ns = stamp_ns(patch.header.stamp);
        for (&vertex, position) in patch.vertices.iter().zip(patch.positions.chunks_exact(3)) {
            let place = [0, 1, 2].map(|axis| position[axis].to_bits());
            match self.drawn.get(&place) {
                // it returned to its earlier place: the display does not show when
                Some(&at_ns) if at_ns < moved_ns => self.forget(vertex),
                Some(&at_ns) => self.record(moved_ns, at_ns),
                None => {
                    self.pending.insert(place, vertex);
                    self.moves
                        .entry(vertex)
                        .or_default()
                        .push((moved_ns, place));
                }
            }
        }
        patch
            .removed_vertices
            .iter()
            .for_each(|&vertex| self.forget(vertex));
    }

    fn forget(&mut self, vertex: u32) {
        for (_, place) in self.moves.remove(&vertex).unwrap_or_default() {
            self.pending.remove(&place);
        }
    }

    /// A drawn place of a vertex answers for its earlier places too.
    fn look(&mut self, corners: &[VertexBits], at_ns: i64) {
        for &place in corners {
            self.drawn.entry(place).or_insert(at_ns);
            let Some(vertex) = self.pending.remove(&place) else {
                continue;
            };
            let moves = self.moves.remove(&vertex).unwrap_or_default();
            let until = moves
                .iter()
                .rposition(|&(_, to)| to == place)
                .map_or(0, |last| last + 1);
            let (shown, open) = moves.split_at(until);
            for &(moved_ns, to) in shown {
                self.pending.remove(&to);
                self.record(moved_ns, at_ns);
            }
            if !open.is_empty() {
                self.moves.insert(vertex, open.to_vec());
            }
        }
    }

    fn record(&mut self, moved_ns: i64, at_ns: i64) {
        let took = Duration::from_nanos((at_ns - moved_ns).max(0) as u64);
        self.visible.record(took);
        self.seconds
            .entry(moved_ns / SECOND_NS)
            .or_default()
            .record(took);
    }

    /// Notes the node's diagnostics of the second that ends.
    fn note_diagnostics(&mut self, message: &DiagnosticArray) {
        let values = message.status.iter().flat_map(|status| &status.values);
        let values: HashMap<&str, f64> = values
            .filter_map(|pair| Some((pair.key.as_str(), pair.value.parse().ok()?)))
            .collect();
        let number = |name: &str| values.get(name).copied();
        let shown = || {
            let [median, p99, longest] =
                ["p50", "p99", "max"].map(|which| number(&format!("patch_behind_{which}_ms")));
            let times = Times {
                median: median?,
                p99: p99?,
                longest: longest?,
            };
            Some((
                times,
                [number("renewals")? as u64, number("late_renewals")? as u64],
            ))
        };
        // before the first touch the patch is empty
        if let Some(shown) = shown().filter(|(times, _)| times.longest > 0.0) {
            self.shown.insert(wall_ns() / SECOND_NS, shown);
        }
    }

    /// Observations by the second.
    fn seen(&self) -> Drawn {
        let at = |second: &i64| SecondDrawn {
            drawn: self.seconds.get(second).and_then(Times::of),
            shown: self.shown.get(second).copied(),
        };
        let seconds = self.seconds.keys().chain(self.shown.keys());
        Drawn {
            seconds: seconds.map(|second| (*second, at(second))).collect(),
        }
    }
}

/// Looks at the mesh until stdin ends; the first line on stdout says that all of it is here.
pub fn view(domain: u16) -> Drawn {
    let (context, mut node) = joined(domain, "viewer");
    let mut mesh = reader::<Marker>(&mut node, "/mesh", MESH);
    let changes = reader::<MeshPatch>(&mut node, "/mesh_patch", CHANGES);
    let diagnostics = reader::<DiagnosticArray>(&mut node, "/diagnostics", CHANGES);
    let (begun, mut tiles) = (Instant::now(), Tiles::default());
    wait_for_matches(&context, 3);
    while !tiles.is_quiet() && begun.elapsed() < PATIENCE {
        tiles.take(&mut mesh);
        sleep(Duration::from_millis(1));
    }
    let took = tiles
        .changed
        .map_or(f64::NAN, |changed| (changed - begun).as_secs_f64());
    let drawn = tiles
        .seen
        .values()
        .flatten()
        .map(|&place| (place, 0))
        .collect();
    let mut seen = Viewer {
        drawn,
        ..Viewer::default()
    };
    println!(
        "the viewer has {} tiles after {took:.1} s",
        tiles.seen.len()
    );
    let has_ended = Arc::new(AtomicBool::new(false));
    spawn({
        let has_ended = Arc::clone(&has_ended);
        move || {
            // nothing is ever written to it
            let _ = stdin().read(&mut [0]);
            has_ended.store(true, Ordering::Relaxed);
        }
    });
    let mut poll = Poll::new().expect("the system polls");
    poll.registry()
        .register(&mut mesh, Token(0), Interest::READABLE)
        .expect("it can be polled");
    let mut events = Events::with_capacity(8);
    while !has_ended.load(Ordering::Relaxed) {
        // an interrupted wait is one that is over
        let _ = poll.poll(&mut events, Some(Duration::from_millis(100)));
        while let Ok(Some((patch, _))) = changes.take() {
            seen.note(&patch);
        }
        while let Ok(Some((message, _))) = diagnostics.take() {
            seen.note_diagnostics(&message);
        }
        let (came, now) = (tiles.take(&mut mesh), wall_ns());
        came.iter()
            .for_each(|tile| seen.look(&tiles.seen[tile], now));
    }
    let unseen: usize = seen.moves.values().map(Vec::len).sum();
    println!(
        "from a sample that moves a vertex to where the viewer has it {}, {unseen} never; {} tiles, {} received",
        shown(seen.visible.quantiles()),
        tiles.seen.len(),
        tiles.received
    );
    seen.seen()
}

/// Sends wrenches at 1 kHz, and poses if the other end is the node, from a whole second on;
/// measures the delay of answers.
#[expect(clippy::too_many_lines)]
pub fn touch(domain: u16, seconds: usize, is_node: bool) -> Answers {
    let (context, mut node) = joined(domain, "sensors");
    let mut mismatches = reader::<HapticMismatch>(&mut node, "/mismatch", SAMPLES);
    let wrenches = writer::<WrenchStamped>(&mut node, "/stylus/wrench");
    let poses = is_node.then(|| writer::<PoseStamped>(&mut node, "/stylus/pose"));
    wait_for_matches(&context, 2 + usize::from(is_node));
    let count = seconds * 1000;
    let sent_ns: Arc<Vec<AtomicI64>> = Arc::new((0..count).map(|_| AtomicI64::new(0)).collect());
    let begin_ns = (wall_ns() / SECOND_NS + 1) * SECOND_NS;
    let begin = Instant::now() + Duration::from_nanos((begin_ns - wall_ns()).max(0) as u64);
    let sending = spawn({
        let sent_ns = Arc::clone(&sent_ns);
        move || {
            for (number, sent) in sent_ns.iter().enumerate() {
                sleep(
                    (begin + Duration::from_millis(number as u64))
                        .saturating_duration_since(Instant::now()),
                );
                let mut sample = slide(number, WIDTH);
                sample.stamp_ns += begin_ns;
                let (wrench, pose) = messages(&sample);
                if let Some(poses) = &poses {
                    wrenches.publish(wrench).expect("best effort never waits");
                    sent.store(wall_ns(), Ordering::Relaxed);
                    poses.publish(pose).expect("best effort never waits");
                } else {
                    sent.store(wall_ns(), Ordering::Relaxed);
                    wrenches.publish(wrench).expect("best effort never waits");
                }
            }
        }
    });
    let mut round_trips = Latencies::new();
    let mut by_second: Vec<(u64, Latencies)> =
        (0..seconds).map(|_| (0, Latencies::new())).collect();
    let mut poll = Poll::new().expect("the system polls");
    poll.registry()
        .register(&mut mismatches, Token(0), Interest::READABLE)
        .expect("it can be polled");
    let mut events = Events::with_capacity(8);
    let end = begin + Duration::from_secs(seconds as u64) + REST;
    while Instant::now() < end {
        // an interrupted wait is one that is over
        let _ = poll.poll(&mut events, Some(Duration::from_millis(100)));
        while let Ok(Some((mismatch, _))) = mismatches.take() {
            let number =
                usize::try_from((stamp_ns(mismatch.header.stamp) - begin_ns) / STEP_NS).ok();
            let Some((number, sent)) =
                number.and_then(|number| Some((number, sent_ns.get(number)?)))
            else {
                continue;
            };
            let took =
                Duration::from_nanos((wall_ns() - sent.load(Ordering::Relaxed)).max(0) as u64);
            let (answered, times) = &mut by_second[number / 1000];
            *answered += 1;
            times.record(took);
            round_trips.record(took);
        }
    }
    sending.join().expect("it sends to the end");
    let answered: u64 = by_second.iter().map(|(answered, _)| answered).sum();
    println!(
        "{answered} of {count} answered; from the sensors and back {}",
        shown(round_trips.quantiles())
    );
    let seconds = by_second
        .iter()
        .map(|(answered, times)| (1000_u64.saturating_sub(*answered), Times::of(times)));
    Answers {
        begin_ns,
        seconds: seconds.collect(),
    }
}
