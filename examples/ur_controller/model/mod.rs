//! The controller of a UR as its client sees it, on a clock of its own, without a network: the
//! stand-in puts it on the wire, and the tests of the driver run it in one process with driver and
//! guard.

pub mod body;
pub mod controller;
pub mod panel;
pub mod record;
pub mod states;
