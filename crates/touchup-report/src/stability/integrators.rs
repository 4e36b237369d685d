//! Integrators of the map: the obvious first choices, and the steps of [`FaceDynamics`].

use nalgebra::{Matrix4, Vector3, Vector4};

use touchup_method::haptic::{ContactModel, DynamicsParams, FaceDynamics, FaceState, StepRule};
use touchup_method::haptic::{LARGEST_SHARE, turn};
use touchup_method::names;

/// Most Newton iterations of the implicit step.
const NEWTON_STEPS: usize = 50;
/// Convergence: the next step is below this share of the scale.
const NEWTON_TOLERANCE: f64 = 1e-12;
/// Relative difference for its Jacobian: half of the digits.
const DIFFERENCE: f64 = 1e-8;

names! {
    /// An integrator that advances a face by one sample.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Integrator {
        /// one explicit Euler step a sample
        ExplicitEuler = "explicit Euler",
        /// one classical Runge–Kutta step of order 4 a sample
        RungeKutta4 = "RK4",
        /// adaptive Runge–Kutta 5(4), up to 20,000 steps
        DormandPrince = "Dormand-Prince 5(4)",
        /// one implicit Euler step a sample, solved by Newton's method
        ImplicitEuler = "implicit Euler",
        /// the exact flow of the position, then of the normal: the default
        Lie = "Lie",
        /// the exact flows with mutual drift
        DriftCorrected = "drift-corrected",
    }
}

/// One sample, held.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeldSample {
    /// p − b at the start, m
    pub arm: Vector3<f64>,
    /// N
    pub force: Vector3<f64>,
    /// s
    pub dt: f64,
    /// force-independent rate at which n turns to F, 1/s: Eq 7 with both forces at unit size
    pub turning: f64,
}

/// Travel along the force, m, and normal of any length.
type TravelAndNormal = (f64, Vector3<f64>);
/// Travel and normal as one vector.
type StateVector = Vector4<f64>;

impl Integrator {
    /// Suffix of a file name: the words of its name.
    pub fn id(self) -> String {
        let name = self.name().to_lowercase();
        let words = name
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| word.starts_with(char::is_alphabetic));
        words.collect::<Vec<_>>().join("_")
    }

    /// Its counterpart in [`FaceDynamics`], if any.
    pub fn rule(self) -> Option<StepRule> {
        match self {
            Self::DormandPrince => Some(StepRule::DormandPrince),
            Self::Lie => Some(StepRule::Lie),
            Self::DriftCorrected => Some(StepRule::DriftCorrected),
            Self::ExplicitEuler | Self::RungeKutta4 | Self::ImplicitEuler => None,
        }
    }

    /// State of the face after one sample; `None` if the integrator gives up.
    pub(super) fn step(
        self,
        params: &DynamicsParams,
        n: &Vector3<f64>,
        held: &HeldSample,
    ) -> Option<TravelAndNormal> {
        if let Some(rule) = self.rule() {
            return by_touchup(&DynamicsParams { rule, ..*params }, n, held);
        }
        let rate = |y: &StateVector| rate(params, held, y);
        let start = Vector4::new(0.0, n.x, n.y, n.z);
        let end = match self {
            Self::ExplicitEuler => start + rate(&start) * held.dt,
            Self::RungeKutta4 => {
                let k1 = rate(&start);
                let k2 = rate(&(start + k1 * (0.5 * held.dt)));
                let k3 = rate(&(start + k2 * (0.5 * held.dt)));
                let k4 = rate(&(start + k3 * held.dt));
                start + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (held.dt / 6.0)
            }
            _ => implicit_euler(&start, held.dt, scale(params, held), rate)?,
        };
        Some((end[0], Vector3::new(end[1], end[2], end[3])))
    }
}

fn by_touchup(
    params: &DynamicsParams,
    n: &Vector3<f64>,
    held: &HeldSample,
) -> Option<TravelAndNormal> {
    let dynamics = FaceDynamics::new(*params).ok()?;
    let face = FaceState {
        b: nalgebra::Point3::origin(),
        n: *n,
    };
    let next = dynamics
        .step(&face, &held.arm.into(), &held.force, held.dt)
        .ok()?;
    let along = held.force.try_normalize(0.0).unwrap_or(*n);
    Some((
        next.b.coords.dot(&along),
        turn(&next.n, &along, held.turning * held.dt),
    ))
}

/// Eq 6 and 7 along the force, written independently: velocity along F (m/s) and normal (1/s).
fn rate(params: &DynamicsParams, held: &HeldSample, y: &StateVector) -> StateVector {
    let n = Vector3::new(y[1], y[2], y[3]);
    let magnitude = held.force.norm();
    let towards = held.force / magnitude;
    let h = (held.arm - towards * y[0]).dot(&n);
    let force_along_n = held.force.dot(&n);
    let (force_along_n, h) = match params.model {
        ContactModel::Sigmoid(curve) if params.take_out_rigid_offset => {
            let lowest = params.model.force(0.0);
            (
                force_along_n.max(lowest).min(LARGEST_SHARE * curve.f_max),
                h + params.model.rigid_offset(force_along_n),
            )
        }
        _ => (force_along_n, h),
    };
    let expected = params.model.force(h);
    let turning = (towards - n * towards.dot(&n))
        * (params.beta_per_n2_s * magnitude * expected + held.turning);
    Vector4::new(
        params.alpha_m_per_n_s * (force_along_n - expected),
        turning.x,
        turning.y,
        turning.z,
    )
}

