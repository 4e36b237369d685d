//! Settings that take a finding about a recording off.

use nalgebra::Vector3;

use super::{Scene, Setting};
use touchup_features::diagnose::InputCorrection;
use touchup_method::stylus::{ClockOffset, KnownChange};

impl Scene {
    /// Settings of this scene that take a finding off; with them it is as in the recording.
    pub fn corrected(&self, correction: &InputCorrection) -> Vec<Setting> {
        match correction {
            InputCorrection::Change(change) => {
                let changes = self.changes.iter().chain([change]).map(written);
                let changes: Vec<String> = changes.collect();
                vec![Setting::word(
                    "changes",
                    format!("[{}]", changes.join(", ")),
                )]
            }
            InputCorrection::TipOffset { offset, sigma } => {
                let told = self
                    .tip
                    .as_ref()
                    .and_then(|tip| tip.offset)
                    .unwrap_or_default();
                let place = |of: f64| of.max(*sigma) * 1e3;
                let sigma = self.uncertainty.map(|known| place(known.calibration.place));
                let sigma =
                    sigma.map(|mm| Setting::word("uncertainty.place_sigma_mm", decimal(mm)));
                let offset = list(&((told + offset) * 1e3));
                [Setting::word("tip.offset_mm", offset)]
                    .into_iter()
                    .chain(sigma)
                    .collect()
            }
            InputCorrection::Compliance { compliance, sigma } => {
                let percent = (100.0 * sigma / compliance).min(100.0);
                let percent = self
                    .uncertainty
                    .map(|_| Setting::word("uncertainty.stiffness_percent", decimal(percent)));
                let stiffness = decimal(1e-3 / compliance);
                let stiffness = Setting::word("tip.stiffness_n_per_mm", stiffness);
                [stiffness].into_iter().chain(percent).collect()
            }
            InputCorrection::WrenchClock(found) => self.paired_with(found),
        }
    }

    /// The whole offset of the wrench clock, and its drift if it is evident.
    fn paired_with(&self, found: &ClockOffset) -> Vec<Setting> {
        let applied = self.sync_params();
        let offset = found.drift().map_or(found.offset, |of| of.offset_at_first);
        let offset_ms = offset * 1e3 + applied.wrench_offset_ns as f64 * 1e-6;
        let drift = found
            .drift()
            .map(|of| (of.rate + applied.wrench_drift) * 1e6);
        let drift = drift.map(|ppm| Setting::word("sync.wrench_drift_ppm", decimal(ppm)));
        let offset = Setting::word("sync.wrench_offset_ms", decimal(offset_ms));
        [offset].into_iter().chain(drift).collect()
    }
}

const SECOND_NS: i64 = 1_000_000_000;

/// A number for people: 0.1 µm, 10 µs.
fn decimal(x: f64) -> String {
    format!("{x:.4}")
}

fn list(x: &Vector3<f64>) -> String {
    format!(
        "[{}]",
        x.iter().map(|x| decimal(*x)).collect::<Vec<_>>().join(", ")
    )
}

/// A change as YAML on one line.
fn written(change: &KnownChange) -> String {
    let KnownChange {
        cause,
        from,
        to,
        shift,
        turn,
        about,
        shift_sigma,
        turn_sigma,
    } = change;
    let seconds = |stamp_ns: i64| format!("{}.{:09}", stamp_ns / SECOND_NS, stamp_ns % SECOND_NS);
    let times = [("from_s", from), ("to_s", to)];
    let times = times.map(|(key, at)| at.map(|at| format!("{key}: {}", seconds(at))));
    let sizes = [
        ("shift_mm", shift * 1e3),
        ("shift_sigma_mm", shift_sigma * 1e3),
        ("turn_deg", turn.map(f64::to_degrees)),
        ("turn_sigma_deg", turn_sigma.map(f64::to_degrees)),
        ("about_mm", about.coords * 1e3),
    ];
    // a change without a turn needs neither turn nor centre
    let turns = *turn != Vector3::zeros() || *turn_sigma != Vector3::zeros();
    let needed = if turns { 5 } else { 2 };
    let sizes = sizes[..needed]
        .iter()
        .map(|(key, size)| format!("{key}: {}", list(size)));
    let keys = [format!("cause: {cause}")].into_iter();
    let keys: Vec<String> = keys
        .chain(times.into_iter().flatten())
        .chain(sizes)
        .collect();
    format!("{{ {} }}", keys.join(", "))
}
