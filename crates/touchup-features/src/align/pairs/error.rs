//! Faults of picked pairs.

use touchup_method::names;

names! {
    /// One of the two points of a pair.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum PairSide {
        /// Before the motion: the scan.
        From = "scan",
        /// After the motion: space.
        To = "space",
    }
}

/// Reason why pairs do not determine a motion. Pair numbers start at 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PairsError {
    /// Fewer than three.
    #[error(
        "{count} pairs do not determine a motion: pick at least 3, better 6, far apart and not on one line"
    )]
    TooFew {
        /// number of pairs
        count: usize,
    },
    /// NaN, infinite or too far.
    #[error(
        "pair {pair}: its {side} point is not finite or farther than 1000 km away; pick it again"
    )]
    BadPoint {
        /// number of the pair
        pair: usize,
        /// its faulty point
        side: PairSide,
    },
    /// A standard deviation that is not positive and finite.
    #[error(
        "pair {pair}: its sigma is {sigma_mm} mm; it must be more than 0, leave it out where it is not known"
    )]
    BadSigma {
        /// number of the pair
        pair: usize,
        /// given value
        sigma_mm: f64,
    },
    /// A sigma of all pairs that is not positive and finite.
    #[error(
        "the sigma of the pairs is {sigma_mm} mm; it must be 1e-9 to 1e6 mm, leave it out where it is not known"
    )]
    BadGivenSigma {
        /// given value
        sigma_mm: f64,
    },
    /// Fewer than three different points.
    #[error(
        "pairs {first} and {second} have the same {side} point, {distance_mm:.6} mm apart, and fewer than 3 differ: pick points far apart"
    )]
    Coincident {
        /// one pair
        first: usize,
        /// the other
        second: usize,
        /// side of the coincidence
        side: PairSide,
        /// distance between the two
        distance_mm: f64,
    },
    /// All points near one line.
    #[error(
        "the {side} points lie on one line: they scatter by {across_mm:.3} mm across it and {along_mm:.1} mm along it, so \
         the turn about it is not determined; pick one more, far off the line"
    )]
    Collinear {
        /// side of the line
        side: PairSide,
        /// rms distance from the middle along the line
        along_mm: f64,
        /// rms distance across
        across_mm: f64,
    },
    /// Distances differ by a factor.
    #[error(
        "distances in space are {factor:.5} times those on the scan{named}: give both in one unit"
    )]
    Scale {
        /// distance in space over distance on the scan
        factor: f64,
        /// units that the factor stands for
        named: &'static str,
    },
    /// A left-handed set of axes.
    #[error(
        "the pairs fit a mirror image (rms {mirrored_mm:.3} mm) and no motion (rms {rms_mm:.3} mm): the sign of one axis is \
         wrong, two axes are swapped, or one set of axes is left-handed"
    )]
    Mirrored {
        /// rms of the best motion
        rms_mm: f64,
        /// rms of the best mirror image
        mirrored_mm: f64,
    },
    /// One pair against all the others.
    #[error(
        "pair {pair} does not fit: it is {distance_mm:.3} mm from where the other {others} put it, and they agree within \
         {rest_mm:.3} mm rms; pick it again or take it out"
    )]
    Outlier {
        /// number of the pair
        pair: usize,
        /// distance from its place by the others
        distance_mm: f64,
        /// number of others
        others: usize,
        /// rms of the others without it
        rest_mm: f64,
    },
    /// No motion fits.
    #[error(
        "the pairs disagree by {rms_mm:.3} mm rms, more than {limit_mm:.3} mm; pair {worst} is worst with {worst_mm:.3} mm: \
         check that each row names one point twice{hint}"
    )]
    Disagree {
        /// √(mean |residual|²)
        rms_mm: f64,
        /// largest allowed rms
        limit_mm: f64,
        /// pair with the largest residual
        worst: usize,
        /// its residual
        worst_mm: f64,
        /// advice
        hint: &'static str,
    },
    /// The decomposition did not converge.
    #[error(
        "the pairs determine no rotation: their coordinates are out of all proportion; check them"
    )]
    NoRotation,
}
