//! Counts in sentences.

use std::fmt::Display;

/// A count with its noun: "1 piece", "2 pieces".
pub fn counted<N: Display + PartialEq + From<u8>>(count: N, one: &str, many: &str) -> String {
    let noun = if count == N::from(1) { one } else { many };
    format!("{count} {noun}")
}

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn one_is_singular() {
        let pieces = [0u64, 1, 2, 11].map(|count| counted(count, "piece", "pieces"));
        assert_eq!(pieces, ["0 pieces", "1 piece", "2 pieces", "11 pieces"]);
    }
}
