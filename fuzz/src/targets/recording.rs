//! A recording in one file, MCAP or SQLite by its content, with poses or with markers.

use crate::seeds::MARKERS;
use crate::{file, read_all};
use touchup_io::recording::Topics;

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let path = file("recording", data);
    read_all(&path, &Topics::default());
    read_all(
        &path,
        &Topics {
            markers: Some(MARKERS.into()),
            ..Topics::default()
        },
    );
}
