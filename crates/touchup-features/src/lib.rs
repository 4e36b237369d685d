//! Features of a touched part, and the decisions that rest on them.
//!
//! | module | purpose |
//! |---|---|
//! | [`features`] | holes, slots, planes, … of a mesh and its touches, with their uncertainty |
//! | [`conformity`] | whether measured characteristics conform with their tolerances: guard bands, conformance probability, matching |
//! | [`align`] | rigid registration: of pairs, of features, of surfaces |
//! | [`compare`] | deviation from the true part, discrepancy of scan and touch, as numbers and as a picture |
//! | [`calibrate`] | payload and tip calibration, registration of the scan |
//! | [`diagnose`] | whether scan and touches belong together |
//!
//! Frames: those of [`touchup_method`]; units: those of [`touchup_geometry`].
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod adjustment;
pub mod align;
pub mod calibrate;
pub mod compare;
pub mod conformity;
pub mod diagnose;
pub mod features;
