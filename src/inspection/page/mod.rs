//! The report: one file of HTML without scripts, which asks for nothing outside of it and prints on
//! A4.

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
use crate::html::{css_string, escaped};
use crate::inspection::InspectionError;

/// The whole page.
pub(super) fn page(input: &ReportInput<'_>) -> Result<String, InspectionError> {
    let record = &input.inspected.record;
    let title = format!(
        "Inspection report{}",
        record
            .part
            .as_ref()
            .map_or(String::new(), |part| format!(": {part}"))
    );
    let foot = [
        record.part.as_deref(),
        record.serial.as_deref(),
        Some(&*record.date),
    ];
    let foot = foot.into_iter().flatten().collect::<Vec<_>>().join(" · ");
    let mut body = String::new();
    body += &sections::head(record);
    body += &sections::verdict(record);
    body += &picture::picture(input)?;
    body += &decisions::table(input.inspected);
    body += &alignment::alignment(record);
    body += &sections::form_and_relations(input);
    body += &touches::touches(input);
    body += &sections::calibration(input.calibration);
    body += &rule::rule(record);
    body += &sections::files(record);
    body += &sections::limits(record);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{}</title>\n<style>\n{}\n@page {{ @bottom-left {{ content: {} }} }}\n</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escaped(&title),
        style::CSS,
        css_string(&foot),
    ))
}
