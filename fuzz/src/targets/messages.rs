//! Messages in CDR: all types of poses and wrenches, transforms and clouds of markers, in a
//! recording around them that is sound.

use crate::seeds::{MARKERS, TOPICS, mcap_of};
use crate::{file, read_all};
use touchup_io::recording::{RecordingLayout, Topics, TransformFrames};

/// A message begins with its topic, and its length in four bytes.
const HEAD: usize = 5;

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let (mut messages, mut rest) = (Vec::new(), data);
    while let Some((head, after)) = rest.split_at_checked(HEAD) {
        let length = u32::from_le_bytes([head[1], head[2], head[3], head[4]]) as usize;
        let (payload, next) = after.split_at(length.min(after.len()));
        messages.push((u16::from(head[0]) % TOPICS.len() as u16, payload));
        rest = next;
    }
    let path = file("messages.mcap", &mcap_of(&messages));
    read_all(&path, &Topics::default());
    read_all(
        &path,
        &Topics {
            markers: Some(MARKERS.into()),
            ..Topics::default()
        },
    );
    for (pose, wrench) in [
        ("/odometry", "/bare_wrench"),
        ("/covariance", "/stylus/wrench"),
        ("/transform", "/bare_wrench"),
        ("/state", "/state"),
    ]
    .into_iter()
    .chain([
        ("/bare_pose", "/bare_wrench"),
        ("/iiwa_pose", "/bare_wrench"),
    ]) {
        read_all(
            &path,
            &Topics {
                pose: pose.into(),
                wrench: wrench.into(),
                markers: None,
            },
        );
    }
    let topics = Topics {
        pose: "/tf".into(),
        ..Topics::default()
    };
    for base in [None, Some("base".to_owned())] {
        let frames = Some(TransformFrames {
            moving: "tool0".into(),
            base,
        });
        read_all(
            &path,
            RecordingLayout {
                topics: topics.clone(),
                frames,
                ..RecordingLayout::default()
            },
        );
    }
}
