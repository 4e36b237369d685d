//! How drawing and part were brought into one frame.

use super::decisions::shown;
use crate::html::{escaped, table};
use crate::io::inspection_file::{AlignmentRecord, InspectionRecord};

/// The section; without an alignment what that means for positions.
pub(super) fn alignment(record: &InspectionRecord) -> String {
    let Some(found) = &record.alignment else {
        return "<h2>Alignment</h2>\n<p class=\"small\">None: positions and coordinates are about the frame of the mesh, in which the drawing is \
                taken to be.</p>\n"
            .to_owned();
    };
    let k = record.coverage_factor;
    let AlignmentRecord {
        translation_mm,
        rotation_vector_deg,
        translation_std_mm,
        rotation_std_deg,
        ..
    } = found;
    let rows = ["x", "y", "z"].iter().enumerate().map(|(i, axis)| {
        let degrees = |number: f64| format!("{number:.4}").replace('-', "−");
        vec![
            (*axis).to_owned(),
            shown(Some(translation_mm[i])),
            shown(Some(translation_std_mm[i] * k)),
            degrees(rotation_vector_deg[i]),
            degrees(rotation_std_deg[i] * k),
        ]
    });
    let [x, y, z] = found.center_mm.map(|mm| shown(Some(mm)));
    let features = found.features.iter().map(|one| {
        vec![
            escaped(&one.name),
            escaped(&one.kind),
            one.feature.to_string(),
            shown(Some(one.residual_mm)),
        ]
    });
    let how = match &*found.method {
        "datums" => {
            "By datums in the order of the table: each fixes what those before it leave open."
        }
        _ => {
            "By a best fit: least squares over these features, weighted by their standard uncertainties."
        }
    };
    format!(
        "<h2>Alignment</h2>\n<p class=\"small\">{how} Positions and coordinates are about the frame of the drawing; the uncertainty of the alignment is in \
         their U. The motion takes the frame of the mesh into that of the drawing: a turn by the rotation vector about the origin, then the shift. The \
         U (k = {k}) of the shift is that at the middle of the features, ({x}, {y}, {z}) mm. Residual of places {} mm root mean square, {} mm at \
         most.</p>\n{}{}",
        shown(Some(found.residual_rms_mm)),
        shown(Some(found.residual_max_mm)),
        table(
            "motion",
            &["Axis", "Shift, mm", "U, mm", "Rotation vector, °", "U, °"],
            &rows.collect::<Vec<_>>()
        ),
        table(
            "aligned",
            &["Feature", "Kind", "Id", "Off its nominal place, mm"],
            &features.collect::<Vec<_>>()
        ),
    )
}
