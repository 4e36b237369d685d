//! A file of features; writing and reading it again gives the same features.

use crate::file;
use touchup_io::features_file::{read_features, write_features};

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let path = file("features.json", data);
    let Ok(features) = read_features(&path) else {
        return;
    };
    write_features(&path, &features).expect("a file that was read can be written");
    let again = read_features(&path).expect("it was written here");
    assert_eq!(again.features.len(), features.features.len());
}
