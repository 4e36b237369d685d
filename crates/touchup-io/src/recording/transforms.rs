//! The pose of one frame in another, from a tree of transforms as `/tf` and `/tf_static` publish it.
//!
//! pose_base_moving = pose_base_a · pose_ab · … · pose_z_moving; links that stay count at any time, those that move are taken together
//! only when their stamps are equal, as robot_state_publisher sends them: nothing is interpolated here.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Isometry3;

use super::decode::Transform;
use super::{BadMessage, RecordingError, TransformFrames};
use touchup_core::stylus::StampedPose;

/// Frames of a tree: an arm has ten, a plant some hundred.
const MOST_FRAMES: usize = 10_000;
/// Transforms with which every publisher has been heard; until then the root of the tree may not be known.
const MESSAGES_OF_A_TREE: u64 = 200;
/// Frames that an error names.
const MOST_NAMED: usize = 40;

/// What is known of a tree before its first pose.
#[derive(Default)]
pub(super) struct TransformTree {
    links: BTreeMap<String, TreeLink>,
    messages: u64,
}

#[derive(Clone)]
struct TreeLink {
    parent: String,
    /// of a link that stays
    fixed: Option<Isometry3<f64>>,
}

impl TransformTree {
    /// Takes in the links of one message.
    pub fn add(&mut self, transforms: Vec<Transform>, are_static: bool) {
        self.messages += u64::from(!are_static);
        for Transform { parent, child, pose, .. } in transforms {
            if self.links.len() < MOST_FRAMES || self.links.contains_key(&child) {
                self.links.insert(child, TreeLink { parent, fixed: are_static.then_some(pose) });
            }
        }
    }

    /// Whether what follows can hardly add to the chain between the frames.
    pub fn is_enough(&self, frames: &TransformFrames) -> bool {
        self.links.contains_key(&frames.moving)
            && (frames.base.is_some() || self.messages >= MESSAGES_OF_A_TREE)
            && self.chain(frames).is_some()
    }

    /// The frames from the moving one up to below the base, and the base.
    fn chain(&self, frames: &TransformFrames) -> Option<(Vec<ChainLink>, String)> {
        let (mut links, mut at) = (Vec::new(), frames.moving.clone());
        while frames.base.as_ref() != Some(&at) && links.len() <= self.links.len() {
            match self.links.get(&at) {
                Some(TreeLink { parent, fixed }) => {
                    let pose = fixed.unwrap_or_default();
                    links.push(ChainLink {
                        child: at,
                        parent: parent.clone(),
                        pose,
                        stamp_ns: None,
                        is_fixed: fixed.is_some(),
                    });
                    at = parent.clone();
                }
                None if frames.base.is_none() => break,
                None => return None,
            }
        }
        (!links.is_empty() && links.len() <= self.links.len()).then_some((links, at))
    }

    /// The chain between the frames.
    ///
    /// # Errors
    /// [`RecordingError::Frames`] when the tree does not have it, or when it does not move.
    pub fn into_chain(self, frames: &TransformFrames, path: &Path) -> Result<TransformChain, RecordingError> {
        let bad = |what: String| RecordingError::Frames { path: path.to_owned(), what, found: self.found() };
        let TransformFrames { moving, base } = frames;
        if !self.links.contains_key(moving) {
            return Err(bad(format!("no frame {moving:?} in the transforms; choose one with --pose-frame")));
        }
        let Some((links, root)) = self.chain(frames) else {
            let base = base.as_deref().unwrap_or_default();
            return Err(bad(format!("{moving:?} does not hang on {base:?}; choose another frame with --base-frame")));
        };
        if links.iter().all(|link| link.is_fixed) {
            return Err(bad(format!(
                "{moving:?} does not move in {root:?}; choose others with --pose-frame and --base-frame"
            )));
        }
        Ok(TransformChain { base: root, links, given_ns: None })
    }

    /// Each frame with the one that it hangs on.
    fn found(&self) -> String {
        let link = |(child, link): (&String, &TreeLink)| format!("{child} (in {})", link.parent);
        let mut named: Vec<_> = self.links.iter().take(MOST_NAMED).map(link).collect();
        if self.links.len() > MOST_NAMED {
            named.push(format!("and {} more", self.links.len() - MOST_NAMED));
        }
        if named.is_empty() { "no frames".to_owned() } else { named.join(", ") }
    }
}

struct ChainLink {
    child: String,
    parent: String,
    pose: Isometry3<f64>,
    stamp_ns: Option<i64>,
    is_fixed: bool,
}

/// The links between two frames, with what was last heard of each.
pub(super) struct TransformChain {
    /// in which the poses are
    pub base: String,
    /// from the moving frame up
    links: Vec<ChainLink>,
    /// stamp of the last pose
    given_ns: Option<i64>,
}

