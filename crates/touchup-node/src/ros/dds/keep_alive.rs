//! Waits for silent participants longer than RustDDS does, and has it meet forgotten ones again:
//! after an unplugged cable, a stopped program, a sleeping computer, a lost packet.
//!
//! A participant shows that it is alive by announcing itself every few seconds (RTPS 2.5, 8.5.3),
//! and listeners forget it after silence for its lease: CycloneDDS has a lease of 10 s and
//! announces itself every 8 s, so one lost packet is enough. So this module repeats the last
//! announcement to RustDDS until the participant has been silent for [`PATIENCE`], unless its
//! computer reports the end of the program.
//!
//! RustDDS 0.15 never meets a forgotten participant again: others repeat their announcement under
//! its old number, and RustDDS skips messages with a known number. This module passes on the
//! announcement of a returning participant under a new number. [`super::rematch`] does the rest.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::GUID;
use ros2_client::dds::rustdds::mio1::net::UdpSocket as MioSocket;
use socket2::{Domain, Protocol, Socket, Type};

use super::first_request;

/// Maximum silence of a participant. RustDDS asks the others for 50 s and announces itself every 10
/// s: beyond 40 s of silence they may have forgotten us, and both sides begin anew.
const PATIENCE: Duration = Duration::from_secs(40);
/// Period of checks for silent participants.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Multicast group of announcements (RTPS 2.5, 9.6.2.4.1).
const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
/// Ports of the first domain, and steps per domain and per participant (RTPS 2.5, 9.6.2.3).
const MULTICAST_PORT: u32 = 7400;
const UNICAST_PORT: u32 = 7410;
const PORTS_OF_A_DOMAIN: u32 = 250;
const PORTS_OF_A_PARTICIPANT: u32 = 2;
/// Number of participants of a computer whose ports get the announcements of one without multicast,
/// as in rmw_fastrtps and rmw_cyclonedds for programs of one computer.
const ASKED_PARTICIPANTS: u32 = 32;
/// Maximum number of remembered participants; a domain holds 120.
const MOST_PARTICIPANTS: usize = 1024;
/// Maximum size of a datagram.
const LARGEST_DATAGRAM: usize = 1 << 16;
/// Maximum size of a stored announcement: a ROS participant's has some 500 bytes.
const LARGEST_ANNOUNCEMENT: usize = 1 << 13;

/// Identifier of a participant on the wire.
type Prefix = [u8; 12];

/// The participants of a domain, by their announcements.
pub(super) struct KeepAlive {
    /// wake the reading thread: one receives announcements to all, one answers of our readers, one
    /// has the port of a participant of this computer and receives announcements to each
    pub sockets: Vec<MioSocket>,
    answers_port: u16,
    /// next number of a forwarded announcement
    next_number: i64,
    /// our own participant, and its port
    own: Prefix,
    own_port: u16,
    known: BTreeMap<Prefix, KnownParticipant>,
    datagram: Vec<u8>,
}

struct KnownParticipant {
    /// the last announcement
    datagram: Vec<u8>,
    from: SocketAddr,
    heard: Instant,
    /// silence after which RustDDS forgets it
    lease: Duration,
    /// time of the last announcement to RustDDS, from here or from the participant
    renewed: Instant,
    state: PeerState,
}

enum PeerState {
    Heard,
    /// long silent: asked its computer whether the program still has its port; `None` without a
    /// route
    Asked(Option<UdpSocket>),
    /// the program has ended
    Ended,
    /// RustDDS has forgotten it
    Lost,
}

impl KnownParticipant {
    /// Whether RustDDS needs an announcement of it soon.
    fn is_due(&self, now: Instant) -> bool {
        let early = (self.lease / 2).min(3 * LOOK_EVERY);
        let silent = now.saturating_duration_since(self.heard);
        !matches!(self.state, PeerState::Ended | PeerState::Lost)
            && now.saturating_duration_since(self.renewed) >= self.lease - early
            && silent + self.lease <= PATIENCE
    }

    /// Whether it may have forgotten us while RustDDS still waits.
    fn is_forgotten_late(&self, now: Instant) -> bool {
        !matches!(self.state, PeerState::Ended | PeerState::Lost)
            && self.lease > PATIENCE
            && now.saturating_duration_since(self.heard) > PATIENCE
    }

