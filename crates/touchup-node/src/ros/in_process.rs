//! The port without any network: tests put arrivals in by hand, and read publications back.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::ros::inbox::Inbox;
use crate::ros::locked;
use crate::ros::port::{Arrival, Call, Port, Publication, Reply, SamplePort};
use crate::ros::stop::StopState;
use touchup_io::recording::LiveMessage;
use touchup_session::clock::Clock;

/// Maximum number of publications kept for reading; the oldest go first.
const MOST_KEPT: usize = 1 << 16;

#[derive(Debug)]
struct InProcess {
    published: Mutex<VecDeque<Publication>>,
    /// maximum number of kept publications
    most_kept: usize,
    clock: Clock,
    /// the time of ROS, ns, and the instant of its setting
    now_ns: Mutex<(i64, Instant)>,
    inbox: Inbox,
    unsent: AtomicU64,
}

impl Port for InProcess {
    fn publish(&self, publication: Publication) {
        if self.most_kept == 0 {
            return;
        }
        let mut published = locked(&self.published);
        if published.len() == self.most_kept {
            published.pop_front();
            self.unsent.fetch_add(1, Ordering::Relaxed);
        }
        published.push_back(publication);
    }

    fn node_name(&self) -> &str {
        "/touchup"
    }

    fn sample_topics(&self) -> [&str; 2] {
        ["/stylus/wrench", "/stylus/pose"]
    }

    fn mesh_patch_topic(&self) -> &str {
        "/mesh_patch"
    }

    fn now_ns(&self) -> i64 {
        let (now_ns, at) = *locked(&self.now_ns);
        now_ns + self.clock.since(at).as_nanos() as i64
    }

    fn dropped(&self) -> [u64; 2] {
        self.inbox.dropped()
    }

    fn lost(&self) -> [u64; 2] {
        [0, 0]
    }

    fn unsent(&self) -> [u64; 2] {
        [0, self.unsent.load(Ordering::Relaxed)]
    }

    fn tiles_waiting(&self) -> usize {
        0
    }
}

/// The other side of an in-process port: all other participants in the graph.
#[derive(Clone, Debug)]
pub struct OtherParticipants {
    port: Arc<InProcess>,
}

/// A port, and the world around it. Arrivals go to `inbox`. The time of ROS is 0 now, and follows
/// `clock`.
pub fn start(inbox: Inbox, clock: &Clock) -> (Arc<dyn Port>, OtherParticipants) {
    start_keeping(MOST_KEPT, inbox, clock)
}

/// The same without a reader of publications.
pub fn start_unread(inbox: Inbox, clock: &Clock) -> (Arc<dyn Port>, OtherParticipants) {
    start_keeping(0, inbox, clock)
}

fn start_keeping(
    most_kept: usize,
    inbox: Inbox,
    clock: &Clock,
) -> (Arc<dyn Port>, OtherParticipants) {
    let port = Arc::new(InProcess {
        published: Mutex::default(),
        most_kept,
        now_ns: Mutex::new((0, clock.now())),
        clock: clock.clone(),
        inbox,
        unsent: AtomicU64::new(0),
    });
    (port.clone(), OtherParticipants { port })
}

impl OtherParticipants {
    /// Delivers an arrival; with a slow node drops and counts it, as a network does. Returns
    /// whether it got in.
    pub fn arrive(&self, arrival: Arrival) -> bool {
        self.port.inbox.put(arrival)
    }

    /// Delivers an arrival as soon as the node has room. Returns whether the node is still present.
    pub fn arrive_patiently(&self, arrival: Arrival) -> bool {
        self.port.inbox.put_patiently(arrival)
    }

    /// Stop state of the arm, as of the services `~/pause` and `~/stop`.
    pub fn stops(&self) -> &StopState {
        self.port.inbox.stops()
    }

