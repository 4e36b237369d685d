//! Steady time of this machine, or of a test that advances it.
//!
//! All deadlines come from a [`Clock`]. With [`Clock::manual`] time stands still until
//! [`ManualClock::advance`], so the test decides when a deadline passes, however busy the machine
//! is. Time waits for threads registered by [`Clock::begin_work`]: it passes only while all of them
//! wait, so a slow thread is never late.
//! them wait, so none of them is late, however slow it is.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Locks a mutex even after a panic of its holder; only for values that stay valid then.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Interval at which a wait on a manual clock checks its channel or condition again. No result
/// depends on it.
const LOOK: Duration = Duration::from_micros(500);
/// Limit for a thread to wait again; beyond it the thread hangs and the test fails. No result
/// depends on it.
const HUNG: Duration = Duration::from_secs(120);

/// Source of time. Clones show the same time.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// `None`: the steady clock of this machine
    manual: Option<Arc<ManualTime>>,
}

/// The control of a [`Clock::manual`].
#[derive(Debug)]
pub struct ManualClock(Arc<ManualTime>);

#[derive(Debug)]
struct ManualTime {
    begun: Instant,
    is_lock_step: bool,
    waits: Mutex<Waits>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waits {
    elapsed: Duration,
    next: u64,
    /// deadlines of the running waits, since `begun`
    deadlines: BTreeMap<u64, Duration>,
    /// number of threads and tasks that time waits for until they wait themselves
    workers: usize,
}

/// Stops the time of a manual clock until dropped, or until its holder waits on that clock.
#[derive(Debug)]
pub struct WorkGuard(Option<Arc<ManualTime>>);

impl Clock {
    /// The steady clock of this machine.
    pub fn system() -> Self {
        Self::default()
    }

    /// A clock that stands still until [`ManualClock::advance`].
    pub fn manual() -> (Self, ManualClock) {
        Self::moved_by_hand(false)
    }

    /// A clock that also advances by each sleep of a thread, so a simulated device runs as fast as
    /// the other threads keep up. Only one thread may sleep.
    pub fn lock_step() -> (Self, ManualClock) {
        Self::moved_by_hand(true)
    }

    fn moved_by_hand(is_lock_step: bool) -> (Self, ManualClock) {
        let (waits, changed) = (Mutex::default(), Condvar::new());
        let manual = Arc::new(ManualTime {
            begun: Instant::now(),
            is_lock_step,
            waits,
            changed,
        });
        (
            Self {
                manual: Some(manual.clone()),
            },
            ManualClock(manual),
        )
    }

    /// Registers a thread or task that time waits for. A thread that waits on the clock needs one.
    pub fn begin_work(&self) -> WorkGuard {
        if let Some(manual) = &self.manual {
            manual.waits().workers += 1;
        }
        WorkGuard(self.manual.clone())
    }

    /// Whether a test advances it.
    pub fn is_manual(&self) -> bool {
        self.manual.is_some()
    }

    /// Now.
    pub fn now(&self) -> Instant {
        self.manual
            .as_ref()
            .map_or_else(Instant::now, |manual| manual.begun + manual.waits().elapsed)
    }

    /// Time since `then`; zero if `then` is in the future.
    pub fn since(&self, then: Instant) -> Duration {
        self.now().saturating_duration_since(then)
    }

    /// Returns after `duration`.
    pub fn sleep(&self, duration: Duration) {
        let Some(manual) = &self.manual else {
            return thread::sleep(duration);
        };
        let wait = manual.begin(duration);
        if manual.is_lock_step {
            return manual.move_to(wait.deadline, wait.number);
        }
        let waits = manual.waits();
        drop(
            manual
                .changed
                .wait_while(waits, |waits| waits.elapsed < wait.deadline),
        );
    }

    /// Receives like [`Receiver::recv_timeout`], including every message sent before the deadline.
    ///
    /// # Errors
    /// Those of [`Receiver::recv_timeout`].
    pub fn recv_timeout<T>(
        &self,
        receiver: &Receiver<T>,
        timeout: Duration,
    ) -> Result<T, RecvTimeoutError> {
        let Some(manual) = &self.manual else {
            return receiver.recv_timeout(timeout);
        };
        let wait = manual.begin(timeout);
        loop {
            let is_over = manual.waits().elapsed >= wait.deadline;
            let patience = if is_over { Duration::ZERO } else { LOOK };
            match receiver.recv_timeout(patience) {
                Err(RecvTimeoutError::Timeout) if !is_over => {}
                ended => return ended,
            }
        }
    }

