//! Work of seconds, on a thread with a lower priority than those of the node.

use std::io;
use std::thread::Builder;

use tokio::sync::oneshot::{Receiver, channel};

use touchup_session::threads::give_way;

/// Begins the work; the receiver gets its result, unless it panics.
///
/// # Errors
/// If the system has no thread for it.
pub(super) fn begin<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Receiver<T>> {
    let (to, result) = channel();
    let run = move || {
        give_way();
        // the requester may have gone
        let _ = to.send(work());
    };
    Builder::new().name(name.to_owned()).spawn(run)?;
    Ok(result)
}
