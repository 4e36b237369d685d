//! Common parts of the verbs: input, output, errors, progress.

pub mod arm_errors;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod begin;
pub mod error;
pub mod found;
pub mod output;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod path_parameter;
pub mod pictures;
pub mod progress;
pub mod recorded;
pub mod refinement;
#[cfg(feature = "web")]
pub mod set_up;
pub mod signals;
pub mod told;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod web;