    /// Calls a service: `world.call(|reply| Call::Undo(request, reply)).recv()` returns the answer.
    pub fn call<A: Send + 'static>(&self, call: impl FnOnce(Reply<A>) -> Call) -> Receiver<A> {
        self.ask(|reply| Arrival::Call(call(reply)))
    }

    /// Delivers an arrival with a reply.
    pub fn ask<A: Send + 'static>(&self, arrival: impl FnOnce(Reply<A>) -> Arrival) -> Receiver<A> {
        let (answer, answers): (SyncSender<A>, _) = sync_channel(1);
        self.arrive_patiently(arrival(Reply::new(move |said| {
            // the receiver may be gone
            let _ = answer.send(said);
        })));
        answers
    }

    /// Publications since the last call, oldest first.
    pub fn published(&self) -> Vec<Publication> {
        locked(&self.port.published).drain(..).collect()
    }

    /// Sets the time of ROS now, ns.
    pub fn set_now_ns(&self, now_ns: i64) {
        *locked(&self.port.now_ns) = (now_ns, self.port.clock.now());
    }
}

/// Measurements of an arm arrive as soon as the node has room.
impl SamplePort for OtherParticipants {
    fn publish(&self, message: LiveMessage) -> bool {
        self.arrive_patiently(Arrival::Message(message, self.port.clock.now()))
    }

    fn listeners(&mut self) -> [usize; 2] {
        [1, 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::inbox::inbox;
    use crate::ros::messages::{Clock as ClockMessage, UndoRequest, UndoResponse};
    use touchup_method::stylus::{Message, StampedWrench, Wrench};

    #[test]
    fn a_call_is_answered_by_who_reads_the_inbox() {
        let (inbox, arrivals) = inbox(8, &Clock::system());
        let (_port, world) = start(inbox, &Clock::system());
        let answers = world.call(|reply| Call::Undo(UndoRequest { strokes: 2 }, reply));
        match arrivals.recv().unwrap() {
            Arrival::Call(Call::Undo(request, reply)) => {
                reply.send(UndoResponse {
                    strokes: request.strokes,
                    ..Default::default()
                });
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(answers.recv().unwrap().strokes, 2);
    }

    #[test]
    fn what_finds_no_room_is_counted_by_kind() {
        let (inbox, _arrivals) = inbox(1, &Clock::system());
        let (port, world) = start(inbox, &Clock::system());
        let (stamp_ns, wrench) = (0, Wrench::default());
        let message = LiveMessage {
            frame: String::new(),
            message: Message::Wrench(StampedWrench { stamp_ns, wrench }),
        };
        let now = Instant::now();
        assert!(world.arrive(Arrival::Message(message.clone(), now)));
        assert!(!world.arrive(Arrival::Message(message, now)));
        assert!(!world.arrive(Arrival::Clock(ClockMessage::default())));
        assert!(!world.arrive(Arrival::Clock(ClockMessage::default())));
        assert_eq!(port.dropped(), [1, 2]);
    }

    #[test]
    fn the_time_of_ros_passes_as_that_of_the_clock() {
        let (clock, hand) = Clock::manual();
        let (port, world) = start(inbox(1, &clock).0, &clock);
        assert_eq!(port.now_ns(), 0);
        hand.advance(std::time::Duration::from_millis(5));
        assert_eq!(port.now_ns(), 5_000_000);
        world.set_now_ns(1_000_000_000_000);
        hand.advance(std::time::Duration::from_nanos(7));
        assert_eq!(port.now_ns(), 1_000_000_000_007);
    }

    #[test]
    fn publications_come_back_in_their_order() {
        let (inbox, _arrivals) = inbox(1, &Clock::system());
        let (port, world) = start(inbox, &Clock::system());
        for strokes in 0..3 {
            port.publish(Publication::Mismatch(
                crate::ros::messages::HapticMismatch {
                    mesh_version: strokes,
                    ..Default::default()
                },
            ));
        }
        let versions: Vec<u64> = world
            .published()
            .iter()
            .map(|published| match published {
                Publication::Mismatch(mismatch) => mismatch.mesh_version,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(versions, [0, 1, 2]);
        assert!(world.published().is_empty());
    }
}
