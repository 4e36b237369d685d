//! Estimates of clock offset and registration from a replay, for the summary only, never applied.

use std::fmt;

use nalgebra::Vector6;
use serde::Serialize;
use touchup_method::haptic::{
    RefineParams, Registrar, Registration, RegistrationError, RegistrationParams,
};
use touchup_method::stylus::{ClockEvidence, ClockOffset, ContactSample, SettingError, SyncParams};

use crate::reported;

reported! {
    /// Clock offset of the wrench against the pose; never applied automatically.
    #[derive(Clone, Copy)]
    pub struct WrenchOffset, pub fn of(found: &ClockOffset, applied: &SyncParams) {
        /// total offset, the scene's and the correction; at the first sample, if it changes
        wrench_offset_ms: f64 = found.ends()[0] * 1e3 + applied.wrench_offset_ns as f64 * 1e-6,
        /// standard uncertainty
        sigma_ms: f64 = found.sigma * 1e3,
        /// part applied by the scene
        applied_offset_ms: f64 = applied.wrench_offset_ns as f64 * 1e-6,
        /// total drift, the scene's and the correction
        wrench_drift_ppm: f64 = (found.drift().map_or(0.0, |of| of.rate) + applied.wrench_drift) * 1e6,
        /// part applied by the scene
        applied_drift_ppm: f64 = applied.wrench_drift * 1e6,
        /// standard uncertainty of the correction; none without a visible drift
        wrench_drift_sigma_ppm: Option<f64> = found.drift().map(|of| of.rate_sigma * 1e6),
        /// time of a step of the offset after the first sample
        step_at_s: Option<f64> = found.step().map(|of| of.at),
        /// total offset after the step
        offset_after_ms: Option<f64> =
            found.step().map(|of| of.offset_after * 1e3 + applied.wrench_offset_ns as f64 * 1e-6),
        /// source of the estimate
        evidence: ClockEvidence = found.evidence,
    }
}

impl fmt::Display for WrenchOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            wrench_offset_ms,
            sigma_ms,
            applied_offset_ms,
            wrench_drift_ppm,
            applied_drift_ppm,
            wrench_drift_sigma_ppm,
            step_at_s,
            offset_after_ms,
            evidence,
        } = *self;
        let is_applied = applied_offset_ms != 0.0 || applied_drift_ppm != 0.0;
        if is_applied {
            write!(
                f,
                "the scene takes {applied_offset_ms:+.1} ms and {applied_drift_ppm:+.1} ppm off the clock of the wrench; beside that "
            )?;
        }
        let [beside_ms, beside_ppm] = [
            wrench_offset_ms - applied_offset_ms,
            wrench_drift_ppm - applied_drift_ppm,
        ];
        write!(
            f,
            "the wrench seems to read {beside_ms:+.1} ± {sigma_ms:.1} ms beyond the pose"
        )?;
        if let Some(ppm_sigma) = wrench_drift_sigma_ppm {
            write!(
                f,
                " at first, and to gain {beside_ppm:+.1} ± {ppm_sigma:.1} ppm"
            )?;
        }
        if let (Some(at), Some(after_ms)) = (step_at_s, offset_after_ms) {
            let after_ms = after_ms - applied_offset_ms;
            return write!(
                f,
                " at first, and {after_ms:+.1} ± {sigma_ms:.1} ms from {at:.1} s on, by {evidence}, not applied"
            );
        }
        write!(f, ", by {evidence}, not applied; ")?;
        if is_applied {
            write!(f, "together ")?;
        }
        write!(f, "sync.wrench_offset_ms: {wrench_offset_ms:.1}")?;
        match wrench_drift_sigma_ppm {
            None => Ok(()),
            Some(_) => write!(f, ", sync.wrench_drift_ppm: {wrench_drift_ppm:.1}"),
        }
    }
}

/// Motion of the scan onto the contacts; never applied automatically.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum ScanOffset {
    /// determined
    Found(FoundOffset),
    /// undetermined
    Refused {
        /// why
        refused: String,
    },
}

