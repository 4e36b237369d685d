//! `probed_touches.jsonl`: a full record of each touch of an arm, a line of JSON each.
//!
//! Each line is on the disk before the arm makes the next touch, so a killed program loses
//! none. An incomplete line after a crash is no touch.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::file_error::{MAX_FILE_BYTES, read_up_to};
use touchup_probing::arm::{Onset, TouchMoment, TouchOutcome};
use touchup_probing::execute::{FlagResult, ProbedTouch};

reported! {
    /// One line; lengths in mm of O, travel along the approach.
    #[derive(Deserialize)]
    pub struct TouchLine, pub fn of(feature: u32, number: usize, touch: &ProbedTouch, ball_radius: f64, offset_ns: i64) {
        /// number of the feature
        pub flag: u32 = feature,
        /// among the touches of the feature, from 0 on
        pub index: usize = number,
        /// by the clock of the recording
        pub begun_ns?: i64 = touch.record.as_ref().map(|record| record.stamps_ns[0] + offset_ns),
        /// by the clock of the recording
        pub ended_ns?: i64 = touch.record.as_ref().map(|record| record.stamps_ns[1] + offset_ns),
        /// `clean`, `slip`, `edge`, `bounce`, `impact`, `miss`, `unclear`, or `held_back` for a
        /// touch not made
        pub verdict: String = verdict(touch).to_owned(),
        /// whether it contributes to the feature
        pub accepted: bool = touch.refused.is_none(),
        /// reason for rejection
        pub reason?: String = touch.refused.clone(),
        /// centre of the ball at the start of the search
        pub from_mm: [f64; 3] = (touch.planned.from * 1e3).coords.into(),
        /// direction of the search, unit vector
        pub approach: [f64; 3] = touch.planned.direction.into_inner().into(),
        /// longest search
        pub search_mm: f64 = touch.planned.search * 1e3,
        /// of the ball at contact
        pub centre_mm?: [f64; 3] = touch.centre.map(|centre| (centre * 1e3).coords.into()),
        /// its standard uncertainty along the approach
        pub sigma_mm?: f64 = onset(touch).map(|onset| onset.sigma * 1e3),
        /// of the contact from the mesh before the touch, positive outside
        pub deviation_mm?: f64 = touch.deviation.map(|deviation| deviation * 1e3),
        /// of the measuring search
        pub speed_mm_per_s?: f64 = touch.record.as_ref().map(|record| record.speed * 1e3),
        /// of the ball
        pub tip_radius_mm: f64 = ball_radius * 1e3,
        /// of the whole touch
        pub largest_force_n?: f64 = touch.record.as_ref().map(|record| record.peak_force),
        /// seconds, travel in mm, force against the approach and across it in N; approach and
        /// retreat
        pub curve: Vec<[f64; 4]> = touch.record.iter().flat_map(|record| &record.curve).map(moment).collect(),
    }
}

impl fmt::Display for TouchLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            index,
            verdict,
            centre_mm,
            sigma_mm,
            reason,
            ..
        } = self;
        write!(f, "touch {index}: {verdict}")?;
        if let (Some([x, y, z]), Some(sigma)) = (centre_mm, sigma_mm) {
            write!(f, ", centre at ({x:.3} {y:.3} {z:.3}) ± {sigma:.3} mm")?;
        }
        reason
            .iter()
            .try_for_each(|reason| write!(f, ", does not count: {reason}"))
    }
}

fn moment(moment: &TouchMoment) -> [f64; 4] {
    [moment.t, moment.travel * 1e3, moment.force, moment.lateral]
}

fn onset(touch: &ProbedTouch) -> Option<&Onset> {
    if let TouchOutcome::Contact { onset, .. } = &touch.record.as_ref()?.outcome {
        Some(onset)
    } else {
        None
    }
}

fn verdict(touch: &ProbedTouch) -> &'static str {
    match touch.record.as_ref().map(|record| &record.outcome) {
        Some(TouchOutcome::Contact { onset, .. }) => onset.verdict.name(),
        Some(TouchOutcome::Miss { .. }) => "miss",
        Some(TouchOutcome::Unclear(_)) => "unclear",
        None => "held_back",
    }
}

/// The touch file of a probing arm, one line per touch.
#[derive(Debug)]
pub struct TouchLog {
    path: PathBuf,
    file: File,
    /// m
    ball_radius: f64,
    /// touches of each feature up to now
    counts: BTreeMap<u32, usize>,
}

impl TouchLog {
    /// Begins a file, in place of an older one.
    ///
    /// - `ball_radius`: of the tip, m.
    ///
    /// # Errors
    /// Any error of the file.
    pub fn create(path: &Path, ball_radius: f64) -> io::Result<Self> {
        Ok(Self {
            path: path.to_owned(),
            file: File::create(path)?,
            ball_radius,
            counts: BTreeMap::new(),
        })
    }

