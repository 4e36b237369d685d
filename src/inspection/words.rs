//! Words that the summary and the report have in common.

/// A share in percent, with the digits that it has.
pub fn percent(share: f64) -> f64 {
    (share * 1e6).round() / 1e4
}

/// Most names in a line.
const MOST_NAMED: usize = 8;

/// The first names, and how many more there are.
pub fn first_few(names: &[String], between: &str) -> String {
    let shown = names
        .iter()
        .take(MOST_NAMED)
        .cloned()
        .collect::<Vec<_>>()
        .join(between);
    match names.len().saturating_sub(MOST_NAMED) {
        0 => shown,
        more => format!("{shown}{between}and {more} more"),
    }
}
