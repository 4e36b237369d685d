//! Errors of a real arm relative to its description.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::random::{gauss, gauss_vector};
use touchup_probing::arm::{ArmGeometry, MOST_JOINTS, UrGeometry};

/// True less nominal values, and errors that differ from touch to touch. Zero: an ideal arm.
///
/// Encoder offsets and link lengths make an error of place that varies smoothly over the workspace:
/// the reported pose comes from the nominal kinematics, the place of the ball from the true ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmErrors {
    /// relative excess of the stiffness along each axis of the base
    pub stiffness: Vector3<f64>,
    /// excess of the ball's radius, m
    pub radius: f64,
    /// error of the ball's centre, in the axes of the tip, m
    pub tip: Vector3<f64>,
    /// displacement of the part, in O, m
    pub shift: Vector3<f64>,
    /// rotation of the part, a scaled axis in O, rad
    pub turn: Vector3<f64>,
    /// fixed point of the rotation, m in O
    pub turned_about: Point3<f64>,
    /// encoder offsets, from the base to the wrist, rad
    pub joints: [f64; MOST_JOINTS],
    /// errors of d₁, a₂, a₃, d₄, d₅, d₆ of a UR, m
    pub lengths: [f64; 6],
    /// standard deviation of the ball's place along each axis from one approach to the next, m
    pub repeatability: f64,
    /// play of the drives: the ball follows the reported place within this distance, m
    pub play: f64,
}

/// Standard deviations of [`ArmErrors::draw`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmErrorSigmas {
    /// share of the stiffness
    pub stiffness: f64,
    /// radius of the ball, m
    pub radius: f64,
    /// place of the tip in the flange along each axis, m
    pub tip: f64,
    /// place of the part in the base along each axis, m
    pub shift: f64,
    /// rotation of the part about each axis, rad
    pub turn: f64,
    /// each encoder, rad
    pub joints: f64,
    /// each length, m
    pub lengths: f64,
    /// as in [`ArmErrors`], not drawn, m
    pub repeatability: f64,
    /// play, m: the draw uses its absolute value
    pub play: f64,
}

impl ArmErrorSigmas {
    /// A UR with probe and part calibrated by its own touches: a ball known to 2 µm, its place and
    /// the part's to some hundredths of a millimetre, repeatability 0.03 mm by its data sheet.
    pub const CALIBRATED: Self = Self {
        stiffness: 0.1,
        radius: 2e-6,
        tip: 0.0,
        shift: 50e-6,
        turn: 0.35e-3,
        joints: 0.0,
        lengths: 0.0,
        repeatability: 30e-6,
        play: 0.0,
    };
}

impl ArmErrors {
    /// An ideal arm.
    pub const NONE: Self = Self {
        stiffness: Vector3::new(0.0, 0.0, 0.0),
        radius: 0.0,
        tip: Vector3::new(0.0, 0.0, 0.0),
        shift: Vector3::new(0.0, 0.0, 0.0),
        turn: Vector3::new(0.0, 0.0, 0.0),
        turned_about: Point3::new(0.0, 0.0, 0.0),
        joints: [0.0; MOST_JOINTS],
        lengths: [0.0; 6],
        repeatability: 0.0,
        play: 0.0,
    };

    /// Normal errors of a seed.
    ///
    /// - `turned_about`: best registered place of the part, m in O.
    pub fn draw(sigmas: &ArmErrorSigmas, turned_about: Point3<f64>, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x7c15_9e37_79b9_4a7f);
        Self {
            stiffness: gauss_vector(&mut rng) * sigmas.stiffness,
            radius: gauss(&mut rng) * sigmas.radius,
            tip: gauss_vector(&mut rng) * sigmas.tip,
            shift: gauss_vector(&mut rng) * sigmas.shift,
            turn: gauss_vector(&mut rng) * sigmas.turn,
            turned_about,
            joints: std::array::from_fn(|_| gauss(&mut rng) * sigmas.joints),
            lengths: std::array::from_fn(|_| gauss(&mut rng) * sigmas.lengths),
            repeatability: sigmas.repeatability,
            play: gauss(&mut rng).abs() * sigmas.play,
        }
    }

    /// Displacement of the part from its nominal to its true pose; maps nominal O to O, in
    /// coordinates of O.
    pub fn displacement(&self) -> Isometry3<f64> {
        let about = self.turned_about.coords;
        let turned = Isometry3::from_parts(
            Translation3::from(about + self.shift),
            UnitQuaternion::new(self.turn),
        );
        turned * Translation3::from(-about)
    }

    /// An arm with its true lengths; unchanged for other arms than a UR.
    pub(super) fn geometry(&self, told: &ArmGeometry) -> ArmGeometry {
        let ArmGeometry::Ur(told) = told else {
            return told.clone();
        };
        let [d1, a2, a3, d4, d5, d6] = self.lengths;
        let truly = UrGeometry {
            d1: told.d1 + d1,
            a2: told.a2 + a2,
            a3: told.a3 + a3,
            d4: told.d4 + d4,
            d5: told.d5 + d5,
            d6: told.d6 + d6,
            ..*told
        };
        truly.into()
    }
}
