//! Detected features beside those of a known part.

use std::fmt;

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use crate::cli::reported;
use touchup_features::features::InspectedQuantity;
use touchup_io::features_file::FeatureRecord;
use touchup_sim::TruthFeature;

reported! {
    /// True feature and its detection; lengths in mm, angles in degrees.
    pub(in crate::cli) struct FoundFeature, fn of(truth: &TruthFeature, record: Option<&FeatureRecord>) {
        name: &'static str = truth.name,
        /// Number in features.json; `null`: not found.
        id: Option<u32> = record.map(|record| record.id),
        numbers: Vec<FoundNumber> = numbers(truth, record),
        center_off_mm: Option<f64> = record.and_then(|record| off_mm(truth, record)),
        axis_off_deg: Option<f64> = record.and_then(|record| axis_off_deg(truth, record)),
        touched: Option<f64> = record.map(|record| record.touched),
    }
}

/// Number of a drawing, and its measurement.
#[derive(Debug, Serialize)]
struct FoundNumber {
    name: &'static str,
    truth: f64,
    found: Option<f64>,
    std: Option<f64>,
    /// Whether this is a depth with an untouched floor.
    #[serde(skip)]
    is_lower_bound: bool,
}

/// All features of a part, and the number of false detections.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct FoundTable {
    features: Vec<FoundFeature>,
    /// Holes, slots, pockets and bosses that the part does not have.
    invented: usize,
}

/// Largest distance of a detected centre from the true one, mm.
const NEAR_MM: f64 = 1.5;
/// Kinds for the count of false detections.
const COUNTED: [&str; 4] = ["hole", "slot", "pocket", "boss"];

impl FoundTable {
    /// Matches each true feature with the found ones.
    pub fn of(truth: &[TruthFeature], found: &[FeatureRecord]) -> Self {
        let features: Vec<_> = truth
            .iter()
            .map(|truth| FoundFeature::of(truth, nearest(truth, found)))
            .collect();
        let matched =
            |record: &&FeatureRecord| features.iter().any(|feature| feature.id == Some(record.id));
        let counted = found
            .iter()
            .filter(|record| COUNTED.contains(&record.kind.as_str()));
        Self {
            invented: counted.filter(|record| !matched(record)).count(),
            features,
        }
    }
}

/// Nearest found feature of the same kind, if any.
fn nearest<'a>(truth: &TruthFeature, found: &'a [FeatureRecord]) -> Option<&'a FeatureRecord> {
    let kind = truth.kind().name();
    let off = |record: &&FeatureRecord| off_mm(truth, record).unwrap_or(f64::INFINITY);
    let of_kind = found.iter().filter(|record| record.kind == kind);
    of_kind
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .filter(|record| off(record) < NEAR_MM)
}

/// Numbers of a feature on the drawing, beside the found ones.
fn numbers(truth: &TruthFeature, record: Option<&FeatureRecord>) -> Vec<FoundNumber> {
    let number = |quantity: InspectedQuantity, truth: f64| {
        let found = record.and_then(|record| record.number(quantity));
        FoundNumber {
            name: quantity.name(),
            truth: truth * 1e3,
            found: found.map(|found| found.value),
            std: found.and_then(|found| found.std),
            is_lower_bound: found.is_some_and(|found| found.is_at_least),
        }
    };
    let sizes = truth.sizes().into_iter();
    sizes
        .map(|(quantity, size)| number(quantity, size))
        .collect()
}

/// Distance across the axis, mm.
fn off_mm(truth: &TruthFeature, record: &FeatureRecord) -> Option<f64> {
    let off = Point3::from(record.center_mm?) - truth.centre * 1e3;
    Some(off.cross(&truth.direction()).norm())
}

fn axis_off_deg(truth: &TruthFeature, record: &FeatureRecord) -> Option<f64> {
    let (axis, truth) = (Vector3::from(record.axis?), truth.direction());
    Some(
        axis.cross(&truth)
            .norm()
            .atan2(axis.dot(&truth).abs())
            .to_degrees(),
    )
}

impl fmt::Display for FoundTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<14} {:>22} {:>26} {:>10}   center, axis off   touched",
            "feature", "true, mm", "found", "error"
        )?;
        self.features
            .iter()
            .try_for_each(|feature| write!(f, "\n{feature}"))?;
        match self.invented {
            0 => write!(f, "\nnone invented"),
            count => write!(f, "\n{count} invented"),
        }
    }
}

impl fmt::Display for FoundFeature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(_) = self.id else {
            return write!(f, "{:<14} not found", self.name);
        };
        let place = format!(
            "{} {}",
            self.center_off_mm
                .map_or(String::new(), |off| format!("{off:.3} mm")),
            self.axis_off_deg
                .map_or(String::new(), |off| format!("{off:.2}°"))
        );
        let touched = self
            .touched
            .map_or(String::new(), |share| format!("{:.0} %", share * 100.0));
        let Some((first, others)) = self.numbers.split_first() else {
            return write!(f, "{:<14} {:>60}   {place:<18} {touched}", self.name, "");
        };
        write!(f, "{:<14} {first}   {place:<18} {touched}", self.name)?;
        others
            .iter()
            .try_for_each(|number| write!(f, "\n{:<14} {number}", ""))
    }
}

impl fmt::Display for FoundNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let truth = format!("{} {:.3}", self.name.trim_end_matches("_mm"), self.truth);
        let Some(found) = self.found else {
            return write!(f, "{truth:>22} {:>26} {:>10}", "not measured", "");
        };
        let shown = match self.std {
            Some(std) => format!("{found:.3} ± {std:.3}"),
            None if self.is_lower_bound => format!("≥ {found:.3}, no farther touched"),
            None => format!("{found:.3} (not touched)"),
        };
        write!(
            f,
            "{truth:>22} {shown:>26} {:>10}",
            format!("{:+.3}", found - self.truth)
        )
    }
}
