//! The port on a sourced ROS 2: r2r over rcl, with whichever RMW is chosen there.
//!
//! Three threads of ours stand beside those of the RMW. One spins: it takes what comes and hands it to the node. Two send:
//! one what is small and urgent, answers among it; one the mesh, where a slow listener may hold things up. rcl reads the
//! command line and the environment by itself, so names go to it as the node has them, not yet remapped.

mod action;
mod convert;
#[cfg(test)]
mod filled;
mod graph;
mod parameter_services;
mod samples;
mod services;
#[cfg(feature = "r2r-check")]
mod stand_in;
mod topics;

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use futures::{FutureExt, Stream, StreamExt};
#[cfg(not(feature = "r2r-check"))]
use r2r::{std_srvs, touchup_msgs};
#[cfg(feature = "r2r-check")]
use stand_in::{std_srvs, touchup_msgs};
use thiserror::Error;

use super::arguments::NodeConfig;
use super::arrivals::Arrivals;
use super::clock::RosClock;
use super::names::NameError;
use super::port::{Arrival, Inbox, Port, Publication, Reply};
use super::send_queue::SendQueue;
pub use samples::samples;

/// Why the node cannot speak to others.
#[derive(Debug, Error)]
pub enum RosError {
    /// a name that a rule made is none
    #[error(transparent)]
    Name(#[from] NameError),
    /// ROS does not start
    #[error("ROS does not start: {0}; is RMW_IMPLEMENTATION one that is installed?")]
    Start(String),
    /// rcl does not do what it is asked for
    #[error("{call}: {reason}; is the workspace sourced that has touchup_msgs?")]
    Rcl {
        /// for what
        call: &'static str,
        /// what it says
        reason: String,
    },
    /// no thread is to be had
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
}

/// Says what rcl was asked for, where it refuses.
trait During<T> {
    fn during(self, call: &'static str) -> Result<T, RosError>;
}

impl<T> During<T> for r2r::Result<T> {
    fn during(self, call: &'static str) -> Result<T, RosError> {
        self.map_err(|error| RosError::Rcl { call, reason: error.to_string() })
    }
}

/// What the parts of the port share.
struct R2rShared {
    arrivals: Arrivals,
    clock: RosClock,
    urgent: SendQueue,
    mesh: SendQueue,
}

impl R2rShared {
    fn new(inbox: Inbox, clock: RosClock) -> Self {
        Self { arrivals: Arrivals::new(inbox), clock, urgent: SendQueue::default(), mesh: SendQueue::default() }
    }

