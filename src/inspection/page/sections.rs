//! Head, verdict, form and relations, calibration, files, limits.

use super::decisions::{in_words, shown};
use super::input::ReportInput;
use crate::conformity::{Decision, MeasuredNumber};
use crate::features::InspectedQuantity;
use crate::html::{escaped, table};
use crate::inspection::calibration::CalibrationLine;
use crate::inspection::words::first_few;
use crate::io::inspection_file::InspectionRecord;

const NOT_STATED: &str = "not stated";

pub(super) fn head(record: &InspectionRecord) -> String {
    let told = |text: &Option<String>| escaped(text.as_deref().unwrap_or(NOT_STATED));
    let facts = [
        ("Part", told(&record.part)),
        ("Serial number", told(&record.serial)),
        ("Operator", told(&record.operator)),
        (
            "Date (UTC)",
            escaped(&record.date.replace('T', " ").replace('Z', "")),
        ),
        ("Program", escaped(&record.program)),
        ("Decision rule", escaped(&rule_name(record))),
    ];
    let facts: String = facts
        .map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>\n"))
        .concat();
    format!("<h1>Inspection report</h1>\n<dl class=\"facts\">\n{facts}</dl>\n")
}

/// The rule in a few words.
pub(super) fn rule_name(record: &InspectionRecord) -> String {
    let percent = crate::inspection::words::percent(record.confidence);
    match &*record.rule {
        "simple" => "simple acceptance, no guard bands".to_owned(),
        _ => format!("ISO 14253-1, guard bands, {percent}\u{a0}%"),
    }
}

pub(super) fn verdict(record: &InspectionRecord) -> String {
    let count = |decision: Decision| record.counts.get(decision.name()).copied().unwrap_or(0);
    let [pass, undecided, fail] = Decision::ALL.map(count);
    let (sign, word) = match &*record.verdict {
        "pass" => ("✓", "PASS"),
        "fail" => ("✗", "FAIL"),
        _ => ("?", "UNDECIDED"),
    };
    let names = |decision: Decision| {
        let of_it = record
            .characteristics
            .iter()
            .filter(|one| one.decision == decision.name());
        let all: Vec<_> = of_it
            .map(|one| format!("{} {}", escaped(&one.number), escaped(&one.name)))
            .collect();
        first_few(&all, "; ")
    };
    let said = |decision: Decision, what: &str| match names(decision) {
        names if names.is_empty() => String::new(),
        names => format!("<p class=\"small\"><strong>{what}:</strong> {names}</p>"),
    };
    let notes: String = record
        .notes
        .iter()
        .map(|note| format!("<p class=\"small\">{}</p>", escaped(note)))
        .collect();
    let without = match record.without_characteristic.len() {
        0 => String::new(),
        _ => {
            let ids = record
                .without_characteristic
                .iter()
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(", ");
            format!("<p class=\"small\">Measured, and not in the drawing: features {ids}.</p>")
        }
    };
    format!(
        "<div class=\"verdict {}\"><b>{sign} {word}</b><div><p>{} characteristics: <strong>{pass} pass, {fail} fail, {undecided} undecided</strong></p>{}{}{without}{notes}</div></div>\n",
        record.verdict,
        record.characteristics.len(),
        said(Decision::Fail, "Out of tolerance"),
        said(Decision::Undecided, "Undecided"),
    )
}

/// Most relations that are listed.
const MOST_RELATIONS: usize = 24;