    /// Sends its last announcement to our own participant, under a new number.
    ///
    /// - `lease_s`: replaces its lease; `None`: its own.
    fn hand_over(&self, next_number: &mut i64, lease_s: Option<i32>, own_port: u16) {
        let Some(announcement) = announcement(&self.datagram) else {
            return;
        };
        let mut datagram = self.datagram.clone();
        announcement.renumber(&mut datagram, *next_number, lease_s);
        *next_number += 1;
        let sent =
            way_from(self.from).and_then(|(way, own)| way.send_to(&datagram, (own, own_port)));
        if let Err(error) = sent {
            tracing::debug!(%error, "a silent participant may be forgotten too early");
        }
    }
}

impl KeepAlive {
    /// Listens beside RustDDS.
    ///
    /// # Errors
    /// Those of the system, if the port cannot be shared.
    pub fn new(domain_id: u16, participant_id: u16, own: GUID) -> Result<Self> {
        let offset = u32::from(domain_id) * PORTS_OF_A_DOMAIN;
        let port_of =
            |participant: u32| UNICAST_PORT + offset + participant * PORTS_OF_A_PARTICIPANT;
        let ports = [MULTICAST_PORT + offset, port_of(participant_id.into())].map(u16::try_from);
        let [Ok(port), Ok(own_port)] = ports else {
            return Err(Error::new(
                ErrorKind::InvalidInput,
                "this domain has no such port",
            ));
        };
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        socket.set_reuse_address(true)?;
        socket.set_reuse_port(true)?;
        socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, port)).into())?;
        socket.set_nonblocking(true)?;
        // on Linux a socket hears every group joined by any other, and RustDDS joins on each
        // interface
        if let Err(error) = socket.join_multicast_v4(&GROUP, &Ipv4Addr::UNSPECIFIED) {
            tracing::debug!(%error, "no route for multicast yet");
        }
        // participants take the first free port
        let free = (0..ASKED_PARTICIPANTS).rev().find_map(|participant| {
            let port = u16::try_from(port_of(participant)).ok()?;
            UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).ok()
        });
        let answers = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        answers.set_nonblocking(true)?;
        let answers_port = answers.local_addr()?.port();
        let mut sockets: Vec<_> = [socket.into(), answers].map(MioSocket::from_std).into();
        if let Some(free) = free {
            free.set_nonblocking(true)?;
            sockets.push(MioSocket::from_std(free));
        }
        Ok(Self {
            sockets,
            answers_port,
            next_number: FIRST_NUMBER,
            own: own.to_bytes().first_chunk().copied().unwrap_or_default(),
            own_port,
            known: BTreeMap::new(),
            datagram: vec![0; LARGEST_DATAGRAM],
        })
    }

    /// Handles a timeout of RustDDS for a participant, or after a pause of this process.
    pub fn lost(&mut self, prefix: &[u8], now: Instant) {
        let Ok(prefix) = Prefix::try_from(prefix) else {
            return;
        };
        let Some(known) = self.known.get_mut(&prefix) else {
            return;
        };
        let before = std::mem::replace(&mut known.state, PeerState::Lost);
        let silent = now.saturating_duration_since(known.heard);
        // this process stopped, not the other one
        if silent < known.lease.min(PATIENCE) {
            self.meet(prefix);
        } else if !matches!(before, PeerState::Ended) {
            tracing::warn!(
                address = %known.from.ip(), silent_s = silent.as_secs(),
                "a program there is out of reach: nothing of it is heard until it comes back"
            );
        }
    }

    /// Handles the farewell of a participant.
    pub fn left(&mut self, prefix: &[u8]) {
        if let Ok(prefix) = Prefix::try_from(prefix) {
            self.known.remove(&prefix);
        }
    }

    /// Has a writer of Fast DDS list its sent messages, see [`first_request`].
    ///
    /// - `reader`: ours.
    pub fn ask(&self, reader: GUID, writer: GUID) {
        let known = Prefix::try_from(writer.prefix.as_ref())
            .ok()
            .and_then(|prefix| self.known.get(&prefix));
        let Some(known) = known else {
            return;
        };
        let asked = way_from(known.from).and_then(|(way, own)| {
            let answers = SocketAddr::new(own, self.answers_port);
            let heartbeat = first_request::heartbeat(reader, writer, answers);
            // readers and writers have the port after the participant's
            let to = (own, self.own_port + 1);
            heartbeat.map_or(Ok(0), |heartbeat| way.send_to(&heartbeat, to))
        });
        if let Err(error) = asked {
            tracing::debug!(%error, "a first request may be heard late");
        }
    }

    /// Passes the answer of our reader on to the writer.
    fn pass_on(&self, answer: &[u8]) {
        let Ok(mut question) = <[u8; first_request::LENGTH]>::try_from(answer) else {
            return;
        };
        let to = first_request::question(&mut question, &self.own);
        let known = to.and_then(|prefix| self.known.get(&prefix));
        let place = known.and_then(|known| announcement(&known.datagram)?.listens);
        let sent = place
            .map(|place| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?.send_to(&question, place));
        if let Some(Err(error)) = sent {
            tracing::debug!(%error, "a first request may be heard late");
        }
    }

    /// Reads all waiting announcements, and checks for silent participants.
    pub fn take(&mut self) {
        let mut datagram = std::mem::take(&mut self.datagram);
        for number in 0..self.sockets.len() {
            loop {
                match self.sockets[number].recv_from(&mut datagram) {
                    Ok((length, from)) => self.hear(&datagram[..length], from, Instant::now()),
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    // empty; any other error ends the read as well
                    Err(_) => break,
                }
            }
        }
        self.datagram = datagram;
        self.look(Instant::now());
    }

    fn hear(&mut self, datagram: &[u8], from: SocketAddr, now: Instant) {
        let Some(Announcement { prefix, lease, .. }) = announcement(datagram) else {
            self.pass_on(datagram);
            return;
        };
        if prefix == self.own || datagram.len() > LARGEST_ANNOUNCEMENT {
            return;
        }
        let state = match self.known.get(&prefix).map(|known| &known.state) {
            Some(PeerState::Lost) => PeerState::Lost,
            None if self.known.len() >= MOST_PARTICIPANTS => {
                self.known.pop_first();
                PeerState::Heard
            }
            _ => PeerState::Heard,
        };
        let is_lost = matches!(state, PeerState::Lost);
        let known = KnownParticipant {
            datagram: datagram.to_vec(),
            from,
            heard: now,
            lease,
            renewed: now,
            state,
        };
        self.known.insert(prefix, known);
        if is_lost {
            self.meet(prefix);
        }
    }

    fn look(&mut self, now: Instant) {
        let (own_port, next_number) = (self.own_port, &mut self.next_number);
        for known in self.known.values_mut() {
            if known.is_forgotten_late(now) {
                known.lease = Duration::ZERO;
                known.hand_over(next_number, Some(0), own_port);
            }
            if !known.is_due(now) {
                continue;
            }
            let PeerState::Asked(asked) = &known.state else {
                known.state = PeerState::Asked(knock(known.from).ok());
                continue;
            };
            if asked.as_ref().is_some_and(is_refused) {
                known.state = PeerState::Ended;
                continue;
            }
            known.state = PeerState::Heard;
            known.renewed = now;
            known.hand_over(next_number, None, own_port);
        }
    }

    /// Has RustDDS meet a forgotten participant.
    fn meet(&mut self, prefix: Prefix) {
        if let Some(known) = self.known.get(&prefix) {
            known.hand_over(&mut self.next_number, None, self.own_port);
        }
    }

    /// Notes that RustDDS has met a participant.
    pub fn met(&mut self, prefix: &[u8]) {
        let known = Prefix::try_from(prefix)
            .ok()
            .and_then(|prefix| self.known.get_mut(&prefix));
        if let Some(known) = known.filter(|known| matches!(known.state, PeerState::Lost)) {
            tracing::warn!(address = %known.from.ip(), "a program there is met again");
            known.state = PeerState::Heard;
        }
    }
}

