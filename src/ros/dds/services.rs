//! The services of docs/ros.md.

use std::sync::Arc;

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::{Context, Node, ReadError};

use super::answers::Shrinkable;
use super::graph::DdsGraph;
use super::incoming::Listener;
use super::server::{CallId, Server};
use super::{DdsShared, RosError};
use crate::ros::arguments::NodeConfig;
use crate::ros::messages::*;
use crate::ros::port::{Arrival, Call, Reply};

macro_rules! carried {
    ($($message:ident),+ $(,)?) => { $(impl ros2_client::Message for $message {})+ };
}
carried!(
    FlagFeatureRequest,
    FlagFeatureResponse,
    UnflagFeatureRequest,
    UnflagFeatureResponse,
    DetectFeaturesRequest,
    DetectFeaturesResponse,
    SaveMeshRequest,
    SaveMeshResponse,
    ResyncMeshRequest,
    ResyncMeshResponse,
    UndoRequest,
    UndoResponse,
    TriggerRequest,
    TriggerResponse,
    SetBoolRequest,
    SetBoolResponse,
    ProbeFeatureRequest,
    ProbeFeatureResponse,
);

/// One service: what it is called, and what is done with a request.
pub(super) struct Service<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> {
    pub name: &'static str,
    pub server: Arc<Server<Q, A>>,
    pub shared: Arc<DdsShared>,
    pub call: Box<dyn FnMut(Q, Reply<A>) + Send>,
}

impl<Q, A> Listener for Service<Q, A>
where
    Q: ros2_client::Message + Send + Sync + 'static,
    A: Shrinkable + Send + Sync + 'static,
{
    fn source(&mut self, _: usize) -> &mut dyn Source {
        Arc::get_mut(&mut self.server).expect("sources are asked for before any request is answered").source()
    }

    fn take(&mut self) {
        loop {
            match self.server.take() {
                Ok(Some((id, request))) => {
                    let reply = reply(self.name, &self.server, &self.shared, id);
                    (self.call)(request, reply);
                }
                Ok(None) => return,
                Err(error) => unreadable(self.name, &self.shared, &error),
            }
        }
    }
}

/// A request that cannot be read is most often one with another header.
pub(super) fn unreadable(name: &'static str, shared: &DdsShared, error: &ReadError) {
    let reason = format!("{error}; has the caller another service_mapping?");
    shared.arrivals.put(Arrival::Unreadable(name, reason));
}

/// Answers a request from the thread that sends.
fn reply<Q, A>(name: &'static str, server: &Arc<Server<Q, A>>, shared: &Arc<DdsShared>, id: CallId) -> Reply<A>
where
    Q: ros2_client::Message + Send + Sync + 'static,
    A: Shrinkable + Send + Sync + 'static,
{
    let (server, shared) = (server.clone(), shared.clone());
    Reply::new(move |answer| {
        let answer = shared.room.fit(name, answer);
        shared.urgent.answer(Box::new(move || {
            if let Err(error) = server.send(id, answer) {
                tracing::warn!(service = name, %error, "an answer is not sent");
            }
        }));
    })
}

/// All services but those of parameters and the action.
pub(super) fn servers(
    config: &NodeConfig,
    context: &Context,
    node: &mut Node,
    graph: &mut DdsGraph,
    shared: &Arc<DdsShared>,
) -> Result<Vec<Box<dyn Listener>>, RosError> {
    let mut made = Services { config, context, node, graph, shared, listeners: Vec::new() };
    made.add("~/flag_feature", "touchup_msgs", "FlagFeature", Call::Flag)?;
    made.add("~/unflag_feature", "touchup_msgs", "UnflagFeature", Call::Unflag)?;
    made.add("~/detect_features", "touchup_msgs", "DetectFeatures", Call::Detect)?;
    made.add("~/save_mesh", "touchup_msgs", "SaveMesh", Call::Save)?;
    made.add("~/resync_mesh", "touchup_msgs", "ResyncMesh", Call::Resync)?;
    made.add("~/undo", "touchup_msgs", "Undo", Call::Undo)?;
    made.add("~/redo", "touchup_msgs", "Undo", Call::Redo)?;
    made.add("~/reset", "std_srvs", "Trigger", |_: TriggerRequest, reply| Call::Reset(reply))?;
    made.add("~/pause", "std_srvs", "SetBool", Call::Pause)?;
    made.add("~/probe_all", "std_srvs", "Trigger", |_: TriggerRequest, reply| Call::ProbeAll(reply))?;
    made.add("~/recover", "std_srvs", "Trigger", |_: TriggerRequest, reply| Call::Recover(reply))?;
    made.add("~/arm_state", "std_srvs", "Trigger", |_: TriggerRequest, reply| Call::ArmState(reply))?;
    made.add("~/probe_feature", "touchup_msgs", "ProbeFeature", Call::ProbeFeature)?;
    Ok(made.listeners)
}

struct Services<'a> {
    config: &'a NodeConfig,
    context: &'a Context,
    node: &'a mut Node,
    shared: &'a Arc<DdsShared>,
    graph: &'a mut DdsGraph,
    listeners: Vec<Box<dyn Listener>>,
}

impl Services<'_> {
    fn add<Q, A>(
        &mut self,
        name: &'static str,
        package: &str,
        type_name: &str,
        call: fn(Q, Reply<A>) -> Call,
    ) -> Result<(), RosError>
    where
        Q: ros2_client::Message + Clone + Send + Sync + 'static,
        A: Shrinkable + Send + Sync + 'static,
    {
        self.graph.serve(self.config.resolve(name)?);
        let server = Arc::new(Server::new(self.config, self.context, self.node, name, package, type_name)?);
        let arrivals = self.shared.clone();
        let call = Box::new(move |request, reply| arrivals.arrivals.put(Arrival::Call(call(request, reply))));
        self.listeners.push(Box::new(Service { name, server, shared: self.shared.clone(), call }));
        Ok(())
    }
}
