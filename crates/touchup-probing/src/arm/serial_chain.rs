//! A serial arm of six to [`MOST_JOINTS`] revolute joints, as in a URDF.
//!
//! T_Bi = Π_k O_k R(a_k, q_k): the origin of a joint in the frame of the one before, and a turn
//! about its axis. The inverse is a search from nearby joints, by steps Δq = Jᵀ (J Jᵀ + λ 1)⁻¹ e
//! with λ proportional to e² \[Sugihara 2011\]: far from a solution and near a singular pose the
//! steps stay short, near a solution they are Newton's, and each is the shortest of all that lead
//! there. A joint that would leave its range stays at its end, and the others do the remainder.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, Point3, SMatrix, UnitQuaternion, UnitVector3, Vector6};

use super::capsule::Capsule;
use super::joints::{Joints, MOST_JOINTS, largest_turn};

/// Velocity of a frame by the joint velocities: three rows of m/s, three of rad/s, a column for
/// each joint, then zeros.
pub(crate) type Jacobian = SMatrix<f64, 6, MOST_JOINTS>;

/// A revolute joint.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainJoint {
    /// name in the joint states
    pub name: Arc<str>,
    /// frame at zero angle, in the frame of the joint before; of the first joint in the base B
    pub origin: Isometry3<f64>,
    /// axis in the frame of the joint
    pub axis: UnitVector3<f64>,
    /// smallest and largest angle, rad; `None`: unlimited
    pub range: Option<[f64; 2]>,
}

/// A link that moves with a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainLink {
    /// the maker's name
    pub name: Arc<str>,
    /// body in the frame of its joint; of the first link in B; `None`: from joint to joint
    pub body: Option<Capsule>,
}

/// Why links and joints make no arm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChainError {
    /// Too few joints, or too many.
    #[error(
        "the arm has {count} turning joints: from 6, which a probe needs to come from any side, to {MOST_JOINTS} are supported"
    )]
    Count {
        /// number of joints
        count: usize,
    },
    /// Other links than one after each joint and one before the first.
    #[error("{count} joints need {} links, there are {links}", count + 1)]
    Links {
        /// number of joints
        count: usize,
        /// number of links
        links: usize,
    },
    /// A range without room, or a value that is no number.
    #[error("joint {name}: {what}")]
    Joint {
        /// name of the joint
        name: Arc<str>,
        /// its defect
        what: &'static str,
    },
    /// A radius out of range.
    #[error("a link has a radius of {radius_mm} mm: give one above 0 and up to 1000 mm")]
    Radius {
        /// radius, mm
        radius_mm: f64,
    },
}

/// Why a pose has no joint angles.
#[derive(Clone, Debug, PartialEq)]
pub enum IkFailure {
    /// too far, or in an impossible orientation
    Pose,
    /// reachable but for the range of a joint
    Range {
        /// name of the joint
        joint: Arc<str>,
        /// its range, rad
        range: [f64; 2],
    },
}

/// A serial arm.
///
/// Joints have unique names, ranges with room, and axes of one metre to a relative 10⁻¹²; links
/// have a capsule each.
#[derive(Clone, Debug, PartialEq)]
pub struct SerialChain {
    joints: Vec<ChainJoint>,
    links: Vec<(Arc<str>, Capsule)>,
    /// flange in the frame of the last joint
    end: Isometry3<f64>,
    /// pairs of links that may collide; the number after the last is the flange, as a point
    meeting: Vec<(usize, usize)>,
    /// length from the second joint along all others to the flange, m
    reach: f64,
}

/// Poses of the frames of an arm in B.
struct ChainFrames {
    /// frame of each joint, turned
    joints: [Isometry3<f64>; MOST_JOINTS],
    flange: Isometry3<f64>,
}

/// Maximum turn of a joint in one step of the search, rad.
const STEP: f64 = 0.3;
/// Maximum number of steps of a search.
const STEPS: usize = 100;
/// Error of a reached pose, in units of the reach and in rad: some thousand roundings.
const REACHED: f64 = 1e-12;
/// Damping in units of the squared error: after steps that help, and at which the search gives up.
const DAMPING: [f64; 2] = [1e-3, 1e6];
/// Factor of the damping: up after a step that fails, down after a step that helps.
const MORE: f64 = 10.0;
/// Least damping, the square of the smallest singular value that counts: rounding.
const LEAST_DAMPING: f64 = 1e-16;
/// Parts of the path to a pose that a search from nearby joints does not reach.
const PARTS: usize = 16;
/// Start configurations across the ranges, for a pose that the path does not reach either.
const CONFIGURATIONS: usize = 32;
/// Configurations tried to find two links clear of each other.
const MEETINGS: usize = 256;

