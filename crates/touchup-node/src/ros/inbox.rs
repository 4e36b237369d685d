//! Arrivals in order, on their way from the port to the sample thread.
//!
//! Two kinds wait here, each with room of its own: samples and transforms, lost and counted without
//! room; and calls and parameter changes, refused without room but never lost. All come out in
//! order of arrival, so a mesh is saved, or a stroke undone, after the samples before the call.
//! Stops of the arm do not wait here at all: they act in [`StopState`], on the delivering thread.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::ros::locked;
use crate::ros::messages::ProbeResult;
use crate::ros::port::{ArmOrder, Arrival, Call, Endpoint};
use crate::ros::stop::{ALLOW_MOTION, StopState};
use touchup_session::clock::Clock;

/// Maximum number of waiting calls and parameter changes.
const MOST_CALLS: usize = 256;
/// Refusal of a call without room.
const FULL: &str =
    "too many calls wait for the node: nothing was done; call again when they are answered";
/// Refusal of a call that comes too late.
const ENDED: &str = "the node ends: nothing was done";

/// Numbers of waiting arrivals, and whether the receiver is gone.
#[derive(Debug, Default)]
struct InboxCounts {
    /// numbers of samples and of calls
    counts: [usize; 2],
    /// the receiver is gone
    is_closed: bool,
}

#[derive(Debug)]
struct InboxState {
    /// for samples, for calls
    room: [usize; 2],
    waiting: Mutex<InboxCounts>,
    /// signals a removal
    taken: Condvar,
    /// of wrenches and poses, of others
    dropped: [AtomicU64; 2],
    is_over: AtomicBool,
    stops: Arc<StopState>,
}

/// Sender of arrivals. Clones lead to the same node.
#[derive(Clone, Debug)]
pub struct Inbox {
    to: Sender<Arrival>,
    shared: Arc<InboxState>,
}

/// Receiver of arrivals. On drop it refuses all waiting and later calls.
#[derive(Debug)]
pub struct Arrivals {
    from: Receiver<Arrival>,
    shared: Arc<InboxState>,
}

/// A sender and its receiver.
///
/// - `samples`: maximum number of waiting samples
/// - `clock`: of the node
pub fn inbox(samples: usize, clock: &Clock) -> (Inbox, Arrivals) {
    let (to, from) = channel();
    let shared = Arc::new(InboxState {
        room: [samples, MOST_CALLS],
        waiting: Mutex::default(),
        taken: Condvar::new(),
        dropped: Default::default(),
        is_over: AtomicBool::new(false),
        stops: Arc::new(StopState::new(clock.clone())),
    });
    (
        Inbox {
            to,
            shared: Arc::clone(&shared),
        },
        Arrivals { from, shared },
    )
}

/// Kind of room that it occupies; `None`: always finds room.
fn kind_of(arrival: &Arrival) -> Option<usize> {
    match arrival {
        Arrival::Shutdown => None,
        Arrival::Call(_) | Arrival::SetParameter(..) | Arrival::Replay(..) => Some(1),
        _ => Some(0),
    }
}

impl Inbox {
    /// Puts an arrival in; without room refuses or counts it; never waits. Returns whether it got
    /// in, or took effect at once.
    pub fn put(&self, arrival: Arrival) -> bool {
        self.put_in(arrival, |_, waiting, _| waiting)
    }

    /// Puts in a call of a service or the action.
    pub fn call(&self, call: Call) {
        self.put(Arrival::Call(call));
    }

    /// As [`Self::put`], but waits for room. Returns whether the node still receives.
    pub fn put_patiently(&self, arrival: Arrival) -> bool {
        self.put_in(arrival, |shared, waiting, kind| {
            let is_full = |waiting: &mut InboxCounts| {
                !waiting.is_closed && waiting.counts[kind] >= shared.room[kind]
            };
            shared
                .taken
                .wait_while(waiting, is_full)
                .unwrap_or_else(PoisonError::into_inner)
        })
    }

