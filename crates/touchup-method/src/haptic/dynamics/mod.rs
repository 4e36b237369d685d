//! Face dynamics: motion and turn of a touched face by one held sample \[paper, Eq 1–7\].
//!
//! ```text
//! h = (p − b)·n      F* = f(h) n      db/dt = α ((F − F*)·n) a      dn/dt = β (F* × F) × n
//! ```
//!
//! p and F are constant over the step; a is n(0), or F/|F| ([`MotionDirection`]). Two sub-flows have exact
//! solutions:
//!
//! - **position**, n frozen: b = b₀ + s a, ds/dt = α (F·n − f(h₀ − (a·n) s)). With n, a·n is
//!   constant: h obeys dh/dt = −α (a·n) (F·n − f(h)): the equation for a = n with α (a·n) in the
//!   place of α. A moving tip or a turning face adds a drift v to dh/dt, frozen as well.
//! - **rotation**, the impulse J = ∫ f dt given: n turns towards F by tan(θ/2) → tan(θ/2)
//!   e^(−β|F|J).
//!
//! [`StepRule::Lie`] does one after the other. For F parallel to n that is the exact solution,
//! whatever dt; otherwise [`StepRule::Bounded`] solves both together to [`RELATIVE_ERROR`].

mod bounded;
mod contact_model;
mod dormand_prince;
mod error;
mod rotation;
mod sigmoid_flow;

use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use crate::words;
use touchup_geometry::numeric::length_and_direction;

pub use contact_model::{ContactModel, LARGEST_SHARE, SigmoidParams};
use contact_model::{Hold, Shift};
pub use dormand_prince::dormand_prince;
pub use error::DynamicsError;
pub use rotation::turn;

/// Tolerance on |n| = 1 of the input: six digits in a file are enough.
pub(crate) const UNIT_TOLERANCE: f64 = 1e-6;
/// Largest error of [`StepRule::Bounded`]: of the position over the farthest travel, of the normal
/// over 1. Larger roundings of the input decide instead.
pub const RELATIVE_ERROR: f64 = 1e-9;
/// Bound of the impulse (times α) that turns a face by one, m: beyond it the face does not turn.
const NO_TURNING: f64 = 1e100;
/// Decay z below which the weight of the end is 1/2 + z/12 to rounding.
const SMALL_DECAY: f64 = 1e-5;

/// Face in the dynamics: a point and a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceState {
    /// b*: barycentre, m, in O
    pub b: Point3<f64>,
    /// n*: outward normal, |n*| = 1, in O
    pub n: Vector3<f64>,
}

words! {
    /// Combination of the two sub-flows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum StepRule {
        /// Position, then rotation: first order, exact for F parallel to n.
        #[default]
        Lie = "lie",
        /// The position flow again with the drift and the mean normal due to the rotation: second
        /// order.
        DriftCorrected = "corrected",
        /// The coupled equations to [`RELATIVE_ERROR`], however stiff: adaptive and implicit, and
        /// far slower (`cargo bench --bench dynamics`).
        Bounded = "bounded",
        /// Adaptive Runge–Kutta on the coupled equations: for comparison, refuses stiff steps.
        DormandPrince = "dp5",
    }
}

words! {
    /// Direction a of the motion of b*.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum MotionDirection {
        /// n*(0) \[paper, Eq 6\]: n* at the first touch of the face, or at the start of the step if
        /// no other is given.
        InitialNormal = "normal0",
        /// F/|F|, which stays bounded for a far-off n*; n* at the start if F = 0.
        #[default]
        Force = "force",
    }
}

/// Parameters of [`FaceDynamics`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicsParams {
    /// Expected force over depth.
    pub model: ContactModel,
    /// α, m/(N·s), ≥ 0
    pub alpha_m_per_n_s: f64,
    /// β, 1/(N²·s), ≥ 0
    pub beta_per_n2_s: f64,
    /// Order and cost of the step.
    pub rule: StepRule,
    /// Direction of motion.
    pub along: MotionDirection,
    /// Compares h with f⁻¹(F·n) ([`ContactModel::rigid_offset`]) instead of 0, so that a face at
    /// rest lies at the tip whatever the force; clamps F·n between f(0) and [`LARGEST_SHARE`] ·
    /// f_max.
    pub take_out_rigid_offset: bool,
}

