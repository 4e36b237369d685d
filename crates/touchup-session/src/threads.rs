//! The threads of the process as workers: the rooms that are pure have none of their own.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, available_parallelism, scope};

use touchup_core::mesh::{Job, Workers};

/// As many as the machine runs at the same time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Threads;

impl Workers for Threads {
    fn count(&self) -> usize {
        available_parallelism().map_or(1, usize::from)
    }

    fn run(&self, jobs: Vec<Job<'_>>) {
        let helpers = self.count().min(jobs.len()).saturating_sub(1);
        let left = Mutex::new(VecDeque::from(jobs));
        let next = || {
            left.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .pop_front()
        };
        let work = || {
            while let Some(job) = next() {
                job();
            }
        };
        scope(|threads| {
            for _ in 0..helpers {
                // a thread that cannot be had leaves its share to the others
                let _ = Builder::new().spawn_scoped(threads, work);
            }
            work();
        });
    }
}
