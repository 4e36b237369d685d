//! Messages between pages and a replay.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Multiples of the recorded speed.
const SPEEDS: RangeInclusive<f64> = 0.1..=100.0;

/// The topic `replay`. Times are along the recording without its long pauses, s.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(in crate::page) struct ReplayShown {
    /// name of the session
    pub session: String,
    /// scan and recording are read: it plays, or waits
    pub is_ready: bool,
    pub speed: f64,
    pub is_paused: bool,
    pub at_s: f64,
    pub end_s: f64,
    /// target of a jump, as fast as possible; `None`: it plays
    pub target_s: Option<f64>,
    /// all messages have come
    pub is_at_end: bool,
    /// position of damage, at which the recording ends
    pub damage: Option<String>,
    /// reason of a stop
    pub error: Option<String>,
}

impl ReplayShown {
    /// A refused replay.
    pub fn refused(session: &str, why: String) -> Self {
        Self {
            session: session.to_owned(),
            error: Some(why),
            ..Self::default()
        }
    }
}

/// The request of `~/replay`; a missing field keeps its value.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::page) struct ReplayRequest {
    pub speed: Option<f64>,
    pub is_paused: Option<bool>,
    pub at_s: Option<f64>,
}

impl ReplayRequest {
    /// Parses a request.
    ///
    /// # Errors
    /// In words: an invalid value.
    pub fn read(request: Value) -> Result<Self, String> {
        let request: Self =
            serde_json::from_value(request).map_err(|error| format!("~/replay: {error}"))?;
        if let Some(speed) = request.speed.filter(|speed| !SPEEDS.contains(speed)) {
            return Err(format!(
                "speed is {speed}: it may be {} to {}",
                SPEEDS.start(),
                SPEEDS.end()
            ));
        }
        if let Some(at_s) = request.at_s.filter(|at_s| *at_s < 0.0) {
            return Err(format!("at_s is {at_s}: it may be 0 or more"));
        }
        Ok(request)
    }
}
