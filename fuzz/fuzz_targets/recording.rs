//! A recording in one file, MCAP or SQLite by its content, with poses or with markers.

#![no_main]

use libfuzzer_sys::fuzz_target;
use touchup_fuzz::seeds::MARKERS;
use touchup_fuzz::{file, read_all};
use touchup_io::recording::Topics;

fuzz_target!(|data: &[u8]| {
    let path = file("recording", data);
    read_all(&path, &Topics::default());
    read_all(
        &path,
        &Topics {
            markers: Some(MARKERS.into()),
            ..Topics::default()
        },
    );
});
