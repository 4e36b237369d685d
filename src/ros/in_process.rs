//! The port without any network: what is to arrive is put in by hand, what is published is read back.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use super::clock::steady_ns;
use super::messages::{PoseStamped, WrenchStamped};
use super::port::{Arrival, Call, Inbox, Port, Publication, Reply, SamplePort};

/// Publications that are kept for reading; the oldest go first.
const MOST_KEPT: usize = 1 << 16;

#[derive(Debug)]
struct InProcess {
    published: Mutex<std::collections::VecDeque<Publication>>,
    now_ns: AtomicI64,
    dropped: [AtomicU64; 2],
    unsent: AtomicU64,
}

impl Port for InProcess {
    fn publish(&self, publication: Publication) {
        let mut published = self.published.lock().unwrap_or_else(PoisonError::into_inner);
        if published.len() == MOST_KEPT {
            published.pop_front();
            self.unsent.fetch_add(1, Ordering::Relaxed);
        }
        published.push_back(publication);
    }

    fn now_ns(&self) -> i64 {
        self.now_ns.load(Ordering::Relaxed)
    }

    fn dropped(&self) -> [u64; 2] {
        self.dropped.each_ref().map(|count| count.load(Ordering::Relaxed))
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

/// The other side of an in-process port: stands for everybody else in the graph.
#[derive(Clone, Debug)]
pub struct World {
    port: Arc<InProcess>,
    inbox: Inbox,
}

/// A port, and the world around it. What is put into the world goes to `inbox`.
pub fn start(inbox: Inbox) -> (Arc<dyn Port>, World) {
    let port = Arc::new(InProcess {
        published: Mutex::default(),
        now_ns: AtomicI64::new(0),
        dropped: [const { AtomicU64::new(0) }; 2],
        unsent: AtomicU64::new(0),
    });
    (port.clone(), World { port, inbox })
}

impl World {
    /// Something arrives; where the node is too slow it is dropped and counted, as on a network. Whether it got in.
    pub fn arrive(&self, arrival: Arrival) -> bool {
        match self.inbox.try_send(arrival) {
            Ok(()) => true,
            Err(TrySendError::Full(lost) | TrySendError::Disconnected(lost)) => {
                let which = usize::from(!matches!(lost, Arrival::Wrench(..) | Arrival::Pose(..)));
                self.port.dropped[which].fetch_add(1, Ordering::Relaxed);
                false
            }
        }
    }

    /// Something arrives, as soon as the node has room for it. Whether the node is still there.
    pub fn arrive_patiently(&self, arrival: Arrival) -> bool {
        self.inbox.send(arrival).is_ok()
    }

    /// Calls a service: `world.call(|reply| Call::Undo(request, reply)).recv()` is the answer.
    pub fn call<A: Send + 'static>(&self, call: impl FnOnce(Reply<A>) -> Call) -> Receiver<A> {
        self.ask(|reply| Arrival::Call(call(reply)))
    }

    /// Puts in whatever wants a reply.
    pub fn ask<A: Send + 'static>(&self, arrival: impl FnOnce(Reply<A>) -> Arrival) -> Receiver<A> {
        let (answer, answers): (SyncSender<A>, _) = sync_channel(1);
        self.arrive_patiently(arrival(Reply::new(move |said| {
            // nobody has to wait for it
            let _ = answer.send(said);
        })));
        answers
    }

    /// What was published since it was last asked, the oldest first.
    pub fn published(&self) -> Vec<Publication> {
        self.port.published.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect()
    }

    /// Sets the time of ROS, ns.
    pub fn set_now_ns(&self, now_ns: i64) {
        self.port.now_ns.store(now_ns, Ordering::Relaxed);
    }
}

impl SamplePort for World {
    fn publish_wrench(&self, wrench: WrenchStamped) -> bool {
        self.arrive(Arrival::Wrench(wrench, steady_ns()))
    }

    fn publish_pose(&self, pose: PoseStamped) -> bool {
        self.arrive(Arrival::Pose(pose, steady_ns()))
    }

    fn listeners(&mut self) -> [usize; 2] {
        [1, 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::messages::{Clock, UndoRequest, UndoResponse, WrenchStamped};

    #[test]
    fn a_call_is_answered_by_who_reads_the_inbox() {
        let (inbox, arrivals) = sync_channel(8);
        let (_port, world) = start(inbox);
        let answers = world.call(|reply| Call::Undo(UndoRequest { strokes: 2 }, reply));
        match arrivals.recv().unwrap() {
            Arrival::Call(Call::Undo(request, reply)) => {
                reply.send(UndoResponse { strokes: request.strokes, ..Default::default() });
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(answers.recv().unwrap().strokes, 2);
    }

    #[test]
    fn what_finds_no_room_is_counted_by_kind() {
        let (inbox, _arrivals) = sync_channel(1);
        let (port, world) = start(inbox);
        assert!(world.arrive(Arrival::Wrench(WrenchStamped::default(), 1)));
        assert!(!world.arrive(Arrival::Wrench(WrenchStamped::default(), 2)));
        assert!(!world.arrive(Arrival::Clock(Clock::default())));
        assert!(!world.arrive(Arrival::Clock(Clock::default())));
        assert_eq!(port.dropped(), [1, 2]);
    }

    #[test]
    fn publications_come_back_in_their_order() {
        let (inbox, _arrivals) = sync_channel(1);
        let (port, world) = start(inbox);
        for strokes in 0..3 {
            port.publish(Publication::Mismatch(crate::ros::messages::HapticMismatch {
                mesh_version: strokes,
                ..Default::default()
            }));
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
