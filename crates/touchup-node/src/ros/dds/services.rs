//! Services, in the mapping of either RMW.
//!
//! In the enhanced mapping the server is ros2-client's. In the mapping of CycloneDDS it is our own:
//! ros2-client's also puts the identity of the request into the inline QoS there, which nobody
//! reads, and which RustDDS 0.15.1 writes wrongly in fragments.

use std::io;
use std::sync::Arc;

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::dds::rustdds::{QosPolicies, TopicKind};
use ros2_client::qos::{History, QosProfile};
use ros2_client::{Publisher, ReadResult, ServiceMapping, ServiceTypeName, Subscription};
use serde::{Deserialize, Serialize};

use super::answers::{Room, Shrinkable};
use super::back_end::{DdsBackEnd, DdsErrorContext};
use super::graph::mapping;
use super::incoming::{Listener, drain};
use super::topics::dds_name;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::messages::*;
use crate::ros::port::Reply;
use crate::ros::services::Serves;

macro_rules! carried {
    ($($message:ident),+) => { $(impl ros2_client::Message for $message {})+ };
}
include!(concat!(env!("OUT_DIR"), "/carried.rs"));

/// One service: its name, and the action for a request.
struct DdsService<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> {
    name: &'static str,
    server: Server<Q, A>,
    exchange: Arc<PortState>,
    room: Arc<Room>,
    call: Box<dyn FnMut(Q, Reply<A>) + Send>,
}

impl<Q, A> Listener for DdsService<Q, A>
where
    Q: ros2_client::Message + Clone + Send + Sync + 'static,
    A: Shrinkable + Send + Sync + 'static,
{
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()> {
        match &mut self.server {
            Server::Enhanced(server) => each(
                Arc::get_mut(server).expect("sources are asked for before any request is answered"),
            ),
            Server::Cyclone(requests, _) => each(&mut **requests),
        }
    }

    fn take(&mut self) {
        let Self {
            name,
            server,
            exchange,
            room,
            call,
        } = self;
        drain(
            (name, exchange, OTHER_MAPPING),
            || server.take(),
            |(request, send)| {
                let (name, room) = (*name, room.clone());
                call(
                    request,
                    exchange.reply(name, move |answer| send(room.fit(name, answer))),
                );
            },
        );
    }
}

/// An unreadable request most often has another header.
pub(super) const OTHER_MAPPING: &str = "; has the caller another service_mapping?";

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
        let (server, exchange, room) = (server?, self.exchange.clone(), self.room.clone());
        self.names.push(self.config.resolve(name)?);
        self.listeners.push(Box::new(DdsService {
            name,
            server,
            exchange,
            room,
            call: Box::new(call),
        }));
        Ok(())
    }
}

/// Profile of ROS 2 for services: no losses, calls queue up.
pub(super) const SERVICE: QosProfile =
    QosProfile::publisher_default().history(History::KeepLast { depth: 10 });

/// A request or an answer of rmw_cyclonedds: caller and number precede the message.
#[derive(Clone, Serialize, Deserialize)]
struct ServiceEnvelope<M> {
    caller: u64,
    number: i64,
    message: M,
}

impl<M: ros2_client::Message> ros2_client::Message for ServiceEnvelope<M> {}

/// Sends the answer to one request.
type SendAnswer<A> = Box<dyn FnOnce(A) -> Result<(), String> + Send>;

/// Receives requests.
enum Server<Q: ros2_client::Message + 'static, A: ros2_client::Message + 'static> {
    Enhanced(Arc<ros2_client::Server<Q, A>>),
    Cyclone(
        Box<Subscription<ServiceEnvelope<Q>>>,
        Arc<Publisher<ServiceEnvelope<A>>>,
    ),
}

impl<Q, A> Server<Q, A>
where
    Q: ros2_client::Message + Clone + Send + Sync + 'static,
    A: ros2_client::Message + Send + Sync + 'static,
{
    /// - `name`: as in docs/ros.md
    fn new(
        back_end: &mut DdsBackEnd<'_>,
        name: &str,
        [package, type_name]: [&str; 2],
    ) -> Result<Self, RosError> {
        let DdsBackEnd {
            config,
            context,
            node,
            ..
        } = back_end;
        let (whole, mapping) = (config.resolve(name)?, mapping(config));
        if mapping != ServiceMapping::Cyclone {
            let type_name = ServiceTypeName::new(package, type_name);
            let server =
                node.create_server(mapping, &dds_name(&whole)?, &type_name, SERVICE, SERVICE);
            return server
                .map(|server| Self::Enhanced(Arc::new(server)))
                .during("offering a service");
        }
        let topic = |name: String, part: &str| {
            let type_name = format!("{package}::srv::dds_::{type_name}_{part}_");
            let qos = QosPolicies::from(&SERVICE);
            context
                .domain_participant()
                .create_topic(name, type_name, &qos, TopicKind::NoKey)
                .during("making a topic")
        };
        let requests = topic(format!("rq{whole}Request"), "Request")?;
        let answers = topic(format!("rr{whole}Reply"), "Response")?;
        let requests = node
            .create_subscription(&requests, Some(SERVICE))
            .during("offering a service")?;
        let answers = node
            .create_publisher(&answers, Some(SERVICE))
            .during("offering a service")?;
        Ok(Self::Cyclone(Box::new(requests), Arc::new(answers)))
    }
    /// The next waiting request, and the function that answers it.
    fn take(&self) -> ReadResult<Option<(Q, SendAnswer<A>)>> {
        Ok(match self {
            Self::Enhanced(server) => server.receive_request()?.map(|(id, request)| {
                let server = server.clone();
                let send = move |answer| {
                    server
                        .send_response(id, answer)
                        .map_err(|error| error.to_string())
                };
                (request, Box::new(send) as SendAnswer<A>)
            }),
            Self::Cyclone(requests, answers) => requests.take()?.map(
                |(
                    ServiceEnvelope {
                        caller,
                        number,
                        message,
                    },
                    _,
                )| {
                    let answers = answers.clone();
                    let send = move |message| {
                        answers
                            .publish(ServiceEnvelope {
                                caller,
                                number,
                                message,
                            })
                            .map_err(|error| error.to_string())
                    };
                    (message, Box::new(send) as SendAnswer<A>)
                },
            ),
        })
    }
}