    /// An answer that goes out from the thread that sends.
    fn reply<A: Send + 'static>(
        self: &Arc<Self>,
        name: &'static str,
        send: impl FnOnce(A) -> r2r::Result<()> + Send + 'static,
    ) -> Reply<A> {
        let shared = self.clone();
        Reply::new(move |answer| {
            shared.urgent.answer(Box::new(move || {
                if let Err(error) = send(answer) {
                    tracing::warn!(name, %error, "an answer is not sent");
                }
            }));
        })
    }
}

/// Takes all that has come from one topic, service or action since it was called last; whether anything had.
type PollSource = Box<dyn FnMut() -> bool + Send>;

/// A stream of r2r as a source. r2r reads one message of each at a time and keeps ten, so none is lost between two spins.
fn source<S>(mut stream: S, mut take: impl FnMut(S::Item) + Send + 'static) -> PollSource
where
    S: Stream + Unpin + Send + 'static,
{
    Box::new(move || {
        let mut has_come = false;
        while let Some(Some(item)) = stream.next().now_or_never() {
            take(item);
            has_come = true;
        }
        has_come
    })
}

struct R2rPort {
    shared: Arc<R2rShared>,
    sending: Vec<JoinHandle<()>>,
    spinning: Option<JoinHandle<()>>,
}

impl Port for R2rPort {
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

    /// r2r does not tell the numbers of senders.
    fn lost(&self) -> [u64; 2] {
        [0, 0]
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

impl Drop for R2rPort {
    /// Sends what waits, then leaves: the node of rcl must outlive all who send.
    fn drop(&mut self) {
        self.shared.urgent.close();
        self.shared.mesh.close();
        for thread in self.sending.drain(..) {
            // one that panicked has said so
            let _ = thread.join();
        }
        self.shared.arrivals.end();
        if let Some(thread) = self.spinning.take() {
            let _ = thread.join();
        }
    }
}

/// Joins ROS as a node: what comes goes to `inbox` from now on. Once in a process: rcl reads the command line.
///
/// # Errors
/// [`RosError`]: a name that is none, ROS does not start, no thread.
pub fn start(config: &NodeConfig, inbox: Inbox) -> Result<Arc<dyn Port>, RosError> {
    let shared = Arc::new(R2rShared::new(inbox, RosClock::new(config.parameters.bool("use_sim_time"))));
    let context = context()?;
    let node = r2r::Node::create(context.clone(), &config.place.node, &config.place.namespace);
    let mut node = node.during("making the node")?;
    let mut graph = graph::R2rGraph::new(context);
    let urgent = topics::UrgentPublishers::new(config, &mut node, &mut graph)?;
    let mesh = topics::MeshPublishers::new(config, &mut node, &mut graph)?;
    let mut sources = topics::subscriptions(config, &mut node, &mut graph, &shared)?;
    sources.extend(services::servers(&mut node, &shared)?);
    sources.extend(action::server(&mut node, &shared)?);
    sources.extend(parameter_services::servers(config, &mut node, &shared)?);
    let mut port = R2rPort { shared: shared.clone(), sending: Vec::new(), spinning: None };
    port.spinning = Some(thread("touchup-spin", &shared, move |shared| spin(node, sources, graph, shared))?);
    port.sending.push(thread("touchup-send", &shared, move |shared| shared.urgent.send(|one| urgent.send(one)))?);
    port.sending.push(thread("touchup-mesh", &shared, move |shared| shared.mesh.send(|one| mesh.send(one)))?);
    Ok(Arc::new(port))
}

/// The context of the process. r2r panics where rcl refuses the command line or the environment.
fn context() -> Result<r2r::Context, RosError> {
    match std::panic::catch_unwind(r2r::Context::create) {
        Ok(context) => context.map_err(|error| RosError::Start(error.to_string())),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref().copied());
            Err(RosError::Start(said.unwrap_or("rcl_init failed").to_owned()))
        }
    }
}

fn thread(
    name: &str,
    shared: &Arc<R2rShared>,
    work: impl FnOnce(&Arc<R2rShared>) + Send + 'static,
) -> std::io::Result<JoinHandle<()>> {
    let shared = shared.clone();
    Builder::new().name(name.to_owned()).spawn(move || work(&shared))
}

/// So long it takes to notice that all is over when nothing comes; what comes wakes it at once.
const NOTHING_CAME: Duration = Duration::from_millis(50);
/// Some 10 ms of spinning for nothing, more than lies between two samples at 100 Hz.
const MOST_IN_VAIN: u32 = 160;
/// The first sample after a rest waits at most so long.
const PAUSE: Duration = Duration::from_millis(2);

/// The thread that takes what comes. There is always a subscription, or rcl would not wait at all (r2r issue 93).
fn spin(mut node: r2r::Node, mut sources: Vec<PollSource>, mut graph: graph::R2rGraph, shared: &Arc<R2rShared>) {
    let _told = ToldWhenOver(shared);
    let mut in_vain = 0;
    while !shared.arrivals.is_over() {
        let began = Instant::now();
        node.spin_once(NOTHING_CAME);
        let has_come = sources.iter_mut().fold(false, |any, take| take() | any);
        in_vain = if has_come || began.elapsed() >= NOTHING_CAME { 0 } else { u32::saturating_add(in_vain, 1) };
        // once the result of a goal is too old to be kept, rcl waits no more (r2r issue 136)
        if in_vain > MOST_IN_VAIN {
            std::thread::sleep(PAUSE);
        }
        if !graph.look(&node, shared) {
            return;
        }
    }
}

/// The node ends too, and saves, when nothing can come any more.
struct ToldWhenOver<'a>(&'a R2rShared);

impl Drop for ToldWhenOver<'_> {
    fn drop(&mut self) {
        if !self.0.arrivals.is_over() {
            tracing::error!("the node hears nothing any more: ROS has ended");
            self.0.arrivals.put(Arrival::Shutdown);
        }
    }
}
