//! Errors of the process, and their reports.

use std::time::Duration;

use crate::ur::protocol::ClientReport;

/// Reason why the process gives up before it has begun.
#[derive(Debug, thiserror::Error)]
pub enum ChildError {
    /// No orders on stdin: only touchup starts this process.
    #[error(
        "this is started by touchup itself: the first line on stdin has to be an order to begin ({0})"
    )]
    NoOrders(String),
    /// The arm does not come to rest.
    #[error("the arm still moves after braking for {} s", after.as_secs())]
    Moves {
        /// duration of braking
        after: Duration,
    },
    /// A failed call of Python.
    #[error("{call}: {reason}")]
    Python {
        /// name of the call
        call: &'static str,
        /// exception text
        reason: String,
    },
}

/// Report of a failed call.
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
