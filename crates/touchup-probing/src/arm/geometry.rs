//! Geometry of an arm: pose of the flange by its joints, and joints of a pose.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Isometry3, Vector3, Vector6};

use super::joints::{Joints, largest_turn};
use super::kinematics::UrGeometry;
use super::serial_chain::{IkFailure, Jacobian, SerialChain, shortest};

/// Geometry of an arm.
#[derive(Clone, Debug, PartialEq)]
pub enum ArmGeometry {
    /// A UR, with its inverse in closed form.
    Ur(UrGeometry),
    /// Any other arm, with a search for its inverse.
    Chain(Arc<SerialChain>),
}

impl From<UrGeometry> for ArmGeometry {
    fn from(ur: UrGeometry) -> Self {
        Self::Ur(ur)
    }
}

impl From<SerialChain> for ArmGeometry {
    fn from(chain: SerialChain) -> Self {
        Self::Chain(Arc::new(chain))
    }
}

/// Maximum turn of a UR joint from its zero, rad.
const JOINT_RANGE: f64 = TAU;
/// Folded configuration of a UR, rad: the inverse chooses joints within half a turn of it.
const FOLDED: [f64; 6] = [0.0, -1.6, 1.6, -1.6, -1.6, 0.0];

impl ArmGeometry {
    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        match self {
            Self::Ur(_) => 6,
            Self::Chain(chain) => chain.joints().len(),
        }
    }

    /// Pose of the flange in the base B.
    ///
    /// # Panics
    /// For a number of joints other than the arm's, as all calls with joints.
    pub fn flange(&self, joints: &Joints) -> Isometry3<f64> {
        match self {
            Self::Ur(ur) => ur.flange(six(joints)),
            Self::Chain(chain) => chain.flange(joints),
        }
    }

    /// Velocity of the flange by the joint velocities, in B.
    pub fn jacobian(&self, joints: &Joints) -> Jacobian {
        match self {
            Self::Ur(ur) => {
                let mut jacobian = Jacobian::zeros();
                jacobian
                    .columns_mut(0, 6)
                    .copy_from(&ur.jacobian(six(joints)));
                jacobian
            }
            Self::Chain(chain) => chain.jacobian(joints),
        }
    }

    /// Distance from a singularity: the smallest singular value of the Jacobian, lengths in units
    /// of the arm's own.
    pub fn dexterity(&self, joints: &Joints) -> f64 {
        match self {
            Self::Ur(ur) => ur.dexterity(six(joints)),
            Self::Chain(chain) => chain.dexterity(joints),
        }
    }

    /// Slowest joint velocities for a velocity of the flange, rad/s; `None` if there are none.
    ///
    /// - `linear`, `angular`: of the flange, m/s and rad/s in B.
    pub fn turning(
        &self,
        joints: &Joints,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
    ) -> Option<Joints> {
        let velocity = Vector6::new(
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        );
        let rates = shortest(&self.jacobian(joints), &velocity, 0.0)?;
        Some(joints.mapped(|joint, _| rates[joint]))
            .filter(|rates| rates.iter().all(|rate| rate.is_finite()))
    }

    /// Joint angles within their ranges that bring the flange to a pose in B, nearest to `near`.
    ///
    /// # Errors
    /// [`IkFailure`]
    pub fn nearest(&self, pose_bf: &Isometry3<f64>, near: &Joints) -> Result<Joints, IkFailure> {
        match self {
            Self::Ur(ur) => {
                let solutions = ur.inverse(pose_bf, six(near)).into_iter().map(Joints::from);
                let unwound = solutions.map(|joints| unwound(&joints, near));
                let in_range =
                    unwound.filter(|joints| joints.iter().all(|angle| angle.abs() <= JOINT_RANGE));
                let nearest =
                    in_range.min_by(|a, b| largest_turn(a, near).total_cmp(&largest_turn(b, near)));
                nearest.ok_or(IkFailure::Pose)
            }
            Self::Chain(chain) => chain.nearest(pose_bf, near),
        }
    }

    /// Joint angles that bring the flange to a pose in B with the largest dexterity: the start of
    /// an arm that exists only in a plan or a simulation. `None` out of reach.
    pub fn most_dexterous(&self, pose_bf: &Isometry3<f64>) -> Option<Joints> {
        match self {
            Self::Ur(ur) => {
                let solutions = ur.inverse(pose_bf, &FOLDED).into_iter();
                solutions
                    .max_by(|a, b| ur.dexterity(a).total_cmp(&ur.dexterity(b)))
                    .map(Joints::from)
            }
            Self::Chain(chain) => chain.most_dexterous(pose_bf),
        }
    }
}

/// The six joints of a UR.
pub(super) fn six(joints: &Joints) -> &[f64; 6] {
    <&[f64; 6]>::try_from(&**joints)
        .expect("whoever has another arm has another geometry: `Limits::check_pose` looks")
}

/// The same angles, each within half a turn of `near`.
fn unwound(joints: &Joints, near: &Joints) -> Joints {
    joints.mapped(|joint, angle| angle + TAU * ((near[joint] - angle) / TAU).round())
}
