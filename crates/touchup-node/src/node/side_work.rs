//! Threads of the node, and side threads that write sessions and files: counted, and all joined.

use std::io;
use std::thread::{Builder, JoinHandle};

use crate::ros::exchange::join;
use touchup_session::clock::Clock;
use touchup_session::threads::give_way;

/// Starts a thread that waits on `clock`.
///
/// # Errors
/// Of the operating system, if no thread is available.
pub fn begin<T: Send + 'static>(
    clock: &Clock,
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> io::Result<JoinHandle<T>> {
    let working = clock.begin_work();
    let work = move || {
        let ended = run();
        drop(working);
        ended
    };
    Builder::new().name(name.to_owned()).spawn(work)
}

/// Starts a thread that gives way to the sample thread.
///
/// # Errors
/// As there.
pub fn begin_behind<T: Send + 'static>(
    clock: &Clock,
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> io::Result<JoinHandle<T>> {
    begin(clock, name, || {
        give_way();
        run()
    })
}

/// Side threads at work.
#[derive(Debug)]
pub struct SideWork {
    clock: Clock,
    threads: Vec<JoinHandle<()>>,
}

impl SideWork {
    /// No threads yet. All waits use `clock`.
    pub fn on(clock: Clock) -> Self {
        Self {
            clock,
            threads: Vec::new(),
        }
    }

    /// Number of running threads.
    pub fn count(&mut self) -> usize {
        self.threads.retain(|thread| !thread.is_finished());
        self.threads.len()
    }

    /// Starts a thread.
    ///
    /// # Errors
    /// Of the operating system, if no thread is available.
    pub fn begin(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        // a thread that has ended keeps its stack until its handle goes
        self.count();
        self.threads.push(begin_behind(&self.clock, name, work)?);
        Ok(())
    }

    /// Waits for all threads.
    pub fn finish(self) {
        join(self.threads);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc::channel;
    use std::sync::{Arc, mpsc};
    use std::time::{Duration, Instant};

    use super::SideWork;
    use touchup_session::clock::Clock;

    #[test]
    fn what_has_ended_is_not_counted_and_the_rest_is_waited_for() {
        let (mut work, done) = (SideWork::on(Clock::system()), Arc::new(AtomicUsize::new(0)));
        let begin = |work: &mut SideWork, gate: mpsc::Receiver<()>| {
            let done = Arc::clone(&done);
            let until_open = move || {
                let _ = gate.recv();
                done.fetch_add(1, Ordering::SeqCst);
            };
            work.begin("test", until_open).unwrap();
        };
        let (gates, held): (Vec<_>, Vec<_>) = (0..4).map(|_| channel()).unzip();
        held.into_iter().for_each(|gate| begin(&mut work, gate));
        assert_eq!(work.count(), 4);
        let mut gates = gates.into_iter();
        drop(gates.next());
        let deadline = Instant::now() + Duration::from_secs(60);
        while work.count() == 4 {
            assert!(Instant::now() < deadline, "the one that ended is counted");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!((work.count(), done.load(Ordering::SeqCst)), (3, 1));
        drop(gates);
        work.finish();
        assert_eq!(done.load(Ordering::SeqCst), 4);
    }
}
