//! Has RustDDS match our readers and writers again with those of a participant that it meets for
//! the second time.
//!
//! RustDDS 0.15 keeps the readers and writers of a forgotten participant, and has them again when
//! it meets the participant again; the participant itself does not announce them anew. But RustDDS
//! matches them with ours only when one of ours begins on their topic. So this module starts one
//! for a moment.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::dds::CreateResult;
use ros2_client::dds::rustdds::no_key::{DataWriter, SimpleDataReader};
use ros2_client::dds::rustdds::policy::{Durability, Reliability};
use ros2_client::dds::rustdds::{
    CDRDeserializerAdapter, CDRSerializerAdapter, DomainParticipant, EndpointDescription, GUID,
    QosPolicyBuilder, TopicKind,
};

/// Maximum number of remembered remote endpoints.
const MOST_ENDPOINTS: usize = 4096;
/// Lifetime of an endpoint of ours: RustDDS takes a few milliseconds.
const MOMENT: Duration = Duration::from_secs(1);

/// A remote reader or writer.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct RemoteEndpoint {
    topic: String,
    type_name: String,
    is_reader: bool,
}

/// An endpoint of ours without any reads or writes.
enum Momentary {
    Reader(#[expect(dead_code)] SimpleDataReader<(), CDRDeserializerAdapter<()>>),
    Writer(#[expect(dead_code)] DataWriter<(), CDRSerializerAdapter<()>>),
}

/// Remote endpoints matched with ours.
pub(super) struct Rematch {
    participant: DomainParticipant,
    /// RustDDS describes an endpoint before it reports a match
    described: Option<(GUID, RemoteEndpoint)>,
    matched: BTreeMap<GUID, RemoteEndpoint>,
    begun: Vec<(Instant, Momentary)>,
}

impl Rematch {
    pub fn new(participant: DomainParticipant) -> Self {
        Self {
            participant,
            described: None,
            matched: BTreeMap::new(),
            begun: Vec::new(),
        }
    }

    /// Notes a description of a remote reader or writer.
    pub fn described(&mut self, endpoint: &EndpointDescription, is_reader: bool) {
        let remote = RemoteEndpoint {
            topic: endpoint.topic_name.clone(),
            type_name: endpoint.type_name.clone(),
            is_reader,
        };
        self.described = Some((endpoint.guid, remote));
    }

    /// Notes that the described endpoint matches one of ours.
    pub fn matched(&mut self, remote: GUID) {
        if let Some((_, endpoint)) = self.described.as_ref().filter(|(guid, _)| *guid == remote)
            && self.matched.len() < MOST_ENDPOINTS
        {
            self.matched.insert(remote, endpoint.clone());
        }
    }

    /// Forgets endpoints that have left.
    pub fn left(&mut self, is_gone: impl Fn(&GUID) -> bool) {
        self.matched.retain(|guid, _| !is_gone(guid));
    }

    /// Handles a meeting with the participant of these endpoints; rematches those matched before.
    ///
    /// # Errors
    /// Those of RustDDS, with the refused request.
    pub fn met(&mut self, is_of: impl Fn(&GUID) -> bool, now: Instant) -> CreateResult<()> {
        let of_it = self.matched.iter().filter(|(guid, _)| is_of(guid));
        let again: BTreeSet<_> = of_it.map(|(_, endpoint)| endpoint.clone()).collect();
        for endpoint in again {
            self.begun.push((now, self.begin(endpoint)?));
        }
        Ok(())
    }

    /// Ends endpoints of ours whose moment is over.
    pub fn look(&mut self, now: Instant) {
        self.begun
            .retain(|(begun, _)| now.saturating_duration_since(*begun) < MOMENT);
    }

    /// Starts an endpoint of ours that fits all: a reader requests least, a writer offers most.
    fn begin(&self, remote: RemoteEndpoint) -> CreateResult<Momentary> {
        let RemoteEndpoint {
            topic,
            type_name,
            is_reader,
        } = remote;
        let (reliability, durability) = if is_reader {
            let max_blocking_time = MOMENT.into();
            (
                Reliability::Reliable { max_blocking_time },
                Durability::TransientLocal,
            )
        } else {
            (Reliability::BestEffort, Durability::Volatile)
        };
        let qos = QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .build();
        let participant = &self.participant;
        let topic = participant.create_topic(topic, type_name, &qos, TopicKind::NoKey)?;
        if is_reader {
            let publisher = participant.create_publisher(&qos)?;
            let writer = publisher.create_datawriter_no_key(&topic, None)?;
            return Ok(Momentary::Writer(writer));
        }
        let subscriber = participant.create_subscriber(&qos)?;
        let reader = subscriber.create_simple_datareader_no_key(&topic, None)?;
        Ok(Momentary::Reader(reader))
    }
}
