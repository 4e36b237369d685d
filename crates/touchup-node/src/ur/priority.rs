//! Real-time priority of the threads that keep an arm moving, if this user may have it.
//!
//! A thread of ordinary priority waits for all other work. The request is for `SCHED_FIFO` as in
//! sched(7): the kernel allows it up to `RLIMIT_RTPRIO`, or with `CAP_SYS_NICE`.

use std::io;

/// Priority of all threads of the program that speaks to the arm.
pub(super) const CLIENT: i32 = 40;
/// Priority of the guard, and of the thread that passes it the lines of the client.
pub(super) const GUARD: i32 = 50;
/// Priority of the thread that commands the arm.
pub(super) const CALLER: i32 = 30;

/// Gives this thread a real-time priority.
///
/// - `inherits`: also threads started from now on; otherwise they are ordinary ones.
///
/// # Errors
/// Of the system: `EPERM` without permission.
pub(super) fn raise(priority: i32, inherits: bool) -> io::Result<()> {
    let policy = libc::SCHED_FIFO
        | if inherits {
            0
        } else {
            libc::SCHED_RESET_ON_FORK
        };
    let mut param = std::mem::MaybeUninit::<libc::sched_param>::zeroed();
    // SAFETY: all zeros is a value of this plain struct; 0 is the calling thread, and the kernel
    // only reads `param`, which outlives the call
    let result = unsafe {
        (*param.as_mut_ptr()).sched_priority = priority;
        libc::sched_setscheduler(0, policy, param.as_ptr())
    };
    if result == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Advice after a refusal of [`raise`].
pub(super) fn remedy(error: &io::Error) -> String {
    format!(
        "the arm is commanded at ordinary priority ({error}), and may stop where this machine is busy: add the line \
         `@realtime - rtprio {GUARD}` to /etc/security/limits.conf, add yourself to the group `realtime`, and log in again"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Priority and policy of this thread, the 40th and 41st field in proc(5).
    fn scheduled() -> (i32, i32) {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        // the second field is a name in parentheses, which may have blanks
        let fields: Vec<_> = stat
            .rsplit_once(')')
            .unwrap()
            .1
            .split_whitespace()
            .collect();
        (
            fields[40 - 3].parse().unwrap(),
            fields[41 - 3].parse().unwrap(),
        )
    }

    /// The kernel confirms priority or refusal; a started thread inherits the priority only on
    /// request.
    #[test]
    fn a_thread_has_the_priority_that_it_was_granted_and_hands_it_on_where_it_is_asked() {
        for inherits in [false, true] {
            let (granted, own, started) = std::thread::spawn(move || {
                let granted = raise(1, inherits);
                (
                    granted,
                    scheduled(),
                    std::thread::spawn(scheduled).join().unwrap(),
                )
            })
            .join()
            .unwrap();
            let ordinary = scheduled();
            match granted {
                Ok(()) => {
                    assert_eq!(own, (1, libc::SCHED_FIFO));
                    assert_eq!(started, if inherits { own } else { ordinary });
                }
                Err(error) => {
                    assert_eq!(error.raw_os_error(), Some(libc::EPERM), "{error}");
                    assert_eq!((own, started), (ordinary, ordinary));
                }
            }
        }
    }

    #[test]
    fn who_may_not_have_it_is_told_what_to_do() {
        let words = remedy(&io::Error::from_raw_os_error(libc::EPERM));
        assert!(
            words.contains("rtprio 50") && words.contains("limits.conf"),
            "{words}"
        );
        assert!(raise(1000, false).is_err(), "no such priority");
    }
}
