//! Files of `../shared/data`, and the report of a skipped test.

use std::path::{Path, PathBuf};

/// A file or folder below `../shared/data`; `None`, with [`skip`], if it is absent.
pub fn shared(below: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .join("../shared/data")
        .join(below);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("../shared/data/{below} is missing"));
    None
}

/// Reports this test as skipped: `tests/all.sh` counts the line as a skipped test, not as a passed
/// one.
pub fn skip(reason: &str) {
    let thread = std::thread::current();
    println!(
        "SKIPPED: {}: {reason}",
        thread.name().unwrap_or("a thread of a test")
    );
}
