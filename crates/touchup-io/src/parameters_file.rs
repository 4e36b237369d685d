//! The text of a ROS parameter file.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Maximum size of a parameter file, bytes.
const LARGEST: u64 = 1 << 20;

/// The text of the file.
///
/// # Errors
/// Any system error; [`io::ErrorKind::FileTooLarge`] beyond a megabyte.
pub fn read(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let length = File::open(path)?
        .take(LARGEST + 1)
        .read_to_string(&mut text)?;
    if length as u64 > LARGEST {
        return Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            "it is larger than 1 MiB",
        ));
    }
    Ok(text)
}
