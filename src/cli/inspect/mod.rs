//! `touchup inspect`: measured features against a drawing, and a report with pass, fail or
//! undecided.

mod arguments;
mod errors;
mod summary;
mod template;

pub(super) use self::arguments::InspectArguments;
use super::common::progress::WorkProgress;
use super::{CliError, Losses, print_report};
use touchup_inspect::{Inspection, InspectionSource, PartDrawing, PartPicture, inspected};

/// Runs `touchup inspect`: inspects, and prints the result.
pub(super) fn inspect(arguments: &InspectArguments) -> Result<Losses, CliError> {
    arguments.check()?;
    let (source, params) = (arguments.source()?, arguments.params());
    if let Some(path) = &arguments.write_nominal {
        return template::write(
            path,
            arguments.nominal.as_deref(),
            &source.features,
            &params.drawing,
        );
    }
    let drawing = {
        let _reading = WorkProgress::stage("read the drawing");
        let nominal = arguments
            .nominal
            .as_deref()
            .ok_or_else(|| CliError::usage("--nominal is missing"))?;
        PartDrawing::read(nominal, &params.drawing)?
    };
    let inspected = inspected(&source, &drawing, &params)?;
    write(arguments, &source, &inspected)?;
    print_report(arguments.json, &inspected.record, || {
        summary::in_words(&inspected.record)
    })?;
    Ok(summary::losses(&inspected.record))
}

/// Writes the requested files.
fn write(
    arguments: &InspectArguments,
    source: &InspectionSource,
    inspected: &Inspection,
) -> Result<(), CliError> {
    let _writing = WorkProgress::stage("write the report");
    let picture = PartPicture {
        mesh_unit: arguments.mesh_unit,
        view: arguments.view.direction()?,
    };
    Ok(arguments.files.write(source, inspected, &picture)?)
}
