//! The arm, the choice of its next touch, and a probing from flag to feature.

mod arm;
mod decided;
mod execute;
mod grid;
mod known_surfaces;
mod plan;
mod pockets;
