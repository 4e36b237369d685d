//! Frame transforms from `/tf` and `/tf_static`, at any moment of the last seconds.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Isometry3;

use super::sync::interpolated;

/// History of moving frames, ns.
pub(super) const KEPT_NS: i64 = 10_000_000_000;
/// Maximum number of poses of a moving frame: 10 s at 1 kHz.
const MOST_POSES: usize = 10_000;
/// Maximum number of frames: a cell has dozens.
const MOST_FRAMES: usize = 1000;
/// Maximum length of a frame name.
const LONGEST_NAME: usize = 256;

/// Pose of a frame in its parent at one instant, as in `geometry_msgs/TransformStamped`.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTransform {
    /// ns; meaningless for a static frame
    pub stamp_ns: i64,
    /// name of the parent
    pub parent: String,
    /// name of the frame
    pub child: String,
    /// pose of the frame in its parent
    pub pose: Isometry3<f64>,
}

/// Reason for a missing transform between two frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// No transform names this frame.
    #[error("frame \"{0}\" is not known: is its transform published?")]
    Unknown(String),
    /// Known frames without a connection.
    #[error(
        "frames \"{0}\" and \"{1}\" are not connected: a transform between their trees is missing"
    )]
    NotConnected(String, String),
    /// Cycle in the parents of a frame.
    #[error(
        "frame \"{0}\" is its own ancestor: two nodes publish transforms that contradict each other"
    )]
    Cycle(String),
    /// Time before the history.
    #[error("frame \"{0}\" is known from {1} ns on, {2} ns was asked for")]
    TooEarly(String, i64, i64),
    /// Time after the newest transform; a later one may still cover it.
    #[error("frame \"{0}\" is known up to {1} ns, {2} ns was asked for")]
    NotYet(String, i64, i64),
    /// Time in a gap longer than the maximum.
    #[error("frame \"{0}\" has no transform for {1} ns around {2} ns")]
    Gap(String, i64, i64),
}

/// Pose of a frame in its parent.
#[derive(Clone, Debug)]
enum FrameMotion {
    Static(Isometry3<f64>),
    /// in order of time
    Moving(VecDeque<(i64, Isometry3<f64>)>),
}

#[derive(Clone, Debug)]
struct FrameLink {
    parent: String,
    motion: FrameMotion,
}

/// All frames, with their recent poses.
#[derive(Clone, Debug, Default)]
pub struct FrameBuffer {
    links: BTreeMap<String, FrameLink>,
}

