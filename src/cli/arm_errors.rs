//! By what a simulated arm differs from what its scene tells of it.

use clap::ValueEnum;
use nalgebra::{Point3, Vector3};

use crate::sim::{ArmErrorSigmas, ArmErrors, ArmFault, SimArm};

/// By what a simulated arm differs from what is told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ArmErrorsName {
    /// By nothing
    None,
    /// By what is left of a UR after calibration, drawn from --seed: standard deviations 10 % of
    /// the stiffness, 0.002 mm of the ball's radius, 0.05 mm and 0.02° of the place of the part,
    /// 0.03 mm of repeatability
    Calibrated,
    /// By nothing, until the probe is bent aside by 1 mm after its twelfth contact
    Bent,
}

/// How the probe is bent, m in the axes of the tip, and after how many contacts.
const BEND: (usize, Vector3<f64>) = (12, Vector3::new(0.8e-3, 0.6e-3, 0.0));

impl ArmErrorsName {
    /// The errors of a seed.
    ///
    /// - `registered_at`: where the place of the part is known best, m in O.
    pub fn drawn(self, registered_at: Point3<f64>, seed: u64) -> ArmErrors {
        match self {
            Self::None | Self::Bent => ArmErrors::NONE,
            Self::Calibrated => ArmErrors::draw(&ArmErrorSigmas::CALIBRATED, registered_at, seed),
        }
    }

    /// Has happen to a simulated arm what happens while it works.
    pub fn befall(self, arm: &mut SimArm) {
        if self == Self::Bent {
            let (contacts, by) = BEND;
            arm.fail_after_contacts(contacts, ArmFault::TipBent(by));
        }
    }
}
