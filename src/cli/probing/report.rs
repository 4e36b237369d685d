//! Probing results, as a table, as JSON, and touch by touch.

use std::fmt;

use serde::Serialize;

use crate::cli::refine::RefineSummary;
use crate::cli::{counted, reported};
use crate::features::Kind;
use crate::io::features_file::FeatureRecord;
use crate::probing::arm::SlideRecord;
use crate::probing::execute::{Ending, Flag, Probed, ProbedSlide};

reported! {
    /// One flag: of `probed.json`.
    #[derive(Clone)]
    pub(in crate::cli) struct ProbedRecord, fn of(probed: &Probed, flagged: Option<&Flag>) {
        flag: u32 = probed.flag,
        kind: &'static str = flagged.and_then(|flag| flag.kind).map_or("unknown", Kind::name),
        flagged_mm: [f64; 3] = flagged.map_or([f64::NAN; 3], |flag| (flag.place * 1e3).coords.into()),
        search_radius_mm: f64 = flagged.map_or(f64::NAN, |flag| flag.radius * 1e3),
        /// how it ended: `tolerance_reached`, `touches_spent`, `time_spent`, `nothing_found`, `cancelled`, `out_of_limits`,
        /// `no_clear_path`, `stopped`
        code: &'static str = code(&probed.ending),
        /// the same in words
        ending: String = probed.ending.to_string(),
        touches: usize = probed.touches.len(),
        #[serde(skip_serializing_if = "Vec::is_empty")]
        slides: Vec<SlideRecordOfFile> = probed.slides.iter().map(SlideRecordOfFile::of).collect(),
        duration_s: f64 = probed.seconds,
        largest_force_n: f64 = probed.peak_force,
        /// of the wanted number, mm or rad
        uncertainty_mm?: f64 = probed.found.as_ref().and_then(|found| found.uncertainty).map(|sigma| sigma * 1e3),
        feature?: FeatureRecord = probed.found.as_ref().and_then(|found| found.feature.as_ref()).map(FeatureRecord::of),
    }
}

reported! {
    /// One slide.
    #[derive(Clone)]
    struct SlideRecordOfFile, fn of(probed: &ProbedSlide) {
        /// its outcome, or why it was not made
        ending: String = match &probed.record {
            Some(record) => record.ending.to_string(),
            None => probed.refused.clone().unwrap_or_default(),
        },
        length_mm: f64 = probed.slide.length() * 1e3,
        forces?: SlideForces = probed.record.as_ref().map(SlideForces::of),
    }
}

reported! {
    /// The contact force along it.
    #[derive(Clone)]
    struct SlideForces, fn of(record: &SlideRecord) {
        duration_s: f64 = (record.stamps_ns[1] - record.stamps_ns[0]) as f64 * 1e-9,
        mean_force_n: f64 = record.mean_force,
        /// largest deviation of the mean over a tenth of a second from the set force
        worst_force_error_n: f64 = record.worst_force,
        largest_force_n: f64 = record.peak_force,
    }
}

/// The summary of a probing.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct ProbingSummary {
    pub features: Vec<ProbedRecord>,
    pub refine: RefineSummary,
}

fn code(ending: &Ending) -> &'static str {
    match ending {
        Ending::ToleranceReached => "tolerance_reached",
        Ending::TouchesSpent => "touches_spent",
        Ending::TimeSpent => "time_spent",
        Ending::NothingFound(_) => "nothing_found",
        Ending::Cancelled(_) => "cancelled",
        Ending::OutOfLimits(_) => "out_of_limits",
        Ending::NoClearPath(_) => "no_clear_path",
        Ending::Stopped(_) => "stopped",
    }
}

/// All flags that were begun.
pub(in crate::cli) fn records(probed: &[Probed], flags: &[Flag]) -> Vec<ProbedRecord> {
    let record = |one: &Probed| ProbedRecord::of(one, flags.iter().find(|flag| flag.id == one.flag));
    probed.iter().map(record).collect()
}

impl fmt::Display for ProbingSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reached = self.features.iter().filter(|record| record.code == code(&Ending::ToleranceReached)).count();
        writeln!(f, "tolerance reached: {reached} of {}", counted(self.features.len(), "feature", "features"))?;
        for record in &self.features {
            let ProbedRecord { flag, kind, touches, duration_s, largest_force_n, ending, .. } = record;
            write!(f, "{kind} {flag}: {ending}")?;
            record.feature.iter().try_for_each(|feature| write!(f, ": {}", numbers(feature)))?;
            let touches = counted(*touches, "touch", "touches");
            write!(f, "\n  {touches}, {duration_s:.0} s, {largest_force_n:.1} N at most")?;
            record.slides.iter().try_for_each(|slide| write!(f, "\n  {slide}"))?;
            writeln!(f)?;
        }
        write!(f, "{}", self.refine)
    }
}

impl fmt::Display for SlideRecordOfFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "slide of {:.0} mm: {}", self.length_mm, self.ending)?;
        match &self.forces {
            Some(SlideForces { duration_s, mean_force_n, worst_force_error_n, .. }) => {
                write!(f, " after {duration_s:.1} s, {mean_force_n:.2} N, at most {worst_force_error_n:.2} N off")
            }
            None => Ok(()),
        }
    }
}

/// The numbers of a feature with their standard uncertainties, mm.
fn numbers(feature: &FeatureRecord) -> String {
    let with = |name: &str, value: Option<f64>, key: &str| {
        value.map(|value| match feature.std.get(key) {
            Some(std) => format!("{name}{value:.3} ± {std:.3}"),
            None => format!("{name}{value:.3}"),
        })
    };
    let centre = feature.center_mm.map(|[x, y, z]| {
        let std = feature.std.get("center_mm").map_or(String::new(), |std| format!(" ± {std:.3}"));
        format!("at ({x:.3} {y:.3} {z:.3}){std}")
    });
    let all = [
        centre,
        with("Ø", feature.diameter_mm, "diameter_mm"),
        with("length ", feature.length_mm, "length_mm"),
        with("width ", feature.width_mm, "width_mm"),
        with("depth ", feature.depth_mm, "depth_mm"),
    ];
    format!("{} mm", all.into_iter().flatten().collect::<Vec<_>>().join(", "))
}
