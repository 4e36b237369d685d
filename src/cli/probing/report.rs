//! Probing results, as a table, as JSON, and touch by touch.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::cli::common::refinement::RefineSummary;
use crate::cli::common::told::ToldNumbers;
use crate::cli::{counted, reported};
use touchup_features::conformity::Decision;
use touchup_features::features::{FeatureKind, InspectedQuantity};
use touchup_io::features_file::FeatureRecord;
use touchup_probing::arm::SlideRecord;
use touchup_probing::execute::{
    Ending, Flag, FlagResult, ProbedSlide, ProbedTouch, ReferenceTouch,
};
use touchup_probing::plan::DecidedCharacteristic;
use touchup_session::scene::{CheckRecord, CheckStanding};

reported! {
    /// Results of one flag, in `probed.json`.
    #[derive(Clone, Deserialize)]
    pub(in crate::cli) struct ProbedRecord, pub(super) fn of(probed: &FlagResult, flagged: &Flag) {
        pub(super) flag: u32 = probed.flag,
        kind: String = kind_of(flagged).to_owned(),
        flagged_mm: [f64; 3] = (flagged.place * 1e3).coords.into(),
        search_radius_mm: f64 = flagged.radius * 1e3,
        /// Code of the ending: `tolerance_reached`, `touches_spent`, `calibration_limits`,
        /// `decided`, `undecided`, `undecidable`, `time_spent`, `nothing_found`, `cancelled`,
        /// `out_of_limits`, `no_clear_path`, `stopped`.
        code: String = code(&probed.ending).to_owned(),
        /// Ending in words.
        ending: String = probed.ending.to_string(),
        touches: usize = probed.touches.len(),
        /// Rejected touches, with reasons.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        rejected_touches: Vec<RejectedTouch> = probed.touches.iter().enumerate().filter_map(RejectedTouch::of).collect(),
        /// Omitted places: the scan has no part there.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        beside_the_part_mm: Vec<[f64; 3]> = probed.left_out.iter().map(|place| (place * 1e3).coords.into()).collect(),
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        slides: Vec<SlideRecordOfFile> = probed.slides.iter().map(SlideRecordOfFile::of).collect(),
        /// Contacts last touched again, none of them moved.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        touched_again: Vec<TouchedAgain> = probed.references.iter().map(TouchedAgain::of).collect(),
        /// Number of touches made before `touched_again`; later ones are in doubt.
        #[serde(default)]
        verified_touches: usize = probed.verified,
        duration_s: f64 = probed.seconds,
        largest_force_n: f64 = probed.peak_force,
        /// Uncertainty of the target number, mm or rad.
        uncertainty_mm?: f64 = probed.found.as_ref().and_then(|found| found.uncertainty).map(|sigma| sigma * 1e3),
        /// Share of it common to all touches: radius, place of the part, kinematics.
        shared_uncertainty_mm?: f64 = probed.found.as_ref().filter(|found| found.uncertainty.is_some()).map(|found| found.shared * 1e3),
        /// `std` of `feature` from the scatter of its touches alone.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        std_of_touches: BTreeMap<String, f64> = probed
            .found
            .as_ref()
            .and_then(|found| found.by_touches.as_ref())
            .map_or_else(BTreeMap::new, |feature| FeatureRecord::of(feature).std),
        /// Characteristics of `--until decided`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        characteristics: Vec<ProbedCharacteristic> = probed
            .found
            .iter()
            .flat_map(|found| &found.characteristics)
            .map(ProbedCharacteristic::of)
            .collect(),
        feature?: FeatureRecord = probed.found.as_ref().and_then(|found| found.feature.as_ref()).map(FeatureRecord::of),
    }
}

/// Coverage factor of expanded uncertainties.
const COVERAGE: f64 = 2.0;