/// Sends an empty message to a participant's sending port. If the program has ended its computer
/// answers port unreachable (ICMP, RFC 792); over a broken route nobody answers.
fn knock(port: SocketAddr) -> Result<UdpSocket> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.set_nonblocking(true)?;
    socket.connect(port)?;
    socket.send(&[b"RTPS".as_slice(), &[2, 5], &[0; 14]].concat())?;
    Ok(socket)
}

fn is_refused(asked: &UdpSocket) -> bool {
    matches!(asked.take_error(), Ok(Some(error)) if error.kind() == ErrorKind::ConnectionRefused)
}

/// A socket to our own participant, and its address there: one of our addresses that reaches the
/// remote. From a loopback address RustDDS would conclude that the remote is on this computer; used
/// only without any route.
fn way_from(somebody: SocketAddr) -> Result<(UdpSocket, IpAddr)> {
    let way = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    let own: IpAddr = match way.connect(somebody) {
        Ok(()) => way.local_addr()?.ip(),
        Err(_) => Ipv4Addr::LOCALHOST.into(),
    };
    Ok((UdpSocket::bind((own, 0))?, own))
}

/// Length of the header of a message (RTPS 2.5, 9.4.4), which ends with the sender.
const HEADER: usize = 20;
/// Numbers of submessages (RTPS 2.5, 9.4.5.1.1).
const PAD: u8 = 0x01;
const INFO_TS: u8 = 0x09;
const INFO_SOURCE: u8 = 0x0c;
const DATA: u8 = 0x15;
/// Flags of a submessage DATA: byte order, parameters before the data, and data.
const LITTLE_ENDIAN: u8 = 0x01;
const HAS_PARAMETERS: u8 = 0x02;
const HAS_DATA: u8 = 0x04;
/// The writer of announcements (RTPS 2.5, 9.3.1.3).
const ANNOUNCER: [u8; 4] = [0x00, 0x01, 0x00, 0xc2];
/// Parameters (RTPS 2.5, 9.6.3): lease, address of readers and writers, and end of a list.
const LEASE: u16 = 0x0002;
const LISTENS: u16 = 0x0031;
const SENTINEL: u16 = 0x0001;
/// The kind of such an address (RTPS 2.5, 9.3.2.4).
const UDP_V4: u32 = 1;
/// First number of forwarded announcements: no participant counts that far.
const FIRST_NUMBER: i64 = 1 << 40;
/// Lease that RustDDS assumes for an announcement without one.
const DEFAULT_LEASE: Duration = Duration::from_secs(60);

