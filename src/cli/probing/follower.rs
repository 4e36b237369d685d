//! Consumer of arm states beside the arm's loop: on its own thread during motion, so that neither a
//! disk nor the reconstruction ever delays a command.

use std::cell::OnceCell;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::Builder;

use touchup_probing::arm::ArmState;

/// Capacity of the state queue: 16 s of an arm at 500 Hz.
pub(super) const QUEUE: usize = 8192;

/// Consumer of each state of an arm, in order.
pub(super) trait TakeStates: Send + 'static {
    /// Whether the consumer continues; `false`: it has failed, and the arm has to stop.
    fn take_state(&mut self, state: &ArmState) -> bool;
}

/// Asynchronous queue of states to a [`TakeStates`]; access to the consumer waits until the queue
/// is empty.
pub(super) struct Follower<F> {
    /// Consumer, unless the thread has it.
    here: OnceCell<Box<F>>,
    events: SyncSender<Event<F>>,
    /// Waits instead of failing if the queue is full: for an arm with a waiting clock.
    is_patient: bool,
    has_failed: Arc<AtomicBool>,
    is_behind: bool,
}

#[expect(
    clippy::large_enum_variant,
    reason = "nearly all are states: a box for each would ask the allocator in the loop of the arm"
)]
enum Event<F> {
    Begin(Box<F>),
    State(ArmState),
    Return(SyncSender<Box<F>>),
}

impl<F: TakeStates> Follower<F> {
    /// - `is_patient`: whether [`Self::on_state`] waits if the queue is full.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub fn new(follows: F, is_patient: bool) -> io::Result<Self> {
        let (events, received) = sync_channel(QUEUE);
        let has_failed = Arc::new(AtomicBool::new(false));
        let failure = Arc::clone(&has_failed);
        Builder::new()
            .name("follow arm".to_owned())
            .spawn(move || follow(&received, &failure))?;
        Ok(Self {
            here: OnceCell::from(Box::new(follows)),
            events,
            is_patient,
            has_failed,
            is_behind: false,
        })
    }

    /// Queues a state.
    pub fn on_state(&mut self, state: &ArmState) {
        if let Some(follows) = self.here.take() {
            // the queue is empty then
            let _ = self.events.send(Event::Begin(follows));
        }
        let state = Event::State(*state);
        if self.is_patient {
            let _ = self.events.send(state);
        } else if let Err(TrySendError::Full(_)) = self.events.try_send(state) {
            self.is_behind = true;
        }
    }

    /// Whether the arm has to stop: the consumer has failed, or a full queue lost a state.
    pub fn has_failed(&self) -> bool {
        self.is_behind || self.has_failed.load(Ordering::Acquire)
    }

    /// Whether a full queue lost a state.
    pub fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// Consumer after all queued states; waits for them. For calls while the arm stands.
    pub fn get(&self) -> &F {
        self.here.get_or_init(|| self.returned())
    }

    /// As [`Self::get`].
    pub fn get_mut(&mut self) -> &mut F {
        let follows = self.here.take().unwrap_or_else(|| self.returned());
        self.here = OnceCell::from(follows);
        self.here.get_mut().expect("it was put there")
    }

    /// As [`Self::get`]; its thread ends.
    pub fn into_inner(mut self) -> F {
        *self.here.take().unwrap_or_else(|| self.returned())
    }

    fn returned(&self) -> Box<F> {
        let (to, back) = sync_channel(1);
        let _ = self.events.send(Event::Return(to));
        back.recv()
            .expect("the thread has it, and lives as long as the queue")
    }
}

/// Consumes events until all senders are gone.
fn follow<F: TakeStates>(events: &Receiver<Event<F>>, has_failed: &AtomicBool) {
    let mut with = None;
    for event in events {
        match (event, &mut with) {
            (Event::Begin(follows), _) => with = Some(follows),
            (Event::State(state), Some(follows)) => {
                if !follows.take_state(&state) {
                    has_failed.store(true, Ordering::Release);
                }
            }
            (Event::State(_), None) => {}
            (Event::Return(to), _) => {
                if let Some(follows) = with.take() {
                    // the requester waits for it
                    let _ = to.send(follows);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use touchup_method::stylus::Wrench;
    use touchup_probing::arm::Safety;

    /// Consumer that takes a state per permit.
    struct Permitted {
        permits: Receiver<bool>,
        taken: Vec<i64>,
    }

    impl TakeStates for Permitted {
        fn take_state(&mut self, state: &ArmState) -> bool {
            let goes_on = self.permits.recv().unwrap();
            self.taken.push(state.stamp_ns);
            goes_on
        }
    }

    fn state(stamp_ns: i64) -> ArmState {
        let nothing = Wrench {
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
        };
        ArmState {
            stamp_ns,
            pose_bt: Isometry3::identity(),
            wrench_b: nothing,
            raw_wrench_f: nothing,
            joints: [0.0; 6].into(),
            safety: Safety::Normal,
        }
    }

    #[test]
    fn states_are_passed_on_while_nothing_is_taken_and_all_are_there_once_asked_for() {
        let (permit, permits) = channel();
        let mut follower = Follower::new(
            Permitted {
                permits,
                taken: Vec::new(),
            },
            false,
        )
        .unwrap();
        for round in 0..3 {
            // a hanging disk delays nobody
            (0..100).for_each(|at| follower.on_state(&state(round * 100 + at)));
            (0..100).for_each(|_| permit.send(true).unwrap());
            assert_eq!(follower.get().taken.len() as i64, (round + 1) * 100);
            follower.get_mut().taken.push(-1);
            assert_eq!(follower.get_mut().taken.pop(), Some(-1));
        }
        assert!(!follower.has_failed());
        assert_eq!(follower.into_inner().taken, (0..300).collect::<Vec<_>>());
    }

    #[test]
    fn a_full_queue_and_a_failure_have_the_arm_stop() {
        let (permit, permits) = channel();
        let mut follower = Follower::new(
            Permitted {
                permits,
                taken: Vec::new(),
            },
            false,
        )
        .unwrap();
        // the thread holds one state, the queue its capacity, perhaps with the first event
        let mut sent = 0;
        while !follower.has_failed() {
            follower.on_state(&state(sent));
            sent += 1;
        }
        assert!(
            follower.is_behind() && (QUEUE as i64..QUEUE as i64 + 3).contains(&sent),
            "{sent}"
        );
        (0..sent).for_each(|_| permit.send(true).unwrap());
        // all but the last, lost to the full queue
        assert_eq!(
            follower.into_inner().taken,
            (0..sent - 1).collect::<Vec<_>>()
        );

        let (permit, permits) = channel();
        let mut follower = Follower::new(
            Permitted {
                permits,
                taken: Vec::new(),
            },
            true,
        )
        .unwrap();
        permit.send(false).unwrap();
        follower.on_state(&state(1));
        assert_eq!(follower.get().taken, [1]);
        assert!(follower.has_failed() && !follower.is_behind());
    }
}
