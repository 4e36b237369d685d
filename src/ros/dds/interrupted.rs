//! The threads of RustDDS outlive a pause of the process.
//!
//! A process that is stopped and goes on (SIGSTOP, Ctrl-Z, a debugger) has its waits for events end
//! with EINTR (signal(7)), and RustDDS 0.15 ends its threads at that: the node would hear nothing
//! any more. So the call that mio waits by is this one, to which a signal is no event.

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

/// As epoll_wait(2), but no events where a signal ends it: the caller waits again for the time that
/// it has left.
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
    // SAFETY: the arguments are those of the caller; without a mask it is the same call
    let count = unsafe { epoll_pwait(epoll, events, most, timeout_ms, null()) };
    let is_signal = count < 0 && Error::last_os_error().kind() == ErrorKind::Interrupted;
    if is_signal { 0 } else { count }
}
