//! Pose of one frame in another, from the transforms of the links between them, each at the rate of
//! its publisher.

use std::collections::BTreeSet;

use super::StampedPose;
use super::frame_buffer::{FrameBuffer, FrameError, FrameTransform, KEPT_NS, plain_name};

/// Longest interpolated gap between transforms of a link, ns: a somewhat irregular publisher at 10
/// Hz. A link that accelerates by 1 m/s² is within 2 mm of the straight line in between, at 100 Hz
/// within 15 µm.
const LONGEST_GAP_NS: i64 = 120_000_000;
/// Maximum number of stamps waiting for transforms of slower links: 10 s at 1 kHz.
const MOST_PENDING: usize = 10_000;

/// Gives a pose at each stamp of a moving link between the two frames; the other links are
/// interpolated at that stamp, linearly in position and at constant angular velocity in
/// orientation. Never extrapolates beyond the first or last transform of a link, nor bridges more
/// than 0.12 s.
///
/// ```
/// use nalgebra::Isometry3;
/// use touchup_method::stylus::{FrameBuffer, FrameTransform, MovingFrame};
/// let mut frames = FrameBuffer::default();
/// let mut tool = MovingFrame::new("tool0", "base");
/// for (stamp_ns, x) in [(0, 1.0), (10_000_000, 2.0)] {
///     let pose = Isometry3::translation(x, 0.0, 0.0);
///     let transforms = [FrameTransform { stamp_ns, parent: "base".into(), child: "tool0".into(), pose }];
///     tool.push(&mut frames, &transforms, false);
///     assert_eq!(tool.next_pose(&frames).unwrap().pose_ot, pose);
/// }
/// ```
#[derive(Clone, Debug)]
pub struct MovingFrame {
    moving: String,
    base: String,
    /// stamps still without a pose, ns
    pending: BTreeSet<i64>,
    /// stamp of the last pose, ns
    given_ns: Option<i64>,
    /// poses with an interpolated link
    pub interpolated: u64,
    /// stamps without a pose, before the first or after the last transform of a link
    pub outside: u64,
    apart: u64,
}

impl MovingFrame {
    /// - `moving`: frame of the pose; `base`: reference frame.
    pub fn new(moving: &str, base: &str) -> Self {
        let [moving, base] = [moving, base].map(|name| plain_name(name).to_owned());
        Self {
            moving,
            base,
            pending: BTreeSet::new(),
            given_ns: None,
            interpolated: 0,
            outside: 0,
            apart: 0,
        }
    }

    /// Reference frame of the poses.
    pub fn base(&self) -> &str {
        &self.base
    }

    /// Inserts the transforms of one message into the buffer, and notes the stamps of moving links
    /// between the two frames; returns the number of refused transforms.
    pub fn push(
        &mut self,
        frames: &mut FrameBuffer,
        transforms: &[FrameTransform],
        are_static: bool,
    ) -> u64 {
        let has_jumped = !are_static && self.has_jumped(frames, transforms);
        if has_jumped {
            // clock set back: earlier transforms no longer apply
            frames.forget_moving();
            self.apart += self.pending.len() as u64;
            self.pending.clear();
            self.given_ns = None;
        }
        let refused = transforms
            .iter()
            .filter(|transform| !frames.insert(transform, are_static))
            .count();
        if !are_static {
            // before the two frames are connected: all known links above `moving`
            let links = frames.links_between(&self.base, &self.moving);
            let known = links
                .or_else(|_| Ok::<_, FrameError>([Vec::new(), frames.ancestors(&self.moving)?]));
            let [down, up] = known.unwrap_or_default();
            for FrameTransform {
                stamp_ns, child, ..
            } in transforms
            {
                let child = plain_name(child);
                if !(down.contains(&child) || up.contains(&child)) || !frames.moves(child) {
                    continue;
                }
                match self.given_ns {
                    Some(given_ns) if *stamp_ns < given_ns => self.apart += 1,
                    Some(given_ns) if *stamp_ns == given_ns => {}
                    _ => drop(self.pending.insert(*stamp_ns)),
                }
            }
        }
        refused as u64
    }

    /// Whether a link between the two frames jumps back beyond the history.
    fn has_jumped(&self, frames: &FrameBuffer, transforms: &[FrameTransform]) -> bool {
        let Some(given_ns) = self.given_ns else {
            return false;
        };
        let Ok([down, up]) = frames.links_between(&self.base, &self.moving) else {
            return false;
        };
        transforms.iter().any(
            |FrameTransform {
                 stamp_ns, child, ..
             }| {
                let child = plain_name(child);
                given_ns.saturating_sub(*stamp_ns) > KEPT_NS
                    && (down.contains(&child) || up.contains(&child))
            },
        )
    }

