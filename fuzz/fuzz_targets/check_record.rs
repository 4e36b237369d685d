//! The record of the check of an arm.

#![no_main]

use libfuzzer_sys::fuzz_target;
use touchup_fuzz::file;
use touchup_session::scene::CheckRecord;

fuzz_target!(|data: &[u8]| {
    let _ = CheckRecord::read(&file("check.json", data));
});
