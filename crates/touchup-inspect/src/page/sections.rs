//! Head, verdict, form and relations, calibration, files, limits.

use maud::{Markup, html};
use touchup_document::table;

use super::decisions::{in_words, shown};
use super::input::ReportInput;
use crate::calibration::CalibrationLine;
use crate::rows::Balloon;
use crate::words::{first_few, percent};
use touchup_features::conformity::{Decision, MeasuredNumber};
use touchup_features::features::InspectedQuantity;
use touchup_io::features_file::RelationRecord;
use touchup_io::inspection_file::InspectionRecord;

pub(super) fn head(record: &InspectionRecord) -> Markup {
    let stated = |text: &Option<String>| text.clone().unwrap_or("not stated".to_owned());
    let facts = [
        ("Part", stated(&record.part)),
        ("Serial number", stated(&record.serial)),
        ("Operator", stated(&record.operator)),
        ("Date (UTC)", record.date.replace('T', " ").replace('Z', "")),
        ("Program", record.program.clone()),
        ("Decision rule", rule_name(record)),
    ];
    html! {
        h1 { "Inspection report" }
        dl.facts { @for (name, value) in facts { div { dt { (name) } dd { (value) } } } }
    }
}

/// Short name of the rule.
pub(super) fn rule_name(record: &InspectionRecord) -> String {
    match &*record.rule {
        "simple" => "simple acceptance, no guard bands".to_owned(),
        _ => format!(
            "ISO 14253-1, guard bands, {}\u{a0}%",
            percent(record.confidence)
        ),
    }
}

pub(super) fn verdict(record: &InspectionRecord) -> Markup {
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
        let names = of_it.map(|one| format!("{} {}", one.number, one.name));
        first_few(&names.collect::<Vec<_>>(), "; ")
    };
    let named = [
        ("Out of tolerance", Decision::Fail),
        ("Undecided", Decision::Undecided),
    ];
    let named = named.map(|(what, decision)| (what, names(decision)));
    let rest: Vec<_> = record
        .without_characteristic
        .iter()
        .map(u32::to_string)
        .collect();
    html! {
        div class={ "verdict " (record.verdict) } {
            b { (sign) " " (word) }
            div {
                p {
                    (record.characteristics.len()) " characteristics: "
                    strong { (pass) " pass, " (fail) " fail, " (undecided) " undecided" }
                }
                @for (what, names) in named.iter().filter(|(_, names)| !names.is_empty()) {
                    p.small { strong { (what) ":" } " " (names) }
                }
                @if !rest.is_empty() {
                    p.small { "Measured, and not in the drawing: features " (rest.join(", ")) "." }
                }
                @for note in &record.notes { p.small { (note) } }
            }
        }
    }
}

/// Most relations in the list.
const MOST_RELATIONS: usize = 24;

/// Form and relations of the drawing's features, with or without a tolerance.
pub(super) fn form_and_relations(input: &ReportInput<'_>) -> Markup {
    let k = input.inspected.record.coverage_factor;
    let (forms, relations) = (forms(input, k), relations(input, k));
    if forms.is_empty() && relations.is_empty() {
        return Markup::default();
    }
    let of_form = [
        "Feature",
        "Roundness, mm",
        "Cylindricity, mm",
        "Straightness, mm",
        "Flatness, mm",
        "Touched",
    ];
    html! {
        h2 { "Form and relations" }
        p.small {
            "Values ± U (k = " (k) "); for information where the drawing has no tolerance. Form is that of what was \
            touched."
        }
        @if !forms.is_empty() { (table("", of_form, forms)) }
        @if !relations.is_empty() {
            h3 { "Relations" }
            (table("rel", ["Relation", "Of", "To", "Numbers"], relations.iter().take(MOST_RELATIONS).cloned()))
        }
        @if relations.len() > MOST_RELATIONS {
            p.small {
                "The first " (MOST_RELATIONS) " of " (relations.len()) "; the file of features has all."
            }
        }
    }
}

fn with_u(number: &MeasuredNumber, k: f64) -> String {
    let [value, u] = [Some(number.value), number.std.map(|std| std * k)].map(shown);
    if number.std.is_some() {
        format!("{value} ± {u}")
    } else {
        value
    }
}

