//! Other participants on our topics, and reasons for their mismatches.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::dds::rustdds::policy::Durability;
use ros2_client::dds::rustdds::{
    DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, GUID, LostReason,
    QosPolicies, RTPSEntity, StatusEvented, Topic, TopicDescription,
};
use ros2_client::{Context, ServiceMapping};

use super::incoming::Listener;
use super::keep_alive::{KeepAlive, LOOK_EVERY};
use super::rematch::Rematch;
use super::sockets::{OpenSockets, guard};
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::port::Arrival;

/// Vendors by their number on the wire; each knows only one mapping of services.
const FAST_DDS: [u8; 2] = [0x01, 0x0f];
const CYCLONE_DDS: [u8; 2] = [0x01, 0x10];
/// Maximum number of remembered participants; a domain holds 120.
const MOST_PARTICIPANTS: usize = 1024;
/// Maximum number of remembered callers of services.
const MOST_CALLERS: usize = 4096;

/// Publishers of one topic and their types.
#[derive(Default)]
struct PublishedTypes {
    /// number of changes
    changes: u64,
    /// types as named in ROS 2
    writers: BTreeMap<GUID, String>,
}

/// Maximum number of publishers of a sample topic.
const MOST_WRITERS: usize = 64;

pub(super) struct DdsGraph {
    listener: DomainParticipantStatusListener,
    /// `None` if its ports are not available
    keep_alive: Option<KeepAlive>,
    rematch: Rematch,
    exchange: Arc<PortState>,
    mapping: ServiceMapping,
    own: GUID,
    /// ROS name and type of our topics, by their name in DDS
    topics: BTreeMap<String, (String, String)>,
    /// published types of our sample topics
    published: BTreeMap<String, PublishedTypes>,
    /// reason why a topic is unreadable, by its name in ROS
    unread: BTreeMap<String, String>,
    /// ROS names of our services
    pub services: Vec<String>,
    /// our readers and writers: ROS name of the topic, and matched remotes
    matched: BTreeMap<GUID, (String, BTreeSet<GUID>)>,
    /// endpoints of service callers: the service in ROS, and the log text once both sides know each
    /// other
    callers: BTreeMap<GUID, (String, &'static str)>,
    /// vendors of the other participants
    vendors: BTreeMap<GUID, [u8; 2]>,
    /// endpoints already reported
    reported: BTreeSet<GUID>,
    /// writer of tiles
    pub tiles: Option<GUID>,
}

impl DdsGraph {
    /// Follows other participants from now on.
    ///
    /// # Errors
    /// [`RosError`]: for this computer alone, a socket that does not close to others.
    pub fn new(
        context: &Context,
        exchange: &Arc<PortState>,
        config: &NodeConfig,
    ) -> Result<Self, RosError> {
        let participant = context.domain_participant();
        let before = OpenSockets::now();
        let own = participant.guid();
        let keep_alive = KeepAlive::new(config.domain_id, participant.participant_id(), own);
        let keep_alive = keep_alive.inspect_err(
            |error| tracing::warn!(%error, "who is out of reach for some seconds is not met again"),
        );
        guard(before, config.localhost_only)?;
        Ok(Self {
            listener: participant.status_listener(),
            keep_alive: keep_alive.ok(),
            exchange: exchange.clone(),
            mapping: mapping(config),
            own,
            rematch: Rematch::new(participant),
            topics: BTreeMap::new(),
            published: BTreeMap::new(),
            unread: BTreeMap::new(),
            services: Vec::new(),
            matched: BTreeMap::new(),
            callers: BTreeMap::new(),
            vendors: BTreeMap::new(),
            reported: BTreeSet::new(),
            tiles: None,
        })
    }

    /// Adds a reader or writer of ours, and the ROS name of its topic.
    pub fn add(&mut self, guid: GUID, topic: &Topic, name: String) {
        self.topics.insert(
            topic.name(),
            (name.clone(), topic.get_type().name().to_owned()),
        );
        self.matched.insert(guid, (name, BTreeSet::new()));
    }

