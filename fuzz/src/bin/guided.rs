//! libFuzzer on the target that `FUZZ_TARGET` names; its arguments are libFuzzer's.

#![no_main]

use std::sync::LazyLock;

use touchup_fuzz::targets::{self, Target};

static RUN: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
    targets::target(&name).unwrap_or_else(|| panic!("FUZZ_TARGET: there is no target \"{name}\""))
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| RUN(data));