fn forms(input: &ReportInput<'_>, k: f64) -> Vec<Markup> {
    let file = &input.source.features;
    let row = |balloon: &Balloon| {
        let form = file.feature(balloon.feature?)?.form.as_ref()?;
        let number = |quantity| {
            let number = form.number(quantity);
            number.map_or("–".to_owned(), |number| with_u(&number, k))
        };
        Some(html! {
            td { (balloon.number) " · " (balloon.kind) }
            td { (number(InspectedQuantity::Roundness)) }
            td { (number(InspectedQuantity::Cylindricity)) }
            td { (number(InspectedQuantity::Straightness)) }
            td { (number(InspectedQuantity::Flatness)) }
            td { (format!("{:.0} %", form.coverage * 100.0)) }
        })
    };
    input.inspected.balloons.iter().filter_map(row).collect()
}

fn relations(input: &ReportInput<'_>, k: f64) -> Vec<Markup> {
    let file = &input.source.features;
    let balloon = |id: u32| {
        let mut balloons = input.inspected.balloons.iter();
        balloons.find(|balloon| balloon.feature == Some(id))
    };
    let name = |id: u32| {
        let kind = file.feature(id).map_or("", |feature| &feature.kind);
        match balloon(id) {
            Some(balloon) => format!("{} · {kind}", balloon.number),
            None => format!("{kind}, id {id}"),
        }
    };
    let row = |relation: &RelationRecord| {
        let known = relation.numbers.keys().filter(|known| known.needs_datum());
        let numbers = known.filter_map(|&quantity| {
            let number = relation.number(quantity)?;
            let unit = if quantity.unit() == "deg" {
                "°"
            } else {
                " mm"
            };
            let (name, number) = (in_words(quantity.name()), with_u(&number, k));
            Some(format!("{name} {number}{unit}"))
        });
        let numbers = numbers.collect::<Vec<_>>().join("; ");
        html! {
            td { (relation.kind) } td { (name(relation.of)) } td { (name(relation.to)) } td { (numbers) }
        }
    };
    let mut relations = file.relations.iter().collect::<Vec<_>>();
    relations.retain(|relation| balloon(relation.of).is_some());
    relations.into_iter().map(row).collect()
}

pub(super) fn calibration(lines: &[CalibrationLine]) -> Markup {
    let row = |line: &CalibrationLine| html! { td { (line.what) } td { (line.value) } td { (line.state) } };
    html! {
        h2 { "State of the calibration" }
        (table("cal", ["What", "Value", "State and age"], lines.iter().map(row)))
    }
}

pub(super) fn files(record: &InspectionRecord) -> Markup {
    let rows = record.files.iter().map(|file| {
        html! { td { (file.role) } td { (file.path) } td { (file.bytes) } td { code { (file.crc32) } } }
    });
    html! {
        h2 { "Files" }
        (table("files", ["What", "File", "Bytes", "CRC-32"], rows))
        p.small {
            "The checksum tells files apart that were mixed up; it is no seal against who wants to deceive."
        }
    }
}

pub(super) fn limits(record: &InspectionRecord) -> Markup {
    html! {
        h2 { "Limits" }
        ul.small {
            li {
                "An uncertainty holds when radius of the ball, stiffness, calibration, place of the scan and noise are as \
                told when it was measured. A wrong value there gives wrong measured values with a small uncertainty; "
                code { "touchup doctor" } ", " code { "disagree" } " and " code { "check" } " find some of them."
            }
            li {
                "The uncertainty is that of the touches. Temperature of the part, deformation by clamping and by the \
                force of the touch beyond the told stiffness are not in it."
            }
            li {
                "A probability of conformity takes nothing for granted but the measurement: what the process usually \
                makes is not counted in."
            }
            li { "Form and relations are those of what was touched; of the rest nothing is said." }
            li {
                @if record.alignment.is_some() {
                    "Errors of different features count as independent in the uncertainty of the alignment; what they \
                    have in common drops out of positions."
                } @else {
                    "Where drawing and mesh do not share one frame, positions and coordinates are wrong, and features are \
                    not found."
                }
            }
        }
    }
}
