//! Closes openings that RustDDS leaves on its sockets: it listens on every interface whatever its
//! networks, and for a message in fragments it allocates the size claimed by the first fragment, up
//! to 4 GB.
//!
//! Its sockets are those opened while it joined. The kernel then drops fragments of messages larger
//! than any to a node of ours, and with [`Range::Computer`] everything from outside the loopback
//! interface.

use std::collections::BTreeSet;
use std::fs::{self, DirEntry};
use std::io;
use std::net::SocketAddr;
use std::os::fd::{BorrowedFd, RawFd};
use std::path::PathBuf;

use socket2::{SockFilter, SockRef, Type};

use crate::ros::exchange::RosError;

/// Maximum size of messages in fragments, bytes; a subscribed message has a hundredth of it.
const LARGEST_MESSAGE: u32 = 1 << 20;
/// Maximum number of examined submessages of a datagram; participants put a few into one.
const MOST_SUBMESSAGES: usize = 24;

/// Reach of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Range {
    /// only programs of this computer
    Computer,
    /// also programs of its networks
    Networks,
}

/// The open sockets of this process: the file number, and the system's name of the socket, as
/// numbers are reused.
#[derive(Debug)]
pub(super) struct OpenSockets(BTreeSet<(RawFd, PathBuf)>);

impl OpenSockets {
    /// The sockets open now.
    ///
    /// # Errors
    /// Those of the system, if it does not list them.
    pub fn now() -> io::Result<Self> {
        let socket = |entry: io::Result<DirEntry>| {
            let entry = entry.ok()?;
            let name = fs::read_link(entry.path()).ok()?;
            let number = entry.file_name().to_str()?.parse().ok()?;
            name.to_str()?
                .starts_with("socket:")
                .then_some((number, name))
        };
        Ok(Self(
            fs::read_dir("/proc/self/fd")?.filter_map(socket).collect(),
        ))
    }

