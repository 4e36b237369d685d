//! A folder of rosbag2: its metadata beside a file that is whole.

use std::fs;

use crate::seeds::mcap_bytes;
use crate::{place, read_all};
use touchup_io::recording::Topics;

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let folder = place("bag");
    if !folder.is_dir() {
        fs::create_dir(&folder).expect("the folder for temporary files takes a folder");
        fs::write(folder.join("bag_0.mcap"), mcap_bytes()).expect("it takes a file");
    }
    fs::write(folder.join("metadata.yaml"), data).expect("it takes a file");
    read_all(&folder, &Topics::default());
}
