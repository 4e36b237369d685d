//! The way from a port to the node: what comes is handed over, or counted where the node is too slow.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::TrySendError;

use super::port::{Arrival, Endpoint, Inbox};

/// Where arrivals go, and how many could not.
pub(super) struct Arrivals {
    inbox: Inbox,
    /// wrenches and poses, others
    dropped: [AtomicU64; 2],
    is_over: AtomicBool,
}

impl Arrivals {
    pub fn new(inbox: Inbox) -> Self {
        Self { inbox, dropped: [const { AtomicU64::new(0) }; 2], is_over: AtomicBool::new(false) }
    }

    /// Puts it into the inbox of the node, or counts it; never waits.
    pub fn put(&self, arrival: Arrival) {
        match self.inbox.try_send(arrival) {
            Ok(()) => {}
            Err(TrySendError::Full(lost)) => {
                let which = usize::from(!matches!(lost, Arrival::Wrench(..) | Arrival::Pose(..)));
                self.dropped[which].fetch_add(1, Ordering::Relaxed);
            }
            Err(TrySendError::Disconnected(_)) => self.end(),
        }
    }

    /// Reports who else is on a topic: to the log, and to the node for its diagnostics.
    ///
    /// - `mismatch`: why one of them does not fit.
    pub fn report(&self, topic: String, count: usize, mismatch: Option<String>) {
        match &mismatch {
            Some(reason) => tracing::warn!(topic, "{reason}"),
            None => tracing::info!(topic, others = count, "who is on a topic has changed"),
        }
        self.put(Arrival::Matched(Endpoint { topic, count, mismatch }));
    }

    /// As [`super::port::Port::dropped`].
    pub fn dropped(&self) -> [u64; 2] {
        self.dropped.each_ref().map(|count| count.load(Ordering::Relaxed))
    }

    /// Nobody takes anything any more.
    pub fn end(&self) {
        self.is_over.store(true, Ordering::Relaxed);
    }

    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;
    use std::time::Instant;

    use super::*;
    use crate::ros::messages::{PoseStamped, TFMessage};

    #[test]
    fn what_finds_no_room_is_counted_by_what_it_is() {
        let (inbox, node) = sync_channel(1);
        let arrivals = Arrivals::new(inbox);
        for _ in 0..3 {
            arrivals.put(Arrival::Pose(PoseStamped::default(), Instant::now()));
        }
        arrivals.put(Arrival::Tf(TFMessage::default()));
        assert_eq!((arrivals.dropped(), arrivals.is_over()), ([2, 1], false));
        drop(node);
        arrivals.put(Arrival::Shutdown);
        assert_eq!((arrivals.dropped(), arrivals.is_over()), ([2, 1], true), "nobody is there to drop it for");
    }
}
