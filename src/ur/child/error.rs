//! Errors of the process, and how they are reported.

use std::time::Duration;

use crate::ur::protocol::ClientReport;

/// Why the process gives up before it has begun.
#[derive(Debug, thiserror::Error)]
pub enum ChildError {
    /// It is started by touchup, with its orders on stdin.
    #[error(
        "this is started by touchup itself: the first line on stdin has to be an order to begin ({0})"
    )]
    NoOrders(String),
    /// The arm does not come to rest.
    #[error("the arm still moves after braking for {} s", after.as_secs())]
    Moves {
        /// that it was braked
        after: Duration,
    },
    /// A call of Python.
    #[error("{call}: {reason}")]
    Python {
        /// which
        call: &'static str,
        /// what it raised
        reason: String,
    },
}

/// A call that did not work, as a report.
pub fn failure(error: &ChildError) -> ClientReport {
    match error {
        ChildError::Python { call, reason } => ClientReport::Failed {
            call: (*call).to_owned(),
            reason: reason.clone(),
        },
        ChildError::NoOrders(reason) => ClientReport::Failed {
            call: "the orders".to_owned(),
            reason: reason.clone(),
        },
        ChildError::Moves { .. } => ClientReport::Failed {
            call: "braking".to_owned(),
            reason: error.to_string(),
        },
    }
}