/// Characteristic length, m.
fn scale(params: &DynamicsParams, held: &HeldSample) -> f64 {
    let of_model = match params.model {
        ContactModel::Sigmoid(curve) => curve.h_min,
        ContactModel::Spring { stiffness_n_per_m } => held.force.norm() / stiffness_n_per_m,
    };
    held.arm.norm() + of_model
}

/// Solves y = y₀ + dt · rate(y) by Newton's method with a difference Jacobian; halves a step that
/// increases the residual.
fn implicit_euler(
    start: &StateVector,
    dt: f64,
    length: f64,
    rate: impl Fn(&StateVector) -> StateVector,
) -> Option<StateVector> {
    let size = Vector4::new(length, 1.0, 1.0, 1.0);
    // everything in units of its size
    let residual =
        |z: &StateVector| z - (start + rate(&z.component_mul(&size)) * dt).component_div(&size);
    let mut z = start.component_div(&size);
    let mut left = residual(&z);
    for _ in 0..NEWTON_STEPS {
        let jacobian = Matrix4::from_fn(|row, column| {
            let mut shifted = z;
            shifted[column] += DIFFERENCE;
            (residual(&shifted)[row] - left[row]) / DIFFERENCE
        });
        let step = jacobian.lu().solve(&left)?;
        let mut share = 1.0;
        let mut next = z - step;
        let is_worse = |next: &StateVector| {
            residual(next)
                .norm()
                .partial_cmp(&left.norm())
                .is_none_or(|o| o.is_gt())
        };
        while share > 1e-6 && is_worse(&next) {
            share *= 0.5;
            next = z - step * share;
        }
        (z, left) = (next, residual(&next));
        if !left.iter().all(|x| x.is_finite()) {
            return None;
        }
        if (step * share).norm() <= NEWTON_TOLERANCE * (1.0 + z.norm()) {
            return Some(z.component_mul(&size));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_method::haptic::MotionDirection;

    /// A spring from h = 1 mm to rest at 0 without force along n: dh/dt = −h/τ, with known solution
    /// and known discrete steps.
    #[test]
    fn each_step_is_its_own_rule_on_a_linear_decay() {
        let model = ContactModel::Spring {
            stiffness_n_per_m: 1e3,
        };
        let params = DynamicsParams {
            model,
            alpha_m_per_n_s: 0.1,
            beta_per_n2_s: 0.0,
            rule: StepRule::Lie,
            along: MotionDirection::Force,
            take_out_rigid_offset: false,
        };
        // 2 N rest at h = −2 mm: 3 mm to go at z = α k dt = 0.5
        let (z, force) = (0.5f64, Vector3::new(0.0, 0.0, 2.0));
        let held = HeldSample {
            arm: Vector3::new(0.0, 0.0, 1e-3),
            force,
            dt: z / 100.0,
            turning: 0.0,
        };
        let left = |integrator: Integrator| {
            let (travel, n) = integrator.step(&params, &Vector3::z(), &held).unwrap();
            assert_eq!(n, Vector3::z());
            (3e-3 - travel) / 3e-3
        };
        let expected = [
            (Integrator::ExplicitEuler, 1.0 - z),
            (
                Integrator::RungeKutta4,
                1.0 - z + z * z / 2.0 - z.powi(3) / 6.0 + z.powi(4) / 24.0,
            ),
            (Integrator::ImplicitEuler, 1.0 / (1.0 + z)),
            (Integrator::DormandPrince, (-z).exp()),
            (Integrator::Lie, (-z).exp()),
            (Integrator::DriftCorrected, (-z).exp()),
        ];
        for (integrator, share) in expected {
            assert!(
                (left(integrator) - share).abs() < 1e-9,
                "{}: {} {share}",
                integrator.name(),
                left(integrator)
            );
        }
    }

    #[test]
    fn all_agree_on_a_short_coupled_step() {
        let params = DynamicsParams::default();
        let (force, n) = (Vector3::new(0.8, -0.3, 2.0), Vector3::z());
        let held = HeldSample {
            arm: Vector3::new(2e-4, 1e-4, 8e-4),
            force,
            dt: 1e-6,
            turning: 0.0,
        };
        let (exact, turned) = Integrator::DormandPrince.step(&params, &n, &held).unwrap();
        assert!(exact > 1e-8 && turned != n);
        for integrator in Integrator::ALL {
            let (travel, end) = integrator.step(&params, &n, &held).unwrap();
            assert!(
                (travel / exact - 1.0).abs() < 1e-3,
                "{}: {travel:e} {exact:e}",
                integrator.name()
            );
            assert!(
                (end - turned).norm() < 1e-3 * (turned - n).norm() + 1e-15,
                "{}",
                integrator.name()
            );
        }
    }
}
