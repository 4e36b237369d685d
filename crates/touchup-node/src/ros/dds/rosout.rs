//! `/rosout`: the log, for observers of the nodes of a cell.

use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use ros2_client::builtin_interfaces::Time;
use ros2_client::log::LogLevel;
use ros2_client::{Node, RosoutRaw};
use tracing::Level;

use crate::log_lines::listen;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;

/// Period of checks whether the port leaves.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Starts the thread that sends lines of the log, in the name of the node.
pub(super) fn send(
    node: &Arc<Mutex<Node>>,
    exchange: &Arc<PortState>,
) -> Result<JoinHandle<()>, RosError> {
    let (node, lines) = (node.clone(), listen());
    // name of a logger: `cell.touchup`
    let name = exchange.node_name.trim_start_matches('/').replace('/', ".");
    Ok(exchange.thread("touchup-rosout", move |exchange| {
        loop {
            match lines.recv_timeout(LOOK_EVERY) {
                Ok(line) => {
                    let stamp = Time::from_nanos(exchange.clock.now_ns());
                    let level = level_of(line.level);
                    locked(&node)
                        .rosout_raw(stamp, level, &name, &line.text, line.file, "", line.line);
                }
                Err(RecvTimeoutError::Timeout) if !exchange.inbox.is_over() => {}
                Err(_) => break,
            }
        }
    })?)
}

fn level_of(level: Level) -> LogLevel {
    match level {
        Level::ERROR => LogLevel::Error,
        Level::WARN => LogLevel::Warn,
        Level::INFO => LogLevel::Info,
        Level::DEBUG | Level::TRACE => LogLevel::Debug,
    }
}
