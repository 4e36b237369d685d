//! One session: the scene file, both rates side by side, and the result.
//!
//! | module | what it does |
//! |---|---|
//! | [`clock`] | steady time, of the machine or of a test that moves it |
//! | [`threads`] | workers for the rooms that are pure |
//! | [`scan`] | a mesh or a point cloud of a file, as a mesh |
//! | [`scene`] | the YAML that names the parts of a scene and their parameters |
//! | [`live`] | the engine: the haptic update at every sample, the patch beside it or at the end |
//! | [`replay`] | a recording from its first message to its last, as messages or as samples |
//! | [`calibration`] | tip, payload and place of the scan: from a recording to what is put into a scene |
//! | [`input_check`] | what speaks against a recording on a scan |
//! | [`refinement`] | a scan refined by a recording, from its first message to the result |
//! | [`sweep`] | many refinements as jobs, and what moved between two of them |
//! | [`session`] | one run: its recording, its result, and the inputs that reproduce it |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub use touchup_io::reported;

pub mod calibration;
pub mod clock;
pub mod input_check;
pub mod live;
pub mod refinement;
pub mod replay;
pub mod scan;
pub mod scene;
pub mod session;
pub mod sweep;
pub mod threads;
