//! One thread receives all messages.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::dds::rustdds::mio1::{Events, Interest, Poll, Token, Waker};
use ros2_client::{Gid, ReadResult, Subscription};

use crate::ros::exchange::{PortState, RosError};
use crate::ros::messages::RosMessage;
use crate::ros::port::Arrival;

/// A source of messages.
pub(super) trait Listener: Send {
    /// Passes on the event sources that wake the thread, once per batch since the last full read.
    /// Called before any read, and again after [`Self::has_changed`].
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()>;

    /// Reads all waiting messages.
    fn take(&mut self);

    /// Whether other sources have to wake the thread from now on, after a change of published
    /// types.
    fn has_changed(&mut self) -> bool {
        false
    }
}

/// Not the number of any listener.
const WAKE: Token = Token(usize::MAX);

/// Starts the thread; the waker makes it check for the end.
///
/// - `look_every`: maximum time between reads of each listener; `None`: only events count.
pub(super) fn listen(
    mut listeners: Vec<Box<dyn Listener>>,
    look_every: Option<Duration>,
    exchange: &Arc<PortState>,
) -> Result<(Arc<Waker>, JoinHandle<()>), RosError> {
    let mut poll = Poll::new()?;
    for (token, listener) in listeners.iter_mut().enumerate() {
        listener.sources(&mut |source| {
            poll.registry()
                .register(source, Token(token), Interest::READABLE)
        })?;
    }
    let waker = Arc::new(Waker::new(poll.registry(), WAKE)?);
    let thread = exchange.thread("touchup-receive", move |exchange| {
        let mut events = Events::with_capacity(128);
        // messages from before the registration wake nobody
        listeners.iter_mut().for_each(|listener| listener.take());
        let mut looked = Instant::now();
        while !exchange.inbox.is_over() {
            if let Err(error) = poll.poll(&mut events, look_every) {
                if error.kind() == io::ErrorKind::Interrupted {
                    continue;
                }
                tracing::error!(%error, "the node hears nothing any more");
                exchange.inbox.put(Arrival::Shutdown);
                return;
            }
            for event in &events {
                if let Some(listener) = listeners.get_mut(event.token().0) {
                    listener.take();
                }
            }
            for (token, listener) in listeners.iter_mut().enumerate() {
                if !listener.has_changed() {
                    continue;
                }
                let registry = poll.registry();
                let heard = listener.sources(&mut |source| {
                    registry.register(source, Token(token), Interest::READABLE)
                });
                if let Err(error) = heard {
                    tracing::error!(%error, "a topic is not heard");
                }
                listener.take();
            }
            if look_every.is_some_and(|every| looked.elapsed() >= every) {
                looked = Instant::now();
                listeners.iter_mut().for_each(|listener| listener.take());
            }
        }
    })?;
    Ok((waker, thread))
}

/// Reads all waiting messages under this name; reports unreadable ones with a remark after the
/// reason.
pub(super) fn drain<T>(
    (name, exchange, remark): (&'static str, &Arc<PortState>, &str),
    mut receive: impl FnMut() -> ReadResult<Option<T>>,
    mut take: impl FnMut(T),
) {
    loop {
        match receive() {
            Ok(Some(message)) => take(message),
            Ok(None) => return,
            Err(error) => drop(
                exchange
                    .inbox
                    .put(Arrival::Unreadable(name, format!("{error}{remark}"))),
            ),
        }
    }
}

/// The last number of each sender.
#[derive(Default)]
pub(super) struct LastNumbers(BTreeMap<Gid, i64>);

impl LastNumbers {
    /// Maximum number of senders.
    const MOST: usize = 64;
    /// A larger gap is no loss: 100 s at 10 kHz.
    const LARGEST: i64 = 1_000_000;

    /// Number of messages missing before this one.
    pub fn missing(&mut self, sender: Gid, number: i64) -> u64 {
        if self.0.len() >= Self::MOST && !self.0.contains_key(&sender) {
            self.0.pop_first();
        }
        let Some(last) = self.0.insert(sender, number) else {
            return 0;
        };
        let gap = number.saturating_sub(last).saturating_sub(1);
        if (1..=Self::LARGEST).contains(&gap) {
            gap as u64
        } else {
            0
        }
    }
}

/// A subscribed topic.
pub(super) struct HeardTopic<M: RosMessage> {
    pub name: &'static str,
    pub subscription: Subscription<M>,
    pub exchange: Arc<PortState>,
    pub arrival: fn(&PortState, M) -> Arrival,
}

impl<M: RosMessage> Listener for HeardTopic<M> {
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()> {
        each(&mut self.subscription)
    }

    fn take(&mut self) {
        let Self {
            name,
            subscription,
            exchange,
            arrival,
        } = self;
        drain(
            (name, exchange, ""),
            || subscription.take(),
            |(message, _)| {
                exchange.inbox.put(arrival(exchange, message));
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_counted_for_each_sender_alone() {
        let mut numbers = LastNumbers::default();
        let [a, b] = [Gid::default(), Gid::from([1; 16])];
        let missing: Vec<u64> = [
            (a, 7),
            (a, 8),
            (b, 1),
            (a, 12),
            (b, 2),
            (a, 3),
            (a, 4),
            (b, i64::MAX),
            (b, i64::MIN),
        ]
        .map(|(sender, number)| numbers.missing(sender, number))
        .into();
        assert_eq!(missing, [0, 0, 0, 3, 0, 0, 0, 0, 0]);
    }
}
