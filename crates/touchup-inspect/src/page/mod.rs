//! The report: one HTML file without scripts or external resources, printable on A4.

mod alignment;
mod decisions;
mod input;
mod picture;
mod plots;
mod rule;
mod sections;
mod style;
mod tolerance_bar;
mod touches;

pub(super) use self::input::ReportInput;
use maud::html;
use touchup_document::{css_string, document};

use crate::InspectionError;

/// The whole page.
pub(super) fn page(input: &ReportInput<'_>) -> Result<String, InspectionError> {
    let record = &input.inspected.record;
    let part = record.part.as_deref();
    let title = part.map_or("Inspection report".to_owned(), |part| {
        format!("Inspection report: {part}")
    });
    let foot = [part, record.serial.as_deref(), Some(&*record.date)];
    let foot = foot.into_iter().flatten().collect::<Vec<_>>().join(" · ");
    let style = style::CSS;
    let style = format!(
        "{style}@page {{ @bottom-left {{ content: {} }} }}\n",
        css_string(&foot)
    );
    let body = html! {
        main {
            (sections::head(record))
            (sections::verdict(record))
            (picture::picture(input)?)
            (decisions::table(input.inspected))
            (alignment::alignment(record))
            (sections::form_and_relations(input))
            (touches::touches(input))
            (sections::calibration(input.calibration))
            (rule::rule(record))
            (sections::files(record))
            (sections::limits(record))
        }
    };
    Ok(document(&title, &style, &body))
}
