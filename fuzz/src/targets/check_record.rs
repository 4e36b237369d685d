//! The record of the check of an arm.

use crate::file;
use touchup_session::scene::CheckRecord;

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = CheckRecord::read(&file("check.json", data));
}
