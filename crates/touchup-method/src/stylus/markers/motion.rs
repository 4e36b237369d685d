//! Motion model of the body: free flight with the pull of springs and dampers.
//!
//! For one degree of freedom let e be the distance to the measured place. A damper that acts on the
//! speed relative to the *measured* motion does not lag behind a steady hand; in the observer form
//! x' = v + d e, v' = k e it needs no derivative of the noise. Sampled at frames Δt apart its exact
//! counterpart is x ← x + α e, v ← v + (β/Δt) e with
//!
//! α = 1 − z₁z₂,   β = (1 − z₁)(1 − z₂),   z₁,₂ = e^(−ω Δt (ζ ± √(ζ² − 1)))
//!
//! which has its poles at z₁ and z₂: inside the unit circle for every stiffness and every Δt.

use nalgebra::{Isometry3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};

use super::body::{MarkerBody, MarkerPairs};
use crate::parameters;
use touchup_geometry::numeric::cauchy_weight;

parameters! {
    /// Spring and damper at each marker, for the mass at it.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SpringParams in "markers" {
        /// Natural frequency √(k/m) / 2π of the springs between the body and its markers: a higher
        /// one follows faster, a lower one smooths more.
        ///
        /// In Hz. Behind a hand that accelerates by 1 m/s² the body lags by 0.2 mm, and the noise
        /// of frames at 200 Hz falls to two thirds.
        frequency: f64 = 12.0, "spring_hz" [HZ, 0.001, 1e6];
        /// Damping ratio d / (2 √(k m)): 1 is the fastest without oscillation.
        damping: f64 = 1.0, "damping" [ONE, 0.5, 100];
    }
}

impl SpringParams {
    /// α and β over `dt` s.
    pub(super) fn gains(&self, dt: f64) -> (f64, f64) {
        let (turn, damping) = (std::f64::consts::TAU * self.frequency * dt, self.damping);
        let product = (-2.0 * damping * turn).exp();
        let under_root = damping * damping - 1.0;
        let sum = if under_root >= 0.0 {
            let root = under_root.sqrt();
            (-turn * (damping + root)).exp() + (-turn * (damping - root)).exp()
        } else {
            2.0 * (-turn * damping).exp() * (turn * (-under_root).sqrt()).cos()
        };
        (1.0 - product, 1.0 + product - sum)
    }
}

/// Share of the mass that sits in all markers; the remainder sits in the observed ones. It keeps
/// the body from jumping in directions that these do not determine: there it flies on.
const LOOSE_MASS: f64 = 0.02;
/// Frame interval below which a velocity is mere noise, s.
const SHORTEST: f64 = 1e-3;
/// Frame interval below which the velocity of the first frames is mere noise, s.
const FIRST_SHORTEST: f64 = 5e-3;
/// Rounds of the marker weights.
const ROUNDS: usize = 3;
/// Distance from the fit at which a marker counts half, in units of the noise.
const HALF_WEIGHT: f64 = 3.0;

/// Pose and motion of the body, about the centroid of its markers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BodyMotion {
    pub centroid: Point3<f64>,
    pub rotation: UnitQuaternion<f64>,
    /// velocity of the centroid, m/s, in O
    velocity: Vector3<f64>,
    /// angular velocity, rad/s, in O
    spin: Vector3<f64>,
    /// frames in use
    pub frames: u32,
}

impl BodyMotion {
    pub(crate) fn at_rest(body: &MarkerBody, pose_ot: &Isometry3<f64>) -> Self {
        let centroid = pose_ot * body.centroid_t();
        Self {
            centroid,
            rotation: pose_ot.rotation,
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            frames: 1,
        }
    }

    pub(crate) fn pose_ot(&self, body: &MarkerBody) -> Isometry3<f64> {
        let p_ot = self.centroid - self.rotation * body.centroid_t().coords;
        Isometry3::from_parts(p_ot.coords.into(), self.rotation)
    }

