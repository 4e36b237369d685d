//! Runs of one face: parameters drawn over twelve decades each, and the final state of the face.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

use super::integrators::{HeldSample, Integrator};
use touchup_method::haptic::{ContactModel, DynamicsParams, SigmoidParams};
use touchup_method::names;

/// Samples held in each run.
const STEPS: usize = 6;
/// Least cosine between normal and force for which a refiner lets a force move a face: 78° at most.
const SMALLEST_COSINE: f64 = 0.2;
/// Tolerance of |n|.
const UNIT_TOLERANCE: f64 = 1e-9;
/// Least crossing that counts, relative to the lengths of the run: far above roundings, far below
/// observed ones.
const CROSSING: f64 = 1e-9;

/// Decades of a parameter: its logarithms.
type Decades = std::ops::Range<f64>;
/// h_min, m
pub(super) const H_MIN: Decades = -9.0..3.0;
/// f_max, N
const F_MAX: Decades = -5.0..7.0;
/// α, m/(N·s)
const ALPHA: Decades = -7.0..5.0;
/// β, 1/(N²·s); of the spring: the rate of turning, 1/s
const BETA: Decades = -7.0..5.0;
/// step length, s
pub(super) const STEP: Decades = -9.0..3.0;

names! {
    /// End of a run.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RunEnding {
        /// no fault
        Stable = "stable",
        /// the integrator refused or gave up
        GaveUp = "gave up",
        /// NaN or infinite
        NotFinite = "not finite",
        /// |n| is not 1
        NotUnit = "not unit",
        /// the normal points backward
        Flipped = "flipped",
        /// beyond the rest point, or the normal beyond the force
        Overshot = "overshot",
        /// an update of the mesh was shortened or given up
        CutBack = "cut back",
    }
}

/// One face, one held sample, one step length.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceRun {
    pub params: DynamicsParams,
    /// h_min, m; for the spring: f_max over its stiffness
    pub h_min: f64,
    pub f_max: f64,
    n: Vector3<f64>,
    pub held: HeldSample,
}

pub(super) fn log_uniform(rng: &mut Pcg64, decades: Decades) -> f64 {
    10f64.powf(rng.random_range(decades))
}

