//! Doubts about the input while it comes: checked beside the samples, every few seconds.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tracing::warn;

use crate::node::setup::Setup;
use crate::node::side_work::SideWork;
use crate::ros::locked;
use touchup_features::diagnose::{InputCause, InputFinding, InputMonitor};
use touchup_session::clock::Clock;

/// Period of checks of the input.
const LOOKED_EVERY: Duration = Duration::from_secs(5);
/// Findings that are no doubt before the first touches, or that the state of the streams covers.
const OF_OTHERS: [InputCause; 4] = [
    InputCause::NoContact,
    InputCause::FewContacts,
    InputCause::NoSample,
    InputCause::StampsGoBack,
];

/// The findings, and the running check.
#[derive(Debug)]
pub struct InputDoubts {
    work: SideWork,
    looked: Instant,
    /// samples accepted at the last check
    accepted: u64,
    found: Arc<Mutex<Vec<InputFinding>>>,
}

impl InputDoubts {
    /// Before the first check.
    pub fn on(clock: &Clock) -> Self {
        Self {
            work: SideWork::on(clock.clone()),
            looked: clock.now(),
            accepted: 0,
            found: Arc::default(),
        }
    }

    /// Checks the input on a thread of its own, if it is time and there are new samples.
    pub fn look(&mut self, setup: &Setup, monitor: &InputMonitor, accepted: u64) {
        let now = setup.clock.now();
        let is_due =
            now.saturating_duration_since(self.looked) >= LOOKED_EVERY && accepted != self.accepted;
        if !is_due || self.work.count() > 0 {
            return;
        }
        (self.looked, self.accepted) = (now, accepted);
        let (monitor, scan, found) = (
            monitor.clone(),
            Arc::clone(&setup.input.scan),
            Arc::clone(&self.found),
        );
        let look = move || {
            let mut findings = monitor.findings(&scan.0, &scan.1);
            findings.retain(|finding| !OF_OTHERS.contains(&finding.cause));
            *locked(&found) = findings;
        };
        if let Err(error) = self.work.begin("doubts", look) {
            warn!("the input is not looked at: {error}");
        }
    }

    /// Forgets the findings of the previous session.
    pub fn restart(&mut self) {
        // a check still running writes to a result without readers
        (self.accepted, self.found) = (0, Arc::default());
    }

    /// The most certain finding.
    pub fn first(&self) -> Option<InputFinding> {
        locked(&self.found).first().cloned()
    }
}
