//! The node during its start, while topics, services and the action are added.

use std::sync::Arc;

use futures::{FutureExt, Stream, StreamExt};

use super::graph::R2rGraph;
use crate::ros::arguments::NodeConfig;
use crate::ros::exchange::{PortState, RosError};

/// Names the refused request to rcl.
pub(super) trait RclErrorContext<T> {
    fn during(self, call: &'static str) -> Result<T, RosError>;
}

impl<T> RclErrorContext<T> for r2r::Result<T> {
    fn during(self, call: &'static str) -> Result<T, RosError> {
        let remedy = "is the workspace sourced that has touchup_msgs?";
        self.map_err(|error| RosError::Refused {
            call,
            reason: error.to_string(),
            remedy,
        })
    }
}

/// Reads all messages of one topic, service or action since its last call; returns whether there
/// were any.
pub(super) type PollSource = Box<dyn FnMut() -> bool + Send>;

/// A stream of r2r as a source. r2r reads one message of each at a time and keeps ten, so there are
/// no losses between two spins.
pub(super) fn source<S>(mut stream: S, mut take: impl FnMut(S::Item) + Send + 'static) -> PollSource
where
    S: Stream + Unpin + Send + 'static,
{
    Box::new(move || {
        let mut has_come = false;
        while let Some(Some(item)) = stream.next().now_or_never() {
            take(item);
            has_come = true;
        }
        has_come
    })
}

/// Back end that publishes, subscribes and serves.
pub(super) struct R2rBackEnd<'a> {
    pub config: &'a NodeConfig,
    pub node: r2r::Node,
    pub graph: R2rGraph,
    pub exchange: Arc<PortState>,
    pub sources: Vec<PollSource>,
}
