//! The touches behind each number.

use maud::{Markup, html};
use touchup_document::table;
use touchup_geometry::numeric::counted;

use super::decisions::in_words;
use super::input::ReportInput;
use super::plots::{force_plot, residual_plot};
use crate::evidence::{TouchEvidence, probed_behind, touch_evidence, widest_gap_deg};
use crate::rows::Balloon;
use touchup_io::features_file::FeatureRecord;
use touchup_io::inspection_file::CharacteristicRecord;

/// The section; without touches a note.
pub(super) fn touches(input: &ReportInput<'_>) -> Markup {
    let balloons = || input.inspected.balloons.iter();
    let missing = balloons().filter(|balloon| balloon.feature.is_none());
    let missing = missing.map(|balloon| format!("{} · {}", balloon.number, balloon.kind));
    let missing: Vec<_> = missing.collect();
    html! {
        h2 { "Touches behind the numbers" }
        @if input.source.touches.is_empty() {
            p { "No file of touches was given (--touches): what is behind the numbers is not shown." }
        } @else {
            p.small {
                "Blue band: ± 2 standard deviations of a single touch as the measurement states them. Of many touches \
                evenly chosen ones are drawn; the numbers are of all."
            }
            @if !missing.is_empty() {
                p.small { "Not found, so without touches: " (missing.join(", ")) "." }
            }
            @for balloon in balloons() { (feature(input, balloon)) }
        }
    }
}

fn feature(input: &ReportInput<'_>, balloon: &Balloon) -> Markup {
    let features = &input.source.features;
    let Some(found) = balloon.feature.and_then(|id| features.feature(id)) else {
        return Markup::default();
    };
    let (mut rows, mut figures) = (Vec::new(), Vec::new());
    let mut drawn: Vec<(&[[u32; 2]], bool)> = Vec::new();
    for &at in &balloon.characteristics {
        let (one, runs) = (
            &input.inspected.record.characteristics[at],
            &input.inspected.runs[at],
        );
        let quantity = input.inspected.quantities[at];
        let evidence = (!quantity.needs_datum())
            .then(|| touch_evidence(quantity, found, runs, &input.source.touches))
            .flatten();
        rows.push(row(one, evidence.as_ref()));
        let is_depth = one.quantity == "depth_mm";
        if let Some(evidence) = evidence.filter(|_| !drawn.contains(&(runs, is_depth))) {
            drawn.push((runs, is_depth));
            figures.push(residual_figure(&evidence, &one.number));
        }
        let probed = probed_behind(&input.source.probed, runs, &input.source.touches);
        if let Some(plot) = force_plot(&probed)
            .filter(|_| drawn.iter().filter(|(other, _)| *other == &**runs).count() <= 1)
        {
            let rejected = probed.iter().filter(|touch| !touch.accepted).count();
            let count = counted(probed.len(), "touch", "touches");
            figures.push(html! {
                (plot)
                figcaption { (one.number) ": force of " (count) " of the arm, " (rejected) " of them rejected" }
            });
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
    html! {
        section.feature {
            h3 {
                (balloon.number) " · " (balloon.kind) " "
                span.small { "id " (found.id) ", " (fitted(found)) }
            }
            (table("", head, rows))
            div.plots { @for figure in figures { figure { (figure) } } }
        }
    }
}

fn row(one: &CharacteristicRecord, evidence: Option<&TouchEvidence>) -> Markup {
    let micrometres = |number: fn(&TouchEvidence) -> f64| {
        let number = evidence.map(|found| format!("{:.1}", number(found) * 1e3));
        number.unwrap_or("–".to_owned())
    };
    html! {
        td { (one.number) }
        td { (one.name) " " span.small { (in_words(&one.quantity)) } }
        td { (one.touches) }
        td { (micrometres(|found| found.rms_mm)) }
        td { (micrometres(|found| found.largest_mm)) }
        td { (micrometres(|found| found.stated_mm)) }
    }
}

fn fitted(feature: &FeatureRecord) -> String {
    match &*feature.fitted_to {
        "touches" => format!("{:.0} % of its surface touched", feature.touched * 100.0),
        _ => "fitted to the mesh: no touches behind it".to_owned(),
    }
}

fn residual_figure(evidence: &TouchEvidence, number: &str) -> Markup {
    let gap = evidence
        .along
        .contains('°')
        .then(|| widest_gap_deg(&evidence.drawn));
    html! {
        (residual_plot(evidence))
        figcaption {
            (number) ": " (counted(evidence.count, "touch", "touches")) " off " (evidence.ideal)
            @if let Some(gap) = gap { "; widest gap " (format!("{gap:.0}")) "° of the turn" }
        }
    }
}
