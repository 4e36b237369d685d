//! Writes what every run of the fuzz targets begins from: `seeds FOLDER`.

use std::path::PathBuf;

// has what the counters at every branch call
#[cfg(feature = "guided")]
use libfuzzer_sys as _;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    touchup_fuzz::seeds::write(&folder.ok_or_else(|| std::io::Error::other("usage: seeds FOLDER"))?)
}