    fn put_in<'a>(
        &'a self,
        arrival: Arrival,
        wait: impl FnOnce(
            &'a InboxState,
            MutexGuard<'a, InboxCounts>,
            usize,
        ) -> MutexGuard<'a, InboxCounts>,
    ) -> bool {
        let Some(arrival) = self.stop(arrival) else {
            return true;
        };
        let (shared, kind) = (&*self.shared, kind_of(&arrival));
        let mut waiting = locked(&shared.waiting);
        if let Some(kind) = kind {
            waiting = wait(shared, waiting, kind);
        }
        let is_full = kind.is_some_and(|kind| waiting.counts[kind] >= shared.room[kind]);
        if !waiting.is_closed && !is_full {
            kind.into_iter().for_each(|kind| waiting.counts[kind] += 1);
            // the receiver exists
            let _ = self.to.send(arrival);
            return true;
        }
        let is_closed = waiting.is_closed;
        // a caller with an answer may call again
        drop(waiting);
        if is_closed {
            arrival.refuse(ProbeResult::SHUTDOWN, ENDED);
        } else if kind == Some(0) {
            let which = usize::from(!matches!(arrival, Arrival::Message(..)));
            shared.dropped[which].fetch_add(1, Ordering::Relaxed);
        } else {
            arrival.refuse(ProbeResult::ARM_NOT_READY, FULL);
        }
        false
    }

    /// Applies stops of the arm at once, on the receiving thread; returns the rest for the node.
    fn stop(&self, arrival: Arrival) -> Option<Arrival> {
        let stops = self.stops();
        match arrival {
            Arrival::SetParameter(name, value, reply) if name == ALLOW_MOTION => {
                reply.send(stops.allow(&value).map_err(|why| why.to_string()));
                return None;
            }
            Arrival::Call(Call::Arm(ArmOrder::Recover(_))) => stops.ask_recovery(),
            Arrival::Shutdown => drop(stops.interrupt()),
            _ => {}
        }
        Some(arrival)
    }

    /// Stop state of the arm and the samples.
    pub fn stops(&self) -> &StopState {
        &self.shared.stops
    }

    /// Reports the other participants on a topic: to the log, and to the node for its diagnostics.
    ///
    /// - `mismatch`: why one of them does not fit.
    pub fn report(&self, topic: String, count: usize, mismatch: Option<String>) {
        match &mismatch {
            Some(reason) => tracing::warn!(topic, "{reason}"),
            None => tracing::info!(topic, others = count, "who is on a topic has changed"),
        }
        self.put(Arrival::Matched(Endpoint {
            topic,
            count,
            mismatch,
        }));
    }

    /// As [`crate::ros::port::Port::dropped`].
    pub fn dropped(&self) -> [u64; 2] {
        self.shared
            .dropped
            .each_ref()
            .map(|count| count.load(Ordering::Relaxed))
    }

    /// Marks the port as leaving: no further arrivals.
    pub fn end(&self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
    }

    /// Whether the port leaves.
    pub fn is_over(&self) -> bool {
        self.shared.is_over.load(Ordering::Relaxed)
    }
}

impl Arrivals {
    /// The next arrival. `None` after the end of all senders.
    pub fn recv(&self) -> Option<Arrival> {
        self.from
            .recv()
            .ok()
            .inspect(|arrival| self.note_taken(arrival))
    }

    /// The next arrival if one waits.
    ///
    /// # Errors
    /// As [`Receiver::try_recv`].
    pub fn try_recv(&self) -> Result<Arrival, TryRecvError> {
        self.from
            .try_recv()
            .inspect(|arrival| self.note_taken(arrival))
    }

    /// The next arrival within a timeout.
    ///
    /// # Errors
    /// As [`Receiver::recv_timeout`].
    pub fn recv_timeout(
        &self,
        clock: &Clock,
        timeout: Duration,
    ) -> Result<Arrival, RecvTimeoutError> {
        clock
            .recv_timeout(&self.from, timeout)
            .inspect(|arrival| self.note_taken(arrival))
    }

    /// Stop state of the arm and the samples.
    pub fn stops(&self) -> &Arc<StopState> {
        &self.shared.stops
    }

    fn note_taken(&self, arrival: &Arrival) {
        if let Some(kind) = kind_of(arrival) {
            locked(&self.shared.waiting).counts[kind] -= 1;
            self.shared.taken.notify_all();
        }
    }
}

impl Drop for Arrivals {
    fn drop(&mut self) {
        // no arrivals after this
        locked(&self.shared.waiting).is_closed = true;
        self.shared.taken.notify_all();
        self.from
            .try_iter()
            .for_each(|arrival| arrival.refuse(ProbeResult::SHUTDOWN, ENDED));
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use nalgebra::Isometry3;
    use touchup_io::recording::LiveMessage;
    use touchup_method::stylus::{Message, StampedPose};

    use super::*;
    use crate::ros::messages::{ProbeFeatureRequest, ProbeGoal, TFMessage, TriggerResponse};
    use crate::ros::parameters::ParameterValue;
    use crate::ros::port::{Feedback, Goal, Reply};

    fn pose() -> Arrival {
        let (stamp_ns, pose_ot) = (0, Isometry3::identity());
        let message = LiveMessage {
            frame: String::new(),
            message: Message::Pose(StampedPose { stamp_ns, pose_ot }),
        };
        Arrival::Message(message, Instant::now())
    }

    /// A reply, and the receiver of its answer.
    fn reply<T: Send + 'static>() -> (Reply<T>, Receiver<T>) {
        let (to, answer) = channel();
        (Reply::new(move |said| drop(to.send(said))), answer)
    }

