//! One face held against one sample, as posed to every integrator: four unknowns, the travel along
//! n*(0) and the normal.
//!
//! ```text
//! ds/dt = α ((F − f n)·n)      dn/dt = β f (n × F) × n      h = (p − b₀ − s n(0))·n      f = f_max / (1 + exp(h/h_min + δ))
//! ```

use nalgebra::{Matrix3, Matrix4, Point3, Vector3, Vector4};

use crate::reference::HeldFace;
use touchup_method::haptic::{
    ContactModel, DynamicsParams, FaceState, MotionDirection, SigmoidParams, StepRule,
};

/// Travel along n*(0), m, and the normal.
pub type State = [f64; 4];

/// f_max of the contact model, N; the paper leaves it open.
pub const F_MAX_N: f64 = 10.0;
/// The paper's δ.
pub const DELTA: f64 = 5.0;
/// The paper's α, m/(N·s).
pub const ALPHA_M_PER_N_S: f64 = 0.1;
/// The paper's β, 1/(N²·s).
pub const BETA_PER_N2_S: f64 = 0.1;

/// One face held against one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Problem {
    /// h_min, m: the smaller, the stiffer
    pub h_min_m: f64,
    /// tip from the barycentre of the face at the start, m, in O
    pub arm: Vector3<f64>,
    /// F on the stylus, N, in O
    pub force: Vector3<f64>,
    /// n* at the start, in O
    pub normal: Vector3<f64>,
    /// hold time of the sample, s
    pub dt_s: f64,
}

impl Problem {
    /// A face that looks up, 2 N for 5 ms, the tip 0.5 mm above the plane of the face and 0.5 mm
    /// beside its barycentre; the force leans away from the normal by `tilt`, rad.
    pub fn of(h_min_m: f64, tilt: f64) -> Self {
        Self {
            h_min_m,
            arm: Vector3::new(0.5e-3, 0.0, 0.5e-3),
            force: 2.0 * Vector3::new(tilt.sin(), 0.0, tilt.cos()),
            normal: Vector3::z(),
            dt_s: 5e-3,
        }
    }

    /// Initial state, s = 0 and n*(0).
    pub fn start(&self) -> State {
        [0.0, self.normal.x, self.normal.y, self.normal.z]
    }

    /// Characteristic size of each unknown.
    pub fn scale(&self) -> State {
        [self.h_min_m, 1.0, 1.0, 1.0]
    }

    /// Parameters of [`touchup_method::haptic::FaceDynamics`], with the paper's direction of motion.
    pub fn params(&self, rule: StepRule) -> DynamicsParams {
        DynamicsParams {
            model: ContactModel::Sigmoid(SigmoidParams {
                f_max: F_MAX_N,
                h_min: self.h_min_m,
                delta: DELTA,
            }),
            alpha_m_per_n_s: ALPHA_M_PER_N_S,
            beta_per_n2_s: BETA_PER_N2_S,
            rule,
            along: MotionDirection::InitialNormal,
            take_out_rigid_offset: false,
        }
    }

    /// The problem for the reference.
    pub fn held(&self) -> HeldFace {
        let Self {
            arm,
            force,
            normal,
            dt_s,
            ..
        } = *self;
        HeldFace {
            params: self.params(StepRule::Bounded),
            normal,
            arm,
            force,
            dt_s,
        }
    }

    /// The face at the start, its barycentre at the origin.
    pub fn face(&self) -> FaceState {
        FaceState {
            b: Point3::origin(),
            n: self.normal,
        }
    }

    /// Expected force, N, and its slope over h, N/m.
    pub fn expected(&self, h: f64) -> (f64, f64) {
        let u = h / self.h_min_m + DELTA;
        let e = (-u.abs()).exp();
        let share = if u > 0.0 {
            e / (1.0 + e)
        } else {
            1.0 / (1.0 + e)
        };
        (
            F_MAX_N * share,
            -F_MAX_N / self.h_min_m * e / ((1.0 + e) * (1.0 + e)),
        )
    }

    /// dy/dt as the paper prints it: n is used as is, even if an integrator has let it drift from
    /// length 1.
    pub fn rate(&self, y: &State) -> State {
        let n = Vector3::new(y[1], y[2], y[3]);
        let f = self.expected((self.arm - y[0] * self.normal).dot(&n)).0;
        let (pressing, squared) = (self.force.dot(&n), n.norm_squared());
        let turning = BETA_PER_N2_S * f * (squared * self.force - pressing * n);
        [
            ALPHA_M_PER_N_S * (pressing - f * squared),
            turning.x,
            turning.y,
            turning.z,
        ]
    }

    /// ∂(dy/dt)/∂y.
    pub fn jacobian(&self, y: &State) -> Matrix4<f64> {
        let n = Vector3::new(y[1], y[2], y[3]);
        let arm = self.arm - y[0] * self.normal;
        let (f, slope) = self.expected(arm.dot(&n));
        let (pressing, squared) = (self.force.dot(&n), n.norm_squared());
        // derivative of h by each unknown
        let h_by = Vector4::new(-self.normal.dot(&n), arm.x, arm.y, arm.z);
        let towards = squared * self.force - pressing * n;
        let (of_travel, turning) = (-ALPHA_M_PER_N_S * squared, BETA_PER_N2_S * towards);
        let by_h = slope * Vector4::new(of_travel, turning.x, turning.y, turning.z);
        let mut jacobian = by_h * h_by.transpose();
        let mut travel_by_n = jacobian.fixed_view_mut::<1, 3>(0, 1);
        travel_by_n += ALPHA_M_PER_N_S * (self.force - 2.0 * f * n).transpose();
        let turned = 2.0 * self.force * n.transpose() - n * self.force.transpose();
        let mut turning_by_n = jacobian.fixed_view_mut::<3, 3>(1, 1);
        turning_by_n += BETA_PER_N2_S * f * (turned - pressing * Matrix3::identity());
        jacobian
    }
}
