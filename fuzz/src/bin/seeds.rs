//! Writes the seeds of the fuzz targets: `seeds FOLDER`.

use std::path::PathBuf;

// provides the counters that every branch calls
#[cfg(feature = "guided")]
use libfuzzer_sys as _;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    touchup_fuzz::seeds::write(&folder.ok_or_else(|| std::io::Error::other("usage: seeds FOLDER"))?)
}