/// Frame name as in tf: without the leading slash of ROS 1.
pub fn plain_name(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl FrameBuffer {
    /// Inserts a transform; `false` for an invalid one, or for too many frames.
    pub fn insert(&mut self, transform: &FrameTransform, is_static: bool) -> bool {
        let FrameTransform { stamp_ns, pose, .. } = *transform;
        let (parent, child) = (plain_name(&transform.parent), plain_name(&transform.child));
        let is_name = |name: &str| !name.is_empty() && name.len() <= LONGEST_NAME;
        let is_room = self.links.len() < MOST_FRAMES || self.links.contains_key(child);
        let is_finite = pose.translation.vector.iter().all(|x| x.is_finite());
        if !is_finite || !is_name(parent) || !is_name(child) || parent == child || !is_room {
            return false;
        }
        let fresh = || FrameLink {
            parent: parent.to_owned(),
            motion: FrameMotion::Moving(VecDeque::new()),
        };
        let link = self.links.entry(child.to_owned()).or_insert_with(fresh);
        if link.parent != parent {
            *link = fresh();
        }
        match &mut link.motion {
            motion if is_static => *motion = FrameMotion::Static(pose),
            FrameMotion::Static(_) => {
                link.motion = FrameMotion::Moving(VecDeque::from([(stamp_ns, pose)]))
            }
            FrameMotion::Moving(poses) => keep(poses, stamp_ns, pose),
        }
        true
    }

    /// Forgets all moving frames, as after a clock jump.
    pub fn forget_moving(&mut self) {
        self.links
            .retain(|_, link| matches!(link.motion, FrameMotion::Static(_)));
    }

    /// Pose of `of` in `in_frame` at a moment: maps points of `of` to `in_frame`.
    ///
    /// # Errors
    /// [`FrameError`]
    pub fn pose(
        &self,
        in_frame: &str,
        of: &str,
        stamp_ns: i64,
    ) -> Result<Isometry3<f64>, FrameError> {
        Ok(self.bridged_pose(in_frame, of, stamp_ns, i64::MAX)?.0)
    }

    /// As [`Self::pose`], refusing gaps longer than `longest_gap_ns` in any link; and whether any
    /// link was interpolated.
    pub(super) fn bridged_pose(
        &self,
        in_frame: &str,
        of: &str,
        stamp_ns: i64,
        longest_gap_ns: i64,
    ) -> Result<(Isometry3<f64>, bool), FrameError> {
        let [down, up] = self.links_between(in_frame, of)?;
        let (down, is_between) = self.climbed(&down, stamp_ns, longest_gap_ns)?;
        let (up, is_also) = self.climbed(&up, stamp_ns, longest_gap_ns)?;
        Ok((down.inv_mul(&up), is_between || is_also))
    }

    /// Frames from `in_frame`, and from `of`, to below their first common ancestor.
    pub(super) fn links_between<'a>(
        &'a self,
        in_frame: &'a str,
        of: &'a str,
    ) -> Result<[Vec<&'a str>; 2], FrameError> {
        let (mut target, mut source) = (self.ancestors(in_frame)?, self.ancestors(of)?);
        let Some(up) = source.iter().position(|name| target.contains(name)) else {
            // if both are unknown, name the one in a header
            let unknown = [of, in_frame].into_iter().find(|name| !self.is_known(name));
            return Err(match unknown {
                Some(name) => FrameError::Unknown(name.to_owned()),
                None => FrameError::NotConnected(in_frame.to_owned(), of.to_owned()),
            });
        };
        target.truncate(
            target
                .iter()
                .position(|name| *name == source[up])
                .unwrap_or(0),
        );
        source.truncate(up);
        Ok([target, source])
    }

    /// Whether a frame moves in its parent.
    pub(super) fn moves(&self, name: &str) -> bool {
        self.links
            .get(name)
            .is_some_and(|link| matches!(link.motion, FrameMotion::Moving(_)))
    }

    /// Whether any transform names the frame, as child or parent.
    fn is_known(&self, name: &str) -> bool {
        self.links.contains_key(name) || self.links.values().any(|link| link.parent == name)
    }

    /// The frame and its ancestors.
    pub(super) fn ancestors<'a>(&'a self, name: &'a str) -> Result<Vec<&'a str>, FrameError> {
        let mut names = vec![name];
        let mut at = name;
        while let Some(link) = self.links.get(at) {
            at = &link.parent;
            if names.len() > self.links.len() {
                return Err(FrameError::Cycle(name.to_owned()));
            }
            names.push(at);
        }
        Ok(names)
    }

    /// Pose of the first frame in the parent of the last; and whether any link was interpolated.
    fn climbed(
        &self,
        names: &[&str],
        stamp_ns: i64,
        longest_gap_ns: i64,
    ) -> Result<(Isometry3<f64>, bool), FrameError> {
        names.iter().try_fold(
            (Isometry3::identity(), false),
            |(below, is_between), name| {
                let Some(link) = self.links.get(*name) else {
                    return Ok((below, is_between));
                };
                let (pose, is_also) = link.motion.at(name, stamp_ns, longest_gap_ns)?;
                Ok((pose * below, is_between || is_also))
            },
        )
    }
}

fn keep(poses: &mut VecDeque<(i64, Isometry3<f64>)>, stamp: i64, pose: Isometry3<f64>) {
    let at = poses.partition_point(|(before, _)| *before < stamp);
    match poses.get_mut(at) {
        Some(there) if there.0 == stamp => there.1 = pose,
        _ => poses.insert(at, (stamp, pose)),
    }
    let newest = poses.back().map_or(stamp, |last| last.0);
    while poses.len() > MOST_POSES
        || poses
            .front()
            .is_some_and(|first| newest.saturating_sub(first.0) > KEPT_NS)
    {
        poses.pop_front();
    }
}

