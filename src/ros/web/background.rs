//! Work that takes seconds: on a thread of its own that yields to those of the node.

use std::io;
use std::thread::Builder;

use tokio::sync::oneshot::{Receiver, channel};

/// Steps by which such a thread stands behind others (setpriority(2)): with a third of their share
/// it still comes to an end where the machine is busy.
const STEPS_BEHIND: i32 = 5;

/// Begins the work; its result comes, unless it panics.
///
/// # Errors
/// Where the system has no thread for it.
pub(super) fn begin<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Receiver<T>> {
    let (to, result) = channel();
    let run = move || {
        step_behind();
        // who asked may have gone
        let _ = to.send(work());
    };
    Builder::new().name(name.to_owned()).spawn(run)?;
    Ok(result)
}

/// Puts this thread, and those that it begins, behind the one that began it.
fn step_behind() {
    // SAFETY: both take numbers and no memory; who = 0 is the calling thread, as Linux has it,
    // which ends at the last step. Where it is refused the work is done all the same
    unsafe {
        libc::setpriority(
            libc::PRIO_PROCESS,
            0,
            libc::getpriority(libc::PRIO_PROCESS, 0) + STEPS_BEHIND,
        )
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> i32 {
        // SAFETY: as above
        unsafe { libc::getpriority(libc::PRIO_PROCESS, 0) }
    }

    #[test]
    fn the_work_and_what_it_begins_stand_behind_who_asked() {
        let before = steps();
        let done = begin("test", || {
            (steps(), std::thread::spawn(steps).join().unwrap())
        })
        .unwrap();
        // 19 is the last step
        let expected = (before + 5).min(19);
        assert_eq!(done.blocking_recv().unwrap(), (expected, expected));
        assert_eq!(steps(), before, "this one goes on as before");
    }
}
