//! The node: wrench and pose in, the refined mesh and its features out.
//!
//! Five threads. `haptic` has the refiner and takes samples, `view` publishes the mesh, `features`
//! finds and fits features, `recorder` writes down what was accepted, `arm` moves an arm where
//! there is one. Between them are bounded queues; where one is full, what is only for viewing is
//! dropped first, and it is counted.

mod acceptance;
mod arm;
mod calls;
mod channels;
mod convert;
mod diagnostics;
mod doubts;
mod error;
mod evaluating_variances;
mod feature_messages;
mod feature_worker;
mod frame_resolver;
mod keeping;
mod mesh_patches;
mod publishing;
mod refinement;
mod replayed;
mod replica;
mod running;
mod session;
mod setup;
mod shared;
mod side_work;
mod streams;
mod take_out;
mod taking_out;
mod tiles;
mod tip;
mod variances;
mod view;

pub use arm::{ArmKind, ArmOfNode};
pub use convert::{as_pose, as_wrench};
pub use error::NodeError;
pub use frame_resolver::CELL;
pub use keeping::ReplayedSession;
pub use running::{INBOX, Node, Prepared};
pub use session::{NodeEnd, SessionReport};
pub use setup::mesh_unit;
