//! Files that grow while an arm probes: touches and samples.
//!
//! A written touch always has all its samples written, however the program ends.

use std::path::{Path, PathBuf};

use crate::cli::{CliError, not_written};
use touchup_io::probed_touches_file::TouchLog;
use touchup_io::recording::{SegmentedWriter, Topics};
use touchup_io::recording::{append_known_surfaces, known_surfaces_beside};
use touchup_io::text_file::write_text;
use touchup_method::reconstruct::KnownSurface;
use touchup_method::stylus::Message;
use touchup_probing::arm::ArmState;
use touchup_probing::execute::ProbedTouch;

/// File of the touches, a line each.
pub(super) const TOUCHES: &str = "probed_touches.jsonl";
/// Folder of the poses and wrenches.
pub(super) const RECORDING: &str = "recording";
/// Frame of the poses in the recording: the base of the arm.
const BASE_FRAME: &str = "base";
/// Frame of the wrenches: the probe's own.
const PROBE_FRAME: &str = "probe";
/// Maximum age of unwritten samples between two touches, ns of the arm's clock.
const FLUSH_EVERY_NS: i64 = 1_000_000_000;
/// Pause after the last sample of an arm with a restarted clock, ns.
const PAUSE_NS: i64 = 1_000_000_000;

/// Topics of the recording.
pub(super) fn probe_topics() -> Topics {
    Topics {
        pose: "/probe/pose".to_owned(),
        wrench: "/probe/wrench".to_owned(),
        markers: None,
    }
}

/// Open files of a probing.
pub(super) struct ProbeFiles {
    touches: TouchLog,
    /// Path of the known surfaces.
    known: PathBuf,
    recording: SegmentedWriter,
    /// Offset from the arm's clock to the recording's, ns; `None` before the first state.
    offset_ns: Option<i64>,
    /// Stamp of the last sample, ns.
    last_ns: Option<i64>,
    /// Stamp of the last flushed sample, ns.
    flushed_ns: i64,
}

impl ProbeFiles {
    /// Begins the files of a folder, in place of older ones.
    ///
    /// - `ball_radius`: m.
    pub fn begin(out: &Path, ball_radius: f64) -> Result<Self, CliError> {
        let recording = SegmentedWriter::replace(&out.join(RECORDING), &probe_topics())
            .map_err(CliError::not_written)?;
        let path = out.join(TOUCHES);
        let touches = TouchLog::create(&path, ball_radius).map_err(not_written(&path))?;
        let known = known_surfaces_beside(&out.join(RECORDING));
        write_text(&known, "").map_err(CliError::not_written)?;
        Ok(Self {
            touches,
            known,
            recording,
            offset_ns: None,
            last_ns: None,
            flushed_ns: i64::MIN,
        })
    }

    /// Continues the files of a folder.
    ///
    /// - `each`: receives the existing samples.
    pub fn resume(
        out: &Path,
        ball_radius: f64,
        each: &mut dyn FnMut(&Message),
    ) -> Result<Self, CliError> {
        let mut last_ns = None;
        let frames = [BASE_FRAME, PROBE_FRAME];
        let recording = SegmentedWriter::resume(
            &out.join(RECORDING),
            &probe_topics(),
            frames,
            &mut |message| {
                last_ns = last_ns.max(Some(message.stamp_ns()));
                each(message);
            },
        )?;
        let path = out.join(TOUCHES);
        let touches = TouchLog::resume(&path, ball_radius).map_err(not_written(&path))?;
        Ok(Self {
            touches,
            known: known_surfaces_beside(&out.join(RECORDING)),
            recording,
            offset_ns: None,
            last_ns,
            flushed_ns: i64::MIN,
        })
    }

    /// Writes a state as messages of a probe: the tip's pose in the base of the arm, as the scene
    /// has the part's pose, and the wrench in the axes of the probe, as from its sensor. `None` for
    /// a state not later than the last.
    pub fn record(&mut self, state: &ArmState) -> Result<Option<[Message; 2]>, CliError> {
        let last_ns = self.last_ns;
        let offset_ns = *self.offset_ns.get_or_insert(match last_ns {
            Some(last) if state.stamp_ns <= last => last + PAUSE_NS - state.stamp_ns,
            _ => 0,
        });
        let stamp_ns = state.stamp_ns + offset_ns;
        if last_ns.is_some_and(|last| last >= stamp_ns) {
            return Ok(None);
        }
        self.last_ns = Some(stamp_ns);
        let (pose, wrench) = state.as_probe(stamp_ns);
        let (pose, wrench) = (Message::Pose(pose), Message::Wrench(wrench));
        for (message, frame) in [(&pose, BASE_FRAME), (&wrench, PROBE_FRAME)] {
            let written = self.recording.write(message, frame);
            written.map_err(CliError::not_written)?;
        }
        if stamp_ns.saturating_sub(self.flushed_ns) > FLUSH_EVERY_NS {
            self.recording.flush().map_err(CliError::not_written)?;
            self.flushed_ns = stamp_ns;
        }
        Ok(Some([pose, wrench]))
    }

    /// Writes a touch, after all its samples.
    pub fn touched(&mut self, flag: u32, touch: &ProbedTouch) -> Result<(), CliError> {
        self.recording.sync().map_err(CliError::not_written)?;
        let written = self
            .touches
            .append(flag, touch, self.offset_ns.unwrap_or(0));
        written.map_err(not_written(self.touches.path()))
    }

    /// Writes the surfaces of a feature; returns them as a reader of the file has them.
    pub fn know(&mut self, surfaces: &[KnownSurface]) -> Result<Vec<KnownSurface>, CliError> {
        let radius = self.touches.ball_radius();
        append_known_surfaces(&self.known, surfaces, radius).map_err(not_written(&self.known))
    }

    /// Ends the recording; returns the number of written touches.
    pub fn finish(self) -> Result<usize, CliError> {
        self.recording.finish().map_err(CliError::not_written)?;
        Ok(self.touches.count())
    }
}
