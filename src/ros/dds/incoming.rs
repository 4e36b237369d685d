//! One thread takes everything that comes.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{Builder, JoinHandle};

use ros2_client::Subscription;
use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::dds::rustdds::mio1::{Events, Interest, Poll, Token, Waker};

use super::{RosError, Shared};
use crate::ros::messages::Message;
use crate::ros::port::Arrival;

/// Something that messages come from.
pub(super) trait Listener: Send {
    /// What wakes the thread: once for all that came since it was last read empty. Asked for once for each number below
    /// [`Self::sources`].
    fn source(&mut self, number: usize) -> &mut dyn Source;

    /// How many sources there are.
    fn sources(&self) -> usize {
        1
    }

    /// Takes all that is there.
    fn take(&mut self);
}

/// Not the number of any listener.
const WAKE: Token = Token(usize::MAX);

/// Starts the thread; the waker lets it look whether all is over.
pub(super) fn listen(
    mut listeners: Vec<Box<dyn Listener>>,
    shared: Arc<Shared>,
) -> Result<(Arc<Waker>, JoinHandle<()>), RosError> {
    let mut poll = Poll::new()?;
    for (token, listener) in listeners.iter_mut().enumerate() {
        for number in 0..listener.sources() {
            poll.registry().register(listener.source(number), Token(token), Interest::READABLE)?;
        }
    }
    let waker = Arc::new(Waker::new(poll.registry(), WAKE)?);
    let thread = Builder::new().name("touchup-receive".to_owned()).spawn(move || {
        let mut events = Events::with_capacity(128);
        // what came before the registration wakes nobody
        listeners.iter_mut().for_each(|listener| listener.take());
        while !shared.arrivals.is_over.load(Ordering::Relaxed) {
            if let Err(error) = poll.poll(&mut events, None) {
                if error.kind() == std::io::ErrorKind::Interrupted {
                    continue;
                }
                tracing::error!(%error, "the node hears nothing any more");
                shared.arrivals.put(Arrival::Shutdown);
                return;
            }
            for event in &events {
                if let Some(listener) = listeners.get_mut(event.token().0) {
                    listener.take();
                }
            }
        }
    })?;
    Ok((waker, thread))
}

/// A topic that is listened to.
pub(super) struct Topic<M: Message> {
    pub name: &'static str,
    pub subscription: Subscription<M>,
    pub shared: Arc<Shared>,
    pub arrival: fn(&Shared, M) -> Option<Arrival>,
}

impl<M: Message> Listener for Topic<M> {
    fn source(&mut self, _: usize) -> &mut dyn Source {
        &mut self.subscription
    }

    fn take(&mut self) {
        loop {
            match self.subscription.take() {
                Ok(Some((message, _))) => {
                    if let Some(arrival) = (self.arrival)(&self.shared, message) {
                        self.shared.arrivals.put(arrival);
                    }
                }
                Ok(None) => return,
                Err(error) => self.shared.arrivals.put(Arrival::Unreadable(self.name, error.to_string())),
            }
        }
    }
}
