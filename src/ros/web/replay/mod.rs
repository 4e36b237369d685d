//! A session that was recorded, touched again before the eyes of who looks: a node of its own,
//! without a network, takes its messages as they came, and pages see it as they see the one that
//! runs.
//!
//! Pages of one session share its replay, which goes with the last of them. Its threads yield to
//! those of the node that runs.

mod control;
mod follow;
mod player;
mod progress;
mod recording;
mod replays;
mod shown;

pub(super) use self::control::ReplayControl;
pub(super) use self::follow::serve;
pub(super) use self::replays::Replays;
