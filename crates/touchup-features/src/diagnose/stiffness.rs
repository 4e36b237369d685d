//! Sink of the reported centre with the force.
//!
//! All presses on one place share the scan's error, whatever their force: the sink is the slope of
//! the centre's distance from the scan over |F| among the presses of one place, by least squares
//! over all places, with the jackknife's uncertainty over them.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector2};

use super::finding::{InputCause, InputFinding};
use touchup_geometry::numeric::{VoxelKey, jackknife_variance, voxel_of};

/// Minimum number of places for a finding.
const FEWEST_PLACES: usize = 8;
/// Minimum difference of a doubtful compliance, as a share of the larger one.
const OTHER_COMPLIANCE: f64 = 0.4;
/// Minimum difference of the sink for a doubt, m.
const LEAST_SUNK: f64 = 0.15e-3;
/// Maximum depth of an estimate below zero, in its standard uncertainties.
const CLEAR_SIGMAS: f64 = 2.0;
/// Minimum variation of the force within places, as a share of the largest force.
const LEAST_VARIATION: f64 = 0.01;
/// Minimum difference in standard uncertainties, for a doubt and for a sure finding.
const DOUBTED_SIGMAS: f64 = 4.0;
const SURE_SIGMAS: f64 = 6.0;

/// A press on the scan.
pub(super) struct SunkPress {
    pub centre: Point3<f64>,
    /// m
    pub distance: f64,
    /// N
    pub force: f64,
}

/// Sums about the means of one place: of squares of the force, and of products with the distance.
type PlaceSums = [f64; 2];

fn sums_of(presses: &[Vector2<f64>]) -> PlaceSums {
    let middle = presses.iter().sum::<Vector2<f64>>() / presses.len() as f64;
    presses.iter().fold([0.0; 2], |[square, product], press| {
        let off = press - middle;
        [square + off.x * off.x, product + off.x * off.y]
    })
}

/// Compliance and its standard uncertainty, m/N, by places of width `place`, m; `None` for too few
/// places, too little variation of the force, or a clearly negative compliance.
fn compliance(presses: &[SunkPress], place: f64, largest: f64) -> Option<[f64; 2]> {
    let mut places: BTreeMap<VoxelKey, Vec<Vector2<f64>>> = BTreeMap::new();
    for press in presses {
        places
            .entry(voxel_of(&press.centre, place))
            .or_default()
            .push(Vector2::new(press.force, press.distance));
    }
    let sums: Vec<PlaceSums> = places
        .values()
        .map(|presses| sums_of(presses))
        .filter(|[square, _]| *square > 0.0)
        .collect();
    if sums.len() < FEWEST_PLACES {
        return None;
    }
    let [square, product] = sums
        .iter()
        .fold([0.0; 2], |all, one| [all[0] + one[0], all[1] + one[1]]);
    if square.sqrt() < LEAST_VARIATION * largest * (presses.len() as f64).sqrt() {
        return None;
    }
    let without: Vec<f64> = sums
        .iter()
        .map(|one| -(product - one[1]) / (square - one[0]).max(f64::MIN_POSITIVE))
        .collect();
    let (found, sigma) = (-product / square, jackknife_variance(&without).sqrt());
    (found + CLEAR_SIGMAS * sigma >= 0.0).then_some([found.max(0.0), sigma])
}

/// Checks whether the stiffness differs from its setting.
///
/// - `told`: inverse of the setting, m/N. `place`: width of a place, m. `largest`: force, N.
pub(super) fn judge_stiffness(
    presses: &[SunkPress],
    told: f64,
    place: f64,
    largest: f64,
) -> Option<InputFinding> {
    let [found, sigma] = compliance(presses, place, largest)?;
    let off = (told - found).abs();
    let is_beyond = |sigmas: f64| off > sigmas * sigma + OTHER_COMPLIANCE * told.max(found);
    let is_doubted = is_beyond(DOUBTED_SIGMAS) && off * largest > LEAST_SUNK;
    let measured = format!(
        "the ball sinks by {:.3} ± {:.3} mm/N where it presses, and by its stiffness it sinks by {:.4} mm/N",
        found * 1e3,
        sigma * 1e3,
        told * 1e3
    );
    let remedy = "give the stiffness in N/mm (--stiffness-n-per-mm, tip.stiffness_n_per_mm; touchup calibrate tip)";
    is_doubted.then(|| {
        InputFinding::new(
            InputCause::Stiffness,
            is_beyond(SURE_SIGMAS),
            measured,
            remedy,
        )
    })
}