/// Refuses a joint without a range, an origin, an axis or a name of its own.
fn check_joints(joints: &[ChainJoint]) -> Result<(), ChainError> {
    for (number, joint) in joints.iter().enumerate() {
        let fault = |what| {
            Err(ChainError::Joint {
                name: joint.name.clone(),
                what,
            })
        };
        if joint
            .range
            .is_some_and(|[low, high]| !(low < high && low.is_finite() && high.is_finite()))
        {
            return fault("its range has no room: give a lower limit below the upper one");
        }
        if !is_finite(&joint.origin) || !joint.axis.iter().all(|part| part.is_finite()) {
            return fault("its origin or axis is no number");
        }
        if joints[..number]
            .iter()
            .any(|other| other.name == joint.name)
        {
            return fault("another has the same name");
        }
    }
    Ok(())
}

impl SerialChain {
    /// - `links`: one before the first joint, and one after each.
    /// - `end`: flange in the frame of the last joint.
    /// - `radius`: of links without a body, m.
    ///
    /// # Errors
    /// [`ChainError`]
    pub fn new(
        joints: Vec<ChainJoint>,
        links: Vec<ChainLink>,
        end: Isometry3<f64>,
        radius: f64,
    ) -> Result<Self, ChainError> {
        let count = joints.len();
        if !(6..=MOST_JOINTS).contains(&count) {
            return Err(ChainError::Count { count });
        }
        if links.len() != count + 1 {
            return Err(ChainError::Links {
                count,
                links: links.len(),
            });
        }
        check_joints(&joints)?;
        let starts = |number: usize| {
            joints
                .get(number)
                .map_or(&end, |joint| &joint.origin)
                .translation
                .vector
        };
        let body = |(number, link): (usize, ChainLink)| {
            let between = Capsule {
                ends: [Point3::origin(), Point3::from(starts(number))],
                radius,
            };
            (link.name, link.body.unwrap_or(between))
        };
        let links: Vec<_> = links.into_iter().enumerate().map(body).collect();
        let thick = links
            .iter()
            .map(|(_, body)| body.radius)
            .find(|radius| !(*radius > 0.0 && *radius <= 1.0));
        if let Some(radius) = thick {
            return Err(ChainError::Radius {
                radius_mm: radius * 1e3,
            });
        }
        let reach = (2..=count).map(|number| starts(number).norm()).sum();
        if !is_finite(&end) || reach <= 0.0 {
            return Err(ChainError::Joint {
                name: joints[count - 1].name.clone(),
                what: "its flange is nowhere",
            });
        }
        let mut chain = Self {
            joints,
            links,
            end,
            meeting: Vec::new(),
            reach,
        };
        chain.meeting = chain.meeting();
        Ok(chain)
    }

    /// Pairs of links that share no joint, and are clear of each other in some configuration: any
    /// other pair lies side by side.
    fn meeting(&self) -> Vec<(usize, usize)> {
        let last = self.links.len();
        let pairs = (0..=last).flat_map(|one| (one + 2..=last).map(move |other| (one, other)));
        let mut hidden: Vec<_> = pairs.collect();
        let mut meeting = Vec::new();
        for joints in (1..=MEETINGS).map(|number| self.configuration(number)) {
            let bodies = self.bodies(&joints, None);
            let (clear, still): (Vec<_>, Vec<_>) = hidden
                .into_iter()
                .partition(|(one, other)| bodies[*one].gap(&bodies[*other]) > 0.0);
            meeting.extend(clear);
            hidden = still;
        }
        meeting.sort_unstable();
        meeting
    }

