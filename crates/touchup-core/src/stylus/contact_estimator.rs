//! The state of the contact at one sample, decided once for all its users.
//!
//! [`ContactEstimator::observe`] turns a raw [`Sample`] into a [`ContactSample`]: weight, lever arm
//! and bias off the wrench, the real centre of the ball, in contact or not and since when, and the
//! normal of the surface within the friction cone. The haptic update, the reconstruction, the
//! registration of the scan, the clock estimate and the node all read this one value.
//!
//! Two uses differ on purpose, and in this alone. The evidence of the reconstruction may wait: it
//! takes [`ContactSample::contact`], which the unsmoothed force decides, and smooths
//! [`ContactSample::centre`] and the force over a window that looks as far ahead as back. The
//! haptic update and the registration answer at once, by position and force smoothed by the past
//! ([`ContactSample::ball`]): for them it is [`ContactSample::ball_contact`], the same thresholds
//! on the smoothed force, so that a ball whose filter still holds free motion is not taken for one
//! that touches. Bias, thresholds and [`WIDEST_CONE_COSINE`](super::WIDEST_CONE_COSINE) are the
//! same for both.

use nalgebra::{Point3, Vector3};

use super::free_motion::FreeMotion;
use super::{
    Ball, BiasParams, BiasTracker, Compensator, CompensatorParams, Contact, ContactGate,
    ContactGateParams, FrictionCoefficient, LONGEST_HOLD, NormalEstimate, Sample, SampleError,
    SettingError, SlidingParams, Tip, TipMotion, TipParams, TouchState,
};

/// Settings of a [`ContactEstimator`]. What is `None` is not built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEstimatorParams {
    /// Weight, constant bias, frames.
    pub compensator: CompensatorParams,
    /// Slow drift of the sensor, followed in free air; `None`: it has none.
    pub bias: Option<BiasParams>,
    /// Thresholds of contact; `None`: every sample is contact \[paper\].
    pub gate: Option<ContactGateParams>,
    /// Size and stiffness of the tip.
    pub tip: TipParams,
    /// Smoothing and friction; `None`: the sample as it is, with the force as the normal.
    pub sliding: Option<SlidingParams>,
}

impl ContactEstimatorParams {
    /// All of it with its defaults, for a sensor that carries nothing: what evidence for the
    /// reconstruction needs.
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

    /// With default thresholds and smoothing where the haptic update does without one of them;
    /// `None` where it has both, so that its own contacts do.
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

/// One sample with all that is decided about its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSample {
    /// pose, and wrench without weight and bias
    pub tip: Tip,
    /// time since the sample before, s; 0 for the first
    pub dt: f64,
    /// bias of the force as tracked so far, in the axes of T, N
    pub bias_t: Vector3<f64>,
    /// real centre of the ball, m, in O: the reported one and the deflection of the stylus
    pub centre: Point3<f64>,
    /// by the unsmoothed force; `None` in free motion, and for a touch too light for the thresholds
    pub contact: Option<Contact>,
    /// whether nothing is touched: noise and zero of the sensor explain the force. Neither this nor
    /// in contact: perhaps a light touch
    pub is_free: bool,
    /// the ball smoothed by the past
    pub ball: Ball,
    /// … and its contact, by the force smoothed alike; `None` in free motion
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

    /// What the unsmoothed force says.
    pub fn state(&self) -> TouchState {
        state_of(self.contact, self.is_free)
    }

    /// What the force says that is smoothed by the past.
    pub fn ball_state(&self) -> TouchState {
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
/// use touchup_core::stylus::{ContactEstimator, ContactEstimatorParams, Sample, TipParams, Wrench};
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
    /// of the smoothed force
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
    /// [`SampleError`] for one that is not finite, absurd or not after the last; nothing is changed
    /// then.
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

    /// The last sample that was taken; `None` before the first.
    pub fn latest(&self) -> Option<&ContactSample> {
        self.latest.as_ref()
    }

    /// How many contacts of the smoothed ball have begun; 0 without thresholds of contact.
    pub fn contacts(&self) -> u64 {
        self.ball_gate.as_ref().map_or(0, ContactGate::contacts)
    }

    /// Kinetic friction as measured so far; `None` until the ball has slid far enough, or without
    /// `sliding`.
    pub fn friction(&self) -> Option<FrictionCoefficient> {
        self.motion.friction()
    }
}
