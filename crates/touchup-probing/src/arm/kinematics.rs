//! Kinematics of a six-axis UR arm: pose of the flange, and joint angles of a pose.
//!
//! T_B6 = Π A_i, A_i = Rz(θ_i) Tz(d_i) Tx(a_i) Rx(α_i), α = (π/2, 0, 0, π/2, −π/2, 0)      \[Denavit Hartenberg 1955\]
//!
//! Axes 2, 3 and 4 are parallel and the last three do not meet in a point, so the inverse goes
//! through axis 1 (the wrist lies on a line at distance d₄ beside it), then 5 and 6, then the
//! triangle of upper arm and forearm \[Hawkins 2013\].

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};

/// Lengths of a UR; those without a DH parameter of a UR are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UrGeometry {
    /// DH length d₁, m
    pub d1: f64,
    /// upper arm, m; negative, as by the maker
    pub a2: f64,
    /// forearm, m; negative, as by the maker
    pub a3: f64,
    /// DH length d₄, m
    pub d4: f64,
    /// DH length d₅, m
    pub d5: f64,
    /// DH length d₆, m
    pub d6: f64,
    /// offset of the upper arm beside the shoulder's centre, along the axis of the shoulder, m
    pub upper_arm_beside: f64,
    /// offset of the forearm, along the same axis, m
    pub forearm_beside: f64,
    /// radii of base, upper arm, forearm and wrist, each at its thickest place, m
    pub radii: [f64; 4],
}

impl UrGeometry {
    /// UR3e: the maker's lengths, and radii from the maker's drawings, rounded up.
    pub const UR3E: Self = Self {
        d1: 0.15185,
        a2: -0.24355,
        a3: -0.2132,
        d4: 0.13105,
        d5: 0.08535,
        d6: 0.0921,
        upper_arm_beside: 0.120,
        forearm_beside: 0.027,
        radii: [0.064, 0.050, 0.045, 0.040],
    };
    /// UR5e, from the same sources.
    pub const UR5E: Self = Self {
        d1: 0.1625,
        a2: -0.425,
        a3: -0.3922,
        d4: 0.1333,
        d5: 0.0997,
        d6: 0.0996,
        upper_arm_beside: 0.138,
        forearm_beside: 0.007,
        radii: [0.075, 0.062, 0.058, 0.047],
    };
    /// UR10e, from the same sources.
    pub const UR10E: Self = Self {
        d1: 0.1807,
        a2: -0.6127,
        a3: -0.57155,
        d4: 0.17415,
        d5: 0.11985,
        d6: 0.11655,
        upper_arm_beside: 0.176,
        forearm_beside: 0.039,
        radii: [0.095, 0.080, 0.070, 0.060],
    };
    /// UR16e, from the same sources.
    pub const UR16E: Self = Self {
        d1: 0.1807,
        a2: -0.4784,
        a3: -0.36,
        d4: 0.17415,
        d5: 0.11985,
        d6: 0.11655,
        upper_arm_beside: 0.176,
        forearm_beside: 0.039,
        radii: [0.095, 0.080, 0.070, 0.060],
    };

    /// DH parameters d, a and α of each link, m and rad.
    fn links(&self) -> [(f64, f64, f64); 6] {
        let Self {
            d1,
            a2,
            a3,
            d4,
            d5,
            d6,
            ..
        } = *self;
        let (d, a) = ([d1, 0.0, 0.0, d4, d5, d6], [0.0, a2, a3, 0.0, 0.0, 0.0]);
        let alpha = [FRAC_PI_2, 0.0, 0.0, FRAC_PI_2, -FRAC_PI_2, 0.0];
        std::array::from_fn(|i| (d[i], a[i], alpha[i]))
    }

    /// Pose of the flange in the base B.
    pub(crate) fn flange(&self, joints: &[f64; 6]) -> Isometry3<f64> {
        self.link_poses(joints)[5]
    }

    /// Pose of the end of each link in B, in the axes of the joint there; the last is the flange.
    pub(super) fn link_poses(&self, joints: &[f64; 6]) -> [Isometry3<f64>; 6] {
        let (links, mut pose) = (self.links(), Isometry3::identity());
        std::array::from_fn(|i| {
            pose *= step(&links[i], joints[i]);
            pose
        })
    }