    /// Configuration of a sequence that fills the ranges evenly \[Halton 1960\].
    fn configuration(&self, number: usize) -> Joints {
        const BASES: [usize; MOST_JOINTS] = [2, 3, 5, 7, 11, 13, 17, 19];
        self.middle().mapped(|joint, _| {
            let (mut share, mut part, mut rest) = (0.0, 1.0, number);
            while rest > 0 {
                part /= BASES[joint] as f64;
                share += part * (rest % BASES[joint]) as f64;
                rest /= BASES[joint];
            }
            let [low, high] = self.joints[joint]
                .range
                .unwrap_or([-PI, PI])
                .map(|end| end.clamp(-TAU, TAU));
            low + (high - low) * share
        })
    }

    /// Each joint in the middle of its range.
    pub(super) fn middle(&self) -> Joints {
        let zeros = Joints::of(&[0.0; MOST_JOINTS][..self.joints.len()])
            .unwrap_or([0.0; MOST_JOINTS].into());
        zeros.mapped(|joint, _| {
            self.joints[joint]
                .range
                .map_or(0.0, |[low, high]| f64::midpoint(low, high))
        })
    }

    /// Joints, from the base on.
    pub fn joints(&self) -> &[ChainJoint] {
        &self.joints
    }

    /// Names of the links, from the base on.
    pub(super) fn link_names(&self) -> impl Iterator<Item = &Arc<str>> {
        self.links.iter().map(|(name, _)| name)
    }

    /// Pairs of links that may collide, by number; the probe comes after the last link.
    pub(super) fn meeting_links(&self) -> &[(usize, usize)] {
        &self.meeting
    }

    fn frames(&self, joints: &Joints) -> ChainFrames {
        let (mut frames, mut pose) = ([Isometry3::identity(); MOST_JOINTS], Isometry3::identity());
        for ((joint, angle), frame) in self.joints.iter().zip(joints.iter()).zip(&mut frames) {
            pose *= joint.origin * UnitQuaternion::from_axis_angle(&joint.axis, *angle);
            *frame = pose;
        }
        ChainFrames {
            joints: frames,
            flange: pose * self.end,
        }
    }

    /// Pose of the flange in the base B.
    pub(crate) fn flange(&self, joints: &Joints) -> Isometry3<f64> {
        self.frames(joints).flange
    }

    /// Velocity of the flange by the joint velocities, in B.
    pub(crate) fn jacobian(&self, joints: &Joints) -> Jacobian {
        self.jacobian_at(&self.frames(joints))
    }

