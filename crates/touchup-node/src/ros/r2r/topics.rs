//! Topics as publishers and subscriptions of r2r.

use r2r::WrappedTypesupport;
use r2r::qos::QosProfile;

use super::back_end::{R2rBackEnd, RclErrorContext, source};
use super::convert::Convert;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::messages::RosMessage;
use crate::ros::port::Arrival;
use crate::ros::sample_source::SampleSource;
use crate::ros::send_queue::SendOutcome;
use crate::ros::topics::{MESH, Publisher, Publishes, Subscribes, SubscribesSamples, Topic};

pub(super) fn profile(topic: Topic) -> QosProfile {
    let profile = if topic.is_reliable {
        QosProfile::default().reliable()
    } else {
        QosProfile::sensor_data()
    };
    let profile = if topic.is_latched {
        profile.transient_local()
    } else {
        profile
    };
    profile.keep_last(topic.depth)
}

impl<M> Publishes<M> for R2rBackEnd<'_>
where
    M: RosMessage + Convert<Theirs: WrappedTypesupport + 'static>,
{
    fn publisher(&mut self, topic: Topic) -> Result<Publisher<M>, RosError> {
        let publisher = self
            .node
            .create_publisher::<M::Theirs>(topic.name, profile(topic));
        let publisher = publisher.during("publishing a topic")?;
        self.graph.watch_listeners(
            self.config.resolve(topic.name)?,
            topic == MESH,
            publisher.clone(),
        );
        Ok(Box::new(move |message| {
            match publisher.publish(&message.theirs()) {
                Ok(()) => SendOutcome::Done,
                Err(error) => {
                    tracing::warn!(topic_type = M::TYPE_NAME, %error, "a message is not sent");
                    SendOutcome::Refused
                }
            }
        }))
    }
}

impl<M> Subscribes<M> for R2rBackEnd<'_>
where
    M: RosMessage + Convert<Theirs: WrappedTypesupport + Send + 'static>,
{
    fn subscribe(
        &mut self,
        topic: Topic,
        arrival: fn(&PortState, M) -> Arrival,
    ) -> Result<(), RosError> {
        let profile = profile(topic);
        let messages = self
            .node
            .subscribe::<M::Theirs>(topic.name, profile.clone());
        let messages = messages.during("subscribing to a topic")?;
        self.graph
            .watch_senders(self.config.resolve(topic.name)?, M::TYPE_NAME, profile);
        let exchange = self.exchange.clone();
        self.sources.push(source(messages, move |message| {
            exchange.inbox.put(arrival(&exchange, M::ours(message)));
        }));
        Ok(())
    }
}

impl SubscribesSamples for R2rBackEnd<'_> {
    /// Subscribes with the parameter's type, else with the publisher's at the node's start: r2r
    /// finds the code of a type by name, if built with it.
    fn subscribe_samples(&mut self, topic: Topic, samples: SampleSource) -> Result<(), RosError> {
        let (profile, whole) = (profile(topic), self.config.resolve(topic.name)?);
        let known = self
            .node
            .get_publishers_info_by_topic(&whole, false)
            .unwrap_or_default();
        let published = known.iter().map(|sender| sender.topic_type.as_str());
        let (of, unread) = samples.choose(samples.first_type(), published);
        if let Some(why) = unread {
            tracing::warn!(topic = whole, "{why}");
        }
        let messages = self
            .node
            .subscribe_raw(topic.name, of.name(), profile.clone());
        let messages = messages.during("subscribing to a topic")?;
        self.graph.watch_senders(whole, of.name(), profile);
        let (name, exchange) = (topic.name, self.exchange.clone());
        self.sources.push(source(messages, move |payload: Vec<u8>| {
            exchange.inbox.put(samples.arrival(
                name,
                of,
                of.decode(&payload, exchange.clock.now_ns()),
            ));
        }));
        Ok(())
    }
}
