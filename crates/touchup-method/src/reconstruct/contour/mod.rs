//! The zero set of the field as a mesh: dual contouring, and the scan clipped to its rim.

pub(in crate::reconstruct) mod clip;
pub(in crate::reconstruct) mod coarsening;
pub(in crate::reconstruct) mod crossing;
pub(in crate::reconstruct) mod dual;
pub(in crate::reconstruct) mod dual_contouring;
pub(in crate::reconstruct) mod loops;
pub(in crate::reconstruct) mod patched;
pub(in crate::reconstruct) mod qef;
pub(in crate::reconstruct) mod scan_clipping;
pub(in crate::reconstruct) mod trace;
