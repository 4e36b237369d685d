//! Port of an arm behind ros2_control.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use r2r::Publisher;
use r2r::geometry_msgs::msg::WrenchStamped as TheirWrench;
use r2r::sensor_msgs::msg::JointState as TheirJoints;
use r2r::trajectory_msgs::msg::JointTrajectory as TheirOrder;

use super::back_end::{RclErrorContext, source};
use super::context;
use super::convert::Convert;
use super::topics::profile;
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::RosError;
use crate::ros::messages::{JointState, JointTrajectory, WrenchStamped};
use crate::ros::port::{ArmPort, ArmReport};
use crate::ros::topics::Topic;

/// Maximum number of messages of a topic kept until read.
const DEPTH: usize = 100;
/// Maximum number of messages waiting for the arm's driver; a driver late by a second gets the
/// oldest, and sees their lateness.
const WAITING: usize = 2048;
/// Maximum time to notice the end without messages; a message wakes it at once.
const NOTHING_CAME: Duration = Duration::from_millis(20);

struct R2rArm {
    reports: Receiver<ArmReport>,
    orders: Publisher<TheirOrder>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for R2rArm {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // a panicked thread has already reported it
            let _ = thread.join();
        }
    }
}

/// Joins ROS as the driver of an arm.
///
/// - `reports`: topics of joint states and of wrenches.
/// - `orders`: topic of trajectories.
///
/// # Errors
/// [`RosError`]: ROS does not start, no thread.
pub fn arm_port(
    config: &NodeConfig,
    reports: [&str; 2],
    orders: &str,
) -> Result<Box<dyn ArmPort>, RosError> {
    let node = r2r::Node::create(context()?, &config.place.node, &config.place.namespace);
    let mut node = node.during("making the node")?;
    let heard = profile(Topic::best_effort("", DEPTH));
    let joints = node
        .subscribe::<TheirJoints>(reports[0], heard.clone())
        .during("subscribing to a topic")?;
    let wrench = node
        .subscribe::<TheirWrench>(reports[1], heard)
        .during("subscribing to a topic")?;
    // only the newest order counts
    let sent = r2r::qos::QosProfile::default().reliable().keep_last(1);
    let orders = node
        .create_publisher::<TheirOrder>(orders, sent)
        .during("publishing a topic")?;
    let (sender, received) = sync_channel(WAITING);
    let of_joints = sender.clone();
    // without room the driver is late, and notices it by the stamps
    let mut joints = source(joints, move |message| {
        let _ = of_joints.try_send(ArmReport::Joints(JointState::ours(message)));
    });
    let mut wrench = source(wrench, move |message| {
        let _ = sender.try_send(ArmReport::Wrench(WrenchStamped::ours(message)));
    });
    let is_over = Arc::new(AtomicBool::new(false));
    let over = is_over.clone();
    let thread = Builder::new()
        .name("touchup-arm-in".to_owned())
        .spawn(move || {
            while !over.load(Ordering::Relaxed) {
                node.spin_once(NOTHING_CAME);
                joints();
                wrench();
            }
        })?;
    Ok(Box::new(R2rArm {
        reports: received,
        orders,
        is_over,
        thread: Some(thread),
    }))
}

impl ArmPort for R2rArm {
    fn next_report(&mut self, timeout: Duration) -> Option<ArmReport> {
        self.reports.recv_timeout(timeout).ok()
    }

    fn publish_trajectory(&mut self, order: JointTrajectory) -> bool {
        self.orders.publish(&order.theirs()).is_ok()
    }

    /// `None` if rcl does not know.
    fn order_listeners(&mut self) -> Option<usize> {
        self.orders.get_inter_process_subscription_count().ok()
    }
}
