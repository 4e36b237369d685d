//! Start-up errors of the node that an operator can mend.

use crate::cli::CliError;
use touchup_node::node::NodeError;

/// Start-up error of the node.
#[derive(Debug)]
pub(in crate::cli) enum BeginError {
    /// Node setup.
    Node(NodeError),
    /// Network or arm.
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
