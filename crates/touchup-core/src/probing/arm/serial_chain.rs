//! An arm of any six to [`MOST_JOINTS`] turning joints one after the other, as a URDF describes it.
//!
//! T_Bi = Π_k O_k R(a_k, q_k): the origin of a joint in the frame of the one before, and a turn
//! about its axis. The inverse is searched from joints near it, by steps Δq = Jᵀ (J Jᵀ + λ 1)⁻¹ e
//! with λ in proportion to e² \[Sugihara 2011\]: far from a solution and near a singular pose the
//! steps stay short, near a solution they are Newton's, and of the steps that lead there each is
//! the shortest. A joint that would leave its range stays at the end of it, and the others do what
//! is left.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, Point3, SMatrix, UnitQuaternion, UnitVector3, Vector6};

use super::capsule::Capsule;
use super::joints::{Joints, MOST_JOINTS, largest_turn};

/// Velocity of a frame by those of the joints: three rows of m/s, three of rad/s, a column for each
/// joint, then zeros.
pub type Jacobian = SMatrix<f64, 6, MOST_JOINTS>;

/// A joint that turns.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainJoint {
    /// as its states have it
    pub name: Arc<str>,
    /// its frame at zero, in the frame of the joint before; of the first in the base B
    pub origin: Isometry3<f64>,
    /// in its frame
    pub axis: UnitVector3<f64>,
    /// smallest and largest angle, rad; `None`: it turns on and on
    pub range: Option<[f64; 2]>,
}

/// What moves with a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainLink {
    /// as its maker has it
    pub name: Arc<str>,
    /// the room that it takes up, in the frame of its joint; of the first link in B; `None`: from
    /// joint to joint
    pub body: Option<Capsule>,
}

/// Why links and joints are no arm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChainError {
    /// Too few, or too many.
    #[error(
        "the arm has {count} turning joints: from 6, which a probe needs to come from any side, to {MOST_JOINTS} are supported"
    )]
    Count {
        /// of joints
        count: usize,
    },
    /// No link after each joint and one before the first.
    #[error("{count} joints need {} links, there are {links}", count + 1)]
    Links {
        /// of joints
        count: usize,
        /// of links
        links: usize,
    },
    /// A range without room, or what is no number.
    #[error("joint {name}: {what}")]
    Joint {
        /// which
        name: Arc<str>,
        /// what is wrong
        what: &'static str,
    },
    /// Nothing can be thinner than nothing.
    #[error("a link has a radius of {radius_mm} mm: give one above 0 and up to 1000 mm")]
    Radius {
        /// mm
        radius_mm: f64,
    },
}

/// Why no joint angles are found for a pose.
#[derive(Clone, Debug, PartialEq)]
pub enum Unreached {
    /// too far, or turned as it cannot be
    Pose,
    /// but for the range of a joint
    Range {
        /// by name
        joint: Arc<str>,
        /// rad
        range: [f64; 2],
    },
}

/// An arm.
///
/// Joints have names of their own, ranges with room, and axes of one metre to a relative 10⁻¹²;
/// links take up a capsule each.
#[derive(Clone, Debug, PartialEq)]
pub struct SerialChain {
    joints: Vec<ChainJoint>,
    links: Vec<(Arc<str>, Capsule)>,
    /// of the flange in the frame of the last joint
    end: Isometry3<f64>,
    /// pairs of links that may meet; the number after the last is the flange, as a point
    meeting: Vec<(usize, usize)>,
    /// from the second joint along all others to the flange, m
    reach: f64,
}

/// Poses of the frames of an arm in B.
struct ChainFrames {
    /// of each joint, turned
    joints: [Isometry3<f64>; MOST_JOINTS],
    flange: Isometry3<f64>,
}

/// No joint turns farther in one step of the search, rad.
const STEP: f64 = 0.3;
/// Steps of a search at most.
const STEPS: usize = 100;
/// A pose is reached when it is so near, in units of the reach and in rad: some thousand roundings.
const REACHED: f64 = 1e-12;
/// Damping in units of the squared error: of steps that help, and where it is given up.
const DAMPING: [f64; 2] = [1e-3, 1e6];
/// By this factor it grows where a step does not help, and falls where one does.
const MORE: f64 = 10.0;
/// Of the square of the smallest singular value that counts: rounding.
const LEAST_DAMPING: f64 = 1e-16;
/// A pose that is not reached from near joints is gone to in so many parts.
const PARTS: usize = 16;
/// Then it is searched from so many configurations spread over the ranges.
const CONFIGURATIONS: usize = 32;
/// In so many configurations is looked for one in which two links are clear of each other.
const MEETINGS: usize = 256;