    /// Removes a reader or writer of ours.
    pub fn remove(&mut self, guid: GUID) {
        self.matched.remove(&guid);
    }

    /// Notes the published types of a topic from now on.
    ///
    /// - `topic`: its DDS name.
    pub fn watch_types(&mut self, topic: &str) {
        self.published.entry(topic.to_owned()).or_default();
    }

    /// Number of changes of the published types, and the current ones.
    pub fn published_types(&self, topic: &str) -> Option<(u64, BTreeSet<String>)> {
        let published = self.published.get(topic)?;
        Some((
            published.changes,
            published.writers.values().cloned().collect(),
        ))
    }

    /// Sets the reason why a topic is unreadable; reports a new reason.
    pub fn set_unread(&mut self, name: &str, why: Option<String>) {
        if self.unread.get(name) == why.as_ref() {
            return;
        }
        match why {
            Some(why) => drop(self.unread.insert(name.to_owned(), why)),
            None => drop(self.unread.remove(name)),
        }
        let locals: Vec<_> = self
            .matched
            .iter()
            .filter(|(_, (of, _))| of == name)
            .map(|(guid, _)| *guid)
            .collect();
        locals
            .into_iter()
            .for_each(|local| self.report(local, None));
    }

    /// Period of checks for silent participants; `None` without a keep-alive.
    pub fn look_every(&self) -> Option<Duration> {
        self.keep_alive.as_ref().map(|_| LOOK_EVERY)
    }

    /// Remembers participants that RustDDS may forget, and has it rematch them on their return.
    fn remember(&mut self, event: &Event) {
        match event {
            Event::ParticipantDiscovered { dpd } => {
                let prefix = dpd.guid.prefix;
                let matched = self
                    .rematch
                    .met(|guid| guid.prefix == prefix, Instant::now());
                if let Err(error) = matched {
                    tracing::warn!(
                        ?error,
                        "not all topics of a program that came back are heard"
                    );
                }
                if let Some(keep_alive) = &mut self.keep_alive {
                    keep_alive.met(prefix.as_ref());
                }
            }
            Event::ReaderDetected { reader: other } | Event::WriterDetected { writer: other } => {
                let is_reader = matches!(event, Event::ReaderDetected { .. });
                self.rematch.described(other, is_reader);
            }
            Event::RemoteReaderMatched {
                remote_reader: remote,
                ..
            }
            | Event::RemoteWriterMatched {
                remote_writer: remote,
                ..
            } if remote.prefix != self.own.prefix => {
                self.rematch.matched(*remote);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                self.rematch.left(|other| other == guid);
            }
            Event::ParticipantLost {
                id,
                reason: LostReason::Disposed,
            } => {
                self.rematch.left(|guid| guid.prefix == *id);
                if let Some(keep_alive) = &mut self.keep_alive {
                    keep_alive.left(id.as_ref());
                }
            }
            Event::ParticipantLost {
                id,
                reason: LostReason::Timeout { .. },
            } => {
                if let Some(keep_alive) = &mut self.keep_alive {
                    keep_alive.lost(id.as_ref(), Instant::now());
                }
            }
            _ => {}
        }
    }

    fn vendor(&self, guid: GUID) -> Option<[u8; 2]> {
        let mut vendors = self.vendors.iter();
        let vendor = vendors.find(|(participant, _)| participant.prefix == guid.prefix);
        vendor.map(|(_, vendor)| *vendor)
    }

