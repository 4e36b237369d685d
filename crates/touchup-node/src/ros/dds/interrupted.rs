//! The threads of RustDDS outlive a pause of the process.
//!
//! In a process that stops and continues (SIGSTOP, Ctrl-Z, a debugger) waits for events end with
//! EINTR (signal(7)), and RustDDS 0.15 then ends its threads: the node would receive nothing more.
//! So this function replaces the wait call of mio; to it a signal is no event.

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

/// As epoll_wait(2), but a signal yields no events: the caller waits again for its remaining time.
///
/// # Safety
/// As for epoll_wait(2): `events` has room for `most` of them.
#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_wait(
    epoll: c_int,
    events: *mut c_void,
    most: c_int,
    timeout_ms: c_int,
) -> c_int {
    // SAFETY: the arguments are the caller's; without a mask it is the same call
    let count = unsafe { epoll_pwait(epoll, events, most, timeout_ms, null()) };
    let is_signal = count < 0 && Error::last_os_error().kind() == ErrorKind::Interrupted;
    if is_signal { 0 } else { count }
}