impl SerialChain {
    /// - `links`: before the first joint, and after each.
    /// - `end`: of the flange in the frame of the last joint.
    /// - `radius`: of links without a body, m.
    ///
    /// # Errors
    /// [`ChainError`]
    #[expect(clippy::too_many_lines)]
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

    /// Pairs of links that share no joint, and are clear of each other in some configuration: what
    /// never is lies side by side.
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

    /// A configuration of a sequence that fills the ranges evenly \[Halton 1960\].
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

    /// Its joints, from the base on.
    pub fn joints(&self) -> &[ChainJoint] {
        &self.joints
    }

    /// Names of its links, from the base on.
    pub(super) fn link_names(&self) -> impl Iterator<Item = &Arc<str>> {
        self.links.iter().map(|(name, _)| name)
    }

    /// Pairs of links that may meet, by their numbers; after the last link comes the probe.
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
    pub fn flange(&self, joints: &Joints) -> Isometry3<f64> {
        self.frames(joints).flange
    }

    /// Velocity of the flange by those of the joints, in B.
    pub fn jacobian(&self, joints: &Joints) -> Jacobian {
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

    /// Distance of the arm from a singularity: the smallest singular value of its Jacobian, lengths
    /// in units of the arm from its second joint on.
    pub fn dexterity(&self, joints: &Joints) -> f64 {
        let mut jacobian = self.jacobian(joints);
        jacobian.rows_mut(0, 3).scale_mut(1.0 / self.reach);
        // of six rows, whatever columns of zeros there are
        (jacobian * jacobian.transpose())
            .symmetric_eigenvalues()
            .min()
            .max(0.0)
            .sqrt()
    }

    /// The capsules of its links in B, from the base on, then the probe.
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

    /// The smallest gap between links that may meet, m.
    fn own_gap(&self, joints: &Joints) -> f64 {
        let bodies = self.bodies(joints, None);
        self.meeting
            .iter()
            .map(|(one, other)| bodies[*one].gap(&bodies[*other]))
            .fold(f64::INFINITY, f64::min)
    }

    /// Joint angles within their ranges that bring the flange to a pose in B, near others.
    ///
    /// From a pose nearby they are the nearest ones to first order; where a search from there does
    /// not lead to it, those of a straight way, and then the nearest of some searches from all over
    /// the ranges.
    ///
    /// # Errors
    /// [`Unreached`]
    pub(super) fn nearest(
        &self,
        pose_bf: &Isometry3<f64>,
        near: &Joints,
    ) -> Result<Joints, Unreached> {
        let from = self.flange(near);
        let first = self.joints[0].origin.translation.vector;
        if (pose_bf.translation.vector - first).norm() > self.reach_of_all() {
            return Err(Unreached::Pose);
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

    /// The joint angles of a pose in B, of those that searches from all over the ranges find, that
    /// leave the arm most room to move, with its links clear of each other if there are such.
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

    /// No flange is farther from the first joint, m.
    fn reach_of_all(&self) -> f64 {
        self.joints[1].origin.translation.vector.norm() + self.reach
    }

    /// The same angles, each within half a turn of another, as far as its range goes.
    fn unwound(&self, joints: &Joints, near: &Joints) -> Joints {
        joints.mapped(|joint, angle| {
            let turned = angle + TAU * ((near[joint] - angle) / TAU).round();
            let is_in = self.joints[joint]
                .range
                .is_none_or(|[low, high]| (low..=high).contains(&turned));
            if is_in { turned } else { angle }
        })
    }

    /// Searches joint angles for a pose from others.
    fn search(&self, pose_bf: &Isometry3<f64>, from: &Joints) -> Result<Joints, Unreached> {
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
                Some(Unreached::Range {
                    joint: joint.name.clone(),
                    range,
                })
            });
        Err(held.unwrap_or(Unreached::Pose))
    }

    /// How far the flange is from a pose: in units of the reach, and in rad, in B.
    fn error(&self, frames: &ChainFrames, pose_bf: &Isometry3<f64>) -> Vector6<f64> {
        let way = (pose_bf.translation.vector - frames.flange.translation.vector) / self.reach;
        let turn = (pose_bf.rotation * frames.flange.rotation.inverse()).scaled_axis();
        Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z)
    }

    /// The joints after one step, all within their ranges.
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
        // each round holds one joint more
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

/// The shortest turns x with J x = v, damped: Jᵀ (J Jᵀ + λ 1)⁻¹ v.
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
