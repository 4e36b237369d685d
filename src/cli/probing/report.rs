//! Probing results, as a table, as JSON, and touch by touch.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::cli::refine::RefineSummary;
use crate::cli::{CliError, counted, write_json};
use crate::features::Kind;
use crate::io::features_file::FeatureRecord;
use crate::probing::execute::{Ending, Flag, Probed, ProbedSlide};

/// `probed.json`
#[derive(Debug, Serialize)]
pub(in crate::cli) struct ProbedFile {
    features: Vec<ProbedRecord>,
}

/// One flag.
#[derive(Clone, Debug, Serialize)]
struct ProbedRecord {
    flag: u32,
    kind: &'static str,
    flagged_mm: [f64; 3],
    search_radius_mm: f64,
    /// how it ended: `tolerance_reached`, `touches_spent`, `time_spent`, `nothing_found`, `cancelled`, `out_of_limits`,
    /// `no_clear_path`, `stopped`
    code: &'static str,
    /// the same in words
    ending: String,
    touches: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    slides: Vec<SlideRecordOfFile>,
    duration_s: f64,
    largest_force_n: f64,
    /// of the wanted number, mm or rad
    #[serde(skip_serializing_if = "Option::is_none")]
    uncertainty_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feature: Option<FeatureRecord>,
}

/// One slide.
#[derive(Clone, Debug, Serialize)]
struct SlideRecordOfFile {
    /// its outcome, or why it was not made
    ending: String,
    length_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    forces: Option<SlideForces>,
}

/// The contact force along it.
#[derive(Clone, Debug, Serialize)]
struct SlideForces {
    duration_s: f64,
    mean_force_n: f64,
    /// largest deviation of the mean over a tenth of a second from the set force
    worst_force_error_n: f64,
    largest_force_n: f64,
}

impl SlideRecordOfFile {
    fn of(probed: &ProbedSlide) -> Self {
        let ending = probed.record.as_ref().map(|record| record.ending.to_string()).or_else(|| probed.refused.clone());
        let forces = probed.record.as_ref().map(|record| SlideForces {
            duration_s: (record.stamps_ns[1] - record.stamps_ns[0]) as f64 * 1e-9,
            mean_force_n: record.mean_force,
            worst_force_error_n: record.worst_force,
            largest_force_n: record.peak_force,
        });
        Self { ending: ending.unwrap_or_default(), length_mm: probed.slide.length() * 1e3, forces }
    }
}

/// The summary of a probing.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct ProbingSummary {
    features: Vec<ProbedRecord>,
    refine: RefineSummary,
}

fn code(ending: &Ending) -> &'static str {
    match ending {
        Ending::ToleranceReached => "tolerance_reached",
        Ending::TouchesSpent => "touches_spent",
        Ending::TimeSpent => "time_spent",
        Ending::NothingFound(_) => "nothing_found",
        Ending::Cancelled => "cancelled",
        Ending::OutOfLimits(_) => "out_of_limits",
        Ending::NoClearPath(_) => "no_clear_path",
        Ending::Stopped(_) => "stopped",
    }
}

impl ProbedRecord {
    fn of(probed: &Probed, flags: &[Flag]) -> Self {
        let flag = flags.iter().find(|flag| flag.id == probed.flag);
        Self {
            flag: probed.flag,
            kind: flag.and_then(|flag| flag.kind).map_or("unknown", Kind::name),
            flagged_mm: flag.map_or([f64::NAN; 3], |flag| (flag.place * 1e3).coords.into()),
            search_radius_mm: flag.map_or(f64::NAN, |flag| flag.radius * 1e3),
            code: code(&probed.ending),
            ending: probed.ending.to_string(),
            touches: probed.touches.len(),
            slides: probed.slides.iter().map(SlideRecordOfFile::of).collect(),
            duration_s: probed.seconds,
            largest_force_n: probed.peak_force,
            uncertainty_mm: probed.found.as_ref().and_then(|found| found.uncertainty).map(|sigma| sigma * 1e3),
            feature: probed.found.as_ref().and_then(|found| found.feature.as_ref()).map(FeatureRecord::from),
        }
    }
}

impl ProbedFile {
    pub fn of(probed: &[Probed], flags: &[Flag]) -> Self {
        Self { features: probed.iter().map(|probed| ProbedRecord::of(probed, flags)).collect() }
    }

    pub fn write(&self, folder: &Path) -> Result<(), CliError> {
        write_json(&folder.join("probed.json"), self)
    }
}

impl ProbingSummary {
    pub fn of(probed: &[Probed], flags: &[Flag], refine: RefineSummary) -> Self {
        Self { features: ProbedFile::of(probed, flags).features, refine }
    }
}

impl fmt::Display for ProbingSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reached = self.features.iter().filter(|record| record.code == code(&Ending::ToleranceReached)).count();
        writeln!(f, "tolerance reached: {reached} of {}", counted(self.features.len(), "feature", "features"))?;
        for record in &self.features {
            let ProbedRecord { flag, kind, touches, duration_s, largest_force_n, ending, .. } = record;
            write!(f, "{kind} {flag}: {ending}")?;
            if let Some(feature) = &record.feature {
                write!(f, ": {}", numbers(feature))?;
            }
            let touches = counted(*touches, "touch", "touches");
            write!(f, "\n  {touches}, {duration_s:.0} s, {largest_force_n:.1} N at most")?;
            for slide in &record.slides {
                write!(f, "\n  {slide}")?;
            }
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
