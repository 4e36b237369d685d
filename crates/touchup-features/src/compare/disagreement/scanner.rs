//! Error model of the scanner, from scan and touch alone.

use super::edges::SHARP;
use super::places::VertexProperties;
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, median};

/// Error of the scanner at places that it should see well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scanner {
    /// median of touch − scan, m: negative if the scan lies outside of the part
    pub offset: f64,
    /// robust standard deviation about it, m
    pub noise: f64,
    /// correlation length ℓ of the noise, m
    pub correlation: f64,
    /// median edge of the scan's triangles, m
    pub edge: f64,
    /// width below which the scan may close over gaps, m
    pub sees_from: f64,
    /// number of places in the estimate
    pub places: usize,
}

/// The median of a squared normal number of variance 1.
const MEDIAN_OF_SQUARE: f64 = 0.4549;
/// Minimum number of places for the estimate.
const FEWEST: usize = 200;
/// Maximum number of places for pairs.
const MOST_PLACES: usize = 1_500;
/// Maximum distance of a pair, in edges of the triangles; number of bins.
const LONGEST: f64 = 8.0;
const BINS: usize = 32;
/// Pairs that fill a bin.
const FULL: usize = 50;
/// Distance of half the mean square difference at 1 − 1/e of the variance, in ℓ.
const GROWN: f64 = std::f64::consts::SQRT_2;
/// Minimum noise, as a share of the edges: finer differences are negligible.
const LEAST_NOISE: f64 = 1e-3;

impl Scanner {
    /// `None` if too few places are open.
    pub(super) fn of(places: &VertexProperties) -> Option<Self> {
        let open = places.open();
        if open.len() < FEWEST {
            return None;
        }
        let edge = places.edges.resolution;
        let mut values: Vec<f64> = open.iter().map(|&at| places.off[at]).collect();
        let offset = median(&mut values)?;
        values
            .iter_mut()
            .for_each(|value| *value = (*value - offset).abs());
        let noise = (SIGMA_OF_MEDIAN * median(&mut values)?).max(LEAST_NOISE * edge);
        let correlation = correlation(places, &open, noise, edge);
        Some(Self {
            offset,
            noise,
            correlation,
            edge,
            sees_from: places.edges.sees_from(),
            places: open.len(),
        })
    }

    /// Whether a disagreement is within a number of standard deviations.
    pub(super) fn is_noise(&self, off: f64, sigmas: f64) -> bool {
        (off - self.offset).abs() <= sigmas * self.noise
    }

    /// Whether edge rounding and noise may explain a disagreement.
    pub(super) fn may_round(&self, off: f64, sigmas: f64) -> bool {
        (off - self.offset).abs() <= self.edge + sigmas * self.noise
    }

    /// Standard deviation of the mean over an area (m²), m.
    pub(crate) fn sigma_of_mean(&self, area: f64) -> f64 {
        let alike = std::f64::consts::TAU * self.correlation.powi(2);
        self.noise / (1.0 + area / alike.max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Correlation length of disagreements, m: half the mean square of their differences grows to 1 −
/// 1/e of the variance within √2 ℓ.
fn correlation(places: &VertexProperties, open: &[usize], noise: f64, edge: f64) -> f64 {
    let some: Vec<usize> = open
        .iter()
        .copied()
        .step_by(open.len().div_ceil(MOST_PLACES))
        .collect();
    let width = LONGEST * edge / BINS as f64;
    let mut bins: Vec<Vec<f64>> = vec![Vec::new(); BINS];
    for (i, &a) in some.iter().enumerate() {
        for &b in &some[..i] {
            let bin = ((places.positions[a] - places.positions[b]).norm() / width) as usize;
            if bin < BINS && places.normals[a].dot(&places.normals[b]) > SHARP {
                bins[bin].push((places.off[a] - places.off[b]).powi(2) / 2.0);
            }
        }
    }
    let grown = (1.0 - (-1.0f64).exp()) * noise.powi(2);
    let is_grown = |bin: &mut Vec<f64>| {
        bin.len() >= FULL && median(bin).is_some_and(|median| median / MEDIAN_OF_SQUARE >= grown)
    };
    let at = bins.iter_mut().position(is_grown).unwrap_or(BINS);
    ((at as f64 + 0.5) * width / GROWN).max(edge / 2.0)
}
