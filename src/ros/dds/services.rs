//! Services, in the mapping of either RMW.
//!
//! In the enhanced mapping a server is that of ros2-client. In the mapping of CycloneDDS it is our own: that of ros2-client puts the
//! identity of the request into the inline QoS there too, which nobody reads, and which RustDDS 0.15.1 writes wrongly in fragments.

use std::sync::Arc;

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::dds::rustdds::{QosPolicies, TopicKind};
use ros2_client::qos::{History, QosProfile};
use ros2_client::{Publisher, ReadError, ReadResult, RmwRequestId, ServiceMapping, ServiceTypeName, Subscription};
use serde::{Deserialize, Serialize};

use super::answers::{Room, Shrinkable};
use super::back_end::{DdsBackEnd, During};
use super::graph::mapping;
use super::incoming::Listener;
use super::topics::dds_name;
use crate::ros::exchange::{Exchange, RosError};
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

impl<S> Serves<S> for DdsBackEnd<'_>
where
    S: RosService<Request: ros2_client::Message, Response: Shrinkable>,
{
    fn serve(
        &mut self,
        name: &'static str,
        call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError> {
        let server = Server::<S::Request, S::Response>::new(self, name, S::TYPE_NAME);
        let (server, exchange, room) = (Arc::new(server?), self.exchange.clone(), self.room.clone());
        self.names.push(self.config.resolve(name)?);
        self.listeners.push(Box::new(Service { name, server, exchange, room, call: Box::new(call) }));
        Ok(())
    }
}

/// As ROS 2 has it for services: nothing is lost, calls wait for each other.
pub(super) const SERVICE: QosProfile = QosProfile::publisher_default().history(History::KeepLast { depth: 10 });

/// A request or an answer as rmw_cyclonedds has it: whose call it is, and its number, stand before the message.
#[derive(Clone, Serialize, Deserialize)]
struct Headed<M> {
    caller: u64,
    number: i64,
    message: M,
}

impl<M: ros2_client::Message> ros2_client::Message for Headed<M> {}

/// Which call is answered.
#[derive(Clone, Copy)]
enum CallId {
    Enhanced(RmwRequestId),
    Cyclone { caller: u64, number: i64 },
}

/// Takes requests and sends answers.
enum Server<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> {
    Enhanced(ros2_client::Server<Q, A>),
    Cyclone(Subscription<Headed<Q>>, Publisher<Headed<A>>),
}

impl<Q, A> Server<Q, A>
where
    Q: ros2_client::Message + Clone + 'static,
    A: ros2_client::Message + 'static,
{
    /// - `name`: as in docs/ros.md
    fn new(back_end: &mut DdsBackEnd<'_>, name: &str, [package, type_name]: [&str; 2]) -> Result<Self, RosError> {
        let DdsBackEnd { config, context, node, .. } = back_end;
        let (whole, mapping) = (config.resolve(name)?, mapping(config));
        if mapping != ServiceMapping::Cyclone {
            let type_name = ServiceTypeName::new(package, type_name);
            let server = node.create_server(mapping, &dds_name(&whole)?, &type_name, SERVICE, SERVICE);
            return server.map(Self::Enhanced).during("offering a service");
        }
        let topic = |name: String, part: &str| {
            let type_name = format!("{package}::srv::dds_::{type_name}_{part}_");
            let qos = QosPolicies::from(&SERVICE);
            context.domain_participant().create_topic(name, type_name, &qos, TopicKind::NoKey).during("making a topic")
        };
        let requests = topic(format!("rq{whole}Request"), "Request")?;
        let answers = topic(format!("rr{whole}Reply"), "Response")?;
        let requests = node.create_subscription(&requests, Some(SERVICE)).during("offering a service")?;
        let answers = node.create_publisher(&answers, Some(SERVICE)).during("offering a service")?;
        Ok(Self::Cyclone(requests, answers))
    }
}

impl<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> Server<Q, A> {
    fn source(&mut self) -> &mut dyn Source {
        match self {
            Self::Enhanced(server) => server,
            Self::Cyclone(requests, _) => requests,
        }
    }

    /// The next request that has come.
    fn take(&self) -> ReadResult<Option<(CallId, Q)>> {
        Ok(match self {
            Self::Enhanced(server) => server.receive_request()?.map(|(id, request)| (CallId::Enhanced(id), request)),
            Self::Cyclone(requests, _) => requests
                .take()?
                .map(|(Headed { caller, number, message }, _)| (CallId::Cyclone { caller, number }, message)),
        })
    }

    /// Answers one; an id of the other mapping there is none.
    fn send(&self, id: CallId, message: A) -> Result<(), String> {
        match (self, id) {
            (Self::Enhanced(server), CallId::Enhanced(id)) => {
                server.send_response(id, message).map_err(|error| error.to_string())
            }
            (Self::Cyclone(_, answers), CallId::Cyclone { caller, number }) => {
                answers.publish(Headed { caller, number, message }).map_err(|error| error.to_string())
            }
            _ => Err("it was asked in another mapping".to_owned()),
        }
    }
}