    /// Waits like [`Condvar::wait_timeout_while`], but does not return whether time ran out: the
    /// caller checks the value.
    pub fn wait_while<'a, T>(
        &self,
        condvar: &Condvar,
        guard: MutexGuard<'a, T>,
        timeout: Duration,
        mut condition: impl FnMut(&mut T) -> bool,
    ) -> MutexGuard<'a, T> {
        let Some(manual) = &self.manual else {
            return condvar
                .wait_timeout_while(guard, timeout, condition)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        };
        let wait = manual.begin(timeout);
        let mut guard = guard;
        loop {
            let is_over = manual.waits().elapsed >= wait.deadline;
            if !condition(&mut guard) || is_over {
                return guard;
            }
            guard = condvar
                .wait_timeout(guard, LOOK)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}

impl ManualClock {
    /// Advances time once all workers wait; returns when every earlier wait with a passed deadline
    /// has ended and all workers wait again.
    ///
    /// # Panics
    /// If a thread hangs.
    pub fn advance(&self, by: Duration) {
        let to = self.0.waits().elapsed.saturating_add(by);
        self.0.move_to(to, u64::MAX);
        drop(self.0.wait_until_idle(self.0.waits()));
    }

    /// Running waits.
    pub fn waiting(&self) -> usize {
        self.0.waits().deadlines.len()
    }

    /// Total number of waits begun; a new wait has read the time of its begin.
    pub fn begun(&self) -> u64 {
        self.0.waits().next
    }
}

/// A running wait; over when dropped.
struct Wait<'a> {
    manual: &'a ManualTime,
    number: u64,
    deadline: Duration,
}

impl ManualTime {
    fn waits(&self) -> MutexGuard<'_, Waits> {
        locked(&self.waits)
    }

    /// Waits until all workers wait.
    fn wait_until_idle<'a>(&'a self, waits: MutexGuard<'a, Waits>) -> MutexGuard<'a, Waits> {
        self.wait_while(waits, |waits| waits.deadlines.len() < waits.workers)
    }

    fn wait_while<'a>(
        &'a self,
        waits: MutexGuard<'a, Waits>,
        holds: impl Fn(&Waits) -> bool,
    ) -> MutexGuard<'a, Waits> {
        let waited = self
            .changed
            .wait_timeout_while(waits, HUNG, |waits| holds(waits));
        let (waits, _) = waited.unwrap_or_else(PoisonError::into_inner);
        assert!(
            !holds(&waits),
            "{} wait of {} that work: one hangs",
            waits.deadlines.len(),
            waits.workers
        );
        waits
    }

    /// Advances time and waits for the threads that wake, except for the wait `own`.
    fn move_to(&self, to: Duration, own: u64) {
        let mut waits = self.wait_until_idle(self.waits());
        waits.elapsed = waits.elapsed.max(to);
        self.changed.notify_all();
        let is_overdue = |waits: &Waits| {
            waits
                .deadlines
                .iter()
                .any(|(number, deadline)| *number != own && *deadline <= waits.elapsed)
        };
        drop(self.wait_while(waits, is_overdue));
    }

    fn begin(&self, timeout: Duration) -> Wait<'_> {
        let mut waits = self.waits();
        let (number, deadline) = (waits.next, waits.elapsed.saturating_add(timeout));
        waits.next += 1;
        waits.deadlines.insert(number, deadline);
        self.changed.notify_all();
        Wait {
            manual: self,
            number,
            deadline,
        }
    }
}

impl Drop for Wait<'_> {
    fn drop(&mut self) {
        self.manual.waits().deadlines.remove(&self.number);
        self.manual.changed.notify_all();
    }
}

