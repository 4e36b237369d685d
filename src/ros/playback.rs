//! What it takes to play a recording, of whatever: when each message is due, and the frames that
//! headers name.

use super::node::CELL;
use crate::stylus::WrenchFrame;

/// A pause in the recording is shortened to this, ns.
const LONGEST_REST_NS: i64 = 2_000_000_000;

/// Time along a recording by its stamps, without its long pauses.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlayedTime {
    passed_ns: i64,
    last_ns: Option<i64>,
}

impl PlayedTime {
    /// Time since the first message at which this one is due, ns. One whose stamp goes back is due
    /// at once.
    pub fn at_ns(&mut self, stamp_ns: i64) -> i64 {
        let last_ns = *self.last_ns.get_or_insert(stamp_ns);
        let step_ns = stamp_ns.saturating_sub(last_ns);
        if step_ns > 0 {
            self.passed_ns = self.passed_ns.saturating_add(step_ns.min(LONGEST_REST_NS));
        }
        // a clock that was set back goes on from there
        if !(-LONGEST_REST_NS..=0).contains(&step_ns) {
            self.last_ns = Some(stamp_ns);
        }
        self.passed_ns
    }
}

/// Frame of the headers of wrenches in these axes.
///
/// - `source`: who touches, `stylus` or `probe`: its sensor gives the wrenches their frame.
pub fn wrench_frame_id(axes: WrenchFrame, source: &str) -> String {
    match axes {
        WrenchFrame::Object => CELL.to_owned(),
        WrenchFrame::Sensor => format!("{source}_sensor"),
    }
}
