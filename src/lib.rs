//! Repairs a 3D scan of a work-piece by touch.
//!
//! A stylus or a robot-held probe touches the real part. From the tip's pose and the measured force
//! touchup predicts the force that the scan implies, compares it with the measured force (the
//! *haptic mismatch*), and moves the mesh until the two agree.
//!
//! This crate is the ROS 2 node and the command line; crates of their own hold the rest, shown here
//! under one name:
//!
//! | crate | modules |
//! |---|---|
//! | [`touchup_core`] | the method: [`stylus`] [`mesh`] [`reconstruct`] [`haptic`] [`features`] [`conformity`] [`align`] [`compare`] [`calibrate`] [`diagnose`] [`probing::plan`] [`probing::arm`] [`probing::execute`]; frames and units |
//! | [`touchup_sim`] | [`sim`]: known surfaces, a scanner, a stylus and an arm to test against |
//! | [`touchup_io`] | [`io`]: mesh files, recordings, tables, pictures |
//! | [`touchup_session`] | [`clock`], [`threads`], [`scan`], [`scene`], [`replay`], [`refinement`], [`calibration`], [`input_check`], [`live`], [`session`], [`sweep`] |
//! | `touchup-report` | a separate program: error against run time, stability, and the cost of each part |
//! | this one | `inspection`: a part against its drawing; `html`: text within pages; `ros`: the node (features `ros` and `r2r`); `ros2_control`: an arm behind it; `ur` (feature `ur`): a UR; [`cli`]: one file for each verb |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

/// The method of docs/method.md, as tested code.
#[cfg(doctest)]
#[doc = include_str!("../docs/method.md")]
struct MethodPage;

pub use touchup_core::{
    align, calibrate, compare, conformity, diagnose, features, form, haptic, mesh, probing,
    reconstruct, stylus,
};
pub use touchup_session::{
    calibration, clock, input_check, live, refinement, replay, scan, scene, session, sweep, threads,
};
pub use {touchup_io as io, touchup_sim as sim};

pub mod cli;
mod inspection;
pub mod log_lines;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod ros;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod ros2_control;
#[cfg(feature = "ur")]
pub mod ur;

/// Optional cargo features, and whether this build has them.
pub const FEATURES: [(&str, bool); 4] = [
    ("feature ros", cfg!(feature = "ros")),
    ("feature r2r", cfg!(feature = "r2r")),
    ("feature ur", cfg!(feature = "ur")),
    ("feature web", cfg!(feature = "web")),
];

// the stand-in supplies the model of a UR's controller and uses this crate by its name
#[cfg(all(test, feature = "ur"))]
extern crate self as touchup;

#[cfg(test)]
#[path = "../tests/common/colour_vision.rs"]
mod colour_vision;
