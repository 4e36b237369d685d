//! One session: the scene file, both rates side by side, and the result.
//!
//! | module | content |
//! |---|---|
//! | [`clock`] | steady time of the machine, or of a test that advances it |
//! | [`threads`] | worker threads for crates without threads |
//! | [`scan`] | reads a mesh or a point cloud from a file as a mesh |
//! | [`scene`] | YAML file of the sections of a scene and their parameters |
//! | [`live`] | engine: haptic update at every sample, patch beside it or at the end |
//! | [`replay`] | a recording from first to last message, as messages or samples |
//! | [`calibration`] | tip, payload and pose of the scan: from a recording to scene settings |
//! | [`input_check`] | findings against a recording on a scan |
//! | [`refinement`] | refines a scan by a recording, from first message to result |
//! | [`probing_run`] | probes flagged features with one arm, one after the other |
//! | [`sweep`] | runs many refinements as jobs, and compares two of them |
//! | [`session`] | one run: its recording, its result, and the inputs that reproduce it |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub use touchup_io::reported;

pub mod calibration;
pub mod clock;
pub mod input_check;
pub mod live;
pub mod probing_run;
pub mod refinement;
pub mod replay;
pub mod scan;
pub mod scene;
pub mod session;
pub mod sweep;
pub mod threads;
