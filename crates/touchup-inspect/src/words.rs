//! Words common to summary and report.

/// A share in percent, without digits of rounding noise.
pub fn percent(share: f64) -> f64 {
    (share * 1e6).round() / 1e4
}

/// Most names in a line.
const MOST_NAMED: usize = 8;

/// First names, and the number of further ones.
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
