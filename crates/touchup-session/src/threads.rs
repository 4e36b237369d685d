//! Worker threads for the crates that have none of their own, and their priority.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, available_parallelism, scope};

use touchup_geometry::mesh::{Task, Workers};

/// Priority steps below the ordinary threads (setpriority(2)): with a third of their share the work
/// still finishes on a busy machine.
const STEPS_BEHIND: i32 = 5;

/// Lowers the priority of this thread, and of threads that it starts later, below the ordinary
/// threads of the process: samples come first, further work uses the remaining time. Needs no
/// privilege. If the system has no priority per thread, or refuses it, the priority stays ordinary.
pub fn give_way() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{getpriority_process, setpriority_process};
        let this = Some(rustix::thread::gettid());
        let _ = getpriority_process(this)
            .and_then(|priority| setpriority_process(this, priority + STEPS_BEHIND));
    }
}

/// As many threads as the machine runs at the same time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Threads;

impl Workers for Threads {
    fn count(&self) -> usize {
        available_parallelism().map_or(1, usize::from)
    }

    fn run(&self, jobs: Vec<Task<'_>>) {
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
                // without this thread the others do its share
                let _ = Builder::new().spawn_scoped(threads, work);
            }
            work();
        });
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// The priority of this thread: 19th field of proc(5) `stat`.
    fn niceness() -> i32 {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        // the second field is a name in parentheses, possibly with blanks
        let (_, fields) = stat.rsplit_once(')').unwrap();
        fields
            .split_whitespace()
            .nth(19 - 3)
            .unwrap()
            .parse()
            .unwrap()
    }

    #[test]
    fn a_thread_that_gives_way_takes_along_those_that_it_begins_and_no_other() {
        let before = niceness();
        let behind = std::thread::spawn(|| {
            give_way();
            (niceness(), std::thread::spawn(niceness).join().unwrap())
        });
        // 19 is the last step
        let expected = (before + 5).min(19);
        assert_eq!(behind.join().unwrap(), (expected, expected));
        assert_eq!(niceness(), before, "this one goes on as before");
    }
}
