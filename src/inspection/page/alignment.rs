//! The motion between the frames of drawing and part.

use maud::{Markup, html};
use touchup_page::number::fixed;
use touchup_page::table;

use super::decisions::shown;
use crate::io::inspection_file::{AlignmentRecord, InspectionRecord};

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
    let AlignmentRecord {
        translation_mm: shift,
        rotation_vector_deg: turn,
        ..
    } = found;
    let rows = ["x", "y", "z"].into_iter().enumerate().map(|(i, axis)| {
        [
            axis.to_owned(),
            shown(Some(shift[i])),
            shown(Some(found.translation_std_mm[i] * k)),
            fixed(turn[i], 4),
            fixed(found.rotation_std_deg[i] * k, 4),
        ]
    });
    let features = found.features.iter().map(|one| {
        let (id, residual) = (one.feature.to_string(), shown(Some(one.residual_mm)));
        [one.name.clone(), one.kind.clone(), id, residual]
    });
    let [x, y, z] = found.center_mm.map(|mm| shown(Some(mm)));
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
            features, (" (x) ", " (y) ", " (z) ") mm. Residual of places " (shown(Some(found.residual_rms_mm)))
            " mm root mean square, " (shown(Some(found.residual_max_mm))) " mm at most."
        }
        (table("motion", ["Axis", "Shift, mm", "U, mm", "Rotation vector, °", "U, °"], rows))
        (table("aligned", ["Feature", "Kind", "Id", "Off its nominal place, mm"], features))
    }
}
