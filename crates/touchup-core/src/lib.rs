//! The method: samples to mesh, features, registration and probing.
//!
//! Nothing here opens a file, reads a clock, starts a thread or speaks ROS: the same samples give
//! the same bytes. The modules, in the order in which data flows through them and in which they may
//! use one another:
//!
//! | module | purpose |
//! |---|---|
//! | [`numeric`] | quantiles, means, bases, voxels, disjoint sets, robust weights, least squares, small rigid motions |
//! | [`mod@parameters`] | the declaration of each key of the scene: unit, range, default, documentation |
//! | [`stylus`] | pose and wrench become one [`stylus::Sample`]: pairing, compensation, contact, friction |
//! | [`mesh`] | the triangle mesh, its repair, its exact closest-face tree, its Laplacian |
//! | [`reconstruct`] | the touched part of the scan reconstructed |
//! | [`haptic`] | [`haptic::Refiner::push`]: face dynamics, region, guard; one sample moves the mesh |
//! | [`form`] | roundness, flatness, parallelism, position, … of points and of fitted features, with their uncertainty |
//! | [`features`] | holes, slots, planes, … of a mesh and its touches, with their uncertainty |
//! | [`conformity`] | whether measured characteristics conform with their tolerances: guard bands, conformance probability, matching |
//! | [`align`] | rigid registration: of pairs, of features, of surfaces |
//! | [`compare`] | deviation from the true part, discrepancy of scan and touch, as numbers and as a picture |
//! | [`calibrate`] | payload and tip calibration, registration of the scan |
//! | [`diagnose`] | whether scan and touches belong together |
//! | [`probing::plan`] | next-touch planning |
//! | [`probing::arm`] | an arm that holds a probe: kinematics, limits, onset of a contact |
//! | [`probing::execute`] | from a flag to a feature with an arm |
//!
//! # Frames
//!
//! O object (the mesh) · T stylus tip (origin: centre of the ball; z: along the shaft, from tip to
//! handle) · S force sensor · H the stylus as it is tracked (axes of T; the scene gives the place
//! of the ball in it) · W world or space, in which it is tracked (the scene gives the pose of O in
//! it; in the simulator z is up) · V view (in the simulator alone; z: towards the scanner or the
//! hand) · F fitted surface (in [`features`] alone; z: its axis or normal). `pose_ot` maps T to O,
//! `p_ot` is the tip in O, `force_o` is a force expressed in O. A wrench acts from the object on
//! the stylus and normals point out of the object, so a stylus that presses has `force_o · normal >
//! 0`.
//!
//! # Units
//!
//! SI throughout: m, N, N·m, kg, s, rad. A bare number that leaves the code carries its unit in its
//! name (`mass_kg`, `stamp_ns`). Stamps are `i64` nanoseconds.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod align;
pub mod calibrate;
pub mod compare;
pub mod conformity;
pub mod diagnose;
pub mod features;
pub mod form;
pub mod haptic;
pub mod mesh;
pub mod numeric;
pub mod parameters;
pub mod probing;
pub mod reconstruct;
pub mod stylus;
