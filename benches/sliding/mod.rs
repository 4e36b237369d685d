//! Course and settings that the benches of a sliding ball share.

/// Assumed scan noise, m.
pub const SCAN_NOISE: f64 = 0.3e-3;

/// A quantile of a sorted list of ns (or µs), in µs (or ms).
pub fn percentile(sorted: &[u64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize] as f64 * 1e-3
}
