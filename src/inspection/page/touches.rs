//! The touches behind each number.

use super::decisions::in_words;
use super::input::ReportInput;
use super::plots::{force_plot, residual_plot};
use crate::html::{escaped, table};
use crate::inspection::evidence::{TouchEvidence, probed_behind, touch_evidence, widest_gap_deg};
use crate::inspection::rows::Balloon;
use crate::io::features_file::FeatureRecord;
use touchup_core::numeric::counted;

/// The section; nothing without touches.
pub(super) fn touches(input: &ReportInput<'_>) -> String {
    if input.source.touches.is_empty() {
        let why = "<p>No file of touches was given (--touches): what is behind the numbers is not shown.</p>\n";
        return format!("<h2>Touches behind the numbers</h2>\n{why}");
    }
    let balloons = input.inspected.balloons.iter();
    let parts: String = balloons
        .clone()
        .map(|balloon| feature(input, balloon))
        .collect();
    let missing = balloons.filter(|balloon| balloon.feature.is_none());
    let missing: Vec<_> = missing
        .map(|balloon| format!("{} · {}", balloon.number, escaped(&balloon.kind)))
        .collect();
    let missing = match missing.len() {
        0 => String::new(),
        _ => format!(
            "<p class=\"small\">Not found, so without touches: {}.</p>\n",
            missing.join(", ")
        ),
    };
    let note = "<p class=\"small\">Blue band: ± 2 standard deviations of a single touch as the measurement states them. Of many touches evenly chosen ones are drawn; the numbers are of all.</p>\n";
    format!("<h2>Touches behind the numbers</h2>\n{note}{missing}{parts}")
}

#[expect(clippy::too_many_lines)]
fn feature(input: &ReportInput<'_>, balloon: &Balloon) -> String {
    let features = &input.source.features;
    let Some(found) = balloon.feature.and_then(|id| features.feature(id)) else {
        return String::new();
    };
    let mut rows = Vec::new();
    let mut figures = String::new();
    let mut drawn: Vec<(&[[u32; 2]], bool)> = Vec::new();
    for &at in &balloon.characteristics {
        let (one, runs) = (
            &input.inspected.record.characteristics[at],
            &input.inspected.runs[at],
        );
        let quantity = input.inspected.quantities[at];
        let evidence = if quantity.needs_datum() {
            None
        } else {
            touch_evidence(quantity, found, runs, &input.source.touches)
        };
        let micrometres = |mm: f64| format!("{:.1}", mm * 1e3);
        let of = |number: fn(&TouchEvidence) -> f64| {
            evidence
                .as_ref()
                .map_or("–".to_owned(), |found| micrometres(number(found)))
        };
        rows.push(vec![
            escaped(&one.number),
            format!(
                "{} <span class=\"small\">{}</span>",
                escaped(&one.name),
                in_words(&one.quantity)
            ),
            one.touches.to_string(),
            of(|found| found.rms_mm),
            of(|found| found.largest_mm),
            of(|found| found.stated_mm),
        ]);
        let is_depth = one.quantity == "depth_mm";
        if let Some(evidence) = evidence.filter(|_| !drawn.contains(&(runs, is_depth))) {
            drawn.push((runs, is_depth));
            figures += &residual_figure(&evidence, &one.number);
        }
        let probed = probed_behind(&input.source.probed, runs, &input.source.touches);
        if let Some(plot) = force_plot(&probed)
            .filter(|_| drawn.iter().filter(|(other, _)| *other == &**runs).count() <= 1)
        {
            let rejected = probed.iter().filter(|touch| !touch.accepted).count();
            let count = counted(probed.len(), "touch", "touches");
            figures += &format!(
                "<figure>{plot}<figcaption>{}: force of {count} of the arm, {rejected} of them rejected</figcaption></figure>\n",
                escaped(&one.number)
            );
        }
    }
    let head = [
        "No.",
        "Characteristic",
        "Touches",
        "rms, µm",
        "largest, µm",
        "stated, µm",
    ];
    format!(
        "<section class=\"feature\"><h3>{} · {} <span class=\"small\">id {}, {}</span></h3>\n{}<div class=\"plots\">{figures}</div></section>\n",
        balloon.number,
        escaped(&balloon.kind),
        found.id,
        fitted(found),
        table("", &head, &rows)
    )
}

fn fitted(feature: &FeatureRecord) -> String {
    match &*feature.fitted_to {
        "touches" => format!("{:.0} % of its surface touched", feature.touched * 100.0),
        _ => "fitted to the mesh: no touches behind it".to_owned(),
    }
}

fn residual_figure(evidence: &TouchEvidence, number: &str) -> String {
    let gap = if evidence.along.contains('°') {
        format!(
            "; widest gap {:.0}° of the turn",
            widest_gap_deg(&evidence.drawn)
        )
    } else {
        String::new()
    };
    let count = counted(evidence.count, "touch", "touches");
    let caption = format!("{}: {count} off {}{gap}", escaped(number), evidence.ideal);
    format!(
        "<figure>{}<figcaption>{caption}</figcaption></figure>\n",
        residual_plot(evidence)
    )
}
