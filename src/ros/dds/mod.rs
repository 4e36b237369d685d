//! The port on its own DDS: ros2-client over RustDDS, no ROS installation needed.
//!
//! Three threads of ours stand beside those of DDS. One takes what comes and hands it to the node. Two send: one what is
//! small and urgent, answers among it; one the mesh, where a slow listener may hold things up.

mod action;
mod answers;
mod graph;
mod incoming;
mod keep_alive;
mod parameter_services;
mod samples;
mod server;
mod services;
mod topics;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{Builder, JoinHandle};

use ros2_client::dds::rustdds;
use ros2_client::{Context, Node, NodeName, NodeOptions, ServiceMapping};
use thiserror::Error;

use self::answers::Room;
use super::arguments::NodeConfig;
use super::arrivals::Arrivals;
use super::clock::RosClock;
use super::names::NameError;
use super::port::{Inbox, Port, Publication};
use super::send_queue::SendQueue;
pub use samples::samples;

/// Why the node cannot speak to others.
#[derive(Debug, Error)]
pub enum RosError {
    /// a name that a rule made is none
    #[error(transparent)]
    Name(#[from] NameError),
    /// DDS does not do what it is asked for
    #[error(
        "{call}: {reason}; is the network up (ip link show lo), and are there fewer than 120 nodes in this domain?"
    )]
    Dds {
        /// which call
        call: &'static str,
        /// what it says
        reason: String,
    },
    /// no thread is to be had
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
}

impl RosError {
    fn dds(call: &'static str, reason: &impl std::fmt::Debug) -> Self {
        Self::Dds { call, reason: format!("{reason:?}") }
    }
}

/// What the parts of the port share.
struct DdsShared {
    arrivals: Arrivals,
    /// wrenches, poses that did not come
    lost: [AtomicU64; 2],
    clock: RosClock,
    urgent: SendQueue,
    mesh: SendQueue,
    room: Room,
}

struct DdsPort {
    shared: Arc<DdsShared>,
    waker: Arc<rustdds::mio1::Waker>,
    threads: Vec<JoinHandle<()>>,
    // its entities leave the graph when it goes
    _node: Arc<Node>,
}

impl Port for DdsPort {
    fn publish(&self, publication: Publication) {
        let outbox = if publication.may_wait() { &self.shared.mesh } else { &self.shared.urgent };
        outbox.put(publication);
    }

    fn now_ns(&self) -> i64 {
        self.shared.clock.now_ns()
    }

    fn dropped(&self) -> [u64; 2] {
        self.shared.arrivals.dropped()
    }

    fn lost(&self) -> [u64; 2] {
        self.shared.lost.each_ref().map(|count| count.load(Ordering::Relaxed))
    }

    fn unsent(&self) -> [u64; 2] {
        let [tiles, patches] = self.shared.mesh.unsent();
        let [_, others] = self.shared.urgent.unsent();
        [tiles, patches + others]
    }

    fn tiles_waiting(&self) -> usize {
        self.shared.mesh.tiles_waiting()
    }
}

impl Drop for DdsPort {
    fn drop(&mut self) {
        self.shared.arrivals.end();
        self.shared.urgent.close();
        self.shared.mesh.close();
        // without it the thread stays until the next message: nothing worse
        let _ = self.waker.wake();
        for thread in self.threads.drain(..) {
            // one that panicked has said so
            let _ = thread.join();
        }
    }
}

/// Joins the network as a node: what comes goes to `inbox` from now on.
///
/// # Errors
/// [`RosError`]: a name that is none, no network, no thread.
pub fn start(config: &NodeConfig, inbox: Inbox) -> Result<Arc<dyn Port>, RosError> {
    let is_simulated = config.parameters.bool("use_sim_time");
    let shared = Arc::new(DdsShared {
        arrivals: Arrivals::new(inbox),
        lost: [const { AtomicU64::new(0) }; 2],
        clock: RosClock::new(is_simulated),
        urgent: SendQueue::default(),
        mesh: SendQueue::default(),
        room: Room::new(&mapping(config)),
    });
    // its own parameter services know one mapping alone, and nothing of ranges
    let options = parameter_services::declare(NodeOptions::new().start_parameter_services(false), &config.parameters);
    let (context, mut node) = join(config, options)?;
    let mut graph = graph::DdsGraph::new(&context, &shared, config);
    let (urgent, mesh) = topics::writers(config, &mut node, &mut graph)?;
    let mut listeners = topics::readers(config, &mut node, &mut graph, &shared)?;
    listeners.extend(services::servers(config, &context, &mut node, &mut graph, &shared)?);
    listeners.push(action::server(config, &mut node, &shared)?);
    let parameters = parameter_services::servers(config, &context, &mut node, &shared)?;
    let node = Arc::new(node);
    listeners.extend(parameters.listeners(&node));
    listeners.push(Box::new(graph));
    let (waker, listening) = incoming::listen(listeners, shared.clone())?;
    let threads = vec![
        listening,
        thread("touchup-send", &shared, move |shared| shared.urgent.send(|one| urgent.send(one)))?,
        thread("touchup-mesh", &shared, move |shared| shared.mesh.send(|one| mesh.send(one)))?,
    ];
    Ok(Arc::new(DdsPort { shared, waker, threads, _node: node }))
}

fn thread(
    name: &str,
    shared: &Arc<DdsShared>,
    send: impl FnOnce(&DdsShared) + Send + 'static,
) -> Result<JoinHandle<()>, RosError> {
    let shared = Arc::clone(shared);
    Ok(Builder::new().name(name.to_owned()).spawn(move || send(&shared))?)
}

fn mapping(config: &NodeConfig) -> ServiceMapping {
    match config.parameters.string("service_mapping") {
        "cyclone" => ServiceMapping::Cyclone,
        _ => ServiceMapping::Enhanced,
    }
}

fn join(config: &NodeConfig, options: NodeOptions) -> Result<(Context, Node), RosError> {
    let mut builder = rustdds::DomainParticipantBuilder::new(config.domain_id);
    if config.localhost_only {
        builder = builder.with_only_networks([std::net::Ipv4Addr::LOCALHOST]);
    }
    let participant = builder.build().map_err(|error| RosError::dds("joining the domain", &error))?;
    let context = Context::from_domain_participant(participant);
    let context = context.map_err(|error| RosError::dds("joining the graph", &error))?;
    let namespace = if config.place.namespace.is_empty() { "/" } else { &config.place.namespace };
    let name =
        NodeName::new(namespace, &config.place.node).map_err(|error| RosError::dds("naming the node", &error))?;
    let node = context.new_node(name, options).map_err(|error| RosError::dds("making the node", &error))?;
    Ok((context, node))
}
