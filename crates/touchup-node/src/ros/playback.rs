//! Playback of any recording: due times of messages, and the frames of their headers.

use crate::ros::parameters::CELL_FRAME;
use touchup_method::stylus::WrenchFrame;

/// Maximum played duration of a pause in the recording, ns.
const LONGEST_REST_NS: i64 = 2_000_000_000;

/// Time along a recording by its stamps, without its long pauses.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlayedTime {
    passed_ns: i64,
    last_ns: Option<i64>,
}

impl PlayedTime {
    /// Due time of a message since the first, ns. A message whose stamp goes back is due at once.
    pub fn at_ns(&mut self, stamp_ns: i64) -> i64 {
        let last_ns = *self.last_ns.get_or_insert(stamp_ns);
        let step_ns = stamp_ns.saturating_sub(last_ns);
        if step_ns > 0 {
            self.passed_ns = self.passed_ns.saturating_add(step_ns.min(LONGEST_REST_NS));
        }
        // time continues from a clock that went back
        if !(-LONGEST_REST_NS..=0).contains(&step_ns) {
            self.last_ns = Some(stamp_ns);
        }
        self.passed_ns
    }
}

/// Frame of the headers of wrenches in these axes.
///
/// - `source`: `stylus` or `probe`, whose sensor names the frame of the wrenches.
pub fn wrench_frame_id(axes: WrenchFrame, source: &str) -> String {
    match axes {
        WrenchFrame::Object => CELL_FRAME.to_owned(),
        WrenchFrame::Sensor => format!("{source}_sensor"),
    }
}
