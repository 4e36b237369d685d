//! Allocator requests of the tests of this program: counts as in `touchup report`, and the largest
//! request of each thread.

use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;

use touchup_report::allocations::CountingAllocator;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

/// The counting allocator, which also remembers the largest request.
struct Metered;

fn note(bytes: usize) {
    // a thread that ends has no meter any more
    let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(bytes)));
}

// SAFETY: forwards every call to the counting allocator unchanged
unsafe impl GlobalAlloc for Metered {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        unsafe { CountingAllocator.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        unsafe { CountingAllocator.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { CountingAllocator.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        unsafe { CountingAllocator.realloc(at, layout, size) }
    }
}

#[global_allocator]
static METERED: Metered = Metered;

/// Result of `f`, and the largest request of this thread during it, bytes.
pub fn largest_request<T>(f: impl FnOnce() -> T) -> (T, usize) {
    LARGEST.set(0);
    let result = f();
    (result, LARGEST.get())
}
