//! Setup before a node: operators choose the scan, its unit and the tip on the page, calibrate the
//! sensors and check them by recordings, and start the node.

mod beside;
mod calibrating;
mod checking;
mod choices;
mod facts;
mod found_calibration;
mod node_setup;
mod recording_check;
mod routes;
mod scene_draft;
mod setup_shown;
mod setup_state;
mod upload;

pub use self::node_setup::{NodeSetup, SetupParams};
pub(super) use self::routes::router;
pub use self::setup_shown::SetupStep;