    /// Velocity of the flange by the joint velocities: three rows of m/s, three of rad/s, in B.
    pub(crate) fn jacobian(&self, joints: &[f64; 6]) -> Matrix6<f64> {
        let end = self.flange(joints).translation.vector;
        let (mut jacobian, mut pose) = (Matrix6::zeros(), Isometry3::identity());
        for (column, (link, angle)) in self.links().iter().zip(joints).enumerate() {
            let axis = pose.rotation * Vector3::z();
            let linear = axis.cross(&(end - pose.translation.vector));
            jacobian
                .fixed_view_mut::<3, 1>(0, column)
                .copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&axis);
            pose *= step(link, *angle);
        }
        jacobian
    }

    /// Distance from a singularity: the smallest singular value of the Jacobian, lengths in units
    /// of upper arm plus forearm. Zero for a stretched arm, for the wrist above the shoulder, and
    /// for parallel axes 4 and 6.
    pub(crate) fn dexterity(&self, joints: &[f64; 6]) -> f64 {
        let mut jacobian = self.jacobian(joints);
        jacobian
            .rows_mut(0, 3)
            .scale_mut(1.0 / (self.a2.abs() + self.a3.abs()));
        jacobian.singular_values().min()
    }

    /// All joint angles in rad, from the base to the wrist, within (−π, π], that bring the flange
    /// to a pose in B: at most eight, none out of reach.
    ///
    /// Parallel axes 4 and 6 determine only the sum of their angles; then the sixth joint stays as
    /// in `near`.
    pub fn inverse(&self, pose_bf: &Isometry3<f64>, near: &[f64; 6]) -> Vec<[f64; 6]> {
        let mut found = Vec::with_capacity(8);
        for q1 in self.shoulders(pose_bf) {
            for (q5, q6) in self.wrists(pose_bf, q1, near[5]) {
                self.elbows(pose_bf, [q1, q5, q6], &mut found);
            }
        }
        found
    }

    /// First joint: the wrist's centre is d₄ beside the plane of the arm.
    fn shoulders(&self, pose_bf: &Isometry3<f64>) -> Vec<f64> {
        let wrist = pose_bf * nalgebra::Point3::new(0.0, 0.0, -self.d6);
        let distance = wrist.x.hypot(wrist.y);
        let share = self.d4 / distance;
        if share.is_nan() || share.abs() > 1.0 {
            return Vec::new();
        }
        let (direction, beside) = (wrist.y.atan2(wrist.x), share.acos());
        [beside, -beside]
            .map(|by| wrapped(direction + by + FRAC_PI_2))
            .to_vec()
    }

    /// Fifth and sixth joint.
    fn wrists(&self, pose_bf: &Isometry3<f64>, q1: f64, q6_near: f64) -> Vec<(f64, f64)> {
        let (sin, cos) = q1.sin_cos();
        // across the plane of the arm
        let across = Vector3::new(sin, -cos, 0.0);
        let cos_q5 = (across.dot(&pose_bf.translation.vector) - self.d4) / self.d6;
        if cos_q5.is_nan() || cos_q5.abs() > 1.0 + ROUNDING {
            return Vec::new();
        }
        let bend = cos_q5.clamp(-1.0, 1.0).acos();
        let [x, y] =
            [Vector3::x(), Vector3::y()].map(|axis| across.dot(&(pose_bf.rotation * axis)));
        let at = |q5: f64| {
            let sign = q5.sin();
            // parallel axes 4 and 6 determine only the sum of their angles
            let q6 = if sign.abs() < PARALLEL {
                q6_near
            } else {
                (-y / sign).atan2(x / sign)
            };
            (q5, wrapped(q6))
        };
        if bend < PARALLEL {
            vec![at(bend)]
        } else {
            vec![at(bend), at(-bend)]
        }
    }

    /// Second to fourth joint: the triangle of upper arm and forearm.
    fn elbows(&self, pose_bf: &Isometry3<f64>, [q1, q5, q6]: [f64; 3], found: &mut Vec<[f64; 6]>) {
        let links = self.links();
        let first = step(&links[0], q1);
        let last = step(&links[4], q5) * step(&links[5], q6);
        // pose of joint 4 in the frame of joint 1
        let pose = first.inverse() * pose_bf * last.inverse();
        let target = pose * nalgebra::Point3::new(0.0, -self.d4, 0.0);
        let reach = target.x.hypot(target.y);
        let cos_q3 =
            (reach * reach - self.a2 * self.a2 - self.a3 * self.a3) / (2.0 * self.a2 * self.a3);
        if cos_q3.is_nan() || cos_q3.abs() > 1.0 + ROUNDING {
            return;
        }
        let bend = cos_q3.clamp(-1.0, 1.0).acos();
        for q3 in [bend, -bend] {
            let forearm = (self.a3 * q3.sin()).atan2(self.a2 + self.a3 * q3.cos());
            let q2 = target.y.atan2(target.x) - forearm;
            let before = step(&links[1], q2) * step(&links[2], q3);
            let turn = (before.rotation.inverse() * pose.rotation) * Vector3::x();
            let q4 = turn.y.atan2(turn.x);
            found.push([q1, q2, q3, q4, q5, q6].map(wrapped));
            if bend < PARALLEL {
                return;
            }
        }
    }
}

/// Angle below which two axes are parallel, rad.
const PARALLEL: f64 = 1e-9;
/// Maximum rounding of a cosine beyond one: sixteen roundings, and those in the lengths.
const ROUNDING: f64 = 1e-12;

/// Transform of one link: turn by `angle`, d along z, a along x, α about x.
fn step(&(d, a, alpha): &(f64, f64, f64), angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha);
    Isometry3::from_parts(
        Translation3::from(turn * Vector3::new(a, 0.0, d)),
        turn * tilt,
    )
}

/// The same angle within (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(2.0 * PI);
    if turned > PI {
        turned - 2.0 * PI
    } else {
        turned
    }
}
