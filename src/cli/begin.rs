//! Why a node does not begin, where an operator may mend it.

use super::CliError;
use crate::ros::node::NodeError;

/// Why a node does not begin.
#[derive(Debug)]
pub(super) enum BeginError {
    /// it cannot be made ready
    Node(NodeError),
    /// its network or its arm
    Around(CliError),
}

impl From<NodeError> for BeginError {
    fn from(error: NodeError) -> Self {
        Self::Node(error)
    }
}

impl From<CliError> for BeginError {
    fn from(error: CliError) -> Self {
        Self::Around(error)
    }
}

impl From<BeginError> for CliError {
    fn from(error: BeginError) -> Self {
        match error {
            BeginError::Node(error) => error.into(),
            BeginError::Around(error) => error,
        }
    }
}