    fn jacobian_at(&self, frames: &ChainFrames) -> Jacobian {
        let end = frames.flange.translation.vector;
        let mut jacobian = Jacobian::zeros();
        for (column, (joint, frame)) in self.joints.iter().zip(&frames.joints).enumerate() {
            let axis = frame.rotation * joint.axis.into_inner();
            let linear = axis.cross(&(end - frame.translation.vector));
            jacobian
                .fixed_view_mut::<3, 1>(0, column)
                .copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&axis);
        }
        jacobian
    }

    /// Distance from a singularity: the smallest singular value of the Jacobian, lengths in units
    /// of the arm from its second joint on.
    pub(crate) fn dexterity(&self, joints: &Joints) -> f64 {
        let mut jacobian = self.jacobian(joints);
        jacobian.rows_mut(0, 3).scale_mut(1.0 / self.reach);
        // six rows, for any number of zero columns
        (jacobian * jacobian.transpose())
            .symmetric_eigenvalues()
            .min()
            .max(0.0)
            .sqrt()
    }

    /// Capsules of the links in B, from the base on, then the probe.
    ///
    /// - `pose_ft`: the tip in the flange; `None`: the flange alone, as a point.
    pub(super) fn bodies(&self, joints: &Joints, pose_ft: Option<&Isometry3<f64>>) -> Vec<Capsule> {
        let frames = self.frames(joints);
        let carriers = std::iter::once(Isometry3::identity()).chain(frames.joints);
        let links = self
            .links
            .iter()
            .zip(carriers)
            .map(|((_, body), carrier)| body.moved(&carrier));
        let tip = frames.flange * pose_ft.copied().unwrap_or_else(Isometry3::identity);
        let probe = Capsule {
            ends: [frames.flange, tip].map(|pose| pose.translation.vector.into()),
            radius: 0.0,
        };
        links.chain([probe]).collect()
    }

    /// Smallest gap between links that may collide, m.
    fn own_gap(&self, joints: &Joints) -> f64 {
        let bodies = self.bodies(joints, None);
        self.meeting
            .iter()
            .map(|(one, other)| bodies[*one].gap(&bodies[*other]))
            .fold(f64::INFINITY, f64::min)
    }

    /// Joint angles within their ranges that bring the flange to a pose in B, near `near`.
    ///
    /// For a nearby pose they are the nearest to first order; if a search from `near` fails, they
    /// come from a straight path, and then from the nearest of some searches from all over the
    /// ranges.
    ///
    /// # Errors
    /// [`IkFailure`]
    pub(super) fn nearest(
        &self,
        pose_bf: &Isometry3<f64>,
        near: &Joints,
    ) -> Result<Joints, IkFailure> {
        let from = self.flange(near);
        let first = self.joints[0].origin.translation.vector;
        if (pose_bf.translation.vector - first).norm() > self.reach_of_all() {
            return Err(IkFailure::Pose);
        }
        let unreached = match self.search(pose_bf, near) {
            Ok(found) => return Ok(found),
            Err(unreached) => unreached,
        };
        let part = |part: usize| from.try_lerp_slerp(pose_bf, part as f64 / PARTS as f64, 1e-9);
        let along = (1..PARTS).try_fold(*near, |joints, number| {
            self.search(&part(number)?, &joints).ok()
        });
        if let Some(found) = along.and_then(|joints| self.search(pose_bf, &joints).ok()) {
            return Ok(found);
        }
        let solutions = self
            .solutions(pose_bf)
            .map(|joints| self.unwound(&joints, near));
        let nearest =
            solutions.min_by(|a, b| largest_turn(a, near).total_cmp(&largest_turn(b, near)));
        nearest.ok_or(unreached)
    }

    /// Joint angles of a pose in B with the largest dexterity, by searches from all over the
    /// ranges, with links clear of each other if possible.
    pub(super) fn most_dexterous(&self, pose_bf: &Isometry3<f64>) -> Option<Joints> {
        let from_middle = self.search(pose_bf, &self.middle()).ok();
        let room = |joints: &Joints| (self.own_gap(joints) > 0.0, self.dexterity(joints));
        let solutions = from_middle.into_iter().chain(self.solutions(pose_bf));
        let rated = solutions.map(|joints| (room(&joints), joints));
        rated
            .max_by(|((a, x), _), ((b, y), _)| a.cmp(b).then(x.total_cmp(y)))
            .map(|(_, joints)| joints)
    }

    fn solutions<'a>(&'a self, pose_bf: &'a Isometry3<f64>) -> impl Iterator<Item = Joints> + 'a {
        (1..=CONFIGURATIONS)
            .filter_map(move |number| self.search(pose_bf, &self.configuration(number)).ok())
    }

    /// Maximum distance of the flange from the first joint, m.
    fn reach_of_all(&self) -> f64 {
        self.joints[1].origin.translation.vector.norm() + self.reach
    }

    /// The same angles, each within half a turn of `near`, as far as its range allows.
    fn unwound(&self, joints: &Joints, near: &Joints) -> Joints {
        joints.mapped(|joint, angle| {
            let turned = angle + TAU * ((near[joint] - angle) / TAU).round();
            let is_in = self.joints[joint]
                .range
                .is_none_or(|[low, high]| (low..=high).contains(&turned));
            if is_in { turned } else { angle }
        })
    }

    /// Searches joint angles for a pose, from others.
    fn search(&self, pose_bf: &Isometry3<f64>, from: &Joints) -> Result<Joints, IkFailure> {
        let mut joints = from.mapped(|joint, angle| match self.joints[joint].range {
            Some([low, high]) => angle.clamp(low, high),
            None => angle,
        });
        let mut frames = self.frames(&joints);
        let mut error = self.error(&frames, pose_bf);
        let mut damping = DAMPING[0];
        for _ in 0..STEPS {
            if error.amax() < REACHED {
                return Ok(joints);
            }
            let next = self.step(
                &joints,
                &frames,
                &error,
                damping * error.norm_squared() + LEAST_DAMPING,
            );
            let Some(next) = next else { break };
            let next_frames = self.frames(&next);
            let next_error = self.error(&next_frames, pose_bf);
            if next_error.norm_squared() < error.norm_squared() {
                (joints, frames, error) = (next, next_frames, next_error);
                damping = (damping / MORE).max(DAMPING[0]);
            } else {
                damping *= MORE;
                if damping > DAMPING[1] {
                    break;
                }
            }
        }
        let held = self
            .joints
            .iter()
            .zip(joints.iter())
            .find_map(|(joint, angle)| {
                let range = joint.range.filter(|ends| ends.contains(angle))?;
                Some(IkFailure::Range {
                    joint: joint.name.clone(),
                    range,
                })
            });
        Err(held.unwrap_or(IkFailure::Pose))
    }

    /// Error of the flange: in units of the reach, and in rad, in B.
    fn error(&self, frames: &ChainFrames, pose_bf: &Isometry3<f64>) -> Vector6<f64> {
        let way = (pose_bf.translation.vector - frames.flange.translation.vector) / self.reach;
        let turn = (pose_bf.rotation * frames.flange.rotation.inverse()).scaled_axis();
        Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z)
    }

    /// Joints after one step, all within their ranges.
    fn step(
        &self,
        joints: &Joints,
        frames: &ChainFrames,
        error: &Vector6<f64>,
        damping: f64,
    ) -> Option<Joints> {
        let mut jacobian = self.jacobian_at(frames);
        jacobian.rows_mut(0, 3).scale_mut(1.0 / self.reach);
        let (mut left, mut next, mut is_held) = (*error, *joints, [false; MOST_JOINTS]);
        // each round holds one more joint
        for _ in 0..=self.joints.len() {
            let turns = shortest(&jacobian, &left, damping)?;
            let share = (STEP / turns.amax()).min(1.0);
            let mut is_over = false;
            for (column, joint) in self.joints.iter().enumerate() {
                if is_held[column] {
                    continue;
                }
                let turned = joints[column] + turns[column] * share;
                let held = joint
                    .range
                    .map(|[low, high]| turned.clamp(low, high))
                    .filter(|held| *held != turned);
                next[column] = held.unwrap_or(turned);
                if let Some(held) = held {
                    (is_held[column], is_over) = (true, true);
                    left -= jacobian.column(column) * (held - joints[column]);
                    jacobian.column_mut(column).fill(0.0);
                }
            }
            if !is_over {
                return Some(next);
            }
        }
        Some(next)
    }
}