    /// Next pose, in order of stamps; `None` while a link may still reach the stamp.
    pub fn next_pose(&mut self, frames: &FrameBuffer) -> Option<StampedPose> {
        while let Some(stamp_ns) = self.pending.first().copied() {
            match frames.bridged_pose(&self.base, &self.moving, stamp_ns, LONGEST_GAP_NS) {
                Ok((pose_ot, is_interpolated)) => {
                    self.pending.pop_first();
                    self.given_ns = Some(stamp_ns);
                    self.interpolated += u64::from(is_interpolated);
                    return Some(StampedPose { stamp_ns, pose_ot });
                }
                Err(
                    FrameError::NotYet(..) | FrameError::Unknown(_) | FrameError::NotConnected(..),
                ) if self.pending.len() <= MOST_PENDING => {
                    return None;
                }
                Err(error) => {
                    self.pending.pop_first();
                    let is_before =
                        self.given_ns.is_none() && !matches!(error, FrameError::Gap(..));
                    *(if is_before {
                        &mut self.outside
                    } else {
                        &mut self.apart
                    }) += 1;
                }
            }
        }
        None
    }

    /// Reason for a missing pose, by the transforms received; `None` if a pose is possible.
    pub fn missing(&self, frames: &FrameBuffer) -> Option<String> {
        match frames.links_between(&self.base, &self.moving) {
            Err(error) => Some(error.to_string()),
            Ok(links) if links.iter().flatten().any(|link| frames.moves(link)) => None,
            Ok(_) => Some(format!(
                "frame \"{}\" does not move in \"{}\"",
                self.moving, self.base
            )),
        }
    }

    /// Number of stamps since the last call that have no pose for lack of transforms around them.
    pub fn take_apart(&mut self) -> u64 {
        std::mem::take(&mut self.apart)
    }

    /// Ends the transforms: pending stamps are lost.
    pub fn finish(&mut self) {
        self.outside += self.pending.len() as u64;
        self.pending.clear();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    use super::*;

    const MS: i64 = 1_000_000;

    fn link(stamp_ms: i64, parent: &str, child: &str, x: f64, turn: f64) -> FrameTransform {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let pose = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation);
        FrameTransform {
            stamp_ns: stamp_ms * MS,
            parent: parent.into(),
            child: child.into(),
            pose,
        }
    }

    fn poses(
        tool: &mut MovingFrame,
        frames: &mut FrameBuffer,
        transforms: &[FrameTransform],
    ) -> Vec<(i64, Isometry3<f64>)> {
        assert_eq!(tool.push(frames, transforms, false), 0);
        std::iter::from_fn(|| tool.next_pose(frames))
            .map(|pose| (pose.stamp_ns / MS, pose.pose_ot))
            .collect()
    }

    /// base → arm turns by a quarter in 100 ms at 10 Hz, arm → tool moves along x by 1 m in that
    /// time at 50 Hz.
    #[test]
    fn a_slow_link_is_interpolated_at_the_stamps_of_a_fast_one_by_hand() {
        let (mut frames, mut tool) = (FrameBuffer::default(), MovingFrame::new("tool0", "/base"));
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(poses(&mut tool, &mut frames, &[link(0, "base", "arm", 0.0, 0.0)]).is_empty());
        assert!(
            tool.missing(&frames)
                .unwrap()
                .contains("\"tool0\" is not known")
        );
        for at in 0..=5 {
            let found = poses(
                &mut tool,
                &mut frames,
                &[link(20 * at, "arm", "tool0", 1.0 + 0.2 * at as f64, 0.0)],
            );
            assert_eq!(
                found.len(),
                usize::from(at == 0),
                "the arm is known at 0 alone"
            );
        }
        let found = poses(
            &mut tool,
            &mut frames,
            &[link(100, "base", "arm", 0.0, quarter)],
        );
        assert_eq!(
            found.iter().map(|(stamp, _)| *stamp).collect::<Vec<_>>(),
            [20, 40, 60, 80, 100]
        );
        for (stamp, pose) in found {
            let (part, turned) = (stamp as f64 / 100.0, stamp as f64 / 100.0 * quarter);
            let expected = (1.0 + part) * Vector3::new(turned.cos(), turned.sin(), 0.0);
            assert!(
                (pose.translation.vector - expected).norm() < 1e-12,
                "{stamp}"
            );
            assert!((pose.rotation.angle() - turned).abs() < 1e-12);
        }
        assert_eq!(tool.missing(&frames), None);
        // the first and the last pose have their own transforms
        assert_eq!((tool.interpolated, tool.take_apart()), (4, 0));
    }

