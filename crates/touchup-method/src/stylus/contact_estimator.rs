//! Contact state at one sample, decided once for all users.
//!
//! [`ContactEstimator::observe`] turns a raw [`Sample`] into a [`ContactSample`]: wrench without
//! weight, lever arm and bias, real ball centre, contact and its onset, surface normal within the
//! friction cone. The haptic update, the reconstruction, the registration of the scan, the clock
//! estimate and the node all read this one value.
//!
//! Two uses differ on purpose, in this alone. The evidence of the reconstruction may wait: it takes
//! [`ContactSample::contact`], by the unsmoothed force, and smooths [`ContactSample::centre`] and
//! the force over a symmetric window. The haptic update and the registration answer at once, by
//! causally smoothed position and force ([`ContactSample::ball`]): their contact is
//! [`ContactSample::ball_contact`], the same thresholds on the smoothed force, so that a ball whose
//! filter still holds free motion does not count as touching. Bias, thresholds and
//! [`WIDEST_CONE_COSINE`](super::WIDEST_CONE_COSINE) are the same for both.

use nalgebra::{Point3, Vector3};

use super::free_motion::FreeMotion;
use super::{
    Ball, BiasParams, BiasTracker, Compensator, CompensatorParams, Contact, ContactGate,
    ContactGateParams, FrictionCoefficient, LONGEST_HOLD, NormalEstimate, Sample, SampleError,
    SettingError, SlidingParams, Tip, TipMotion, TipParams, TouchState,
};

/// Settings of a [`ContactEstimator`]; `None` disables a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEstimatorParams {
    /// Weight, constant bias, frames.
    pub compensator: CompensatorParams,
    /// Slow drift of the sensor, followed in free air; `None`: no drift.
    pub bias: Option<BiasParams>,
    /// Thresholds of contact; `None`: every sample is contact \[paper\].
    pub gate: Option<ContactGateParams>,
    /// Size and stiffness of the tip.
    pub tip: TipParams,
    /// Smoothing and friction; `None`: the raw sample, with the force as the normal.
    pub sliding: Option<SlidingParams>,
}

impl ContactEstimatorParams {
    /// All parts with their defaults, for a sensor without payload: the settings for evidence of
    /// the reconstruction.
    pub fn new(tip: TipParams) -> Self {
        let gate = ContactGateParams::default();
        Self {
            compensator: CompensatorParams::default(),
            bias: Some(BiasParams::default()),
            gate: Some(gate),
            tip,
            sliding: Some(SlidingParams::default()),
        }
    }

    /// Adds default thresholds and smoothing if the haptic update lacks either; `None` if it has
    /// both, so that its own contacts serve.
    pub fn completed(self) -> Option<Self> {
        let is_complete = self.gate.is_some() && self.sliding.is_some();
        let (gate, sliding) = (
            Some(self.gate.unwrap_or_default()),
            Some(self.sliding.unwrap_or_default()),
        );
        (!is_complete).then_some(Self {
            gate,
            sliding,
            ..self
        })
    }
}

/// One sample with all decisions about its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSample {
    /// pose, and wrench without weight and bias
    pub tip: Tip,
    /// time since the previous sample, s; 0 for the first
    pub dt: f64,
    /// tracked bias of the force, in the axes of T, N
    pub bias_t: Vector3<f64>,
    /// real ball centre, m, in O: reported centre plus deflection of the stylus
    pub centre: Point3<f64>,
    /// by the unsmoothed force; `None` in free motion, and for a touch below the thresholds
    pub contact: Option<Contact>,
    /// whether noise and zero error of the sensor explain the force; neither free nor in contact:
    /// perhaps a light touch
    pub is_free: bool,
    /// the causally smoothed ball
    pub ball: Ball,
    /// contact of [`Self::ball`], by the force smoothed likewise; `None` in free motion
    pub ball_contact: Option<Contact>,
    /// the surface under [`Self::ball`], within the friction cone; `None` without
    /// [`Self::ball_contact`] or force
    pub surface: Option<NormalEstimate>,
}

impl ContactSample {
    /// Whether the stylus touches, by the unsmoothed force.
    pub fn is_in_contact(&self) -> bool {
        self.contact.is_some()
    }

    /// State by the unsmoothed force.
    pub(crate) fn state(&self) -> TouchState {
        state_of(self.contact, self.is_free)
    }

    /// State by the causally smoothed force.
    pub(crate) fn ball_state(&self) -> TouchState {
        state_of(self.ball_contact, self.is_free)
    }
}

fn state_of(contact: Option<Contact>, is_free: bool) -> TouchState {
    match contact {
        Some(_) => TouchState::Contact,
        None if is_free => TouchState::Free,
        None => TouchState::Light,
    }
}

