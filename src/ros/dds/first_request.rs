//! The first request of a program that the node meets in the same moment.
//!
//! Fast DDS sends a request as soon as it knows our reader, be it before RustDDS knows the writer: that
//! request is passed over, and comes again only when it is asked for. RustDDS 0.15 asks by an ACKNACK
//! of everything before number 1, and Fast DDS answers one before number 0 alone: the request would
//! come with the next heartbeat, after 3 s. So one with 0 is sent from here, under the next
//! number of our reader. That our reader does not use that number again, it answers a heartbeat that
//! it has from here.

use ros2_client::dds::rustdds::GUID;

/// The numbers of both messages: RustDDS and Fast DDS begin with 0.
const COUNT: u32 = 1;

/// Asks a writer of Fast DDS for a heartbeat (RTPS 2.5, 9.4.5.2).
pub(super) fn question(reader: GUID, writer: GUID) -> Vec<u8> {
    // base, then how many are asked for
    let numbers = [0_u32; 3];
    message(
        reader,
        writer,
        0x06,
        [reader, writer],
        &[&numbers[..], &[COUNT]].concat(),
    )
}

/// A heartbeat of a writer that has nothing (RTPS 2.5, 9.4.5.7).
pub(super) fn heartbeat(reader: GUID, writer: GUID) -> Vec<u8> {
    // first and last number, high half first
    message(writer, reader, 0x07, [reader, writer], &[0, 1, 0, 0, COUNT])
}

/// A little endian message of one to another, with one submessage about these two and an empty set
/// of flags.
fn message(from: GUID, to: GUID, id: u8, about: [GUID; 2], words: &[u32]) -> Vec<u8> {
    let submessage = |id: u8, body: &[u8]| {
        let length = (body.len() as u16).to_le_bytes();
        [&[id, 1], length.as_slice(), body].concat()
    };
    let words: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let entities = about.map(|guid| guid.entity_id.to_slice()).concat();
    [
        [b"RTPS".as_slice(), &[2, 4, 1, 18], from.prefix.as_ref()].concat(),
        submessage(0x0e, to.prefix.as_ref()),
        submessage(id, &[entities, words].concat()),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_messages_are_as_rtps_draws_them() {
        let [reader, writer] = [3, 5].map(|byte| GUID::from_bytes([byte; 16]));
        let header = |from: u8, to: u8| {
            [
                b"RTPS".as_slice(),
                &[2, 4, 1, 18],
                &[from; 12],
                &[0x0e, 1, 12, 0],
                &[to; 12],
            ]
            .concat()
        };
        // reader, writer; base (8), bits (4), count (4)
        let asked = [
            &[6, 1, 24, 0],
            [3; 4].as_slice(),
            &[5; 4],
            &[0; 12],
            &[1, 0, 0, 0],
        ]
        .concat();
        assert_eq!(question(reader, writer), [header(3, 5), asked].concat());
        // reader, writer; first (8), last (8), count (4)
        let beats = [
            &[7, 1, 28, 0],
            [3; 4].as_slice(),
            &[5; 4],
            &[0; 4],
            &[1, 0, 0, 0],
            &[0; 8],
            &[1, 0, 0, 0],
        ];
        assert_eq!(
            heartbeat(reader, writer),
            [header(5, 3), beats.concat()].concat()
        );
    }
}
