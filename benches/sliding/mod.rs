//! What the benches of a sliding ball share: quantiles, memory of the process.

/// Assumed scan noise, m.
pub const SCAN_NOISE: f64 = 0.3e-3;

/// A quantile of a sorted list of ns (or µs), in µs (or ms).
pub fn percentile(sorted: &[u64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize] as f64 * 1e-3
}

/// Memory of the process, MB.
pub fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes =
        status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.parse().ok());
    kilobytes.map_or(f64::NAN, |kilobytes: f64| kilobytes / 1e3)
}