impl Default for DynamicsParams {
    /// The paper's α, β, h_min, δ, with the f_max of 10 N that the paper leaves open; the robust
    /// choice for the rest.
    fn default() -> Self {
        Self {
            model: ContactModel::Sigmoid(SigmoidParams::default()),
            alpha_m_per_n_s: 0.1,
            beta_per_n2_s: 0.1,
            rule: StepRule::Lie,
            along: MotionDirection::Force,
            take_out_rigid_offset: true,
        }
    }
}

/// Moves a face by one held sample; pure, no allocation.
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use touchup_method::haptic::{DynamicsParams, FaceDynamics, FaceState};
///
/// let dynamics = FaceDynamics::new(DynamicsParams::default())?;
/// let face = FaceState { b: Point3::origin(), n: Vector3::z() };
/// // 2 N push up at 1 mm above the face: it rises towards the tip
/// let moved = dynamics.step(&face, &Point3::new(0.0, 0.0, 1e-3), &Vector3::new(0.0, 0.0, 2.0), 1e-3)?;
/// assert!(moved.b.z > 0.0 && moved.b.z < 1e-3);
/// # Ok::<(), touchup_method::haptic::DynamicsError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceDynamics {
    params: DynamicsParams,
    /// f(0), N
    at_zero_n: f64,
}

/// A sample relative to the face.
struct FaceSample {
    /// n at the start
    n: Vector3<f64>,
    /// F/|F|, or zero
    towards: Vector3<f64>,
    /// |F|, N
    magnitude: f64,
    /// a
    along: Vector3<f64>,
    /// p − b at the start
    arm: Vector3<f64>,
    dt: f64,
}

impl FaceDynamics {
    /// # Errors
    /// [`DynamicsError::BadParameter`].
    pub fn new(params: DynamicsParams) -> Result<Self, DynamicsError> {
        params.model.check()?;
        DynamicsError::check(
            "alpha_m_per_n_s",
            params.alpha_m_per_n_s,
            params.alpha_m_per_n_s >= 0.0,
        )?;
        DynamicsError::check(
            "beta_per_n2_s",
            params.beta_per_n2_s,
            params.beta_per_n2_s >= 0.0,
        )?;
        Ok(Self {
            params,
            at_zero_n: params.model.force(0.0),
        })
    }

    /// The face after holding the tip `p` (m, in O) and the force on the stylus `force` (N, in O)
    /// for `dt` (s).
    ///
    /// # Errors
    /// Input that is not finite, a normal not of length 1, a negative `dt`, a result that
    /// overflows, [`DynamicsError::Stiff`] from [`StepRule::DormandPrince`] and
    /// [`StepRule::Bounded`], and [`DynamicsError::Undetermined`] from the latter.
    pub fn step(
        &self,
        face: &FaceState,
        p: &Point3<f64>,
        force: &Vector3<f64>,
        dt: f64,
    ) -> Result<FaceState, DynamicsError> {
        self.step_from(&face.n, face, p, force, dt)
    }

    /// As [`Self::step`], with the n*(0) of an earlier step: [`MotionDirection::InitialNormal`] keeps b* on
    /// its line of that step. Uses n*(0) unchecked, |n*(0)| = 1.
    ///
    /// # Errors
    /// Errors of [`Self::step`].
    pub fn step_from(
        &self,
        initial_normal: &Vector3<f64>,
        face: &FaceState,
        p: &Point3<f64>,
        force: &Vector3<f64>,
        dt: f64,
    ) -> Result<FaceState, DynamicsError> {
        let (magnitude, towards) = length_and_direction(force);
        let sum = face.b.coords + face.n + p.coords;
        if !(finite(&sum) && finite(force) && magnitude.is_finite() && dt.is_finite()) {
            return Err(not_finite(face, p, force));
        }
        let length_squared = face.n.norm_squared();
        if (length_squared - 1.0).abs() > 2.0 * UNIT_TOLERANCE {
            return Err(DynamicsError::NotUnit {
                length: length_squared.sqrt(),
            });
        }
        if dt < 0.0 {
            return Err(DynamicsError::BadTimeStep { dt_s: dt });
        }
        let along = if self.params.along == MotionDirection::Force && magnitude > 0.0 {
            towards
        } else {
            *initial_normal
        };
        let touch = FaceSample {
            n: face.n,
            towards,
            magnitude,
            along,
            arm: p - face.b,
            dt,
        };
        let (displacement, n) = match self.params.rule {
            StepRule::Lie => self.lie(&touch),
            StepRule::DriftCorrected => self.drift_corrected(&touch),
            StepRule::Bounded => self.bounded(&touch)?,
            StepRule::DormandPrince => self.dormand_prince(&touch)?,
        };
        let b = face.b + displacement * along;
        if !finite(&b.coords) || !finite(&n) {
            return Err(DynamicsError::NotFinite {
                what: "the result of the step",
            });
        }
        Ok(FaceState { b, n })
    }

