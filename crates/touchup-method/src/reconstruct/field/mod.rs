//! The signed field on the lattice: piecewise fits of the contacts, free space, the smoothest
//! continuation between.

pub(in crate::reconstruct) mod floating_components;
pub(in crate::reconstruct) mod grid;
pub(in crate::reconstruct) mod harmonic_fill;
pub(in crate::reconstruct) mod uncertainty;
pub(in crate::reconstruct) mod unreachable;
