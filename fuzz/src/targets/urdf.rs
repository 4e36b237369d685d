//! The URDF of an arm.

use crate::file;
use touchup_io::urdf::{ArmLinks, read_urdf};

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = read_urdf(
        &file("arm.urdf", data),
        &ArmLinks {
            base: "base",
            flange: "flange",
            radius: 0.05,
        },
    );
}
