//! The arm, where it touches next, and a probing from flag to feature.

mod arm;
mod decided;
mod execute;
mod grid;
mod plan;
mod pockets;