impl FaceRun {
    /// Draws the parameters of a run; `is_spring` selects the linear one of the two contact models.
    /// A spring pulls a tip outside the face, and Eq 7 would turn the face away from the force
    /// there: with a spring the normal turns at a rate of its own, as in
    /// [`touchup_method::haptic::RefineParams::robust`].
    pub fn draw(rng: &mut Pcg64, is_spring: bool) -> Self {
        let (h_min, f_max) = (log_uniform(rng, H_MIN), log_uniform(rng, F_MAX));
        let model = if is_spring {
            ContactModel::Spring {
                stiffness_n_per_m: f_max / h_min,
            }
        } else {
            ContactModel::Sigmoid(SigmoidParams {
                f_max,
                h_min,
                delta: 5.0,
            })
        };
        let beta = log_uniform(rng, BETA);
        let params = DynamicsParams {
            model,
            alpha_m_per_n_s: log_uniform(rng, ALPHA),
            beta_per_n2_s: if is_spring { 0.0 } else { beta },
            // as in the robust mode: a known spring has no offset to take out
            take_out_rigid_offset: !is_spring,
            ..DynamicsParams::default()
        };
        // first with z along n, then all turned into the drawn direction
        let cosine: f64 = if rng.random_bool(0.25) {
            1.0
        } else {
            rng.random_range(SMALLEST_COSINE..1.0)
        };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let magnitude = f_max * log_uniform(rng, -6.0..0.5);
        let length = if rng.random_bool(0.5) {
            h_min * log_uniform(rng, -3.0..1.5)
        } else {
            log_uniform(rng, -9.0..0.0)
        };
        let arm = length * Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        let axis = Unit::new_normalize(Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
        let turn = UnitQuaternion::from_axis_angle(&axis, rng.random_range(0.0..3.0));
        let held = HeldSample {
            arm: turn * arm,
            force: turn * Vector3::new(sine, 0.0, cosine) * magnitude,
            dt: log_uniform(rng, STEP),
            turning: if is_spring { beta } else { 0.0 },
        };
        Self {
            params,
            h_min,
            f_max,
            n: turn * Vector3::z(),
            held,
        }
    }

    /// Stiffness of position, α f_max dt / h_min, and normal, β f_max² dt or rate times dt.
    pub fn stiffness(&self) -> [f64; 2] {
        let turning = (self.params.beta_per_n2_s * self.f_max * self.f_max + self.held.turning)
            * self.held.dt;
        [
            self.params.alpha_m_per_n_s * self.f_max * self.held.dt / self.h_min,
            turning,
        ]
    }

    /// Equilibrium h of the face under `n`, m.
    fn rest(&self, n: &Vector3<f64>) -> f64 {
        if self.params.take_out_rigid_offset {
            0.0
        } else {
            self.params.model.distance(self.held.force.dot(n))
        }
    }

    /// End of the run, and whether the integrator itself kept |n| = 1: after each step a normal of
    /// wrong length is normalised, as in any usual implementation.
    pub fn judge(&self, integrator: Integrator) -> (RunEnding, bool) {
        let mut kept_unit = true;
        (self.run(integrator, &mut kept_unit), kept_unit)
    }

    fn run(&self, integrator: Integrator, kept_unit: &mut bool) -> RunEnding {
        let (mut held, mut n) = (self.held, self.n);
        let towards = held.force.normalize();
        let longest = self.rest(&n).abs() + held.arm.norm() + self.h_min;
        for _ in 0..STEPS {
            let Some((travel, raw)) = integrator.step(&self.params, &n, &held) else {
                return RunEnding::GaveUp;
            };
            let length = raw.norm();
            if !(travel.is_finite() && length.is_finite()) {
                return RunEnding::NotFinite;
            }
            *kept_unit &= (length - 1.0).abs() <= UNIT_TOLERANCE;
            if integrator.rule().is_some() && !*kept_unit {
                return RunEnding::NotUnit;
            }
            let Some(turned) = raw.try_normalize(0.0) else {
                return RunEnding::NotUnit;
            };
            if turned.dot(&self.n) <= 0.0 {
                return RunEnding::Flipped;
            }
            let arm = held.arm - towards * travel;
            if self.crosses(&n, &turned, [&held.arm, &arm], CROSSING * longest)
                || turns_past(&n, &turned, &towards)
            {
                return RunEnding::Overshot;
            }
            (held.arm, n) = (arm, turned);
        }
        RunEnding::Stable
    }

    /// Whether h crosses its rest point. The rest point differs for the normals before and after: a
    /// crossing counts only if it holds for both.
    fn crosses(
        &self,
        n: &Vector3<f64>,
        turned: &Vector3<f64>,
        arms: [&Vector3<f64>; 2],
        tolerance: f64,
    ) -> bool {
        let [from, to] = arms.map(|arm| [n, turned].map(|n| arm.dot(n) - self.rest(n)));
        goes_over(from, to, tolerance)
    }
}

/// Whether a distance to the rest point changes its sign, for the normals before and after, and by
/// more than `tolerance`.
pub(super) fn goes_over(from: [f64; 2], to: [f64; 2], tolerance: f64) -> bool {
    let over = |sign: f64| {
        from.iter().all(|x| sign * x >= 0.0) && to.iter().all(|x| sign * x < -tolerance)
    };
    over(1.0) || over(-1.0)
}

/// Whether n goes from one side of the force to the other.
fn turns_past(n: &Vector3<f64>, turned: &Vector3<f64>, towards: &Vector3<f64>) -> bool {
    let (before, after) = (n.cross(towards), turned.cross(towards));
    before.dot(&after) < 0.0 && after.norm() > CROSSING
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn along_the_normal(stiffness: f64) -> FaceRun {
        let model = ContactModel::Spring {
            stiffness_n_per_m: 1e3,
        };
        let params = DynamicsParams {
            model,
            alpha_m_per_n_s: 0.1,
            beta_per_n2_s: 0.0,
            take_out_rigid_offset: false,
            ..DynamicsParams::default()
        };
        let held = HeldSample {
            arm: Vector3::z() * 1e-3,
            force: Vector3::z() * 2.0,
            dt: stiffness / 100.0,
            turning: 0.0,
        };
        FaceRun {
            params,
            h_min: 1e-3,
            f_max: 1.0,
            n: Vector3::z(),
            held,
        }
    }

    /// Explicit Euler on dh/dt = −h/τ overshoots from dt = τ on; RK4 keeps the sign, since its
    /// polynomial has no real root.
    #[test]
    fn explicit_euler_overshoots_from_one_time_constant_on() {
        assert_eq!(
            along_the_normal(0.99).judge(Integrator::ExplicitEuler).0,
            RunEnding::Stable
        );
        assert_eq!(
            along_the_normal(1.01).judge(Integrator::ExplicitEuler).0,
            RunEnding::Overshot
        );
        for integrator in [Integrator::Lie, Integrator::ImplicitEuler] {
            assert_eq!(
                along_the_normal(1e6).judge(integrator).0,
                RunEnding::Stable,
                "{}",
                integrator.name()
            );
        }
    }

    #[test]
    fn a_normal_beyond_the_force_has_overshot() {
        let at = |angle: f64| Vector3::new(angle.sin(), 0.0, angle.cos());
        assert!(turns_past(&at(0.0), &at(0.5), &at(0.4)));
        assert!(!turns_past(&at(0.0), &at(0.3), &at(0.4)));
        assert!(!turns_past(&at(0.0), &at(0.4), &at(0.4)));
    }

    #[test]
    fn draws_cover_their_decades() {
        let mut rng = Pcg64::seed_from_u64(3);
        let runs: Vec<_> = (0..4000)
            .map(|i| FaceRun::draw(&mut rng, i % 2 == 0))
            .collect();
        let spread = |of: fn(&FaceRun) -> f64| {
            let logs = runs.iter().map(|run| of(run).log10());
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            })
        };
        for of in [
            |run: &FaceRun| run.h_min,
            |run: &FaceRun| run.f_max,
            |run: &FaceRun| run.held.dt,
            |run: &FaceRun| run.params.alpha_m_per_n_s,
        ] {
            let (low, high) = spread(of);
            assert!((11.9..12.0).contains(&(high - low)), "{low} {high}");
        }
    }
}
