//! Messages in CDR: poses, wrenches and clouds of markers, in a recording around them that is sound.

#![no_main]

use libfuzzer_sys::fuzz_target;
use touchup_fuzz::seeds::{MARKERS, mcap_of};
use touchup_fuzz::{file, read_all};
use touchup_io::recording::Topics;

/// A message begins with its topic, and its length in four bytes.
const HEAD: usize = 5;

fuzz_target!(|data: &[u8]| {
    let (mut messages, mut rest) = (Vec::new(), data);
    while let Some((head, after)) = rest.split_at_checked(HEAD) {
        let length = u32::from_le_bytes([head[1], head[2], head[3], head[4]]) as usize;
        let (payload, next) = after.split_at(length.min(after.len()));
        messages.push((u16::from(head[0] % 3), payload));
        rest = next;
    }
    let path = file("messages.mcap", &mcap_of(&messages));
    read_all(&path, &Topics::default());
    read_all(&path, &Topics { markers: Some(MARKERS.into()), ..Topics::default() });
});
