//! Bytes that a thread has allocated and not freed, in the tests of this crate.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static LIVE: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator with a count.
struct LiveBytes;

fn note(bytes: isize) {
    // an ending thread counts no more
    let _ = LIVE.try_with(|live| live.set(live.get() + bytes));
}

// SAFETY: forwards every call to the system's allocator unchanged
unsafe impl GlobalAlloc for LiveBytes {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        note(-(layout.size() as isize));
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static LIVE_BYTES: LiveBytes = LiveBytes;

/// Live bytes of this thread.
pub fn live_bytes() -> isize {
    LIVE.get()
}

#[test]
fn what_is_kept_counts_and_what_is_dropped_does_not() {
    let before = live_bytes();
    let kept = vec![0_u8; 10_000];
    drop(vec![0_u8; 20_000]);
    assert_eq!(live_bytes() - before, 10_000);
    drop(kept);
    assert_eq!(live_bytes(), before);
}
