//! Relative place of two things: rigid motions with their uncertainty.

mod by_features;
mod datum_fit;
mod icp;
mod pairs;

pub use by_features::{
    Alternative, FeaturesError, FeaturesParams, FeaturesSide, FreeTurn, OrientedSample, Surfaces,
    align_features,
};
pub use datum_fit::{DatumFit, DatumFitError, DatumPair, fit_datums};
pub use icp::{IcpError, IcpFit, IcpMotion, IcpParams, icp};
pub(crate) use pairs::closest_motion;
pub use pairs::{PairSide, PairsError, PairsFit, PairsParams, PointPair, fit_pairs};
