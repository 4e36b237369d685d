//! Work on each of many points.

use std::num::NonZero;
use std::thread;

/// Points of a thread at least.
const LEAST_PIECE: usize = 4_000;

/// What `each` makes of 0 to `count` − 1, in this order.
pub(super) fn map<T: Send>(count: usize, each: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(count / LEAST_PIECE).max(1);
    let size = count.div_ceil(threads).max(1);
    let each = &each;
    thread::scope(|scope| {
        let pieces = (0..count).step_by(size).map(|first| first..(first + size).min(count));
        let running: Vec<_> = pieces.map(|piece| scope.spawn(move || piece.map(each).collect::<Vec<T>>())).collect();
        let done = running.into_iter().flat_map(|thread| match thread.join() {
            Ok(part) => part,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        done.collect()
    })
}
