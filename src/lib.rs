//! Repairs a 3D scan of a work-piece by touch.
//!
//! A stylus or a robot-held probe touches the real part. From the tip's pose and the felt force touchup predicts what
//! the scan says should be felt, compares it with what is felt (the *haptic mismatch*), and moves the mesh until the
//! two agree.
//!
//! The rooms, in the order in which data flows through them:
//!
//! | room | what happens there |
//! |---|---|
//! | [`clock`] | steady time, of the machine or of a test that moves it |
//! | [`touch`] | pose and wrench become one [`touch::Sample`]; weight and bias come off; is there contact? |
//! | [`mesh`] | the triangle mesh, its closest face, its Laplacian |
//! | [`patch`] | the scan meshed anew where it was touched |
//! | [`refine`] | [`refine::Refiner::push`]: one sample moves the mesh |
//! | [`live`] | both rates: [`refine`] at every sample, [`patch`] beside it on a thread of its own |
//! | [`features`] | what a mesh and the touches on it are made of: holes, slots, planes, with their uncertainty |
//! | [`align`] | where one shape lies on another: rigid motions of pairs and of surfaces |
//! | [`compare`] | how far a mesh is from the true part, in numbers and as a picture |
//! | [`calibrate`] | what hangs on the sensor, and where the ball is |
//! | [`explore`] | where to touch next |
//! | [`robot`] | an arm that holds a probe: kinematics, and where a touch began; `robot::ur` (feature `ur`): a UR |
//! | [`probe`] | flag to feature with an arm: wishes become ways that keep clear, touches, and a reason for every ending |
//! | [`sim`] | known surfaces, a scanner and a stylus to test against |
//! | [`io`] | mesh files and recordings; with [`scene`] the only file access |
//! | [`scene`] | the YAML that names the parts of a scene |
//! | `ros` | the node's side of ROS 2 (features `ros` and `r2r`): messages, parameters, and the port to what is behind them |
//! | [`session`] | one run of touching: what comes of it, and what it takes to get the same again |
//! | [`report`] | error against run time, stability, and what each part costs |
//! | [`cli`] | one file for each verb of the command line |
//!
//! # Frames
//!
//! O object (the mesh) · T stylus tip (origin: centre of the ball; z: along the shaft, from tip to handle) · S force
//! sensor · H the stylus as it is tracked (axes of T; the scene says where the ball is in it) · W world or space, in which
//! it is tracked (the scene says where O is in it; in [`sim`] z is up) · V view (in [`sim`] alone; z: towards the scanner or
//! the hand) · F fitted surface (in [`features`] alone; z: its axis or normal). `pose_ot` maps T to O, `p_ot` is the tip in
//! O, `force_o` is a force expressed in O. A wrench is what the object does to the stylus and normals point out of the
//! object, so a stylus that presses has `force_o · normal > 0`.
//!
//! # Units
//!
//! SI throughout: m, N, N·m, kg, s, rad. A bare number that leaves the code carries its unit in its name
//! (`mass_kg`, `stamp_ns`). Stamps are `i64` nanoseconds.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]
#![warn(missing_docs)]

/// The method as docs/method.md has it; its code is tested.
#[cfg(doctest)]
#[doc = include_str!("../docs/method.md")]
struct Method;

pub mod align;
pub mod calibrate;
pub mod cli;
pub mod clock;
pub mod compare;
pub mod explore;
pub mod features;
pub mod io;
pub mod live;
pub mod mesh;
pub mod patch;
pub mod probe;
pub mod refine;
pub mod report;
pub mod robot;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod ros;
pub mod scene;
pub mod session;
pub mod sim;
pub mod touch;