impl Drop for WorkGuard {
    fn drop(&mut self) {
        if let Some(manual) = &self.0 {
            manual.waits().workers -= 1;
            manual.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_manual_clock_shows_what_it_was_moved_by() {
        let (clock, hand) = Clock::manual();
        let begun = clock.now();
        assert_eq!(clock.since(begun), Duration::ZERO);
        hand.advance(3 * SECOND);
        assert_eq!(
            (clock.since(begun), clock.clone().since(begun)),
            (3 * SECOND, 3 * SECOND)
        );
    }

    #[test]
    fn a_wait_ends_when_its_deadline_has_passed_and_not_before() {
        let (clock, hand) = Clock::manual();
        let (ended, ends) = channel();
        thread::scope(|scope| {
            scope.spawn(|| {
                clock.sleep(2 * SECOND);
                ended.send(clock.now()).unwrap();
            });
            while hand.waiting() == 0 {
                thread::yield_now();
            }
            hand.advance(SECOND);
            assert_eq!(hand.waiting(), 1);
            assert!(ends.try_recv().is_err());
            hand.advance(SECOND);
            assert_eq!(hand.waiting(), 0);
            assert_eq!(ends.recv().unwrap(), clock.now());
        });
    }

    #[test]
    fn what_was_sent_in_time_is_received_and_what_was_not_is_a_timeout() {
        let (clock, hand) = Clock::manual();
        let (sender, receiver) = channel();
        sender.send(7).unwrap();
        assert_eq!(clock.recv_timeout(&receiver, Duration::ZERO), Ok(7));
        let (timeout, receiver) = thread::scope(|scope| {
            let clock = clock.clone();
            let waiting = scope.spawn(move || (clock.recv_timeout(&receiver, SECOND), receiver));
            while hand.waiting() == 0 {
                thread::yield_now();
            }
            hand.advance(SECOND);
            waiting.join().unwrap()
        });
        assert_eq!(timeout, Err(RecvTimeoutError::Timeout));
        drop(sender);
        assert_eq!(
            clock.recv_timeout(&receiver, SECOND),
            Err(RecvTimeoutError::Disconnected)
        );
    }

    #[test]
    fn a_condition_ends_a_wait_before_its_deadline() {
        let (clock, _hand) = Clock::manual();
        let (value, changed) = (Mutex::new(0), Condvar::new());
        thread::scope(|scope| {
            let waiting = scope.spawn(|| {
                *clock.wait_while(&changed, value.lock().unwrap(), SECOND, |value| *value == 0)
            });
            *value.lock().unwrap() = 5;
            changed.notify_all();
            assert_eq!(waiting.join().unwrap(), 5);
        });
    }

    /// A working thread is never late, however slow: both loops run in the same order every time.
    #[test]
    fn time_waits_for_workers_and_passes_while_they_wait() {
        let (clock, hand) = Clock::manual();
        let (sender, receiver) = channel::<Duration>();
        let begun = clock.now();
        let work = clock.begin_work();
        let thread = thread::spawn({
            let clock = clock.clone();
            move || {
                let _work = work;
                for _ in 0..3 {
                    clock.sleep(SECOND);
                    // time is stopped, so the sleep takes none
                    thread::sleep(Duration::from_millis(20));
                    sender.send(clock.since(begun)).unwrap();
                }
            }
        });
        (0..3).for_each(|_| hand.advance(SECOND));
        thread.join().unwrap();
        assert_eq!(
            receiver.try_iter().collect::<Vec<_>>(),
            [SECOND, 2 * SECOND, 3 * SECOND]
        );
        // no thread is left to wait for
        hand.advance(SECOND);
    }

    #[test]
    fn a_sleeper_moves_a_clock_in_lock_step_past_the_deadlines_of_others() {
        let (clock, _hand) = Clock::lock_step();
        let begun = clock.now();
        let work = [clock.begin_work(), clock.begin_work()];
        let ticks = thread::scope(|scope| {
            let [sleeps, ticks] = work;
            let (over, is_over) = channel::<()>();
            let clock = &clock;
            let ticking = scope.spawn(move || {
                let _work = ticks;
                let mut ticks = Vec::new();
                while clock.recv_timeout(&is_over, 3 * SECOND) == Err(RecvTimeoutError::Timeout) {
                    ticks.push(clock.since(begun).as_secs());
                }
                ticks
            });
            scope.spawn(move || {
                let _work = sleeps;
                (0..10).for_each(|_| clock.sleep(SECOND));
                drop(over);
            });
            ticking.join().unwrap()
        });
        assert_eq!((ticks, clock.since(begun)), (vec![3, 6, 9], 10 * SECOND));
    }
}