/// Shortest turns x with J x = v, damped: Jᵀ (J Jᵀ + λ 1)⁻¹ v.
pub(super) fn shortest(
    jacobian: &Jacobian,
    velocity: &Vector6<f64>,
    damping: f64,
) -> Option<nalgebra::SVector<f64, MOST_JOINTS>> {
    let normal = jacobian * jacobian.transpose() + Matrix6::from_diagonal_element(damping);
    Some(jacobian.transpose() * normal.cholesky()?.solve(velocity))
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation
        .vector
        .iter()
        .chain(pose.rotation.coords.iter())
        .all(|part| part.is_finite())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn sequences_of_configurations_fill_each_range() {
        let axis = Vector3::z_axis();
        let joint = |number: usize| ChainJoint {
            name: format!("j{number}").into(),
            origin: Isometry3::translation(0.1, 0.0, 0.0),
            axis,
            range: (number > 0).then_some([-1.0, 2.0]),
        };
        let link = |number: usize| ChainLink {
            name: format!("l{number}").into(),
            body: None,
        };
        let joints = (0..6).map(joint).collect();
        let chain = SerialChain::new(
            joints,
            (0..7).map(link).collect(),
            Isometry3::identity(),
            0.01,
        )
        .unwrap();
        let at = |joint: usize| (1..=64).map(move |number| (number, joint));
        for joint in 0..6 {
            let (low, high) = if joint == 0 { (-PI, PI) } else { (-1.0, 2.0) };
            let angles: Vec<f64> = at(joint)
                .map(|(number, joint)| chain.configuration(number)[joint])
                .collect();
            assert!(angles.iter().all(|angle| (low..high).contains(angle)));
            // each third of the range has its share
            for third in 0..3 {
                let from = low + (high - low) * f64::from(third) / 3.0;
                let in_it = angles
                    .iter()
                    .filter(|angle| (from..from + (high - low) / 3.0).contains(angle))
                    .count();
                assert!((16..=26).contains(&in_it), "{joint} {third}: {in_it}");
            }
        }
    }
}
