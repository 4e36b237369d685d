//! `touchup inspect`: measured features against a drawing, and a report that says pass, fail or undecided.

mod arguments;
mod calibration;
mod drawing;
mod evidence;
mod measured;
mod page;
mod rows;
mod source;
mod summary;

pub(super) use self::arguments::InspectArguments;
use self::calibration::calibration_of;
use self::drawing::PartDrawing;
use self::page::{ReportInput, page, write_page};
use self::rows::{Inspected, inspected};
use self::source::InspectionSource;
use super::pictures::view_from;
use super::progress::WorkProgress;
use super::{CliError, Losses, not_written, print_report};
use crate::conformity::DecisionParams;
use crate::io::inspection_file::write_inspection_table;
use crate::io::qif_file::write_qif;

/// The command: inspects, and prints the result.
pub(super) fn inspect(arguments: &InspectArguments) -> Result<Losses, CliError> {
    arguments.check()?;
    let source = arguments.source()?;
    if let Some(path) = &arguments.write_nominal {
        return drawing::write_template(
            path,
            arguments.nominal.as_deref(),
            &source.features,
            &arguments.drawing_flags(),
        );
    }
    let drawing = {
        let _reading = WorkProgress::stage("read the drawing");
        let nominal = arguments.nominal.as_deref().ok_or_else(|| CliError::usage("--nominal is missing"))?;
        PartDrawing::read(nominal, &arguments.drawing_flags())?
    };
    let params = DecisionParams { rule: arguments.rule, confidence: arguments.confidence };
    let inspected = inspected(arguments, &source, &drawing, &params)?;
    write(arguments, &source, &inspected)?;
    print_report(arguments.json, &inspected.record, || summary::in_words(&inspected.record))?;
    Ok(summary::losses(&inspected.record))
}

/// Writes the files that were asked for.
fn write(arguments: &InspectArguments, source: &InspectionSource, inspected: &Inspected) -> Result<(), CliError> {
    let record = &inspected.record;
    if let Some(path) = &arguments.csv {
        write_inspection_table(path, &record.characteristics).map_err(CliError::not_written)?;
    }
    if let Some(path) = &arguments.qif {
        write_qif(path, record).map_err(CliError::not_written)?;
    }
    let Some(path) = &arguments.out else { return Ok(()) };
    let _writing = WorkProgress::stage("write the report");
    let calibration = calibration_of(source)?;
    let view = view_from(arguments.view.as_ref())?;
    let input = ReportInput { inspected, source, calibration: &calibration, mesh_unit: arguments.mesh_unit, view };
    let page = page(&input)?;
    write_page(path, &page).map_err(not_written(path))
}