reported! {
    /// Characteristic to decide.
    #[derive(Clone, Deserialize)]
    struct ProbedCharacteristic, fn of(one: &DecidedCharacteristic) {
        name: String = one.sought.name.clone(),
        quantity: String = one.sought.quantity.name().to_owned(),
        /// `pass`, `fail` or `undecided`.
        decision: String = one.assessment.decision.name().to_owned(),
        /// Reason, if undecided.
        reason?: String = why_open(one),
        value_mm?: f64 = one.measured.map(|number| number.value * 1e3),
        /// U, with a coverage factor of 2.
        expanded_uncertainty_mm?: f64 = one.measured.and_then(|number| number.std).map(|std| std * COVERAGE * 1e3),
        /// Part of the standard uncertainty common to all touches.
        shared_uncertainty_mm: f64 = one.shared * 1e3,
        lower_limit_mm?: f64 = one.sought.limits.lower.map(|limit| limit * 1e3),
        upper_limit_mm?: f64 = one.sought.limits.upper.map(|limit| limit * 1e3),
        conformance_probability?: f64 = one.assessment.conformance_probability,
    }
}

fn why_open(one: &DecidedCharacteristic) -> Option<String> {
    let is_undecided = one.assessment.decision == Decision::Undecided;
    let why = match one.measured {
        None => "its touches do not fix it",
        Some(_) if one.is_limited => {
            "no touch decides it: what all touches have in common leaves it open, or they do not fix it"
        }
        Some(_) => "more touches could decide it",
    };
    is_undecided.then(|| why.to_owned())
}

impl fmt::Display for ProbedCharacteristic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.decision)?;
        if let Some(value) = self.value_mm {
            write!(f, ": {value:.3} mm")?;
        }
        self.expanded_uncertainty_mm
            .iter()
            .try_for_each(|expanded| write!(f, " ± {expanded:.3} mm (k = 2)"))?;
        match (self.lower_limit_mm, self.upper_limit_mm) {
            (Some(lower), Some(upper)) => write!(f, ", limits {lower:.3} to {upper:.3} mm")?,
            (Some(lower), None) => write!(f, ", at least {lower:.3} mm")?,
            (None, Some(upper)) => write!(f, ", at most {upper:.3} mm")?,
            (None, None) => {}
        }
        self.reason
            .iter()
            .try_for_each(|reason| write!(f, "; {reason}"))
    }
}

/// Rejected touch.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RejectedTouch {
    /// Index in this probing of the feature, from 0 on.
    index: usize,
    reason: String,
}

impl RejectedTouch {
    fn of((index, touch): (usize, &ProbedTouch)) -> Option<Self> {
        Some(Self {
            index,
            reason: touch.refused.clone()?,
        })
    }
}

/// Code of an unknown region, without a number to measure: the arm makes all its touches.
const UNKNOWN: &str = "unknown";

/// Kind of a flag, by its name.
pub(super) fn kind_of(flag: &Flag) -> &'static str {
    flag.kind.map_or(UNKNOWN, FeatureKind::name)
}

impl ProbedRecord {
    /// Whether the arm completed the probing, with or without a feature.
    pub(super) fn is_finished(&self) -> bool {
        matches!(
            self.code.as_str(),
            "tolerance_reached"
                | "touches_spent"
                | "calibration_limits"
                | "decided"
                | "undecided"
                | "undecidable"
                | "time_spent"
                | "nothing_found"
        )
    }

    /// Whether a stop of the arm, or a signal, ended it.
    pub(super) fn is_broken_off(&self) -> bool {
        matches!(self.code.as_str(), "cancelled" | "stopped")
    }

    /// Results of the references, a line of the summary each.
    fn references(&self) -> String {
        let farthest = |one: &TouchedAgain| one.off_mm.abs();
        let again = self.touched_again.iter().map(farthest).reduce(f64::max);
        let again = again.map(|most_mm| {
            let contacts = counted(self.touched_again.len(), "contact", "contacts");
            format!("\n  {contacts} touched again, {most_mm:.3} mm off at most")
        });
        let doubted = (self.verified_touches < self.touches).then(|| {
            let (first, last) = (self.verified_touches, self.touches - 1);
            format!("\n  in doubt: after touches {first} to {last} no contact was found where it had been")
        });
        again.into_iter().chain(doubted).collect()
    }

    /// Deviation from the request, if any.
    pub(super) fn loss(&self) -> Option<String> {
        let failed: Vec<_> = self
            .characteristics
            .iter()
            .filter(|one| one.decision == Decision::Fail.name())
            .collect();
        if !failed.is_empty() {
            let failed = failed
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("; ");
            let ending = if self.code == "decided" {
                String::new()
            } else {
                format!("; {}", self.ending)
            };
            return Some(format!("feature {}: {failed}{ending}", self.flag));
        }
        let is_as_asked = match self.code.as_str() {
            "tolerance_reached" | "decided" => true,
            "touches_spent" => self.kind == UNKNOWN,
            _ => false,
        };
        (!is_as_asked).then(|| format!("feature {}: {}", self.flag, self.ending))
    }
}

