//! Description of the machine, for reports of measurements.

use std::fs;
use std::thread::available_parallelism;

/// Commit of the build, with a mark for later changes; "unknown" without a checkout.
pub const COMMIT: &str = env!("TOUCHUP_COMMIT");
/// Version and commit.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TOUCHUP_COMMIT"), ")");

/// Processor, hardware threads, memory, and system, where known.
pub fn describe_machine() -> String {
    let processor = fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| value_of(&text, "model name"));
    let threads = available_parallelism().map_or(1, usize::from);
    let memory = fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|text| value_of(&text, "MemTotal"));
    let system = fs::read_to_string("/etc/os-release")
        .ok()
        .and_then(|text| value_of(&text, "PRETTY_NAME"));
    let parts = [
        Some(processor.unwrap_or_else(|| "unknown processor".to_owned())),
        Some(format!(
            "{threads} hardware thread{}",
            if threads == 1 { "" } else { "s" }
        )),
        memory.as_deref().and_then(gigabytes),
        Some(system.unwrap_or_else(|| std::env::consts::OS.to_owned())),
        Some(std::env::consts::ARCH.to_owned()),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The value behind the first `key` and `:` or `=`, without quotes.
fn value_of(text: &str, key: &str) -> Option<String> {
    let value = |line: &str| {
        let rest = line
            .strip_prefix(key)?
            .trim_start()
            .strip_prefix([':', '='])?;
        Some(rest.trim().trim_matches('"').to_owned())
    };
    text.lines()
        .find_map(value)
        .filter(|value| !value.is_empty())
}

/// Of "8123456 kB".
fn gigabytes(kilobytes: &str) -> Option<String> {
    let kilobytes: f64 = kilobytes.strip_suffix("kB")?.trim().parse().ok()?;
    Some(format!("{:.1} GB memory", kilobytes * 1024.0 / 1e9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linux_machine_files_are_read() {
        let text = "processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\nmodel name\t: another\n";
        assert_eq!(
            value_of(text, "model name").as_deref(),
            Some("Some CPU @ 2 GHz")
        );
        assert_eq!(
            value_of("NAME=x\nPRETTY_NAME=\"Debian 13\"\n", "PRETTY_NAME").as_deref(),
            Some("Debian 13")
        );
        assert_eq!(value_of(text, "MemTotal"), None);
        assert_eq!(gigabytes("8000000 kB").as_deref(), Some("8.2 GB memory"));
        assert_eq!(gigabytes("many"), None);
    }
}
