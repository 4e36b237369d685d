//! Before there is a node: the scan, its unit and the tip are chosen on the page, step by step, a recording is looked at where there is
//! one, and the node begins from there.

mod facts;
mod node_setup;
mod recording_check;
mod routes;
mod scene_draft;
mod setup_shown;
mod upload;

pub use self::node_setup::{NodeSetup, SetupParams};
pub(super) use self::routes::router;
pub use self::setup_shown::SetupStep;