reported! {
    /// Reference touched again.
    #[derive(Clone, Deserialize)]
    struct TouchedAgain, fn of(touch: &ReferenceTouch) {
        /// Number of its feature.
        flag: u32 = touch.flag,
        /// Index of the touch in that feature, from 0 on.
        index: usize = touch.index,
        /// Shift along its search, positive farther along.
        off_mm: f64 = touch.off * 1e3,
        /// Standard uncertainty of the shift.
        std_mm: f64 = touch.sigma * 1e3,
    }
}

reported! {
    /// One slide.
    #[derive(Clone, Deserialize)]
    struct SlideRecordOfFile, fn of(probed: &ProbedSlide) {
        /// Outcome, or reason for its omission.
        ending: String = match &probed.record {
            Some(record) => record.ending.to_string(),
            None => probed.refused.clone().unwrap_or_default(),
        },
        length_mm: f64 = probed.slide.length() * 1e3,
        forces?: SlideForces = probed.record.as_ref().map(SlideForces::of),
    }
}

reported! {
    /// Contact force along a slide.
    #[derive(Clone, Deserialize)]
    struct SlideForces, fn of(record: &SlideRecord) {
        duration_s: f64 = (record.stamps_ns[1] - record.stamps_ns[0]) as f64 * 1e-9,
        mean_force_n: f64 = record.mean_force,
        /// Largest deviation of the mean over a tenth of a second from the set force.
        worst_force_error_n: f64 = record.worst_force,
        largest_force_n: f64 = record.peak_force,
    }
}

reported! {
    /// Check of the arm, as valid at the time of the results.
    #[derive(Clone, Deserialize)]
    pub(in crate::cli) struct CheckOfResults, pub(super) fn of(standing: &CheckStanding) {
        /// Whether the check is free of doubts.
        is_good: bool = standing.doubts.is_empty(),
        /// Reasons against relying on it.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        doubts: Vec<String> = standing.doubts(),
        age_days?: f64 = standing.age_days,
        /// Record of the check, without the touches.
        record?: CheckRecord = standing.record.clone(),
        /// Check in one line.
        summary: String = standing.to_string(),
    }
}

/// Content of `probed.json`.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct ProbedFile {
    pub features: Vec<ProbedRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub check: Option<CheckOfResults>,
}

/// Summary of a probing.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct ProbingSummary {
    pub check: CheckOfResults,
    pub features: Vec<ProbedRecord>,
    /// Settings of tip and scan, and their sources.
    pub told: ToldNumbers,
    /// Summary of the mesh; `None` after a signal, and without a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refine: Option<RefineSummary>,
}

fn code(ending: &Ending) -> &'static str {
    match ending {
        Ending::ToleranceReached => "tolerance_reached",
        Ending::TouchesSpent => "touches_spent",
        Ending::CalibrationLimits { .. } => "calibration_limits",
        Ending::Decided => "decided",
        Ending::Undecided { .. } => "undecided",
        Ending::Undecidable { .. } => "undecidable",
        Ending::TimeSpent => "time_spent",
        Ending::NothingFound(_) => "nothing_found",
        Ending::Cancelled(_) => "cancelled",
        Ending::OutOfLimits(_) => "out_of_limits",
        Ending::NoClearPath(_) => "no_clear_path",
        Ending::Stopped(_) => "stopped",
    }
}

