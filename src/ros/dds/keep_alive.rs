//! Waits longer for participants that are silent than RustDDS does: a cable was out, a computer was
//! busy, a packet was lost.
//!
//! A participant says that it is alive by announcing itself every few seconds (RTPS 2.5, 8.5.3),
//! and whoever hears nothing of it for the time that it asks for forgets it: CycloneDDS asks for 10
//! s and announces itself every 8 s, so one lost packet is enough. RustDDS 0.15 then never meets it
//! again, as it takes what the participant says of itself once more for what it knows already. So
//! it hears the last announcement again from here until the participant has been silent for
//! [`PATIENCE`], unless its computer says that the program has ended.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::mio1::net::UdpSocket as MioSocket;
use socket2::{Domain, Protocol, Socket, Type};

/// So long a participant may be silent. RustDDS asks the others for 50 s and announces itself every
/// 10 s: beyond 40 s of silence they may have forgotten us, and both sides must begin anew.
const PATIENCE: Duration = Duration::from_secs(40);
/// How often it is looked for who is silent.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Where participants announce themselves (RTPS 2.5, 9.6.2.4.1).
const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
/// Ports of the first domain, and from one domain and one participant to the next (RTPS 2.5,
/// 9.6.2.3).
const MULTICAST_PORT: u32 = 7400;
const UNICAST_PORT: u32 = 7410;
const PORTS_OF_A_DOMAIN: u32 = 250;
const PORTS_OF_A_PARTICIPANT: u32 = 2;
/// Participants that are remembered; a domain holds 120.
const MOST_PARTICIPANTS: usize = 1024;
/// No datagram is larger.
const LARGEST_DATAGRAM: usize = 1 << 16;
/// Larger announcements are not kept: one of a participant of ROS has some 500 bytes.
const LARGEST_ANNOUNCEMENT: usize = 1 << 13;

/// What names a participant on the wire.
type Prefix = [u8; 12];

/// The participants of a domain, by what they announce.
pub(super) struct KeepAlive {
    /// wakes who takes
    pub socket: MioSocket,
    /// where our own participant listens
    own_port: u16,
    known: BTreeMap<Prefix, KnownParticipant>,
    datagram: Vec<u8>,
}

struct KnownParticipant {
    /// the last announcement
    datagram: Vec<u8>,
    from: SocketAddr,
    heard: Instant,
    /// after so much silence RustDDS forgets it
    lease: Duration,
    /// when RustDDS heard the last announcement, here or from the participant
    renewed: Instant,
    state: PeerState,
}

enum PeerState {
    Heard,
    /// silent for long: its computer was asked whether the program still has its port, where there
    /// is a way to it
    Asked(Option<UdpSocket>),
    /// it has not
    Ended,
    /// RustDDS has forgotten it
    Lost,
}

impl KnownParticipant {
    /// Whether RustDDS has to hear of it soon.
    fn is_due(&self, now: Instant) -> bool {
        let early = (self.lease / 2).min(3 * LOOK_EVERY);
        let silent = now.saturating_duration_since(self.heard);
        !matches!(self.state, PeerState::Ended | PeerState::Lost)
            && now.saturating_duration_since(self.renewed) >= self.lease - early
            && silent + self.lease <= PATIENCE
    }
}

impl KeepAlive {
    /// Listens beside RustDDS.
    ///
    /// # Errors
    /// Those of the system, when the port cannot be shared.
    pub fn new(domain_id: u16, participant_id: u16) -> Result<Self> {
        let offset = u32::from(domain_id) * PORTS_OF_A_DOMAIN;
        let own_offset = offset + u32::from(participant_id) * PORTS_OF_A_PARTICIPANT;
        let ports = [MULTICAST_PORT + offset, UNICAST_PORT + own_offset].map(u16::try_from);
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
        // on Linux a socket hears every group that any other has joined, as RustDDS has on each
        // interface
        if let Err(error) = socket.join_multicast_v4(&GROUP, &Ipv4Addr::UNSPECIFIED) {
            tracing::debug!(%error, "no route for multicast yet");
        }
        let socket = MioSocket::from_std(socket.into());
        Ok(Self {
            socket,
            own_port,
            known: BTreeMap::new(),
            datagram: vec![0; LARGEST_DATAGRAM],
        })
    }

    /// RustDDS has waited for it in vain.
    pub fn lost(&mut self, prefix: &[u8]) {
        if let Some(known) = Prefix::try_from(prefix)
            .ok()
            .and_then(|prefix| self.known.get_mut(&prefix))
        {
            known.state = PeerState::Lost;
        }
    }

    /// It has taken its leave.
    pub fn left(&mut self, prefix: &[u8]) {
        if let Ok(prefix) = Prefix::try_from(prefix) {
            self.known.remove(&prefix);
        }
    }

