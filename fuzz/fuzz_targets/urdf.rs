//! The URDF of an arm.

#![no_main]

use libfuzzer_sys::fuzz_target;
use touchup_fuzz::file;
use touchup_io::urdf::{ArmLinks, read_urdf};

fuzz_target!(|data: &[u8]| {
    let _ = read_urdf(
        &file("arm.urdf", data),
        &ArmLinks {
            base: "base",
            flange: "flange",
            radius: 0.05,
        },
    );
});