    /// Free flight for `dt` s.
    pub(crate) fn fly(&self, dt: f64) -> Self {
        let mut rotation = UnitQuaternion::from_scaled_axis(self.spin * dt) * self.rotation;
        rotation.renormalize();
        Self {
            centroid: self.centroid + self.velocity * dt,
            rotation,
            ..*self
        }
    }

    /// Pulls the body by the seen markers after a flight of `dt` s.
    pub(crate) fn pull(
        &mut self,
        body: &MarkerBody,
        pairs: &MarkerPairs,
        spring: &SpringParams,
        noise: f64,
        dt: f64,
    ) {
        let Some(twist) = self.twist(body, pairs, noise) else {
            return;
        };
        self.frames = self.frames.saturating_add(1);
        let (alpha, beta) = spring.gains(dt);
        // a body just found has no past: n frames in a row have the gains of a straight line
        // through them
        let n = f64::from(self.frames);
        let (first_alpha, first_beta) = ((4.0 * n - 2.0) / (n * (n + 1.0)), 6.0 / (n * (n + 1.0)));
        let alpha = alpha.max(first_alpha).min(1.0);
        let rate = (beta / dt.max(SHORTEST)).max(first_beta / dt.max(FIRST_SHORTEST));
        // markers that do not determine the pose give no velocity: the body flies on
        let rate = if body.is_held_by(pairs) { rate } else { 0.0 };
        let (shift, turn) = (
            twist.fixed_rows::<3>(0).into_owned(),
            twist.fixed_rows::<3>(3).into_owned(),
        );
        self.centroid += shift * alpha;
        self.rotation = UnitQuaternion::from_scaled_axis(turn * alpha) * self.rotation;
        self.velocity += shift * rate;
        self.spin += turn * rate;
    }

    /// Motion by the springs: M⁻¹ Σ w Jᵀ e with J = \[1, −\[r\]×\], the small motion (shift, turn)
    /// that takes the body to equilibrium among the observed markers. The eigenvalues of M⁻¹ Σ w
    /// JᵀJ lie in \[0, 1\], so no set of markers makes a step too long.
    fn twist(&self, body: &MarkerBody, pairs: &MarkerPairs, noise: f64) -> Option<Vector6<f64>> {
        let arm = |i: usize| self.rotation * (body.markers_t()[i] - body.centroid_t());
        let mut loose = Matrix6::zeros();
        (0..body.markers_t().len()).for_each(|i| add_mass(&mut loose, &arm(i), LOOSE_MASS));
        let mut twist = Vector6::zeros();
        for round in 0..ROUNDS {
            let (mut mass, mut pull) = (loose, Vector6::zeros());
            for &(i, measured) in pairs {
                let arm = arm(i);
                let error = measured - (self.centroid + arm);
                let left =
                    error - (twist.fixed_rows::<3>(0) + twist.fixed_rows::<3>(3).cross(&arm));
                let weight = if round == 0 {
                    1.0
                } else {
                    cauchy_weight(left.norm_squared() / (HALF_WEIGHT * noise).powi(2))
                };
                add_mass(&mut mass, &arm, weight);
                let torque = arm.cross(&error);
                pull +=
                    Vector6::new(error.x, error.y, error.z, torque.x, torque.y, torque.z) * weight;
            }
            twist = mass.cholesky()?.solve(&pull);
        }
        Some(twist)
    }
}

/// Adds w Jᵀ J of a point mass at `arm` from the centroid.
fn add_mass(mass: &mut Matrix6<f64>, arm: &Vector3<f64>, weight: f64) {
    let cross = arm.cross_matrix() * weight;
    for k in 0..3 {
        mass[(k, k)] += weight;
    }
    let mut corner = mass.fixed_view_mut::<3, 3>(0, 3);
    corner -= cross;
    let mut corner = mass.fixed_view_mut::<3, 3>(3, 0);
    corner += cross;
    let mut corner = mass.fixed_view_mut::<3, 3>(3, 3);
    corner -= cross * arm.cross_matrix();
}
