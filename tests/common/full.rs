//! What belongs to the quick checks, and what to `tests/all.sh --full`. What proofs print there is
//! taken into docs/results.md: the list is in tests/results.sh.

/// Whether the slow proofs run too.
pub fn is_full() -> bool {
    std::env::var_os("TOUCHUP_FULL").is_some()
}

/// One of two sizes of a test.
pub fn either<T>(quick: T, full: T) -> T {
    if is_full() { full } else { quick }
}
