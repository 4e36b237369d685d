//! Error models of a simulated arm, relative to its scene.

use clap::ValueEnum;
use nalgebra::{Point3, Vector3};

use touchup_sim::{ArmErrorSigmas, ArmErrors, ArmFault, SimArm};

/// Error model of a simulated arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum ArmErrorsName {
    /// No errors
    None,
    /// Residual errors of a calibrated UR, drawn from --seed: standard deviations 10 % of the
    /// stiffness, 0.002 mm of the tip radius, 0.05 mm and 0.02° of the part's pose, 0.03 mm of
    /// repeatability
    Calibrated,
    /// No errors, until the probe bends aside by 1 mm after its twelfth contact
    Bent,
}

/// Contacts before the bend, and the bend in the axes of the tip, m.
const BEND: (usize, Vector3<f64>) = (12, Vector3::new(0.8e-3, 0.6e-3, 0.0));

impl ArmErrorsName {
    /// Errors for a seed.
    ///
    /// - `registered_at`: point of the most certain registration, m in O.
    pub fn drawn(self, registered_at: Point3<f64>, seed: u64) -> ArmErrors {
        match self {
            Self::None | Self::Bent => ArmErrors::NONE,
            Self::Calibrated => ArmErrors::draw(&ArmErrorSigmas::CALIBRATED, registered_at, seed),
        }
    }

    /// Schedules the faults of this model in a simulated arm.
    pub fn befall(self, arm: &mut SimArm) {
        if self == Self::Bent {
            let (contacts, by) = BEND;
            arm.fail_after_contacts(contacts, ArmFault::TipBent(by));
        }
    }
}
