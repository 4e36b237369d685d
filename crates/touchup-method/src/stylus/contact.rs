//! Contact detection: a gate on the measured force, with hysteresis.

use nalgebra::Vector3;

use super::SettingError;
use crate::parameters;

/// Longest pause in contact within one stroke, ns: a bounce of the hand, not a lift.
pub(crate) const STROKE_PAUSE_NS: i64 = 100_000_000;
/// Maximum duration for which a sample acts, s: a longer pause is unknown.
pub(crate) const LONGEST_HOLD: f64 = 0.03;

parameters! {
    /// The two thresholds of a [`ContactGate`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ContactGateParams in "contact" {
        /// Force above which a contact begins; no less than off_n.
        ///
        /// In N. Eight times the 0.05 N variation of noise and bias of a usual sensor, and far
        /// below the 2–4 N of a pressing hand.
        on: f64 = 0.4, "on_n" [N, 0, 1000];
        /// Force below which a contact ends.
        ///
        /// In N. Above noise and bias together, and low enough below `on` that noise at the
        /// threshold does not chatter.
        off: f64 = 0.22, "off_n" [N, 0, 1000];
        /// Largest error of the zero of the sensor, below on_n: a force above it, beyond the noise,
        /// may be a light touch, which neither moves the mesh nor frees space.
        ///
        /// In N. Three times the 0.05 N variation of the bias of a usual sensor.
        free: f64 = 0.15, "free_n" [N, 0, 1000];
    }
    check ContactGateParams::is_in_order;
}

impl ContactGateParams {
    fn is_in_order(&self) -> Result<(), SettingError> {
        let allowed = format!("contact.off_n to 1000 N, and contact.off_n is {}", self.off);
        SettingError::check("contact.on_n", self.on, self.on >= self.off, &allowed)
    }
}

/// State of the stylus by its force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchState {
    /// Pressing.
    Contact,
    /// Perhaps pressing, too lightly for a contact: no information on the material.
    Light,
    /// Touching nothing.
    Free,
}

/// An ongoing contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contact {
    /// Time of its first sample, ns.
    pub onset_ns: i64,
}

/// Separates contact from free motion by |F|: on above one threshold, off below a lower one.
///
/// Without it the expected force of a hovering stylus (f(0) > 0) would push the mesh away for ever.
#[derive(Clone, Debug)]
pub struct ContactGate {
    params: ContactGateParams,
    contact: Option<Contact>,
    contacts: u64,
}

impl ContactGate {
    /// A gate without contact.
    ///
    /// # Errors
    /// [`SettingError`] unless 0 ≤ `off` ≤ `on` ≤ 1000.
    pub fn new(params: ContactGateParams) -> Result<Self, SettingError> {
        params.check()?;
        Ok(Self {
            params,
            contact: None,
            contacts: 0,
        })
    }

    /// Takes the next force, N, in any frame; returns the new or continuing contact, if any.
    #[inline]
    pub fn update(&mut self, stamp_ns: i64, force: &Vector3<f64>) -> Option<Contact> {
        let magnitude = force.norm();
        self.contact = match self.contact {
            Some(contact) if magnitude >= self.params.off => Some(contact),
            None if magnitude > self.params.on => {
                self.contacts += 1;
                Some(Contact { onset_ns: stamp_ns })
            }
            _ => None,
        };
        self.contact
    }

    /// Number of contacts begun.
    pub fn contacts(&self) -> u64 {
        self.contacts
    }
}