/// Form and relations of the features in the drawing, also of what has no tolerance.
#[expect(clippy::too_many_lines)]
pub(super) fn form_and_relations(input: &ReportInput<'_>) -> String {
    let (file, k) = (
        &input.source.features,
        input.inspected.record.coverage_factor,
    );
    let balloon = |id: u32| {
        input
            .inspected
            .balloons
            .iter()
            .find(|balloon| balloon.feature == Some(id))
    };
    let with_u = |number: &MeasuredNumber| match number.std {
        Some(std) => format!("{} ± {}", shown(Some(number.value)), shown(Some(std * k))),
        None => shown(Some(number.value)),
    };
    let mut forms = Vec::new();
    for one in &input.inspected.balloons {
        let feature = one.feature.and_then(|id| file.feature(id));
        let Some(form) = feature.and_then(|feature| feature.form.as_ref()) else {
            continue;
        };
        let number = |quantity| {
            form.number(quantity)
                .map_or("–".to_owned(), |number| with_u(&number))
        };
        forms.push(vec![
            format!("{} · {}", one.number, escaped(&one.kind)),
            number(InspectedQuantity::Roundness),
            number(InspectedQuantity::Cylindricity),
            number(InspectedQuantity::Straightness),
            number(InspectedQuantity::Flatness),
            format!("{:.0} %", form.coverage * 100.0),
        ]);
    }
    let name = |id: u32| {
        let kind = file
            .feature(id)
            .map_or(String::new(), |feature| escaped(&feature.kind));
        balloon(id).map_or_else(
            || format!("{kind}, id {id}"),
            |balloon| format!("{} · {kind}", balloon.number),
        )
    };
    let quantities = InspectedQuantity::ALL
        .into_iter()
        .filter(|quantity| quantity.needs_datum());
    let of_balloons = file
        .relations
        .iter()
        .filter(|relation| balloon(relation.of).is_some());
    let all: Vec<_> = of_balloons
        .map(|relation| {
            let numbers = quantities.clone().filter_map(|quantity| {
                let number = relation.number(quantity)?;
                let unit = if quantity.unit() == "deg" {
                    "°"
                } else {
                    " mm"
                };
                Some(format!(
                    "{} {}{unit}",
                    in_words(quantity.name()),
                    with_u(&number)
                ))
            });
            let numbers = numbers.collect::<Vec<_>>().join("; ");
            vec![
                escaped(&relation.kind),
                name(relation.of),
                name(relation.to),
                numbers,
            ]
        })
        .collect();
    if forms.is_empty() && all.is_empty() {
        return String::new();
    }
    let mut html = format!(
        "<h2>Form and relations</h2>\n<p class=\"small\">Values ± U (k = {k}); for information where the drawing has no tolerance. Form is that of what was touched.</p>\n"
    );
    if !forms.is_empty() {
        html += &table(
            "",
            &[
                "Feature",
                "Roundness, mm",
                "Cylindricity, mm",
                "Straightness, mm",
                "Flatness, mm",
                "Touched",
            ],
            &forms,
        );
    }
    if !all.is_empty() {
        html += "<h3>Relations</h3>\n";
        html += &table(
            "rel",
            &["Relation", "Of", "To", "Numbers"],
            &all[..all.len().min(MOST_RELATIONS)],
        );
    }
    if all.len() > MOST_RELATIONS {
        html += &format!(
            "<p class=\"small\">The first {MOST_RELATIONS} of {}; the file of features has all.</p>\n",
            all.len()
        );
    }
    html
}

pub(super) fn calibration(lines: &[CalibrationLine]) -> String {
    let rows: Vec<_> = lines
        .iter()
        .map(|line| {
            vec![
                line.what.to_owned(),
                escaped(&line.value),
                escaped(&line.state),
            ]
        })
        .collect();
    format!(
        "<h2>State of the calibration</h2>\n{}",
        table("cal", &["What", "Value", "State and age"], &rows)
    )
}

pub(super) fn files(record: &InspectionRecord) -> String {
    let row = |file: &crate::io::inspection_file::InspectedFile| {
        vec![
            escaped(&file.role),
            escaped(&file.path),
            file.bytes.to_string(),
            format!("<code>{}</code>", escaped(&file.crc32)),
        ]
    };
    let rows: Vec<_> = record.files.iter().map(row).collect();
    let note = "<p class=\"small\">The checksum tells files apart that were mixed up; it is no seal against who wants to deceive.</p>\n";
    format!(
        "<h2>Files</h2>\n{}{note}",
        table("files", &["What", "File", "Bytes", "CRC-32"], &rows)
    )
}

pub(super) fn limits(record: &InspectionRecord) -> String {
    let frames = match record.alignment {
        Some(_) => {
            "Errors of different features count as independent in the uncertainty of the alignment; what they have in common drops out of positions."
        }
        None => {
            "Where drawing and mesh do not share one frame, positions and coordinates are wrong, and features are not found."
        }
    };
    let limits = [
        "An uncertainty holds when radius of the ball, stiffness, calibration, place of the scan and noise are as told when it was measured. A wrong value there \
         gives wrong measured values with a small uncertainty; <code>touchup doctor</code>, <code>disagree</code> and <code>check</code> find some of them.",
        "The uncertainty is that of the touches. Temperature of the part, deformation by clamping and by the force of the touch beyond the told stiffness are not in it.",
        "A probability of conformity takes nothing for granted but the measurement: what the process usually makes is not counted in.",
        "Form and relations are those of what was touched; of the rest nothing is said.",
        frames,
    ];
    let items: String = limits
        .map(|limit| format!("<li>{}</li>\n", limit.replace("  ", " ")))
        .concat();
    format!("<h2>Limits</h2>\n<ul class=\"small\">\n{items}</ul>\n")
}
