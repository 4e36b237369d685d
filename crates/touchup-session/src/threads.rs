//! The threads of the process as workers, as the rooms that are pure have none of their own; and which of them give way.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, available_parallelism, scope};

use touchup_core::mesh::{Job, Workers};

/// Steps by which a thread gives way to others (setpriority(2)): with a third of their share its
/// work still comes to an end if the machine is busy.
const STEPS_BEHIND: i32 = 5;

/// Has this thread, and those that it begins from now on, give way to the ordinary threads of the
/// process: a sample is answered first, and what follows from it has the time that is left. Needs
/// no privilege. If the system has no priority for a single thread, or refuses it, the work is
/// done at the ordinary one.
pub fn give_way() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{getpriority_process, setpriority_process};
        let this = Some(rustix::thread::gettid());
        let _ = getpriority_process(this)
            .and_then(|priority| setpriority_process(this, priority + STEPS_BEHIND));
    }
}

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

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// The priority of this thread as proc(5) has it in the 19th field.
    fn niceness() -> i32 {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        // the second field is a name in parentheses, which may have blanks
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
