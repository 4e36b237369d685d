//! What speaks against the input while it comes: looked for beside the samples, every few seconds.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tracing::warn;

use super::setup::Setup;
use super::side_work::SideWork;
use crate::clock::Clock;
use crate::diagnose::{InputCause, InputFinding, InputMonitor};
use crate::ros::locked;

/// The input is looked at so often.
const LOOKED_EVERY: Duration = Duration::from_secs(5);
/// What is no doubt while somebody may still come to touch something, or what the state of the
/// streams says itself.
const OF_OTHERS: [InputCause; 4] = [
    InputCause::NoContact,
    InputCause::FewContacts,
    InputCause::NoSample,
    InputCause::StampsGoBack,
];

/// What was found, and what looks for more.
#[derive(Debug)]
pub struct InputDoubts {
    work: SideWork,
    looked: Instant,
    /// samples that were accepted then
    accepted: u64,
    found: Arc<Mutex<Vec<InputFinding>>>,
}

impl InputDoubts {
    /// Nothing was looked at yet.
    pub fn on(clock: &Clock) -> Self {
        Self {
            work: SideWork::on(clock.clone()),
            looked: clock.now(),
            accepted: 0,
            found: Arc::default(),
        }
    }

    /// Looks at what came, on a thread of its own, where it is time and there is something new.
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
            Arc::clone(&setup.scan),
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

    /// What was said of a session before means nothing in the next.
    pub fn restart(&mut self) {
        // what still looks writes to what nobody reads any more
        (self.accepted, self.found) = (0, Arc::default());
    }

    /// The surest.
    pub fn first(&self) -> Option<InputFinding> {
        locked(&self.found).first().cloned()
    }
}
