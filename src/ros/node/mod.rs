//! The node: wrench and pose in, the refined mesh and its features out.
//!
//! Five threads. `haptic` has the refiner and takes samples, `view` shows the mesh, `seeker` knows the features, `recorder`
//! takes down what was accepted, `arm` moves one where there is one. Between them go bounded queues; where something must give, it is what is only for viewing,
//! and it is counted.

mod arm;
mod calls;
mod channels;
mod convert;
mod diagnostics;
mod edits;
mod engine;
mod error;
mod feature_messages;
mod feature_worker;
mod frame_resolver;
mod frames;
mod mesh_patches;
mod publishing;
mod refinement;
mod replica;
mod running;
mod session;
mod setup;
mod shared;
mod side_work;
mod streams;
mod tiles;
mod tip;
mod view;

pub use arm::{ArmKind, ArmOfNode};
pub use convert::{as_pose, as_wrench};
pub use error::NodeError;
pub use frame_resolver::CELL;
pub use frames::{FrameBuffer, FrameError};
pub use running::{INBOX, Node, Prepared};
pub use session::{NodeEnd, SessionReport};
pub use setup::mesh_unit;
