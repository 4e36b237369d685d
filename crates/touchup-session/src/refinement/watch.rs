//! What watches the input of a refinement.

use touchup_core::diagnose::{InputMonitor, InputMonitorParams};
use touchup_core::haptic::{RefineParams, Refiner};
use touchup_core::stylus::{ContactEstimator, ContactSample, Sample, SettingError};

/// Watches messages, samples, and what is decided about their contact.
#[derive(Debug)]
pub(super) struct InputWatch {
    pub monitor: InputMonitor,
    /// decides where the update takes every sample for contact, which says nothing about it
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

    /// A sample that was taken; returns what is decided about its contact.
    ///
    /// - `refiner`: as that sample has left it.
    pub fn sample(&mut self, sample: &Sample, refiner: &Refiner) -> Option<ContactSample> {
        let contact = match &mut self.observer {
            Some(observer) => observer.observe(sample).ok().copied(),
            None => refiner.contact().copied(),
        };
        self.monitor.sample(sample);
        if let Some(contact) = &contact {
            self.monitor.contact(contact);
        }
        contact
    }
}
