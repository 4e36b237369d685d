//! All tests that need no device: one module a room, linked once.

#[path = "../common/chains.rs"]
mod chains;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/full.rs"]
mod full;
#[path = "../common/plate_stream.rs"]
mod plate_stream;
#[path = "../common/shapes.rs"]
mod shapes;
#[path = "../common/shared.rs"]
mod shared;
#[path = "../common/soundness.rs"]
mod soundness;
#[path = "../common/static_scan.rs"]
mod static_scan;

mod accepted;
mod align;
mod allocation;
mod allocations;
mod calibrate;
mod cli;
mod compare;
mod diagnose;
mod features;
mod form;
mod haptic;
mod inspect;
mod io;
mod layers;
mod light_touch;
mod live;
mod mesh;
mod probing;
mod reconstruct;
mod refinement;
mod scene;
mod sim;
mod stylus;
mod sweep;
