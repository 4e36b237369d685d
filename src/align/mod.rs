//! Where one thing lies relative to another: rigid motions with their uncertainty.

mod icp;
mod pairs;

pub use icp::{IcpError, IcpFit, IcpParams, Motion, icp};
pub use pairs::{PairsError, PairsFit, PairsParams, PointPair, Side, fit_pairs};