    /// Guards the UDP sockets opened since then; returns their number.
    ///
    /// # Errors
    /// Those of the system, if a socket refuses the filter or device.
    pub fn guard_since(&self, range: Range) -> io::Result<usize> {
        let filter = filter();
        let mut guarded = 0;
        for &(number, _) in Self::now()?.0.difference(&self.0) {
            // SAFETY: it was open a moment ago, and is borrowed for a few system calls, each of
            // which refuses anything but a socket; a file opened by another thread under this
            // number meanwhile is no UDP socket, or one that may be guarded as well
            let file = unsafe { BorrowedFd::borrow_raw(number) };
            let socket = SockRef::from(&file);
            let address = socket
                .local_addr()
                .ok()
                .and_then(|address| address.as_socket());
            if !matches!(
                (socket.r#type(), address),
                (Ok(Type::DGRAM), Some(SocketAddr::V4(_)))
            ) {
                continue;
            }
            socket.attach_filter(&filter)?;
            if range == Range::Computer {
                socket.bind_device(Some(b"lo"))?;
            }
            guarded += 1;
        }
        Ok(guarded)
    }
}

/// Guards the sockets of a join. Without protection from other computers a local node does not run;
/// without a filter for large messages a node does.
pub(super) fn guard(before: io::Result<OpenSockets>, localhost_only: bool) -> Result<(), RosError> {
    let range = if localhost_only {
        Range::Computer
    } else {
        Range::Networks
    };
    match before.and_then(|before| before.guard_since(range)) {
        Ok(guarded) => tracing::debug!(guarded, ?range, "sockets are guarded"),
        Err(error) if localhost_only => {
            let remedy = "unset ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_LOCALHOST_ONLY where other computers may reach the node";
            return Err(RosError::Refused {
                call: "binding to loopback",
                reason: error.to_string(),
                remedy,
            });
        }
        Err(error) => tracing::warn!(%error, "messages of any size are taken from the network"),
    }
    Ok(())
}

/// Start of the submessages in a filter's view of a datagram: after the headers of UDP and RTPS.
const FIRST_SUBMESSAGE: u32 = 8 + 20;
/// Numbers of submessages (RTPS 2.5, 9.4.5.1.1).
const PAD: u32 = 0x01;
const INFO_TS: u32 = 0x09;
const DATA_FRAG: u32 = 0x16;
/// Offset of the total size in a DATA_FRAG (RTPS 2.5, 9.4.5.5).
const DATA_SIZE: u32 = 32;
/// Verdicts of a filter, as accepted bytes of a datagram.
const TAKEN: SockFilter = SockFilter::new(0x06, 0, 0, u32::MAX);
const DROPPED: SockFilter = SockFilter::new(0x06, 0, 0, 0);

/// Passes all but fragments of messages of [`LARGEST_MESSAGE`] and more: walks along the
/// submessages of a datagram, X at the header of one after the other.
fn filter() -> Vec<SockFilter> {
    // a jump holds the number of instructions to skip if true and if false
    let op = SockFilter::new;
    let length = || op(0x80, 0, 0, 0);
    let byte = |at| op(0x50, 0, 0, at);
    let is = |value, so, not| op(0x15, so, not, value);
    let is_at_least = |value, so, not| op(0x35, so, not, value);
    let is_little_endian = |so, not| op(0x45, so, not, 1);
    let mut program = vec![
        length(),
        is_at_least(FIRST_SUBMESSAGE + 4, 1, 0),
        TAKEN,
        op(0x01, 0, 0, FIRST_SUBMESSAGE),
    ];
    for _ in 0..MOST_SUBMESSAGES {
        // a whole header remains: length - 4 >= X
        program.extend([length(), op(0x14, 0, 0, 4), op(0x3d, 1, 0, 0), TAKEN]);
        program.extend([
            byte(0),
            is(DATA_FRAG, 0, 9),
            byte(1),
            is_little_endian(0, 4),
        ]);
        program.extend([
            byte(DATA_SIZE + 3),
            is(0, 0, 4),
            byte(DATA_SIZE + 2),
            is_at_least(LARGEST_MESSAGE >> 16, 2, 3),
        ]);
        program.extend([
            op(0x40, 0, 0, DATA_SIZE),
            is_at_least(LARGEST_MESSAGE, 0, 1),
            DROPPED,
        ]);
        // its length into A, through memory: bytes in order, or reversed
        program.extend([
            byte(1),
            is_little_endian(0, 9),
            byte(3),
            op(0x64, 0, 0, 8),
            op(0x02, 0, 0, 1),
            byte(2),
        ]);
        program.extend([
            op(0x03, 0, 0, 0),
            op(0x61, 0, 0, 1),
            op(0x4c, 0, 0, 0),
            op(0x61, 0, 0, 0),
            op(0x05, 0, 0, 1),
        ]);
        program.push(op(0x48, 0, 0, 2));
        // without a length it is the last one, except for the two that may be empty
        program.extend([
            is(0, 0, 5),
            byte(0),
            is(PAD, 2, 0),
            is(INFO_TS, 1, 0),
            TAKEN,
            op(0x00, 0, 0, 0),
        ]);
        program.extend([op(0x04, 0, 0, 4), op(0x0c, 0, 0, 0), op(0x07, 0, 0, 0)]);
    }
    program.push(TAKEN);
    program
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, UdpSocket};
    use std::time::Duration;

    use super::*;

    /// A submessage: its number, whether its numbers are little endian, its content.
    fn submessage(id: u8, is_little_endian: bool, body: &[u8]) -> Vec<u8> {
        let length = body.len() as u16;
        let length = if is_little_endian {
            length.to_le_bytes()
        } else {
            length.to_be_bytes()
        };
        [&[id, u8::from(is_little_endian)], length.as_slice(), body].concat()
    }

    /// A fragment of a message of this number of bytes.
    fn fragment(is_little_endian: bool, size: u32) -> Vec<u8> {
        let size = if is_little_endian {
            size.to_le_bytes()
        } else {
            size.to_be_bytes()
        };
        submessage(
            0x16,
            is_little_endian,
            &[[7; 28].as_slice(), &size, &[9; 16]].concat(),
        )
    }