impl fmt::Display for ProbingSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |wanted: Ending| {
            self.features
                .iter()
                .filter(|record| record.code == code(&wanted))
                .count()
        };
        let features = counted(self.features.len(), "feature", "features");
        if self
            .features
            .iter()
            .any(|record| !record.characteristics.is_empty())
        {
            writeln!(f, "decided: {} of {features}", count(Ending::Decided))?;
        } else {
            writeln!(
                f,
                "tolerance reached: {} of {features}",
                count(Ending::ToleranceReached)
            )?;
        }
        for record in &self.features {
            let ProbedRecord {
                flag,
                kind,
                touches,
                duration_s,
                largest_force_n,
                ending,
                ..
            } = record;
            write!(f, "{kind} {flag}: {ending}")?;
            record
                .feature
                .iter()
                .try_for_each(|feature| write!(f, ": {}", numbers(feature)))?;
            record
                .characteristics
                .iter()
                .try_for_each(|one| write!(f, "\n  {one}"))?;
            let touches = counted(*touches, "touch", "touches");
            write!(
                f,
                "\n  {touches}, {duration_s:.0} s, {largest_force_n:.1} N at most"
            )?;
            by_reason(&record.rejected_touches)
                .iter()
                .try_for_each(|line| write!(f, "\n  {line}"))?;
            record
                .slides
                .iter()
                .try_for_each(|slide| write!(f, "\n  {slide}"))?;
            write!(f, "{}", record.references())?;
            writeln!(f)?;
        }
        writeln!(f, "{}", self.check.summary)?;
        // the summary of the mesh has the settings
        match &self.refine {
            Some(refine) => write!(f, "{refine}"),
            None => write!(f, "{}", self.told),
        }
    }
}

/// Rejected touches, a line for each reason.
fn by_reason(rejected: &[RejectedTouch]) -> Vec<String> {
    let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
    for RejectedTouch { index, reason } in rejected {
        match groups.iter_mut().find(|(known, _)| known == reason) {
            Some((_, indices)) => indices.push(*index),
            None => groups.push((reason, vec![*index])),
        }
    }
    let line = |(reason, indices): (&str, Vec<usize>)| match indices[..] {
        [index] => format!("touch {index} does not count: {reason}"),
        _ => format!("touches {} do not count: {reason}", in_ranges(&indices)),
    };
    groups.into_iter().map(line).collect()
}

/// Ascending numbers in words, with a range for each run of more than two: `0, 1, 4 to 9`.
fn in_ranges(numbers: &[usize]) -> String {
    let runs = numbers
        .chunk_by(|a, b| a + 1 == *b)
        .flat_map(|run| match run {
            [first, _, .., last] => vec![format!("{first} to {last}")],
            few => few.iter().map(usize::to_string).collect(),
        });
    runs.collect::<Vec<_>>().join(", ")
}

impl fmt::Display for SlideRecordOfFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "slide of {:.0} mm: {}", self.length_mm, self.ending)?;
        match &self.forces {
            Some(SlideForces {
                duration_s,
                mean_force_n,
                worst_force_error_n,
                ..
            }) => {
                write!(
                    f,
                    " after {duration_s:.1} s, {mean_force_n:.2} N, at most {worst_force_error_n:.2} N off"
                )
            }
            None => Ok(()),
        }
    }
}

/// Numbers of a feature with their standard uncertainties, mm.
fn numbers(feature: &FeatureRecord) -> String {
    let with = |name: &str, quantity| {
        let number = feature.number(quantity)?;
        let bound = if number.is_at_least { "≥ " } else { "" };
        Some(match number.std {
            Some(std) => format!("{name}{:.3} ± {std:.3}", number.value),
            None => format!("{name}{bound}{:.3}", number.value),
        })
    };
    let centre = feature.center_mm.map(|[x, y, z]| {
        let std = feature
            .std
            .get("center_mm")
            .map_or(String::new(), |std| format!(" ± {std:.3}"));
        format!("at ({x:.3} {y:.3} {z:.3}){std}")
    });
    let all = [
        centre,
        with("Ø", InspectedQuantity::Diameter),
        with("length ", InspectedQuantity::Length),
        with("width ", InspectedQuantity::Width),
        with("depth ", InspectedQuantity::Depth),
    ];
    format!(
        "{} mm",
        all.into_iter().flatten().collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_with_the_same_reason_are_one_line() {
        let touch = |(index, reason): (usize, &str)| RejectedTouch {
            index,
            reason: reason.to_owned(),
        };
        let rejected = [
            (0, "far"),
            (1, "an impact"),
            (2, "far"),
            (3, "far"),
            (5, "far"),
            (6, "far"),
            (7, "far"),
            (9, "far"),
        ];
        assert_eq!(
            by_reason(&rejected.map(touch)),
            [
                "touches 0, 2, 3, 5 to 7, 9 do not count: far",
                "touch 1 does not count: an impact"
            ]
        );
        assert!(by_reason(&[]).is_empty());
    }
}
