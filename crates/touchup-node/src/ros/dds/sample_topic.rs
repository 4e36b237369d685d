//! Topics of poses and wrenches, of any published type.

use std::io;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use ros2_client::Subscription;
use ros2_client::dds::rustdds::TopicDescription;
use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::qos::QosProfile;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error};

use super::back_end::{BegunNode, DdsBackEnd, DdsErrorContext};
use super::graph::DdsGraph;
use super::incoming::{LastNumbers, Listener, drain};
use super::topics::{profile, topic_of};
use crate::ros::clock::RosClock;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::sample_source::SampleSource;
use crate::ros::topics::{SubscribesSamples, Topic};
use touchup_io::recording::{BadMessage, LiveMessage, LiveType};

/// A message as read by the decoder of recordings.
struct ReadMessage(Result<LiveMessage, BadMessage>);

/// The library requires this of subscribed types; decoding needs the type of the message.
impl<'de> Deserialize<'de> for ReadMessage {
    fn deserialize<D: Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(D::Error::custom("read without its type"))
    }
}

#[derive(Clone, Copy)]
struct Seed<'a> {
    of: LiveType,
    clock: &'a RosClock,
}

impl<'de> DeserializeSeed<'de> for Seed<'_> {
    type Value = ReadMessage;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<ReadMessage, D::Error> {
        // the message has arrived by now
        self.of
            .seed(self.clock.now_ns())
            .deserialize(deserializer)
            .map(ReadMessage)
    }
}

/// A topic of poses or wrenches, with its published type.
struct SampleTopic {
    name: &'static str,
    /// absolute, remapped
    whole: String,
    /// DDS name
    wire_name: String,
    profile: QosProfile,
    source: SampleSource,
    of: LiveType,
    subscription: Subscription<ReadMessage>,
    /// number of examined changes of the published types
    seen: u64,
    node: BegunNode,
    graph: Arc<Mutex<DdsGraph>>,
    exchange: Arc<PortState>,
    /// index of its counter of lost messages
    counter: usize,
    numbers: LastNumbers,
}

impl SubscribesSamples for DdsBackEnd<'_> {
    fn subscribe_samples(&mut self, topic: Topic, source: SampleSource) -> Result<(), RosError> {
        let (profile, whole) = (profile(topic), self.config.resolve(topic.name)?);
        let of = source.first_type();
        let announced = topic_of(of.name(), &self.node, &whole, &profile)?;
        let subscription = self
            .node
            .create_subscription(&announced, Some(profile.clone()));
        let subscription = subscription.during("subscribing to a topic")?;
        let wire_name = announced.name();
        let mut graph = locked(&self.graph);
        graph.add(subscription.guid(), &announced, whole.clone());
        graph.watch_types(&wire_name);
        drop(graph);
        self.listeners.push(Box::new(SampleTopic {
            name: topic.name,
            whole,
            wire_name,
            profile,
            source,
            of,
            subscription,
            seen: 0,
            node: self.begun.clone(),
            graph: self.graph.clone(),
            exchange: self.exchange.clone(),
            counter: usize::from(!topic.name.ends_with("wrench")),
            numbers: LastNumbers::default(),
        }));
        Ok(())
    }
}

impl SampleTopic {
    /// Subscribes to another type.
    fn listen_to(&mut self, of: LiveType) -> Result<(), RosError> {
        let node = self
            .node
            .get()
            .ok_or("the node begins")
            .during("changing the type of a topic")?;
        let mut node = locked(node);
        let announced = topic_of(of.name(), &node, &self.whole, &self.profile)?;
        let subscription = node.create_subscription(&announced, Some(self.profile.clone()));
        let subscription = subscription.during("subscribing to a topic")?;
        let mut graph = locked(&self.graph);
        graph.remove(self.subscription.guid());
        graph.add(subscription.guid(), &announced, self.whole.clone());
        (self.of, self.subscription, self.numbers) = (of, subscription, LastNumbers::default());
        Ok(())
    }
}

impl Listener for SampleTopic {
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()> {
        each(&mut self.subscription)
    }

    fn take(&mut self) {
        let Self {
            name,
            subscription,
            source,
            of,
            exchange,
            counter,
            numbers,
            ..
        } = self;
        drain(
            (*name, exchange, ""),
            || {
                subscription.take_seed(Seed {
                    of: *of,
                    clock: &exchange.clock,
                })
            },
            |(ReadMessage(read), info)| {
                let lost = numbers.missing(info.publisher_gid(), info.sequence_number());
                exchange.lost[*counter].fetch_add(lost, Ordering::Relaxed);
                exchange.inbox.put(source.arrival(name, *of, read));
            },
        );
    }

    fn has_changed(&mut self) -> bool {
        // nothing changes before the start of the node
        if self.node.get().is_none() {
            return false;
        }
        let graph = locked(&self.graph);
        let Some((seen, published)) = graph
            .published_types(&self.wire_name)
            .filter(|(seen, _)| *seen != self.seen)
        else {
            return false;
        };
        let (of, unread) = self
            .source
            .choose(self.of, published.iter().map(String::as_str));
        drop(graph);
        self.seen = seen;
        locked(&self.graph).set_unread(&self.whole, unread);
        if of == self.of {
            return false;
        }
        match self.listen_to(of) {
            Ok(()) => {
                tracing::info!(
                    topic = self.whole,
                    type_name = of.name(),
                    "listens to the type that is published"
                );
                true
            }
            Err(error) => {
                tracing::error!(topic = self.whole, type_name = of.name(), %error, "cannot listen to what is published");
                false
            }
        }
    }
}