fn short(bytes: &[u8], at: usize, is_little_endian: bool) -> Option<u16> {
    let bytes = *bytes.get(at..)?.first_chunk()?;
    Some(if is_little_endian {
        u16::from_le_bytes(bytes)
    } else {
        u16::from_be_bytes(bytes)
    })
}

/// The announcement of a participant, and positions in its datagram.
#[derive(Debug, PartialEq, Eq)]
struct Announcement {
    prefix: Prefix,
    lease: Duration,
    /// address of its readers and writers
    listens: Option<SocketAddr>,
    /// position of its number, and its byte order
    number: (usize, bool),
    /// position of the seconds of its lease, and their byte order
    lease_s: Option<(usize, bool)>,
}

impl Announcement {
    /// Reads its data, which end at a position of the datagram; `None` for invalid data.
    fn take_from(&mut self, data: &[u8], end: usize) -> Option<()> {
        // the data has its own byte order: an even number is big endian
        let is_little_endian = data.get(1)? & 1 != 0;
        let word = |bytes: [u8; 4]| {
            if is_little_endian {
                u32::from_le_bytes(bytes)
            } else {
                u32::from_be_bytes(bytes)
            }
        };
        parameters(data.get(4..)?, is_little_endian, |id, value, left| {
            if let (LEASE, Some(seconds)) = (id, value.first_chunk()) {
                let seconds = u64::from(word(*seconds));
                // the highest bit is a sign
                let is_negative = seconds > i32::MAX as u64;
                self.lease = Duration::from_secs(if is_negative { 0 } else { seconds });
                self.lease_s = Some((end - left, is_little_endian));
            }
            // kind, port, address with IPv4 in its last four bytes
            if let (LISTENS, Some((head, tail))) = (id, value.split_first_chunk::<8>())
                && let (Some(kind), Some(port)) = (head.first_chunk(), head.last_chunk())
                && (self.listens, word(*kind)) == (None, UDP_V4)
                && let (Some(address), Ok(port)) =
                    (tail.last_chunk::<4>(), u16::try_from(word(*port)))
            {
                self.listens = Some(SocketAddr::from((*address, port)));
            }
        })
        .map(drop)
    }