    /// F·n, N, and h, m, for their comparison.
    #[inline]
    fn compared(&self, n: &Vector3<f64>, touch: &FaceSample, displacement: f64) -> (f64, f64) {
        let force = touch.magnitude * touch.towards.dot(n);
        let h = (touch.arm - displacement * touch.along).dot(n);
        if !self.params.take_out_rigid_offset {
            return (force, h);
        }
        let force = self.params.model.comparable(force, self.at_zero_n);
        (force, h + self.params.model.distance(force))
    }

    #[inline]
    fn hold(&self, touch: &FaceSample) -> Hold {
        let (force, h) = self.compared(&touch.n, touch, 0.0);
        let cosine = touch.along.dot(&touch.n);
        Hold {
            h,
            drift: 0.0,
            cosine,
            force,
            alpha: self.params.alpha_m_per_n_s,
            dt: touch.dt,
        }
    }

    #[inline]
    fn turned(&self, touch: &FaceSample, impulse: f64) -> Vector3<f64> {
        turn(
            &touch.n,
            &touch.towards,
            self.params.beta_per_n2_s * touch.magnitude * impulse,
        )
    }

    #[inline]
    fn lie(&self, touch: &FaceSample) -> (f64, Vector3<f64>) {
        let Shift {
            displacement,
            impulse,
        } = self.params.model.flow(&self.hold(touch));
        (displacement, self.turned(touch, impulse))
    }

    /// Position flow with h₀ + v t from the arm held and n turning evenly from its start to its
    /// predicted end; twice, so that b* fits the returned n*. F·n and a·n, which change during the
    /// step, enter by a mean that weights the end the more the faster h forgets: 1/2 when slow
    /// (second order), 1 when stiff.
    fn drift_corrected(&self, touch: &FaceSample) -> (f64, Vector3<f64>) {
        let (displacement, end) = self.lie(touch);
        if touch.dt == 0.0 || end == touch.n {
            return (displacement, end);
        }
        let (shift, spare) = self.drifting_flow(touch, &end, displacement);
        let end = self.turned(touch, shift.impulse + spare);
        let (shift, _) = self.drifting_flow(touch, &end, shift.displacement);
        (shift.displacement, end)
    }

    /// The flow, and the part of the impulse outside its mean of F·n, N·s.
    fn drifting_flow(
        &self,
        touch: &FaceSample,
        end: &Vector3<f64>,
        displacement: f64,
    ) -> (Shift, f64) {
        let start = self.hold(touch);
        let (force, h) = self.compared(end, touch, 0.0);
        let cosine = touch.along.dot(end);
        let (_, h_end) = self.compared(end, touch, displacement);
        let decay = -start.alpha * cosine * self.params.model.slope(h_end) * touch.dt;
        let weight = end_weight(decay);
        let mean = |from: f64, to: f64| from + weight * (to - from);
        let hold = Hold {
            drift: (h - start.h) / touch.dt,
            cosine: mean(start.cosine, cosine),
            force: mean(start.force, force),
            ..start
        };
        (
            self.params.model.flow(&hold),
            (0.5 - weight) * (force - start.force) * touch.dt,
        )
    }

