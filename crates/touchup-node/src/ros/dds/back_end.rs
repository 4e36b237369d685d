//! The node during its start, while topics, services and the action are added.

use std::fmt::Debug;
use std::sync::{Arc, Mutex, OnceLock};

use ros2_client::dds::rustdds;
use ros2_client::{Context, Node, NodeName, NodeOptions};

use super::answers::Room;
use super::environment;
use super::graph::DdsGraph;
use super::incoming::Listener;
use super::sockets::{OpenSockets, guard};
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::{PortState, RosError};

/// Names the refused request to DDS.
pub(super) trait DdsErrorContext<T> {
    fn during(self, call: &'static str) -> Result<T, RosError>;
}

impl<T, E: Debug> DdsErrorContext<T> for Result<T, E> {
    fn during(self, call: &'static str) -> Result<T, RosError> {
        self.map_err(|error| {
            let reason = format!("{error:?}");
            // RustDDS does not always give the reason for a missing socket
            let remedy = if reason.contains("open files") {
                "a node takes some 250: allow the process more (ulimit -n)"
            } else {
                "is the network up (ip link show lo), are there fewer than 120 nodes in this domain, and may the process open 300 \
                 files (ulimit -n)?"
            };
            RosError::Refused { call, reason, remedy }
        })
    }
}

/// The complete node, for topics whose type changes.
pub(super) type BegunNode = Arc<OnceLock<Arc<Mutex<Node>>>>;

/// Back end that publishes, subscribes and serves.
pub(super) struct DdsBackEnd<'a> {
    pub config: &'a NodeConfig,
    pub context: Context,
    pub node: Node,
    pub graph: Arc<Mutex<DdsGraph>>,
    pub begun: BegunNode,
    pub exchange: Arc<PortState>,
    pub room: Arc<Room>,
    /// names of the services up to now, absolute and remapped
    pub names: Vec<String>,
    pub listeners: Vec<Box<dyn Listener>>,
}

/// Joins the network as a node without any topics.
///
/// # Errors
/// [`RosError`]: an unsupported environment, or no network.
pub(super) fn join(config: &NodeConfig, options: NodeOptions) -> Result<(Context, Node), RosError> {
    let variable = |name: &str| std::env::var(name).ok();
    environment::check(variable)?;
    for line in environment::unheeded(variable) {
        tracing::warn!("{line}");
    }
    let mut builder = rustdds::DomainParticipantBuilder::new(config.domain_id);
    if config.localhost_only {
        builder = builder.with_only_networks([std::net::Ipv4Addr::LOCALHOST]);
    }
    let before = OpenSockets::now();
    let participant = builder.build().during("joining the domain")?;
    guard(before, config.localhost_only)?;
    let context = Context::from_domain_participant(participant).during("joining the graph")?;
    let namespace = if config.place.namespace.is_empty() {
        "/"
    } else {
        &config.place.namespace
    };
    let name = NodeName::new(namespace, &config.place.node).during("naming the node")?;
    let node = context.new_node(name, options).during("making the node")?;
    Ok((context, node))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_no_more_files_is_not_sent_to_the_network() {
        // EMFILE
        let refused: Result<(), _> =
            Err(std::io::Error::from_raw_os_error(24)).during("publishing a topic");
        let said = refused.unwrap_err().to_string();
        assert!(
            said.contains("ulimit -n") && !said.contains("ip link"),
            "{said}"
        );
        let refused: Result<(), _> = Err("no such interface").during("joining the domain");
        assert!(refused.unwrap_err().to_string().contains("ip link show lo"));
    }
}
