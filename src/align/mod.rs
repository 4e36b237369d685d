//! Where one thing lies relative to another: rigid motions with their uncertainty.

mod pairs;

pub use pairs::{PairsError, PairsFit, PairsParams, PointPair, Side, fit_pairs};