    /// Takes all announcements that are there, and looks who is silent.
    pub fn take(&mut self) {
        let mut datagram = std::mem::take(&mut self.datagram);
        loop {
            match self.socket.recv_from(&mut datagram) {
                Ok((length, from)) => self.hear(&datagram[..length], from, Instant::now()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                // nothing is left; any other error ends what was there as well
                Err(_) => break,
            }
        }
        self.datagram = datagram;
        self.look(Instant::now());
    }

    fn hear(&mut self, datagram: &[u8], from: SocketAddr, now: Instant) {
        let Some((prefix, lease)) = announcement(datagram) else {
            return;
        };
        if datagram.len() > LARGEST_ANNOUNCEMENT {
            return;
        }
        if self
            .known
            .get(&prefix)
            .is_some_and(|known| matches!(known.state, PeerState::Lost))
        {
            tracing::warn!(
                address = %from.ip(),
                "a program there was out of reach for too long and is not met again: start it anew, or this node"
            );
        } else if self.known.len() >= MOST_PARTICIPANTS && !self.known.contains_key(&prefix) {
            self.known.pop_first();
        }
        let datagram = datagram.to_vec();
        self.known.insert(
            prefix,
            KnownParticipant {
                datagram,
                from,
                heard: now,
                lease,
                renewed: now,
                state: PeerState::Heard,
            },
        );
    }

    fn look(&mut self, now: Instant) {
        for known in self.known.values_mut().filter(|known| known.is_due(now)) {
            let PeerState::Asked(asked) = &known.state else {
                known.state = PeerState::Asked(ask(known.from).ok());
                continue;
            };
            if asked.as_ref().is_some_and(is_refused) {
                known.state = PeerState::Ended;
                continue;
            }
            known.state = PeerState::Heard;
            known.renewed = now;
            if let Err(error) = hand_over(&known.datagram, known.from, self.own_port) {
                tracing::debug!(%error, "a silent participant may be forgotten too early");
            }
        }
    }
}

/// A message without content, for the port that a participant sends from. Where the program has
/// ended its computer answers that nobody is there (ICMP, RFC 792); nobody answers where the way is
/// cut.
fn ask(port: SocketAddr) -> Result<UdpSocket> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.set_nonblocking(true)?;
    socket.connect(port)?;
    socket.send(&[b"RTPS".as_slice(), &[2, 5], &[0; 14]].concat())?;
    Ok(socket)
}

fn is_refused(asked: &UdpSocket) -> bool {
    matches!(asked.take_error(), Ok(Some(error)) if error.kind() == ErrorKind::ConnectionRefused)
}

/// Sends a datagram to our own participant, from an address of ours that reaches whom it is from: a
/// loopback address would make RustDDS believe that he is on this computer. It is taken where there
/// is no way to him at all.
fn hand_over(datagram: &[u8], from: SocketAddr, port: u16) -> Result<()> {
    let way = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    let own: IpAddr = match way.connect(from) {
        Ok(()) => way.local_addr()?.ip(),
        Err(_) => Ipv4Addr::LOCALHOST.into(),
    };
    UdpSocket::bind((own, 0))?
        .send_to(datagram, (own, port))
        .map(drop)
}

/// Length of the header of a message (RTPS 2.5, 9.4.4), which ends with who sends it.
const HEADER: usize = 20;
/// Numbers of submessages (RTPS 2.5, 9.4.5.1.1).
const PAD: u8 = 0x01;
const INFO_TS: u8 = 0x09;
const INFO_SOURCE: u8 = 0x0c;
const DATA: u8 = 0x15;
/// Flags of a submessage DATA: byte order, whether there are parameters before the data, and
/// whether there is data.
const LITTLE_ENDIAN: u8 = 0x01;
const HAS_PARAMETERS: u8 = 0x02;
const HAS_DATA: u8 = 0x04;
/// The writer of announcements (RTPS 2.5, 9.3.1.3).
const ANNOUNCER: [u8; 4] = [0x00, 0x01, 0x00, 0xc2];
/// Parameters (RTPS 2.5, 9.6.3): how long to wait, and the last one of a list.
const LEASE: u16 = 0x0002;
const SENTINEL: u16 = 0x0001;
/// Where an announcement has no lease, RustDDS waits so long.
const DEFAULT_LEASE: Duration = Duration::from_secs(60);

fn short(bytes: &[u8], at: usize, is_little_endian: bool) -> Option<u16> {
    let bytes = *bytes.get(at..)?.first_chunk()?;
    Some(if is_little_endian {
        u16::from_le_bytes(bytes)
    } else {
        u16::from_be_bytes(bytes)
    })
}

