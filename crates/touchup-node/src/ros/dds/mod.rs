//! The port on its own DDS: ros2-client over RustDDS, no ROS installation needed.
//!
//! Three threads of ours run beside those of DDS. One receives messages and puts them into the
//! inbox of the node. Two send: one small and urgent messages, including answers; one the mesh, as
//! a slow listener may delay it.

mod action;
mod answers;
mod arm_port;
mod back_end;
mod environment;
mod first_request;
mod graph;
mod incoming;
#[cfg(target_os = "linux")]
mod interrupted;
mod keep_alive;
mod rematch;
mod rosout;
mod sample_topic;
mod samples;
mod services;
mod sockets;
mod topics;

use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use ros2_client::dds::rustdds;
use ros2_client::{Node, NodeOptions};

use self::answers::Room;
use self::back_end::{BegunNode, DdsBackEnd, join};
use self::graph::{DdsGraph, mapping};
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::{self, ConnectedPort, PortState, RosError};
use crate::ros::inbox::Inbox;
use crate::ros::locked;
use crate::ros::parameter_services::{self, PublicParameters};
use crate::ros::parameters::{PARAMETERS, ParameterValue, Parameters};
use crate::ros::port::Port;
use crate::ros::topics::{mesh, subscribe, urgent};
pub use arm_port::arm_port;
pub use samples::samples;

struct DdsConnection {
    exchange: Arc<PortState>,
    waker: Arc<rustdds::mio1::Waker>,
    threads: Vec<JoinHandle<()>>,
    /// its entities leave the graph on drop
    node: Option<Arc<Mutex<Node>>>,
}

/// Maximum time for leaving the network in order: a RustDDS busy with received messages does not
/// keep a node from its end.
const LEAVES_WITHIN: Duration = Duration::from_secs(20);

impl Drop for DdsConnection {
    fn drop(&mut self) {
        self.exchange.inbox.end();
        self.exchange.close();
        // otherwise the thread stays until the next message, which does no harm
        let _ = self.waker.wake();
        let (threads, node) = (std::mem::take(&mut self.threads), self.node.take());
        let (done, has_left) = sync_channel(1);
        let leave = move || {
            exchange::join(threads);
            drop(node);
            // the waiting thread may have given up
            let _ = done.send(());
        };
        let is_late = Builder::new()
            .name("touchup-leave".to_owned())
            .spawn(leave)
            .is_err()
            || has_left.recv_timeout(LEAVES_WITHIN).is_err();
        if is_late {
            tracing::warn!(
                "the network is not left in order: others see the node until its lease is over"
            );
        }
    }
}

/// Joins the network as a node: messages go to `inbox` from now on.
///
/// # Errors
/// [`RosError`]: an invalid name, no network, no thread.
pub fn start(config: &NodeConfig, inbox: Inbox) -> Result<Arc<dyn Port>, RosError> {
    let exchange = PortState::new(config, inbox);
    // the library's parameter services know only one mapping, and no ranges
    let options = declare(
        NodeOptions::new().start_parameter_services(false),
        &config.parameters,
    );
    let (context, node) = join(config, options)?;
    let mut back_end = DdsBackEnd {
        config,
        graph: Arc::new(Mutex::new(DdsGraph::new(&context, &exchange, config)?)),
        begun: BegunNode::default(),
        context,
        node,
        exchange: exchange.clone(),
        room: Arc::new(Room::new(&mapping(config))),
        names: Vec::new(),
        listeners: Vec::new(),
    };
    let (mesh, urgent) = (mesh(&mut back_end)?, urgent(&mut back_end)?);
    subscribe(config, &mut back_end)?;
    crate::ros::services::serve(&mut back_end, &Arc::new(exchange.inbox.clone()))?;
    locked(&back_end.graph).services = back_end.names.clone();
    let announce = announcement(back_end.begun.clone());
    parameter_services::serve(
        &mut back_end,
        &PublicParameters::new(&exchange, &config.parameters, announce),
    )?;
    let probe = action::server(&mut back_end)?;
    let DdsBackEnd {
        node,
        graph,
        begun,
        mut listeners,
        ..
    } = back_end;
    listeners.push(probe);
    let node = Arc::new(Mutex::new(node));
    begun.get_or_init(|| node.clone());
    let look_every = locked(&graph).look_every();
    listeners.push(Box::new(graph));
    let (waker, listening) = incoming::listen(listeners, look_every, &exchange)?;
    let mut threads = vec![listening];
    threads.extend(exchange.senders(urgent, mesh)?);
    threads.push(rosout::send(&node, &exchange)?);
    let connection = DdsConnection {
        exchange: exchange.clone(),
        waker,
        threads,
        node: Some(node),
    };
    Ok(Arc::new(ConnectedPort {
        exchange,
        _connection: connection,
    }))
}

/// Announces the changes of a parameter once the node has begun.
fn announcement(begun: BegunNode) -> impl Fn(&str, &ParameterValue) {
    move |name, value| {
        let set = begun
            .get()
            .map(|node| locked(node).set_parameter(name, native(value)));
        if let Some(Err(reason)) = set {
            tracing::warn!(name, reason, "a change of a parameter is not announced");
        }
    }
}

/// Declares the values to ros2-client, so that it announces their changes on `/parameter_events`.
fn declare(options: NodeOptions, parameters: &Parameters) -> NodeOptions {
    PARAMETERS.iter().fold(options, |options, declared| {
        let value = parameters
            .value(declared.name)
            .cloned()
            .unwrap_or(declared.default_value());
        options.declare_parameter(declared.name, native(&value))
    })
}

fn native(value: &ParameterValue) -> ros2_client::ParameterValue {
    match value {
        ParameterValue::Bool(on) => ros2_client::ParameterValue::Boolean(*on),
        ParameterValue::Integer(whole) => ros2_client::ParameterValue::Integer(*whole),
        ParameterValue::Double(number) => ros2_client::ParameterValue::Double(*number),
        ParameterValue::String(word) => ros2_client::ParameterValue::String(word.clone()),
    }
}
