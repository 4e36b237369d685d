//! Sizes by which a mesh is read.

use crate::features::measure::Measure;
use crate::features::surfaces::BESIDE_CONTACTS;

/// Width of the strip of a scan beside an edge that belongs to no surface, in median edges.
const STRIP: f64 = 12.0;
/// The same, in diagonals: no coarse scan loses a whole face.
const STRIP_OF_ALL: f64 = 0.03;
/// Length of steps along the borders of a scan, in median edges.
const STEP: f64 = 3.0;
/// Area of a region that is no more than noise, in squared median edges.
const LEAST_AREA: f64 = 16.0;
/// Length of chains that are no more than noise, in strips.
const SHORT: f64 = 0.5;
/// Maximum distance of a chain of a drawing from its curve, in diagonals: its chords.
const CHORDS: f64 = 0.005;

/// Lengths that count beside the blur and noise of a mesh; 0 for a drawing, but for the reach.
pub(super) struct BoundaryScale {
    /// maximum distance of the scan from a touched surface that goes on over it, m
    pub near_touched: f64,
    /// of strips, m
    pub width: f64,
    /// of a region, m²
    pub least_area: f64,
    /// of chains that may be no more than noise, m
    pub short: f64,
    /// between points along a border, m
    pub step: f64,
    /// maximum distance of a chain from its curve, m
    pub reach: f64,
}

impl BoundaryScale {
    pub(super) fn of(measure: &Measure) -> Self {
        let parted = measure.observed.parted;
        let (edge, diagonal) = (parted.edge, parted.diagonal);
        if parted.rounding.is_some() {
            return Self {
                near_touched: 0.0,
                width: 0.0,
                least_area: 0.0,
                short: 0.0,
                step: 0.0,
                reach: CHORDS * diagonal,
            };
        }
        let width = (STRIP * edge).min(STRIP_OF_ALL * diagonal);
        Self {
            near_touched: BESIDE_CONTACTS * measure.observed.reach(),
            width,
            least_area: LEAST_AREA * edge * edge,
            short: SHORT * width,
            step: STEP * edge,
            reach: width / 2.0,
        }
    }
}
