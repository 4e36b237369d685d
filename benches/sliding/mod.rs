//! What the benches of a sliding ball share: its noisy samples, quantiles, memory of the process.

use nalgebra::Vector3;
use touchup::sim::wavy::slide_on;
use touchup::stylus::Sample;

/// Noise of the tracker on each axis, m.
const NOISE: f64 = 0.03e-3;
/// Assumed scan noise, m.
pub const SCAN_NOISE: f64 = 0.3e-3;

/// Sample `i` of [`slide_on`] with evenly spread noise of the wanted standard deviation, the same each time.
pub fn noisy(side: f64, i: usize, width: f64) -> Sample {
    let mut sample = slide_on(side, i, width);
    let mut state = i as u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 12f64.sqrt() * NOISE
    };
    draw();
    sample.pose_ot.translation.vector += Vector3::new(draw(), draw(), draw());
    sample
}

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
