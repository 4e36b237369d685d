//! Replay of a recorded session: a node of its own, without a network, gets the recorded messages
//! at their times, and pages show it like the running node.
//!
//! Pages of one session share its replay, which ends with the last of them. Its threads yield to
//! those of the running node.

mod follow;
mod player;
mod recording;
mod replays;

pub(super) use self::follow::serve;
pub(super) use self::replays::Replays;
