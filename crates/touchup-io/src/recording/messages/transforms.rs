//! The pose of one frame in another, from a tree of transforms of `/tf` and `/tf_static`.
//!
//! pose_base_moving = pose_base_a · pose_ab · … · pose_z_moving; static links hold at any time,
//! [`MovingFrame`] brings moving ones to one instant.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Isometry3;

use crate::recording::TransformFrames;
use crate::recording::error::BadMessage;
use crate::recording::error::RecordingError;
use touchup_method::stylus::{FrameBuffer, FrameTransform, MovingFrame, StampedPose};

/// Frames of a tree: an arm has ten, a plant some hundred.
const MOST_FRAMES: usize = 10_000;
/// Number of transforms that covers every publisher; until then the root of the tree may be
/// unknown.
const MESSAGES_OF_A_TREE: u64 = 200;
/// Maximum number of frames in an error.
const MOST_NAMED: usize = 40;

/// State of a tree before its first pose.
#[derive(Default)]
pub(in crate::recording) struct TransformTree {
    links: BTreeMap<String, TreeLink>,
    messages: u64,
}

#[derive(Clone)]
struct TreeLink {
    parent: String,
    /// of a static link
    fixed: Option<Isometry3<f64>>,
}

impl TransformTree {
    /// Takes in the links of one message.
    pub fn add(&mut self, transforms: Vec<FrameTransform>, are_static: bool) {
        self.messages += u64::from(!are_static);
        for FrameTransform {
            parent,
            child,
            pose,
            ..
        } in transforms
        {
            if self.links.len() < MOST_FRAMES || self.links.contains_key(&child) {
                self.links.insert(
                    child,
                    TreeLink {
                        parent,
                        fixed: are_static.then_some(pose),
                    },
                );
            }
        }
    }

    /// Whether later messages can hardly add to the chain between the frames.
    pub fn is_enough(&self, frames: &TransformFrames) -> bool {
        self.links.contains_key(&frames.moving)
            && (frames.base.is_some() || self.messages >= MESSAGES_OF_A_TREE)
            && self.chain(frames).is_some()
    }

