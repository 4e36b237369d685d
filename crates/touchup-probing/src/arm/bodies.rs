//! Bodies of an arm: capsules along its links.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use super::capsule::Capsule;
use super::geometry::{ArmGeometry, six};
use super::joints::Joints;
use super::kinematics::UrGeometry;
use super::serial_chain::SerialChain;

/// A link of an arm, by its maker's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Link {
    /// on the floor
    #[error("base")]
    Base,
    /// from shoulder to elbow
    #[error("upper arm")]
    UpperArm,
    /// from elbow to wrist
    #[error("forearm")]
    Forearm,
    /// from the forearm to the second joint of the wrist
    #[error("first link of the wrist")]
    Wrist1,
    /// from the second to the third joint of the wrist
    #[error("second link of the wrist")]
    Wrist2,
    /// from the third joint of the wrist to the flange
    #[error("third link of the wrist")]
    Wrist3,
    /// from the flange to the tip
    #[error("probe")]
    Probe,
    /// a link of any other arm than a UR
    #[error("link {0}")]
    Named(Arc<str>),
}

/// Links of a UR, from the base outward.
const UR_LINKS: [Link; 7] = [
    Link::Base,
    Link::UpperArm,
    Link::Forearm,
    Link::Wrist1,
    Link::Wrist2,
    Link::Wrist3,
    Link::Probe,
];

/// Pairs of UR links that may collide, by number; links that share a joint, or lie side by side at
/// all joint angles, cannot.
const UR_MEETING: [(usize, usize); 11] = [
    (0, 2),
    (0, 3),
    (0, 4),
    (0, 5),
    (0, 6),
    (1, 3),
    (1, 4),
    (1, 5),
    (1, 6),
    (2, 5),
    (2, 6),
];

/// Links of an arm at given joint angles, in the base B.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmBodies<'a> {
    links: Vec<(Link, Capsule)>,
    /// pairs that may collide, by number
    meeting: &'a [(usize, usize)],
}

impl<'a> ArmBodies<'a> {
    /// - `pose_ft`: the tip in the flange. The probe is the line between them; the margin of a
    ///   check has to hold its thickness.
    pub fn new(geometry: &'a ArmGeometry, joints: &Joints, pose_ft: &Isometry3<f64>) -> Self {
        match geometry {
            ArmGeometry::Ur(ur) => Self {
                links: of_ur(ur, six(joints), pose_ft),
                meeting: &UR_MEETING,
            },
            ArmGeometry::Chain(chain) => Self {
                links: of_chain(chain, joints, pose_ft),
                meeting: chain.meeting_links(),
            },
        }
    }

    /// Links and capsules, from the base outward.
    pub(crate) fn links(&self) -> impl Iterator<Item = (&Link, &Capsule)> {
        self.links.iter().map(|(link, capsule)| (link, capsule))
    }

    /// Pair of links with the smallest gap, m, among those that may collide.
    pub fn nearest_pair(&self) -> (Link, Link, f64) {
        let gap = |&(one, other): &(usize, usize)| {
            (one, other, self.links[one].1.gap(&self.links[other].1))
        };
        let nearest = self
            .meeting
            .iter()
            .map(gap)
            .min_by(|a, b| a.2.total_cmp(&b.2));
        let (one, other, gap) = nearest.unwrap_or((0, self.links.len() - 1, f64::INFINITY));
        (self.links[one].0.clone(), self.links[other].0.clone(), gap)
    }
}

fn of_ur(ur: &UrGeometry, joints: &[f64; 6], pose_ft: &Isometry3<f64>) -> Vec<(Link, Capsule)> {
    let poses = ur.link_poses(joints);
    let joint = |number: usize| poses[number].translation.vector;
    // along the parallel axes of shoulder, elbow and first wrist
    let across = poses[0].rotation * Vector3::z();
    let [upper, fore] = [ur.upper_arm_beside, ur.forearm_beside].map(|by| across * by);
    let tip = (poses[5] * pose_ft).translation.vector;
    let [base, upper_arm, forearm, wrist] = ur.radii;
    let ends = [
        (Vector3::zeros(), joint(0), base),
        (joint(0) + upper, joint(1) + upper, upper_arm),
        (joint(1) + fore, joint(2) + fore, forearm),
        (joint(2) + fore, joint(3), wrist),
        (joint(3), joint(4), wrist),
        (joint(4), joint(5), wrist),
        (joint(5), tip, 0.0),
    ];
    let capsules = ends.map(|(from, to, radius)| Capsule {
        ends: [from.into(), to.into()],
        radius,
    });
    UR_LINKS.into_iter().zip(capsules).collect()
}

/// Links of a chain: the first carries the arm, the last is the probe.
fn of_chain(
    chain: &SerialChain,
    joints: &Joints,
    pose_ft: &Isometry3<f64>,
) -> Vec<(Link, Capsule)> {
    let moving = chain
        .link_names()
        .skip(1)
        .map(|name| Link::Named(name.clone()));
    let names = std::iter::once(Link::Base)
        .chain(moving)
        .chain([Link::Probe]);
    names.zip(chain.bodies(joints, Some(pose_ft))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The upper arm is upright. With the forearm at a right angle all links are clear; folded down
    /// it is in the base's column, as forearm and upper arm are nearly equally long.
    #[test]
    fn a_stretched_arm_is_free_and_one_folded_onto_itself_is_not() {
        let probe = Isometry3::translation(0.0, 0.0, 0.15);
        let ur = ArmGeometry::from(UrGeometry::UR5E);
        let pair = |joints: [f64; 6]| ArmBodies::new(&ur, &joints.into(), &probe).nearest_pair();
        let (_, _, gap) = pair([0.0, -1.6, 1.6, -1.6, -1.6, 0.0]);
        assert!(gap > 0.05, "{gap}");
        let (one, other, gap) = pair([0.0, -1.6, 3.0, -1.6, -1.6, 0.0]);
        assert!(
            gap < 0.0 && (&one, &other) == (&Link::Base, &Link::Forearm),
            "{one} {other} {gap}"
        );
        // the wrist bends the probe back along the forearm
        let (one, other, gap) = pair([0.0, -1.6, 1.6, 0.0, 3.1, 0.0]);
        assert!(gap < 0.0 && one == Link::Forearm, "{one} {other} {gap}");
    }
}
