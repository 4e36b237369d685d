//! The threads of RustDDS outlive a pause of the process.
//!
//! A process that is stopped and goes on (SIGSTOP, Ctrl-Z, a debugger) has its waits for events end
//! with EINTR (signal(7)), and RustDDS 0.15 ends its threads at that: the node would hear nothing
//! any more. So the call that mio waits by is this one, which waits again.

use std::ffi::{c_int, c_void};
use std::io::{Error, ErrorKind};
use std::ptr::null;

unsafe extern "C" {
    fn epoll_pwait(
        epoll: c_int,
        events: *mut c_void,
        most: c_int,
        timeout_ms: c_int,
        mask: *const c_void,
    ) -> c_int;
}

/// As epoll_wait(2), but a signal does not end it.
///
/// # Safety
/// As of epoll_wait(2): `events` has room for `most` of them.
#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_wait(
    epoll: c_int,
    events: *mut c_void,
    most: c_int,
    timeout_ms: c_int,
) -> c_int {
    loop {
        // SAFETY: the arguments are those of the caller; without a mask it is the same call
        let count = unsafe { epoll_pwait(epoll, events, most, timeout_ms, null()) };
        if count >= 0 || Error::last_os_error().kind() != ErrorKind::Interrupted {
            return count;
        }
    }
}
