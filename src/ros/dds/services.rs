//! Services as servers of ros2-client, or our own.

use std::sync::Arc;

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::{Context, Node, ReadError};

use super::RosError;
use super::answers::{Room, Shrinkable};
use super::incoming::Listener;
use super::server::Server;
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::Exchange;
use crate::ros::messages::*;
use crate::ros::port::{Arrival, Reply};
use crate::ros::services::Serves;

macro_rules! carried {
    ($($message:ident),+) => { $(impl ros2_client::Message for $message {})+ };
}
include!(concat!(env!("OUT_DIR"), "/carried.rs"));

/// One service: what it is called, and what is done with a request.
struct Service<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> {
    name: &'static str,
    server: Arc<Server<Q, A>>,
    exchange: Arc<Exchange>,
    room: Arc<Room>,
    call: Box<dyn FnMut(Q, Reply<A>) + Send>,
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
                    let (name, server, room) = (self.name, self.server.clone(), self.room.clone());
                    let send = move |answer| server.send(id, room.fit(name, answer));
                    (self.call)(request, self.exchange.reply(name, send));
                }
                Ok(None) => return,
                Err(error) => unreadable(self.name, &self.exchange, &error),
            }
        }
    }
}

/// A request that cannot be read is most often one with another header.
pub(super) fn unreadable(name: &'static str, exchange: &Exchange, error: &ReadError) {
    let reason = format!("{error}; has the caller another service_mapping?");
    exchange.arrivals.put(Arrival::Unreadable(name, reason));
}

/// Makes servers.
pub(super) struct DdsServices<'a> {
    pub config: &'a NodeConfig,
    pub context: &'a Context,
    pub node: &'a mut Node,
    pub exchange: &'a Arc<Exchange>,
    pub room: &'a Arc<Room>,
    /// of those that are served so far, absolute and remapped
    pub names: Vec<String>,
    pub listeners: Vec<Box<dyn Listener>>,
}

impl<S> Serves<S> for DdsServices<'_>
where
    S: RosService<Request: ros2_client::Message, Response: Shrinkable>,
{
    fn serve(
        &mut self,
        name: &'static str,
        call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError> {
        let [package, type_name] = S::TYPE_NAME;
        let server =
            Server::<S::Request, S::Response>::new(self.config, self.context, self.node, name, package, type_name);
        let (server, exchange, room) = (Arc::new(server?), self.exchange.clone(), self.room.clone());
        self.names.push(self.config.resolve(name)?);
        self.listeners.push(Box::new(Service { name, server, exchange, room, call: Box::new(call) }));
        Ok(())
    }
}
