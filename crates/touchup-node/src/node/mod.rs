//! The node: wrench and pose in, the refined mesh and its features out.
//!
//! Six threads of its own. `haptic` has the refiner and takes samples, `patch` reconstructs the
//! touched surface beside it if the scene has a patch, `view` publishes the mesh, `features` finds
//! and fits features, `recorder` writes down the accepted messages, `arm` moves an arm if there is
//! one. Between them are bounded queues; a full one first drops, and counts, inputs for viewing
//! only. Each longer piece of work beside (a save, uncertainty, a check of the input, removal of a
//! touch) has a short-lived thread, and the port has those of its network.

mod arm;
mod calls;
mod channels;
mod diagnostics;
mod error;
mod evaluating_uncertainty;
mod feature_messages;
mod feature_worker;
mod input;
mod keeping;
mod publishing;
mod refinement;
mod running;
mod session;
mod setup;
mod shared;
mod side_work;
mod strokes;
mod take_out;
mod uncertainty;
mod viewing;

pub use arm::{ArmKind, ArmOfNode};
pub use error::NodeError;
pub use keeping::ReplayedSession;
pub use running::{INBOX, Node, PreparedNode};
pub use session::{NodeEnd, SessionReport};
pub use setup::mesh_unit;
