//! Probing of flagged features by an arm that holds a probe.
//!
//! | module | purpose |
//! |---|---|
//! | [`plan`] | next-touch planning |
//! | [`arm`] | an arm that holds a probe: kinematics, limits, onset of a contact |
//! | [`execute`] | from a flag to a feature with an arm |
//!
//! Frames: those of [`touchup_method`]; units: those of [`touchup_geometry`].
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod arm;
pub mod execute;
pub mod plan;
