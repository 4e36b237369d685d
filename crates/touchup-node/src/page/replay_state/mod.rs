//! State of a replay, as its pages see and change it.

mod control;
mod progress;
mod shown;

pub(super) use self::control::ReplayControl;
pub(super) use self::progress::ReplayNext;
pub(super) use self::shown::ReplayShown;
