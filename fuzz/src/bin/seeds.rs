//! Writes what every run of the fuzz targets begins from: `seeds FOLDER`.

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    touchup_fuzz::seeds::write(&folder.ok_or_else(|| std::io::Error::other("usage: seeds FOLDER"))?)
}
