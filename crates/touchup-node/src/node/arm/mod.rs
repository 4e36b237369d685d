//! The arm behind the node.

mod answer;
mod common;
mod pace;
mod request;
mod worker;
mod world;

pub use worker::{ArmHandle, ArmKind, ArmOfNode, start};