/// Who announces itself in an RTPS datagram, and its lease; `None` for anything else.
fn announcement(datagram: &[u8]) -> Option<(Prefix, Duration)> {
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
        // more flags, where the data is, reader, writer
        if id == DATA && flags & HAS_DATA != 0 && body.get(8..12) == Some(&ANNOUNCER) {
            let skipped = 4 + usize::from(short(body, 2, is_little_endian)?);
            let mut data = body.get(skipped..)?;
            if flags & HAS_PARAMETERS != 0 {
                data = parameters(data, is_little_endian, |_, _| {})?;
            }
            // the byte order of the data is its own: an even number is big endian
            let is_little_endian = data.get(1)? & 1 != 0;
            let mut lease = DEFAULT_LEASE;
            parameters(data.get(4..)?, is_little_endian, |id, value| {
                if let (LEASE, Some(seconds)) = (id, value.first_chunk()) {
                    let seconds = if is_little_endian {
                        i32::from_le_bytes(*seconds)
                    } else {
                        i32::from_be_bytes(*seconds)
                    };
                    lease = Duration::from_secs(u64::try_from(seconds).unwrap_or(0));
                }
            })?;
            return Some((prefix, lease));
        }
        // what follows would be from somebody else
        if id == INFO_SOURCE {
            return None;
        }
        at = end;
    }
}

/// Reads a list of parameters, number and value; what comes after it.
fn parameters(
    mut bytes: &[u8],
    is_little_endian: bool,
    mut each: impl FnMut(u16, &[u8]),
) -> Option<&[u8]> {
    loop {
        let id = short(bytes, 0, is_little_endian)?;
        let length = usize::from(short(bytes, 2, is_little_endian)?);
        if id == SENTINEL {
            return bytes.get(4..);
        }
        each(id, bytes.get(4..4 + length)?);
        bytes = bytes.get(4 + length..)?;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SENDER: Prefix = [1, 16, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

    /// A timestamp, then an announcement with a lease, as RTPS 2.5 9.4.5 and 9.6.3 draw them.
    fn datagram(lease_s: i32, is_little_endian: bool, flags: u8) -> Vec<u8> {
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
        let ids = [[0, 0, 0, 0], [0, 1, 0, 0xc2], [0, 0, 0, 0], [0, 0, 0, 1]].concat();
        let version = [short(0x15), short(4), [2, 5], [0, 0]].concat();
        let lease = [&short(2), &short(8), seconds.as_slice(), &[0; 4]].concat();
        let list = [
            [0, 2 | flag, 0, 0].as_slice(),
            &version,
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
            assert_eq!(
                announcement(&heard),
                Some((SENDER, Duration::from_secs(10)))
            );
        }
        assert_eq!(
            announcement(&datagram(-1, true, HAS_DATA)),
            Some((SENDER, Duration::ZERO))
        );
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
                if let Some((prefix, _)) = announcement(&bytes) {
                    prop_assert_eq!(prefix.as_slice(), &bytes[8..20]);
                }
            }
        }
    }

    /// One that is looked at twice a second, and the port that it forwards to.
    struct WatchedPeer {
        keep_alive: KeepAlive,
        own: UdpSocket,
        /// what the participant sends from; `None` when it has ended
        sender: Option<UdpSocket>,
        from: SocketAddr,
        begun: Instant,
    }

    impl WatchedPeer {
        fn new() -> Self {
            let own = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
            own.set_nonblocking(true).unwrap();
            let mut keep_alive = KeepAlive::new(0, 0).unwrap();
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

        /// When something is handed over in a time, s.
        fn handed_over(&mut self, from_s: f64, until_s: f64) -> Vec<f64> {
            let looks = (0..)
                .map(|look| from_s + 0.5 * f64::from(look))
                .take_while(|at_s| *at_s < until_s);
            let mut found = vec![];
            for at_s in looks {
                self.keep_alive
                    .look(self.begun + Duration::from_secs_f64(at_s));
                let mut bytes = [0; 200];
                if let Ok(length) = self.own.recv(&mut bytes) {
                    assert_eq!(announcement(&bytes[..length]).unwrap().0, SENDER);
                    found.push(at_s);
                }
            }
            found
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
        // asked 1.5 s before the end, handed over 0.5 s later; what begins at 27 s ends at 37 s,
        // and 46 s would be too late
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
    fn who_waits_for_longer_has_left_or_is_lost_is_not_spoken_for() {
        let mut watched = WatchedPeer::new();
        watched.hear(60, 0.0);
        assert!(watched.handed_over(0.0, 100.0).is_empty());
        watched.hear(10, 100.0);
        watched.keep_alive.left(&SENDER);
        assert!(watched.handed_over(100.0, 200.0).is_empty());
        watched.hear(10, 200.0);
        watched.keep_alive.lost(&SENDER);
        assert!(watched.handed_over(200.0, 300.0).is_empty());
    }
}
