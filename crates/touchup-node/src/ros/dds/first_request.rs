//! The first request of a program at the moment of discovery.
//!
//! Fast DDS sends a request as soon as it knows our reader, even before RustDDS knows the writer:
//! RustDDS skips that request, and gets it again only on demand. RustDDS 0.15 asks by an ACKNACK of
//! everything before number 1, and Fast DDS answers only one before number 0: the request would
//! come with the next heartbeat, after 3 s. So this module sends an ACKNACK with 0.
//!
//! An ACKNACK has a count, and Fast DDS skips known counts. So our reader gets a heartbeat that
//! directs its answer here, and that answer goes on to the writer: nobody else uses its count.

use std::net::{IpAddr, SocketAddr};

use ros2_client::dds::rustdds::GUID;

/// A heartbeat of a writer without data (RTPS 2.5, 9.4.5.7), with the address for the answer
/// (9.4.5.9). `None` for writers of discovery: Fast DDS sends them a first heartbeat by itself, and
/// RustDDS would skip it. `None` for an IPv6 address, as neither side has any.
pub(super) fn heartbeat(reader: GUID, writer: GUID, answers: SocketAddr) -> Option<Vec<u8>> {
    let IpAddr::V4(address) = answers.ip() else {
        return None;
    };
    let submessage = |id: u8, body: &[u8]| {
        let length = (body.len() as u16).to_le_bytes();
        [&[id, LITTLE_ENDIAN], length.as_slice(), body].concat()
    };
    let words = |words: &[u32]| -> Vec<u8> {
        let bytes = words.iter().flat_map(|word| word.to_le_bytes());
        bytes.collect()
    };
    // count, kind, port, and an address with IPv4 in its last four bytes
    let place = words(&[1, 1, answers.port().into(), 0, 0, 0]);
    // RustDDS also reads optional multicast addresses: none
    let place = [place.as_slice(), &address.octets(), &[0; 4]].concat();
    let entities = [reader, writer].map(|guid| guid.entity_id.to_slice());
    // first and last number, high half first, and the count
    let beats = [entities.concat(), words(&[0, 1, 0, 0, 1])].concat();
    let message = [
        [b"RTPS".as_slice(), &[2, 4, 1, 18], writer.prefix.as_ref()].concat(),
        submessage(INFO_DST, reader.prefix.as_ref()),
        submessage(INFO_REPLY, &place),
        submessage(HEARTBEAT, &beats),
    ];
    let is_user_defined = writer.entity_id.kind().is_user_defined();
    is_user_defined.then(|| message.concat())
}

/// Turns the answer of our reader to such a heartbeat into a question that Fast DDS answers: with
/// base 0 and not final (RTPS 2.5, 9.4.5.2). Returns its destination participant; `None` for
/// anything else.
pub(super) fn question(answer: &mut [u8; LENGTH], own: &[u8]) -> Option<[u8; 12]> {
    let (header, submessages) = answer.split_at_mut(20);
    let (info, acknack) = submessages.split_at_mut(16);
    let is_ours = header.starts_with(b"RTPS") && header.ends_with(own);
    let is_both = info[0] == INFO_DST && acknack[0] == ACKNACK;
    // an answer with a request has a longer bit set
    let is_empty = acknack[20..24] == [0; 4];
    acknack[1] &= LITTLE_ENDIAN;
    acknack[12..20].fill(0);
    let to = info.last_chunk().copied();
    to.filter(|_| is_ours && is_both && is_empty)
}

/// Length of an answer without a request: header, destination, reader, writer, base, bits, count.
pub(super) const LENGTH: usize = 20 + 16 + 4 + 8 + 8 + 4 + 4;
/// Numbers of submessages (RTPS 2.5, 9.4.5.1.1), and the flag of their byte order.
const ACKNACK: u8 = 0x06;
const HEARTBEAT: u8 = 0x07;
const INFO_DST: u8 = 0x0e;
const INFO_REPLY: u8 = 0x0f;
const LITTLE_ENDIAN: u8 = 1;

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(prefix: u8, entity: [u8; 4]) -> GUID {
        let mut bytes = [prefix; 16];
        bytes[12..].copy_from_slice(&entity);
        GUID::from_bytes(bytes)
    }

    fn header(from: u8, to: u8) -> Vec<u8> {
        let header = [b"RTPS".as_slice(), &[2, 4, 1, 18], &[from; 12]];
        [header.concat(), vec![0x0e, 1, 12, 0], vec![to; 12]].concat()
    }

    #[test]
    fn a_heartbeat_is_as_rtps_draws_it_and_not_for_discovery() {
        let of = |writer| {
            let answers = SocketAddr::from(([10, 0, 0, 7], 7411));
            heartbeat(guid(3, [0, 0, 3, 4]), guid(5, writer), answers)
        };
        let parts = [
            // count, kind, port, address
            [0x0f, 1, 32, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0xf3, 0x1c, 0, 0].as_slice(),
            &[0; 12],
            &[10, 0, 0, 7, 0, 0, 0, 0],
            // reader, writer; first (8), last (8), count (4)
            &[7, 1, 28, 0, 0, 0, 3, 4, 0, 0, 0x14, 3],
            &[0, 0, 0, 0, 1, 0, 0, 0],
            &[0; 8],
            &[1, 0, 0, 0],
        ];
        assert_eq!(
            of([0, 0, 0x14, 3]),
            Some([header(5, 3), parts.concat()].concat())
        );
        // RTPS 2.5, 9.3.1.3: publications, subscriptions, liveliness
        for discovery in [[0, 0, 3, 0xc2], [0, 0, 4, 0xc2], [0, 2, 0, 0xc2]] {
            assert_eq!(of(discovery), None);
        }
    }

    #[test]
    fn an_answer_becomes_a_question_with_its_own_count() {
        // reader, writer; base (8), bits (4), count (4)
        let acknack = |flags, base, bits| {
            let parts = [
                vec![6, flags, 24, 0, 0, 0, 3, 4, 0, 0, 0x14, 3],
                vec![0, 0, 0, 0, base, 0, 0, 0],
                vec![bits, 0, 0, 0, 9, 0, 0, 0],
            ];
            let message = [header(3, 5), parts.concat()].concat();
            <[u8; LENGTH]>::try_from(message).unwrap()
        };
        let mut answer = acknack(3, 1, 0);
        assert_eq!(question(&mut answer, &[3; 12]), Some([5; 12]));
        assert_eq!(answer, acknack(1, 0, 0));
        assert_eq!(question(&mut acknack(3, 1, 0), &[4; 12]), None, "of others");
        assert_eq!(question(&mut acknack(3, 1, 7), &[3; 12]), None, "it asks");
        assert_eq!(question(&mut [0; LENGTH], &[0; 12]), None);
    }
}