    fn datagram(submessages: &[Vec<u8>]) -> Vec<u8> {
        [
            b"RTPS".as_slice(),
            &[2, 5, 1, 16],
            &[3; 12],
            &submessages.concat(),
        ]
        .concat()
    }

    /// Whether each datagram passes the filter; a passing one follows each.
    fn passed(datagrams: &[Vec<u8>]) -> Vec<bool> {
        let before = OpenSockets::now().unwrap();
        let receiver = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        receiver
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        assert!(before.guard_since(Range::Networks).unwrap() >= 1);
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let receive = || {
            let mut bytes = vec![0; 1 << 16];
            let length = receiver.recv(&mut bytes).unwrap();
            bytes[..length].to_vec()
        };
        let mut passes = |datagram: &Vec<u8>| {
            for bytes in [datagram.as_slice(), b"after it"] {
                sender
                    .send_to(bytes, receiver.local_addr().unwrap())
                    .unwrap();
            }
            let first = receive();
            first != b"after it" && (first == *datagram && receive() == b"after it")
        };
        datagrams.iter().map(&mut passes).collect()
    }

    #[test]
    fn fragments_of_what_is_too_large_are_dropped_wherever_they_stand() {
        let sizes = [1 << 20, 1 << 24, u32::MAX, 0xff10_0000, 0x0010_00ff];
        let time = |is_little_endian| submessage(0x09, is_little_endian, &[1; 8]);
        for is_little_endian in [true, false] {
            let fragment = |size| fragment(is_little_endian, size);
            let alone = sizes.map(|size| datagram(&[fragment(size)]));
            let behind = sizes.map(|size| {
                datagram(&[
                    time(!is_little_endian),
                    time(is_little_endian),
                    fragment(size),
                ])
            });
            // an empty time, padding, and a submessage longer than 255 bytes
            let far = [
                submessage(0x09, true, &[]),
                submessage(0x01, false, &[]),
                submessage(0x15, true, &[0x16; 700]),
            ];
            let far = datagram(&[far.concat(), fragment(u32::MAX)]);
            let second = datagram(&[fragment(1000), fragment(u32::MAX)]);
            let dropped = [alone.as_slice(), &behind, &[far, second]].concat();
            assert_eq!(
                passed(&dropped),
                vec![false; dropped.len()],
                "little endian: {is_little_endian}"
            );
        }
    }

    #[test]
    fn all_else_passes() {
        for is_little_endian in [true, false] {
            let fragments =
                [0, 1000, (1 << 20) - 1].map(|size| datagram(&[fragment(is_little_endian, size)]));
            // the content of the last one may look like a fragment
            let looks_like = [
                submessage(0x06, is_little_endian, &[2; 24]),
                vec![0x15, u8::from(is_little_endian), 0, 0],
            ];
            let last = datagram(&[looks_like.concat(), fragment(is_little_endian, u32::MAX)]);
            let data = datagram(&[submessage(0x15, is_little_endian, &[0x16; 1000])]);
            let many = datagram(&vec![submessage(0x07, is_little_endian, &[0xff; 28]); 200]);
            let cut = datagram(&[submessage(0x15, is_little_endian, &[1; 20])])[..30].to_vec();
            let others = [
                last,
                data,
                many,
                cut,
                datagram(&[]),
                b"RTPS".to_vec(),
                b"no RTPS, but as long as a header".to_vec(),
            ];
            let all = [fragments.as_slice(), &others].concat();
            assert_eq!(
                passed(&all),
                vec![true; all.len()],
                "little endian: {is_little_endian}"
            );
        }
    }

    #[test]
    fn of_this_computer_alone_what_comes_over_loopback_is_heard() {
        let before = OpenSockets::now().unwrap();
        let receiver = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
        receiver
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        assert!(before.guard_since(Range::Computer).unwrap() >= 1);
        assert_eq!(
            SockRef::from(&receiver).device().unwrap(),
            Some(b"lo".to_vec())
        );
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        sender
            .send_to(
                b"here",
                (Ipv4Addr::LOCALHOST, receiver.local_addr().unwrap().port()),
            )
            .unwrap();
        assert_eq!(receiver.recv(&mut [0; 8]).unwrap(), 4);
    }
}