    /// Writes another number and another lease into its datagram.
    fn renumber(&self, datagram: &mut [u8], number: i64, lease_s: Option<i32>) {
        let mut put = |(at, is_little_endian): (usize, bool), value: i32| {
            let bytes = if is_little_endian {
                value.to_le_bytes()
            } else {
                value.to_be_bytes()
            };
            datagram[at..at + 4].copy_from_slice(&bytes);
        };
        let (at, is_little_endian) = self.number;
        // the high half comes first (RTPS 2.5, 9.3.2.3)
        put((at, is_little_endian), (number >> 32) as i32);
        put((at + 4, is_little_endian), number as i32);
        if let (Some(place), Some(lease_s)) = (self.lease_s, lease_s) {
            put(place, lease_s);
        }
    }
}

/// The announcement in an RTPS datagram; `None` for anything else.
fn announcement(datagram: &[u8]) -> Option<Announcement> {
    if !datagram.starts_with(b"RTPS") {
        return None;
    }
    let prefix = Prefix::try_from(datagram.get(HEADER - 12..HEADER)?).ok()?;
    let mut at = HEADER;
    loop {
        let &[id, flags] = datagram.get(at..)?.first_chunk()?;
        let is_little_endian = flags & LITTLE_ENDIAN != 0;
        let length = usize::from(short(datagram, at + 2, is_little_endian)?);
        let end = if length == 0 && id != PAD && id != INFO_TS {
            datagram.len()
        } else {
            at + 4 + length
        };
        let body = datagram.get(at + 4..end)?;
        if id == DATA && flags & HAS_DATA != 0 && body.get(8..12) == Some(&ANNOUNCER) {
            // more flags, offset of the data, reader, writer, and then the number
            body.get(12..20)?;
            let number = (at + 16, is_little_endian);
            let skipped = 4 + usize::from(short(body, 2, is_little_endian)?);
            let mut data = body.get(skipped..)?;
            if flags & HAS_PARAMETERS != 0 {
                data = parameters(data, is_little_endian, |_, _, _| {})?;
            }
            let mut read = Announcement {
                prefix,
                lease: DEFAULT_LEASE,
                listens: None,
                number,
                lease_s: None,
            };
            read.take_from(data, end)?;
            return Some(read);
        }
        // the rest would be from another sender
        if id == INFO_SOURCE {
            return None;
        }
        at = end;
    }
}