    #[test]
    fn at_equal_stamps_nothing_is_interpolated_and_what_repeats_gives_nothing() {
        let (mut frames, mut tool) = (FrameBuffer::default(), MovingFrame::new("tool0", "base"));
        let both = [
            link(5, "base", "arm", 1.0, 0.0),
            link(5, "arm", "tool0", 1.0, 0.0),
        ];
        assert!(poses(&mut tool, &mut frames, &both[..1]).is_empty());
        let found = poses(&mut tool, &mut frames, &both[1..]);
        assert_eq!(found, [(5, both[0].pose * both[1].pose)]);
        assert!(poses(&mut tool, &mut frames, &both).is_empty());
        assert!(
            poses(
                &mut tool,
                &mut frames,
                &[link(7, "arm", "camera", 1.0, 0.0)]
            )
            .is_empty()
        );
        assert_eq!((tool.interpolated, tool.take_apart()), (0, 0));
    }

    #[test]
    fn nothing_is_taken_beyond_the_ends_of_a_link_or_over_a_gap() {
        let (mut frames, mut tool) = (FrameBuffer::default(), MovingFrame::new("tool0", "base"));
        let arm = |ms| [link(ms, "base", "arm", 1.0, 0.0)];
        let hand = |ms| [link(ms, "arm", "tool0", 1.0, 0.0)];
        let at = |found: Vec<(i64, _)>| found.iter().map(|(stamp, _)| *stamp).collect::<Vec<_>>();
        // nothing before the first transform of the arm
        assert!(poses(&mut tool, &mut frames, &hand(0)).is_empty());
        assert!(poses(&mut tool, &mut frames, &arm(60)).is_empty());
        for (ms, expected) in [
            (50, vec![]),
            (100, vec![60]),
            (150, vec![]),
            (200, vec![]),
            (250, vec![]),
        ] {
            assert_eq!(
                at(poses(&mut tool, &mut frames, &hand(ms))),
                expected,
                "{ms}"
            );
        }
        assert_eq!((tool.outside, tool.take_apart()), (2, 0));
        // 60 to 190 exceeds the longest gap, and 100 and 150 lie in between
        assert_eq!(at(poses(&mut tool, &mut frames, &arm(190))), [190]);
        assert_eq!(tool.take_apart(), 2);
        assert_eq!(at(poses(&mut tool, &mut frames, &arm(240))), [200, 240]);
        tool.finish();
        // 250 is after the last transform of the arm
        assert_eq!((tool.outside, tool.take_apart()), (3, 0));
    }

    #[test]
    fn a_clock_that_was_set_back_begins_anew_and_what_never_comes_takes_no_memory() {
        let (mut frames, mut tool) = (FrameBuffer::default(), MovingFrame::new("tool0", "base"));
        assert_eq!(
            poses(
                &mut tool,
                &mut frames,
                &[link(60_000, "base", "tool0", 1.0, 0.0)]
            )
            .len(),
            1
        );
        assert_eq!(
            poses(
                &mut tool,
                &mut frames,
                &[link(10, "base", "tool0", 2.0, 0.0)]
            )[0]
            .0,
            10
        );
        assert_eq!(
            poses(
                &mut tool,
                &mut frames,
                &[link(5, "base", "tool0", 2.0, 0.0)]
            )
            .len(),
            0
        );
        assert_eq!(tool.take_apart(), 1, "it is older than the last");
        let mut tool = MovingFrame::new("tool0", "base");
        let mut frames = FrameBuffer::default();
        poses(&mut tool, &mut frames, &[link(0, "base", "arm", 1.0, 0.0)]);
        for ms in 1..=MOST_PENDING as i64 + 5 {
            poses(
                &mut tool,
                &mut frames,
                &[link(ms, "arm", "tool0", 1.0, 0.0)],
            );
        }
        assert_eq!(
            (tool.pending.len(), tool.outside, tool.take_apart()),
            (MOST_PENDING, 5, 0)
        );
    }
}