    /// The frames from the moving one up to below the base, and the base.
    fn chain(&self, frames: &TransformFrames) -> Option<(Vec<TransformLink>, String)> {
        let (mut links, mut at) = (Vec::new(), frames.moving.clone());
        while frames.base.as_ref() != Some(&at) && links.len() <= self.links.len() {
            match self.links.get(&at) {
                Some(TreeLink { parent, fixed }) => {
                    links.push(TransformLink {
                        child: at,
                        parent: parent.clone(),
                        fixed: *fixed,
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
    /// [`RecordingError::Frames`] if the tree lacks it, or if it does not move.
    pub fn into_chain(
        self,
        frames: &TransformFrames,
        path: &Path,
    ) -> Result<TransformChain, RecordingError> {
        let bad = |what: String| RecordingError::Frames {
            path: path.to_owned(),
            what,
            found: self.found(),
        };
        let TransformFrames { moving, base } = frames;
        if !self.links.contains_key(moving) {
            return Err(bad(format!(
                "no frame {moving:?} in the transforms; choose one with --pose-frame"
            )));
        }
        let Some((links, root)) = self.chain(frames) else {
            let base = base.as_deref().unwrap_or_default();
            return Err(bad(format!(
                "{moving:?} does not hang on {base:?}; choose another frame with --base-frame"
            )));
        };
        if links.iter().all(|link| link.fixed.is_some()) {
            return Err(bad(format!(
                "{moving:?} does not move in {root:?}; choose others with --pose-frame and --base-frame"
            )));
        }
        let mut chain = TransformChain {
            poses: MovingFrame::new(moving, &root),
            links,
            frames: FrameBuffer::default(),
        };
        for TransformLink {
            child,
            parent,
            fixed,
        } in &chain.links
        {
            if let Some(pose) = *fixed {
                let link = FrameTransform {
                    stamp_ns: 0,
                    parent: parent.clone(),
                    child: child.clone(),
                    pose,
                };
                chain.poses.push(&mut chain.frames, &[link], true);
            }
        }
        Ok(chain)
    }

    /// Each frame with its parent.
    fn found(&self) -> String {
        let link = |(child, link): (&String, &TreeLink)| format!("{child} (in {})", link.parent);
        let mut named: Vec<_> = self.links.iter().take(MOST_NAMED).map(link).collect();
        if self.links.len() > MOST_NAMED {
            named.push(format!("and {} more", self.links.len() - MOST_NAMED));
        }
        if named.is_empty() {
            "no frames".to_owned()
        } else {
            named.join(", ")
        }
    }
}

/// A link between two frames of a chain.
struct TransformLink {
    child: String,
    parent: String,
    /// of a static link
    fixed: Option<Isometry3<f64>>,
}

/// The links between two frames, and their latest poses.
pub(in crate::recording) struct TransformChain {
    pub poses: MovingFrame,
    /// from the moving frame up
    links: Vec<TransformLink>,
    frames: FrameBuffer,
}

impl TransformChain {
    /// Takes in the links of one message.
    ///
    /// # Errors
    /// [`BadMessage::FrameChanged`] for a frame with a new parent.
    pub fn push(
        &mut self,
        transforms: Vec<FrameTransform>,
        are_static: bool,
    ) -> Result<(), BadMessage> {
        for transform in transforms {
            let Some(link) = self.links.iter().find(|link| link.child == transform.child) else {
                continue;
            };
            if link.parent != transform.parent {
                return Err(BadMessage::FrameChanged);
            }
            // some publishers repeat static links on the topic of moving ones
            let is_static = are_static || link.fixed.is_some();
            if self.poses.push(&mut self.frames, &[transform], is_static) > 0 {
                return Err(BadMessage::Malformed);
            }
        }
        Ok(())
    }

    /// The next pose; `None` as long as a link may still come to the next stamp.
    pub fn next_pose(&mut self) -> Option<StampedPose> {
        self.poses.next_pose(&self.frames)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn link(stamp_ns: i64, parent: &str, child: &str, x: f64, turn: f64) -> FrameTransform {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let pose = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation);
        FrameTransform {
            stamp_ns,
            parent: parent.into(),
            child: child.into(),
            pose,
        }
    }

    /// Pose from a message.
    fn pushed(chain: &mut TransformChain, links: Vec<FrameTransform>) -> Option<StampedPose> {
        chain.push(links, false).unwrap();
        chain.next_pose()
    }

    fn frames(moving: &str, base: Option<&str>) -> TransformFrames {
        TransformFrames {
            moving: moving.into(),
            base: base.map(Into::into),
        }
    }

    /// world → base is static, base → arm and arm → hand move, hand → tool0 is static.
    fn tree() -> TransformTree {
        let mut tree = TransformTree::default();
        tree.add(
            vec![
                link(0, "world", "base", 10.0, 0.0),
                link(0, "hand", "tool0", 0.1, 0.0),
            ],
            true,
        );
        tree.add(
            vec![
                link(1, "base", "arm", 1.0, 0.0),
                link(1, "arm", "hand", 1.0, 0.0),
            ],
            false,
        );
        tree
    }

    #[test]
    fn two_turned_links_and_a_fixed_one_give_the_place_worked_out_by_hand() {
        let mut chain = tree()
            .into_chain(&frames("tool0", Some("base")), Path::new("bag"))
            .unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        // along x by 1, a quarter turn: along y by 1, another quarter turn: along -x by 0.1
        let links = vec![
            link(5, "base", "arm", 1.0, quarter),
            link(5, "arm", "hand", 1.0, quarter),
        ];
        let pose = pushed(&mut chain, links).unwrap();
        assert_eq!((pose.stamp_ns, chain.poses.base()), (5, "base"));
        assert!((pose.pose_ot.translation.vector - Vector3::new(0.9, 1.0, 0.0)).norm() < 1e-12);
        assert!((pose.pose_ot.rotation.angle() - 2.0 * quarter).abs() < 1e-12);
    }

    #[test]
    fn without_a_base_the_root_of_the_tree_is_it() {
        let mut chain = tree()
            .into_chain(&frames("tool0", None), Path::new("bag"))
            .unwrap();
        let pose = pushed(
            &mut chain,
            vec![
                link(5, "base", "arm", 1.0, 0.0),
                link(5, "arm", "hand", 1.0, 0.0),
            ],
        );
        assert_eq!(chain.poses.base(), "world");
        assert!((pose.unwrap().pose_ot.translation.vector.x - 12.1).abs() < 1e-12);
    }

    #[test]
    fn links_that_come_apart_wait_for_one_another_and_keep_their_parents() {
        let mut chain = tree()
            .into_chain(&frames("tool0", Some("base")), Path::new("bag"))
            .unwrap();
        assert_eq!(
            pushed(&mut chain, vec![link(5, "base", "arm", 1.0, 0.0)]),
            None
        );
        assert!(pushed(&mut chain, vec![link(5, "arm", "hand", 1.0, 0.0)]).is_some());
        // links of other frames give nothing, and static ones may repeat among moving ones
        assert_eq!(
            pushed(&mut chain, vec![link(8, "base", "camera", 1.0, 0.0)]),
            None
        );
        assert_eq!(
            pushed(&mut chain, vec![link(9, "hand", "tool0", 0.1, 0.0)]),
            None
        );
        assert_eq!(
            chain.push(vec![link(9, "camera", "hand", 1.0, 0.0)], false),
            Err(BadMessage::FrameChanged)
        );
        assert!(
            pushed(
                &mut chain,
                vec![
                    link(9, "base", "arm", 1.0, 0.0),
                    link(9, "arm", "hand", 1.0, 0.0)
                ]
            )
            .is_some()
        );
        assert_eq!((chain.poses.take_apart(), chain.poses.interpolated), (0, 0));
    }

    #[test]
    fn a_frame_that_is_not_there_is_answered_by_those_that_are() {
        let why = |moving, base| {
            tree()
                .into_chain(&frames(moving, base), Path::new("bag"))
                .err()
                .unwrap()
                .to_string()
        };
        let text = why("tool1", None);
        assert!(
            text.contains("--pose-frame") && text.contains("tool0 (in hand)"),
            "{text}"
        );
        assert!(why("tool0", Some("floor")).contains("--base-frame"));
        assert!(why("base", None).contains("does not move"));
        // a circle ends
        let mut circle = tree();
        circle.add(vec![link(1, "tool0", "world", 0.0, 0.0)], false);
        assert!(circle.chain(&frames("tool0", None)).is_none());
    }
}
