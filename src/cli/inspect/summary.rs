//! Inspection in a few lines.

use crate::cli::{Losses, counted};
use touchup_features::conformity::Decision;
use touchup_inspect::{first_few, percent};
use touchup_io::inspection_file::{AlignmentRecord, CharacteristicRecord, InspectionRecord};

/// Table for stdout.
pub(super) fn in_words(record: &InspectionRecord) -> String {
    let width = record
        .characteristics
        .iter()
        .map(|one| one.name.chars().count())
        .max()
        .unwrap_or(0)
        .clamp(14, 40);
    let k = record.coverage_factor;
    let head = format!(
        "{:<6} {:<width$} {:>10} {:>21} {:>22} {:>10}  decision",
        "no.",
        "characteristic",
        "nominal",
        "limits",
        format!("actual ± U (k = {k})"),
        "deviation"
    );
    let mut lines = vec![head];
    lines.extend(record.characteristics.iter().map(|one| row(one, width)));
    let without = &record.without_characteristic;
    if !without.is_empty() {
        let ids = without
            .iter()
            .map(u32::to_string)
            .collect::<Vec<_>>()
            .join(", ");
        lines.push(format!(
            "without a characteristic: {}: {ids}",
            counted(without.len(), "feature", "features")
        ));
    }
    lines.extend(record.alignment.iter().map(aligned));
    lines.extend(record.notes.iter().cloned());
    let count = |decision: Decision| record.counts.get(decision.name()).copied().unwrap_or(0);
    let [pass, undecided, fail] = Decision::ALL.map(count);
    lines.push(format!(
        "{}: {pass} pass, {fail} fail, {undecided} undecided; rule {}, {} %",
        record.verdict.to_uppercase(),
        record.rule,
        percent(record.confidence)
    ));
    lines.join("\n")
}

/// Alignment of drawing and part.
fn aligned(found: &AlignmentRecord) -> String {
    let [turn, shift] = [found.rotation_vector_deg, found.translation_mm]
        .map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt());
    let names = found
        .features
        .iter()
        .map(|one| one.name.clone())
        .collect::<Vec<_>>();
    format!(
        "aligned by {}: {}; turned by {turn:.4}°, shifted by {shift:.3} mm; residual {:.3} mm rms, {:.3} mm at most",
        found.method,
        first_few(&names, ", "),
        found.residual_rms_mm,
        found.residual_max_mm
    )
}

fn row(one: &CharacteristicRecord, width: usize) -> String {
    let number = |name: &str| {
        one.number(name)
            .map_or_else(|| "-".to_owned(), |number| format!("{number:.3}"))
    };
    let limits = format!("{} … {}", number("lower_limit"), number("upper_limit"));
    let bound = if one.is_at_least { "≥ " } else { "" };
    let spread = one
        .number("expanded_uncertainty")
        .map_or(String::new(), |u| format!(" ± {u:.3}"));
    let actual = one
        .number("actual")
        .map_or("not measured".to_owned(), |actual| {
            format!("{bound}{actual:.3}{spread}")
        });
    let deviation = one
        .number("deviation")
        .map_or(String::new(), |deviation| format!("{deviation:+.3}"));
    let name: String = one.name.chars().take(width).collect();
    let why = one
        .reason
        .as_ref()
        .map_or(String::new(), |reason| format!(": {reason}"));
    format!(
        "{:<6} {name:<width$} {:>10} {limits:>21} {actual:>22} {deviation:>10}  {}{why}",
        one.number,
        number("nominal"),
        one.decision
    )
}

/// Characteristics without proof of conformity, a line for each decision; empty: none.
pub(super) fn losses(record: &InspectionRecord) -> Losses {
    let named = |decision: Decision, said: &str| {
        let names: Vec<_> = record
            .characteristics
            .iter()
            .filter(|one| one.decision == decision.name())
            .collect();
        let all = first_few(
            &names.iter().map(|one| one.name.clone()).collect::<Vec<_>>(),
            ", ",
        );
        let count = record.characteristics.len();
        (!names.is_empty()).then(|| format!("{} of {count} {said}: {all}", names.len()))
    };
    [
        named(Decision::Fail, "out of tolerance"),
        named(Decision::Undecided, "undecided"),
    ]
    .into_iter()
    .flatten()
    .collect()
}
