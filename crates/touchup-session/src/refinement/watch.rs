//! Watches the input of a refinement.

use touchup_features::diagnose::{InputMonitor, InputMonitorParams};
use touchup_method::haptic::RefineParams;
use touchup_method::stylus::{ContactEstimator, ContactSample, Sample, SettingError};

/// Watches messages, samples, and decisions on their contact.
#[derive(Debug)]
pub(super) struct InputWatch {
    pub monitor: InputMonitor,
    /// decides on contact if the update takes every sample for contact, without a decision
    observer: Option<ContactEstimator>,
}

impl InputWatch {
    pub fn new(monitor: InputMonitorParams, params: &RefineParams) -> Result<Self, SettingError> {
        let observer = params
            .contact()
            .completed()
            .map(ContactEstimator::new)
            .transpose()?;
        Ok(Self {
            monitor: InputMonitor::new(monitor)?,
            observer,
        })
    }

    /// Notes an accepted sample; returns its contact.
    ///
    /// - `decided`: decision of the update on its contact.
    pub fn sample(
        &mut self,
        sample: &Sample,
        decided: Option<&ContactSample>,
    ) -> Option<ContactSample> {
        let contact = match &mut self.observer {
            Some(observer) => observer.observe(sample).ok().copied(),
            None => decided.copied(),
        };
        self.monitor.sample(sample);
        if let Some(contact) = &contact {
            self.monitor.contact(contact);
        }
        contact
    }
}
