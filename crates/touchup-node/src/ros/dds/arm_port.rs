//! Port of an arm behind ros2_control.

use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use ros2_client::dds::rustdds::mio1::{Events, Interest, Poll, Token, Waker};
use ros2_client::dds::rustdds::{
    DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, GUID, StatusEvented,
};
use ros2_client::{Node, NodeOptions, Publisher, Subscription};

use super::back_end::{DdsErrorContext, join};
use super::topics::{BEST_EFFORT, URGENT, keep, make_topic};
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::RosError;
use crate::ros::messages::{JointState, JointTrajectory, RosMessage, WrenchStamped};
use crate::ros::port::{ArmPort, ArmReport};

/// Maximum number of messages of a topic kept by DDS until read: a tenth of a second at 1 kHz.
const DEPTH: usize = 100;
/// Maximum number of messages waiting for the arm's driver; a driver late by a second gets the
/// oldest, and sees their lateness.
const WAITING: usize = 2048;

struct DdsArm {
    reports: Receiver<ArmReport>,
    orders: Publisher<JointTrajectory>,
    status: DomainParticipantStatusListener,
    listeners: BTreeSet<GUID>,
    is_over: Arc<AtomicBool>,
    waker: Arc<Waker>,
    thread: Option<JoinHandle<()>>,
    // its entities leave the graph on drop
    _node: Node,
}

impl Drop for DdsArm {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        // otherwise the thread stays until the next message, which does no harm
        let _ = self.waker.wake();
        if let Some(thread) = self.thread.take() {
            // a panicked thread has already reported it
            let _ = thread.join();
        }
    }
}

/// Joins the network as the driver of an arm.
///
/// - `reports`: topics of joint states and of wrenches.
/// - `orders`: topic of trajectories.
///
/// # Errors
/// [`RosError`]: an invalid name, no network, no thread.
pub fn arm_port(
    config: &NodeConfig,
    reports: [&str; 2],
    orders: &str,
) -> Result<Box<dyn ArmPort>, RosError> {
    let (context, mut node) = join(config, NodeOptions::new().start_parameter_services(false))?;
    let status = context.domain_participant().status_listener();
    let heard = keep(BEST_EFFORT, DEPTH);
    let joints = make_topic::<JointState>(&node, &config.resolve(reports[0])?, &heard)?;
    let mut joints = node
        .create_subscription::<JointState>(&joints, Some(heard.clone()))
        .during("subscribing to a topic")?;
    let wrench = make_topic::<WrenchStamped>(&node, &config.resolve(reports[1])?, &heard)?;
    let mut wrench = node
        .create_subscription::<WrenchStamped>(&wrench, Some(heard))
        .during("subscribing to a topic")?;
    // only the newest order counts
    let sent = keep(URGENT, 1);
    let topic = make_topic::<JointTrajectory>(&node, &config.resolve(orders)?, &sent)?;
    let orders = node
        .create_publisher(&topic, Some(sent))
        .during("publishing a topic")?;
    let mut poll = Poll::new()?;
    poll.registry()
        .register(&mut joints, Token(0), Interest::READABLE)?;
    poll.registry()
        .register(&mut wrench, Token(1), Interest::READABLE)?;
    let waker = Arc::new(Waker::new(poll.registry(), Token(2))?);
    let (sender, received) = sync_channel(WAITING);
    let is_over = Arc::new(AtomicBool::new(false));
    let over = is_over.clone();
    let thread = Builder::new()
        .name("touchup-arm-in".to_owned())
        .spawn(move || {
            let mut events = Events::with_capacity(16);
            while !over.load(Ordering::Relaxed) {
                // messages from before the registration wake nobody
                take(&joints, &sender, ArmReport::Joints);
                take(&wrench, &sender, ArmReport::Wrench);
                match poll.poll(&mut events, None) {
                    Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                        tracing::error!(%error, "nothing is heard of the arm any more");
                        return;
                    }
                    _ => {}
                }
            }
        })?;
    Ok(Box::new(DdsArm {
        reports: received,
        orders,
        status,
        listeners: BTreeSet::new(),
        is_over,
        waker,
        thread: Some(thread),
        _node: node,
    }))
}

/// Reads all waiting messages.
fn take<M: RosMessage>(
    from: &Subscription<M>,
    to: &SyncSender<ArmReport>,
    report: fn(M) -> ArmReport,
) {
    loop {
        let report = match from.take() {
            Ok(Some((message, _))) => report(message),
            Ok(None) => return,
            Err(error) => ArmReport::Unreadable(error.to_string()),
        };
        // without room the driver is late, and notices it by the stamps
        let _ = to.try_send(report);
    }
}

impl ArmPort for DdsArm {
    fn next_report(&mut self, timeout: Duration) -> Option<ArmReport> {
        self.reports.recv_timeout(timeout).ok()
    }

    fn publish_trajectory(&mut self, order: JointTrajectory) -> bool {
        self.orders
            .publish(order)
            .inspect_err(|error| tracing::debug!(%error, "an order is not sent"))
            .is_ok()
    }

    fn order_listeners(&mut self) -> Option<usize> {
        while let Some(event) = self.status.try_recv_status() {
            match event {
                Event::RemoteReaderMatched {
                    local_writer,
                    remote_reader,
                } if local_writer == self.orders.guid() => {
                    self.listeners.insert(remote_reader);
                }
                Event::ReaderLost { guid, .. } => {
                    self.listeners.remove(&guid);
                }
                _ => {}
            }
        }
        Some(self.listeners.len())
    }
}
