//! Signals that end a verb: SIGINT (Ctrl-C), SIGTERM, and for the node SIGHUP.

use std::future::poll_fn;
use std::io;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
#[cfg(any(feature = "ros", feature = "r2r"))]
use std::sync::{Mutex, PoisonError};
use std::task::Poll;
use std::thread::Builder;

use tokio::runtime;
pub(in crate::cli) use tokio::signal::unix::SignalKind;
use tokio::signal::unix::{Signal, signal};

use super::error::{CliError, INTERRUPTED};
use crate::cli::notify;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros::inbox::Inbox;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros::port::Arrival;
use touchup_probing::arm::StopRequest;

/// Calls `each` on its own thread with the count of signals, from 1 on.
pub(in crate::cli) fn on_each_signal(
    kinds: &[SignalKind],
    mut each: impl FnMut(u32) + Send + 'static,
) -> io::Result<()> {
    let runtime = runtime::Builder::new_current_thread().enable_io().build()?;
    let mut signals = {
        let _entered = runtime.enter();
        kinds
            .iter()
            .map(|kind| signal(*kind))
            .collect::<io::Result<Vec<_>>>()?
    };
    let listen = move || {
        for count in 1.. {
            runtime.block_on(any(&mut signals));
            each(count);
        }
    };
    Builder::new()
        .name("signals".to_owned())
        .spawn(listen)
        .map(drop)
}

/// Target node of the signals; without one, a signal ends the program at once.
#[cfg(any(feature = "ros", feature = "r2r"))]
#[derive(Debug)]
pub(in crate::cli) struct SignalledNode(Arc<Mutex<Option<Inbox>>>);

#[cfg(any(feature = "ros", feature = "r2r"))]
impl SignalledNode {
    /// Starts listening. The first signal ends the node, which saves, and its arm stops and
    /// retracts. The next one stops a still retracting arm in place; one more, or the second
    /// without arm motion, ends the program at once.
    pub fn listen() -> io::Result<Self> {
        let node = Arc::new(Mutex::new(None::<Inbox>));
        let heard = Arc::clone(&node);
        let kinds = [
            SignalKind::interrupt(),
            SignalKind::terminate(),
            SignalKind::hangup(),
        ];
        on_each_signal(&kinds, move |count| {
            let inbox = heard.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let Some(inbox) = inbox else {
                exit(i32::from(INTERRUPTED.1))
            };
            if count == 1 {
                notify(
                    "ends and saves; a second signal ends it at once, or stops an arm that still retracts where it is",
                );
                // an ended node needs no shutdown
                inbox.put(Arrival::Shutdown);
                return;
            }
            if !inbox.stops().interrupt() {
                exit(1);
            }
            notify("the arm stops and stays where it is; one more signal ends the node at once");
        })?;
        Ok(Self(node))
    }

    /// Sets the node to end.
    pub fn set(&self, node: Option<Inbox>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = node;
    }
}

/// Waits for any signal.
async fn any(signals: &mut [Signal]) {
    poll_fn(|context| {
        match signals
            .iter_mut()
            .any(|signal| signal.poll_recv(context).is_ready())
        {
            true => Poll::Ready(()),
            false => Poll::Pending,
        }
    })
    .await;
}

/// Stop requests of the user to an arm.
#[derive(Clone, Debug, Default)]
pub(in crate::cli) struct StopSignals {
    count: Arc<AtomicU32>,
    is_at_rest: Arc<AtomicBool>,
}

impl StopSignals {
    /// Starts listening: at the first signal the arm stops and retracts, at the second it stays in
    /// place.
    ///
    /// # Errors
    /// If the system has no thread for it: kind `signals`.
    pub fn listen() -> Result<Self, CliError> {
        let signals = Self::default();
        let Self { count, is_at_rest } = signals.clone();
        let each = move |number| {
            if is_at_rest.load(Ordering::Acquire) {
                exit(i32::from(INTERRUPTED.1));
            }
            count.store(number, Ordering::Release);
            notify(match request_of(number) {
                Some(StopRequest::Stay) => "the arm stops and stays where it is",
                _ => "the arm stops and retracts; a second signal has it stay where it is",
            });
        };
        let no_thread = |error| {
            CliError::new(
                ("signals", 1),
                format!("cannot listen to signals: {error}"),
                None,
            )
        };
        on_each_signal(&[SignalKind::interrupt(), SignalKind::terminate()], each)
            .map_err(no_thread)?;
        Ok(signals)
    }

    /// Stop request from the signals until now.
    pub fn request(&self) -> Option<StopRequest> {
        request_of(self.count.load(Ordering::Acquire))
    }

    /// Marks the end of motion: the next signal ends the program at once.
    pub fn arm_is_at_rest(&self) {
        self.is_at_rest.store(true, Ordering::Release);
    }
}

fn request_of(signals: u32) -> Option<StopRequest> {
    match signals {
        0 => None,
        1 => Some(StopRequest::Retract),
        _ => Some(StopRequest::Stay),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_signal_retracts_and_the_second_has_the_arm_stay() {
        assert_eq!(
            [0, 1, 2, 3].map(request_of),
            [
                None,
                Some(StopRequest::Retract),
                Some(StopRequest::Stay),
                Some(StopRequest::Stay)
            ]
        );
    }
}
