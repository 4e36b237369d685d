//! Changes of the evidence between two renewals.

use nalgebra::Point3;

/// Changes of the evidence: points of the contacts with a new or moved mean, and changed centres of
/// the tip, m, in O.
#[derive(Clone, Debug, Default)]
pub(in crate::reconstruct) struct GridChanges {
    pub means: Vec<Point3<f64>>,
    pub centres: Vec<Point3<f64>>,
}

impl GridChanges {
    pub(crate) fn is_empty(&self) -> bool {
        self.means.is_empty() && self.centres.is_empty()
    }

    pub(crate) fn extend(&mut self, more: &Self) {
        self.means.extend_from_slice(&more.means);
        self.centres.extend_from_slice(&more.centres);
    }
}