reported! {
    #[derive(Clone)]
    /// Shift and turn of the scan with their uncertainties.
    pub struct FoundOffset, fn of(found: &Registration) {
        /// shift of the centre of the contacts, and its standard uncertainty
        shift_mm: [f64; 3] = three(&found.twist, 0, 1e3),
        shift_sigma_mm: [f64; 3] = three(&sigma(found), 0, 1e3),
        /// rotation vector about that centre, and its standard uncertainty
        turn_deg: [f64; 3] = three(&found.twist, 3, 1f64.to_degrees()),
        turn_sigma_deg: [f64; 3] = three(&sigma(found), 3, 1f64.to_degrees()),
        /// surface offset of the scan, outwards
        surface_offset_mm: f64 = found.surface_offset[0] * 1e3,
        surface_offset_sigma_mm: f64 = found.surface_offset[1] * 1e3,
        /// centre of the contacts
        centre_mm: [f64; 3] = (found.centre.coords * 1e3).into(),
    }
}

fn sigma(found: &Registration) -> Vector6<f64> {
    found.covariance.diagonal().map(f64::sqrt)
}

fn three(v: &Vector6<f64>, first: usize, unit: f64) -> [f64; 3] {
    (v.fixed_rows::<3>(first) * unit).into()
}

impl ScanOffset {
    /// The registration as reported.
    pub fn of(found: Result<Registration, RegistrationError>) -> Self {
        match found {
            Ok(found) => Self::Found(FoundOffset::of(&found)),
            Err(refused) => Self::Refused {
                refused: refused.to_string(),
            },
        }
    }
}

impl fmt::Display for ScanOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pairs = |values: &[f64; 3], sigmas: &[f64; 3]| {
            values
                .iter()
                .zip(sigmas)
                .map(|(x, s)| format!("{x:+.3} ± {s:.3}"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        match self {
            Self::Refused { refused } => write!(f, "undetermined: {refused}"),
            Self::Found(found) => {
                write!(
                    f,
                    "shift ({}) mm, ",
                    pairs(&found.shift_mm, &found.shift_sigma_mm)
                )?;
                write!(
                    f,
                    "turn ({})°, ",
                    pairs(&found.turn_deg, &found.turn_sigma_deg)
                )?;
                let [offset, sigma] = [found.surface_offset_mm, found.surface_offset_sigma_mm];
                write!(
                    f,
                    "surface offset {offset:+.3} ± {sigma:.3} mm; not applied"
                )
            }
        }
    }
}

/// Contact points of the part, for the registration.
#[derive(Debug)]
pub(super) struct ContactPoints {
    pub registrar: Registrar,
    /// minimum speed for a known surface normal, m/s
    slowest: f64,
    radius: f64,
}

impl ContactPoints {
    pub fn new(params: &RefineParams) -> Result<Self, SettingError> {
        let registration = RegistrationParams {
            scan_noise: params.scan_noise,
            ..RegistrationParams::default()
        };
        Ok(Self {
            registrar: Registrar::new(registration)?,
            slowest: params.sliding.unwrap_or_default().slowest,
            radius: params.tip.radius,
        })
    }

    pub fn push(&mut self, sample: &ContactSample) {
        let ContactSample { ball, surface, .. } = sample;
        if let Some(surface) = surface.filter(|_| ball.velocity.norm() > self.slowest) {
            self.registrar.push(
                &(ball.centre - surface.normal * self.radius),
                &surface.normal,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 ms applied, and 1.5 ms found beside them.
    #[test]
    fn an_offset_that_the_scene_applies_is_told_as_applied() {
        let found = ClockOffset {
            offset: 1.5e-3,
            sigma: 1e-3,
            change: None,
            evidence: ClockEvidence::Onsets(30),
        };
        let told = |wrench_offset_ns| {
            let applied = SyncParams {
                wrench_offset_ns,
                ..SyncParams::default()
            };
            WrenchOffset::of(&found, &applied).to_string()
        };
        assert_eq!(
            told(0),
            "the wrench seems to read +1.5 ± 1.0 ms beyond the pose, by 30 onsets of contact, not applied; sync.wrench_offset_ms: 1.5"
        );
        assert_eq!(
            told(20_000_000),
            "the scene takes +20.0 ms and +0.0 ppm off the clock of the wrench; beside that the wrench seems to read +1.5 ± 1.0 ms \
             beyond the pose, by 30 onsets of contact, not applied; together sync.wrench_offset_ms: 21.5"
        );
    }
}