/// Reads a list of parameters: number, value, and number of bytes from the value on; returns the
/// bytes after the list.
fn parameters(
    mut bytes: &[u8],
    is_little_endian: bool,
    mut each: impl FnMut(u16, &[u8], usize),
) -> Option<&[u8]> {
    loop {
        let id = short(bytes, 0, is_little_endian)?;
        let length = usize::from(short(bytes, 2, is_little_endian)?);
        if id == SENTINEL {
            return bytes.get(4..);
        }
        each(id, bytes.get(4..4 + length)?, bytes.len() - 4);
        bytes = bytes.get(4 + length..)?;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SENDER: Prefix = [1, 16, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

    /// A timestamp, then an announcement with a lease, as drawn in RTPS 2.5 9.4.5 and 9.6.3.
    fn datagram(lease_s: i32, is_little_endian: bool, flags: u8) -> Vec<u8> {
        numbered([0, 1], lease_s, is_little_endian, flags)
    }

    /// The same datagram with another number: its high half, its low half.
    fn numbered(number: [u32; 2], lease_s: i32, is_little_endian: bool, flags: u8) -> Vec<u8> {
        let flag = u8::from(is_little_endian);
        let short = |value: u16| {
            if is_little_endian {
                value.to_le_bytes()
            } else {
                value.to_be_bytes()
            }
        };
        let seconds = if is_little_endian {
            lease_s.to_le_bytes()
        } else {
            lease_s.to_be_bytes()
        };
        let header = [b"RTPS".as_slice(), &[2, 5, 1, 16], &SENDER].concat();
        let time = [&[0x09, flag], short(8).as_slice(), &[0; 8]].concat();
        let long = |value: u32| {
            if is_little_endian {
                value.to_le_bytes()
            } else {
                value.to_be_bytes()
            }
        };
        let [high, low] = number.map(long);
        let ids = [[0, 0, 0, 0], [0, 1, 0, 0xc2], high, low].concat();
        let place = |kind: u32, address: [u8; 4]| {
            [
                [short(0x31), short(24)].concat(),
                [long(kind), long(7411), [0; 4], [0; 4], [0; 4], address].concat(),
            ]
            .concat()
        };
        let version = [short(0x15), short(4), [2, 5], [0, 0]].concat();
        let lease = [&short(2), &short(8), seconds.as_slice(), &[0; 4]].concat();
        let list = [
            [0, 2 | flag, 0, 0].as_slice(),
            &version,
            // an address of another kind comes first
            &place(16, [0; 4]),
            &place(1, [10, 0, 0, 7]),
            &lease,
            &short(1),
            &short(0),
        ]
        .concat();
        let body = [&[0, 0], &short(16), ids.as_slice(), &list].concat();
        [
            header,
            time,
            vec![0x15, flag | flags],
            short(body.len() as u16).to_vec(),
            body,
        ]
        .concat()
    }

    #[test]
    fn an_announcement_is_read_in_both_byte_orders() {
        for is_little_endian in [true, false] {
            let heard = datagram(10, is_little_endian, HAS_DATA);
            let read = announcement(&heard).unwrap();
            assert_eq!((read.prefix, read.lease), (SENDER, Duration::from_secs(10)));
            assert_eq!(read.listens, Some(SocketAddr::from(([10, 0, 0, 7], 7411))));
        }
        let read = announcement(&datagram(-1, true, HAS_DATA)).unwrap();
        assert_eq!(read.lease, Duration::ZERO);
    }

    #[test]
    fn an_announcement_gets_another_number_and_lease_and_nothing_else() {
        for is_little_endian in [true, false] {
            let numbered = |number, lease_s| numbered(number, lease_s, is_little_endian, HAS_DATA);
            let mut heard = numbered([0, 1], 10);
            let read = announcement(&heard).unwrap();
            read.renumber(&mut heard, (7 << 32) + 0xfedc_ba98, None);
            assert_eq!(heard, numbered([7, 0xfedc_ba98], 10));
            read.renumber(&mut heard, 3, Some(0));
            assert_eq!(heard, numbered([0, 3], 0));
        }
    }

    #[test]
    fn what_is_no_announcement_is_none() {
        assert_eq!(announcement(&datagram(10, true, 0)), None, "a farewell");
        let mut other = datagram(10, true, HAS_DATA);
        let writer = other.iter().position(|byte| *byte == 0xc2).unwrap();
        other[writer] = 0xc3;
        assert_eq!(announcement(&other), None);
        assert_eq!(announcement(b"RTPX 0123456789abcdef"), None);
        assert_eq!(announcement(b"RTPS"), None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_fail(bytes in prop::collection::vec(any::<u8>(), 0..200), cut in 0_usize..120) {
            let mut near = datagram(10, true, HAS_DATA);
            near.truncate(cut);
            for bytes in [bytes.clone(), [b"RTPS".to_vec(), bytes.clone()].concat(), [near, bytes].concat()] {
                if let Some(read) = announcement(&bytes) {
                    prop_assert_eq!(read.prefix.as_slice(), &bytes[8..20]);
                    read.renumber(&mut bytes.clone(), 7, Some(0));
                }
            }
        }
    }

    /// A participant checked twice a second, and the port that receives its announcements.
    struct WatchedPeer {
        keep_alive: KeepAlive,
        own: UdpSocket,
        /// its sending socket; `None` after its end
        sender: Option<UdpSocket>,
        from: SocketAddr,
        begun: Instant,
    }

    impl WatchedPeer {
        fn new() -> Self {
            let own = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
            own.set_nonblocking(true).unwrap();
            let mut keep_alive = KeepAlive::new(0, 0, GUID::from_bytes([0; 16])).unwrap();
            keep_alive.own_port = own.local_addr().unwrap().port();
            let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
            let from = sender.local_addr().unwrap();
            Self {
                keep_alive,
                own,
                sender: Some(sender),
                from,
                begun: Instant::now(),
            }
        }

        fn hear(&mut self, lease_s: i32, at_s: f64) {
            let now = self.begun + Duration::from_secs_f64(at_s);
            self.keep_alive
                .hear(&datagram(lease_s, true, HAS_DATA), self.from, now);
        }

        /// Times of forwarded announcements in an interval, s.
        fn handed_over(&mut self, from_s: f64, until_s: f64) -> Vec<f64> {
            let looks = (0..)
                .map(|look| from_s + 0.5 * f64::from(look))
                .take_while(|at_s| *at_s < until_s);
            let mut found = vec![];
            for at_s in looks {
                self.keep_alive
                    .look(self.begun + Duration::from_secs_f64(at_s));
                found.extend(self.received().map(|_| at_s));
            }
            found
        }

        /// The datagram received by our own participant.
        fn received(&mut self) -> Option<Vec<u8>> {
            let mut bytes = [0; 400];
            let length = self.own.recv(&mut bytes).ok()?;
            Some(bytes[..length].to_vec())
        }

        fn lost(&mut self, at_s: f64) {
            let now = self.begun + Duration::from_secs_f64(at_s);
            self.keep_alive.lost(&SENDER, now);
        }
    }

    #[test]
    fn who_announces_itself_in_time_needs_no_help() {
        let mut watched = WatchedPeer::new();
        for at in 0..10 {
            let at_s = 8.0 * f64::from(at);
            watched.hear(10, at_s);
            assert!(watched.handed_over(at_s, at_s + 8.0).is_empty());
        }
    }

    #[test]
    fn who_is_silent_is_spoken_for_before_each_end_of_its_lease_until_patience_ends() {
        let mut watched = WatchedPeer::new();
        watched.hear(10, 0.0);
        // asked 1.5 s before the end, forwarded 0.5 s later; a lease from 27 s ends at 37 s, and 46
        // s would be too late
        assert_eq!(watched.handed_over(0.0, 100.0), [9.0, 18.0, 27.0]);
        watched.hear(10, 100.0);
        assert_eq!(watched.handed_over(100.0, 110.0), [109.0]);
    }

    #[test]
    fn who_has_ended_without_a_word_is_not_spoken_for() {
        let mut watched = WatchedPeer::new();
        watched.hear(10, 0.0);
        assert_eq!(watched.handed_over(0.0, 10.0), [9.0]);
        watched.sender = None;
        assert!(watched.handed_over(10.0, 100.0).is_empty());
    }

    #[test]
    fn who_has_left_or_is_lost_is_not_spoken_for() {
        let mut watched = WatchedPeer::new();
        watched.hear(10, 100.0);
        watched.keep_alive.left(&SENDER);
        assert!(watched.handed_over(100.0, 200.0).is_empty());
        watched.hear(10, 200.0);
        watched.lost(212.0);
        assert!(watched.handed_over(212.0, 300.0).is_empty());
    }

    #[test]
    fn who_is_lost_is_met_when_it_comes_back_under_a_number_that_is_new() {
        let mut watched = WatchedPeer::new();
        let mut numbers = vec![];
        for at_s in [0.0, 200.0, 400.0] {
            watched.hear(10, at_s);
            if at_s > 0.0 {
                numbers.push(watched.received().unwrap());
            }
            watched.keep_alive.met(&SENDER);
            watched.lost(at_s + 12.0);
            assert!(watched.received().is_none());
        }
        // until RustDDS has met it
        for _ in 0..2 {
            watched.hear(10, 600.0);
            assert!(watched.received().is_some());
        }
        watched.keep_alive.met(&SENDER);
        watched.hear(10, 601.0);
        assert!(watched.received().is_none());
        assert_eq!(
            numbers,
            [0, 1].map(|low| numbered([1 << 8, low], 10, true, HAS_DATA))
        );
    }

    #[test]
    fn who_is_lost_because_this_process_stood_still_is_met_at_once() {
        let mut watched = WatchedPeer::new();
        watched.hear(10, 100.0);
        watched.lost(101.0);
        assert!(watched.received().is_some());
    }

    #[test]
    fn who_waits_for_longer_than_patience_is_forgotten_with_it() {
        let mut watched = WatchedPeer::new();
        watched.hear(60, 0.0);
        assert!(watched.handed_over(0.0, 40.5).is_empty());
        watched
            .keep_alive
            .look(watched.begun + Duration::from_secs(41));
        let expected = numbered([1 << 8, 0], 0, true, HAS_DATA);
        assert_eq!(watched.received(), Some(expected));
        watched.lost(43.0);
        assert!(watched.handed_over(43.0, 100.0).is_empty());
    }
}
