//! The port on a sourced ROS 2: r2r over rcl, with the RMW chosen there.
//!
//! Three threads of ours run beside those of the RMW. One spins: it receives messages and puts them
//! into the inbox of the node. Two send: one small and urgent messages, including answers; one the
//! mesh, as a slow listener may delay it. rcl reads the command line and the environment by itself,
//! so it gets the node's names before remapping.

mod action;
mod arm_port;
mod back_end;
mod convert;
mod graph;
mod samples;
mod services;
#[cfg(feature = "r2r-check")]
mod stand_in;
mod topics;

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

#[cfg(not(feature = "r2r-check"))]
use r2r::{std_srvs, touchup_msgs};
#[cfg(feature = "r2r-check")]
use stand_in::{std_srvs, touchup_msgs};

use crate::ros::arguments::NodeConfig;
use crate::ros::clock::time;
use crate::ros::exchange::{self, ConnectedPort, PortState, RosError};
use crate::ros::inbox::Inbox;
use crate::ros::locked;
use crate::ros::messages::{Parameter, ParameterEvent};
use crate::ros::parameter_services::{self, PublicParameters, raw};
use crate::ros::parameters::ParameterValue;
use crate::ros::port::{Arrival, Port};
use crate::ros::topics::{mesh, subscribe, urgent};
pub use arm_port::arm_port;
use back_end::{PollSource, R2rBackEnd, RclErrorContext};
use convert::Convert;
use graph::R2rGraph;
pub use samples::samples;

struct R2rConnection {
    exchange: Arc<PortState>,
    sending: Vec<JoinHandle<()>>,
    spinning: Option<JoinHandle<()>>,
}

impl Drop for R2rConnection {
    /// Sends waiting messages, then leaves: the node of rcl must outlive all senders.
    fn drop(&mut self) {
        self.exchange.close();
        exchange::join(self.sending.drain(..));
        self.exchange.inbox.end();
        exchange::join(self.spinning.take());
    }
}

/// Joins ROS as a node: messages go to `inbox` from now on. Once per process: rcl reads the command
/// line.
///
/// # Errors
/// [`RosError`]: an invalid name, ROS does not start, no thread.
pub fn start(config: &NodeConfig, inbox: Inbox) -> Result<Arc<dyn Port>, RosError> {
    let exchange = PortState::new(config, inbox);
    let context = context()?;
    let node = r2r::Node::create(context.clone(), &config.place.node, &config.place.namespace);
    let (node, graph) = (node.during("making the node")?, R2rGraph::new(context));
    let mut back_end = R2rBackEnd {
        config,
        node,
        graph,
        exchange: exchange.clone(),
        sources: Vec::new(),
    };
    let (mesh, urgent) = (mesh(&mut back_end)?, urgent(&mut back_end)?);
    subscribe(config, &mut back_end)?;
    let announce = announce(&mut back_end.node, config.place.full_name(), &exchange)?;
    crate::ros::services::serve(&mut back_end, &Arc::new(exchange.inbox.clone()))?;
    parameter_services::serve(
        &mut back_end,
        &PublicParameters::new(&exchange, &config.parameters, announce),
    )?;
    let R2rBackEnd {
        mut node,
        graph,
        mut sources,
        ..
    } = back_end;
    sources.extend(action::server(&mut node, &exchange)?);
    let mut connection = R2rConnection {
        exchange: exchange.clone(),
        sending: Vec::new(),
        spinning: None,
    };
    let spinning = exchange.thread("touchup-spin", move |exchange| {
        spin(node, sources, graph, exchange)
    })?;
    connection.spinning = Some(spinning);
    connection.sending.extend(exchange.senders(urgent, mesh)?);
    Ok(Arc::new(ConnectedPort {
        exchange,
        _connection: connection,
    }))
}

/// Publishes changes of parameters on `/parameter_events`.
fn announce(
    node: &mut r2r::Node,
    name: String,
    exchange: &Arc<PortState>,
) -> Result<impl Fn(&str, &ParameterValue) + Send + Sync + 'static, RosError> {
    let events = node.create_publisher(
        "/parameter_events",
        r2r::qos::QosProfile::parameter_events(),
    );
    let (events, exchange) = (
        Arc::new(Mutex::new(events.during("publishing a topic")?)),
        exchange.clone(),
    );
    Ok(move |parameter: &str, value: &ParameterValue| {
        let event = ParameterEvent {
            stamp: time(exchange.clock.now_ns()),
            node: name.clone(),
            changed_parameters: vec![Parameter {
                name: parameter.to_owned(),
                value: raw(Some(value)),
            }],
            ..ParameterEvent::default()
        };
        let events = events.clone();
        exchange.urgent.answer(Box::new(move || {
            if let Err(error) = locked(&events).publish(&event.theirs()) {
                tracing::warn!(%error, "a change of a parameter is not announced");
            }
        }));
    })
}

/// The context of the process. r2r panics if rcl refuses the command line or the environment.
fn context() -> Result<r2r::Context, RosError> {
    let created = match std::panic::catch_unwind(r2r::Context::create) {
        Ok(context) => context.map_err(|error| error.to_string()),
        Err(panic) => {
            let said = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or(panic.downcast_ref().copied());
            Err(said.unwrap_or("rcl_init failed").to_owned())
        }
    };
    let remedy = "is RMW_IMPLEMENTATION one that is installed?";
    created.map_err(|reason| RosError::Refused {
        call: "ROS does not start",
        reason,
        remedy,
    })
}

/// Maximum time to notice the end without messages; a message wakes it at once.
const NOTHING_CAME: Duration = Duration::from_millis(50);
/// Number of idle spins, some 10 ms: more than between two samples at 100 Hz.
const MOST_IN_VAIN: u32 = 160;
/// Maximum delay of the first sample after a rest.
const PAUSE: Duration = Duration::from_millis(2);

/// Spins until the end. There is always a subscription, or rcl would not wait at all (r2r issue
/// 93).
fn spin(
    mut node: r2r::Node,
    mut sources: Vec<PollSource>,
    mut graph: R2rGraph,
    exchange: &PortState,
) {
    let _reports_end = ReportsEnd(exchange);
    let mut in_vain = 0;
    while !exchange.inbox.is_over() {
        let began = Instant::now();
        node.spin_once(NOTHING_CAME);
        let has_come = sources.iter_mut().fold(false, |any, take| take() | any);
        in_vain = if has_come || began.elapsed() >= NOTHING_CAME {
            0
        } else {
            u32::saturating_add(in_vain, 1)
        };
        // after the expiry of a goal's result rcl no longer waits (r2r issue 136)
        if in_vain > MOST_IN_VAIN {
            std::thread::sleep(PAUSE);
        }
        if !graph.look(&node, exchange) {
            return;
        }
    }
}

/// Ends the node too, which then saves, once nothing can arrive any more.
struct ReportsEnd<'a>(&'a PortState);

impl Drop for ReportsEnd<'_> {
    fn drop(&mut self) {
        if !self.0.inbox.is_over() {
            tracing::error!("the node hears nothing any more: ROS has ended");
            self.0.inbox.put(Arrival::Shutdown);
        }
    }
}
