//! How late this machine is: threads that sleep for a millisecond again and again, and see when they wake.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// As many as there are processors that may stand still alone.
const THREADS: usize = 2;
const SLEEP: Duration = Duration::from_millis(1);

pub struct Lateness {
    is_over: Arc<AtomicBool>,
    threads: [JoinHandle<Duration>; THREADS],
}

impl Lateness {
    pub fn watch() -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let threads = std::array::from_fn(|_| {
            let is_over = is_over.clone();
            std::thread::spawn(move || {
                let mut worst = Duration::ZERO;
                while !is_over.load(Ordering::Relaxed) {
                    let begun = Instant::now();
                    std::thread::sleep(SLEEP);
                    worst = worst.max(begun.elapsed().saturating_sub(SLEEP));
                }
                worst
            })
        });
        Self { is_over, threads }
    }

    /// The longest that one of them overslept.
    pub fn end(self) -> Duration {
        self.is_over.store(true, Ordering::Relaxed);
        self.threads.into_iter().map(|thread| thread.join().unwrap()).max().unwrap()
    }
}