    /// Continues the touches of a file and their count; removes an incomplete line after a crash.
    ///
    /// - `ball_radius`: of the tip, m.
    ///
    /// # Errors
    /// Any error of the file, also for a whole line that is no touch.
    pub fn resume(path: &Path, ball_radius: f64) -> io::Result<Self> {
        let text = read_up_to(path, MAX_FILE_BYTES)?;
        let whole = whole_lines(&text);
        let mut counts = BTreeMap::new();
        for touch in touches_of(whole)? {
            *counts.entry(touch.flag).or_default() += 1;
        }
        let file = OpenOptions::new().append(true).open(path)?;
        file.set_len(whole.len() as u64)?;
        Ok(Self {
            path: path.to_owned(),
            file,
            ball_radius,
            counts,
        })
    }

    /// Appends a touch, which is on the disk when this returns.
    ///
    /// - `offset_ns`: from the arm's clock to that of the recording, ns.
    ///
    /// # Errors
    /// Any error of the file.
    pub fn append(&mut self, flag: u32, touch: &ProbedTouch, offset_ns: i64) -> io::Result<()> {
        let count = self.counts.entry(flag).or_default();
        let mut line = Vec::new();
        write_line(
            &TouchLine::of(flag, *count, touch, self.ball_radius, offset_ns),
            &mut line,
        )?;
        *count += 1;
        self.file.write_all(&line)?;
        self.file.sync_data()
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Radius of the tip, m.
    pub fn ball_radius(&self) -> f64 {
        self.ball_radius
    }

    /// Number of touches in it.
    pub fn count(&self) -> usize {
        self.counts.values().sum()
    }
}

/// All touches of a file, in their order; none without a file.
///
/// # Errors
/// Any error of the file, also for a whole line that is no touch.
pub fn read_probed_touches(path: &Path) -> io::Result<Vec<TouchLine>> {
    match read_up_to(path, MAX_FILE_BYTES) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        text => touches_of(whole_lines(&text?)),
    }
}

fn touches_of(lines: &[u8]) -> io::Result<Vec<TouchLine>> {
    serde_json::Deserializer::from_slice(lines)
        .into_iter()
        .map(|line| Ok(line?))
        .collect()
}

/// The text without an incomplete last line.
pub(crate) fn whole_lines(text: &[u8]) -> &[u8] {
    let end = text
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |at| at + 1);
    &text[..end]
}

/// Appends the touches of one more feature.
///
/// - `offset_ns`: from the arm's clock to that of the file, ns.
///
/// # Errors
/// Any error of the file.
pub fn append_probed_touches(
    probed: &FlagResult,
    ball_radius: f64,
    offset_ns: i64,
    path: &Path,
) -> io::Result<()> {
    let mut lines = Vec::new();
    for (index, touch) in probed.touches.iter().enumerate() {
        write_line(
            &TouchLine::of(probed.flag, index, touch, ball_radius, offset_ns),
            &mut lines,
        )?;
    }
    OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)?
        .write_all(&lines)
}

fn write_line(touch: &TouchLine, out: &mut dyn Write) -> io::Result<()> {
    serde_json::to_writer(&mut *out, touch)?;
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};
    use touchup_probing::plan::TouchPlan;

    use super::*;

    fn refused(reason: &str) -> ProbedTouch {
        let (entry, from) = (Point3::origin(), Point3::new(1e-3, 2e-3, 3e-3));
        let planned = TouchPlan {
            entry,
            from,
            direction: Vector3::z_axis(),
            search: 4e-3,
            expected: None,
        };
        ProbedTouch {
            planned,
            record: None,
            centre: None,
            deviation: None,
            refused: Some(reason.to_owned()),
        }
    }

    fn read(path: &Path) -> Vec<(u32, usize, Option<String>)> {
        let touches = read_probed_touches(path).unwrap();
        touches
            .into_iter()
            .map(|touch| (touch.flag, touch.index, touch.reason))
            .collect()
    }

    #[test]
    fn a_crash_in_mid_line_loses_that_line_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touches.jsonl");
        let mut log = TouchLog::create(&path, 1.5e-3).unwrap();
        log.append(1, &refused("a"), 0).unwrap();
        log.append(2, &refused("b"), 0).unwrap();
        drop(log);
        let whole = std::fs::read(&path).unwrap();
        let line = whole.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        let [first, second] = ["a", "b"].map(|reason| Some(reason.to_owned()));
        for cut in line..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            assert_eq!(read(&path), [(1, 0, first.clone())], "cut at {cut}");
        }
        let mut log = TouchLog::resume(&path, 1.5e-3).unwrap();
        assert_eq!(log.count(), 1);
        log.append(2, &refused("b"), 0).unwrap();
        log.append(1, &refused("b"), 0).unwrap();
        assert_eq!(
            read(&path),
            [(1, 0, first), (2, 0, second.clone()), (1, 1, second)]
        );
        assert_eq!(std::fs::read(&path).unwrap()[..whole.len()], whole);
    }
}