    fn on(&mut self, event: Event) {
        self.remember(&event);
        if let Event::RemoteWriterMatched {
            local_reader,
            remote_writer,
        } = &event
            && self.vendor(*remote_writer) == Some(FAST_DDS)
            && let Some(keep_alive) = &self.keep_alive
        {
            keep_alive.ask(*local_reader, *remote_writer);
        }
        match event {
            Event::ParticipantDiscovered { dpd } if self.vendors.len() < MOST_PARTICIPANTS => {
                self.vendors.insert(dpd.guid, dpd.vendor_id.as_bytes());
            }
            Event::ParticipantLost { id, .. } => {
                self.vendors.retain(|guid, _| guid.prefix != id);
                self.callers.retain(|guid, _| guid.prefix != id);
                self.reported.retain(|guid| guid.prefix != id);
                self.unmatch(|guid| guid.prefix == id);
            }
            // ignores the node's own publications
            Event::WriterDetected { writer }
                if self.published.contains_key(&writer.topic_name)
                    && writer.guid.prefix == self.own.prefix => {}
            Event::WriterDetected { writer } if self.published.contains_key(&writer.topic_name) => {
                self.note_published(writer.guid, &writer.topic_name, &writer.type_name);
            }
            Event::ReaderDetected { reader: other } | Event::WriterDetected { writer: other } => {
                self.seen(other.guid, &other.topic_name, &other.type_name);
            }
            Event::RemoteReaderMatched {
                local_writer: local,
                remote_reader: remote,
            }
            | Event::RemoteWriterMatched {
                local_reader: local,
                remote_writer: remote,
            } => {
                self.note_match(local, remote);
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                self.reported.remove(&guid);
                self.callers.remove(&guid);
                self.unmatch(|other| *other == guid);
            }
            Event::RemoteReaderQosIncompatible {
                local_writer: local,
                remote_reader: remote,
                requested_qos,
                offered_qos,
            } => self.misfit(local, remote, &requested_qos, &offered_qos, "a listener"),
            Event::RemoteWriterQosIncompatible {
                local_reader: local,
                remote_writer: remote,
                requested_qos,
                offered_qos,
            } => self.misfit(local, remote, &requested_qos, &offered_qos, "a sender"),
            _ => {}
        }
    }

    fn note_match(&mut self, local: GUID, remote: GUID) {
        let is_new = self
            .matched
            .get_mut(&local)
            .is_some_and(|(_, others)| others.insert(remote));
        if is_new {
            self.report(local, None);
        }
        if let Some((service, what)) = self.callers.get(&remote) {
            tracing::info!(service, "{what}");
        }
    }

    fn note_published(&mut self, writer: GUID, topic: &str, type_name: &str) {
        let Some(published) = self.published.get_mut(topic) else {
            return;
        };
        let type_name = ros_type(type_name);
        let is_room =
            published.writers.len() < MOST_WRITERS || published.writers.contains_key(&writer);
        if is_room && published.writers.insert(writer, type_name.clone()) != Some(type_name) {
            published.changes += 1;
        }
    }

    fn unmatch(&mut self, is_gone: impl Fn(&GUID) -> bool) {
        for published in self.published.values_mut() {
            let count = published.writers.len();
            published.writers.retain(|writer, _| !is_gone(writer));
            published.changes += u64::from(published.writers.len() < count);
        }
        let mut fewer = Vec::new();
        for (local, (_, others)) in &mut self.matched {
            let count = others.len();
            others.retain(|other| !is_gone(other));
            if others.len() < count {
                fewer.push(*local);
            }
        }
        fewer.into_iter().for_each(|local| self.report(local, None));
    }

    fn misfit(
        &mut self,
        local: GUID,
        remote: GUID,
        wanted: &QosPolicies,
        offered: &QosPolicies,
        who: &str,
    ) {
        if self.reported.insert(remote) {
            self.report(
                local,
                Some(format!(
                    "{who} does not fit: {}",
                    difference(wanted, offered)
                )),
            );
        }
    }

