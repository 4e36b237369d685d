//! Where a part lies: the rigid motion that brings one shape onto another.

mod icp;

pub use icp::{IcpError, IcpFit, IcpParams, Motion, icp};