    /// Both flows at once; a face that does not turn has the exact solution of [`Self::lie`].
    fn bounded(&self, touch: &FaceSample) -> Result<(f64, Vector3<f64>), DynamicsError> {
        let turning = self.params.beta_per_n2_s * touch.magnitude;
        let (displacement, end) = self.lie(touch);
        if turning == 0.0
            || touch.dt == 0.0
            || end == touch.n && touch.n.cross(&touch.towards).norm() <= f64::EPSILON
        {
            return Ok((displacement, end));
        }
        let (model, alpha) = (&self.params.model, self.params.alpha_m_per_n_s);
        let (contact, shift) = match *model {
            ContactModel::Sigmoid(curve) => (curve.h_min, (curve.h_min * curve.delta).abs()),
            ContactModel::Spring { stiffness_n_per_m } => (
                self.hold(touch).h.abs() + touch.magnitude / stiffness_n_per_m,
                0.0,
            ),
        };
        let rounding = 8.0 * f64::EPSILON * (touch.arm.norm() + shift);
        // the impulse times α is a length, as the travel is
        let unit = if alpha > 0.0 { alpha } else { 1.0 };
        let normal = |impulse: f64| turn(&touch.n, &touch.towards, turning / unit * impulse);
        let slope = |y: &bounded::CoupledState| {
            let n = normal(y.y);
            let turned = turning / unit * (touch.towards - touch.towards.dot(&n) * n);
            let (force, h) = self.compared(&n, touch, y.x);
            let mut force_slope = touch.magnitude * touch.towards.dot(&turned);
            let mut by_impulse = (touch.arm - y.x * touch.along).dot(&turned);
            if self.params.take_out_rigid_offset {
                if force != touch.magnitude * touch.towards.dot(&n) {
                    force_slope = 0.0;
                }
                by_impulse += model.distance_slope(force) * force_slope;
            }
            let (expected, stiffness) = (model.force(h), model.slope(h));
            let by_travel = -touch.along.dot(&n);
            bounded::Slope {
                rate: Vector2::new(alpha * (force - expected), unit * expected),
                jacobian: Matrix2::new(
                    -alpha * stiffness * by_travel,
                    alpha * (force_slope - stiffness * by_impulse),
                    unit * stiffness * by_travel,
                    unit * stiffness * by_impulse,
                ),
            }
        };
        // for a force that turns the face by nothing
        let turned = (unit / turning).min(NO_TURNING);
        let sizes = bounded::Sizes {
            rounding,
            turning: turned,
            contact,
        };
        let y = bounded::integrate(touch.dt, sizes, RELATIVE_ERROR, slope)?;
        Ok((y.x, normal(y.y)))
    }

    fn dormand_prince(&self, touch: &FaceSample) -> Result<(f64, Vector3<f64>), DynamicsError> {
        let (model, alpha, beta) = (
            &self.params.model,
            self.params.alpha_m_per_n_s,
            self.params.beta_per_n2_s,
        );
        let rate = |y: &[f64; 4]| {
            let n = Vector3::new(y[1], y[2], y[3]);
            let (force, h) = self.compared(&n, touch, y[0]);
            let expected = model.force(h);
            let cosine = touch.towards.dot(&n);
            let turning = beta * touch.magnitude * expected * (touch.towards - cosine * n);
            [alpha * (force - expected), turning.x, turning.y, turning.z]
        };
        let scale = match *model {
            ContactModel::Sigmoid(curve) => curve.h_min,
            ContactModel::Spring { stiffness_n_per_m } => {
                self.hold(touch).h.abs() + touch.magnitude / stiffness_n_per_m
            }
        };
        let start = [0.0, touch.n.x, touch.n.y, touch.n.z];
        let scale = [scale.max(f64::MIN_POSITIVE), 1.0, 1.0, 1.0];
        let [displacement, x, y, z] =
            dormand_prince::dormand_prince(start, touch.dt, scale, dormand_prince::RELATIVE, rate)?;
        Ok((displacement, Vector3::new(x, y, z).normalize()))
    }
}

/// ∫ e^−z(1−x) x dx / ∫ e^−z(1−x) dx over 0..1.
fn end_weight(z: f64) -> f64 {
    if !z.is_finite() || z > f64::MAX.sqrt() {
        return 1.0;
    }
    if z < SMALL_DECAY {
        return 0.5 + z.max(0.0) / 12.0;
    }
    let decayed = -(-z).exp_m1();
    1.0 / decayed - 1.0 / z
}

#[cold]
fn not_finite(face: &FaceState, p: &Point3<f64>, force: &Vector3<f64>) -> DynamicsError {
    let parts = [
        ("b", face.b.coords),
        ("n", face.n),
        ("p", p.coords),
        ("force", *force),
    ];
    let what = parts
        .iter()
        .find(|(_, v)| !finite(v))
        .map_or("dt, |F| or a sum of the input", |(what, _)| what);
    DynamicsError::NotFinite { what }
}

#[inline]
fn finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}
