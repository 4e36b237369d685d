//! Reports who else is on a topic: to the log, and to the node for its diagnostics.

use super::arrivals::Arrivals;
use super::port::{Arrival, Endpoint};

/// - `mismatch`: why one of them does not fit.
pub(super) fn report(arrivals: &Arrivals, topic: String, count: usize, mismatch: Option<String>) {
    match &mismatch {
        Some(reason) => tracing::warn!(topic, "{reason}"),
        None => tracing::info!(topic, others = count, "who is on a topic has changed"),
    }
    arrivals.put(Arrival::Matched(Endpoint { topic, count, mismatch }));
}