    #[test]
    fn samples_that_find_no_room_are_counted_and_calls_have_room_of_their_own_in_the_order_of_all()
    {
        let (inbox, arrivals) = inbox(1, &Clock::system());
        assert!(inbox.put(pose()) && !inbox.put(pose()) && !inbox.put(pose()));
        assert!(!inbox.put(Arrival::Tf(TFMessage::default())));
        assert_eq!(inbox.dropped(), [2, 1]);
        assert!(inbox.put(Arrival::Call(Call::Reset(reply().0))));
        assert!(inbox.put(Arrival::SetParameter(
            "stale_ms".to_owned(),
            ParameterValue::Double(7.0),
            reply().0
        )));
        assert!(matches!(arrivals.recv(), Some(Arrival::Message(..))));
        assert!(inbox.put(pose()), "there is room again");
        assert!(matches!(
            arrivals.recv(),
            Some(Arrival::Call(Call::Reset(_)))
        ));
        assert!(matches!(arrivals.recv(), Some(Arrival::SetParameter(..))));
        assert!(
            matches!(arrivals.try_recv(), Ok(Arrival::Message(..))) && arrivals.try_recv().is_err()
        );
    }

    #[test]
    fn a_call_that_finds_no_room_or_comes_too_late_or_is_never_taken_is_refused() {
        let (inbox, arrivals) = inbox(1, &Clock::system());
        let ask = || {
            let (to, answer) = reply();
            (inbox.put(Arrival::Call(Call::Reset(to))), answer)
        };
        let waiting: Vec<_> = (0..MOST_CALLS).map(|_| ask()).collect();
        assert!(
            waiting
                .iter()
                .all(|(is_in, answer)| *is_in && answer.try_recv().is_err())
        );
        let (is_in, answer) = ask();
        assert!(!is_in && answer.try_recv().unwrap().message == FULL);
        assert!(
            inbox.put(pose()) && inbox.put(Arrival::Shutdown),
            "each has room of its own, the end always"
        );
        drop(arrivals);
        let refused =
            |answer: &Receiver<TriggerResponse>| answer.try_recv().unwrap().message == ENDED;
        assert!(waiting.iter().all(|(_, answer)| refused(answer)));
        assert!(refused(&ask().1) && !inbox.put(pose()) && !inbox.put_patiently(pose()));
    }

    /// Refuses each call once.
    #[test]
    fn every_call_has_a_refusal_of_its_type() {
        let (inbox, arrivals) = inbox(1, &Clock::system());
        drop(arrivals);
        macro_rules! assert_refused {
            ($($call:ident $(($request:expr))?),+) => {$({
                let (to, answer) = reply();
                assert!(!inbox.put(Arrival::Call(Call::$call($($request,)? to))));
                let said = answer.try_recv().unwrap();
                assert!(!said.success && said.message == ENDED, "{said:?}");
            })+};
        }
        assert_refused!(
            Flag(Default::default()),
            Unflag(Default::default()),
            Detect(Default::default()),
            ArmState
        );
        assert_refused!(
            Save(Default::default()),
            Resync(Default::default()),
            Undo(Default::default()),
            Reset
        );
        assert_refused!(Redo(Default::default()), TakeOut(Default::default()));
        let (to, answer) = reply();
        let order = ArmOrder::Feature(
            ProbeFeatureRequest {
                id: 7,
                ..Default::default()
            },
            to,
        );
        inbox.put(Arrival::Call(Call::Arm(order)));
        let result = answer.try_recv().unwrap().result;
        assert_eq!(
            (result.id, result.code, result.message.as_str()),
            (7, ProbeResult::SHUTDOWN, ENDED)
        );
        assert!(result.uncertainty.is_nan() && result.feature.diameter.is_nan());
        let ((accept, accepted), (result, ended)) = (reply(), reply());
        let (feedback, is_cancelled) = (Feedback(Box::new(|_| {})), Arc::default());
        let goal = Goal {
            accept,
            feedback,
            result,
            is_cancelled,
        };
        inbox.put(Arrival::Call(Call::Arm(ArmOrder::Goal(
            ProbeGoal {
                ids: vec![7],
                ..Default::default()
            },
            goal,
        ))));
        let (_, response) = ended.try_recv().unwrap();
        assert_eq!(
            (accepted.try_recv(), response.ids, response.codes),
            (Ok(true), vec![7], vec![ProbeResult::SHUTDOWN])
        );
    }

    #[test]
    fn a_stop_after_recover_was_called_outlasts_it() {
        let (inbox, _arrivals) = inbox(1, &Clock::system());
        let recover = || inbox.put(Arrival::Call(Call::Arm(ArmOrder::Recover(reply().0))));
        inbox.stops().stop();
        assert!(recover());
        inbox.stops().stop();
        // the node handles the first call only now
        assert!(
            inbox
                .stops()
                .recover()
                .unwrap_err()
                .contains("call ~/recover again")
        );
        assert!(inbox.stops().ready().is_err());
        assert!(recover());
        assert!(inbox.stops().recover().is_ok() && inbox.stops().ready().is_ok());
    }
}
