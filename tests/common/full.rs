//! Sizes of a test: one for the quick checks, one for the slow proofs. The shards of
//! tests/shards.sh run the latter, and name the tests whose output goes into docs/results.md.

/// Whether the slow proofs run too.
pub fn is_full() -> bool {
    std::env::var_os("TOUCHUP_FULL").is_some()
}

/// One of two sizes of a test.
pub fn either<T>(quick: T, full: T) -> T {
    if is_full() { full } else { quick }
}