impl TransformChain {
    /// Takes in the links of one message; a pose when all that move have one stamp.
    ///
    /// # Errors
    /// [`BadMessage::FrameChanged`] for a frame that hangs on another one now; [`BadMessage::TransformsApart`] for a link that moved
    /// on before the others had reached its stamp, of which there is no pose.
    pub fn push(&mut self, transforms: Vec<Transform>, are_static: bool) -> Result<Option<StampedPose>, BadMessage> {
        let (mut has_moved, mut is_apart) = (false, false);
        for Transform { stamp_ns, parent, child, pose } in transforms {
            let Some(link) = self.links.iter_mut().find(|link| link.child == child) else { continue };
            if link.parent != parent {
                return Err(BadMessage::FrameChanged);
            }
            link.pose = pose;
            if !are_static && !link.is_fixed {
                is_apart |= link.stamp_ns.is_some_and(|before| before != stamp_ns && self.given_ns != Some(before));
                link.stamp_ns = Some(stamp_ns);
                has_moved = true;
            }
        }
        let mut stamps = self.links.iter().filter(|link| !link.is_fixed).map(|link| link.stamp_ns);
        let first = stamps.next().flatten();
        let together = first.filter(|_| has_moved && stamps.all(|stamp| stamp == first));
        let Some(stamp_ns) = together.filter(|stamp_ns| self.given_ns != Some(*stamp_ns)) else {
            return if is_apart { Err(BadMessage::TransformsApart) } else { Ok(None) };
        };
        self.given_ns = Some(stamp_ns);
        let pose_ot = self.links.iter().rev().fold(Isometry3::identity(), |pose, link| pose * link.pose);
        Ok(Some(StampedPose { stamp_ns, pose_ot }))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn link(stamp_ns: i64, parent: &str, child: &str, x: f64, turn: f64) -> Transform {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let pose = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation);
        Transform { stamp_ns, parent: parent.into(), child: child.into(), pose }
    }

    fn frames(moving: &str, base: Option<&str>) -> TransformFrames {
        TransformFrames { moving: moving.into(), base: base.map(Into::into) }
    }

    /// world → base stays, base → arm and arm → hand move, hand → tool0 stays.
    fn tree() -> TransformTree {
        let mut tree = TransformTree::default();
        tree.add(vec![link(0, "world", "base", 10.0, 0.0), link(0, "hand", "tool0", 0.1, 0.0)], true);
        tree.add(vec![link(1, "base", "arm", 1.0, 0.0), link(1, "arm", "hand", 1.0, 0.0)], false);
        tree
    }

    #[test]
    fn two_turned_links_and_a_fixed_one_give_the_place_worked_out_by_hand() {
        let mut chain = tree().into_chain(&frames("tool0", Some("base")), Path::new("bag")).unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        // along x by 1, a quarter turn: along y by 1, another quarter turn: along -x by 0.1
        let pose = chain.push(vec![link(5, "base", "arm", 1.0, quarter), link(5, "arm", "hand", 1.0, quarter)], false);
        let pose = pose.unwrap().unwrap();
        assert_eq!((pose.stamp_ns, chain.base.as_str()), (5, "base"));
        assert!((pose.pose_ot.translation.vector - Vector3::new(0.9, 1.0, 0.0)).norm() < 1e-12);
        assert!((pose.pose_ot.rotation.angle() - 2.0 * quarter).abs() < 1e-12);
    }

    #[test]
    fn without_a_base_the_root_of_the_tree_is_it() {
        let mut chain = tree().into_chain(&frames("tool0", None), Path::new("bag")).unwrap();
        let pose = chain.push(vec![link(5, "base", "arm", 1.0, 0.0), link(5, "arm", "hand", 1.0, 0.0)], false);
        assert_eq!(chain.base, "world");
        assert!((pose.unwrap().unwrap().pose_ot.translation.vector.x - 12.1).abs() < 1e-12);
    }

    #[test]
    fn links_are_taken_together_only_at_one_stamp() {
        let mut chain = tree().into_chain(&frames("tool0", Some("base")), Path::new("bag")).unwrap();
        assert_eq!(chain.push(vec![link(5, "base", "arm", 1.0, 0.0)], false), Ok(None));
        assert!(chain.push(vec![link(5, "arm", "hand", 1.0, 0.0)], false).unwrap().is_some());
        assert_eq!(chain.push(vec![link(6, "base", "arm", 1.0, 0.0)], false), Ok(None));
        assert_eq!(chain.push(vec![link(7, "base", "arm", 1.0, 0.0)], false), Err(BadMessage::TransformsApart));
        // what concerns other frames gives nothing, and the same again nothing new
        assert_eq!(chain.push(vec![link(8, "base", "camera", 1.0, 0.0)], false), Ok(None));
        assert!(chain.push(vec![link(7, "arm", "hand", 1.0, 0.0)], false).unwrap().is_some());
        assert_eq!(chain.push(vec![link(7, "arm", "hand", 1.0, 0.0)], false), Ok(None));
        assert_eq!(chain.push(vec![link(9, "camera", "hand", 1.0, 0.0)], false), Err(BadMessage::FrameChanged));
    }

    #[test]
    fn a_frame_that_is_not_there_is_answered_by_those_that_are() {
        let why = |moving, base| tree().into_chain(&frames(moving, base), Path::new("bag")).err().unwrap().to_string();
        let text = why("tool1", None);
        assert!(text.contains("--pose-frame") && text.contains("tool0 (in hand)"), "{text}");
        assert!(why("tool0", Some("floor")).contains("--base-frame"));
        assert!(why("base", None).contains("does not move"));
        // a circle ends
        let mut circle = tree();
        circle.add(vec![link(1, "tool0", "world", 0.0, 0.0)], false);
        assert!(circle.chain(&frames("tool0", None)).is_none());
    }
}
