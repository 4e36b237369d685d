//! The method: samples of a stylus move the mesh until felt and predicted force agree.
//!
//! The modules, in the order in which data flows through them and in which they may use one
//! another:
//!
//! | module | purpose |
//! |---|---|
//! | [`mod@parameters`] | the declaration of each key of the scene: unit, range, default, documentation |
//! | [`stylus`] | pose and wrench become one [`stylus::Sample`]: pairing, compensation, contact, friction |
//! | [`reconstruct`] | the touched part of the scan reconstructed |
//! | [`haptic`] | [`haptic::Refiner::push`]: face dynamics, region, guard; one sample moves the mesh |
//!
//! # Frames
//!
//! O object (the mesh) · T stylus tip (origin: centre of the ball; z: along the shaft, from tip to
//! handle) · S force sensor · H the stylus as it is tracked (axes of T; the scene gives the place
//! of the ball in it) · W world or space, in which it is tracked (the scene gives the pose of O in
//! it; in the simulator z is up) · V view (in the simulator alone; z: towards the scanner or the
//! hand) · F fitted surface (in `touchup-features` alone; z: its axis or normal). `pose_ot` maps T
//! to O, `p_ot` is the tip in O, `force_o` is a force expressed in O. A wrench acts from the object
//! on the stylus and normals point out of the object, so a stylus that presses has `force_o ·
//! normal > 0`. Units: those of [`touchup_geometry`].
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod haptic;
pub mod parameters;
pub mod reconstruct;
pub mod stylus;
