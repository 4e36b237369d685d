//! Repairs a 3D scan of a work-piece by touch.
//!
//! A stylus or a robot-held probe touches the real part. From the tip's pose and the measured force
//! touchup predicts the force that the scan implies, compares it with the measured force (the
//! *haptic mismatch*), and moves the mesh until the two agree.
//!
//! This crate is the command line; crates of their own hold the rest, shown here under one name:
//!
//! | crate | modules |
//! |---|---|
//! | [`touchup_geometry`] | [`mesh`] [`form`] [`brep`]; units |
//! | [`touchup_method`] | samples to mesh: [`stylus`] [`reconstruct`] [`haptic`]; frames |
//! | [`touchup_features`] | [`features`] [`conformity`] [`align`] [`compare`] [`calibrate`] [`diagnose`] |
//! | [`touchup_probing`] | [`probing::plan`] [`probing::arm`] [`probing::execute`] |
//! | [`touchup_sim`] | [`sim`]: known surfaces, a scanner, a stylus and an arm to test against |
//! | [`touchup_io`] | [`io`]: mesh files, recordings, tables, pictures |
//! | [`touchup_session`] | [`clock`], [`threads`], [`scan`], [`scene`], [`replay`], [`refinement`], [`probing_run`], [`calibration`], [`input_check`], [`live`], [`session`], [`sweep`] |
//! | [`touchup_node`] | `ros` and `node` (features `ros` and `r2r`), `page` (feature `web`), `ros2_control`, `ur` (feature `ur`), [`log_lines`] |
//! | `touchup-inspect` | a part against its drawing |
//! | `touchup-report` | a separate program: error against run time, stability, and the cost of each part |
//! | this one | [`cli`]: one file for each verb |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

/// The method of docs/method.md, as tested code.
#[cfg(doctest)]
#[doc = include_str!("../docs/method.md")]
struct MethodPage;

pub use touchup_features::{align, calibrate, compare, conformity, diagnose, features};
pub use touchup_geometry::{brep, form, mesh};
pub use touchup_method::{haptic, reconstruct, stylus};
pub use touchup_node::*;
pub use touchup_probing as probing;
pub use touchup_session::{
    calibration, clock, input_check, live, probing_run, refinement, replay, scan, scene, session,
    sweep, threads,
};
pub use {touchup_io as io, touchup_sim as sim};

pub mod cli;

#[cfg(test)]
#[path = "../tests/common/colour_vision.rs"]
mod colour_vision;
