//! Memory of the process, for the benches that watch it.

/// Resident memory, MB.
pub fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = status.lines().find_map(|line| {
        line.strip_prefix("VmRSS:")?
            .trim()
            .strip_suffix(" kB")?
            .parse()
            .ok()
    });
    kilobytes.map_or(f64::NAN, |kilobytes: f64| kilobytes / 1e3)
}
