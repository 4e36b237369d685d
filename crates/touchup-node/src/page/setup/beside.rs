//! Background work of the setup, while the server goes on.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::Builder;

use super::setup_state::NodeSetupError;

/// Starts a thread.
///
/// - `what`: the work, in words.
///
/// # Errors
/// [`NodeSetupError::Refused`]: the system gives no thread.
pub(super) fn beside(
    name: &str,
    what: &str,
    work: impl FnOnce() + Send + 'static,
) -> Result<(), NodeSetupError> {
    let started = Builder::new().name(name.to_owned()).spawn(work).map(drop);
    started.map_err(|error| {
        NodeSetupError::Refused(format!(
            "{what} is not possible now: {error}; end other programs"
        ))
    })
}

/// Result of background work; a panic becomes an error, so that nobody waits for it.
pub(super) fn to_its_end<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let fault = || {
        "a fault of touchup ended this: please report it with the file, and choose another one"
            .to_owned()
    };
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(fault()))
}
