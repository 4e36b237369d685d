//! The motion between the frames of drawing and part.

use maud::{Markup, html};
use touchup_document::number::fixed;
use touchup_document::table;

use super::decisions::shown;
use touchup_io::inspection_file::InspectionRecord;

/// The section; without an alignment the meaning of positions.
pub(super) fn alignment(record: &InspectionRecord) -> Markup {
    let Some(found) = &record.alignment else {
        return html! {
            h2 { "Alignment" }
            p.small {
                "None: positions and coordinates are about the frame of the mesh, in which the drawing is taken to be."
            }
        };
    };
    let k = record.coverage_factor;
    let mm = |mm: f64| shown(Some(mm));
    let rows = ["x", "y", "z"].into_iter().enumerate().map(|(i, axis)| {
        let (shift, turn) = (found.translation_mm[i], found.rotation_vector_deg[i]);
        let (shift_u, turn_u) = (
            found.translation_std_mm[i] * k,
            found.rotation_std_deg[i] * k,
        );
        html! {
            td { (axis) } td { (mm(shift)) } td { (mm(shift_u)) }
            td { (fixed(turn, 4)) } td { (fixed(turn_u, 4)) }
        }
    });
    let features = found.features.iter().map(|one| {
        html! { td { (one.name) } td { (one.kind) } td { (one.feature) } td { (mm(one.residual_mm)) } }
    });
    let [x, y, z] = found.center_mm.map(mm);
    let how = match &*found.method {
        "datums" => {
            "By datums in the order of the table: each fixes what those before it leave open."
        }
        _ => {
            "By a best fit: least squares over these features, weighted by their standard uncertainties."
        }
    };
    html! {
        h2 { "Alignment" }
        p.small {
            (how) " Positions and coordinates are about the frame of the drawing; the uncertainty of the alignment \
            is in their U. The motion takes the frame of the mesh into that of the drawing: a turn by the rotation \
            vector about the origin, then the shift. The U (k = " (k) ") of the shift is that at the middle of the \
            features, (" (x) ", " (y) ", " (z) ") mm. Residual of places " (mm(found.residual_rms_mm))
            " mm root mean square, " (mm(found.residual_max_mm)) " mm at most."
        }
        (table("motion", ["Axis", "Shift, mm", "U, mm", "Rotation vector, °", "U, °"], rows))
        (table("aligned", ["Feature", "Kind", "Id", "Off its nominal place, mm"], features))
    }
}
