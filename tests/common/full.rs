//! What belongs to the quick checks, and what to `tests/all.sh --full`.

/// Whether the slow proofs run too.
pub fn is_full() -> bool {
    std::env::var_os("TOUCHUP_FULL").is_some()
}

/// One of two sizes of a test.
pub fn either<T>(quick: T, full: T) -> T {
    if is_full() { full } else { quick }
}

/// Puts what a slow proof measured where `tests/all.sh --full` makes docs/results.md of it; shows it in any case.
///
/// - `name`: the heading there, with `_` for a space.
/// - `text`: Markdown.
pub fn write_result(name: &str, text: &str) {
    println!("{text}");
    if let Some(folder) = std::env::var_os("TOUCHUP_RESULTS") {
        std::fs::write(std::path::Path::new(&folder).join(format!("{name}.md")), text).unwrap();
    }
}