impl FrameMotion {
    /// Interpolates between two poses, linearly and at constant angular velocity along the shorter
    /// arc; and whether it did.
    fn at(
        &self,
        name: &str,
        stamp_ns: i64,
        longest_gap_ns: i64,
    ) -> Result<(Isometry3<f64>, bool), FrameError> {
        let poses = match self {
            Self::Static(pose) => return Ok((*pose, false)),
            Self::Moving(poses) => poses,
        };
        let next = poses.partition_point(|(stamp, _)| *stamp < stamp_ns);
        let (first, last) = (
            poses.front().map_or(i64::MAX, |p| p.0),
            poses.back().map_or(i64::MIN, |p| p.0),
        );
        match (
            poses.get(next),
            next.checked_sub(1).and_then(|before| poses.get(before)),
        ) {
            (Some((stamp, pose)), _) if *stamp == stamp_ns => Ok((*pose, false)),
            (Some((end, after)), Some((start, before))) => {
                let gap_ns = end.saturating_sub(*start);
                if gap_ns > longest_gap_ns {
                    return Err(FrameError::Gap(name.to_owned(), gap_ns, stamp_ns));
                }
                let t = (stamp_ns - start) as f64 / gap_ns as f64;
                Ok((interpolated(before, after, t), true))
            }
            (Some(_), None) => Err(FrameError::TooEarly(name.to_owned(), first, stamp_ns)),
            (None, _) => Err(FrameError::NotYet(name.to_owned(), last, stamp_ns)),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn stamped(parent: &str, child: &str, sec: i64, x: f64, quarter_turns: f64) -> FrameTransform {
        let turn = UnitQuaternion::from_axis_angle(
            &Vector3::z_axis(),
            quarter_turns * std::f64::consts::FRAC_PI_2,
        );
        let pose = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), turn);
        FrameTransform {
            stamp_ns: sec * 1_000_000_000,
            parent: parent.to_owned(),
            child: child.to_owned(),
            pose,
        }
    }

    /// Worked by hand: the arm moves from 0 to 2 m in two seconds and turns by 90° about z; the
    /// tool is 1 m along its x.
    #[test]
    fn a_moving_frame_is_between_its_poses() {
        let mut frames = FrameBuffer::default();
        assert!(frames.insert(&stamped("cell", "arm", 10, 0.0, 0.0), false));
        assert!(frames.insert(&stamped("/cell", "/arm", 12, 2.0, 1.0), false));
        assert!(frames.insert(&stamped("arm", "tool", 0, 1.0, 0.0), true));
        assert!(frames.insert(&stamped("cell", "object", 0, 5.0, 0.0), true));
        let pose = frames.pose("object", "tool", 11_000_000_000).unwrap();
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        assert!(
            (pose.translation.vector - Vector3::new(1.0 + diagonal - 5.0, diagonal, 0.0)).norm()
                < 1e-12
        );
        let back = frames.pose("tool", "object", 11_000_000_000).unwrap();
        assert!((back * pose).translation.vector.norm() < 1e-12);
        assert!(
            matches!(frames.pose("object", "tool", 13_000_000_000), Err(FrameError::NotYet(name, ..)) if name == "arm")
        );
        assert!(
            matches!(frames.pose("object", "tool", 9_000_000_000), Err(FrameError::TooEarly(name, ..)) if name == "arm")
        );
        assert_eq!(
            frames.pose("cell", "cell", 0).unwrap(),
            Isometry3::identity()
        );
    }

    #[test]
    fn what_does_not_connect_is_named() {
        let mut frames = FrameBuffer::default();
        frames.insert(&stamped("a", "b", 0, 0.0, 0.0), true);
        frames.insert(&stamped("c", "d", 0, 0.0, 0.0), true);
        assert_eq!(
            frames.pose("a", "x", 0),
            Err(FrameError::Unknown("x".into()))
        );
        assert_eq!(
            frames.pose("b", "d", 0),
            Err(FrameError::NotConnected("b".into(), "d".into()))
        );
        frames.insert(&stamped("b", "a", 0, 0.0, 0.0), true);
        assert!(matches!(
            frames.pose("c", "a", 0),
            Err(FrameError::Cycle(_))
        ));
        for bad in [
            stamped("a", "a", 0, 0.0, 0.0),
            stamped("", "a", 0, 0.0, 0.0),
        ] {
            assert!(!frames.insert(&bad, false));
        }
        assert!(!frames.insert(&stamped("a", "b", 0, f64::NAN, 0.0), false));
    }

    #[test]
    fn memory_is_bounded() {
        let mut frames = FrameBuffer::default();
        for sec in 0..100 {
            frames.insert(&stamped("a", "b", sec, sec as f64, 0.0), false);
        }
        assert!(matches!(
            frames.pose("a", "b", 88_000_000_000),
            Err(FrameError::TooEarly(_, 89_000_000_000, _))
        ));
        for number in 0..5000 {
            frames.insert(&stamped("a", &format!("f{number}"), 0, 0.0, 0.0), true);
        }
        assert_eq!(frames.links.len(), MOST_FRAMES);
    }
}