/// Decides bias, contact and friction, sample by sample.
///
/// # Example
/// ```
/// use nalgebra::{Isometry3, Vector3};
/// use touchup_method::stylus::{ContactEstimator, ContactEstimatorParams, Sample, TipParams, Wrench};
///
/// let tip = TipParams { radius: 1.5e-3, stiffness: Some(2e4) };
/// let mut estimator = ContactEstimator::new(ContactEstimatorParams::new(tip))?;
/// let pressed = |ms: i64, newtons: f64| Sample {
///     stamp_ns: ms * 1_000_000,
///     pose_ot: Isometry3::identity(),
///     wrench: Wrench { force: Vector3::new(0.0, 0.0, newtons), torque: Vector3::zeros() },
/// };
/// assert!(!estimator.observe(&pressed(0, 0.1))?.is_in_contact());
/// let touching = estimator.observe(&pressed(1, 2.0))?;
/// assert_eq!(touching.contact.map(|contact| contact.onset_ns), Some(1_000_000));
/// assert!((touching.centre.z - 2.0 / 2e4).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ContactEstimator {
    params: ContactEstimatorParams,
    compensator: Compensator,
    bias: Option<BiasTracker>,
    free_motion: FreeMotion,
    gate: Option<ContactGate>,
    /// gate of the smoothed force
    ball_gate: Option<ContactGate>,
    motion: TipMotion,
    first_ns: Option<i64>,
    latest: Option<ContactSample>,
}

impl ContactEstimator {
    /// An estimator without samples yet.
    ///
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(params: ContactEstimatorParams) -> Result<Self, SettingError> {
        Ok(Self {
            compensator: Compensator::new(params.compensator)?,
            bias: params.bias.map(BiasTracker::new).transpose()?,
            free_motion: FreeMotion::new(params.gate.unwrap_or_default().free),
            gate: params.gate.map(ContactGate::new).transpose()?,
            ball_gate: params.gate.map(ContactGate::new).transpose()?,
            motion: TipMotion::new(params.sliding.unwrap_or_default(), params.tip),
            first_ns: None,
            latest: None,
            params,
        })
    }

    /// Takes the next raw sample.
    ///
    /// # Errors
    /// [`SampleError`] for a sample that is not finite, absurd or not after the last; the state
    /// then stays unchanged.
    #[inline]
    pub fn observe(&mut self, sample: &Sample) -> Result<&ContactSample, SampleError> {
        sample.check()?;
        let dt = sample.seconds_since(self.latest.as_ref().map(|latest| latest.tip.stamp_ns))?;
        Ok(self.decide(self.compensator.compensate(sample), dt))
    }

    fn decide(&mut self, mut tip: Tip, dt: f64) -> &ContactSample {
        let free_motion = &mut self.free_motion;
        let mut is_free = false;
        let bias_t = match &mut self.bias {
            Some(bias) => {
                let mut decide = |rest: &Vector3<f64>| {
                    is_free = free_motion.update(rest, dt);
                    is_free
                };
                tip.force_o = bias.compensate(&tip, &mut decide);
                bias.bias_t()
            }
            None => {
                is_free = free_motion.update(&tip.force_o, dt);
                Vector3::zeros()
            }
        };
        let ball = match self.params.sliding {
            Some(_) => self.motion.update(&tip, dt, LONGEST_HOLD),
            None => self.motion.unfiltered(&tip),
        };
        let always = Contact {
            onset_ns: *self.first_ns.get_or_insert(tip.stamp_ns),
        };
        let decide = |gate: &mut Option<ContactGate>, force_o: &Vector3<f64>| match gate {
            Some(gate) => gate.update(tip.stamp_ns, force_o),
            None => Some(always),
        };
        let contact = decide(&mut self.gate, &tip.force_o);
        let ball_contact = decide(&mut self.ball_gate, &ball.force_o);
        let surface = match (ball_contact, self.params.sliding) {
            (Some(_), Some(_)) => self.motion.surface_normal(&ball, dt.min(LONGEST_HOLD)),
            (Some(_), None) => NormalEstimate::of_force(&ball.force_o),
            (None, _) => {
                self.motion.lift();
                None
            }
        };
        let reported = tip.pose_ot.translation.vector.into();
        let centre = self.params.tip.centre(&reported, &tip.force_o);
        let is_free = is_free && contact.is_none();
        self.latest.insert(ContactSample {
            tip,
            dt,
            bias_t,
            centre,
            contact,
            is_free,
            ball,
            ball_contact,
            surface,
        })
    }

    /// Last sample; `None` before the first.
    pub fn latest(&self) -> Option<&ContactSample> {
        self.latest.as_ref()
    }

    /// Number of contacts of the smoothed ball; 0 without contact thresholds.
    pub fn contacts(&self) -> u64 {
        self.ball_gate.as_ref().map_or(0, ContactGate::contacts)
    }

    /// Measured kinetic friction; `None` until the ball has slid far enough, or without `sliding`.
    pub fn friction(&self) -> Option<FrictionCoefficient> {
        self.motion.friction()
    }
}