    /// Checks the type and the service mapping of a remote endpoint on a topic or service of ours.
    fn seen(&mut self, guid: GUID, topic: &str, type_name: &str) {
        if guid.prefix == self.own.prefix {
            return;
        }
        let asked = service_of(topic, "rq", "Request");
        if self.callers.len() < MOST_CALLERS {
            let what = [
                (asked, "a caller is heard"),
                (service_of(topic, "rr", "Reply"), "a caller can be answered"),
            ];
            for (service, what) in what {
                self.callers
                    .extend(service.map(|service| (guid, (service.to_owned(), what))));
            }
        }
        if let Some((name, ours)) = self.topics.get(topic) {
            if ours != type_name && self.reported.insert(guid) {
                let reason =
                    format!("somebody has it with the type {type_name}, here it is {ours}");
                let of_topic = self.matched.values().filter(|(own, _)| own == name);
                let count = of_topic.map(|(_, others)| others.len()).sum();
                self.exchange
                    .inbox
                    .report(name.clone(), count, Some(reason));
            }
            return;
        }
        let wants = match self.vendor(guid) {
            Some(CYCLONE_DDS) => ServiceMapping::Cyclone,
            Some(FAST_DDS) => ServiceMapping::Enhanced,
            _ => return,
        };
        let Some(service) = asked else { return };
        if self.services.iter().any(|own| own == service)
            && wants != self.mapping
            && self.reported.insert(guid)
        {
            let right = if wants == ServiceMapping::Cyclone {
                "cyclone"
            } else {
                "enhanced"
            };
            let reason = format!(
                "somebody who calls it has another header: start this node with -p service_mapping:={right}, or all with one RMW"
            );
            self.exchange
                .inbox
                .report(service.to_owned(), 1, Some(reason));
        }
    }

    fn report(&self, local: GUID, mismatch: Option<String>) {
        if let Some((name, others)) = self.matched.get(&local) {
            let mismatch = mismatch.or_else(|| self.unread.get(name).cloned());
            if self.tiles == Some(local) {
                self.exchange.inbox.put(Arrival::Viewers(others.len()));
            }
            self.exchange
                .inbox
                .report(name.clone(), others.len(), mismatch);
        }
    }
}

/// ROS name of a type from its DDS name.
fn ros_type(wire_name: &str) -> String {
    let plain = wire_name.replace("::dds_::", "::");
    plain.strip_suffix('_').unwrap_or(&plain).replace("::", "/")
}

/// The service of a topic of requests or answers.
fn service_of<'a>(topic: &'a str, before: &str, after: &str) -> Option<&'a str> {
    topic.strip_prefix(before)?.strip_suffix(after)
}

/// The requested quality of service that is not offered.
fn difference(wanted: &QosPolicies, offered: &QosPolicies) -> String {
    if wanted.is_reliable() && !offered.is_reliable() {
        return "it wants reliable, offered is best effort".to_owned();
    }
    let latched =
        |qos: &QosPolicies| !matches!(qos.durability(), None | Some(Durability::Volatile));
    if latched(wanted) && !latched(offered) {
        return "it wants transient local, offered is volatile".to_owned();
    }
    match offered.compliance_failure_wrt(wanted) {
        Some(policy) => format!("the quality of service {policy:?} that it wants is not offered"),
        None => "its quality of service".to_owned(),
    }
}

/// The topics that follow published types query the graph, on the same thread.
impl Listener for Arc<Mutex<DdsGraph>> {
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut graph = locked(self);
        each(graph.listener.as_status_source_mio1())?;
        graph
            .keep_alive
            .iter_mut()
            .flat_map(|keep_alive| &mut keep_alive.sockets)
            .try_for_each(|socket| each(socket))
    }

    fn take(&mut self) {
        let mut graph = locked(self);
        while let Some(event) = graph.listener.try_recv_status() {
            graph.on(event);
        }
        if let Some(keep_alive) = &mut graph.keep_alive {
            keep_alive.take();
        }
        graph.rematch.look(Instant::now());
    }
}

/// Mapping of services, by the parameter.
pub(super) fn mapping(config: &NodeConfig) -> ServiceMapping {
    match config.parameters.string("service_mapping") {
        "cyclone" => ServiceMapping::Cyclone,
        _ => ServiceMapping::Enhanced,
    }
}
