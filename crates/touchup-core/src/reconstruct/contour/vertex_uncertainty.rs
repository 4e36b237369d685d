//! Uncertainty of the vertices of a patched mesh.

use nalgebra::Point3;

use crate::reconstruct::contour::patched::Support;
use crate::reconstruct::evidence::point_evidence::Evidence;
use crate::reconstruct::field::piecewise::FieldScratch;

/// A vertex is off where it is not on the fit: edges and corners are put together of several pieces.
const OFF_FIT: f64 = 1.4;
/// A guess one radius from the nearest contact is off by this share of the radius; it grows with the square of the distance.
const GUESS: f64 = 0.18;

/// Standard deviation of a vertex along the normal, m.
///
/// - `scan`: that of a vertex of the scan, m.
pub(in crate::reconstruct) fn vertex_sigma(
    evidence: &Evidence<'_>,
    p: &Point3<f64>,
    support: Support,
    scan: f64,
    window_ns: i64,
    scratch: &mut FieldScratch,
) -> f64 {
    if support == Support::Scan {
        return scan;
    }
    let (field, radius) = (&evidence.params.field, evidence.params.radius);
    let Some(found) = field.at(evidence.contacts, p, scratch) else {
        return scan.hypot(guess(field.reach, radius));
    };
    let fit = field.sigma_of(&found, evidence.contacts, p, window_ns, scratch).total();
    match support {
        Support::Guessed => fit.hypot(guess(found.nearest, radius)),
        _ => fit.hypot(OFF_FIT * found.value),
    }
}

fn guess(distance: f64, radius: f64) -> f64 {
    GUESS * distance * distance / radius
}
