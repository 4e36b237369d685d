//! Common parts of every network port: the inbox, the time of ROS, and two sending threads.

use std::fmt::Display;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{Builder, JoinHandle};

use crate::ros::arguments::NodeConfig;
use crate::ros::clock::RosClock;
use crate::ros::inbox::Inbox;
use crate::ros::names::NameError;
use crate::ros::port::{MESH_PATCH_TOPIC, Port, Publication, Reply};
use crate::ros::send_queue::{SendOutcome, SendQueue};
use touchup_session::threads::give_way;

/// Reason why the node cannot communicate.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// an invalid name from a rule
    #[error(transparent)]
    Name(#[from] NameError),
    /// a refused request to ROS
    #[error("{call}: {reason}; {remedy}")]
    Refused {
        /// name of the call
        call: &'static str,
        /// cause
        reason: String,
        /// advice
        remedy: &'static str,
    },
    /// a thread does not start
    #[error("cannot start a thread: {0}")]
    Thread(#[from] io::Error),
}

/// State shared by the parts of a port.
pub(super) struct PortState {
    pub inbox: Inbox,
    /// full name with its namespace
    pub node_name: String,
    /// topics of wrenches and of poses, absolute
    sample_topics: [String; 2],
    /// absolute
    mesh_patch_topic: String,
    pub clock: RosClock,
    /// queue of small and urgent messages, including answers
    pub urgent: SendQueue,
    mesh: SendQueue,
    /// wrenches and poses sent but not received, if the port sees their numbers
    pub lost: [AtomicU64; 2],
}

impl PortState {
    pub fn new(config: &NodeConfig, inbox: Inbox) -> Arc<Self> {
        Arc::new(Self {
            inbox,
            // a subscription refuses invalid names later
            sample_topics: config
                .sample_topics()
                .map(|name| config.resolve(name).unwrap_or_default()),
            mesh_patch_topic: config.resolve(MESH_PATCH_TOPIC).unwrap_or_default(),
            node_name: config.place.full_name(),
            clock: RosClock::new(config.parameters.bool("use_sim_time")),
            urgent: SendQueue::default(),
            mesh: SendQueue::default(),
            lost: Default::default(),
        })
    }

    /// A reply that the sending thread sends.
    pub fn reply<A: Send + 'static, E: Display>(
        self: &Arc<Self>,
        service: &'static str,
        send: impl FnOnce(A) -> Result<(), E> + Send + 'static,
    ) -> Reply<A> {
        let exchange = self.clone();
        Reply::new(move |answer| {
            exchange.urgent.answer(Box::new(move || {
                if let Err(error) = send(answer) {
                    tracing::warn!(service, %error, "an answer is not sent");
                }
            }));
        })
    }

    /// Starts the two sending threads: one for urgent messages, one for the mesh, as a slow
    /// listener may delay it.
    pub fn senders(
        self: &Arc<Self>,
        urgent: impl Fn(Publication) -> SendOutcome<Publication> + Send + 'static,
        mesh: impl Fn(Publication) -> SendOutcome<Publication> + Send + 'static,
    ) -> io::Result<[JoinHandle<()>; 2]> {
        // urgent messages wait for nobody
        let urgent = move |publication| match urgent(publication) {
            SendOutcome::Later(_) => SendOutcome::Refused,
            sent => sent,
        };
        Ok([
            self.thread("touchup-send", move |exchange| exchange.urgent.send(urgent))?,
            self.thread("touchup-mesh", move |exchange| {
                give_way();
                exchange.mesh.send(mesh);
            })?,
        ])
    }

    /// Starts a thread.
    pub fn thread(
        self: &Arc<Self>,
        name: &str,
        work: impl FnOnce(&Arc<Self>) + Send + 'static,
    ) -> io::Result<JoinHandle<()>> {
        let exchange = self.clone();
        Builder::new()
            .name(name.to_owned())
            .spawn(move || work(&exchange))
    }

    /// Has the sending threads end once everything is sent.
    pub fn close(&self) {
        self.urgent.close();
        self.mesh.close();
    }
}

/// Waits for threads to end.
pub(crate) fn join(threads: impl IntoIterator<Item = JoinHandle<()>>) {
    for thread in threads {
        // a panicked thread has already reported it
        let _ = thread.join();
    }
}

/// A port at work; `_connection` leaves the network on drop.
pub(super) struct ConnectedPort<C> {
    pub exchange: Arc<PortState>,
    pub _connection: C,
}

impl<C: Send + Sync> Port for ConnectedPort<C> {
    fn publish(&self, publication: Publication) {
        // the mesh, and touches with their curves, are large and may wait
        match publication {
            Publication::Tile(_) | Publication::MeshPatch(_) | Publication::ProbeTouch(_) => {
                &self.exchange.mesh
            }
            _ => &self.exchange.urgent,
        }
        .put(publication);
    }

    fn node_name(&self) -> &str {
        &self.exchange.node_name
    }

    fn sample_topics(&self) -> [&str; 2] {
        self.exchange.sample_topics.each_ref().map(String::as_str)
    }

    fn mesh_patch_topic(&self) -> &str {
        &self.exchange.mesh_patch_topic
    }

    fn now_ns(&self) -> i64 {
        self.exchange.clock.now_ns()
    }

    fn dropped(&self) -> [u64; 2] {
        self.exchange.inbox.dropped()
    }

    fn lost(&self) -> [u64; 2] {
        self.exchange
            .lost
            .each_ref()
            .map(|count| count.load(Ordering::Relaxed))
    }

    fn unsent(&self) -> [u64; 2] {
        let [tiles, patches] = self.exchange.mesh.unsent();
        let [_, others] = self.exchange.urgent.unsent();
        [tiles, patches + others]
    }

    fn tiles_waiting(&self) -> usize {
        self.exchange.mesh.tiles_waiting()
    }
}
